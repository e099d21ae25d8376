//! `_core.Dataset`: rows of a run or of measured pulls.

use crate::error;
use crate::film;
use gripgen::in_parallel;
use gripgen::record::proto::gripgen_v1::{JawContact, Status};
use gripgen::record::{Dataset as Rows, DatasetError, NoiseMode};
use gripgen::twin::Values;
use gripgen::twin::{ContactPatch, Jaw};
use gripgen::{Project, press_only};
use gripgen_measured::open_dataset;
use numpy::{IntoPyArray, PyArray, PyArray1, PyArray3, PyArray4, PyArray5, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use std::path::PathBuf;
use std::sync::{Mutex, OnceLock, PoisonError};

/// Rows of simulated or measured pulls, opened for reading. Threads may share it.
#[pyclass(frozen, module = "gripgen._core")]
pub struct Dataset {
    rows: Rows,
    project: OnceLock<Result<Project, String>>,
}

#[pymethods]
impl Dataset {
    #[new]
    fn new(py: Python<'_>, path: PathBuf) -> PyResult<Self> {
        let rows = py.detach(|| open_dataset(&path)).map_err(|e| error::open(py, &e))?;
        Ok(Self { rows, project: OnceLock::new() })
    }

    fn __len__(&self) -> usize {
        self.rows.table().rows()
    }

    /// Width and height of the images; None if there are none.
    #[getter]
    fn image_size_px(&self) -> Option<(u32, u32)> {
        self.rows.image_size_px()
    }

    /// Whether images are stored without their noise.
    #[getter]
    fn clean_images(&self, py: Python<'_>) -> PyResult<bool> {
        py.detach(|| self.rows.has_clean_images()).map_err(|e| error::data(py, &e))
    }

    /// Whether pulls are filmed.
    #[getter]
    fn has_films(&self, py: Python<'_>) -> PyResult<bool> {
        py.detach(|| self.rows.has_films()).map_err(|e| error::data(py, &e))
    }

    /// What the run says of itself: name, source, gripgen_version, config_sha256, config_toml. Empty for a table of pulls.
    #[getter]
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        if let Some(run) = self.rows.run() {
            let info = run.info();
            found.set_item("name", &info.name)?;
            found.set_item("source", &info.source)?;
            found.set_item("gripgen_version", &info.gripgen_version)?;
            found.set_item("config_sha256", &info.config_sha256)?;
            found.set_item("config_toml", &info.config_toml)?;
        }
        Ok(found)
    }

    /// All columns by name: float64 arrays (NaN where there is no value) or lists of str.
    fn columns<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        for (name, column) in self.rows.table().columns() {
            match column {
                Values::Numbers(x) => found.set_item(name, PyArray1::from_slice(py, x))?,
                Values::Words(words) => found.set_item(name, PyList::new(py, words)?)?,
            }
        }
        Ok(found)
    }

    /// What each column is to somebody who trains on it: "place", "input", "label" or "answer".
    fn roles<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        for (name, _) in self.rows.table().columns() {
            found.set_item(name, self.rows.role(name).name())?;
        }
        Ok(found)
    }

    /// Images of these rows: uint8[B, 2, H, W, 3], left jaw first. `threads` share the decoding.
    /// `noise`: "stored" (that of the sample), "off", or "again" (other noise, that of a `pass_`), where images are stored without it.
    #[pyo3(signature = (rows, threads = 1, noise = "stored", pass_ = 0))]
    fn images<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<usize>,
        threads: usize,
        noise: &str,
        pass_: u64,
    ) -> PyResult<Bound<'py, PyArray5<u8>>> {
        let mode = match noise {
            "stored" => NoiseMode::Stored,
            "off" => NoiseMode::Off,
            "again" => NoiseMode::Again { pass: pass_ },
            _ => return Err(error::argument(py, &format!("noise = {noise:?}: stored, off or again"), None)),
        };
        let Some((width, height)) = self.rows.image_size_px() else {
            let what = format!("{}: there are no images", self.rows.path().display());
            return Err(error::missing(py, &what, Some("sweep with images = \"png\"")));
        };
        let shape = [rows.len(), 2, height as usize, width as usize, 3];
        let each: usize = shape[1..].iter().product();
        let made = py.detach(|| {
            let mut pixels = vec![0_u8; rows.len() * each];
            fill(&rows, &mut pixels, each, threads, |row, out| self.rows.images_with(row, mode, out))?;
            Ok(pixels)
        });
        let pixels = made.map_err(|e| error::data(py, &e))?;
        PyArray::from_vec(py, pixels).reshape(shape)
    }

    /// Traces of these rows: float32[B, T, 4] with time_s, desired_force_n, measured_force_n, displacement_mm, NaN beyond
    /// the end of each, and int64[B] with their lengths (0 where no trace is stored).
    fn traces<'py>(&self, py: Python<'py>, rows: Vec<usize>) -> PyResult<Traces<'py>> {
        let read = || rows.iter().map(|&row| self.rows.trace(row)).collect::<Result<Vec<_>, _>>();
        let traces = py.detach(read).map_err(|e| error::data(py, &e))?;
        let lengths: Vec<i64> = traces.iter().map(|t| t.as_ref().map_or(0, |t| t.len() as i64)).collect();
        let longest = lengths.iter().copied().max().unwrap_or(0) as usize;
        let mut values = vec![f32::NAN; rows.len() * longest * 4];
        for (out, trace) in values.chunks_mut((longest * 4).max(1)).zip(&traces) {
            let Some(trace) = trace else { continue };
            for (out, row) in out.chunks_mut(4).zip(trace.rows()) {
                let all = [row.time_s, row.desired_force_n, row.measured_force_n, row.displacement_m * 1e3];
                out.iter_mut().zip(all).for_each(|(out, x)| *out = x as f32);
            }
        }
        let values = PyArray::from_vec(py, values).reshape([rows.len(), longest, 4])?;
        Ok((values, lengths.into_pyarray(py)))
    }

    /// The film of a row's pull as a dict of arrays, F frames of 2 jaws; None where there is none.
    fn film<'py>(&self, py: Python<'py>, row: usize) -> PyResult<Option<Bound<'py, PyDict>>> {
        let film = py.detach(|| self.rows.film(row)).map_err(|e| error::data(py, &e))?;
        film.map(|film| film::arrays(py, &film)).transpose()
    }

    /// Pressure cells of these rows: float32[B, 2, 64, 4] with x_mm (right), y_mm (down), area_mm2 and normal force_n of each
    /// cell of the contact, zero where a jaw has fewer.
    fn forces<'py>(&self, py: Python<'py>, rows: Vec<usize>) -> PyResult<Bound<'py, PyArray4<f32>>> {
        const CELLS: usize = ContactPatch::MAX_CELLS;
        let mut values = vec![0.0_f32; rows.len() * 2 * CELLS * 4];
        let filled = py.detach(|| {
            for (&row, out) in rows.iter().zip(values.chunks_mut(2 * CELLS * 4)) {
                let missing =
                    || DatasetError::Missing { path: self.rows.path().into(), row, what: "contact forces" };
                let sample = self.rows.record(row)?.ok_or_else(missing)?.sample;
                // A rig does not know them; zeros would say that nothing was touched.
                let touched = matches!(sample.status(), Status::Slipped | Status::Censored | Status::Suspect);
                if touched && sample.left.is_none() && sample.right.is_none() {
                    return Err(missing());
                }
                let jaws = [sample.left, sample.right];
                for (jaw, out) in jaws.iter().zip(out.chunks_mut(CELLS * 4)) {
                    jaw.iter().for_each(|jaw| cells_into(jaw, out));
                }
            }
            Ok(())
        });
        filled.map_err(|e| error::data(py, &e))?;
        PyArray::from_vec(py, values).reshape([rows.len(), 2, CELLS, 4])
    }

    /// How deep the part is pressed into the gels, simulated again from the run's own configuration: float32[B, 2, H, W] in
    /// mm, 0 outside the contact. NaN for samples that failed.
    #[pyo3(signature = (rows, threads = 1))]
    fn heights<'py>(
        &self,
        py: Python<'py>,
        rows: Vec<usize>,
        threads: usize,
    ) -> PyResult<Bound<'py, PyArray4<f32>>> {
        let project = match py.detach(|| self.project.get_or_init(|| self.load_project())) {
            Ok(project) => project,
            Err(e) => {
                return Err(error::missing(py, e, Some("heights are made by the gripgen that made the run")));
            }
        };
        let grid = project.library.sensor(&project.twin.optics.left);
        let grid = grid.map_err(|e| error::missing(py, &e.to_string(), None))?.grid;
        let each = 2 * grid.len();
        let made = py.detach(|| {
            let mut values = vec![0.0_f32; rows.len() * each];
            fill(&rows, &mut values, each, threads, |row, out| self.heights_into(project, row, out))?;
            Ok(values)
        });
        let values = made.map_err(|e| error::data(py, &e))?;
        PyArray::from_vec(py, values).reshape([rows.len(), 2, grid.height_px, grid.width_px])
    }
}

type Traces<'py> = (Bound<'py, PyArray3<f32>>, Bound<'py, PyArray1<i64>>);

impl Dataset {
    fn load_project(&self) -> Result<Project, String> {
        let none = || format!("{}: no simulated run", self.rows.path().display());
        let run = self.rows.run().filter(|run| run.info().source == "sim").ok_or_else(none)?;
        Project::from_run(run).map_err(|e| format!("{}: {e}", self.rows.path().display()))
    }

    fn heights_into(&self, project: &Project, row: usize, out: &mut [f32]) -> Result<(), DatasetError> {
        let index = self.rows.sample_index(row)?;
        let pressed = project.twin_of(index).ok().and_then(|twin| {
            let (scenario, usable) = project.sweep.scenario(index, &twin);
            usable.ok()?;
            press_only(&twin, &project.library, &scenario, project.sweep.mechanics).ok()
        });
        let Some(contact) = pressed else {
            out.fill(f32::NAN);
            return Ok(());
        };
        let Some(press) = contact else { return Ok(()) };
        let half = out.len() / 2;
        for (jaw, out) in Jaw::BOTH.into_iter().zip(out.chunks_mut(half)) {
            let mm_per_px = (press.sensors[jaw].grid.metres_per_px * 1e3) as f32;
            let depth = &press.imprint[jaw].depth_px.values;
            out.iter_mut().zip(depth).for_each(|(out, px)| *out = px.max(0.0) * mm_per_px);
        }
        Ok(())
    }
}

fn cells_into(jaw: &JawContact, out: &mut [f32]) {
    for (i, out) in out.chunks_mut(4).enumerate().take(jaw.cell_x_mm.len()) {
        let cell = [&jaw.cell_x_mm, &jaw.cell_y_mm, &jaw.cell_area_mm2, &jaw.cell_force_n];
        out.iter_mut().zip(cell).for_each(|(out, column)| *out = column.get(i).copied().unwrap_or(0.0));
    }
}

/// Fills pieces of `each` values, one for each row, with `threads`. The first row that fails is the error.
fn fill<T: Send>(
    rows: &[usize],
    values: &mut [T],
    each: usize,
    threads: usize,
    of: impl Fn(usize, &mut [T]) -> Result<(), DatasetError> + Sync,
) -> Result<(), DatasetError> {
    let pieces: Vec<Mutex<&mut [T]>> = values.chunks_mut(each).map(Mutex::new).collect();
    let one = |i: usize| of(rows[i], &mut pieces[i].lock().unwrap_or_else(PoisonError::into_inner));
    in_parallel(rows.len(), threads, one).into_iter().collect()
}
