//! From a sample to the messages of a shard.

use crate::background::Background;
use crate::film_frame::EncodedFrame;
use crate::index::index_row;
use crate::picture::{PictureError, encode_png, encode_small_png, encode_smallest_png};
use crate::proto::foxglove::{CompressedImage, RawImage};
use crate::proto::gripgen_v1 as proto;
use gripgen_twin::columns::Scale;
use gripgen_twin::config::{ImageStorage, TraceStorage};
use gripgen_twin::draw::Drawn;
use gripgen_twin::frames::Pose;
use gripgen_twin::image::pixel_noise::PixelNoise;
use gripgen_twin::label::forces::PullForces;
use gripgen_twin::{
    ImprintSummary, Jaw, Outcome, PerJaw, PullTrace, Sample, Scenario, SlipLabel, TactileImage,
};
use prost::Message;
use prost_types::Timestamp;
use std::sync::Arc;

/// Rows of `/pull/state` per second; a viewer needs no more.
pub const VIEW_RATE_HZ: f64 = 50.0;

/// What of a sample is stored, and where in time it stands.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodeOptions {
    /// How images are stored.
    pub images: ImageStorage,
    /// Whether the trace is stored.
    pub trace: TraceStorage,
    /// Rows of `/pull/state` per second; `None` stores every row of the trace.
    pub view_rate_hz: Option<f64>,
    /// Keys beside the fixed columns that get a column of their own in the index.
    pub extra_columns: Vec<String>,
    /// Sensor noise of each image that is stored without it, levels of 0 to 255; `None` where it has it.
    pub noise_apart_rgb: Option<PerJaw<[f32; 3]>>,
    /// What images are stored without, beside their noise; stands in the shard once.
    pub background: Option<Arc<PerJaw<Background>>>,
    /// Samples before this one in its file, and the time each of them takes up.
    pub first_sample: u64,
    /// Time between the starts of two samples of a file.
    pub slot_ns: u64,
}

/// One message, with the time it belongs to.
#[derive(Debug, Clone, PartialEq)]
pub struct Timed {
    /// Nanoseconds since the start of the file's time.
    pub time_ns: u64,
    /// The protobuf message.
    pub data: Vec<u8>,
}

/// A sample as the messages of a shard.
#[derive(Debug, Clone, PartialEq)]
pub struct EncodedSample {
    /// Start of its time slot.
    pub start_ns: u64,
    /// `/sample`
    pub sample: Vec<u8>,
    /// `/tactile/left`, `/tactile/right`
    pub images: Option<PerJaw<Vec<u8>>>,
    /// `/pull/trace`
    pub trace: Option<Vec<u8>>,
    /// `/pull/state`
    pub states: Vec<Timed>,
    /// `/tactile/left/film`, `/tactile/right/film` and what is known beside them, if the pull is filmed.
    pub film: Vec<EncodedFrame>,
    /// What only runs of a rig have.
    pub rig: Option<EncodedRig>,
    /// Its row of the index.
    pub row: Vec<String>,
    /// How it ended.
    pub status: proto::Status,
}

/// The messages of a measured pull beside those of any sample.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct EncodedRig {
    /// `/tactile/left_rest`, `/tactile/right_rest`
    pub rest: Option<PerJaw<Vec<u8>>>,
    /// `/rig/log`, one a stream
    pub streams: Vec<Vec<u8>>,
    /// `/rig/events`, one per event
    pub events: Vec<Vec<u8>>,
}

/// Encodes a sample. Pure: the same sample gives the same bytes.
///
/// # Errors
///
/// An image that cannot be compressed.
pub fn encode(sample: &Sample, options: &EncodeOptions) -> Result<EncodedSample, PictureError> {
    let start_ns = (sample.scenario.index - options.first_sample) * options.slot_ns;
    let timestamp = Some(timestamp(start_ns));
    let mut message = sample_message(sample, timestamp);
    if let Some(sd_rgb) = options.noise_apart_rgb.filter(|_| message.status() != proto::Status::Failed) {
        let noise = |jaw: Jaw| {
            let [red, green, blue] = sd_rgb[jaw];
            let key = PixelNoise::key_of(sample.scenario.seed, sample.scenario.index, jaw);
            (red > 0.0 || green > 0.0 || blue > 0.0).then_some(proto::ImageNoise { key, red, green, blue })
        };
        (message.left_image_noise, message.right_image_noise) = (noise(Jaw::Left), noise(Jaw::Right));
    }
    let row = index_row(&message, &options.extra_columns);
    let status = message.status();
    let images = match &sample.outcome {
        Outcome::Pulled(pulled) => pulled.images.as_ref(),
        Outcome::NoContact { images } => images.as_ref(),
        Outcome::Failed { .. } => None,
    };
    let images = images
        .filter(|_| options.images != ImageStorage::None)
        .map(|both| {
            PerJaw::try_from_fn(|jaw| match options.background.as_deref() {
                None => image_message(&both[jaw], jaw, options.images, timestamp),
                Some(background) => {
                    let data = encode_smallest_png(&background[jaw].taken_off(&both[jaw]))?;
                    Ok(png_message(data, jaw, timestamp))
                }
            })
        })
        .transpose()?;
    let trace = match &sample.outcome {
        Outcome::Pulled(pulled) if options.trace == TraceStorage::Full => Some(&pulled.trace),
        _ => None,
    };
    Ok(EncodedSample {
        start_ns,
        sample: message.encode_to_vec(),
        images,
        trace: trace.map(|t| trace_message(t, timestamp).encode_to_vec()),
        states: trace.map(|t| state_messages(t, start_ns, options.view_rate_hz)).unwrap_or_default(),
        film: vec![],
        rig: None,
        row,
        status,
    })
}

pub(crate) fn timestamp(time_ns: u64) -> Timestamp {
    Timestamp { seconds: (time_ns / 1_000_000_000) as i64, nanos: (time_ns % 1_000_000_000) as i32 }
}

/// What was asked; how it ended is left out.
pub(crate) fn scenario_message(s: &Scenario, timestamp: Option<Timestamp>) -> proto::Sample {
    let Scenario { covariates: c, pull, .. } = s;
    let mut message = proto::Sample {
        timestamp,
        index: s.index,
        seed: s.seed,
        group: s.group,
        repetition: s.repetition,
        part: s.part.clone(),
        grip_pose: s.grip_pose as u32,
        gel_id: c.gel_id.clone(),
        session: c.session.clone(),
        grip_force_n: s.grip_force_n,
        force_increment_n: pull.increment_n,
        force_start_n: pull.start_n,
        step_time_s: pull.step_s,
        dwell_s: c.dwell_s,
        pull_index: c.pull_index,
        time_s: c.time_s,
        temperature_c: c.temperature_c,
        grip_offset_mm: Scale::Thousandth.as_written(c.grip_offset_m),
        grip_angle_deg: Scale::Degree.as_written(c.grip_angle_rad),
        pull_direction: c.pull_direction as i32,
        stop_mm: Scale::Thousandth.as_written(pull.stop_m),
        label_tolerance_n: pull.label_tolerance_n,
        ..Default::default()
    };
    for (key, value) in &s.drawn {
        match value {
            Drawn::Number(x) => drop(message.drawn_number.insert(key.clone(), *x)),
            Drawn::Text(text) => drop(message.drawn_text.insert(key.clone(), text.clone())),
        }
    }
    message
}

fn sample_message(sample: &Sample, timestamp: Option<Timestamp>) -> proto::Sample {
    let mut message = scenario_message(&sample.scenario, timestamp);
    match &sample.outcome {
        Outcome::Pulled(p) => {
            set_label(&mut message, &p.label);
            set_suspect(&mut message, p.suspect.as_deref());
            set_forces(&mut message, &p.forces);
            message.limit_force_n = Some(p.limit_force_n);
            (message.slip_onset_s, message.slip_s) = (p.slip_onset_s, p.slip_s);
            (message.mu_drawn, message.mu_effective) = (Some(p.mu_drawn), Some(p.mu_effective));
            message.outside_fit = p.outside_fit;
            message.lag_exceeds_tolerance = p.lag_exceeds_tolerance;
            let contact = |jaw| {
                let (force, pose) = (p.grasp.normal_force_n[jaw], &p.grasp.gel_from_part[jaw]);
                Some(contact_message(force, pose, &p.imprint[jaw]))
            };
            (message.left, message.right) = (contact(Jaw::Left), contact(Jaw::Right));
        }
        Outcome::NoContact { .. } => {
            message.set_status(proto::Status::NoContact);
            // Jaws that hold nothing: every force is 0.
            message.max_pull_force_n = Some(0.0);
            (message.peak_force_n, message.kinetic_force_n) = (Some(0.0), Some(0.0));
            message.limit_force_n = Some(0.0);
        }
        Outcome::Failed { reason } => {
            message.set_status(proto::Status::Failed);
            message.failure = reason.clone();
        }
    }
    message
}

/// The label of a pull, and the status that goes with it.
pub(crate) fn set_label(message: &mut proto::Sample, label: &SlipLabel) {
    message.set_status(if label.censored { proto::Status::Censored } else { proto::Status::Slipped });
    message.max_pull_force_n = Some(label.max_pull_force_n);
    message.slip_time_s = Some(label.slip_time_s);
    message.censored = label.censored;
}

/// Forces of a trace in addition to its label, which has been set.
pub(crate) fn set_forces(message: &mut proto::Sample, forces: &PullForces) {
    (message.peak_force_n, message.kinetic_force_n) = (forces.peak_force_n, forces.kinetic_force_n);
    let label = message.max_pull_force_n.zip(message.slip_time_s);
    let branch = label
        .and_then(|(label_n, slip_time_s)| forces.branch(label_n, slip_time_s, message.label_tolerance_n));
    message.label_branch = branch.map_or(String::new(), |branch| branch.name().into());
}

/// The status of a label that evidence contradicts; the label stays.
pub(crate) fn set_suspect(message: &mut proto::Sample, reason: Option<&str>) {
    if let Some(reason) = reason {
        message.set_status(proto::Status::Suspect);
        message.status_reason = reason.into();
    }
}

fn contact_message(normal_force_n: f64, pose: &Pose, imprint: &ImprintSummary) -> proto::JawContact {
    let (t, q) = (pose.translation.vector * 1e3, pose.rotation.quaternion());
    let cells = &imprint.patch.cells;
    proto::JawContact {
        normal_force_n,
        press_depth_mm: imprint.press_depth_m * 1e3,
        x_mm: t.x,
        y_mm: t.y,
        z_mm: t.z,
        qx: q.i,
        qy: q.j,
        qz: q.k,
        qw: q.w,
        cell_x_mm: cells.iter().map(|c| (c.x_m * 1e3) as f32).collect(),
        cell_y_mm: cells.iter().map(|c| (c.y_m * 1e3) as f32).collect(),
        cell_area_mm2: cells.iter().map(|c| (c.area_m2 * 1e6) as f32).collect(),
        cell_force_n: cells.iter().map(|c| c.force_n as f32).collect(),
    }
}

pub(crate) fn image_message(
    image: &TactileImage,
    jaw: Jaw,
    storage: ImageStorage,
    timestamp: Option<Timestamp>,
) -> Result<Vec<u8>, PictureError> {
    let frame_id = format!("gel_{jaw}");
    Ok(match storage {
        ImageStorage::Raw => RawImage {
            timestamp,
            frame_id,
            width: image.width_px,
            height: image.height_px,
            encoding: "rgb8".into(),
            step: 3 * image.width_px,
            data: image.rgb.clone(),
        }
        .encode_to_vec(),
        _ => {
            let data =
                if storage == ImageStorage::Clean { encode_small_png(image) } else { encode_png(image) };
            png_message(data?, jaw, timestamp)
        }
    })
}

fn png_message(data: Vec<u8>, jaw: Jaw, timestamp: Option<Timestamp>) -> Vec<u8> {
    let frame_id = format!("gel_{jaw}");
    CompressedImage { timestamp, frame_id, data, format: "png".into() }.encode_to_vec()
}

pub(crate) fn trace_message(trace: &PullTrace, timestamp: Option<Timestamp>) -> proto::PullTrace {
    let single = |values: &[f64], scale: f64| values.iter().map(|x| (x * scale) as f32).collect();
    let rate_hz = uniform_rate_hz(&trace.time_s);
    proto::PullTrace {
        timestamp,
        start_s: trace.time_s.first().copied().unwrap_or(0.0),
        rate_hz: rate_hz.unwrap_or(0.0),
        time_s: if rate_hz.is_some() { vec![] } else { trace.time_s.clone() },
        desired_force_n: single(&trace.desired_force_n, 1.0),
        measured_force_n: single(&trace.measured_force_n, 1.0),
        displacement_mm: single(&trace.displacement_m, 1e3),
    }
}

/// The rate of equally spaced times, `None` if they are not.
fn uniform_rate_hz(time_s: &[f64]) -> Option<f64> {
    let (first, last) = (time_s.first()?, time_s.last()?);
    if time_s.len() < 2 {
        return None;
    }
    let step = (last - first) / (time_s.len() - 1) as f64;
    let uniform = time_s.iter().enumerate().all(|(i, t)| (t - (first + i as f64 * step)).abs() < 1e-7);
    // A rate in whole hertz is meant exactly.
    let rate = 1.0 / step;
    uniform.then(|| if (rate - rate.round()).abs() < 1e-6 * rate { rate.round() } else { rate })
}

pub(crate) fn state_messages(trace: &PullTrace, start_ns: u64, view_rate_hz: Option<f64>) -> Vec<Timed> {
    let mut due_s = f64::NEG_INFINITY;
    let mut states = Vec::new();
    let earliest = trace.time_s.first().copied().unwrap_or(0.0).min(0.0);
    for (i, row) in trace.rows().enumerate() {
        if row.time_s + 1e-9 < due_s && i + 1 < trace.len() {
            continue;
        }
        due_s = view_rate_hz.map_or(f64::NEG_INFINITY, |rate| row.time_s + 1.0 / rate);
        let time_ns = start_ns + ((row.time_s - earliest) * 1e9).round() as u64;
        let data = proto::PullState {
            timestamp: Some(timestamp(time_ns)),
            desired_force_n: row.desired_force_n,
            measured_force_n: row.measured_force_n,
            displacement_mm: row.displacement_m * 1e3,
        }
        .encode_to_vec();
        states.push(Timed { time_ns, data });
    }
    states
}
