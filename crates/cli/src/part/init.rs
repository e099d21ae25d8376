//! Files to start from: commented configurations, and those for a part of one's own.

mod benchmark;
mod doubts;
mod places;
mod pose;
mod propose;
mod seen;
mod text;
mod trial;

pub use benchmark::{BenchmarkStarter, benchmark_starter};
use gripgen::Location;
use gripgen::assets;
use gripgen::{BASELINE_TWIN, load_twin_document};
use gripgen::{Library, LibraryError};
use gripgen_physics::{PartShape, Surface};
use gripgen_report::{View, grips_picture};
use gripgen_tactile::{ClusteredMesh, Grid, raster};
pub use gripgen_twin::Proposal;
use gripgen_twin::frames::Pose;
use gripgen_twin::{Jaw, MeshError, Part, TriMesh, Twin};
pub(crate) use propose::Proposed;
use propose::Search;
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
pub use trial::Varied;
pub(crate) use trial::{ANGLES_DEG, HIGHEST_N, Trial, TrialCell};

/// Friction and imprint constant of a part of which nothing is known; `twin.toml` says so.
pub(crate) const MU: f64 = 0.15;
const IMPRINT_MM3_PER_N: f64 = 1.5;

/// Name of the part while grips are looked for.
pub(crate) const PART: &str = "part";

/// The smallest of the largest forces that a grip is tried with.
const LEAST_FORCE_N: f64 = 10.0;

/// A part smaller or larger than this is asked about its unit.
const SMALL_MM: f64 = 8.0;
const LARGE_MM: f64 = 2000.0;

/// A file that `init` writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StarterFile {
    /// Its name in the folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Files for some parts, and what to tell about them.
#[derive(Debug, Clone, PartialEq)]
pub struct PartStarter {
    /// The files.
    pub files: Vec<StarterFile>,
    /// The parts, in the order of their meshes.
    pub parts: Vec<PartGrips>,
    /// What the sweep varies beside the grip: what all grips of all parts stand.
    pub varied: Varied,
    /// Sizes of the parts and the grips found, a line each.
    pub summary: String,
}

/// The grips that are proposed for a part.
#[derive(Debug, Clone, PartialEq)]
pub struct PartGrips {
    /// Its name in the twin.
    pub name: String,
    /// The best first.
    pub grips: Vec<Proposal>,
    /// What is doubtful of each, a sentence each.
    pub doubts: Vec<Vec<String>>,
    /// What is to be said of the mesh, a sentence each.
    pub mesh_words: Vec<String>,
}

/// Why a part has no grip.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoGrip {
    /// The jaws do not open far enough.
    #[error(
        "the part is too wide: its narrowest place measures {narrowest_mm:.1} mm, the jaws open to {opening_mm:.0} mm and \
         take {largest_mm:.1} mm"
    )]
    TooWide {
        /// Narrowest place.
        narrowest_mm: f64,
        /// Opening of the gripper.
        opening_mm: f64,
        /// Widest grip.
        largest_mm: f64,
    },
    /// No surfaces face each other.
    #[error(
        "the part is too round or too steep: where a gel rests its surface is inclined by {least_deg:.1} degrees or more, \
         friction holds up to {allowed_deg:.1} degrees"
    )]
    TooSteep {
        /// Smallest inclination found.
        least_deg: f64,
        /// Largest inclination that is proposed.
        allowed_deg: f64,
    },
    /// The part presses through the gel.
    #[error(
        "the part is too small or too pointed, it presses through the gel: {force_n:.0} N need an imprint of {wanted_mm3:.1} \
         mm3, the best place has {available_mm3:.1} mm3 before the gel is pressed through"
    )]
    TooDeep {
        /// Smallest force tried.
        force_n: f64,
        /// Volume that it needs.
        wanted_mm3: f64,
        /// Largest volume found.
        available_mm3: f64,
    },
    /// Something of the part is always in a jaw's way.
    #[error(
        "the part reaches beyond the open jaws at each of {places} places: they open to {opening_mm:.0} mm, half of it on \
         either side"
    )]
    Beyond {
        /// Places looked at.
        places: usize,
        /// Opening of the gripper.
        opening_mm: f64,
    },
    /// Grips that look good fail when they are tried.
    #[error(
        "none of {tried} grips works when it is tried as a sweep does, from {LEAST_FORCE_N:.0} N on: {failure}"
    )]
    AllFail {
        /// Grips tried.
        tried: usize,
        /// Why the first failed.
        failure: String,
    },
}

impl NoGrip {
    /// What to do about it, of a part whose size is right.
    fn hint(&self) -> &'static str {
        match self {
            NoGrip::TooWide { .. } | NoGrip::Beyond { .. } => {
                "grips are looked for with the shipped gripper; for a wider one set gripper.opening_mm in a twin of your own \
                 (`gripgen init FOLDER`) and write the grips into it"
            }
            _ => {
                "write a grip that you know to hold into a twin of your own: `gripgen init FOLDER`, [[parts.NAME.grips]]"
            }
        }
    }
}

/// Why there is nothing to start from.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum InitError {
    /// The mesh.
    #[error(transparent)]
    Mesh(#[from] LibraryError),
    /// The mesh file.
    #[error(transparent)]
    Read(#[from] gripgen::ReadFileError),
    /// The mesh encloses no volume.
    #[error(
        "{path}: the mesh is open: {open_edges} edges belong to one triangle only, gels would sink into its holes"
    )]
    Open {
        /// The mesh file.
        path: String,
        /// Edges of one triangle only.
        open_edges: usize,
    },
    /// Two meshes would make one part.
    #[error("{first} and {second} would both be the part `{name}`")]
    OneName {
        /// Name of the part.
        name: String,
        /// One mesh.
        first: String,
        /// The other.
        second: String,
    },
    /// No grip works.
    #[error("{path}: no grip found on {x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm: {source}")]
    NoGrip {
        /// The mesh file.
        path: String,
        /// Size along x.
        x_mm: f64,
        /// Size along y.
        y_mm: f64,
        /// Size along z.
        z_mm: f64,
        /// Why.
        source: NoGrip,
    },
}

impl InitError {
    /// What to do about it, of a mesh that was read at `scale_mm_per_unit`.
    pub fn hint(&self, scale_mm_per_unit: f64) -> String {
        let sizes_mm = match self {
            InitError::Mesh(LibraryError::Mesh {
                source: MeshError::Extent { x_mm, y_mm, z_mm }, ..
            })
            | InitError::NoGrip { x_mm, y_mm, z_mm, .. } => [*x_mm, *y_mm, *z_mm],
            InitError::Open { .. } => {
                return "close its holes (Meshlab, Blender), or go on with --accept-open-mesh".into();
            }
            InitError::OneName { .. } => {
                return "rename one of the files: its name is that of the part".into();
            }
            InitError::Read(_) => return "a path is relative to where you are".into(),
            InitError::Mesh(LibraryError::Mesh { source, .. }) => return source.hint().into(),
            _ => return "export the part as STL, OBJ, PLY or GLB".into(),
        };
        if let Some(guess) = unit_guess(sizes_mm, scale_mm_per_unit) {
            return guess;
        }
        match self {
            // Its size is that of a part: the unit is right.
            InitError::NoGrip { source, .. } => source.hint().into(),
            _ => "--scale-mm-per-unit 1000 reads a file in metres, 25.4 one in inches".into(),
        }
    }
}

/// What the file's unit may be, of a part whose size is not that of a part when it is read at `scale_mm_per_unit`.
fn unit_guess(sizes_mm: [f64; 3], scale_mm_per_unit: f64) -> Option<String> {
    let largest_mm = sizes_mm.iter().fold(0.0_f64, |a, &b| a.max(b));
    if (SMALL_MM..=LARGE_MM).contains(&largest_mm) {
        return None;
    }
    let units = largest_mm / scale_mm_per_unit;
    let (unit, scale) = match units {
        x if x < 0.5 => ("metres", 1000.0),
        x if x < SMALL_MM => ("inches", 25.4),
        x if x > LARGE_MM => ("micrometres", 1e-3),
        _ => ("millimetres", 1.0),
    };
    let as_mm = units * scale;
    (scale != scale_mm_per_unit)
        .then(|| format!("in {unit} the largest side would be {as_mm:.1} mm: --scale-mm-per-unit {scale}"))
}

/// A commented sweep and twin.
pub fn starter() -> Vec<StarterFile> {
    ["sweep.toml", "twin.toml"]
        .map(|name| StarterFile {
            name: name.into(),
            bytes: assets::text(&format!("templates/{name}")).as_bytes().to_vec(),
        })
        .to_vec()
}

/// What `part_starter` is told beside the mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PartOptions {
    /// Millimetres per unit of the mesh file.
    pub scale_mm_per_unit: f64,
    /// Whether an open mesh is taken as it is.
    pub accept_open_mesh: bool,
    /// Friction coefficient of the part, if it was measured: twin and sweep are written with it. Grips are looked for without it.
    pub mu: Option<f64>,
    /// Threads to try grips with; the result does not depend on them.
    pub threads: usize,
}

/// A mesh that was read, looked at and searched for grips.
pub(crate) struct Searched {
    /// The file name as a TOML bare key.
    pub(crate) name: String,
    /// Content of the file.
    pub(crate) bytes: Vec<u8>,
    /// The mesh, in metres.
    pub(crate) mesh: TriMesh,
    /// Its extent along its axes.
    pub(crate) size_mm: [f64; 3],
    /// What is to be said of the mesh, a sentence each.
    pub(crate) mesh_words: Vec<String>,
    /// The rig, with a part named `part` that has the grips found.
    pub(crate) twin: Twin,
    /// The files of the twin.
    pub(crate) library: Library,
    /// The grips.
    pub(crate) proposed: Proposed,
}

/// Reads a mesh, looks at it and tries grips on a rig.
pub(crate) fn search(path: &Path, options: PartOptions, twin: Twin) -> Result<Searched, InitError> {
    let location = Location::Disk(path.into());
    let bytes = location.read()?.into_owned();
    let metres_per_unit = options.scale_mm_per_unit * 1e-3;
    let mesh = TriMesh::from_file_bytes(&bytes, location.extension(), metres_per_unit)
        .map_err(|source| LibraryError::Mesh { location: location.clone(), source })?;
    let look = mesh.look();
    if !look.is_closed() && !options.accept_open_mesh {
        return Err(InitError::Open { path: path.display().to_string(), open_edges: look.open_edges });
    }
    // The contact shape is built now, so that a mesh without volume is refused here.
    PartShape::hull(&mesh, &Pose::identity())
        .map_err(|source| LibraryError::Shape { location: location.clone(), source })?;
    let size_mm = mesh.extent_m().map(|s| s * 1e3);
    let part = Part {
        mesh: path.display().to_string(),
        metres_per_unit,
        grips: vec![],
        mu: MU,
        kinetic_ratio: 1.0,
        kinetic_fall_s: 0.0,
        scatter: 0.0,
        imprint_m3_per_n: IMPRINT_MM3_PER_N * 1e-9,
        edge_radius_m: 0.0,
        relief_m: 0.0,
    };
    let mut twin = Twin { parts: BTreeMap::from([(PART.to_string(), part.clone())]), ..twin };
    // Paths are relative to where the program was started.
    let library = Library::of_twin(&twin, &Location::Disk("twin.toml".into()))?;
    for jaw in Jaw::BOTH {
        library.check_sensor(&twin.optics[jaw], &twin.gel[jaw])?;
    }
    // Where lines meet the part, and its middle of mass, are those of faces that look outwards. Contacts and images are the same.
    let (surface, clustered) = if look.faces_outwards() {
        (library.surface(&part)?, library.clustered_mesh(&part)?)
    } else {
        let outwards = mesh.faced_outwards();
        let clustered = Arc::new(ClusteredMesh::new(&outwards));
        (Arc::new(Surface::new(Arc::new(outwards))), clustered)
    };
    let search = Search {
        twin: &twin,
        library: &library,
        surface,
        mesh: clustered,
        part,
        closed: look.is_closed(),
        threads: options.threads,
    };
    let [x_mm, y_mm, z_mm] = size_mm;
    let path_shown = || path.display().to_string();
    let proposed =
        search.run().map_err(|source| InitError::NoGrip { path: path_shown(), x_mm, y_mm, z_mm, source })?;
    let grips = proposed.grips.iter().map(Proposal::part_from_mesh).collect();
    twin.parts.get_mut(PART).expect("it was put there").grips = grips;
    let mut mesh_words = look.words();
    mesh_words.extend(unit_guess(size_mm, options.scale_mm_per_unit).map(|guess| {
        format!("the part measures {x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm; {guess}, if the file is not in mm")
    }));
    Ok(Searched { name: part_name(path), bytes, mesh, size_mm, mesh_words, twin, library, proposed })
}

/// A sweep, a twin with grips that were tried, pictures and copies of the meshes, for mesh files with their options.
///
/// # Errors
///
/// A file that is no mesh, a mesh that is open, a part on which no grip works, or two of one name.
pub fn part_starter(meshes: &[(&Path, PartOptions)], folder: &Path) -> Result<PartStarter, InitError> {
    let (mut files, mut sections, mut parts) = (Vec::new(), Vec::new(), Vec::new());
    for &(path, options) in meshes {
        let Searched { name, bytes, mesh, mesh_words, proposed, size_mm: [x_mm, y_mm, z_mm], .. } =
            search(path, options, baseline())?;
        if let Some(k) = parts.iter().position(|part: &StarterPart| part.name == name) {
            let [first, second] = [meshes[k].0, path].map(|path| path.display().to_string());
            return Err(InitError::OneName { name, first, second });
        }
        let size = format!("{x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm");
        let (mesh_name, copy) = mesh_reference(path, folder);
        sections.push(text::part_section(&name, &mesh_name, &size, options, &proposed.grips));
        let picture = if meshes.len() == 1 { "grips.png".into() } else { format!("{name}-grips.png") };
        let bytes_of_picture = grips_picture(&name, &mesh, &proposed.grips, &rasterise);
        files.push(StarterFile { name: picture, bytes: bytes_of_picture });
        if copy {
            files.push(StarterFile { name: mesh_name, bytes });
        }
        parts.push(StarterPart { name, size, mesh_words, proposed });
    }
    let varied = text::narrowest(parts.iter().map(|part| &part.proposed.varied));
    let poses = parts.iter().map(|part| part.proposed.grips.len()).min().unwrap_or(0);
    let fill = |template: &str| {
        template
            .replace("{{parts_said}}", &text::listed(&parts))
            .replace("{{parts}}", sections.join("\n").trim_end())
            .replace(
                "{{mu_known}}",
                &text::mu_known(meshes.iter().filter_map(|(_, options)| options.mu).next()),
            )
            .replace("{{grip_poses}}", &text::pose_list(poses))
            .replace("{{grip_force_n}}", &text::numbers(&[varied.grip_force_n.0, varied.grip_force_n.1]))
            .replace("{{grip_offset_sd_mm}}", &format!("{:?}", varied.grip_offset_sd_mm))
            .replace("{{grip_angle_deg}}", &text::numbers(&varied.grip_angle_deg))
            .replace("{{narrowed}}", &text::narrowed_comment(&varied, &parts))
            .into_bytes()
    };
    let configs = [("sweep.toml", "templates/part-sweep.toml"), ("twin.toml", "templates/part-twin.toml")];
    let configs =
        configs.map(|(name, from)| StarterFile { name: name.into(), bytes: fill(assets::text(from)) });
    let summary = parts.iter().map(text::summary).collect::<String>() + text::LOOK;
    let files = configs.into_iter().chain(files).collect();
    let parts = parts.into_iter().map(|part| {
        let Proposed { grips, doubts, .. } = part.proposed;
        PartGrips { name: part.name, grips, doubts, mesh_words: part.mesh_words }
    });
    Ok(PartStarter { files, parts: parts.collect(), varied, summary })
}

/// A part that was searched, as texts need it.
struct StarterPart {
    name: String,
    size: String,
    mesh_words: Vec<String>,
    proposed: Proposed,
}

/// Heights of a mesh for a drawing, as those of a part in front of a gel.
pub fn rasterise(mesh: &TriMesh, eye_from_mesh: &Pose, view: &View) -> Vec<f32> {
    let (width_px, height_px) = (view.size_px.0 as usize, view.size_px.1 as usize);
    let grid = Grid { width_px, height_px, metres_per_px: view.metres_per_px };
    raster(mesh, eye_from_mesh, &grid, f64::INFINITY).values
}

/// The rig that grips are proposed for.
pub(crate) fn baseline() -> Twin {
    let document = load_twin_document(&Location::parse(BASELINE_TWIN), &[]);
    let file = document.ok().and_then(|d| d.read_twin().ok());
    file.and_then(|f| Twin::new(&f).ok()).expect("a test loads the baseline twin")
}

/// The file name as a TOML bare key.
fn part_name(path: &Path) -> String {
    let stem = path.file_stem().map_or_else(|| "part".into(), |s| s.to_string_lossy().to_lowercase());
    let name: String = stem.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
    let name = name.trim_matches('_').to_string();
    if name.is_empty() { "part".into() } else { name }
}

/// How the twin in `folder` names the mesh, and whether the file has to be copied there.
fn mesh_reference(path: &Path, folder: &Path) -> (String, bool) {
    let whole = |p: &Path| {
        std::fs::canonicalize(p).or_else(|_| std::path::absolute(p)).unwrap_or_else(|_| p.to_path_buf())
    };
    if let Ok(inside) = whole(path).strip_prefix(whole(folder)) {
        return (inside.to_string_lossy().replace('\\', "/"), false);
    }
    let extension = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    (format!("{}.{extension}", part_name(path)), true)
}

#[cfg(test)]
mod tests {
    use super::unit_guess;

    /// What the hint names is the option for the file, not a factor on what was read.
    #[test]
    fn the_unit_that_is_guessed_is_that_of_the_file() {
        let guess = |largest_mm: f64, scale| unit_guess([0.0, largest_mm, 0.0], scale).unwrap_or_default();
        assert!(
            guess(0.04, 1.0)
                .ends_with("in metres the largest side would be 40.0 mm: --scale-mm-per-unit 1000")
        );
        assert!(guess(40e3, 1.0).ends_with("40.0 mm: --scale-mm-per-unit 0.001"));
        assert!(
            guess(40e3, 1000.0)
                .ends_with("in millimetres the largest side would be 40.0 mm: --scale-mm-per-unit 1")
        );
        assert!(
            guess(2500.0, 1000.0)
                .ends_with("in inches the largest side would be 63.5 mm: --scale-mm-per-unit 25.4")
        );
        assert_eq!(guess(5.5, 1000.0), "", "the unit may be right");
        assert_eq!(guess(40.0, 1.0), "");
    }
}
