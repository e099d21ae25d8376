//! Files to start from: commented configurations, and those for a part of one's own.

mod antipodal;
mod drawing;

use crate::assets;
use crate::library::LibraryError;
use crate::location::Location;
use crate::project::{BASELINE_TWIN, load_twin_document};
pub use antipodal::Proposal;
use antipodal::propose;
use gripgen_physics::PartShape;
use gripgen_twin::{TriMesh, Twin};
use std::fmt::Write as _;
use std::path::Path;

/// A file that `init` writes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct StarterFile {
    /// Its name in the folder.
    pub name: String,
    /// Its content.
    pub bytes: Vec<u8>,
}

/// Files for a part, and what to tell about them.
#[derive(Debug, Clone, PartialEq)]
pub struct PartStarter {
    /// The files.
    pub files: Vec<StarterFile>,
    /// The grips proposed, the best first.
    pub grips: Vec<Proposal>,
    /// Size of the part and the grips found, a line each.
    pub summary: String,
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
    Read(#[from] crate::location::ReadFileError),
    /// No pair of opposite surfaces fits between the jaws.
    #[error(
        "{path}: no grip found: the part measures {x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm, the jaws open to \
         {opening_mm:.0} mm and need two opposite surfaces"
    )]
    NoGrip {
        /// The mesh file.
        path: String,
        /// Size along x.
        x_mm: f64,
        /// Size along y.
        y_mm: f64,
        /// Size along z.
        z_mm: f64,
        /// Opening of the gripper.
        opening_mm: f64,
    },
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

/// A sweep, a twin with proposed grips, and a picture, for the mesh file at `path`.
///
/// # Errors
///
/// A file that is no mesh, or a part on which no grip is found.
pub fn part_starter(path: &Path, folder: &Path, scale_mm_per_unit: f64) -> Result<PartStarter, InitError> {
    let location = Location::Disk(path.into());
    let bytes = location.read()?;
    let mesh = TriMesh::from_file_bytes(&bytes, location.extension(), scale_mm_per_unit * 1e-3)
        .map_err(|source| LibraryError::Mesh { location: location.clone(), source })?;
    // The contact shape is built now, so that a mesh without volume is refused here.
    PartShape::hull(&mesh, &gripgen_twin::frames::Pose::identity())
        .map_err(|source| LibraryError::Shape { location, source })?;
    let [x_mm, y_mm, z_mm] = mesh.extent_m().map(|s| s * 1e3);
    let twin = baseline();
    let proposals = propose(&mesh, &twin);
    if proposals.is_empty() {
        let opening_mm = twin.gripper.opening_m * 1e3;
        return Err(InitError::NoGrip { path: path.display().to_string(), x_mm, y_mm, z_mm, opening_mm });
    }
    let name = part_name(path);
    let fill = |template: &str| {
        template
            .replace("{{part}}", &name)
            .replace("{{mesh}}", &mesh_reference(path, folder))
            .replace("{{scale_mm_per_unit}}", &format!("{scale_mm_per_unit:?}"))
            .replace("{{size}}", &format!("{x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm"))
            .replace("{{grips}}", &grips_toml(&name, &proposals))
            .replace("{{grip_poses}}", &pose_list(proposals.len()))
            .into_bytes()
    };
    let files = vec![
        StarterFile { name: "sweep.toml".into(), bytes: fill(assets::text("templates/part-sweep.toml")) },
        StarterFile { name: "twin.toml".into(), bytes: fill(assets::text("templates/part-twin.toml")) },
        StarterFile { name: "grips.png".into(), bytes: drawing::grips_picture(&name, &mesh, &proposals) },
    ];
    let mut summary =
        format!("{name}: {x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm, {} grips proposed\n", proposals.len());
    for (i, p) in proposals.iter().enumerate() {
        let [ox, oy, oz] = p.origin_mm.map(|x| (x * 10.0).round() / 10.0 + 0.0);
        let _ = writeln!(
            summary,
            "grip {i}: {:.1} mm between the jaws at [{ox:.1}, {oy:.1}, {oz:.1}] mm, {:.0} mm2 in contact at 40 N",
            p.width_mm, p.contact_mm2
        );
    }
    summary += "look at grips.png; friction and imprint constant in twin.toml are assumptions\n";
    Ok(PartStarter { files, grips: proposals, summary })
}

/// The rig that grips are proposed for.
fn baseline() -> Twin {
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

/// How the twin in `folder` names the mesh: relative where they lie together, absolute elsewhere.
fn mesh_reference(path: &Path, folder: &Path) -> String {
    let absolute = |p: &Path| std::path::absolute(p).unwrap_or_else(|_| p.to_path_buf());
    let (path, folder) = (absolute(path), absolute(folder));
    path.strip_prefix(&folder).unwrap_or(&path).to_string_lossy().replace('\\', "/")
}

fn grips_toml(part: &str, proposals: &[Proposal]) -> String {
    let mut text = String::new();
    for (i, p) in proposals.iter().enumerate() {
        let _ = write!(
            text,
            "[[parts.{part}.grips]]     # grip_pose = {i}: {:.1} mm between the jaws\norigin_mm = {:?}\norientation_deg = {:?}\n\n",
            p.width_mm, p.origin_mm, p.orientation_deg
        );
    }
    text.trim_end().to_string()
}

fn pose_list(n: usize) -> String {
    let poses: Vec<String> = (0..n).map(|i| i.to_string()).collect();
    format!("[{}]", poses.join(", "))
}
