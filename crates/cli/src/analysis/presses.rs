//! Press sets from disk: Taxim's `dataPack.npz`, or a folder with a table and images.

mod bodies;

use crate::mesh_file::MeshFileError;
use bodies::PressBodies;
use gripgen::Files;
use gripgen::{Library, LibraryError};
use gripgen::{LoadError, load_twin_document};
use gripgen::{Location, ReadFileError};
use gripgen_measured::{PRESSES_FILE, PressFolder, PressRecord, TableError, press_table, read_press_folder};
use gripgen_record::sha256_hex;
use gripgen_tactile::presses::{
    Circle, DATA_PACK_BALL_M, DATA_PACK_METRES_PER_PX, DataPackError, IndenterError, IndenterPose, Press,
    PressSet, USUAL_SINK_IN, find_circle, reference_frame,
};
use gripgen_tactile::{Follow, Pyramid, Sensor, finish};
use gripgen_twin::config::ImageNoise;
use gripgen_twin::{Optics, TactileImage, Twin};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Taxim's file inside a folder.
const DATA_PACK: &str = "dataPack.npz";

/// What a press set does not say itself.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct PressGeometry {
    /// Diameter of the ball.
    pub ball_m: Option<f64>,
    /// Side of a pixel on the gel.
    pub metres_per_px: Option<f64>,
}

/// Why a press set could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadPressesError {
    /// A file.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// A folder of presses.
    #[error(transparent)]
    Folder(#[from] TableError),
    /// Taxim's file.
    #[error("{}: {source}", .path.display())]
    DataPack {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        source: DataPackError,
    },
    /// A folder of images says neither how large the ball nor how large a pixel is.
    #[error("{}: a folder of presses does not say {missing}", .path.display())]
    Geometry {
        /// The folder.
        path: PathBuf,
        /// What is missing.
        missing: &'static str,
    },
    /// Images of several sizes.
    #[error("{}: `{name}` is {}x{} pixels, the first press {}x{}", .path.display(), .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// The press set.
        path: PathBuf,
        /// The press, or the rest frame.
        name: String,
        /// Width and height of its image.
        found: (u32, u32),
        /// Width and height of the first.
        wanted: (u32, u32),
    },
    /// An image without colours.
    #[error("{}: `{name}` is grey: red, green and blue are equal at all of its {pixels} pixels", .path.display())]
    Grey {
        /// The press set.
        path: PathBuf,
        /// The press, or the rest frame.
        name: String,
        /// Pixels of the image.
        pixels: usize,
    },
    /// A ball that sank in by more than its radius.
    #[error("{}: `{name}` is {depth_mm} mm deep, the ball's radius is {radius_mm} mm", .path.display())]
    Depth {
        /// The table.
        path: PathBuf,
        /// The press.
        name: String,
        /// Its depth.
        depth_mm: f64,
        /// Radius of the ball.
        radius_mm: f64,
    },
    /// The mesh of a body.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// A body that cannot be pressed in.
    #[error("{}: {source}", .path.display())]
    Body {
        /// The folder.
        path: PathBuf,
        /// What is wrong.
        source: IndenterError,
    },
    /// A length that cannot be.
    #[error("{what} is {value_mm} mm, it must be from {min_mm} to {max_mm} mm")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its value.
        value_mm: f64,
        /// Smallest.
        min_mm: f64,
        /// Largest.
        max_mm: f64,
    },
    /// No press set.
    #[error("{}: neither a `dataPack.npz` nor a folder with `{PRESSES_FILE}`", .path.display())]
    Unknown {
        /// The path.
        path: PathBuf,
    },
}

/// Whether a path looks like a press set.
pub fn is_press_set(path: &Path) -> bool {
    path.extension().is_some_and(|e| e == "npz")
        || press_table(path).is_some()
        || path.join(DATA_PACK).is_file()
}

impl LoadPressesError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::Grey { .. } => Some(
                "slopes are told apart by the colours of the lights: save the frames of the colour camera as they are, not converted to grey",
            ),
            Self::Mesh(e) => e.hint(),
            _ => None,
        }
    }
}

/// Loads a press set. A `dataPack.npz` has Taxim's geometry (4.0 mm, 0.0295 mm per pixel) unless another one is given;
/// for a folder both have to be.
///
/// # Errors
///
/// A path that is no press set, files that cannot be read, images of two sizes, grey images, or a missing or impossible
/// geometry.
pub fn load_presses(path: &Path, geometry: PressGeometry) -> Result<PressSet, LoadPressesError> {
    let length = |what, value_m: Option<f64>, min_mm: f64, max_mm: f64| match value_m
        .map(|m| (m * 1e9).round() * 1e-6)
    {
        Some(value_mm) if !(min_mm..=max_mm).contains(&value_mm) => {
            Err(LoadPressesError::Length { what, value_mm, min_mm, max_mm })
        }
        _ => Ok(value_m),
    };
    let ball_m = length("the ball", geometry.ball_m, 0.1, 100.0)?;
    let metres_per_px = length("a pixel", geometry.metres_per_px, 1e-4, 1.0)?;
    let pack = if path.is_dir() { path.join(DATA_PACK) } else { path.to_path_buf() };
    if press_table(path).is_some() {
        let missing = |missing| LoadPressesError::Geometry { path: path.into(), missing };
        let folder = read_press_folder(path)?;
        // Where there is no ball its size is not asked for, and nothing looks at it.
        let no_ball = folder.presses.iter().all(|press| press.body.is_some()).then_some(DATA_PACK_BALL_M);
        let ball_m = ball_m.or(no_ball).ok_or_else(|| missing("how large the ball is"))?;
        let metres_per_px = metres_per_px.ok_or_else(|| missing("how large a pixel is"))?;
        return one_kind(path, from_folder(path, folder, ball_m, metres_per_px)?);
    }
    if !pack.is_file() {
        return Err(LoadPressesError::Unknown { path: path.into() });
    }
    let bytes = Location::Disk(pack.clone()).read()?;
    let ball_m = ball_m.unwrap_or(DATA_PACK_BALL_M);
    let metres_per_px = metres_per_px.unwrap_or(DATA_PACK_METRES_PER_PX);
    let set = PressSet::from_data_pack(&bytes, ball_m, metres_per_px);
    one_kind(path, set.map_err(|source| LoadPressesError::DataPack { path: pack, source })?)
}

/// All images have one size, and colours.
fn one_kind(path: &Path, set: PressSet) -> Result<PressSet, LoadPressesError> {
    let size = |image: &TactileImage| (image.width_px, image.height_px);
    let Some(wanted) = set.presses.first().map(|first| size(&first.image)) else { return Ok(set) };
    let rest = set.rest.as_ref().map(|image| ("rest frame", image));
    for (name, image) in set.presses.iter().map(|p| (p.name.as_str(), &p.image)).chain(rest) {
        let (path, name) = (|| path.to_path_buf(), || name.to_string());
        if size(image) != wanted {
            return Err(LoadPressesError::Size { path: path(), name: name(), found: size(image), wanted });
        }
        let (pixels, _) = image.rgb.as_chunks::<3>();
        if pixels.iter().all(|[red, green, blue]| red == green && green == blue) {
            return Err(LoadPressesError::Grey { path: path(), name: name(), pixels: pixels.len() });
        }
    }
    Ok(set)
}

fn from_folder(
    path: &Path,
    folder: PressFolder,
    ball_m: f64,
    metres_per_px: f64,
) -> Result<PressSet, LoadPressesError> {
    let radius_px = |record: &PressRecord| match record.depth_m {
        Some(depth_m) if record.body.is_none() && record.radius_px.is_none() && depth_m > ball_m / 2.0 => {
            Err(LoadPressesError::Depth {
                path: press_table(path).unwrap_or_else(|| path.join(PRESSES_FILE)),
                name: record.name.clone(),
                depth_mm: depth_m * 1e3,
                radius_mm: ball_m * 0.5e3,
            })
        }
        // The circle that is seen is smaller than the ball's cut with the gel at rest, since the gel gives way.
        depth_m => Ok(record.radius_px.or(depth_m.map(|depth_m| {
            Circle::radius_px_at_depth(ball_m, (1.0 - USUAL_SINK_IN) * depth_m, metres_per_px)
        }))),
    };
    let known = folder
        .presses
        .iter()
        .map(|record| Ok((record.centre_px, radius_px(record)?)))
        .collect::<Result<Vec<Known>, LoadPressesError>>()?;
    let mut bodies = PressBodies::new(path, metres_per_px);
    let mut presses = Vec::with_capacity(known.len());
    for (record, &(centre, radius)) in folder.presses.into_iter().zip(&known) {
        presses.push(match (&record.body, centre, record.depth_m) {
            (Some(body), Some((x_px, y_px)), Some(travel_m)) => {
                let at = IndenterPose { x_px, y_px, rotation_rad: body.rotation_rad };
                let indenter = bodies.indenter(body, at, travel_m, &record.image)?;
                Press::of_body(record.name, record.image, indenter)
            }
            _ => {
                let circle =
                    centre.zip(radius).map(|((x_px, y_px), radius_px)| Circle { x_px, y_px, radius_px });
                Press { travel_m: record.depth_m, ..Press::of_ball(record.name, record.image, circle) }
            }
        });
    }
    let mut set = PressSet { metres_per_px, ball_m, rest: folder.rest, presses };
    complete(&mut set, &known);
    Ok(set)
}

/// Centre and radius in pixels, where somebody measured them.
type Known = (Option<(f64, f64)>, Option<f64>);

/// Where half of a mark is known, a depth say, the other half is looked for.
fn complete(set: &mut PressSet, known: &[Known]) {
    if known.iter().all(|(centre, radius)| centre.is_some() == radius.is_some()) {
        return;
    }
    let Some(rest) = reference_frame(set) else { return };
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    for (press, &(centre, radius)) in set.presses.iter_mut().zip(known) {
        let half = press.indenter.is_none()
            && centre.is_some() != radius.is_some()
            && press.image.rgb.len() == 3 * rest[0].len();
        let Some(found) = half.then(|| find_circle(&press.image, &rest, ball_radius_px)).flatten() else {
            continue;
        };
        let (x_px, y_px) = centre.unwrap_or((found.x_px, found.y_px));
        press.circle = Some(Circle { x_px, y_px, radius_px: radius.unwrap_or(found.radius_px) });
    }
}

/// Looks for the contact of every press that nobody marked. Presses without a visible contact are taken out of the set.
pub fn find_missing_circles(set: &mut PressSet) -> FoundCircles {
    let unmarked = unmarked_names(set);
    set.mark_missing();
    let without_contact = unmarked_names(set);
    set.presses.retain(|press| press.circle.is_some());
    let found = unmarked.into_iter().filter(|name| !without_contact.contains(name)).collect();
    FoundCircles { found, without_contact }
}

/// The same, against the sensor file's frame without contact where the set has none of its own.
pub fn find_circles_with_sensor(set: &mut PressSet, sensor: &Sensor) -> FoundCircles {
    if set.rest.is_some() {
        return find_missing_circles(set);
    }
    set.rest = Some(finish(sensor, None, None));
    let circles = find_missing_circles(set);
    set.rest = None;
    circles
}

fn unmarked_names(set: &PressSet) -> Vec<String> {
    set.presses.iter().filter(|press| press.circle.is_none()).map(|press| press.name.clone()).collect()
}

/// What [`find_missing_circles`] and [`find_circles_with_sensor`] found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FoundCircles {
    /// Presses whose contact was found.
    pub found: Vec<String>,
    /// Presses without a visible contact, which were taken out.
    pub without_contact: Vec<String>,
}

/// Hash of the images and marks of a set.
pub fn presses_sha256(set: &PressSet) -> String {
    let mut text = String::new();
    for press in &set.presses {
        let mark = press.circle.map_or(String::new(), |c| format!("{} {} {}", c.x_px, c.y_px, c.radius_px));
        text += &format!("{} {} {mark}\n", press.name, sha256_hex(&press.image.rgb));
    }
    sha256_hex(text.as_bytes())
}

/// Why the sensor of a comparison could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadSensorError {
    /// A file.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// The twin that names it.
    #[error(transparent)]
    Twin(#[from] LoadError),
    /// The sensor file, or one that belongs to it.
    #[error(transparent)]
    Sensor(#[from] LibraryError),
}

/// Reads a sensor file.
///
/// # Errors
///
/// A file that cannot be read, or is no sensor.
pub fn load_sensor(location: &Location) -> Result<Arc<Sensor>, LoadSensorError> {
    let optics = Optics {
        sensor: location.to_string(),
        metres_per_px: None,
        background: None,
        gel_map: None,
        shadow_table: None,
        table_width_px: None,
        table_channels: None,
        image_noise: ImageNoise::Off,
    };
    sensor_of(&optics, |_| location.clone())
}

/// The sensor of a twin's left jaw, with what the twin puts beside it; the deformation is that of the twin's gel unless the
/// sensor file has one.
///
/// # Errors
///
/// A twin that cannot be loaded, or as [`load_sensor`].
pub fn load_twin_sensor(twin: &Location) -> Result<Arc<Sensor>, LoadSensorError> {
    let document = load_twin_document(twin, &[])?;
    let read = document.read_twin().map_err(LoadError::from)?;
    let Twin { optics, gel, .. } = Twin::new(&read).map_err(|e| LoadError::from(document.located(e)))?;
    let sensor = sensor_of(&optics.left, |path| twin.beside(path))?;
    let pyramid = Pyramid {
        kernels_px: gel.left.kernels_px,
        restore_depth_fraction: gel.left.restore_depth_fraction,
        sink_in_fraction: 0.0,
        follow: Follow::AtLeast,
    };
    Ok(Arc::new(Sensor { pyramid: sensor.pyramid.clone().or(Some(pyramid)), ..(*sensor).clone() }))
}

fn sensor_of(optics: &Optics, locate: impl Fn(&str) -> Location) -> Result<Arc<Sensor>, LoadSensorError> {
    let mut files = Files::new();
    let beside = [&optics.background, &optics.gel_map, &optics.shadow_table].into_iter().flatten();
    for path in std::iter::once(&optics.sensor).chain(beside) {
        let location = locate(path);
        let bytes = location.read()?.into_owned();
        files.insert(path.clone(), (location, bytes));
    }
    Ok(Library::new(files).sensor(optics)?)
}
