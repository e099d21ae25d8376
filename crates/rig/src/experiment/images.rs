//! Images of both jaws, new ones.

use super::fault::Fault;
use super::run::Experiment;
use crate::camera::{CameraFrame, CameraWaitError, SHIPPED_FRAME_LIMITS, decode_jpeg};
use crate::stamped::Stamped;
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// When a frame was taken and came.
#[derive(Debug, Clone, PartialEq)]
pub struct FrameStamp {
    /// Which camera.
    pub jaw: Jaw,
    /// What it was taken for.
    pub what: &'static str,
    /// When it came.
    pub at: Instant,
    /// The camera's clock, where it has one.
    pub device_time_s: Option<f64>,
}

/// Images with their stamps.
pub(super) struct Seen {
    pub(super) images: PerJaw<TactileImage>,
    pub(super) stamps: Vec<FrameStamp>,
}

impl Experiment<'_> {
    /// The first frame of each camera that comes after this moment. A frame with the stamp of one before it is the past:
    /// the camera is frozen.
    pub(super) fn look_at_gels(&mut self, what: &'static str, before: &[FrameStamp]) -> Result<Seen, Fault> {
        let asked = Instant::now();
        let left = self.frame_after(Jaw::Left, asked)?;
        let right = self.frame_after(Jaw::Right, asked)?;
        let views = self.config.views();
        let image = |jaw: Jaw, frame: &Stamped<Arc<CameraFrame>>| {
            let frame = decode_jpeg(&frame.event.jpeg, &SHIPPED_FRAME_LIMITS)
                .map_err(|source| Fault::Frame { jaw, source })?;
            views[jaw].apply(&frame).map_err(|source| Fault::View { jaw, source })
        };
        let images = PerJaw { left: image(Jaw::Left, &left)?, right: image(Jaw::Right, &right)? };
        let stamp = |jaw, frame: &Stamped<Arc<CameraFrame>>| FrameStamp {
            jaw,
            what,
            at: frame.at,
            device_time_s: frame.event.device_time_s,
        };
        let stamps = vec![stamp(Jaw::Left, &left), stamp(Jaw::Right, &right)];
        for new in &stamps {
            let same = |old: &&FrameStamp| old.jaw == new.jaw && old.device_time_s == new.device_time_s;
            if let Some(time_s) = before.iter().find(same).and_then(|old| old.device_time_s) {
                return Err(Fault::Frozen { jaw: new.jaw, time_s });
            }
        }
        Ok(Seen { images, stamps })
    }

    fn frame_after(&mut self, jaw: Jaw, asked: Instant) -> Result<Stamped<Arc<CameraFrame>>, Fault> {
        let limit = Duration::from_secs_f64(self.config.images.frame_s);
        loop {
            self.look()?;
            let camera = &self.devices.cameras[jaw];
            if let Some(frame) = camera.newest().filter(|frame| frame.at > asked) {
                return Ok(frame);
            }
            let wait = |source| Fault::Camera { jaw, source };
            if let Some(end) = camera.ended() {
                return Err(wait(CameraWaitError::Link(end)));
            }
            if asked.elapsed() > limit {
                let limit_s = limit.as_secs_f64();
                return Err(wait(match camera.newest() {
                    Some(old) => CameraWaitError::Old { age_s: old.at.elapsed().as_secs_f64(), limit_s },
                    None => CameraWaitError::None { connected_s: asked.elapsed().as_secs_f64(), limit_s },
                }));
            }
        }
    }
}
