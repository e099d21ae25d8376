//! Sets of imprints from disk: a folder with `imprints.csv`, whose volumes stand there or are read off pictures.

use gripgen_identify::{Covariate, ImprintData};
use gripgen_measured::{
    IMPRINTS_FILE, ImprintTable, MeasuredImprint, TableError, read_imprint_picture, read_imprint_table,
};
use gripgen_record::sha256_hex;
use gripgen_tactile::{Sensor, SimdLevel, VolumeError, VolumeReader};
use gripgen_twin::{Gel, TactileImage};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// A set of imprints with its volumes.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintSet {
    /// What is fitted.
    pub data: ImprintData,
    /// Hash of the table and of the pictures that it names.
    pub sha256: String,
    /// Remarks for people.
    pub notes: Vec<String>,
}

/// Why a set of imprints could not be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadImprintsError {
    /// The table, or a picture.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Pictures without the sensor that took them.
    #[error("{}: {images} of {rows} rows have an image and no volume_mm3, and no sensor file says what its colours mean", .path.display())]
    NoSensor {
        /// The folder.
        path: PathBuf,
        /// Rows with an image.
        images: usize,
        /// All rows.
        rows: usize,
    },
    /// A picture, or the sensor.
    #[error("{}: `{name}`: {source}", .path.display())]
    Volume {
        /// The folder.
        path: PathBuf,
        /// The picture.
        name: String,
        /// What is wrong.
        source: VolumeError,
    },
}

impl LoadImprintsError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            Self::NoSensor { .. } | Self::Volume { .. } => Some(
                "name the sensor file that belongs to these images with --sensor; `gripgen calibrate presses` writes one",
            ),
            Self::Table(_) => None,
        }
    }
}

/// Whether a path looks like a set of imprints.
pub fn is_imprint_set(path: &Path) -> bool {
    path.join(IMPRINTS_FILE).is_file()
}

/// Loads the set of a folder. Volumes of rows with an image are read through the colours of a sensor; `gel` deforms as the sensor file does
/// not say.
///
/// # Errors
///
/// A table or picture that cannot be read, images without a sensor or of another size.
pub fn load_imprint_set(
    folder: &Path,
    sensor: Option<(&Sensor, &Gel)>,
) -> Result<ImprintSet, LoadImprintsError> {
    let table = read_imprint_table(folder)?;
    let images = table.imprints.iter().filter(|m| matches!(m, MeasuredImprint::Image { .. })).count();
    let reader = match (images, sensor) {
        (0, _) => None,
        (_, None) => {
            return Err(LoadImprintsError::NoSensor { path: folder.into(), images, rows: table.ids.len() });
        }
        (_, Some((sensor, gel))) => {
            let at = |source| LoadImprintsError::Volume {
                path: folder.into(),
                name: IMPRINTS_FILE.into(),
                source,
            };
            Some(VolumeReader::new(sensor, gel, SimdLevel::best()).map_err(at)?)
        }
    };
    let mut volumes = Vec::with_capacity(table.ids.len());
    let mut hashes = table.sha256.clone();
    let mut rests: BTreeMap<String, TactileImage> = BTreeMap::new();
    for imprint in &table.imprints {
        match (imprint, &reader) {
            (MeasuredImprint::VolumeMm3(volume), _) => volumes.push(*volume),
            (MeasuredImprint::Image { image, rest }, Some(reader)) => {
                let picture = read_imprint_picture(folder, image)?;
                hashes += &sha256_hex(&picture.rgb);
                if let Some(name) = rest.as_ref().filter(|name| !rests.contains_key(*name)) {
                    let frame = read_imprint_picture(folder, name)?;
                    hashes += &sha256_hex(&frame.rgb);
                    rests.insert(name.clone(), frame);
                }
                let at_rest = rest.as_ref().and_then(|name| rests.get(name));
                let volume = reader.volume_m3(&picture, at_rest);
                let at =
                    |source| LoadImprintsError::Volume { path: folder.into(), name: image.clone(), source };
                volumes.push(1e9 * volume.map_err(at)?);
            }
            (MeasuredImprint::Image { .. }, None) => {}
        }
    }
    let mut set = imprint_data(&table, volumes);
    if let Some(reader) = &reader {
        set.sha256 = sha256_hex(hashes.as_bytes());
        set.notes.push(format!(
            "volumes of {images} images were read through the sensor file: their common factor is right to about {:.0} % on balls",
            100.0 * reader.scatter()
        ));
    }
    Ok(set)
}

/// A table with the volume of each row.
pub fn imprint_data(table: &ImprintTable, volume_mm3: Vec<f64>) -> ImprintSet {
    let extra = table.extra.iter().map(|(name, values)| (name.clone(), Covariate::from(values)));
    let data = ImprintData {
        ids: table.ids.clone(),
        grip_force_n: table.grip_force_n.clone(),
        volume_mm3,
        time_s: table.time_s.clone(),
        grasp: table.grasp.clone(),
        grasps: table.grasps.clone(),
        part: table.part.clone(),
        session: table.session.clone(),
        extra: extra.collect(),
    };
    ImprintSet { data, sha256: table.sha256.clone(), notes: Vec::new() }
}
