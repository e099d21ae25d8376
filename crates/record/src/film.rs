//! Films of pulls: to the messages of a shard and back.

use crate::encode::{image_message, timestamp};
use crate::film_frame::{EncodedFrame, film_topic, label_topic};
use crate::picture::{PictureError, decode_grey, encode_grey};
use crate::proto::gripgen_v1 as proto;
use crate::reader::{ReadError, ShardReader, png_image, raw_image};
use crate::rig_run::{camera_image, stamp_of};
use gripgen_twin::config::ImageStorage;
use gripgen_twin::{CellShear, FilmFrame, Jaw, PerJaw, SlipState, TactileImage};
use image::ExtendedColorType;
use prost::Message;

/// What all frames of a film share.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FilmOptions {
    /// How images are stored; films have no noise in any of them.
    pub images: ImageStorage,
    /// Start of the sample's time slot.
    pub start_ns: u64,
    /// Time at which the first cell left its place on the part.
    pub incipient_slip_s: Option<f64>,
    /// Time at which the last one did.
    pub whole_slip_s: Option<f64>,
}

/// Encodes a frame. Pure: the same frame gives the same bytes.
///
/// # Errors
///
/// An image that cannot be compressed.
pub fn encode_frame(
    number: usize,
    frame: &PerJaw<FilmFrame>,
    options: &FilmOptions,
) -> Result<EncodedFrame, PictureError> {
    let time_ns = options.start_ns + (frame.left.time_s * 1e9).round() as u64;
    let time = Some(timestamp(time_ns));
    Ok(EncodedFrame {
        time_ns,
        image: PerJaw::try_from_fn(|jaw| image_message(&frame[jaw].image, jaw, options.images, time))?,
        labels: PerJaw::try_from_fn(|jaw| -> Result<Vec<u8>, PictureError> {
            let f = &frame[jaw];
            let (width, height) = (f.image.width_px, f.image.height_px);
            let depth: Vec<u8> = f.depth_um.iter().flat_map(|d| d.to_ne_bytes()).collect();
            let mut message = proto::FilmFrame {
                timestamp: time,
                frame: number as u32,
                time_s: f.time_s,
                contact_force_n: f.contact_force_n,
                displacement_mm: f.displacement_m * 1e3,
                state: 0,
                incipient_slip_s: options.incipient_slip_s,
                whole_slip_s: options.whole_slip_s,
                pull_x: f.pull_px[0],
                pull_y: f.pull_px[1],
                cell_png: encode_grey(&f.cell_of_px, (width, height), ExtendedColorType::L8)?,
                depth_png: encode_grey(&depth, (width, height), ExtendedColorType::L16)?,
                cell_shear_mm: f.cells.iter().map(|c| (c.shear_m * 1e3) as f32).collect(),
                cell_slip_mm: f.cells.iter().map(|c| (c.slip_m * 1e3) as f32).collect(),
                cell_force_n: f.cells.iter().map(|c| c.force_n as f32).collect(),
                cell_slipped: f.cells.iter().map(|c| u8::from(c.slipped)).collect(),
                marker_x_px: f.markers_px.iter().map(|m| m[0] as f32).collect(),
                marker_y_px: f.markers_px.iter().map(|m| m[1] as f32).collect(),
                camera: None,
            };
            message.set_state(match f.state() {
                None => proto::SlipState::Unspecified,
                Some(SlipState::Stick) => proto::SlipState::Stick,
                Some(SlipState::Incipient) => proto::SlipState::Incipient,
                Some(SlipState::Slip) => proto::SlipState::Slip,
            });
            Ok(message.encode_to_vec())
        })?,
    })
}

/// A film that was read.
#[derive(Debug, Clone, PartialEq)]
pub struct Film {
    /// Its frames in order.
    pub frames: Vec<PerJaw<FilmFrame>>,
    /// Time at which the first cell left its place on the part, if one did.
    pub incipient_slip_s: Option<f64>,
    /// Time at which the last one did.
    pub whole_slip_s: Option<f64>,
}

impl Film {
    /// A film of these frames as it comes back from a shard; `None` without any.
    pub fn as_read(
        frames: impl IntoIterator<Item = PerJaw<FilmFrame>>,
        incipient_slip_s: Option<f64>,
        whole_slip_s: Option<f64>,
    ) -> Option<Self> {
        let rounded = |f: FilmFrame| FilmFrame {
            displacement_m: f.displacement_m * 1e3 * 1e-3,
            cells: f.cells.iter().map(cell_as_read).collect(),
            markers_px: f.markers_px.iter().map(|m| m.map(|x| f64::from(x as f32))).collect(),
            ..f
        };
        let frames: Vec<_> = frames
            .into_iter()
            .map(|both| PerJaw { left: rounded(both.left), right: rounded(both.right) })
            .collect();
        (!frames.is_empty()).then_some(Self { frames, incipient_slip_s, whole_slip_s })
    }
}

/// Numbers of a cell are stored in millimetres, with 24 bits.
fn cell_as_read(cell: &CellShear) -> CellShear {
    let length_m = |x_m: f64| f64::from((x_m * 1e3) as f32) * 1e-3;
    CellShear {
        shear_m: length_m(cell.shear_m),
        slip_m: length_m(cell.slip_m),
        force_n: f64::from(cell.force_n as f32),
        slipped: cell.slipped,
    }
}

impl ShardReader {
    /// Whether its samples may have films.
    pub fn has_film(&self) -> bool {
        self.has_topic(film_topic(Jaw::Left))
    }

    /// The film of a sample's pull, where there is one.
    ///
    /// # Errors
    ///
    /// A sample that is not in the shard, or a message that cannot be read.
    pub fn film(&self, index: u64) -> Result<Option<Film>, ReadError> {
        let mut film = Film { frames: vec![], incipient_slip_s: None, whole_slip_s: None };
        let raw = self.raw_film(index)?;
        for encoded in &raw {
            let mut read = |jaw: Jaw| -> Result<FilmFrame, ReadError> {
                let bad = |topic: &str, problem: String| self.damaged(index, topic, &problem);
                let label = proto::FilmFrame::decode(&encoded.labels[jaw][..])
                    .map_err(|e| bad(label_topic(jaw), e.to_string()))?;
                (film.incipient_slip_s, film.whole_slip_s) = (label.incipient_slip_s, label.whole_slip_s);
                let image = match &label.camera {
                    Some(camera) => camera_image(&encoded.image[jaw], camera),
                    None => self.film_image(&encoded.image[jaw]),
                };
                let image = image.map_err(|problem| bad(film_topic(jaw), problem))?;
                frame_of(&label, image).map_err(|problem| bad(label_topic(jaw), problem))
            };
            let both = PerJaw { left: read(Jaw::Left)?, right: read(Jaw::Right)? };
            film.frames.push(both);
        }
        Ok((!film.frames.is_empty()).then_some(film))
    }

    fn film_image(&self, bytes: &[u8]) -> Result<TactileImage, String> {
        if self.has_raw_images() { raw_image(bytes) } else { png_image(bytes) }
    }

    /// The messages of a film, as they are stored.
    pub(crate) fn raw_film(&self, index: u64) -> Result<Vec<EncodedFrame>, ReadError> {
        let mut found = PerJaw { left: (vec![], vec![]), right: (vec![], vec![]) };
        let mut times_ns = Vec::new();
        self.each_film_message(index, |topic, time_ns, data| {
            for jaw in Jaw::BOTH {
                if topic == film_topic(jaw) {
                    found[jaw].0.push(data.to_vec());
                } else if topic == label_topic(jaw) {
                    found[jaw].1.push(data.to_vec());
                }
            }
            if topic == film_topic(Jaw::Left) {
                times_ns.push(time_ns);
            }
        })?;
        let counts = [&found.left.0, &found.left.1, &found.right.0, &found.right.1].map(Vec::len);
        if counts.iter().any(|&n| n != times_ns.len()) {
            let problem = format!("its film has {counts:?} images and labels of the left and right jaw");
            return Err(self.damaged(index, film_topic(Jaw::Left), &problem));
        }
        let PerJaw { left, right } = found;
        let images = left.0.into_iter().zip(right.0).map(|(left, right)| PerJaw { left, right });
        let labels = left.1.into_iter().zip(right.1).map(|(left, right)| PerJaw { left, right });
        let frames = times_ns.into_iter().zip(images.zip(labels));
        Ok(frames.map(|(time_ns, (image, labels))| EncodedFrame { time_ns, image, labels }).collect())
    }
}

fn frame_of(label: &proto::FilmFrame, image: TactileImage) -> Result<FilmFrame, String> {
    let size = (image.width_px, image.height_px);
    let pixels = size.0 as usize * size.1 as usize;
    let grey = |png: &[u8]| match label.camera {
        Some(_) => Ok(vec![0; pixels]),
        None => decode_grey(png, size).map_err(|e| e.to_string()),
    };
    let cell_of_px = grey(&label.cell_png)?.into_iter().map(|v| v as u8).collect();
    let cells = label.cell_shear_mm.len();
    let counts = [label.cell_slip_mm.len(), label.cell_force_n.len(), label.cell_slipped.len()];
    if counts.iter().any(|&n| n != cells) || label.marker_x_px.len() != label.marker_y_px.len() {
        return Err(format!("columns of {cells} and {counts:?} cells"));
    }
    let cell = |i: usize| CellShear {
        shear_m: f64::from(label.cell_shear_mm[i]) * 1e-3,
        slip_m: f64::from(label.cell_slip_mm[i]) * 1e-3,
        force_n: f64::from(label.cell_force_n[i]),
        slipped: label.cell_slipped[i] != 0,
    };
    let markers = label.marker_x_px.iter().zip(&label.marker_y_px);
    Ok(FilmFrame {
        time_s: label.time_s,
        contact_force_n: label.contact_force_n,
        displacement_m: label.displacement_mm * 1e-3,
        pull_px: [label.pull_x, label.pull_y],
        image,
        camera: label.camera.as_ref().map(stamp_of),
        cell_of_px,
        depth_um: grey(&label.depth_png)?,
        cells: (0..cells).map(cell).collect(),
        markers_px: markers.map(|(&x, &y)| [f64::from(x), f64::from(y)]).collect(),
    })
}
