//! From what the rig measured to what the recorder stores.

use gripgen::record::{FrameView, RigFilm, RigFrame, RigLog, RigLogEvent, RigPull, RigResult, RigStream};
use gripgen::twin::columns::notes::TEMPERATURE;
use gripgen::twin::draw::Drawn;
use gripgen::twin::label::check::{
    Expected, GripForceEvidence, LabelEvidence, WrenchRow, ZERO_SHIFT, check_label,
};
use gripgen::twin::{Campaign, Covariates, Jaw, PerJaw, PlannedPull, PullKind, PullSettings, Scenario};
use gripgen_rig::experiment::film::FilmedFrame;
use gripgen_rig::experiment::pull::{ExecutedPull, FrameStamp};
use gripgen_rig::experiment::{PullOutcome, RigConfig, RobotRow};

/// Where a pull stands in its campaign.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Standing {
    /// Its place among the pulls.
    pub index: u64,
    /// Pulls that were made before it.
    pub made: u64,
    /// Time since the campaign began.
    pub time_s: f64,
}

/// A measured pull as it is stored.
///
/// `suspect` is what [`suspect`] says of it.
pub fn rig_pull(
    config: &RigConfig,
    campaign: &Campaign,
    standing: Standing,
    m: ExecutedPull,
    suspect: Option<String>,
) -> RigPull {
    let result = match (&m.outcome, suspect) {
        (PullOutcome::Labelled(label), Some(reason)) => RigResult::Suspect { label: *label, reason },
        (outcome, _) => result_of(outcome),
    };
    let scenario = scenario(config, campaign, standing, &m);
    let mut streams = vec![robot(&m.rows, &m.rows_unix_s)];
    streams.extend(Jaw::BOTH.map(|jaw| camera(jaw, &m)).into_iter().flatten());
    let mut events: Vec<RigLogEvent> = Vec::with_capacity(m.log.len() + 2);
    let event = |host_time_s, device_time_s, source: &str, text: String| RigLogEvent {
        host_time_s,
        device_time_s,
        source: source.into(),
        text,
    };
    events.extend(m.log.iter().map(|(at, line)| event(*at, None, line.source, line.text.clone())));
    let start = format!("time_s {:.6}, preload {:.3} N", standing.time_s, m.preload_n);
    events.push(event(m.unix_s, Some(m.robot_time_s), START, start));
    events.push(event(m.unix_s, Some(m.robot_time_s), EVIDENCE, beside(config, &m)));
    if let Some(stopped) = &m.stopped {
        let still = if stopped.still {
            "the robot stood still"
        } else {
            "nobody knows whether the robot stood still"
        };
        let text = format!("{}; {still}; {}", stopped.reason, stopped.steps.join("; "));
        events.push(event(m.unix_s, None, "safe stop", text));
    }
    events.sort_by(|a, b| a.host_time_s.total_cmp(&b.host_time_s));
    RigPull {
        scenario,
        result,
        images: m.images,
        rest: m.rest,
        film: (config.images.film_hz > 0.0).then(|| film(config, &m.film, m.robot_time_s)),
        trace: m.trace.filter(|trace| trace.len() > 1),
        log: RigLog { streams, events },
    }
}

/// The film, by the clock of the trace.
fn film(config: &RigConfig, frames: &[PerJaw<FilmedFrame>], start_s: f64) -> RigFilm {
    let views = config.views();
    let frame = |filmed: &FilmedFrame| RigFrame {
        received_s: ((filmed.robot_time_s - start_s) * 1e6).round() * 1e-6,
        device_time_s: filmed.frame.device_time_s,
        jpeg: filmed.frame.jpeg.as_slice().into(),
    };
    RigFilm {
        views: PerJaw::from_fn(|jaw| FrameView {
            quarters: views[jaw].rotate_deg / 90,
            mirror: views[jaw].mirror,
            crop_px: views[jaw].crop_px,
        }),
        frames: frames.iter().map(|both| PerJaw::from_fn(|jaw| frame(&both[jaw]))).collect(),
    }
}

fn result_of(outcome: &PullOutcome) -> RigResult {
    match outcome {
        PullOutcome::Labelled(label) if label.censored => RigResult::Censored { label: *label },
        PullOutcome::Labelled(label) => RigResult::Slipped { label: *label },
        PullOutcome::NoContact => RigResult::NoContact,
        PullOutcome::Failed { reason } => RigResult::Failed { reason: reason.clone() },
    }
}

/// How far a grip force that the gripper reports may be from the one that was asked, N and as a share: without
/// force-measuring fingers a WSG 50 knows its force from the motor current, badly below 20 N.
const GRIP_FORCE_N: f64 = 2.5;
const GRIP_FORCE_SHARE: f64 = 0.1;
/// Less than the time between two rows, s.
const ROW_S: f64 = 1e-3;

/// Why the label of a pull is suspect, by all that was recorded of it; `None` if it is not, or if there is none.
pub fn suspect(config: &RigConfig, campaign: &Campaign, m: &ExecutedPull) -> Option<String> {
    let PullOutcome::Labelled(label) = &m.outcome else { return None };
    let asked_n = m.planned.grip_force_n;
    let allowed_n = GRIP_FORCE_N.max(GRIP_FORCE_SHARE * asked_n);
    let sign = config.robot.force_sign * config.robot.force_gain * m.planned.pull_direction;
    let times = m.trace.as_ref().map_or(&[][..], |trace| &trace.time_s);
    // Rows of the trace only: between the reading without a load and the pull the jaws closed.
    let unloaded_s = times.iter().rev().find(|t| **t < 0.0);
    let span = |from_s: Option<&f64>, to_s: Option<&f64>, time_s: f64| {
        from_s.is_some_and(|t| time_s > t - ROW_S) && to_s.is_some_and(|t| time_s < t + ROW_S)
    };
    let of_trace = |time_s: f64| match time_s < 0.0 {
        true => span(times.first(), unloaded_s, time_s),
        false => span(Some(&0.0), times.last(), time_s),
    };
    let wrench: Vec<WrenchRow> = m
        .rows
        .iter()
        .map(|row| {
            let [x, y, z, rx, ry, rz] = row.force;
            let across_n = [x, y].map(|force_n| force_n * config.robot.force_gain);
            let time_s = row.timestamp_s - m.robot_time_s;
            WrenchRow { time_s, pull_n: sign * z, across_n, torque_nm: [rx, ry, rz] }
        })
        .filter(|row| of_trace(row.time_s))
        .collect();
    let of_trace = LabelEvidence::of_trace(
        label.max_pull_force_n,
        campaign.label_tolerance_n,
        campaign.stop_m,
        m.trace.as_ref(),
    );
    let evidence = LabelEvidence {
        censored: label.censored,
        every_reading: true,
        no_load_after_n: &m.no_load_after_n,
        grip_force: m.reported_force_n.map(|reported_n| GripForceEvidence { asked_n, reported_n, allowed_n }),
        wrench: &wrench,
        ..of_trace
    };
    let by_force = check_label(&evidence, &Expected::default()).reason();
    let reasons: Vec<String> = by_force.into_iter().chain(m.doubts.iter().cloned()).collect();
    (!reasons.is_empty()).then(|| reasons.join("; "))
}

/// Source of the event with what was measured beside the label.
pub const EVIDENCE: &str = "evidence";
/// So long before the pull the jaws have closed and nothing pulls yet.
const CLAMPED_S: f64 = 0.3;

/// What was measured beside the label and may explain it: the shift of the zero, the gripper's word less what was asked, what the
/// jaws press across the pull. Readers take it as columns.
fn covariates_beside(config: &RigConfig, m: &ExecutedPull) -> Vec<(&'static str, f64)> {
    let across_n = |row: &&RobotRow| config.robot.force_gain.abs() * row.force[0].hypot(row.force[1]);
    let clamped = clamped(m);
    let lateral_n = clamped.iter().map(across_n).sum::<f64>() / clamped.len().max(1) as f64;
    let off_n = m.reported_force_n.map(|reported_n| reported_n - m.planned.grip_force_n);
    let lateral_n = (!clamped.is_empty()).then_some(lateral_n);
    let all = [(ZERO_SHIFT, m.zero_shift_n), ("grip_force_off_n", off_n), ("lateral_n", lateral_n)];
    all.into_iter().filter_map(|(name, x)| Some((name, x.filter(|x| x.is_finite())?))).collect()
}

/// Readings of jaws that have closed while nothing pulls yet.
fn clamped(m: &ExecutedPull) -> Vec<&RobotRow> {
    let before = |row: &&RobotRow| (-CLAMPED_S..0.0).contains(&(row.timestamp_s - m.robot_time_s));
    m.rows.iter().filter(before).collect()
}

/// What was measured beside the label: the gripper's word, the zero before and after, what was zeroed away, what the jaws press across the pull.
fn beside(config: &RigConfig, m: &ExecutedPull) -> String {
    let mean = |values: Vec<f64>| match values.len() {
        0 => "none".to_string(),
        n => format!("{:.3}", values.iter().sum::<f64>() / n as f64),
    };
    let gain = config.robot.force_gain;
    let unloaded = m.trace.as_ref().map_or(Vec::new(), |trace| {
        trace.rows().filter(|row| row.time_s < 0.0).map(|row| row.measured_force_n).collect()
    });
    let clamped = clamped(m);
    let of_clamped = |of: &dyn Fn(&RobotRow) -> f64| mean(clamped.iter().map(|row| of(row)).collect());
    format!(
        "reported_grip_force_n {}, no_load_before_n {}, no_load_after_n {}, zeroed_away_z_n {}, lateral_x_n {}, lateral_y_n {}, \
         torque_x_nm {}, torque_y_nm {}, torque_z_nm {}",
        m.reported_force_n.map_or("none".into(), |n| format!("{n:.3}")),
        mean(unloaded),
        mean(m.no_load_after_n.clone()),
        of_clamped(&|row| row.raw_force[2] - row.force[2]),
        of_clamped(&|row| gain * row.force[0]),
        of_clamped(&|row| gain * row.force[1]),
        of_clamped(&|row| row.force[3]),
        of_clamped(&|row| row.force[4]),
        of_clamped(&|row| row.force[5]),
    )
}

/// Source of the event that ties the clocks of a pull together.
pub const START: &str = "start of the pull";

fn scenario(config: &RigConfig, campaign: &Campaign, standing: Standing, m: &ExecutedPull) -> Scenario {
    let planned = &m.planned;
    let (group, repetition) = group_of(campaign, standing.index as usize);
    let thousandth = |x: f64| (x * 1e3).round() * 1e-3;
    Scenario {
        seed: 0,
        index: standing.index,
        group,
        repetition,
        part: planned.part.clone(),
        grip_pose: 0,
        grip_force_n: planned.grip_force_n,
        covariates: Covariates {
            pull_index: standing.made,
            time_s: thousandth(standing.time_s),
            dwell_s: thousandth(m.dwell_s),
            // A rig has no thermometer: it is that of a person, or none.
            temperature_c: match planned.notes.get(TEMPERATURE) {
                Some(Drawn::Number(celsius)) => *celsius,
                _ => f64::NAN,
            },
            ..planned.covariates()
        },
        pull: PullSettings {
            increment_n: planned.force_increment_n,
            start_n: planned.force_start_n,
            step_s: planned.step_time_s,
            step_jitter: 0.0,
            stop_m: campaign.stop_m,
            direction: [0.0, 0.0, 1.0],
            max_force_n: Some(config.limits.pull_force_n),
            max_time_s: config.limits.pull_time_s,
            label_tolerance_n: campaign.label_tolerance_n,
        },
        drawn: covariates_beside(config, m)
            .into_iter()
            .map(|(name, x)| (name.into(), Drawn::Number(thousandth(x))))
            .chain(planned.notes.clone().into_iter().filter(|(name, _)| name != TEMPERATURE))
            .collect(),
    }
}

/// The first pull of the campaign with the same settings, and how many of them come before this one: repetitions stay together
/// when data are split by group.
fn group_of(campaign: &Campaign, index: usize) -> (u64, u64) {
    let pulls: Vec<&PlannedPull> = campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).collect();
    let Some(mine) = pulls.get(index) else { return (index as u64, 0) };
    let same = |p: &PlannedPull| {
        let alike = PlannedPull {
            pause_s: mine.pause_s,
            session: mine.session.clone(),
            gel_id: mine.gel_id.clone(),
            notes: mine.notes.clone(),
            ..p.clone()
        };
        alike == **mine
    };
    let first = pulls.iter().position(|p| same(p)).unwrap_or(index);
    (first as u64, pulls[..index].iter().filter(|p| same(p)).count() as u64)
}

fn robot(rows: &[RobotRow], unix_s: &[f64]) -> RigStream {
    let column = |of: &dyn Fn(&RobotRow) -> f64| rows.iter().map(of).collect::<Vec<f64>>();
    let mut columns: Vec<(String, Vec<f64>)> = Vec::new();
    for (i, axis) in ["x", "y", "z"].into_iter().enumerate() {
        columns.push((format!("tcp_{axis}_mm"), column(&|r| 1e3 * r.tcp.position_m[i])));
        columns.push((format!("tcp_r{axis}_rad"), column(&|r| r.tcp.rotation_rad[i])));
        columns.push((format!("speed_{axis}_m_s"), column(&|r| r.speed[i])));
        columns.push((format!("force_{axis}_n"), column(&|r| r.force[i])));
        columns.push((format!("torque_{axis}_nm"), column(&|r| r.force[3 + i])));
        columns.push((format!("raw_force_{axis}_n"), column(&|r| r.raw_force[i])));
    }
    type Of = fn(&RobotRow) -> f64;
    let single: [(&str, Of); 13] = [
        ("robot_mode", |r| f64::from(r.mode)),
        ("safety_mode", |r| f64::from(r.safety)),
        ("safety_status_bits", |r| f64::from(r.safety_bits)),
        ("runtime_state", |r| f64::from(r.runtime)),
        ("speed_scaling", |r| r.speed_scaling),
        ("speed_slider", |r| r.speed_slider),
        ("phase", |r| f64::from(r.phase)),
        ("step", |r| f64::from(r.step)),
        ("run", |r| f64::from(r.run)),
        ("stop_reason", |r| f64::from(r.reason)),
        ("desired_force_n", |r| r.desired_n),
        ("displacement_mm", |r| 1e3 * r.displacement_m),
        ("lateral_mm", |r| 1e3 * r.lateral_m),
    ];
    columns.extend(single.into_iter().map(|(name, of)| (name.to_string(), column(&of))));
    RigStream {
        name: "robot".into(),
        host_time_s: unix_s.to_vec(),
        device_time_s: rows.iter().map(|r| r.timestamp_s).collect(),
        columns,
    }
}

/// Stamps of the frames that were taken; nothing where there are none.
fn camera(jaw: Jaw, m: &ExecutedPull) -> Option<RigStream> {
    let frames: Vec<&FrameStamp> = m.frames.iter().filter(|frame| frame.jaw == jaw).collect();
    // Host stamps lie on the robot's: both are this machine's clock.
    let origin = m.rows.first().zip(m.rows_unix_s.first());
    let (row, unix_s) = origin?;
    let host_time_s = frames.iter().map(|frame| match frame.at.checked_duration_since(row.at) {
        Some(after) => unix_s + after.as_secs_f64(),
        None => unix_s - row.at.duration_since(frame.at).as_secs_f64(),
    });
    let device: Option<Vec<f64>> = frames.iter().map(|frame| frame.device_time_s).collect();
    let is_grip = frames.iter().map(|frame| f64::from(u8::from(frame.what == "grip"))).collect();
    (!frames.is_empty()).then(|| RigStream {
        name: format!("camera_{jaw}"),
        host_time_s: host_time_s.collect(),
        device_time_s: device.unwrap_or_default(),
        columns: vec![("is_grip".into(), is_grip)],
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repetitions_are_one_group() {
        let pull = |part: &str, session: &str| PlannedPull {
            part: part.into(),
            grip_force_n: 20.0,
            session: session.into(),
            ..PlannedPull::default()
        };
        let pause = PlannedPull { kind: PullKind::NoLoad, ..PlannedPull::default() };
        let pulls = vec![pause, pull("a", "1"), pull("b", "1"), pull("a", "2"), pull("a", "2")];
        let campaign = Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls };
        let groups: Vec<(u64, u64)> = (0..4).map(|i| group_of(&campaign, i)).collect();
        assert_eq!(groups, [(0, 0), (1, 0), (0, 1), (0, 2)]);
    }
}
