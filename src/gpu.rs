//! One graphics processor for all worker threads of a sweep.
//!
//! A thread of its own has the device. Workers send it the images of their samples and wait; it makes all that has come in while it
//! was busy as one batch, so that batches grow with the number of workers.

use gripgen_tactile::gpu::{
    AdapterChoice, GpuAdapter, GpuError, GpuImage, GpuMesh, GpuPress, GpuRenderer, GpuRequest, GpuSensor,
};
use gripgen_tactile::{IndentError, Sensor};
use gripgen_twin::frames::Pose;
use gripgen_twin::{Gel, TactileImage, TriMesh};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;

/// Meshes and sensors kept on the device.
const MESHES: usize = 32;
const SENSORS: usize = 4;

/// A part pressed into a gel.
#[derive(Debug, Clone)]
pub struct PlacedPart {
    /// Its mesh.
    pub mesh: Arc<TriMesh>,
    /// Where the mesh is in front of the gel.
    pub gel_from_mesh: Pose,
    /// Volume that a newton displaces.
    pub imprint_m3_per_n: f64,
    /// Normal force.
    pub force_n: f64,
}

/// An image to make.
#[derive(Debug, Clone)]
pub struct ImageJob {
    /// The sensor behind the gel.
    pub sensor: Arc<Sensor>,
    /// The gel.
    pub gel: Gel,
    /// What is pressed into it.
    pub part: PlacedPart,
    /// Which noise; none without a key.
    pub noise_key: Option<u64>,
}

/// Why there is no image.
#[derive(Debug, Clone, PartialEq)]
pub enum ImageFault {
    /// The device failed.
    Device(GpuError),
    /// The part cannot be pressed into the gel.
    Indent(IndentError),
}

/// An image with its place among those of its worker.
type Answer = (usize, Result<TactileImage, ImageFault>);

/// A job whose worker waits for it.
struct Waiting {
    job: ImageJob,
    place: usize,
    answer: Sender<Answer>,
}

/// What the thread of the device is asked for.
enum Order {
    Images(Vec<Waiting>),
    /// To put a sensor on the device.
    Prepare(Arc<Sensor>, Gel, Sender<Result<(), GpuError>>),
}

/// The device and its thread.
pub struct Gpu {
    adapter: GpuAdapter,
    /// `None` once it ends.
    orders: Option<Sender<Order>>,
    thread: Option<JoinHandle<()>>,
    fault: Arc<Mutex<Option<GpuError>>>,
}

impl Gpu {
    /// Opens an adapter: the one named, or the first graphics processor.
    ///
    /// # Errors
    ///
    /// No adapter, or one that cannot do what the stages need.
    pub fn open(adapter: Option<&str>) -> Result<Self, GpuError> {
        let choice = adapter.map_or(AdapterChoice::Hardware, |name| AdapterChoice::Named(name.into()));
        let renderer = GpuRenderer::new(&choice)?;
        let adapter = renderer.adapter().clone();
        let (orders, taken) = channel();
        let fault = Arc::new(Mutex::new(None));
        let slot = fault.clone();
        let device = Device { renderer, meshes: vec![], sensors: vec![] };
        let thread = std::thread::Builder::new()
            .name("gpu".into())
            .spawn(move || device.serve(&taken, &slot))
            .map_err(|e| GpuError::Device { adapter: adapter.to_string(), problem: e.to_string() })?;
        Ok(Self { adapter, orders: Some(orders), thread: Some(thread), fault })
    }

    /// Which adapter it is.
    pub fn adapter(&self) -> &GpuAdapter {
        &self.adapter
    }

    /// What the device reported, if it failed: then no image is worth waiting for.
    pub fn fault(&self) -> Option<GpuError> {
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }

    /// Puts a sensor on the device.
    ///
    /// # Errors
    ///
    /// A sensor that the device cannot have.
    pub fn prepare(&self, sensor: &Arc<Sensor>, gel: &Gel) -> Result<(), GpuError> {
        let (answer, answered) = channel();
        self.order(Order::Prepare(sensor.clone(), gel.clone(), answer));
        answered.recv().unwrap_or_else(|_| Err(self.gone()))
    }

    /// Makes images, together with those of other threads.
    pub fn images<const N: usize>(&self, jobs: [ImageJob; N]) -> [Result<TactileImage, ImageFault>; N] {
        let (answer, answered) = channel();
        let waiting = |(place, job)| Waiting { job, place, answer: answer.clone() };
        self.order(Order::Images(jobs.into_iter().enumerate().map(waiting).collect()));
        drop(answer);
        let mut images = std::array::from_fn(|_| None);
        for (place, image) in answered {
            // The first answer counts.
            images[place].get_or_insert(image);
        }
        images.map(|image| image.unwrap_or_else(|| Err(ImageFault::Device(self.gone()))))
    }

    fn order(&self, order: Order) {
        // Where the thread has gone, whoever waits for the answer sees it.
        if let Some(orders) = &self.orders {
            let _ = orders.send(order);
        }
    }

    /// Why nobody answers. From then on it is the fault of the device, so that what asks for it stops.
    fn gone(&self) -> GpuError {
        let ended =
            || GpuError::Device { adapter: self.adapter.to_string(), problem: "its thread has ended".into() };
        self.fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert_with(ended).clone()
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        self.orders = None;
        if let Some(thread) = self.thread.take() {
            // What it reported was told to those who waited.
            let _ = thread.join();
        }
    }
}

/// What the thread has: the device and what is on it, most recently used last.
struct Device {
    renderer: GpuRenderer,
    meshes: Vec<(Arc<TriMesh>, GpuMesh)>,
    sensors: Vec<(Arc<Sensor>, Gel, GpuSensor)>,
}

impl Device {
    /// Answers until nobody can ask any more.
    fn serve(mut self, orders: &Receiver<Order>, fault: &Mutex<Option<GpuError>>) {
        while let Ok(first) = orders.recv() {
            let mut all = vec![];
            for order in std::iter::once(first).chain(orders.try_iter()) {
                match order {
                    Order::Images(jobs) => all.extend(jobs),
                    Order::Prepare(sensor, gel, answer) => {
                        let _ = answer.send(self.sensor(&sensor, &gel).map(drop));
                    }
                }
            }
            while let Some(Waiting { job: first, .. }) = all.first() {
                let (sensor, gel) = (first.sensor.clone(), first.gel.clone());
                let alike = |w: &Waiting| Arc::ptr_eq(&w.job.sensor, &sensor) && w.job.gel == gel;
                let (batch, rest) = all.into_iter().partition(alike);
                all = rest;
                if let Err(e) = self.make(&batch) {
                    fault.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(e.clone());
                    // Those that were answered listen to the first answer only.
                    for w in &batch {
                        let _ = w.answer.send((w.place, Err(ImageFault::Device(e.clone()))));
                    }
                }
            }
        }
    }

    fn sensor(&mut self, sensor: &Arc<Sensor>, gel: &Gel) -> Result<&mut GpuSensor, GpuError> {
        let entry = match self.sensors.iter().position(|(s, g, _)| Arc::ptr_eq(s, sensor) && g == gel) {
            Some(i) => self.sensors.remove(i),
            None => {
                if self.sensors.len() == SENSORS {
                    self.sensors.remove(0);
                }
                (sensor.clone(), gel.clone(), self.renderer.sensor(sensor, gel)?)
            }
        };
        self.sensors.push(entry);
        Ok(&mut self.sensors.last_mut().expect("just put there").2)
    }

    /// Puts the meshes of a batch on the device; those of earlier batches may have to go.
    fn bring_meshes(&mut self, batch: &[Waiting]) -> Result<(), GpuError> {
        let wanted = |mesh: &Arc<TriMesh>| batch.iter().any(|w| Arc::ptr_eq(&w.job.part.mesh, mesh));
        while self.meshes.len() > MESHES {
            match self.meshes.iter().position(|(mesh, _)| !wanted(mesh)) {
                Some(i) => drop(self.meshes.remove(i)),
                None => break,
            }
        }
        for part in batch.iter().map(|w| &w.job.part) {
            if !self.meshes.iter().any(|(mesh, _)| Arc::ptr_eq(mesh, &part.mesh)) {
                self.meshes.push((part.mesh.clone(), self.renderer.mesh(&part.mesh)?));
            }
        }
        Ok(())
    }

    /// Makes a batch of one sensor. Every image is answered when it is there.
    fn make(&mut self, batch: &[Waiting]) -> Result<(), GpuError> {
        let Some(Waiting { job: first, .. }) = batch.first() else { return Ok(()) };
        self.bring_meshes(batch)?;
        self.sensor(&first.sensor, &first.gel)?;
        let Self { renderer, meshes, sensors } = self;
        let (.., sensor) = sensors.last_mut().expect("brought just now");
        let on_device = |mesh: &Arc<TriMesh>| {
            let found = meshes.iter().find(|(m, _)| Arc::ptr_eq(m, mesh));
            &found.expect("brought just now").1
        };
        let request = |job: &ImageJob| GpuRequest {
            press: Some(GpuPress {
                mesh: on_device(&job.part.mesh),
                gel_from_mesh: job.part.gel_from_mesh,
                imprint_m3_per_n: job.part.imprint_m3_per_n,
                force_n: job.part.force_n,
            }),
            noise_key: job.noise_key,
        };
        let requests: Vec<GpuRequest<'_>> = batch.iter().map(|w| request(&w.job)).collect();
        let grid = first.sensor.grid;
        let taken = |image: GpuImage<'_>| TactileImage {
            width_px: grid.width_px as u32,
            height_px: grid.height_px as u32,
            rgb: image.rgb.to_vec(),
        };
        renderer.render(sensor, &requests, |place, image| {
            let w = &batch[place];
            // A worker that does not listen any more has ended.
            let _ = w.answer.send((w.place, image.map(taken).map_err(ImageFault::Indent)));
        })
    }
}
