//! Images of measured pulls, from a folder of files or from the shards of a run.

use super::press::Seen;
use gripgen_measured::{pulls_with_images, read_pull_images};
use gripgen_record::{Dataset, DatasetError, PictureFileError};
use gripgen_twin::PerJaw;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Why images of measured pulls could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ImprintImagesError {
    /// Files beside a table.
    #[error(transparent)]
    Files(#[from] PictureFileError),
    /// A run.
    #[error(transparent)]
    Run(#[from] DatasetError),
    /// A pull without images.
    #[error("pull `{id}` has no images")]
    None {
        /// The pull.
        id: String,
    },
}

/// Where the images are.
pub(crate) enum ImageSource {
    /// `images/` beside `pulls.csv`.
    Files(PathBuf, BTreeSet<String>),
    /// The samples of a run; ids are their indices.
    Run(Box<Dataset>),
}

impl ImageSource {
    pub(crate) fn open(folder: &Path) -> Result<Self, ImprintImagesError> {
        if folder.join("run.json").is_file() {
            return Ok(Self::Run(Box::new(Dataset::open(folder)?)));
        }
        Ok(Self::Files(folder.into(), pulls_with_images(folder)?))
    }

    pub(crate) fn has(&self, id: &str) -> bool {
        match self {
            Self::Files(_, ids) => ids.contains(id),
            Self::Run(samples) => samples.image_size_px().is_some() && samples.row_of(id).is_some(),
        }
    }

    pub(crate) fn read(&self, id: &str) -> Result<Seen, ImprintImagesError> {
        let none = || ImprintImagesError::None { id: id.into() };
        match self {
            Self::Files(folder, _) => {
                let images = read_pull_images(folder, id)?;
                Ok(Seen { grip: images.grip, rest: images.rest, grip_pose: None })
            }
            Self::Run(samples) => {
                let row = samples.row_of(id).ok_or_else(none)?;
                let record = samples.record(row)?.ok_or_else(none)?;
                let grip = record.images.ok_or_else(none)?;
                let (left, right) = samples.rest(row)?.map(|rest| (rest.left, rest.right)).unzip();
                // Which of the twin's grips a rig made is not known to it.
                let grip_pose = (!samples.has_rest()).then_some(record.sample.grip_pose as usize);
                Ok(Seen { grip, rest: PerJaw { left, right }, grip_pose })
            }
        }
    }
}
