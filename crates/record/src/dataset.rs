//! A run or a folder of measured pulls as rows with random access: what training code reads.
//!
//! A row is one sample, counted from 0 in the order of the index; rows of shards that are not done are left out. Any
//! row can be read at any time from any thread. Memory does not grow with what was read: the shards used last stay open.

mod columns;
mod films;
mod images;
#[cfg(test)]
mod tests;

pub use columns::Table;
pub use images::NoiseMode;

use crate::folder::{FolderError, RunFolder};
use crate::index::{extra_columns, index_row};
use crate::picture::encode_png;
use crate::proto::gripgen_v1::Sample;
use crate::reader::{ReadError, Record, ShardReader};
use crate::shard::RIG_SOURCE;
use gripgen_twin::{Jaw, PerJaw, PullTrace, TactileImage};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, PoisonError};

/// Shards that stay open.
const OPEN_SHARDS: usize = 64;

/// Rows of simulated or measured pulls.
pub struct Dataset {
    path: PathBuf,
    table: Table,
    source: Source,
    image_size_px: Option<(u32, u32)>,
}

enum Source {
    Run {
        folder: Box<RunFolder>,
        /// Global index of the first sample and first row of each finished shard, by row.
        shards: Vec<FinishedShard>,
        open: Mutex<Vec<(u64, Arc<ShardReader>)>>,
    },
    Shard(Arc<ShardReader>),
    Measured(MeasuredRows),
}

/// Rows of measured pulls from a table.
pub struct MeasuredRows {
    /// Name of each pull.
    pub ids: Vec<String>,
    /// Force over time of each, where it was recorded.
    pub traces: Vec<Option<PullTrace>>,
    /// Reads the images of a pull, by its name.
    pub images: Box<ReadImages>,
    /// Width and height of all images.
    pub image_size_px: Option<(u32, u32)>,
}

/// Reads both images of a pull; `None` where it has none.
pub type ReadImages = dyn Fn(&str) -> Result<Option<PerJaw<TactileImage>>, PictureFileError> + Send + Sync;

/// Why an image file could not be read.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{}: {problem}", .path.display())]
pub struct PictureFileError {
    /// The file or folder.
    pub path: PathBuf,
    /// What the system or the decoder says.
    pub problem: String,
}

#[derive(Clone, Copy)]
struct FinishedShard {
    shard: u64,
    first_row: usize,
    first_sample: u64,
}

/// Why a dataset, or a row of it, could not be read. Every message names the file.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum DatasetError {
    /// Neither a run nor measured pulls.
    #[error("{}: neither a run folder (run.json), nor a folder of measured pulls (pulls.csv), nor a shard (.mcap)", .path.display())]
    Unknown {
        /// The path.
        path: PathBuf,
    },
    /// Nothing is finished.
    #[error("{}: no shard of this run is done", .path.display())]
    Empty {
        /// The folder.
        path: PathBuf,
    },
    /// The run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A shard.
    #[error(transparent)]
    Shard(#[from] ReadError),
    /// A shard that another run, or another version, made.
    #[error("{}: `{what}` is {found}, the run.json beside it says {wanted}", .path.display())]
    Mixed {
        /// The shard.
        path: PathBuf,
        /// What differs.
        what: &'static str,
        /// Value in the shard.
        found: String,
        /// Value of the run.
        wanted: String,
    },
    /// Images of measured pulls.
    #[error(transparent)]
    Images(#[from] PictureFileError),
    /// There is no such row.
    #[error("{}: there is no row {row}, it has {rows}", .path.display())]
    NoRow {
        /// The dataset.
        path: PathBuf,
        /// Row asked for.
        row: usize,
        /// Rows there are.
        rows: usize,
    },
    /// A row without what was asked for.
    #[error("{}: row {row} has no {what}", .path.display())]
    Missing {
        /// The dataset.
        path: PathBuf,
        /// The row.
        row: usize,
        /// What it lacks.
        what: &'static str,
    },
    /// Other noise of images that have theirs.
    #[error("{}: the noise of its images is in them", .path.display())]
    Noisy {
        /// The dataset.
        path: PathBuf,
    },
    /// Images of another size than the first.
    #[error("{}: an image of row {row} is {}x{} pixels, the first one {}x{}", .path.display(), .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// The dataset.
        path: PathBuf,
        /// The row.
        row: usize,
        /// Width and height found.
        found: (u32, u32),
        /// Those of the first image.
        wanted: (u32, u32),
    },
}

impl Dataset {
    /// Opens a run folder, of which it reads the index and no shard; or a single shard, of which it reads all samples without
    /// their images.
    pub fn open(path: &Path) -> Result<Self, DatasetError> {
        if path.join("run.json").is_file() {
            return Self::open_run(path);
        }
        if path.is_file() {
            return Self::open_shard(path);
        }
        Err(DatasetError::Unknown { path: path.into() })
    }

    fn open_run(path: &Path) -> Result<Self, DatasetError> {
        let folder = RunFolder::open(path)?;
        let mut table = Table::of_index(&folder.info().extra_columns);
        let mut shards = Vec::new();
        for shard in 0..folder.info().shards {
            let Some(sidecar) = folder.finished(shard)? else { continue };
            let (found, wanted) = (&sidecar.gripgen_version, &folder.info().gripgen_version);
            if found != wanted {
                let (path, what) = (folder.sidecar_path(shard), "gripgen_version");
                return Err(DatasetError::Mixed { path, what, found: found.clone(), wanted: wanted.clone() });
            }
            shards.push(FinishedShard { shard, first_row: table.rows(), first_sample: sidecar.first_sample });
            sidecar.rows.iter().for_each(|row| table.push(row));
        }
        if table.rows() == 0 {
            return Err(DatasetError::Empty { path: path.into() });
        }
        let source = Source::Run { folder: Box::new(folder), shards, open: Mutex::default() };
        let table = table.finished();
        let mut found = Self { path: path.into(), table, source, image_size_px: None };
        found.image_size_px = found.first_image_size()?;
        Ok(found)
    }

    /// Rows of measured pulls, with one row of `table` each.
    pub fn of_measured(path: &Path, table: Table, rows: MeasuredRows) -> Self {
        let image_size_px = rows.image_size_px;
        Self { path: path.into(), table, source: Source::Measured(rows), image_size_px }
    }

    fn open_shard(path: &Path) -> Result<Self, DatasetError> {
        let reader = ShardReader::open(path)?;
        let samples = reader.indices().map(|i| reader.sample(i)).collect::<Result<Vec<_>, _>>()?;
        let drawn =
            |s: &Sample| s.drawn_number.keys().chain(s.drawn_text.keys()).cloned().collect::<Vec<_>>();
        let names: BTreeSet<String> = samples.iter().flat_map(drawn).collect();
        let extra = extra_columns(names.iter().map(String::as_str));
        let rows: Vec<Vec<String>> = samples.iter().map(|sample| index_row(sample, &extra)).collect();
        if rows.is_empty() {
            return Err(DatasetError::Empty { path: path.into() });
        }
        let source = Source::Shard(Arc::new(reader));
        let table = Table::of_index_rows(&extra, &rows);
        let mut found = Self { path: path.into(), table, source, image_size_px: None };
        found.image_size_px = found.first_image_size()?;
        Ok(found)
    }

    /// Where it is.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The run folder, where it is one.
    pub fn run(&self) -> Option<&RunFolder> {
        match &self.source {
            Source::Run { folder, .. } => Some(folder),
            Source::Shard(_) | Source::Measured(_) => None,
        }
    }

    /// One row per sample: what was varied, the label, how it ended. Of measured pulls the columns of their table.
    pub fn table(&self) -> &Table {
        &self.table
    }

    /// Width and height of all images; `None` if there are none.
    pub fn image_size_px(&self) -> Option<(u32, u32)> {
        self.image_size_px
    }

    /// Global index of the sample in a row of a run.
    pub fn sample_index(&self, row: usize) -> Result<u64, DatasetError> {
        self.check_row(row)?;
        match &self.source {
            Source::Run { shards, .. } => {
                let at = shards[shards.partition_point(|s| s.first_row <= row) - 1];
                Ok(at.first_sample + (row - at.first_row) as u64)
            }
            Source::Shard(reader) => Ok(reader.indices().start + row as u64),
            Source::Measured(_) => Ok(row as u64),
        }
    }

    /// The row of the sample with this global index, or of the pull with this id.
    pub fn row_of(&self, id: &str) -> Option<usize> {
        match &self.source {
            Source::Run { shards, .. } => {
                let index: u64 = id.parse().ok()?;
                let place = shards.partition_point(|s| s.first_sample <= index).checked_sub(1)?;
                let row = shards[place].first_row + (index - shards[place].first_sample) as usize;
                let end = shards.get(place + 1).map_or(self.table.rows(), |next| next.first_row);
                (row < end).then_some(row)
            }
            Source::Shard(reader) => {
                let row = id.parse::<u64>().ok()?.checked_sub(reader.indices().start)? as usize;
                (row < self.table.rows()).then_some(row)
            }
            Source::Measured(rows) => rows.ids.iter().position(|name| name == id),
        }
    }

    /// Both images of a row into `out`: `[2, height, width, 3]` bytes, left jaw first.
    pub fn images_into(&self, row: usize, out: &mut [u8]) -> Result<(), DatasetError> {
        self.images_with(row, NoiseMode::Stored, out)
    }

    /// Whether the images of its rows are stored without their noise.
    ///
    /// # Errors
    ///
    /// A shard that cannot be read.
    pub fn has_clean_images(&self) -> Result<bool, DatasetError> {
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => Ok(self.shard_of(0)?.0.has_clean_images()),
            Source::Measured(_) => Ok(false),
        }
    }

    /// The same with other noise, where the noise is not in the stored images already.
    ///
    /// # Errors
    ///
    /// Other noise than that of the images, where they have it; a row without images, or a shard that cannot be read.
    pub fn images_with(&self, row: usize, mode: NoiseMode, out: &mut [u8]) -> Result<(), DatasetError> {
        self.check_row(row)?;
        if mode != NoiseMode::Stored && !self.has_clean_images()? {
            return Err(DatasetError::Noisy { path: self.path.clone() });
        }
        let missing = || DatasetError::Missing { path: self.path.clone(), row, what: "images" };
        let wanted = self.image_size_px.ok_or_else(missing)?;
        let size = |found| DatasetError::Size { path: self.path.clone(), row, found, wanted };
        let (left, right) = out.split_at_mut(out.len() / 2);
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => {
                let (reader, index) = self.shard_of(row)?;
                let raw = reader.raw(index)?;
                let both = raw.images.as_ref().ok_or_else(missing)?;
                let noise = reader.noise_of(index, &raw.sample)?;
                for (jaw, out) in [(Jaw::Left, left), (Jaw::Right, right)] {
                    reader.image_into(index, jaw, &both[jaw], raw.raw_images, wanted, out)?.map_err(size)?;
                    reader.put_back(jaw, out);
                    if let Some(noise) = noise[jaw].and_then(|noise| mode.of(noise)) {
                        noise.add(out);
                    }
                }
            }
            Source::Measured(rows) => {
                let images = (rows.images)(&rows.ids[row])?.ok_or_else(missing)?;
                for (image, out) in [(images.left, left), (images.right, right)] {
                    if (image.width_px, image.height_px) != wanted {
                        return Err(size((image.width_px, image.height_px)));
                    }
                    out.copy_from_slice(&image.rgb);
                }
            }
        }
        Ok(())
    }

    /// Both images of a row as PNG, left jaw first; `None` where it has none.
    pub fn images_png(&self, row: usize) -> Result<Option<[Vec<u8>; 2]>, DatasetError> {
        self.check_row(row)?;
        let coded = |image: &TactileImage| {
            let problem = |e: crate::PictureError| PictureFileError {
                path: self.path.clone(),
                problem: format!("row {row}: {e}"),
            };
            encode_png(image).map_err(|e| DatasetError::Images(problem(e)))
        };
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => {
                let (reader, index) = self.shard_of(row)?;
                if reader.has_raw_images() || reader.has_clean_images() {
                    let images = reader.record(index)?.images;
                    return images.map(|i| Ok([coded(&i.left)?, coded(&i.right)?])).transpose();
                }
                Ok(reader.images_png(index)?)
            }
            Source::Measured(rows) => match (rows.images)(&rows.ids[row])? {
                Some(images) => Ok(Some([coded(&images.left)?, coded(&images.right)?])),
                None => Ok(None),
            },
        }
    }

    /// Whether its rows may have images without contact that [`Dataset::rest_png`] knows: those of a rig.
    pub fn has_rest(&self) -> bool {
        match &self.source {
            Source::Run { folder, .. } => folder.info().source == RIG_SOURCE,
            Source::Shard(reader) => reader.is_rig(),
            Source::Measured(_) => false,
        }
    }

    /// Both images of a row of a rig's run before the grip, where there are any.
    pub fn rest(&self, row: usize) -> Result<Option<PerJaw<TactileImage>>, DatasetError> {
        self.check_row(row)?;
        if !self.has_rest() {
            return Ok(None);
        }
        let (reader, index) = self.shard_of(row)?;
        Ok(reader.rest(index)?)
    }

    /// The same as PNG, left jaw first.
    pub fn rest_png(&self, row: usize) -> Result<Option<[Vec<u8>; 2]>, DatasetError> {
        self.check_row(row)?;
        if !self.has_rest() {
            return Ok(None);
        }
        let (reader, index) = self.shard_of(row)?;
        let both = reader.raw_rest(index)?;
        Ok(both.map(|both| reader.png_of(index, "_rest", &both)).transpose()?)
    }

    /// The force over time of a row, where it is stored.
    pub fn trace(&self, row: usize) -> Result<Option<PullTrace>, DatasetError> {
        self.check_row(row)?;
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => {
                let (reader, index) = self.shard_of(row)?;
                Ok(reader.pull(index)?.1)
            }
            Source::Measured(rows) => Ok(rows.traces[row].clone()),
        }
    }

    /// Both images of a row; `None` where it has none.
    ///
    /// # Errors
    ///
    /// A row that cannot be read.
    pub fn images(&self, row: usize) -> Result<Option<PerJaw<TactileImage>>, DatasetError> {
        self.check_row(row)?;
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => {
                let (reader, index) = self.shard_of(row)?;
                Ok(reader.record(index)?.images)
            }
            Source::Measured(rows) => Ok((rows.images)(&rows.ids[row])?),
        }
    }

    /// Everything of a row of a run; `None` for measured pulls from a table.
    pub fn record(&self, row: usize) -> Result<Option<Record>, DatasetError> {
        self.check_row(row)?;
        match &self.source {
            Source::Run { .. } | Source::Shard(_) => {
                let (reader, index) = self.shard_of(row)?;
                Ok(Some(reader.record(index)?))
            }
            Source::Measured(_) => Ok(None),
        }
    }

    fn check_row(&self, row: usize) -> Result<(), DatasetError> {
        let rows = self.table.rows();
        if row < rows { Ok(()) } else { Err(DatasetError::NoRow { path: self.path.clone(), row, rows }) }
    }

    /// The shard of a row and the global index of its sample.
    fn shard_of(&self, row: usize) -> Result<(Arc<ShardReader>, u64), DatasetError> {
        let (folder, shards, open) = match &self.source {
            Source::Run { folder, shards, open } => (folder, shards, open),
            Source::Shard(reader) => return Ok((reader.clone(), reader.indices().start + row as u64)),
            Source::Measured(_) => return Err(DatasetError::Unknown { path: self.path.clone() }),
        };
        let at = shards[shards.partition_point(|s| s.first_row <= row) - 1];
        let index = at.first_sample + (row - at.first_row) as u64;
        let lock = || open.lock().unwrap_or_else(PoisonError::into_inner);
        {
            let mut open = lock();
            if let Some(i) = open.iter().position(|(shard, _)| *shard == at.shard) {
                let entry = open.remove(i);
                let reader = entry.1.clone();
                open.push(entry);
                return Ok((reader, index));
            }
        }
        let path = folder.shard_path(at.shard);
        let reader = Arc::new(ShardReader::open(&path)?);
        let found = reader.metadata().get("config_sha256").cloned().unwrap_or_default();
        let wanted = &folder.info().config_sha256;
        if found != *wanted {
            return Err(DatasetError::Mixed { path, what: "config_sha256", found, wanted: wanted.clone() });
        }
        let mut open = lock();
        if open.len() >= OPEN_SHARDS {
            open.remove(0);
        }
        open.push((at.shard, reader.clone()));
        Ok((reader, index))
    }

    /// Size of the first image of a run; a sample that failed has none.
    fn first_image_size(&self) -> Result<Option<(u32, u32)>, DatasetError> {
        let (reader, _) = self.shard_of(0)?;
        if !reader.has_images() {
            return Ok(None);
        }
        for row in 0..self.table.rows() {
            let (reader, index) = self.shard_of(row)?;
            if let Some(images) = reader.record(index)?.images {
                return Ok(Some((images.left.width_px, images.left.height_px)));
            }
        }
        Ok(None)
    }
}
