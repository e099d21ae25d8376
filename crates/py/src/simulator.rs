//! `_core.Simulator`: pulls on a twin, one by one or many at once.

use crate::{error, values};
use gripgen::in_parallel;
use gripgen::record::proto::gripgen_v1::Status;
use gripgen::record::status_name;
use gripgen::twin::config::Mechanics;
use gripgen::twin::draw::Drawn;
use gripgen::twin::label::forces::LabelBranch;
use gripgen::twin::{Outcome, PerJaw, PullTrace, Sample, TactileImage};
use gripgen::{Draw, Location, Simulator as Twin};
use numpy::{PyArray, PyArray1, PyArray4, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::time::Duration;

/// Time between two looks at the interpreter's signals.
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

/// A twin with its files, ready to pull. Threads may share it.
#[pyclass(frozen, module = "gripgen._core")]
pub struct Simulator {
    pub twin: Arc<Twin>,
}

/// Values of a pull, seed and index.
type Asked = (BTreeMap<String, Drawn>, Draw);

#[pymethods]
impl Simulator {
    /// `overrides` are keys of the twin or of the pull; `mechanics` is "reduced" or "rapier".
    #[new]
    #[pyo3(signature = (twin, overrides = None, mechanics = "reduced", images = true))]
    fn new(
        py: Python<'_>,
        twin: &str,
        overrides: Option<&Bound<'_, PyDict>>,
        mechanics: &str,
        images: bool,
    ) -> PyResult<Self> {
        let sets = values::overrides(overrides)?;
        let mechanics = match mechanics {
            "reduced" => Mechanics::Reduced,
            "rapier" => Mechanics::Rapier,
            other => {
                let what = format!("mechanics = {other:?} is neither \"reduced\" nor \"rapier\"");
                return Err(error::argument(py, &what, None));
            }
        };
        let opened = py.detach(|| Twin::open(&Location::parse(twin), &sets, mechanics, images));
        Ok(Self { twin: Arc::new(opened.map_err(|e| error::load(py, e))?) })
    }

    /// Names of the twin's parts.
    #[getter]
    fn parts(&self) -> Vec<String> {
        self.twin.twin().parts.keys().cloned().collect()
    }

    /// Width and height of the images.
    #[getter]
    fn image_size_px(&self, py: Python<'_>) -> PyResult<(usize, usize)> {
        let project = self.twin.project();
        let sensor = project.library.sensor(&project.twin.optics.left);
        let grid = sensor.map_err(|e| error::missing(py, &e.to_string(), None))?.grid;
        Ok((grid.width_px, grid.height_px))
    }

    /// Simulates pulls: `asked` holds a dict of keys and values for each; pull i has the index `first_index + i`. Returns a
    /// dict for each. Ctrl-C ends it after the pulls under way: the KeyboardInterrupt has a dict for each pull that was made, as `made`.
    #[pyo3(signature = (asked, seed = 0, first_index = 0, images = true, trace = true, threads = 1))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords in Python")]
    fn pulls<'py>(
        &self,
        py: Python<'py>,
        asked: Vec<Bound<'py, PyDict>>,
        seed: u64,
        first_index: u64,
        images: bool,
        trace: bool,
        threads: usize,
    ) -> PyResult<Vec<Bound<'py, PyDict>>> {
        let all: Vec<Asked> = asked
            .iter()
            .enumerate()
            .map(|(i, v)| Ok((values::drawn(py, v)?, Draw { seed, index: first_index + i as u64 })))
            .collect::<PyResult<_>>()?;
        let stop = AtomicBool::new(false);
        let one = |i: usize| {
            let asked = &all[i];
            (!stop.load(Ordering::Relaxed)).then(|| self.twin.pull(&asked.0, asked.1, images, trace))
        };
        let (made, raised) = py.detach(|| while_looking(&stop, || in_parallel(all.len(), threads, one)));
        let made = made.into_iter().flatten().map(|made| match made {
            Ok(sample) => dict_of(py, sample, trace),
            Err(e) => Err(error::config(py, e)),
        });
        let Some(raised) = raised else { return made.collect() };
        // What was made before is kept, whatever became of the others.
        let made: Vec<_> = made.flatten().collect();
        raised.value(py).setattr("made", made)?;
        Err(raised)
    }
}

/// Does some work while the interpreter's signals are looked at; the first one sets `stop` and is returned with what the work gives.
fn while_looking<T: Send>(stop: &AtomicBool, work: impl FnOnce() -> T + Send) -> (T, Option<PyErr>) {
    std::thread::scope(|scope| {
        let (done, watched) = mpsc::channel::<()>();
        let working = scope.spawn(move || {
            // Dropped when the work ends, however it ends.
            let _done = done;
            work()
        });
        let mut raised = None;
        while watched.recv_timeout(BETWEEN_LOOKS) == Err(RecvTimeoutError::Timeout) {
            if raised.is_none() {
                raised = Python::attach(|py| py.check_signals()).err();
                stop.store(raised.is_some(), Ordering::Relaxed);
            }
        }
        (working.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)), raised)
    })
}

/// Both images as uint8[2, H, W, 3].
pub fn image_array<'py>(
    py: Python<'py>,
    images: &PerJaw<TactileImage>,
) -> PyResult<Bound<'py, PyArray4<u8>>> {
    let (width, height) = (images.left.width_px as usize, images.left.height_px as usize);
    let pixels = [&images.left.rgb[..], &images.right.rgb[..]].concat();
    PyArray::from_vec(py, pixels).reshape([2, height, width, 3])
}

/// Columns of a trace.
pub fn trace_into(found: &Bound<'_, PyDict>, trace: &PullTrace) -> PyResult<()> {
    let py = found.py();
    found.set_item("time_s", PyArray1::from_slice(py, &trace.time_s))?;
    found.set_item("desired_force_n", PyArray1::from_slice(py, &trace.desired_force_n))?;
    found.set_item("measured_force_n", PyArray1::from_slice(py, &trace.measured_force_n))?;
    let displacement_mm: Vec<f64> = trace.displacement_m.iter().map(|x| x * 1e3).collect();
    found.set_item("displacement_mm", PyArray1::from_vec(py, displacement_mm))
}

fn dict_of(py: Python<'_>, sample: Sample, trace: bool) -> PyResult<Bound<'_, PyDict>> {
    let found = PyDict::new(py);
    let scenario = &sample.scenario;
    found.set_item("part", &scenario.part)?;
    found.set_item("grip_force_n", scenario.grip_force_n)?;
    found.set_item("seed", scenario.seed)?;
    found.set_item("index", scenario.index)?;
    let status = |status| found.set_item("status", status_name(status));
    match sample.outcome {
        Outcome::Failed { reason } => {
            status(Status::Failed)?;
            found.set_item("failure", reason)?;
        }
        Outcome::NoContact { images } => {
            status(Status::NoContact)?;
            found.set_item("max_pull_force_n", 0.0)?;
            found.set_item("images", images.as_ref().map(|i| image_array(py, i)).transpose()?)?;
        }
        Outcome::Pulled(pulled) => {
            status(match (&pulled.suspect, pulled.label.censored) {
                (Some(_), _) => Status::Suspect,
                (None, true) => Status::Censored,
                (None, false) => Status::Slipped,
            })?;
            if let Some(reason) = &pulled.suspect {
                found.set_item("status_reason", reason)?;
            }
            found.set_item("max_pull_force_n", pulled.label.max_pull_force_n)?;
            found.set_item("slip_time_s", pulled.label.slip_time_s)?;
            found.set_item("mu_drawn", pulled.mu_drawn)?;
            found.set_item("mu_effective", pulled.mu_effective)?;
            found.set_item("limit_force_n", pulled.limit_force_n)?;
            let forces = &pulled.forces;
            let optional = [
                ("peak_force_n", forces.peak_force_n),
                ("kinetic_force_n", forces.kinetic_force_n),
                ("slip_onset_s", pulled.slip_onset_s),
                ("slip_s", pulled.slip_s),
            ];
            for (name, value) in optional {
                found.set_item(name, value.unwrap_or(f64::NAN))?;
            }
            let label = &pulled.label;
            let tolerance_n = scenario.pull.label_tolerance_n;
            let branch = forces.branch(label.max_pull_force_n, label.slip_time_s, tolerance_n);
            found.set_item("label_branch", branch.map_or("", LabelBranch::name))?;
            found.set_item("outside_fit", pulled.outside_fit)?;
            found.set_item("images", pulled.images.as_ref().map(|i| image_array(py, i)).transpose()?)?;
            if trace {
                trace_into(&found, &pulled.trace)?;
            }
        }
    }
    Ok(found)
}
