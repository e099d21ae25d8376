//! Press sets from disk: Taxim's `dataPack.npz`, or a folder with a table and images.

use crate::library::{Library, LibraryError};
use crate::location::{Location, ReadFileError};
use crate::project::{LoadError, load_twin_document};
use crate::resolve::Files;
use gripgen_record::{PRESSES_FILE, PressFolder, PressFolderError, read_press_folder};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::{
    Circle, DATA_PACK_BALL_M, DATA_PACK_METRES_PER_PX, DataPackError, Press, PressSet,
};
use gripgen_twin::config::ImageNoise;
use gripgen_twin::{Optics, Twin};
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
    Folder(#[from] PressFolderError),
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
        /// What is missing, with the flag.
        missing: &'static str,
    },
    /// A length that cannot be.
    #[error("{what} is {value_mm} mm, it must be from {least_mm} to {most_mm} mm")]
    Length {
        /// Which length.
        what: &'static str,
        /// Its value.
        value_mm: f64,
        /// Smallest.
        least_mm: f64,
        /// Largest.
        most_mm: f64,
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
        || path.join(PRESSES_FILE).is_file()
        || path.join(DATA_PACK).is_file()
}

/// Loads a press set. A `dataPack.npz` has Taxim's geometry (4.0 mm, 0.0295 mm per pixel) unless another one is given;
/// for a folder both have to be.
pub fn load_presses(path: &Path, geometry: PressGeometry) -> Result<PressSet, LoadPressesError> {
    let length = |what, value_m: Option<f64>, least_mm: f64, most_mm: f64| match value_m.map(|m| m * 1e3) {
        Some(value_mm) if !(least_mm..=most_mm).contains(&value_mm) => {
            Err(LoadPressesError::Length { what, value_mm, least_mm, most_mm })
        }
        _ => Ok(value_m),
    };
    let ball_m = length("the ball", geometry.ball_m, 0.1, 100.0)?;
    let metres_per_px = length("a pixel", geometry.metres_per_px, 1e-4, 1.0)?;
    let pack = if path.is_dir() { path.join(DATA_PACK) } else { path.to_path_buf() };
    if path.join(PRESSES_FILE).is_file() {
        let missing = |missing| LoadPressesError::Geometry { path: path.into(), missing };
        let ball_m = ball_m.ok_or_else(|| missing("how large the ball is (--ball-mm)"))?;
        let metres_per_px = metres_per_px.ok_or_else(|| missing("how large a pixel is (--mm-per-px)"))?;
        return Ok(from_folder(read_press_folder(path)?, ball_m, metres_per_px));
    }
    if !pack.is_file() {
        return Err(LoadPressesError::Unknown { path: path.into() });
    }
    let bytes = Location::Disk(pack.clone()).read()?;
    let ball_m = ball_m.unwrap_or(DATA_PACK_BALL_M);
    let metres_per_px = metres_per_px.unwrap_or(DATA_PACK_METRES_PER_PX);
    PressSet::from_data_pack(&bytes, ball_m, metres_per_px)
        .map_err(|source| LoadPressesError::DataPack { path: pack, source })
}

fn from_folder(folder: PressFolder, ball_m: f64, metres_per_px: f64) -> PressSet {
    let press = |record: gripgen_record::PressRecord| {
        let depth = |d| Circle::radius_px_at_depth(ball_m, d, metres_per_px);
        let radius_px = record.radius_px.or(record.depth_m.map(depth));
        let circle =
            record.centre_px.zip(radius_px).map(|((x_px, y_px), radius_px)| Circle { x_px, y_px, radius_px });
        Press { name: record.name, image: record.image, circle }
    };
    PressSet {
        metres_per_px,
        ball_m,
        rest: folder.rest,
        presses: folder.presses.into_iter().map(press).collect(),
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

fn unmarked_names(set: &PressSet) -> Vec<String> {
    set.presses.iter().filter(|press| press.circle.is_none()).map(|press| press.name.clone()).collect()
}

/// What [`find_missing_circles`] found.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct FoundCircles {
    /// Presses whose contact was found.
    pub found: Vec<String>,
    /// Presses without a visible contact, which were taken out.
    pub without_contact: Vec<String>,
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
pub fn load_sensor(location: &Location) -> Result<Arc<Sensor>, LoadSensorError> {
    let optics = Optics {
        sensor: location.to_string(),
        metres_per_px: None,
        background: None,
        gel_map: None,
        shadow_table: None,
        image_noise: ImageNoise::Off,
    };
    sensor_of(&optics, |_| location.clone())
}

/// The sensor of a twin's left jaw, with what the twin puts beside it.
pub fn load_twin_sensor(twin: &Location) -> Result<Arc<Sensor>, LoadSensorError> {
    let document = load_twin_document(twin, &[])?;
    let read = document.read_twin().map_err(LoadError::from)?;
    let optics = Twin::new(&read).map_err(|e| LoadError::from(document.located(e)))?.optics.left;
    sensor_of(&optics, |path| twin.beside(path))
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
