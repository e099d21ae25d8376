//! Pictures of the page, decoded when somebody looks at them.

use gripgen::record::{Dataset, encode_png};
use gripgen::twin::{Jaw, PerJaw};
use gripgen_rig::camera::{CameraFrame, CameraView, SHIPPED_FRAME_LIMITS, decode_jpeg};
use std::path::PathBuf;
use std::sync::Arc;

/// Where a picture comes from.
#[derive(Debug, Clone)]
pub enum Picture {
    /// A frame of a camera, and how it is looked at.
    Frame(Arc<CameraFrame>, PerJaw<CameraView>),
    /// The last sample of a shard.
    Shard(PathBuf),
}

impl Picture {
    /// As a PNG; `None` where there is none, or it cannot be read.
    pub fn png(&self, jaw: Jaw) -> Option<Vec<u8>> {
        match self {
            Self::Frame(frame, views) => {
                let frame = decode_jpeg(&frame.jpeg, &SHIPPED_FRAME_LIMITS).ok()?;
                encode_png(&views[jaw].apply(&frame).ok()?).ok()
            }
            Self::Shard(path) => {
                let shard = Dataset::open(path).ok()?;
                let last = shard.table().rows().checked_sub(1)?;
                let [left, right] = shard.images_png(last).ok()??;
                Some(if jaw == Jaw::Left { left } else { right })
            }
        }
    }
}
