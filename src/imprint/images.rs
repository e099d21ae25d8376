//! Images of measured pulls, from a folder of files or from the shards of a run.

use super::press::Seen;
use gripgen_record::{
    FolderError, PullImagesError, ReadError, RunFolder, ShardReader, pulls_with_images, read_pull_images,
};
use gripgen_twin::PerJaw;
use std::collections::BTreeSet;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// Why images of measured pulls could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImprintImagesError {
    /// Files beside a table.
    #[error(transparent)]
    Files(#[from] PullImagesError),
    /// A run folder.
    #[error(transparent)]
    Folder(#[from] FolderError),
    /// A shard of it.
    #[error(transparent)]
    Shard(#[from] ReadError),
    /// A pull without images.
    #[error("pull `{id}` has no images")]
    None {
        /// The pull.
        id: String,
    },
}

/// Where the images are.
pub(super) enum ImageSource {
    /// `images/` beside `pulls.csv`.
    Files(PathBuf, BTreeSet<String>),
    /// Shards with the samples that they hold; ids are the samples' indices.
    Run(Vec<(Range<u64>, ShardReader)>),
}

impl ImageSource {
    pub(super) fn open(folder: &Path) -> Result<Self, ImprintImagesError> {
        if !folder.join("run.json").is_file() {
            return Ok(Self::Files(folder.into(), pulls_with_images(folder)?));
        }
        let run = RunFolder::open(folder)?;
        let mut shards = Vec::new();
        for shard in 0..run.info().shards {
            if run.finished(shard)?.is_some() {
                let reader = ShardReader::open(&run.shard_path(shard))?;
                if reader.has_images() {
                    shards.push((reader.indices(), reader));
                }
            }
        }
        Ok(Self::Run(shards))
    }

    pub(super) fn has(&self, id: &str) -> bool {
        match self {
            Self::Files(_, ids) => ids.contains(id),
            Self::Run(_) => self.shard_of(id).is_some(),
        }
    }

    fn shard_of(&self, id: &str) -> Option<(u64, &ShardReader)> {
        let (Self::Run(shards), Ok(index)) = (self, id.parse::<u64>()) else { return None };
        shards.iter().find(|(held, _)| held.contains(&index)).map(|(_, reader)| (index, reader))
    }

    pub(super) fn read(&self, id: &str) -> Result<Seen, ImprintImagesError> {
        if let Self::Files(folder, _) = self {
            let images = read_pull_images(folder, id)?;
            return Ok(Seen { grip: images.grip, rest: images.rest, grip_pose: None });
        }
        let none = || ImprintImagesError::None { id: id.into() };
        let (index, reader) = self.shard_of(id).ok_or_else(none)?;
        let record = reader.record(index)?;
        let grip = record.images.ok_or_else(none)?;
        let grip_pose = Some(record.sample.grip_pose as usize);
        Ok(Seen { grip, rest: PerJaw { left: None, right: None }, grip_pose })
    }
}
