//! Meshes, contact shapes and sensors: read once, shared by the samples that need them.

use crate::location::{Location, ReadFileError};
use crate::resolve::Files;
use gripgen_physics::Cache;
use gripgen_physics::{ArmError, ArmModel, PartShape, PlacedArm, ShapeError, Surface, UrdfError};
use gripgen_record::{decode_picture, sha256_hex};
use gripgen_tactile::{ClusteredMesh, Sensor, SensorError, SensorFiles, TableReading};
use gripgen_twin::config::TableChannels;
use gripgen_twin::{Gel, MeshError, NO_MESH, Optics, Part, RobotArm, TriMesh, Twin};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Meshes, shapes and sensors kept at a time: those of a sweep over the whole benchmark. A sweep that draws a scale or a
/// resolution makes a new one per sample.
const MESHES: usize = 256;
const SHAPES: usize = 512;
const SENSORS: usize = 8;
const ARMS: usize = 8;

/// What holds the place of a geometry that is not known.
const STAND_IN: &str = "asset:parts/long_shaft/part.stl";

/// The files of a sweep and what was made of them. What it returns depends on its arguments only.
pub struct Library {
    files: Files,
    meshes: Cache<(String, u64), TriMesh>,
    clustered: Cache<(String, u64), ClusteredMesh>,
    surfaces: Cache<(String, u64), Arc<Surface>>,
    shapes: Cache<(String, u64, [u64; 7]), PartShape>,
    arms: Cache<RobotArm, PlacedArm>,
    sensors: Cache<SensorKey, Sensor>,
}

/// Files of a sensor (sensor, background, gel map, shadow table), the bits of its pixel size, how its table is read.
type SensorKey = ([Option<String>; 4], Option<u64>, (Option<u32>, Option<TableChannels>));

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
    /// A robot description.
    #[error("{location}: {source}")]
    Urdf {
        /// The file.
        location: Location,
        /// What is wrong.
        source: UrdfError,
    },
    /// A stance of the arm.
    #[error(transparent)]
    Arm(#[from] ArmError),
    /// A file that is not part of the sweep.
    #[error("`{path}` is none of the files of this sweep")]
    Unknown {
        /// Its path.
        path: String,
    },
    /// A blur kernel wider than the image, which it would mirror more than once.
    #[error(
        "a blur kernel of {kernel_px} pixels is too large for an image of {image_px} pixels along its shorter side"
    )]
    Kernel {
        /// Width of the kernel.
        kernel_px: u32,
        /// Shorter side of the image.
        image_px: usize,
    },
}

impl LibraryError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            LibraryError::Mesh { source, .. } => Some(source.hint()),
            LibraryError::Sensor { source: SensorError::TableScale { .. }, .. } => Some(
                "set table_width_px in the same section of the twin: the width of the images on which the table was made",
            ),
            LibraryError::Sensor { source: SensorError::Incomplete { .. }, .. } => {
                Some("give it in the same section of the twin")
            }
            LibraryError::Sensor {
                source: SensorError::GelMap { .. } | SensorError::GelMapSize { .. },
                ..
            } => Some("a gel map is an .npy array with a height in pixels for each pixel of the background"),
            LibraryError::Sensor { source: SensorError::ShadowTable(_), .. } => Some(
                "docs/sensors.md has the lines of Python that turn Taxim's shadowTable.npz into plain arrays",
            ),
            LibraryError::Sensor { .. } => {
                Some("a sensor file is gripgen's own npz, or Taxim's polycalib.npz")
            }
            LibraryError::Kernel { .. } => Some("see kernels_px of the gel"),
            LibraryError::Urdf { .. } => Some(
                "package://NAME/... is looked for in a folder NAME beside or above the URDF; robot.arm.tip names one of its links",
            ),
            LibraryError::Arm(_) => Some("see robot.arm.joints_deg of the twin"),
            _ => None,
        }
    }
}

impl Library {
    /// The files that the grips of a twin need: meshes, robot and sensors. `beside` is where the twin lies. For labels, which do
    /// not depend on it, a part without a geometry has the shape of a shaft.
    ///
    /// # Errors
    ///
    /// A file that cannot be read.
    pub fn of_twin(twin: &Twin, beside: &Location) -> Result<Self, ReadFileError> {
        let meshes = twin.parts.values().map(|part| &part.mesh);
        let sensors = twin.optics.iter().flat_map(|(_, o)| {
            [Some(&o.sensor), o.background.as_ref(), o.gel_map.as_ref(), o.shadow_table.as_ref()]
        });
        let arm = twin.arm.iter().map(|arm| &arm.urdf);
        let mut files = Files::new();
        for path in meshes.chain(sensors.flatten()).chain(arm) {
            if !files.contains_key(path) {
                let at = if path == NO_MESH { Location::parse(STAND_IN) } else { beside.beside(path) };
                let bytes = at.read()?.into_owned();
                files.insert(path.clone(), (at, bytes));
            }
        }
        Ok(Self::new(files))
    }

    /// The files of a twin, by the path that names them: where they are, and their content.
    pub fn new(files: Files) -> Self {
        Self {
            files,
            meshes: Cache::new(MESHES),
            clustered: Cache::new(MESHES),
            surfaces: Cache::new(MESHES),
            shapes: Cache::new(SHAPES),
            arms: Cache::new(ARMS),
            sensors: Cache::new(SENSORS),
        }
    }

    /// SHA-256 of each file's content, by its path in the resolved configuration.
    pub fn files_sha256(&self) -> BTreeMap<String, String> {
        self.files.iter().map(|(path, (_, bytes))| (path.clone(), sha256_hex(bytes))).collect()
    }

    /// Path and content of the files that gripgen does not hold itself.
    pub(crate) fn disk_files(&self) -> Vec<(&str, &[u8])> {
        let on_disk = self.files.iter().filter(|(_, (at, _))| matches!(at, Location::Disk(_)));
        on_disk.map(|(path, (_, bytes))| (path.as_str(), bytes.as_slice())).collect()
    }

    fn file(&self, path: &str) -> Result<&(Location, Vec<u8>), LibraryError> {
        self.files.get(path).ok_or_else(|| LibraryError::Unknown { path: path.into() })
    }

    /// The mesh of a part, in metres.
    ///
    /// # Errors
    ///
    /// A file that is not of this twin, or no mesh.
    pub fn mesh(&self, part: &Part) -> Result<Arc<TriMesh>, LibraryError> {
        let key = (part.mesh.clone(), part.metres_per_unit.to_bits());
        self.meshes.get(key, || {
            let (location, bytes) = self.file(&part.mesh)?;
            TriMesh::from_file_bytes(bytes, location.extension(), part.metres_per_unit)
                .map_err(|source| LibraryError::Mesh { location: location.clone(), source })
        })
    }

    /// The mesh of a part, prepared for the tactile images.
    ///
    /// # Errors
    ///
    /// As [`Self::mesh`].
    pub fn clustered_mesh(&self, part: &Part) -> Result<Arc<ClusteredMesh>, LibraryError> {
        let key = (part.mesh.clone(), part.metres_per_unit.to_bits());
        self.clustered.get(key, || Ok(ClusteredMesh::new(&*self.mesh(part)?)))
    }

    /// The surface of a part, prepared for what its jaws meet.
    pub fn surface(&self, part: &Part) -> Result<Arc<Surface>, LibraryError> {
        let key = (part.mesh.clone(), part.metres_per_unit.to_bits());
        let make = || Ok::<_, LibraryError>(Arc::new(Surface::new(self.mesh(part)?)));
        Ok((*self.surfaces.get(key, make)?).clone())
    }

    /// The contact shape of a part in one of its grips, in the part frame.
    ///
    /// # Errors
    ///
    /// As [`Self::mesh`], or a contact shape that cannot be built.
    pub fn shape(&self, part: &Part, grip_pose: usize) -> Result<Arc<PartShape>, LibraryError> {
        let pose = &part.grips[grip_pose];
        let (t, q) = (pose.translation.vector, pose.rotation.coords);
        let bits = [t.x, t.y, t.z, q.x, q.y, q.z, q.w].map(f64::to_bits);
        self.shapes.get((part.mesh.clone(), part.metres_per_unit.to_bits(), bits), || {
            let surface = self.surface(part)?;
            let (location, _) = self.file(&part.mesh)?;
            PartShape::of_surface(surface, pose)
                .map_err(|source| LibraryError::Shape { location: location.clone(), source })
        })
    }

    /// An arm in its stance.
    ///
    /// # Errors
    ///
    /// A file that is not of this twin or no URDF, or a stance that the arm cannot take.
    pub fn arm(&self, arm: &RobotArm) -> Result<Arc<PlacedArm>, LibraryError> {
        self.arms.get(arm.clone(), || {
            // Where its meshes are was checked when the configuration was loaded; they are not used.
            let model = self.arm_model(arm, &|reference| Some(reference.into()))?;
            Ok(PlacedArm::new(model, arm)?)
        })
    }

    /// Reads the robot description of an arm and checks that the files it names are there.
    pub(crate) fn check_arm(&self, arm: &RobotArm) -> Result<(), LibraryError> {
        let (location, _) = self.file(&arm.urdf)?;
        // The copy in a run folder was checked where it came from; the meshes are not copied.
        let copied =
            matches!(location, Location::Disk(file) if file.parent().is_some_and(|p| p.ends_with("inputs")));
        self.arm_model(arm, &|reference| {
            if copied { Some(reference.into()) } else { location.ros_file(reference) }
        })?;
        self.arm(arm).map(drop)
    }

    fn arm_model(
        &self,
        arm: &RobotArm,
        find: &dyn Fn(&str) -> Option<String>,
    ) -> Result<ArmModel, LibraryError> {
        let (location, bytes) = self.file(&arm.urdf)?;
        ArmModel::from_urdf(&String::from_utf8_lossy(bytes), &arm.tip, find)
            .map_err(|source| LibraryError::Urdf { location: location.clone(), source })
    }

    /// The tactile sensor that a twin's optics name.
    ///
    /// # Errors
    ///
    /// A file that is not of this twin or no sensor, or one that does not fit the gel.
    pub fn sensor(&self, optics: &Optics) -> Result<Arc<Sensor>, LibraryError> {
        let named = [
            Some(optics.sensor.clone()),
            optics.background.clone(),
            optics.gel_map.clone(),
            optics.shadow_table.clone(),
        ];
        let table = (optics.table_width_px, optics.table_channels);
        self.sensors.get((named, optics.metres_per_px.map(f64::to_bits), table), || {
            let beside = |path: &Option<String>| path.as_ref().map(|path| self.file(path)).transpose();
            let picture = beside(&optics.background)?.map(|(location, bytes)| {
                decode_picture(bytes)
                    .map_err(|e| LibraryError::Picture { location: location.clone(), problem: e.to_string() })
            });
            let background = picture.transpose()?;
            let (gel_map, shadow_table) = (beside(&optics.gel_map)?, beside(&optics.shadow_table)?);
            let sensor = self.file(&optics.sensor)?;
            let usual = TableReading::default();
            let files = SensorFiles {
                sensor: &sensor.1,
                metres_per_px: optics.metres_per_px,
                background: background.as_ref(),
                gel_map: gel_map.map(|(_, bytes)| &bytes[..]),
                shadow_table: shadow_table.map(|(_, bytes)| &bytes[..]),
                table: TableReading {
                    width_px: optics.table_width_px.unwrap_or(usual.width_px),
                    channels: optics.table_channels.unwrap_or(usual.channels),
                },
            };
            Sensor::from_files(&files).map_err(|source| {
                let faulty = match &source {
                    SensorError::GelMap { .. } | SensorError::GelMapSize { .. } => gel_map,
                    SensorError::ShadowTable(_) => shadow_table,
                    _ => None,
                };
                let location = faulty.unwrap_or(sensor).0.clone();
                LibraryError::Sensor { location, source }
            })
        })
    }

    /// Reads a sensor and checks that a gel fits it.
    pub fn check_sensor(&self, optics: &Optics, gel: &Gel) -> Result<(), LibraryError> {
        let sensor = self.sensor(optics)?;
        let image_px = sensor.grid.width_px.min(sensor.grid.height_px);
        let kernels_px = sensor.pyramid.as_ref().map_or(&gel.kernels_px, |pyramid| &pyramid.kernels_px);
        match kernels_px.iter().find(|&&k| k as usize / 2 >= image_px) {
            None => Ok(()),
            Some(&kernel_px) => Err(LibraryError::Kernel { kernel_px, image_px }),
        }
    }
}
