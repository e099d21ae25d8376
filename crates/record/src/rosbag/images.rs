//! Tactile images of the pulls of bags.

use super::bags::Bags;
use super::cdr::Cdr;
use super::container::message_at;
use super::error::RosbagError;
use super::pull::{mark_ns, span_ns};
use super::signals::{At, Frame, Signals, held};
use crate::picture::decode;
use crate::pulls::PullImages;
use gripgen_twin::{Jaw, PerJaw, TactileImage};
use std::collections::BTreeMap;
use std::path::Path;

/// Largest image that is read, in pixels.
const LARGEST_PX: u64 = 1 << 26;

/// Where the images of the pulls of bags stand.
pub struct BagImages {
    of_pull: BTreeMap<String, (PerJaw<Frame>, PerJaw<Option<Frame>>)>,
}

impl BagImages {
    /// Looks for the images of each pull: the last ones before the staircase begins, or before `image_s`; at rest the last before
    /// `rest_s`. A pull without one of each jaw has none.
    ///
    /// # Errors
    ///
    /// As [`crate::read_judged_bags`].
    pub fn open(path: &Path) -> Result<Self, RosbagError> {
        let bags = Bags::open(path)?;
        let topics = &bags.file.topics;
        if topics.image_left.is_none() || topics.image_right.is_none() {
            return Ok(Self { of_pull: BTreeMap::new() });
        }
        let signals = bags.signals()?;
        let mut of_pull = BTreeMap::new();
        for pull in &bags.pulls {
            let of_bag: &Signals = &signals[&pull.bag];
            let gripped = match pull.marks.image_s {
                Some(s) => mark_ns(of_bag, s),
                None => match span_ns(of_bag, &pull.marks) {
                    Ok((begin, _)) => begin,
                    Err(_) => continue,
                },
            };
            let frame = |all: &Vec<At<Frame>>, ns: i64| held(all, ns).map(|at| at.value.clone());
            let both = PerJaw::from_fn(|jaw| frame(&of_bag.frames[jaw], gripped));
            let rest = pull.marks.rest_s.map(|s| mark_ns(of_bag, s));
            let rest = PerJaw::from_fn(|jaw| rest.and_then(|ns| frame(&of_bag.frames[jaw], ns)));
            if let PerJaw { left: Some(left), right: Some(right) } = both {
                of_pull.insert(pull.id.clone(), (PerJaw { left, right }, rest));
            }
        }
        Ok(Self { of_pull })
    }

    /// Whether a pull has images of both jaws.
    pub fn has(&self, id: &str) -> bool {
        self.of_pull.contains_key(id)
    }

    /// The images of a pull.
    ///
    /// # Errors
    ///
    /// Images that are none.
    pub fn read(&self, id: &str) -> Result<PullImages, RosbagError> {
        let (grip, rest) = self
            .of_pull
            .get(id)
            .ok_or_else(|| RosbagError::new(Path::new(""), format!("pull `{id}` has no images")))?;
        Ok(PullImages {
            grip: PerJaw::try_from_fn(|jaw| image(&grip[jaw]))?,
            rest: PerJaw::try_from_fn(|jaw: Jaw| rest[jaw].as_ref().map(image).transpose())?,
        })
    }
}

fn image(frame: &Frame) -> Result<TactileImage, RosbagError> {
    let message = message_at(&frame.file, frame.place)?;
    let bad = |problem: String| {
        RosbagError::new(&frame.file, format!("image at byte {}: {problem}", frame.place.record))
            .hint("images are rgb8, bgr8, rgba8 or bgra8, or PNG and JPEG")
    };
    let read = if frame.compressed { compressed(&message) } else { raw(&message) };
    read.map_err(bad)
}

fn compressed(message: &[u8]) -> Result<TactileImage, String> {
    let mut cdr = Cdr::new(message)?;
    cdr.stamp_ns()?;
    cdr.text()?;
    decode(cdr.bytes()?).map_err(|e| e.to_string())
}

pub(super) fn raw(message: &[u8]) -> Result<TactileImage, String> {
    let mut cdr = Cdr::new(message)?;
    cdr.stamp_ns()?;
    let (height_px, width_px) = (cdr.u32()?, cdr.u32()?);
    let encoding = cdr.text()?;
    cdr.u8()?;
    let step = cdr.u32()? as usize;
    let bytes = cdr.bytes()?;
    let (channels, order) = match encoding.as_str() {
        "rgb8" => (3, [0, 1, 2]),
        "bgr8" => (3, [2, 1, 0]),
        "rgba8" => (4, [0, 1, 2]),
        "bgra8" => (4, [2, 1, 0]),
        other => return Err(format!("its encoding is `{other}`")),
    };
    let pixels = u64::from(width_px) * u64::from(height_px);
    if pixels == 0 || pixels > LARGEST_PX {
        return Err(format!("it is {width_px}x{height_px} pixels, at most {LARGEST_PX} are read"));
    }
    let (width, height) = (width_px as usize, height_px as usize);
    let wanted = step.checked_mul(height);
    if step < width * channels || wanted.is_none_or(|n| n > bytes.len()) {
        return Err(format!(
            "{width_px}x{height_px} pixels of {channels} bytes in rows of {step} bytes, and {} bytes",
            bytes.len()
        ));
    }
    let mut rgb = Vec::with_capacity(width * height * 3);
    for row in bytes.chunks_exact(step).take(height) {
        for pixel in row.chunks_exact(channels).take(width) {
            rgb.extend(order.map(|i| pixel[i]));
        }
    }
    Ok(TactileImage { width_px, height_px, rgb })
}
