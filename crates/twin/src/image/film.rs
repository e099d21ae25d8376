//! A pull as a film: which of its moments are frames, and what a frame holds.

use crate::config::{ConfigError, DuringPullFile, in_range};
use crate::{PullTrace, TactileImage};

/// Which moments of a pull are frames.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum FilmPace {
    /// So many frames: two thirds evenly in time from the grip until all of the contact slips, the others evenly over the way
    /// that is left. Of a pull that does not slip all of them evenly in time.
    Frames(u32),
    /// Frames per second, from the grip on.
    RateHz(f64),
}

/// How much of a contact has left its place on the part.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum SlipState {
    /// Nothing.
    #[default]
    Stick,
    /// Some of it: incipient slip.
    Incipient,
    /// All of it.
    Slip,
}

/// A cell of the contact at a moment of the pull.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct CellShear {
    /// How far the surface of the gel stays behind the gripper, along the pull.
    pub shear_m: f64,
    /// How far it has moved over the part, along the pull.
    pub slip_m: f64,
    /// Force that it carries along the pull.
    pub force_n: f64,
    /// Whether it has left its place on the part since the grip.
    pub slipped: bool,
}

/// When the frame of a real camera came.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CameraStamp {
    /// When it arrived, by the clock of the pull's trace.
    pub received_s: f64,
    /// The camera's own clock when it was taken, where it says so; it is nobody else's clock.
    pub device_time_s: Option<f64>,
}

/// One frame of one jaw.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmFrame {
    /// Time since the start of the pull.
    pub time_s: f64,
    /// What both jaws take along the pull.
    pub contact_force_n: f64,
    /// Way of the gripper.
    pub displacement_m: f64,
    /// Direction of the pull in the image, columns and rows; its length is the share that lies in the image.
    pub pull_px: [f64; 2],
    /// What the camera sees: without its noise in a simulation, as it was received from a real one.
    pub image: TactileImage,
    /// Of the frame of a real camera, of which nothing below is known.
    pub camera: Option<CameraStamp>,
    /// Number of the cell, from 1, of each pixel in contact; 0 beside it.
    pub cell_of_px: Vec<u8>,
    /// How deep the part lies below the surface of the gel at rest; 0 beside the contact.
    pub depth_um: Vec<u16>,
    /// The cells of the jaw's contact, in the order of its patch.
    pub cells: Vec<CellShear>,
    /// Where the markers are, column and row; empty without markers.
    pub markers_px: Vec<[f64; 2]>,
}

impl FilmFrame {
    /// How much of the contact has slipped; `None` in the frame of a real camera.
    pub fn state(&self) -> Option<SlipState> {
        let slipped = self.cells.iter().filter(|c| c.slipped).count();
        match slipped {
            _ if self.camera.is_some() => None,
            0 => Some(SlipState::Stick),
            n if n == self.cells.len() => Some(SlipState::Slip),
            _ => Some(SlipState::Incipient),
        }
    }
}

impl FilmPace {
    /// The frames that `[images] during_pull` asks for.
    ///
    /// # Errors
    ///
    /// Both kinds, none, or a number out of range.
    pub fn new(file: &DuringPullFile) -> Result<Self, ConfigError> {
        let key = "images.during_pull";
        match (file.frames, file.rate_hz) {
            (Some(frames), None) => {
                in_range(&format!("{key}.frames"), f64::from(frames), 2.0..=480.0, "1")?;
                Ok(Self::Frames(frames))
            }
            (None, Some(rate_hz)) => {
                Ok(Self::RateHz(in_range(&format!("{key}.rate_hz"), rate_hz, 0.1..=120.0, "Hz")?))
            }
            (both, _) => {
                let problem =
                    if both.is_some() { "frames and rate_hz are both there" } else { "it is empty" };
                Err(ConfigError::new(key, problem).hint("write { frames = 24 } or { rate_hz = 30 }"))
            }
        }
    }

    /// What stands in a file.
    pub fn to_file(self) -> DuringPullFile {
        match self {
            Self::Frames(frames) => DuringPullFile { frames: Some(frames), rate_hz: None },
            Self::RateHz(rate_hz) => DuringPullFile { frames: None, rate_hz: Some(rate_hz) },
        }
    }

    /// Rows of a trace that are frames, each once and in order; `slip_row` is the first one at which all of the contact slips.
    pub fn rows(self, trace: &PullTrace, slip_row: Option<usize>) -> Vec<usize> {
        let Some(last) = trace.len().checked_sub(1) else { return vec![] };
        let mut rows = Vec::new();
        match self {
            Self::Frames(frames) => {
                let count = frames as usize;
                let (until, before) = match slip_row {
                    Some(row) => (row, (2 * count).div_ceil(3).min(count - 1)),
                    None => (last, count - 1),
                };
                rows.extend((0..=before).map(|i| (i * until + before / 2) / before));
                let after = count - 1 - before;
                let (from_m, to_m) = (trace.displacement_m[until], trace.displacement_m[last]);
                for i in 1..=after {
                    let way_m = from_m + (to_m - from_m) * i as f64 / after as f64;
                    let there = trace.displacement_m[until..].iter().position(|&x| x >= way_m);
                    rows.push(there.filter(|_| i < after).map_or(last, |row| until + row));
                }
            }
            Self::RateHz(rate_hz) => {
                for frame in 0_u32.. {
                    let time_s = f64::from(frame) / rate_hz - 1e-9;
                    let row = trace.time_s.partition_point(|&t| t < time_s);
                    if row > last {
                        break;
                    }
                    rows.push(row);
                }
            }
        }
        rows.sort_unstable();
        rows.dedup();
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TraceRow;

    /// 10 s at rest but for 1 mm of shear, then 4 mm in half a second.
    fn trace() -> PullTrace {
        let row = |i: usize| {
            let time_s = i as f64 / 100.0;
            let displacement_m = 1e-4 * time_s.min(10.0) + 8e-3 * (time_s - 10.0).max(0.0);
            TraceRow { time_s, desired_force_n: time_s, measured_force_n: time_s, displacement_m }
        };
        (0..=1050).map(row).collect()
    }

    #[test]
    fn frames_are_shared_between_hold_and_slip() {
        let rows = FilmPace::Frames(24).rows(&trace(), Some(1000));
        assert_eq!(rows.len(), 24);
        assert_eq!((rows[0], rows[16], rows[23]), (0, 1000, 1050));
        assert!(rows[..17].windows(2).all(|w| (62..=63).contains(&(w[1] - w[0]))), "{rows:?}");
        assert!(rows[16..].windows(2).all(|w| (6..=9).contains(&(w[1] - w[0]))), "{rows:?}");
        // Without slip all of them are even in time.
        let held = FilmPace::Frames(24).rows(&trace(), None);
        assert!(held.windows(2).all(|w| (45..=46).contains(&(w[1] - w[0]))), "{held:?}");
        assert_eq!((held.len(), held[23]), (24, 1050));
    }

    #[test]
    fn a_rate_is_that_of_a_camera() {
        let rows = FilmPace::RateHz(25.0).rows(&trace(), Some(1000));
        assert_eq!(rows, (0..=262).map(|i| 4 * i).collect::<Vec<_>>());
        // Never more frames than readings.
        let few: PullTrace = trace().rows().take(3).collect();
        assert_eq!(FilmPace::Frames(24).rows(&few, None), [0, 1, 2]);
        assert!(FilmPace::Frames(24).rows(&PullTrace::default(), None).is_empty());
    }

    #[test]
    fn a_pace_is_one_of_two_numbers() {
        let new = |frames, rate_hz| FilmPace::new(&DuringPullFile { frames, rate_hz });
        assert_eq!(new(Some(24), None), Ok(FilmPace::Frames(24)));
        assert_eq!(new(None, Some(30.0)).map(FilmPace::to_file).unwrap().rate_hz, Some(30.0));
        for (frames, rate_hz) in [(None, None), (Some(24), Some(30.0)), (Some(1), None), (None, Some(0.0))] {
            assert!(new(frames, rate_hz).unwrap_err().key.starts_with("images.during_pull"));
        }
    }
}
