//! `_core.Pulls`: pulls under way that Python commands step by step; what the Gymnasium environments are made of.

use crate::simulator::{Simulator, image_array, trace_into};
use crate::{error, values};
use gripgen::physics::{Command, PullSession};
use gripgen::twin::{PullTrace, TraceRow, slip_label};
use gripgen::{Draw, SampleError, Simulator as Twin};
use numpy::{PyArray, PyArray2, PyArray4, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::sync::MutexExt;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// Columns of what a step returns.
const COLUMNS: usize = 6;

/// Pulls under way, each in a place of its own.
#[pyclass(frozen, module = "gripgen._core")]
pub struct Pulls {
    twin: Arc<Twin>,
    places: Mutex<Vec<Option<Place>>>,
}

struct Place {
    session: Option<PullSession>,
    trace: PullTrace,
    /// Every command was a force: the label rule compares with it.
    forces_only: bool,
    stop_m: f64,
    max_time_s: f64,
    tolerance_n: f64,
}

#[pymethods]
impl Pulls {
    #[new]
    fn new(simulator: &Simulator, places: usize) -> Self {
        let empty = (0..places).map(|_| None).collect();
        Self { twin: simulator.twin.clone(), places: Mutex::new(empty) }
    }

    /// Grips anew in a place. `values` are keys of a sweep's `[vary]`. Returns uint8[2, H, W, 3], or None without images.
    #[pyo3(signature = (place, values, seed, index, images = true))]
    fn start<'py>(
        &self,
        py: Python<'py>,
        place: usize,
        values: &Bound<'py, PyDict>,
        seed: u64,
        index: u64,
        images: bool,
    ) -> PyResult<Option<Bound<'py, PyArray4<u8>>>> {
        let asked = values::drawn(py, values)?;
        let started = py.detach(|| self.twin.start(&asked, Draw { seed, index }, images));
        let (scenario, started) = started.map_err(|e| error::sample(py, e))?;
        let mut places = self.lock_attached(py);
        let count = places.len();
        let Some(slot) = places.get_mut(place) else {
            return Err(error::argument(py, &format!("there is no place {place}, there are {count}"), None));
        };
        *slot = Some(Place {
            session: started.session,
            trace: PullTrace::default(),
            forces_only: true,
            stop_m: scenario.pull.stop_m,
            max_time_s: scenario.pull.max_time_s,
            tolerance_n: scenario.pull.label_tolerance_n,
        });
        started.images.as_ref().map(|i| image_array(py, i)).transpose()
    }

    /// Carries out one command in each place for `duration_s`: pull forces in N, or speeds in mm/s if `speeds`. Returns
    /// float64[N, 6]: time_s, measured_force_n, displacement_mm, whether the jaws have slid, whether the pull is over
    /// (displacement stop, or no contact), whether its time is up. A place whose pull is over stands still, and so do those
    /// that `waits` (bool[N]) is true of.
    #[pyo3(signature = (commands, duration_s, speeds = false, threads = 1, waits = None))]
    fn step<'py>(
        &self,
        py: Python<'py>,
        commands: PyReadonlyArray1<'py, f64>,
        duration_s: f64,
        speeds: bool,
        threads: usize,
        waits: Option<PyReadonlyArray1<'py, bool>>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let mut commands = commands.as_slice()?.to_vec();
        if let Some(waits) = waits {
            // No command is none.
            commands
                .iter_mut()
                .zip(waits.as_slice()?)
                .filter(|(_, wait)| **wait)
                .for_each(|(c, _)| *c = f64::NAN);
        }
        // The lock is taken and given back without the interpreter's: nobody who waits for one holds the other.
        let stepped = py.detach(|| {
            let mut places = self.places.lock().unwrap_or_else(PoisonError::into_inner);
            if commands.len() != places.len() {
                return Err(Err(places.len()));
            }
            step_all(&mut places[..], &commands, duration_s, speeds, threads).map_err(Ok)
        });
        let n = commands.len();
        let values = stepped.map_err(|e| match e {
            Ok(e) => error::sample(py, e),
            Err(places) => error::argument(py, &format!("{n} commands for {places} pulls"), None),
        })?;
        PyArray::from_vec(py, values).reshape([n, COLUMNS])
    }

    /// The pull in a place so far: its trace, and the label by the label rule where the commands were forces.
    fn result<'py>(&self, py: Python<'py>, place: usize) -> PyResult<Bound<'py, PyDict>> {
        let taken = {
            let places = self.lock_attached(py);
            let of = |place: &Place| {
                let largest = place.trace.measured_force_n.iter().copied().fold(0.0, f64::max);
                let slid = place.session.as_ref().map(PullSession::has_slid);
                let label = slid.filter(|_| place.forces_only).and_then(|slid| {
                    slip_label(&place.trace, place.tolerance_n, slid).ok().map(|l| l.max_pull_force_n)
                });
                (place.trace.clone(), slid, label.unwrap_or(largest))
            };
            places.get(place).and_then(Option::as_ref).map(of)
        };
        let found = PyDict::new(py);
        let Some((trace, slid, max_pull_force_n)) = taken else { return Ok(found) };
        trace_into(&found, &trace)?;
        let status = match slid {
            None => "no_contact",
            Some(true) => "slipped",
            Some(false) => "censored",
        };
        found.set_item("status", status)?;
        found.set_item("max_pull_force_n", if slid.is_none() { 0.0 } else { max_pull_force_n })?;
        Ok(found)
    }
}

impl Pulls {
    /// The lock, waited for without the interpreter's.
    fn lock_attached<'a>(&'a self, py: Python<'a>) -> MutexGuard<'a, Vec<Option<Place>>> {
        self.places.lock_py_attached(py).unwrap_or_else(PoisonError::into_inner)
    }
}

/// Places, their commands, and where what they return goes.
type Piece<'a> = (&'a mut [Option<Place>], (&'a [f64], &'a mut [f64]));

fn step_all(
    places: &mut [Option<Place>],
    commands: &[f64],
    duration_s: f64,
    speeds: bool,
    threads: usize,
) -> Result<Vec<f64>, SampleError> {
    let mut values = vec![0.0; places.len() * COLUMNS];
    let each = places.len().div_ceil(threads.clamp(1, places.len().max(1))).max(1);
    let piece = |(places, (commands, out)): Piece<'_>| {
        let all = places.iter_mut().zip(commands).zip(out.chunks_mut(COLUMNS));
        for ((place, &command), out) in all {
            if let Some(place) = place.as_mut().filter(|_| !command.is_nan()) {
                out.copy_from_slice(&place.step(command, duration_s, speeds)?);
            }
        }
        Ok::<(), SampleError>(())
    };
    let pieces = places.chunks_mut(each).zip(commands.chunks(each).zip(values.chunks_mut(each * COLUMNS)));
    if each >= commands.len() {
        for one in pieces {
            piece(one)?;
        }
        return Ok(values);
    }
    let done: Vec<Result<(), SampleError>> = std::thread::scope(|scope| {
        let running: Vec<_> = pieces.map(|one| scope.spawn(|| piece(one))).collect();
        running
            .into_iter()
            .map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
            .collect()
    });
    done.into_iter().collect::<Result<(), _>>()?;
    Ok(values)
}

impl Place {
    fn step(&mut self, command: f64, duration_s: f64, speeds: bool) -> Result<[f64; COLUMNS], SampleError> {
        let Some(session) = &mut self.session else { return Ok([0.0, 0.0, 0.0, 0.0, 1.0, 0.0]) };
        let ticks = (duration_s * session.rate_hz()).round().max(1.0) as usize;
        let command_of = if speeds { Command::SpeedMPerS(command * 1e-3) } else { Command::ForceN(command) };
        self.forces_only &= !speeds;
        for _ in 0..ticks {
            let state = session.state();
            if state.displacement_m > self.stop_m || state.time_s >= self.max_time_s {
                break;
            }
            self.trace.push(TraceRow {
                time_s: state.time_s,
                // A speed has no desired force: the label rule is not asked then.
                desired_force_n: if speeds { state.measured_force_n } else { command },
                measured_force_n: state.measured_force_n,
                displacement_m: state.displacement_m,
            });
            session.step(command_of, 1.0 / session.rate_hz())?;
        }
        let state = session.state();
        let flag = |x: bool| f64::from(u8::from(x));
        Ok([
            state.time_s,
            state.measured_force_n,
            state.displacement_m * 1e3,
            flag(session.has_slid()),
            flag(state.displacement_m > self.stop_m),
            flag(state.time_s >= self.max_time_s),
        ])
    }
}
