//! The film of a pull: frames of both cameras from the grip to the stop, as they were received.
//!
//! Nothing is decoded while a pull is under way: a frame is kept by what the camera's own thread has received anyway. Memory is bounded:
//! where a film would grow beyond its share, every other frame is let go and the film goes on at half the rate.

use crate::camera::{CameraFrame, SHIPPED_FRAME_LIMITS, decode_jpeg};
use crate::link::Stamped;
use gripgen_twin::{Jaw, PerJaw};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// A camera that is seen to send nothing for so many times what a frame may take has dropped frames.
const DROPPED: f64 = 2.0;

/// A frame as it was received.
#[derive(Debug, Clone, PartialEq)]
pub struct FilmedFrame {
    /// When it came.
    pub at: Instant,
    /// The robot's clock when it came.
    pub robot_time_s: f64,
    /// The frame as it came.
    pub frame: Arc<CameraFrame>,
}

/// A film under way.
#[derive(Debug)]
pub(super) struct Recorder {
    every: Duration,
    max_bytes: usize,
    bytes: usize,
    due: Instant,
    pub(super) frames: Vec<PerJaw<Stamped<Arc<CameraFrame>>>>,
}

impl Recorder {
    /// So many frames a second at most, so many bytes of JPEG at most.
    pub(super) fn new(rate_hz: f64, max_bytes: usize) -> Self {
        let every = Duration::from_secs_f64(1.0 / rate_hz);
        Self { every, max_bytes, bytes: 0, due: Instant::now(), frames: Vec::new() }
    }

    /// Takes the newest frames of both cameras, once each of them is a new one and it is time.
    pub(super) fn take(&mut self, newest: PerJaw<Option<Stamped<Arc<CameraFrame>>>>, now: Instant) {
        let PerJaw { left: Some(left), right: Some(right) } = newest else { return };
        let both = PerJaw { left, right };
        // A camera that is short of time may send one exposure twice: its own stamp tells.
        let follows = |new: &Stamped<Arc<CameraFrame>>, last: &Stamped<Arc<CameraFrame>>| {
            let stamp = new.event.device_time_s;
            new.at > last.at && (stamp.is_none() || stamp != last.event.device_time_s)
        };
        let is_new = self
            .frames
            .last()
            .is_none_or(|last| Jaw::BOTH.iter().all(|&jaw| follows(&both[jaw], &last[jaw])));
        if !is_new || now < self.due {
            return;
        }
        // A beat that was missed is not made up for.
        self.due = (self.due + self.every).max(now);
        self.bytes += bytes_of(&both);
        self.frames.push(both);
        while self.bytes > self.max_bytes && self.frames.len() > 2 {
            let mut number = 0;
            self.frames.retain(|_| {
                number += 1;
                number % 2 == 1
            });
            self.bytes = self.frames.iter().map(bytes_of).sum();
            self.every *= 2;
        }
    }
}

fn bytes_of(both: &PerJaw<Stamped<Arc<CameraFrame>>>) -> usize {
    both.iter().map(|(_, frame)| frame.event.jpeg.len()).sum()
}

/// What is wrong with the cameras by what was filmed, a sentence each: bytes that repeat, another size, frames that are missing.
/// `frame_s`: how long a frame may take.
pub(super) fn doubts(film: &[PerJaw<FilmedFrame>], frame_s: f64) -> Vec<String> {
    let mut found = Vec::new();
    for jaw in Jaw::BOTH {
        let frames: Vec<&FilmedFrame> = film.iter().map(|both| &both[jaw]).collect();
        let pairs = || frames.windows(2).map(|pair| (pair[0], pair[1]));
        let repeated = pairs().filter(|(a, b)| a.frame.jpeg == b.frame.jpeg).count();
        if repeated > 0 {
            found
                .push(format!("the {jaw} camera sent the same bytes again {repeated} times during the pull"));
        }
        let gap_s = pairs().map(|(a, b)| (b.at - a.at).as_secs_f64()).fold(0.0, f64::max);
        if gap_s > DROPPED * frame_s {
            let limit_s = DROPPED * frame_s;
            found.push(format!(
                "the {jaw} camera sent nothing for {gap_s:.2} s during the pull, {limit_s} s are allowed"
            ));
        }
        let sizes: Vec<Option<(u32, u32)>> = frames.iter().map(|frame| size_px(&frame.frame.jpeg)).collect();
        if let Some(other) = sizes.iter().position(|size| *size != sizes[0]) {
            let words = |size: Option<(u32, u32)>| {
                size.map_or("no picture".into(), |(width, height)| format!("{width} x {height} px"))
            };
            let (first, other) = (words(sizes[0]), words(sizes[other]));
            found.push(format!("the {jaw} camera changed from {first} to {other} during the pull"));
        }
    }
    found
}

/// Changes of the light that the label does not hang on, a sentence each: exposure or white balance that is automatic. Looked at are a few frames, at
/// the rim of the image, where no part presses.
pub(super) fn exposure(film: &[PerJaw<FilmedFrame>]) -> Vec<String> {
    let every = film.len().div_ceil(LOOKED_AT).max(1);
    let of_jaw = |jaw: &Jaw| {
        let levels = film.iter().step_by(every).filter_map(|both| rim_levels(&both[*jaw].frame.jpeg));
        let levels: Vec<[f64; 3]> = levels.collect();
        let first = levels.first()?;
        let change = |now: &[f64; 3]| {
            let each = [0, 1, 2].map(|c| now[c].max(DARK) / first[c].max(DARK) - 1.0);
            each.into_iter().fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most })
        };
        let most =
            levels.iter().map(change).fold(0.0, |most: f64, x| if x.abs() > most.abs() { x } else { most });
        (most.abs() > EXPOSURE).then(|| {
            let percent = 100.0 * most;
            format!("the {jaw} camera's light at the rim changed by {percent:.0} % during the pull: is its exposure automatic?")
        })
    };
    Jaw::BOTH.iter().filter_map(of_jaw).collect()
}

/// Share by which the levels at the rim change before it is said.
const EXPOSURE: f64 = 0.1;

/// Levels below which nothing is said of light.
const DARK: f64 = 10.0;

/// Frames that are looked at.
const LOOKED_AT: usize = 8;

/// Mean red, green and blue of the outermost tenth of the frame, on all sides.
fn rim_levels(jpeg: &[u8]) -> Option<[f64; 3]> {
    let frame = decode_jpeg(jpeg, &SHIPPED_FRAME_LIMITS).ok()?;
    let (width, height) = (frame.width_px, frame.height_px);
    let rim = (width.min(height) / 10).max(1);
    let inside = |x: u32, y: u32| (rim..width - rim).contains(&x) && (rim..height - rim).contains(&y);
    let (mut sums, mut count) = ([0.0; 3], 0.0);
    for y in 0..height {
        for x in (0..width).filter(|x| !inside(*x, y)) {
            let pixel = frame.pixel(x, y);
            (0..3).for_each(|c| sums[c] += f64::from(pixel[c]));
            count += 1.0;
        }
    }
    Some(sums.map(|sum| sum / f64::max(count, 1.0)))
}

/// Columns and rows of a JPEG, by its header.
fn size_px(jpeg: &[u8]) -> Option<(u32, u32)> {
    let reader = image::ImageReader::with_format(std::io::Cursor::new(jpeg), image::ImageFormat::Jpeg);
    reader.into_dimensions().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(at: Instant, jpeg: Vec<u8>) -> Stamped<Arc<CameraFrame>> {
        Stamped { at, event: Arc::new(CameraFrame { jpeg, device_time_s: None }) }
    }

    /// A camera of 30 frames a second that are filmed at 10, and a second one that is late by 5 ms.
    fn filmed(seconds: u64, max_bytes: usize) -> Recorder {
        let begin = Instant::now();
        let mut film = Recorder { due: begin, ..Recorder::new(10.0, max_bytes) };
        for ms in 0..1000 * seconds {
            let now = begin + Duration::from_millis(ms);
            let newest = |late_ms: u64| {
                let number = ms.checked_sub(late_ms)? / 33;
                Some(frame(begin + Duration::from_millis(33 * number + late_ms), vec![number as u8; 100]))
            };
            film.take(PerJaw { left: newest(0), right: newest(5) }, now);
        }
        film
    }

    #[test]
    fn frames_are_new_ones_at_the_rate_of_the_film() {
        let film = filmed(4, 1 << 20);
        let times: Vec<f64> =
            film.frames.iter().map(|both| (both.left.at - film.frames[0].left.at).as_secs_f64()).collect();
        assert!((36..=41).contains(&times.len()), "{times:?}");
        assert!(times.windows(2).all(|t| (0.06..0.14).contains(&(t[1] - t[0]))), "{times:?}");
    }

    /// The same exposure in another message is not a new frame.
    #[test]
    fn an_exposure_that_is_sent_twice_is_filmed_once() {
        let begin = Instant::now();
        let mut film = Recorder { due: begin, ..Recorder::new(10.0, 1 << 20) };
        for (tenth, stamp) in [(0_u64, 0.0), (1, 0.0), (2, 0.2)] {
            let at = begin + Duration::from_millis(100 * tenth);
            let frame = || {
                Some(Stamped {
                    at,
                    event: Arc::new(CameraFrame { jpeg: vec![1; 10], device_time_s: Some(stamp) }),
                })
            };
            film.take(PerJaw { left: frame(), right: frame() }, at);
        }
        let stamps: Vec<f64> = film.frames.iter().filter_map(|both| both.left.event.device_time_s).collect();
        assert_eq!(stamps, [0.0, 0.2]);
    }

    /// Half the frames at half the rate, from the beginning to the end.
    #[test]
    fn a_film_that_is_too_large_loses_every_other_frame() {
        let film = filmed(16, 16_000);
        let count = film.frames.len();
        assert!(film.bytes <= 16_000 && film.bytes == 200 * count && (40..=80).contains(&count), "{count}");
        let times: Vec<f64> =
            film.frames.iter().map(|both| (both.left.at - film.frames[0].left.at).as_secs_f64()).collect();
        assert!(*times.last().unwrap() > 15.0, "{times:?}");
        assert!(times.windows(2).all(|t| (0.15..0.5).contains(&(t[1] - t[0]))), "{times:?}");
    }

    #[test]
    fn what_is_wrong_with_a_camera_is_said() {
        let begin = Instant::now();
        let jpeg = |width: u32, level: u8| {
            let mut bytes = Vec::new();
            let image = image::RgbImage::from_pixel(width, 4, image::Rgb([level; 3]));
            image.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Jpeg).unwrap();
            bytes
        };
        let filmed = |left: &[(u64, Vec<u8>)]| -> Vec<PerJaw<FilmedFrame>> {
            let one = |ms: u64, bytes: Vec<u8>| {
                let Stamped { at, event } = frame(begin + Duration::from_millis(ms), bytes);
                FilmedFrame { at, robot_time_s: 0.0, frame: event }
            };
            let both = |(i, (ms, bytes)): (usize, &(u64, Vec<u8>))| PerJaw {
                left: one(*ms, bytes.clone()),
                right: one(100 * i as u64, jpeg(8, i as u8)),
            };
            left.iter().enumerate().map(both).collect()
        };
        let good = [(0, jpeg(8, 10)), (100, jpeg(8, 11)), (200, jpeg(8, 12))];
        assert_eq!(doubts(&filmed(&good), 0.5), [""; 0]);
        let mut same = good.clone();
        same[2].1 = same[1].1.clone();
        assert!(doubts(&filmed(&same), 0.5)[0].contains("left camera sent the same bytes again 1 times"));
        let mut other = good.clone();
        other[2].1 = jpeg(16, 12);
        assert!(doubts(&filmed(&other), 0.5)[0].contains("from 8 x 4 px to 16 x 4 px"));
        let mut brighter = [(0, jpeg(8, 100)), (100, jpeg(8, 104)), (200, jpeg(8, 103))];
        assert_eq!(exposure(&filmed(&brighter)), [""; 0]);
        brighter[1].1 = jpeg(8, 120);
        assert!(exposure(&filmed(&brighter))[0].contains("left camera's light at the rim changed by 20 %"));
        let mut late = good;
        late[2].0 = 1600;
        assert!(doubts(&filmed(&late), 0.5)[0].contains("sent nothing for 1.50 s"));
    }
}
