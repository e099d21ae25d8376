//! Meshes, contact shapes and sensors: read once, shared by all samples.

use crate::location::Location;
use crate::project::drawn_parts;
use gripgen_physics::{PartShape, ShapeError};
use gripgen_record::{decode_picture, sha256_hex};
use gripgen_tactile::{Sensor, SensorError};
use gripgen_twin::{Gel, MeshError, Optics, Part, Sweep, TriMesh, Twin};
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

/// The files of a sweep and what was made of them. What it returns depends on its arguments only; it is a cache.
pub struct Library {
    files: BTreeMap<String, (Location, Vec<u8>)>,
    meshes: Cache<(String, u64), TriMesh>,
    shapes: Cache<(String, u64, usize, [u64; 7]), PartShape>,
    sensors: Cache<(String, Option<String>, Option<u64>), Sensor>,
}

type Cache<K, V> = Mutex<BTreeMap<K, Arc<V>>>;

/// Why a file cannot be used. The message names it.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LibraryError {
    /// A mesh.
    #[error("{location}: {source}")]
    Mesh {
        /// The file.
        location: Location,
        /// What is wrong.
        source: MeshError,
    },
    /// A contact shape.
    #[error("{location}: {source}")]
    Shape {
        /// The mesh file.
        location: Location,
        /// What is wrong.
        source: ShapeError,
    },
    /// A sensor file.
    #[error("{location}: {source}")]
    Sensor {
        /// The file.
        location: Location,
        /// What is wrong.
        source: SensorError,
    },
    /// A background image.
    #[error("{location}: {problem}")]
    Picture {
        /// The file.
        location: Location,
        /// What is wrong.
        problem: String,
    },
    /// A setting of the twin does not fit the sensor it names.
    #[error("{0}")]
    Mismatch(String),
}

impl Library {
    pub(crate) fn new(files: BTreeMap<String, (Location, Vec<u8>)>) -> Self {
        Self { files, meshes: Cache::default(), shapes: Cache::default(), sensors: Cache::default() }
    }

    /// SHA-256 of each file's content, by the path as written.
    pub fn files_sha256(&self) -> BTreeMap<String, String> {
        self.files.iter().map(|(path, (_, bytes))| (path.clone(), sha256_hex(bytes))).collect()
    }

    /// Content of the files that gripgen does not hold itself.
    pub(crate) fn disk_files(&self) -> Vec<&[u8]> {
        let on_disk = self.files.values().filter(|(at, _)| matches!(at, Location::Disk(_)));
        on_disk.map(|(_, bytes)| bytes.as_slice()).collect()
    }

    fn file(&self, path: &str) -> Result<&(Location, Vec<u8>), LibraryError> {
        self.files.get(path).ok_or_else(|| {
            LibraryError::Mismatch(format!("`{path}` was drawn, but only listed files can vary"))
        })
    }

    /// The mesh of a part, in metres.
    pub fn mesh(&self, part: &Part) -> Result<Arc<TriMesh>, LibraryError> {
        let key = (part.mesh.clone(), part.metres_per_unit.to_bits());
        cached(&self.meshes, key, || {
            let (location, bytes) = self.file(&part.mesh)?;
            TriMesh::from_file_bytes(bytes, location.extension(), part.metres_per_unit)
                .map_err(|source| LibraryError::Mesh { location: location.clone(), source })
        })
    }

    /// The contact shape of a part in one of its grips, in the part frame.
    pub fn shape(&self, part: &Part, grip_pose: usize) -> Result<Arc<PartShape>, LibraryError> {
        let pose = &part.grips[grip_pose];
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let bits = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(f64::to_bits);
        let key = (part.mesh.clone(), part.metres_per_unit.to_bits(), grip_pose, bits);
        let mesh = self.mesh(part)?;
        cached(&self.shapes, key, || {
            PartShape::hull(&mesh, pose).map_err(|source| {
                let location =
                    self.file(&part.mesh).map_or_else(|_| Location::parse(&part.mesh), |f| f.0.clone());
                LibraryError::Shape { location, source }
            })
        })
    }

    /// The tactile sensor that a twin's optics name.
    pub fn sensor(&self, optics: &Optics) -> Result<Arc<Sensor>, LibraryError> {
        let key = (optics.sensor.clone(), optics.background.clone(), optics.metres_per_px.map(f64::to_bits));
        cached(&self.sensors, key, || {
            let background = match &optics.background {
                None => None,
                Some(path) => {
                    let (location, bytes) = self.file(path)?;
                    let picture = decode_picture(bytes).map_err(|e| LibraryError::Picture {
                        location: location.clone(),
                        problem: e.to_string(),
                    })?;
                    Some(picture)
                }
            };
            let (location, bytes) = self.file(&optics.sensor)?;
            Sensor::from_npz(bytes, optics.metres_per_px, background.as_ref())
                .map_err(|source| LibraryError::Sensor { location: location.clone(), source })
        })
    }

    /// Reads everything that a sweep can draw, so that a broken file is found before any work is done.
    pub(crate) fn check(&self, sweep: &Sweep, twin: &Twin) -> Result<(), LibraryError> {
        for name in drawn_parts(sweep, twin) {
            let part = &twin.parts[&name];
            for grip_pose in 0..part.grips.len() {
                self.shape(part, grip_pose)?;
            }
        }
        for (jaw, optics) in twin.optics.iter() {
            let sensor = self.sensor(optics)?;
            check_kernels(&sensor, &twin.gel[jaw])?;
        }
        Ok(())
    }
}

/// A blur kernel that is wider than the image would mirror it more than once.
fn check_kernels(sensor: &Sensor, gel: &Gel) -> Result<(), LibraryError> {
    let smallest = sensor.grid.width_px.min(sensor.grid.height_px);
    match gel.kernels_px.iter().find(|&&k| k as usize / 2 >= smallest) {
        None => Ok(()),
        Some(k) => Err(LibraryError::Mismatch(format!(
            "gel kernels_px has a kernel of {k} pixels, the sensor's image has {smallest} pixels along its shorter side"
        ))),
    }
}

fn cached<K: Ord, V>(
    cache: &Cache<K, V>,
    key: K,
    make: impl FnOnce() -> Result<V, LibraryError>,
) -> Result<Arc<V>, LibraryError> {
    // Built under the lock: the first samples wait for one another instead of all building the same thing.
    let mut map = cache.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(value) = map.get(&key) {
        return Ok(value.clone());
    }
    let value = Arc::new(make()?);
    map.insert(key, value.clone());
    Ok(value)
}
