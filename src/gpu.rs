//! One graphics processor for all worker threads of a sweep.
//!
//! A thread puts its images into a queue and asks for the device. Whoever gets it makes everything that waits, so that
//! images of several threads become one batch; the others find theirs made when it is their turn.

use gripgen_tactile::gpu::{
    AdapterChoice, GpuAdapter, GpuError, GpuMesh, GpuPress, GpuRenderer, GpuRequest, GpuSensor,
};
use gripgen_tactile::{IndentError, Sensor};
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gel, TactileImage, TriMesh};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Meshes and sensors kept on the device.
const MESHES: usize = 32;
const SENSORS: usize = 4;

/// A part pressed into a gel.
#[derive(Debug, Clone)]
pub(crate) struct PlacedPart {
    pub(crate) mesh: Arc<TriMesh>,
    pub(crate) gel_from_mesh: Pose,
    pub(crate) imprint_m3_per_n: f64,
    pub(crate) force_n: f64,
}

/// An image to make.
#[derive(Debug, Clone)]
pub(crate) struct ImageJob {
    pub(crate) sensor: Arc<Sensor>,
    pub(crate) gel: Gel,
    pub(crate) part: PlacedPart,
    pub(crate) noise_key: Option<u64>,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum ImageFault {
    Device(GpuError),
    Indent(IndentError),
}

type Answer = Arc<Mutex<Option<Result<TactileImage, ImageFault>>>>;

/// The device and its queue.
pub struct Gpu {
    renderer: GpuRenderer,
    waiting: Mutex<Vec<(ImageJob, Answer)>>,
    resident: Mutex<Resident>,
    fault: Mutex<Option<GpuError>>,
}

/// What is on the device, most recently used last.
#[derive(Default)]
struct Resident {
    meshes: Vec<(Arc<TriMesh>, GpuMesh)>,
    sensors: Vec<(Arc<Sensor>, Gel, GpuSensor)>,
}

impl Gpu {
    /// Opens an adapter: the one named, or the first graphics processor.
    ///
    /// # Errors
    ///
    /// No adapter, or one that cannot do what the stages need.
    pub fn open(adapter: Option<&str>) -> Result<Self, GpuError> {
        let choice = adapter.map_or(AdapterChoice::Hardware, |name| AdapterChoice::Named(name.into()));
        Ok(Self {
            renderer: GpuRenderer::new(&choice)?,
            waiting: Mutex::default(),
            resident: Mutex::default(),
            fault: Mutex::default(),
        })
    }

    /// Which adapter it is.
    pub fn adapter(&self) -> &GpuAdapter {
        self.renderer.adapter()
    }

    /// What the device reported, if it failed: then no image is worth waiting for.
    pub(crate) fn fault(&self) -> Option<GpuError> {
        lock(&self.fault).clone()
    }

    /// Puts a sensor on the device, or says why the device cannot have it.
    pub(crate) fn prepare(&self, sensor: &Arc<Sensor>, gel: &Gel) -> Result<(), GpuError> {
        lock(&self.resident).sensor(&self.renderer, sensor, gel).map(drop)
    }

    /// Makes images, together with those of other threads.
    pub(crate) fn images<const N: usize>(
        &self,
        jobs: [ImageJob; N],
    ) -> [Result<TactileImage, ImageFault>; N] {
        let answers: [Answer; N] = std::array::from_fn(|_| Answer::default());
        lock(&self.waiting).extend(jobs.into_iter().zip(answers.iter().cloned()));
        let mut resident = lock(&self.resident);
        // Answers are complete when the device is free, or ours are still waiting.
        if answers.iter().any(|a| lock(a).is_none()) {
            let mut all = std::mem::take(&mut *lock(&self.waiting));
            while !all.is_empty() {
                let alike = |other: &ImageJob, one: &ImageJob| {
                    Arc::ptr_eq(&other.sensor, &one.sensor) && other.gel == one.gel
                };
                let first = all[0].0.clone();
                let (batch, rest) = all.into_iter().partition(|(job, _)| alike(job, &first));
                all = rest;
                if let Err(e) = resident.make(&self.renderer, &batch) {
                    lock(&self.fault).get_or_insert(e.clone());
                    for (_, answer) in &batch {
                        lock(answer).get_or_insert(Err(ImageFault::Device(e.clone())));
                    }
                }
            }
        }
        drop(resident);
        answers.map(|a| lock(&a).take().expect("whoever had the device answered all that waited"))
    }
}

impl Resident {
    fn sensor(
        &mut self,
        renderer: &GpuRenderer,
        sensor: &Arc<Sensor>,
        gel: &Gel,
    ) -> Result<&mut GpuSensor, GpuError> {
        let entry = match self.sensors.iter().position(|(s, g, _)| Arc::ptr_eq(s, sensor) && g == gel) {
            Some(i) => self.sensors.remove(i),
            None => {
                if self.sensors.len() == SENSORS {
                    self.sensors.remove(0);
                }
                (sensor.clone(), gel.clone(), renderer.sensor(sensor, gel)?)
            }
        };
        self.sensors.push(entry);
        Ok(&mut self.sensors.last_mut().expect("just put there").2)
    }

    /// Puts the meshes of a batch on the device; those of earlier batches may have to go.
    fn bring_meshes(&mut self, renderer: &GpuRenderer, batch: &[(ImageJob, Answer)]) -> Result<(), GpuError> {
        let wanted = |mesh: &Arc<TriMesh>| batch.iter().any(|(job, _)| Arc::ptr_eq(&job.part.mesh, mesh));
        while self.meshes.len() > MESHES {
            match self.meshes.iter().position(|(mesh, _)| !wanted(mesh)) {
                Some(i) => drop(self.meshes.remove(i)),
                None => break,
            }
        }
        for (job, _) in batch {
            if !self.meshes.iter().any(|(mesh, _)| Arc::ptr_eq(mesh, &job.part.mesh)) {
                self.meshes.push((job.part.mesh.clone(), renderer.mesh(&job.part.mesh)?));
            }
        }
        Ok(())
    }

    /// Makes a batch of one sensor.
    fn make(&mut self, renderer: &GpuRenderer, batch: &[(ImageJob, Answer)]) -> Result<(), GpuError> {
        let Some((first, _)) = batch.first() else { return Ok(()) };
        self.bring_meshes(renderer, batch)?;
        self.sensor(renderer, &first.sensor, &first.gel)?;
        let Self { meshes, sensors } = self;
        let (.., sensor) = sensors.last_mut().expect("brought just now");
        let on_device = |mesh: &Arc<TriMesh>| {
            let found = meshes.iter().find(|(m, _)| Arc::ptr_eq(m, mesh));
            &found.expect("brought just now").1
        };
        let requests: Vec<GpuRequest<'_>> = batch
            .iter()
            .map(|(job, _)| GpuRequest {
                press: Some(GpuPress {
                    mesh: on_device(&job.part.mesh),
                    gel_from_mesh: job.part.gel_from_mesh,
                    imprint_m3_per_n: job.part.imprint_m3_per_n,
                    force_n: job.part.force_n,
                }),
                noise_key: job.noise_key,
            })
            .collect();
        for ((_, answer), image) in batch.iter().zip(renderer.images(sensor, &requests)?) {
            *lock(answer) = Some(image.map_err(ImageFault::Indent));
        }
        Ok(())
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
