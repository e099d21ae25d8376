//! From the frame of a camera to the image of a sample: turned, mirrored, cut out, and brought to its size.
//!
//! An R1.5 sends 240 x 320 (portrait); samples are 320 x 240 (landscape).

use gripgen_twin::TactileImage;
use image::RgbImage;
use image::imageops::{FilterType, resize};

/// Longest side of an image that is made or taken.
const MAX_SIDE_PX: u32 = 4096;

/// How the frame is looked at. The steps come in the order of the fields.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CameraView {
    /// Turned clockwise by so many degrees: 0, 90, 180 or 270.
    pub rotate_deg: u32,
    /// Left and right changed.
    pub mirror: bool,
    /// What is cut out of the turned frame: first column, first row, columns, rows. Everything, without it.
    pub crop_px: Option<[u32; 4]>,
    /// Columns and rows of the image. A larger cut-out is resampled (triangle filter, as wide as a new pixel); a smaller one is
    /// refused.
    pub size_px: [u32; 2],
}

/// A view that this frame does not have.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ViewError {
    /// Not a quarter turn.
    #[error("a turn by {rotate_deg} degrees, it must be by 0, 90, 180 or 270")]
    Rotation {
        /// What was asked.
        rotate_deg: u32,
    },
    /// No image, or one that is too large.
    #[error("an image of {width_px} x {height_px} px, each side must be from 1 to {MAX_SIDE_PX} px")]
    Size {
        /// Columns.
        width_px: u32,
        /// Rows.
        height_px: u32,
    },
    /// Bytes that are not those of the size.
    #[error("{bytes} bytes for an image that needs {wanted}")]
    Bytes {
        /// How many there are.
        bytes: u64,
        /// Three for each pixel.
        wanted: u64,
    },
    /// A cut-out that is empty or reaches beyond the frame.
    #[error(
        "{} x {} px from ({}, {}) on cannot be cut out of {width_px} x {height_px} px",
        crop_px[2], crop_px[3], crop_px[0], crop_px[1]
    )]
    Crop {
        /// What was asked.
        crop_px: [u32; 4],
        /// Columns of the turned frame.
        width_px: u32,
        /// Rows of the turned frame.
        height_px: u32,
    },
    /// A frame with fewer pixels than the image: nothing would be seen in between.
    #[error(
        "a frame of {} x {} px would have to be enlarged to {} x {} px",
        found_px[0], found_px[1], size_px[0], size_px[1]
    )]
    Enlarged {
        /// Columns and rows of what is cut out of the turned frame.
        found_px: [u32; 2],
        /// Columns and rows of the image.
        size_px: [u32; 2],
    },
    /// What was cut away cannot be put back.
    #[error("a view that cuts out {} x {} px cannot be undone", crop_px[2], crop_px[3])]
    Cut {
        /// The cut-out.
        crop_px: [u32; 4],
    },
    /// The image is not what the view gives.
    #[error(
        "an image of {} x {} px is not of this view, which gives {} x {} px",
        found_px[0], found_px[1], size_px[0], size_px[1]
    )]
    OtherSize {
        /// Columns and rows of the image.
        found_px: [u32; 2],
        /// Columns and rows that the view gives.
        size_px: [u32; 2],
    },
}

impl CameraView {
    /// The frame as it is seen. A view that changes nothing gives the same bytes.
    ///
    /// # Errors
    ///
    /// A view that does not fit the frame, or bytes that do not fit its size.
    pub fn apply(&self, frame: &TactileImage) -> Result<TactileImage, ViewError> {
        checked(frame)?;
        let [width_px, height_px] = self.size_px;
        check_sides(width_px, height_px)?;
        let turned = turn(frame, self.rotate_deg, self.mirror)?;
        let [x, y, columns, rows] = self.crop_px.unwrap_or([0, 0, turned.width_px, turned.height_px]);
        if [columns, rows] == [turned.width_px, turned.height_px] && [columns, rows] == self.size_px {
            return Ok(turned);
        }
        let all = (turned.width_px, turned.height_px);
        let outside = ViewError::Crop { crop_px: [x, y, columns, rows], width_px: all.0, height_px: all.1 };
        let cut = turned.cut_out([x, y, columns, rows]).ok_or(outside)?;
        if columns < width_px || rows < height_px {
            return Err(ViewError::Enlarged { found_px: [columns, rows], size_px: self.size_px });
        }
        if [columns, rows] == self.size_px {
            return Ok(cut);
        }
        let (bytes, wanted) = (cut.rgb.len() as u64, bytes_of(columns, rows));
        let cut = RgbImage::from_raw(columns, rows, cut.rgb).ok_or(ViewError::Bytes { bytes, wanted })?;
        let seen = resize(&cut, width_px, height_px, FilterType::Triangle);
        Ok(TactileImage { width_px, height_px, rgb: seen.into_raw() })
    }

    /// The frame that is seen as this image: turn and mirror undone. Only of a view that cuts nothing out, and of an image of its
    /// size.
    ///
    /// # Errors
    ///
    /// A view that cuts something out, or an image of another size than it gives.
    pub fn unapply(&self, image: &TactileImage) -> Result<TactileImage, ViewError> {
        checked(image)?;
        if let Some(crop_px) = self.crop_px {
            return Err(ViewError::Cut { crop_px });
        }
        let found_px = [image.width_px, image.height_px];
        if found_px != self.size_px {
            return Err(ViewError::OtherSize { found_px, size_px: self.size_px });
        }
        let back_deg = match self.rotate_deg {
            0 | 180 => self.rotate_deg,
            90 => 270,
            270 => 90,
            rotate_deg => return Err(ViewError::Rotation { rotate_deg }),
        };
        turn(&turn(image, 0, self.mirror)?, back_deg, false)
    }
}

/// Turned clockwise, then mirrored.
fn turn(image: &TactileImage, rotate_deg: u32, mirror: bool) -> Result<TactileImage, ViewError> {
    match rotate_deg {
        0 | 90 | 180 | 270 => Ok(image.turned(rotate_deg / 90, mirror)),
        _ => Err(ViewError::Rotation { rotate_deg }),
    }
}

fn bytes_of(width_px: u32, height_px: u32) -> u64 {
    3 * u64::from(width_px) * u64::from(height_px)
}

fn check_sides(width_px: u32, height_px: u32) -> Result<(), ViewError> {
    let sides = 1..=MAX_SIDE_PX;
    let good = sides.contains(&width_px) && sides.contains(&height_px);
    if good { Ok(()) } else { Err(ViewError::Size { width_px, height_px }) }
}

/// An image has the bytes of its size.
fn checked(image: &TactileImage) -> Result<(), ViewError> {
    check_sides(image.width_px, image.height_px)?;
    let (bytes, wanted) = (image.rgb.len() as u64, bytes_of(image.width_px, image.height_px));
    if bytes == wanted { Ok(()) } else { Err(ViewError::Bytes { bytes, wanted }) }
}
