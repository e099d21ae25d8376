//! Samples and run folders on disk.
//!
//! ```
//! use gripgen_record::{decode_picture, encode_png};
//! use gripgen_twin::TactileImage;
//!
//! // Images of a sample are PNG: rows from the top, three bytes per pixel, red, green, blue.
//! let image = TactileImage { width_px: 2, height_px: 1, rgb: vec![255, 0, 0, 10, 20, 30] };
//! assert_eq!(decode_picture(&encode_png(&image)?)?, image);
//! # Ok::<(), gripgen_record::PictureError>(())
//! ```
//!
//! A run folder holds `run.json`, shards (`shard-00000.mcap`) with a sidecar each (`shard-00000.json`, written last),
//! and `index.csv`. A shard is an MCAP file of protobuf messages with embedded descriptors, so that Foxglove, Rerun
//! and the stock MCAP libraries read it without knowing gripgen. `docs/format.md` describes all of it.
//!
//! This crate does not know how samples are made. Reading holds one sample in memory, writing one as well.

mod background;
mod card;
mod dataset;
mod differences;
mod encode;
mod export;
mod film;
mod film_frame;
mod folder;
mod frame;
mod index;
mod lerobot;
mod parquet;
mod picture;
pub mod proto;
mod reader;
mod rig_log;
mod rig_run;
mod shard;
mod stored;
#[cfg(test)]
mod tests;
mod verify;
mod webdataset;

/// Version of gripgen.
pub(crate) const VERSION: &str = env!("CARGO_PKG_VERSION");

pub use background::Background;
pub use dataset::{Dataset, DatasetError, MeasuredRows, NoiseMode, PictureFileError, ReadImages, Table};
pub use differences::differences;
pub use encode::{EncodeOptions, EncodedRig, EncodedSample, Timed, VIEW_RATE_HZ, encode};
pub use export::{ExportDatasetError, ExportError, ExportOptions, export_sample};
pub use film::{Film, FilmOptions, encode_frame};
pub use film_frame::EncodedFrame;
pub use folder::{
    FolderError, PartialShard, RUN_SCHEMA, RunFolder, RunInfo, SHARD_SCHEMA, ShardStart, Sidecar, hash_file,
    is_url, sha256_hex,
};
pub use index::{INDEX_COLUMNS, csv_lines, extra_columns, index_header, index_row, status_name};
pub use lerobot::export_lerobot;
pub use parquet::export_parquet;
pub use picture::{PictureError, decode as decode_picture, encode_jpeg, encode_png, is_jpeg};
pub use reader::{ReadError, Record, ShardReader};
pub use rig_log::{RigLog, RigLogEvent, RigStream};
pub use rig_run::{
    FAILED_FOLDER, FrameView, RigCampaign, RigFilm, RigFrame, RigPull, RigResult, RigRunError, RigRunInfo,
    create_rig_run, discard_failed, failed_pulls, missing_pulls, rig_campaign, suspect_pulls, write_rig_pull,
};
pub use shard::{LAYOUT_VERSION, METADATA_NAME, RIG_SOURCE, ShardError, ShardInfo, ShardWriter};
pub use stored::{sample_covariates, sample_view};
pub use verify::{Verification, can_be_made_again, repair, verify};
pub use webdataset::{export_webdataset, webdataset_card, webdataset_rows};
