//! Films of measured pulls: frames as the cameras sent them, with stamps.

use crate::encode::timestamp;
use crate::film_frame::EncodedFrame;
use crate::picture::decode;
use crate::proto::foxglove::CompressedImage;
use crate::proto::gripgen_v1 as proto;
use gripgen_twin::{CameraStamp, PerJaw, PullTrace, TactileImage};
use prost::Message;
use std::sync::Arc;

/// How the frames of a camera are looked at: turned, mirrored, cut out, in this order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct FrameView {
    /// Turned clockwise by so many quarters.
    pub quarters: u32,
    /// Left and right changed.
    pub mirror: bool,
    /// First column, first row, columns and rows of the turned frame; all of it where there is none.
    pub crop_px: Option<[u32; 4]>,
}

/// A frame as a camera sent it.
#[derive(Debug, Clone, PartialEq)]
pub struct RigFrame {
    /// When it arrived, by the robot's clock, since the start of the pull; negative before it.
    pub received_s: f64,
    /// The camera's own clock when it was taken, where it says so.
    pub device_time_s: Option<f64>,
    /// JPEG.
    pub jpeg: Arc<[u8]>,
}

/// The film of a measured pull, from the grip to the stop.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RigFilm {
    /// How its frames are looked at.
    pub views: PerJaw<FrameView>,
    /// The newest frame of each camera at one moment, in order.
    pub frames: Vec<PerJaw<RigFrame>>,
}

impl RigFilm {
    /// Its messages; force and way are those of the row of the trace at or before a frame.
    pub(super) fn encode(&self, trace: Option<&PullTrace>) -> Vec<EncodedFrame> {
        let first_s = self.frames.first().map_or(0.0, |both| both.left.received_s.min(both.right.received_s));
        let from_s = trace.and_then(|t| t.time_s.first().copied()).unwrap_or(first_s).min(0.0);
        let mut before_ns = 0;
        let mut encoded = Vec::with_capacity(self.frames.len());
        for (number, both) in self.frames.iter().enumerate() {
            let time_s = both.left.received_s.max(both.right.received_s);
            let time_ns = (((time_s - from_s) * 1e9).round().max(0.0) as u64).max(before_ns);
            before_ns = time_ns;
            let row = trace.and_then(|t| {
                let row = t.time_s.partition_point(|&at| at <= time_s).checked_sub(1)?;
                Some((t.measured_force_n[row], t.displacement_m[row]))
            });
            let (force_n, way_m) = row.unwrap_or_default();
            let time = Some(timestamp(time_ns));
            encoded.push(EncodedFrame {
                time_ns,
                image: PerJaw::from_fn(|jaw| {
                    let (frame_id, format) = (format!("gel_{jaw}"), "jpeg".to_string());
                    let data = both[jaw].jpeg.to_vec();
                    CompressedImage { timestamp: time, frame_id, data, format }.encode_to_vec()
                }),
                labels: PerJaw::from_fn(|jaw| {
                    let (frame, view) = (&both[jaw], &self.views[jaw]);
                    proto::FilmFrame {
                        timestamp: time,
                        frame: number as u32,
                        time_s,
                        contact_force_n: force_n,
                        displacement_mm: way_m * 1e3,
                        camera: Some(proto::CameraStamp {
                            received_s: frame.received_s,
                            device_time_s: frame.device_time_s,
                            quarters: view.quarters,
                            mirror: view.mirror,
                            crop_px: view.crop_px.map(Vec::from).unwrap_or_default(),
                        }),
                        ..Default::default()
                    }
                    .encode_to_vec()
                }),
            });
        }
        encoded
    }
}

/// The frame of a camera as it is looked at.
pub(crate) fn camera_image(bytes: &[u8], camera: &proto::CameraStamp) -> Result<TactileImage, String> {
    let compressed = CompressedImage::decode(bytes).map_err(|e| e.to_string())?;
    let frame = decode(&compressed.data).map_err(|e| e.to_string())?;
    let turned = frame.turned(camera.quarters, camera.mirror);
    match *camera.crop_px {
        [] => Ok(turned),
        [x, y, columns, rows] => turned.cut_out([x, y, columns, rows]).ok_or_else(|| {
            let (width, height) = (turned.width_px, turned.height_px);
            format!("{columns} x {rows} px from ({x}, {y}) on are not in {width} x {height} px")
        }),
        ref other => Err(format!("a cut-out of {} numbers, it has 4", other.len())),
    }
}

pub(crate) fn stamp_of(camera: &proto::CameraStamp) -> CameraStamp {
    CameraStamp { received_s: camera.received_s, device_time_s: camera.device_time_s }
}
