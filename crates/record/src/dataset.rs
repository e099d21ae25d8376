//! A run or a folder of measured pulls as rows with random access: what training code reads.
//!
//! A row is one sample, counted from 0 in the order of the index; rows of shards that are not done are left out. Any
//! row can be read at any time from any thread. Memory does not grow with what was read: the shards used last stay open.

mod columns;
mod images;
mod roles;
#[cfg(test)]
mod tests;

pub use columns::Table;
pub use images::NoiseMode;

use crate::film::Film;
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

/// Where a row is.
enum Place<'a> {
    /// A sample of a shard, by its global index.
    Sample(Arc<ShardReader>, u64),
    /// A measured pull, by its row.
    Pull(&'a MeasuredRows, usize),
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
    /// A shard that another run made.
    #[error("{}: `config_sha256` is {found}, the run.json of its folder says {wanted}", .path.display())]
    Mixed {
        /// The shard.
        path: PathBuf,
        /// Value in the shard.
        found: String,
        /// Value of the run.
        wanted: String,
    },
    /// Images of measured pulls.
    #[error(transparent)]
    Images(#[from] PictureFileError),
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
    /// A row that is not there, or an image of another size than the first.
    #[error("{}: {problem}", .path.display())]
    Row {
        /// The dataset.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

impl DatasetError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            DatasetError::Unknown { .. } => Some("`gripgen sweep` writes a run folder"),
            DatasetError::Empty { .. } => Some("run the sweep again to continue it"),
            DatasetError::Folder(e) => e.hint(),
            DatasetError::Shard(_) => {
                Some("`gripgen verify` reads the whole run; sweeping again rebuilds what is broken")
            }
            DatasetError::Mixed { .. } => Some("delete the shard and sweep again"),
            DatasetError::Noisy { .. } => {
                Some("sweep with images = \"clean\" to choose the noise when reading")
            }
            DatasetError::Missing { .. } => Some("ds.table() says what there is"),
            DatasetError::Images(_) | DatasetError::Row { .. } => None,
        }
    }
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

    /// Whether the images of its rows are stored without their noise.
    ///
    /// # Errors
    ///
    /// A shard that cannot be read.
    pub fn has_clean_images(&self) -> Result<bool, DatasetError> {
        Ok(self.first_shard()?.is_some_and(|reader| reader.has_clean_images()))
    }

    /// Both images of a row into `out`: `[2, height, width, 3]` bytes, left jaw first; with other noise, where the noise is not in
    /// the stored images already.
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
        let size = |found: (u32, u32)| {
            let ((width, height), (w, h)) = (found, wanted);
            self.wrong(format!("an image of row {row} is {width}x{height} pixels, the first one {w}x{h}"))
        };
        let (left, right) = out.split_at_mut(out.len() / 2);
        if let Place::Sample(reader, index) = self.place(row)? {
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
            return Ok(());
        }
        let images = self.images(row)?.ok_or_else(missing)?;
        for (image, out) in [(images.left, left), (images.right, right)] {
            if (image.width_px, image.height_px) != wanted {
                return Err(size((image.width_px, image.height_px)));
            }
            out.copy_from_slice(&image.rgb);
        }
        Ok(())
    }

    /// Both images of a row as PNG, left jaw first; `None` where it has none.
    pub fn images_png(&self, row: usize) -> Result<Option<[Vec<u8>; 2]>, DatasetError> {
        if let Place::Sample(reader, index) = self.place(row)?
            && !(reader.has_raw_images() || reader.has_clean_images())
        {
            return Ok(reader.images_png(index)?);
        }
        let coded =
            |image: &TactileImage| encode_png(image).map_err(|e| self.wrong(format!("row {row}: {e}")));
        self.images(row)?.map(|both| Ok([coded(&both.left)?, coded(&both.right)?])).transpose()
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
        match self.rig_place(row)? {
            Some((reader, index)) => Ok(reader.rest(index)?),
            None => Ok(None),
        }
    }

    /// The same as PNG, left jaw first.
    pub fn rest_png(&self, row: usize) -> Result<Option<[Vec<u8>; 2]>, DatasetError> {
        let Some((reader, index)) = self.rig_place(row)? else { return Ok(None) };
        let both = reader.raw_rest(index)?;
        Ok(both.map(|both| reader.png_of(index, "_rest", &both)).transpose()?)
    }

    /// The force over time of a row, where it is stored.
    pub fn trace(&self, row: usize) -> Result<Option<PullTrace>, DatasetError> {
        match self.place(row)? {
            Place::Sample(reader, index) => Ok(reader.pull(index)?.1),
            Place::Pull(rows, row) => Ok(rows.traces[row].clone()),
        }
    }

    /// Both images of a row; `None` where it has none.
    ///
    /// # Errors
    ///
    /// A row that cannot be read.
    pub fn images(&self, row: usize) -> Result<Option<PerJaw<TactileImage>>, DatasetError> {
        match self.place(row)? {
            Place::Sample(reader, index) => Ok(reader.record(index)?.images),
            Place::Pull(rows, row) => Ok((rows.images)(&rows.ids[row])?),
        }
    }

    /// Whether pulls of its rows are filmed.
    ///
    /// # Errors
    ///
    /// A shard that cannot be read.
    pub fn has_films(&self) -> Result<bool, DatasetError> {
        Ok(self.first_shard()?.is_some_and(|reader| reader.has_film()))
    }

    /// The film of a row's pull, where there is one.
    ///
    /// # Errors
    ///
    /// A row that is not there, or a shard that cannot be read.
    pub fn film(&self, row: usize) -> Result<Option<Film>, DatasetError> {
        match self.place(row)? {
            Place::Sample(reader, index) => Ok(reader.film(index)?),
            Place::Pull(..) => Ok(None),
        }
    }

    /// Everything of a row of a run; `None` for measured pulls from a table.
    pub fn record(&self, row: usize) -> Result<Option<Record>, DatasetError> {
        match self.place(row)? {
            Place::Sample(reader, index) => Ok(Some(reader.record(index)?)),
            Place::Pull(..) => Ok(None),
        }
    }

    fn check_row(&self, row: usize) -> Result<(), DatasetError> {
        let rows = self.table.rows();
        let missing = || self.wrong(format!("there is no row {row}, it has {rows}"));
        if row < rows { Ok(()) } else { Err(missing()) }
    }

    fn wrong(&self, problem: String) -> DatasetError {
        DatasetError::Row { path: self.path.clone(), problem }
    }

    /// The first shard; `None` of measured pulls.
    fn first_shard(&self) -> Result<Option<Arc<ShardReader>>, DatasetError> {
        match &self.source {
            Source::Measured(_) => Ok(None),
            _ => match self.place(0)? {
                Place::Sample(reader, _) => Ok(Some(reader)),
                Place::Pull(..) => Ok(None),
            },
        }
    }

    /// Where a row of a rig's run is; `None` of all else.
    fn rig_place(&self, row: usize) -> Result<Option<(Arc<ShardReader>, u64)>, DatasetError> {
        if !self.has_rest() {
            return self.check_row(row).map(|()| None);
        }
        match self.place(row)? {
            Place::Sample(reader, index) => Ok(Some((reader, index))),
            Place::Pull(..) => Ok(None),
        }
    }

    /// Where a row is, its shard opened.
    fn place(&self, row: usize) -> Result<Place<'_>, DatasetError> {
        self.check_row(row)?;
        let (folder, shards, open) = match &self.source {
            Source::Run { folder, shards, open } => (folder, shards, open),
            Source::Shard(reader) => {
                return Ok(Place::Sample(reader.clone(), reader.indices().start + row as u64));
            }
            Source::Measured(rows) => return Ok(Place::Pull(rows, row)),
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
                return Ok(Place::Sample(reader, index));
            }
        }
        let path = folder.shard_path(at.shard);
        let reader = Arc::new(ShardReader::open(&path)?);
        let found = reader.metadata().get("config_sha256").cloned().unwrap_or_default();
        let wanted = &folder.info().config_sha256;
        if found != *wanted {
            return Err(DatasetError::Mixed { path, found, wanted: wanted.clone() });
        }
        let mut open = lock();
        if open.len() >= OPEN_SHARDS {
            open.remove(0);
        }
        open.push((at.shard, reader.clone()));
        Ok(Place::Sample(reader, index))
    }

    /// Size of the first image of a run; a sample that failed has none.
    fn first_image_size(&self) -> Result<Option<(u32, u32)>, DatasetError> {
        if self.first_shard()?.is_some_and(|reader| !reader.has_images()) {
            return Ok(None);
        }
        for row in 0..self.table.rows() {
            if let Some(images) = self.images(row)? {
                return Ok(Some((images.left.width_px, images.left.height_px)));
            }
        }
        Ok(None)
    }
}
