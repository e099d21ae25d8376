//! What clean frames are stored without: how the frame at rest differs from even rows.
//!
//! A frame at rest fades over the image, in steps that cost a PNG more bytes than the contact. It is the same in every sample, so that
//! it is stored once a shard. What is left is still a picture of the contact, on rows of one colour each, the mean of the frame at rest.

use gripgen_twin::TactileImage;

/// The frame at rest of a sensor, less the mean of each row and channel.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Background {
    rest: TactileImage,
    /// Wrapped to bytes.
    apart: Vec<u8>,
}

impl Background {
    /// That of a frame at rest.
    pub fn new(rest: TactileImage) -> Self {
        let width = rest.width_px as usize;
        let mut apart = rest.rgb.clone();
        for row in apart.chunks_exact_mut(3 * width.max(1)) {
            for channel in 0..3 {
                let sum: usize = row.iter().skip(channel).step_by(3).map(|&level| usize::from(level)).sum();
                let mean = ((2 * sum + width) / (2 * width)) as u8;
                row.iter_mut().skip(channel).step_by(3).for_each(|level| *level = level.wrapping_sub(mean));
            }
        }
        Self { rest, apart }
    }

    /// The frame at rest.
    pub fn rest(&self) -> &TactileImage {
        &self.rest
    }

    /// A frame without it. Levels wrap around, so that nothing is lost.
    #[must_use]
    pub fn taken_off(&self, image: &TactileImage) -> TactileImage {
        let rgb = image.rgb.iter().zip(&self.apart).map(|(level, apart)| level.wrapping_sub(*apart));
        TactileImage { rgb: rgb.collect(), ..*image }
    }

    /// Puts it back.
    pub fn put_back(&self, rgb: &mut [u8]) {
        for (level, apart) in rgb.iter_mut().zip(&self.apart) {
            *level = level.wrapping_add(*apart);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_at_rest_is_even_and_nothing_is_lost() {
        let rgb = (0..3 * 16 * 9).map(|i: u32| (i * i % 250) as u8).collect();
        let rest = TactileImage { width_px: 16, height_px: 9, rgb };
        let background = Background::new(rest.clone());
        let even = background.taken_off(&rest);
        assert!(even.rgb.chunks(48).all(|row| row.chunks(3).all(|pixel| pixel == &row[..3])));
        let rgb = (0..3 * 16 * 9).map(|i: u32| (i * 91 % 256) as u8).collect();
        let frame = TactileImage { width_px: 16, height_px: 9, rgb };
        let mut stored = background.taken_off(&frame);
        assert_ne!(stored, frame);
        background.put_back(&mut stored.rgb);
        assert_eq!(stored, frame);
    }
}
