//! `_core.Stream`: batches of a sweep that are made while somebody trains on them.

mod samples;

use crate::{error, film, values};
use gripgen::record::proto::gripgen_v1::Status;
use gripgen::record::{Table, extra_columns, status_name};
use gripgen::twin::config::ImageStorage;
use gripgen::twin::{Jaw, Values};
use gripgen::{Location, Project};
use numpy::{PyArray, PyArray1, PyArray5, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use samples::{SampleStream, StreamError, StreamOptions, Streamed, StreamedSample};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Time between two looks at the interpreter's signals.
const BETWEEN_LOOKS: Duration = Duration::from_millis(100);

/// A sweep that is read while it is made. One reader at a time.
#[pyclass(frozen, module = "gripgen._core")]
pub struct Stream {
    project: Arc<Project>,
    samples: SampleStream,
    kept: Vec<String>,
    /// Width and height of the images.
    size_px: Option<(u32, u32)>,
    /// Whether batches have films.
    films: bool,
}

/// Images, labels, columns, films, and how many samples were read for it.
type Batch<'py> = (
    Option<Bound<'py, PyArray5<u8>>>,
    Bound<'py, PyArray1<f32>>,
    Bound<'py, PyDict>,
    Option<Bound<'py, PyList>>,
    u64,
);

#[pymethods]
impl Stream {
    #[new]
    #[pyo3(signature = (config, overrides = None, first = 0, every = 1, jobs = 1, ahead = 64, status = None, films = false))]
    #[expect(clippy::too_many_arguments, reason = "keywords of a constructor")]
    fn new(
        py: Python<'_>,
        config: &str,
        overrides: Option<&Bound<'_, PyDict>>,
        first: u64,
        every: u64,
        jobs: usize,
        ahead: usize,
        status: Option<Vec<String>>,
        films: bool,
    ) -> PyResult<Self> {
        let sets = values::overrides(overrides)?;
        let loaded = py.detach(|| Project::load(&Location::parse(config), &sets));
        let project = Arc::new(loaded.map_err(|e| error::load(py, e))?);
        let size_px = match project.sweep.images {
            ImageStorage::None => None,
            _ => {
                let sensor = project.library.sensor(&project.twin.optics.left);
                let grid = sensor.map_err(|e| error::missing(py, &e.to_string(), None))?.grid;
                Some((grid.width_px as u32, grid.height_px as u32))
            }
        };
        let options = StreamOptions { first, every, jobs, ahead, films };
        let samples = SampleStream::new(project.clone(), options);
        let kept = status.unwrap_or_else(|| {
            [Status::Slipped, Status::NoContact].map(status_name).map(Into::into).to_vec()
        });
        Ok(Self { project, samples, kept, size_px, films })
    }

    /// Number of samples of the sweep, its seed, the hash of its configuration, the columns of its rows, and whether its pulls are filmed.
    #[getter]
    fn info<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = PyDict::new(py);
        found.set_item("samples", self.project.sweep.samples)?;
        found.set_item("seed", self.project.sweep.seed)?;
        found.set_item("config_sha256", &self.project.config_sha256)?;
        let columns: Vec<String> = self.table(&[]).columns().iter().map(|(name, _)| name.clone()).collect();
        found.set_item("columns", columns)?;
        found.set_item("filmed", self.project.sweep.film.is_some())?;
        Ok(found)
    }

    /// Width and height of the images; None if the sweep makes none.
    #[getter]
    fn image_size_px(&self) -> Option<(u32, u32)> {
        self.size_px
    }

    /// The next rows that are kept, fewer at the end of the sweep: uint8[B, 2, H, W, 3], float32[B], the columns of these rows, their films as dicts of
    /// arrays (None where the stream has none, or a pull), and how many samples were read for them.
    fn batch<'py>(&self, py: Python<'py>, size: usize, columns: Vec<String>) -> PyResult<Batch<'py>> {
        let (mut found, mut read): (Vec<StreamedSample>, u64) = (Vec::new(), 0);
        let mut looked = Instant::now();
        while found.len() < size {
            match py.detach(|| self.samples.next(BETWEEN_LOOKS)).map_err(|e| ended(py, &e))? {
                Streamed::Sample(sample) => {
                    read += 1;
                    if self.kept.iter().any(|kept| kept == status_name(sample.status)) {
                        found.push(*sample);
                    }
                }
                Streamed::Pending => {}
                Streamed::End => break,
            }
            if looked.elapsed() >= BETWEEN_LOOKS {
                looked = Instant::now();
                py.check_signals()?;
            }
        }
        let table = self.table(&found);
        let labels = table.numbers("max_pull_force_n").unwrap_or_default();
        let labels: Vec<f32> = labels.iter().map(|&force_n| force_n as f32).collect();
        let picked = PyDict::new(py);
        for name in columns {
            let Some((_, column)) = table.columns().iter().find(|(known, _)| *known == name) else {
                let all: Vec<&str> = table.columns().iter().map(|(name, _)| name.as_str()).collect();
                let what = format!("there is no column '{name}'; there are {}", all.join(", "));
                return Err(error::missing(py, &what, None));
            };
            match column {
                Values::Numbers(x) => picked.set_item(name, PyArray1::from_slice(py, x))?,
                Values::Words(words) => picked.set_item(name, PyList::new(py, words)?)?,
            }
        }
        let images = self.size_px.map(|size_px| pixels(py, &found, size_px)).transpose()?;
        let films = self.films.then(|| -> PyResult<_> {
            let each = found.iter().map(|s| s.film.as_ref().map(|f| film::arrays(py, f)).transpose());
            PyList::new(py, each.collect::<PyResult<Vec<_>>>()?)
        });
        Ok((images, PyArray1::from_vec(py, labels), picked, films.transpose()?, read))
    }
}

impl Stream {
    fn table(&self, found: &[StreamedSample]) -> Table {
        let extra = extra_columns(self.project.sweep.drawn_keys());
        Table::of_index_rows(&extra, found.iter().map(|sample| &sample.row))
    }
}

/// Images of these samples: uint8[B, 2, H, W, 3], left jaw first.
fn pixels<'py>(
    py: Python<'py>,
    found: &[StreamedSample],
    (width, height): (u32, u32),
) -> PyResult<Bound<'py, PyArray5<u8>>> {
    let shape = [found.len(), 2, height as usize, width as usize, 3];
    let mut all = Vec::with_capacity(shape.iter().product());
    for sample in found {
        let index = sample.index;
        let Some(images) = &sample.images else {
            let what = format!("sample {index} has no images: a failed sample has none");
            return Err(error::missing(py, &what, Some("leave `failed` out of status")));
        };
        for jaw in Jaw::BOTH {
            let image = &images[jaw];
            if (image.width_px, image.height_px) != (width, height) {
                let (w, h) = (image.width_px, image.height_px);
                let what =
                    format!("an image of sample {index} is {w}x{h} pixels, the first one {width}x{height}");
                return Err(error::missing(py, &what, None));
            }
            all.extend_from_slice(&image.rgb);
        }
    }
    PyArray::from_vec(py, all).reshape(shape)
}

fn ended(py: Python<'_>, e: &StreamError) -> PyErr {
    let hint = "begin it in the process that reads it: iterate over the stream there, or take gg.torch.PullStream for workers of a loader";
    error::missing(py, &e.to_string(), matches!(e, StreamError::Forked { .. }).then_some(hint))
}
