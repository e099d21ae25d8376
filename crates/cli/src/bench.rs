//! How many tactile images per second, on this machine: from a pose to an image with noise.

use gripgen_tactile::gpu::{
    AdapterChoice, GpuAdapter, GpuError, GpuImage, GpuPress, GpuRenderer, GpuRequest, GpuSensor,
};
use gripgen_tactile::{ClusteredMesh, IndentError, Renderer, Sensor, SensorError, SimdLevel};
use gripgen_twin::config::Backend;
use gripgen_twin::frames::{Pose, pose, rotation_from_fixed_xyz};
use gripgen_twin::parts::SteppedShaft;
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Gel, Jaw, TriMesh, Twin};
use nalgebra::Vector3;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

use gripgen::LibraryError;
use gripgen::{LoadError, Project};
use gripgen::{Location, ReadFileError};

/// Poses that are rendered in turn.
const POSES: usize = 64;

/// Segments of the shaft: 50 000 triangles.
const SEGMENTS: usize = 1924;

/// Images of a batch on a graphics processor: some 3 GB of its memory.
const GPU_BATCH: usize = 512;

/// How often each stage is made where its time is measured.
const STAGE_REPEATS: u32 = 50;

/// Stages with their seconds.
type Stages = Vec<(&'static str, f64)>;

/// What to measure.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchOptions {
    /// Where images are made.
    pub backend: Backend,
    /// The sensor file; the shipped sensor where there is none. One that names the deformation of its gel has its way.
    pub sensor: Option<PathBuf>,
    /// Part of the name of the adapter; the first graphics processor where there is none.
    pub adapter: Option<String>,
    /// Shortest time of a measurement, in seconds.
    pub seconds: f64,
    /// Threads of the measurement with all cores.
    pub threads: usize,
}

/// What was measured. Nothing in it is extrapolated.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchReport {
    /// Where images were made.
    pub backend: Backend,
    /// The adapter, if it was not the processor.
    pub adapter: Option<GpuAdapter>,
    /// Images that the adapter makes at once.
    pub batch: Option<usize>,
    /// Vector unit of the processor.
    pub level: SimdLevel,
    /// Colours of the sensor: `lambert`, `taxim` or `regressor`.
    pub colour: &'static str,
    /// Columns and rows of an image.
    pub size_px: (usize, usize),
    /// Triangles of the part.
    pub triangles: usize,
    /// The measurements.
    pub rates: Vec<BenchRate>,
    /// Seconds that each stage takes of a batch on the adapter, by name and in order; empty on the processor.
    pub stages: Vec<(&'static str, f64)>,
}

/// One measurement.
#[derive(Debug, Clone, PartialEq)]
pub struct BenchRate {
    /// `one_core`, `all_cores`, `device_resident` or `read_back`.
    pub what: &'static str,
    /// Threads that worked.
    pub threads: usize,
    /// Images made.
    pub images: u64,
    /// In which time.
    pub seconds: f64,
}

impl BenchRate {
    /// Images per second.
    pub fn images_per_s(&self) -> f64 {
        self.images as f64 / self.seconds
    }
}

/// Why nothing was measured.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum BenchError {
    /// The graphics processor.
    #[error(transparent)]
    Gpu(#[from] GpuError),
    /// The shipped configuration.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The shipped sensor.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// The file of a sensor.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// What is in it.
    #[error("{location}: {source}")]
    Sensor {
        /// The file.
        location: Location,
        /// What is wrong.
        source: SensorError,
    },
    /// A press of the measurement.
    #[error("a press of the measurement failed: {0}")]
    Press(#[from] IndentError),
}

/// A shaft of 50 000 triangles in many poses before a sensor, pressed with 20 to 80 N.
struct Work {
    sensor: Arc<Sensor>,
    gel: Gel,
    imprint_m3_per_n: f64,
    mesh: TriMesh,
    clustered: ClusteredMesh,
    presses: Vec<(Pose, f64)>,
}

impl Work {
    fn new(sensor: Option<&PathBuf>) -> Result<Self, BenchError> {
        let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &[])?;
        let twin: &Twin = &project.twin;
        let mesh = SteppedShaft { segments: SEGMENTS, ..Default::default() }.mesh();
        let mut stream = Stream::new(1, 0, Purpose::Draw);
        let mut between = |low: f64, high: f64| low + (high - low) * stream.uniform();
        let presses = (0..POSES)
            .map(|_| {
                let tilt = [between(-0.05, 0.05), between(-0.05, 0.05)];
                let turned = between(0.0, std::f64::consts::TAU);
                // The shaft's axis lies in the gel's plane.
                let rotation =
                    rotation_from_fixed_xyz([tilt[0], std::f64::consts::FRAC_PI_2 + tilt[1], turned]);
                let nearest =
                    mesh.vertices_m().iter().map(|v| (rotation * v).z).fold(f64::INFINITY, f64::min);
                let at = pose(&rotation, Vector3::new(between(-3e-3, 3e-3), between(-3e-3, 3e-3), -nearest));
                (at, between(20.0, 80.0))
            })
            .collect();
        let imprint_m3_per_n = twin.parts.values().next().map_or(1e-9, |part| part.imprint_m3_per_n);
        let sensor = match sensor {
            None => project.library.sensor(&twin.optics[Jaw::Left])?,
            Some(path) => {
                let location = Location::Disk(path.clone());
                let sensor = Sensor::from_npz(&location.read()?, None, None);
                Arc::new(sensor.map_err(|source| BenchError::Sensor { location, source })?)
            }
        };
        Ok(Self {
            sensor,
            gel: twin.gel[Jaw::Left].clone(),
            imprint_m3_per_n,
            clustered: ClusteredMesh::new(&mesh),
            mesh,
            presses,
        })
    }
}

/// Measures.
///
/// # Errors
///
/// A twin, part or sensor that cannot be loaded, no device for the GPU backend, or a press that fails.
pub fn bench(options: &BenchOptions) -> Result<BenchReport, BenchError> {
    // The adapter first: without one there is nothing to wait for.
    let gpu = match options.backend {
        Backend::Cpu => None,
        Backend::Gpu => {
            let named = |name: &String| AdapterChoice::Named(name.clone());
            Some(GpuRenderer::new(&options.adapter.as_ref().map_or(AdapterChoice::Hardware, named))?)
        }
    };
    let work = Work::new(options.sensor.as_ref())?;
    let least = Duration::from_secs_f64(options.seconds);
    let mut report = BenchReport {
        backend: options.backend,
        adapter: gpu.as_ref().map(|gpu| gpu.adapter().clone()),
        batch: None,
        level: SimdLevel::best(),
        colour: work.sensor.colour.name(),
        size_px: (work.sensor.grid.width_px, work.sensor.grid.height_px),
        triangles: work.mesh.triangles().len(),
        rates: vec![],
        stages: vec![],
    };
    match gpu {
        None => {
            report.rates.push(on_threads("one_core", 1, &work, least)?);
            if options.threads > 1 {
                report.rates.push(on_threads("all_cores", options.threads, &work, least)?);
            }
        }
        Some(gpu) => {
            let mut sensor = gpu.sensor_for(&work.sensor, &work.gel, GPU_BATCH)?;
            report.batch = Some(sensor.batch());
            (report.rates, report.stages) = on_device(&gpu, &mut sensor, &work, least)?;
        }
    }
    Ok(report)
}

/// Every thread makes whole images, until the time is over.
fn on_threads(
    what: &'static str,
    threads: usize,
    work: &Work,
    least: Duration,
) -> Result<BenchRate, BenchError> {
    let renderer = Renderer { sensor: &work.sensor, gel: &work.gel, level: SimdLevel::best() };
    let one = |i: usize| {
        let (at, force_n) = &work.presses[i % work.presses.len()];
        let imprint = renderer.press(&work.clustered, at, work.imprint_m3_per_n, *force_n)?;
        std::hint::black_box(renderer.image(Some(&imprint), Some(i as u64)));
        Ok::<(), IndentError>(())
    };
    one(0)?;
    let start = Instant::now();
    let made = std::thread::scope(|scope| {
        let worker = |thread: usize| {
            let mut made = 0u64;
            while start.elapsed() < least {
                one(made as usize * threads + thread)?;
                made += 1;
            }
            Ok::<u64, IndentError>(made)
        };
        let handles: Vec<_> = (0..threads).map(|t| scope.spawn(move || worker(t))).collect();
        handles
            .into_iter()
            .map(|h| h.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .sum::<Result<u64, IndentError>>()
    })?;
    Ok(BenchRate { what, threads, images: made, seconds: start.elapsed().as_secs_f64() })
}

/// Images that stay on the device, then images that are copied to memory of the host.
fn on_device(
    gpu: &GpuRenderer,
    sensor: &mut GpuSensor,
    work: &Work,
    least: Duration,
) -> Result<(Vec<BenchRate>, Stages), BenchError> {
    let mesh = gpu.mesh(&work.mesh)?;
    // At least some batches at a time, so that the ring is full.
    let at_once = 4 * sensor.batch();
    let requests: Vec<GpuRequest<'_>> = (0..at_once)
        .map(|i| {
            let (gel_from_mesh, force_n) = work.presses[i % work.presses.len()];
            let imprint_m3_per_n = work.imprint_m3_per_n;
            let press = GpuPress { mesh: &mesh, gel_from_mesh, imprint_m3_per_n, force_n };
            GpuRequest { press: Some(press), noise_key: Some(i as u64) }
        })
        .collect();
    let mut fault = None;
    let mut taken = vec![0u8; 3 * work.sensor.grid.len()];
    let mut take = |_: usize, image: Result<GpuImage<'_>, IndentError>| match image {
        Ok(image) => taken.copy_from_slice(image.rgb),
        Err(e) => fault = Some(e),
    };
    // The first batch pays for what is built once.
    let first = &requests[..sensor.batch().min(requests.len())];
    gpu.render(sensor, first, &mut take)?;
    let mut measure = |what, copies: bool| -> Result<BenchRate, BenchError> {
        let (start, mut images) = (Instant::now(), 0);
        while start.elapsed() < least {
            if copies {
                gpu.render(sensor, &requests, &mut take)?;
            } else {
                gpu.render_resident(sensor, &requests)?;
            }
            images += requests.len() as u64;
        }
        Ok(BenchRate { what, threads: 1, images, seconds: start.elapsed().as_secs_f64() })
    };
    let rates = vec![measure("device_resident", false)?, measure("read_back", true)?];
    std::hint::black_box(&taken);
    if let Some(fault) = fault {
        return Err(fault.into());
    }
    let repeats = if gpu.adapter().software { 1 } else { STAGE_REPEATS };
    let start = Instant::now();
    let stages = gpu.stage_seconds(sensor, &requests, repeats, &|| start.elapsed().as_secs_f64())?;
    Ok((rates, stages))
}
