//! Images of both jaws, new ones.

use super::event::{FrameStamp, RigEvent};
use super::fault::Fault;
use super::film::{FilmedFrame, Recorder};
use super::run::Experiment;
use crate::camera::{CameraFrame, CameraWaitError, SHIPPED_FRAME_LIMITS, decode_jpeg};
use crate::link::Stamped;
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Images with their stamps.
pub(super) struct Seen {
    pub(super) images: PerJaw<TactileImage>,
    pub(super) stamps: Vec<FrameStamp>,
}

impl Experiment<'_> {
    /// The first frame of each camera that was taken after this moment, as far as the frames before it say when that was.
    pub(super) fn look_at_gels(&mut self, what: &'static str, before: &[FrameStamp]) -> Result<Seen, Fault> {
        let asked = Asked { at: Instant::now(), robot_time_s: self.robot_time_s()? };
        let left = self.frame_after(Jaw::Left, &asked, before)?;
        let right = self.frame_after(Jaw::Right, &asked, before)?;
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
            robot_time_s: self.robot_time_at(frame.at),
            jpeg: frame.event.clone(),
        };
        let stamps = vec![stamp(Jaw::Left, &left), stamp(Jaw::Right, &right)];
        self.tell(RigEvent::Images { what, images: images.clone() });
        Ok(Seen { images, stamps })
    }

    /// What is wrong with the cameras now, in words: those that ended, and those from which nothing comes any more.
    pub(super) fn silent_cameras(&self) -> Vec<String> {
        let limit_s = self.frame_limit_s();
        let silent = |jaw: Jaw| {
            let camera = &self.devices.cameras[jaw];
            if let Some(end) = camera.ended() {
                return Some(format!("the {jaw} camera ended during the pull: {end}"));
            }
            let silent_s = camera.newest()?.at.elapsed().as_secs_f64();
            (silent_s > limit_s).then(|| {
                format!("the {jaw} camera sent nothing for {silent_s:.2} s during the pull, {limit_s} s are allowed")
            })
        };
        Jaw::BOTH.into_iter().filter_map(silent).collect()
    }

    /// How long a new frame may take.
    pub(super) fn frame_limit_s(&self) -> f64 {
        self.config.images.frame_s * self.config.limits.patience
    }

    /// Films from now on, if the rig films at all.
    pub(super) fn start_film(&mut self) {
        let images = &self.config.images;
        let max_bytes = (images.film_mib * f64::from(1 << 20)) as usize;
        self.film = (images.film_hz > 0.0).then(|| Recorder::new(images.film_hz, max_bytes));
    }

    /// Keeps what is new.
    pub(super) fn film_on(&mut self) {
        if let Some(film) = &mut self.film {
            film.take(PerJaw::from_fn(|jaw| self.devices.cameras[jaw].newest()), Instant::now());
        }
    }

    /// Ends the film.
    pub(super) fn end_film(&mut self) -> Vec<PerJaw<FilmedFrame>> {
        let frames = self.film.take().map(|film| film.frames).unwrap_or_default();
        let stamped = |frame: Stamped<Arc<CameraFrame>>| FilmedFrame {
            robot_time_s: self.robot_time_at(frame.at),
            at: frame.at,
            frame: frame.event,
        };
        let both = |PerJaw { left, right }| PerJaw { left: stamped(left), right: stamped(right) };
        frames.into_iter().map(both).collect()
    }

    fn frame_after(
        &mut self,
        jaw: Jaw,
        asked: &Asked,
        before: &[FrameStamp],
    ) -> Result<Stamped<Arc<CameraFrame>>, Fault> {
        let limit = Duration::from_secs_f64(self.frame_limit_s());
        let old = before.iter().rfind(|old| old.jaw == jaw);
        // What came, but was taken before: a frame that waited on its way, or one of a camera that stands still.
        let mut first_late: Option<f64> = None;
        loop {
            self.look()?;
            let camera = &self.devices.cameras[jaw];
            let newest = camera.newest();
            let late = newest
                .as_ref()
                .and_then(|frame| Some((asked.late_s(frame, old)?, frame.event.device_time_s?)));
            if let Some(frame) = newest.as_ref().filter(|frame| frame.at > asked.at) {
                match late {
                    Some((_, time_s)) => _ = first_late.get_or_insert(time_s),
                    None => {
                        // Jaws that closed on a part do not look like open ones, and no two frames have the same noise.
                        if let Some(old) = old.filter(|old| old.jpeg.jpeg == frame.event.jpeg) {
                            let passed_s = (frame.at - old.at).as_secs_f64();
                            return Err(Fault::SameBytes { jaw, passed_s, bytes: frame.event.jpeg.len() });
                        }
                        return Ok(frame.clone());
                    }
                }
            }
            let wait = |source| Fault::Camera { jaw, source };
            if let Some(end) = camera.ended() {
                return Err(wait(CameraWaitError::Link(end)));
            }
            let waited = asked.at.elapsed();
            if waited > limit {
                let limit_s = limit.as_secs_f64();
                return Err(match (newest, first_late, late) {
                    (_, Some(first_s), Some((_, time_s))) if first_s == time_s => {
                        Fault::Frozen { jaw, time_s }
                    }
                    (_, Some(_), Some((late_s, _))) => Fault::Past { jaw, late_s },
                    (Some(old), ..) => {
                        wait(CameraWaitError::Old { age_s: old.at.elapsed().as_secs_f64(), limit_s })
                    }
                    (None, ..) => wait(CameraWaitError::None { connected_s: waited.as_secs_f64(), limit_s }),
                });
            }
        }
    }

    /// The robot's clock at a moment of this machine's, to within a reading.
    fn robot_time_at(&self, at: Instant) -> f64 {
        let row = self.rows.iter().rfind(|row| row.at <= at).or(self.rows.first());
        row.map_or(0.0, |row| row.timestamp_s)
    }
}

/// When a frame was asked for.
struct Asked {
    at: Instant,
    robot_time_s: f64,
}

impl Asked {
    /// How long before that a frame was taken, going by a frame before it; `None` if it was taken after it, or nobody knows. The
    /// camera's clock and the robot's go equally fast, however far apart they are.
    fn late_s(&self, frame: &Stamped<Arc<CameraFrame>>, old: Option<&FrameStamp>) -> Option<f64> {
        let old = old?;
        let passed_s = frame.event.device_time_s? - old.device_time_s?;
        let late_s = self.robot_time_s - (old.robot_time_s + passed_s);
        (late_s > 0.0).then_some(late_s)
    }
}
