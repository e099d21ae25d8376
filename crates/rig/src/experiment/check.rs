//! Does every device answer, and how fast. Nothing moves.

use super::config::RigConfig;
use super::devices::{
    connect_camera, connect_dashboard, connect_for, connect_gripper, connect_listener, connect_primary,
};
use super::prepare::unsupported;
use super::robot::RobotRow;
use crate::camera::{SHIPPED_FRAME_LIMITS, decode_jpeg};
use crate::dashboard::{DashboardCommand, DashboardReply};
use crate::gcl::{GclCommand, GripState, Query};
use crate::primary::PrimaryMessage;
use crate::robot_state::{RobotMode, SafetyStatus};
use crate::rtde::{Event, RtdeClient, Value};
use std::time::{Duration, Instant};

/// How long a device may take.
const REPLY: Duration = Duration::from_secs(2);
/// How long readings and frames are counted.
const COUNT: Duration = Duration::from_millis(1500);
/// Standard gravity.
const GRAVITY_M_S2: f64 = 9.806_65;
/// Readings that an average is made of.
const AVERAGED: usize = 250;
/// Largest force at rest: the accuracy of an e-Series' sensor is 4 N (data sheet), and a payload that is half a kilogram wrong
/// shows with 5 N.
const REST_N: f64 = 5.0;
/// A payload is that of the rig's file if it differs by less: 1 N.
const SAME_PAYLOAD_KG: f64 = 0.1;
/// How long somebody has to hang a mass.
const HANG: Duration = Duration::from_secs(60);

/// One line of the answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct CheckLine {
    /// What was looked at.
    pub what: &'static str,
    /// Whether an experiment can be made with it.
    pub ok: bool,
    /// What was found.
    pub found: String,
}

fn line<E: std::fmt::Display>(what: &'static str, found: Result<(bool, String), E>) -> CheckLine {
    match found {
        Ok((ok, found)) => CheckLine { what, ok, found },
        Err(e) => CheckLine { what, ok: false, found: e.to_string() },
    }
}

/// Looks at every device; `tell` gets each line when it is known.
pub fn check(config: &RigConfig, mut tell: impl FnMut(CheckLine)) {
    robot_data(config).into_iter().for_each(&mut tell);
    dashboard(config).into_iter().for_each(&mut tell);
    tell(line("primary interface", primary(config)));
    tell(line("gripper", gripper(config)));
    tell(line("left camera", camera(config, true)));
    tell(line("right camera", camera(config, false)));
}

/// Readings of about so long, and the controller's version.
fn readings(robot: &RtdeClient, rows: usize, limit: Duration) -> (Vec<RobotRow>, Option<[u32; 4]>) {
    let (began, mut found, mut version) = (Instant::now(), Vec::new(), None);
    while let Some(left) = limit.checked_sub(began.elapsed()) {
        let Ok(event) = robot.events().recv_timeout(left) else { break };
        match event.event {
            Event::ControllerVersion(v) => version = Some(v),
            Event::Data(values) => found.extend(RobotRow::from_values(event.at, &values)),
            _ => {}
        }
        if found.len() >= rows {
            break;
        }
    }
    (found, version)
}

fn robot_data(config: &RigConfig) -> Vec<CheckLine> {
    let began = Instant::now();
    let robot = match connect_listener(config, config.patient(REPLY)) {
        Ok(robot) => robot,
        Err(e) => return vec![line::<String>("RTDE", Ok((false, e.to_string())))],
    };
    let connected_ms = 1e3 * began.elapsed().as_secs_f64();
    let (rows, version) = readings(&robot, usize::MAX, COUNT);
    let Some(last) = rows.last() else {
        return vec![line::<String>("RTDE", Ok((false, "connected, but no reading came".into())))];
    };
    let version = version.map_or("unknown".into(), |[a, b, c, d]| format!("{a}.{b}.{c}.{d}"));
    let (gap_s, late_s) = gaps(&rows);
    let words = format!(
        "controller {version}, connected in {connected_ms:.0} ms, {} readings, largest gap {:.1} ms by its own clock, 99 % arrive \
         within {:.1} ms of the earliest",
        rows.len(),
        1e3 * gap_s,
        1e3 * late_s
    );
    let mode = RobotMode::from_number(last.mode).map_or("unknown", RobotMode::name);
    let safety = SafetyStatus::from_number(last.safety);
    let ready = mode == RobotMode::Running.name() && safety.is_some_and(SafetyStatus::allows_motion);
    let state = format!(
        "{mode}, {}, speed slider {:.0} %, limiter {:.0} %, program {}",
        safety.map_or("unknown", SafetyStatus::name),
        100.0 * last.speed_slider,
        100.0 * last.speed_scaling,
        if last.program_runs() { "running" } else { "stopped" }
    );
    let [fx, fy, fz] = [0, 1, 2].map(|i| rows.iter().map(|r| r.force[i]).sum::<f64>() / rows.len() as f64);
    let rest_n = fx.hypot(fy).hypot(fz);
    let zero = if rest_n < REST_N {
        format!("below {REST_N} N; zeroed before every pull")
    } else {
        format!(
            "{rest_n:.1} N, {REST_N} N are allowed: another payload than the robot counts with, a cable, or an old zero"
        )
    };
    let force = format!("{fx:.2}, {fy:.2}, {fz:.2} N at rest, {zero}");
    let [x, y, z] = last.tcp.position_m.map(|m| 1e3 * m);
    vec![
        line::<String>("RTDE", Ok((gap_s <= config.limits.robot_gap_s, words))),
        line::<String>("robot", Ok((ready && last.is_at_full_speed(), state))),
        line::<String>("tool", Ok((true, format!("at {x:.1}, {y:.1}, {z:.1} mm")))),
        line("tool offset", tool_offset(config)),
        line("payload", payload(config)),
        line::<String>("force", Ok((rest_n < REST_N, force))),
    ]
}

/// Grip centre at the flange that the robot counts with, beside that of the rig's file.
fn tool_offset(config: &RigConfig) -> Result<(bool, String), ReadPoseError> {
    let found_mm = read_tool_mm(config)?;
    let words = |mm: [f64; 3]| format!("{:.1}, {:.1}, {:.1} mm", mm[0], mm[1], mm[2]);
    let (found, wanted) = (words(found_mm), words(config.robot.tool_mm));
    if same_tool(found_mm, config) {
        return Ok((true, format!("{found} at the flange, as in the rig's file")));
    }
    Ok((
        false,
        format!(
            "{found} at the flange, {wanted} in the rig's file: taught poses would be off by the difference"
        ),
    ))
}

/// Weight that the robot counts with, beside that of the rig's file.
fn payload(config: &RigConfig) -> Result<(bool, String), ReadPoseError> {
    let wanted_kg = config.robot.payload_kg;
    let found_kg = match read_one(config, "payload")? {
        Value::Double(found_kg) => found_kg,
        other => return Ok((false, format!("the robot answers {other:?} to payload"))),
    };
    let ok = (found_kg - wanted_kg).abs() < SAME_PAYLOAD_KG;
    let words = match ok {
        true => "as in the rig's file".to_string(),
        false => format!(
            "{wanted_kg:.2} kg in the rig's file: the reading at rest would be off by the difference's weight"
        ),
    };
    Ok((ok, format!("{found_kg:.2} kg, {words}")))
}

/// The value of one output field.
fn read_one(config: &RigConfig, field: &str) -> Result<Value, ReadPoseError> {
    let robot = connect_for(config, &["timestamp", field], config.patient(REPLY))?;
    let began = Instant::now();
    while let Some(left) = config.patient(REPLY).checked_sub(began.elapsed()) {
        let Ok(event) = robot.events().recv_timeout(left) else { break };
        if let Event::Data(values) = event.event
            && let Some(value) = values.get(1)
        {
            return Ok(*value);
        }
    }
    Err(ReadPoseError::Silent)
}

fn same_tool(found_mm: [f64; 3], config: &RigConfig) -> bool {
    (0..3).all(|i| (found_mm[i] - config.robot.tool_mm[i]).abs() < SAME_TOOL_MM)
}

fn read_tool_mm(config: &RigConfig) -> Result<[f64; 3], ReadPoseError> {
    match read_one(config, "tcp_offset")? {
        Value::Vector6d([x, y, z, ..]) => Ok([x, y, z].map(|m| 1e3 * m)),
        _ => Err(ReadPoseError::Silent),
    }
}

/// Largest gap in the robot's clock, and how late 99 % of the readings are at most, beside the earliest, when a constant
/// rate between both clocks is taken out.
fn gaps(rows: &[RobotRow]) -> (f64, f64) {
    let gap_s = rows.windows(2).map(|w| w[1].timestamp_s - w[0].timestamp_s).fold(0.0, f64::max);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return (gap_s, 0.0) };
    let device_s = (last.timestamp_s - first.timestamp_s).max(1e-9);
    let rate = (last.at - first.at).as_secs_f64() / device_s;
    let late: Vec<f64> = rows
        .iter()
        .map(|row| (row.at - first.at).as_secs_f64() - rate * (row.timestamp_s - first.timestamp_s))
        .collect();
    let earliest = late.iter().copied().fold(f64::INFINITY, f64::min);
    let mut late: Vec<f64> = late.iter().map(|x| x - earliest).collect();
    late.sort_by(f64::total_cmp);
    (gap_s, late.get(late.len() * 99 / 100).copied().unwrap_or(0.0))
}

fn dashboard(config: &RigConfig) -> Vec<CheckLine> {
    let mut client = match connect_dashboard(config) {
        Ok(client) => client,
        Err(e) => return vec![line::<String>("dashboard", Ok((false, e.to_string())))],
    };
    let mut ask = |what: &'static str, command: DashboardCommand| {
        let answer = client.command(command, config.patient(REPLY));
        line(
            what,
            answer.map(|reply| match reply {
                DashboardReply::RemoteControl(remote) => {
                    let words = if remote { "remote" } else { "local: programs from outside are not taken" };
                    (remote, words.to_string())
                }
                DashboardReply::Version(v) => match unsupported(&v) {
                    None => (true, format!("PolyScope {}.{}.{}", v.major, v.minor, v.bugfix)),
                    Some(why) => (false, why),
                },
                DashboardReply::SerialNumber(number) => (true, format!("serial number {number}")),
                other => (true, format!("{other:?}")),
            }),
        )
    };
    vec![
        ask("dashboard", DashboardCommand::PolyscopeVersion),
        ask("controller", DashboardCommand::SerialNumber),
        ask("control", DashboardCommand::IsInRemoteControl),
    ]
}

fn primary(config: &RigConfig) -> Result<(bool, String), String> {
    let client = connect_primary(config).map_err(|e| e.to_string())?;
    let began = Instant::now();
    while let Some(left) = config.patient(REPLY).checked_sub(began.elapsed()) {
        let Ok(event) = client.messages().recv_timeout(left) else { break };
        if let PrimaryMessage::Version { .. } = event.event {
            return Ok((true, event.event.to_string()));
        }
    }
    Ok((false, format!("no version came within {:.0} s", REPLY.as_secs_f64())))
}

fn gripper(config: &RigConfig) -> Result<(bool, String), String> {
    let reply = config.patient(REPLY);
    let mut client = connect_gripper(config).map_err(|e| e.to_string())?;
    let began = Instant::now();
    let state = client.ask(Query::GripState, reply).map_err(|e| e.to_string())?;
    let reply_ms = 1e3 * began.elapsed().as_secs_f64();
    let width_mm = client.ask(Query::Position, reply).map_err(|e| e.to_string())?;
    client.run(&GclCommand::Verbose(true), reply).map_err(|e| e.to_string())?;
    let state = GripState::from_number(state);
    let ready = matches!(state, Some(GripState::Idle));
    let words = format!(
        "{}, jaws at {width_mm:.1} mm, answers in {reply_ms:.1} ms",
        state.map_or("unknown".into(), |s| format!("{s:?}").to_lowercase())
    );
    client.close().map_err(|e| e.to_string())?;
    Ok((ready, words))
}

fn camera(config: &RigConfig, left: bool) -> Result<(bool, String), String> {
    let client = connect_camera(config, left).map_err(|e| e.to_string())?;
    let began = Instant::now();
    let first = client.frame_after(began, config.patient(REPLY)).map_err(|e| e.to_string())?;
    let seen = client.frames_seen();
    std::thread::sleep(COUNT);
    let rate_hz = (client.frames_seen() - seen) as f64 / COUNT.as_secs_f64();
    let last = client.frame_after(Instant::now(), config.patient(REPLY)).map_err(|e| e.to_string())?;
    let frame = decode_jpeg(&last.event.jpeg, &SHIPPED_FRAME_LIMITS).map_err(|e| e.to_string())?;
    let views = config.views();
    let view = if left { views.left } else { views.right };
    let image = view.apply(&frame).map_err(|e| e.to_string())?;
    let stamped = match (first.event.device_time_s, last.event.device_time_s) {
        (Some(a), Some(b)) if b > a => "stamped",
        (Some(_), Some(_)) => return Ok((false, "its stamps stand still: the picture is frozen".into())),
        _ => "without stamps",
    };
    let words = format!(
        "{rate_hz:.0} frames per second of {} x {} px, {stamped}, images of {} x {} px",
        frame.width_px, frame.height_px, image.width_px, image.height_px
    );
    Ok((rate_hz > 5.0, words))
}

/// What hanging a known mass on the tool says of sign and gain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceCheck {
    /// Change of the reading along z.
    pub change_n: f64,
    /// Weight of the mass.
    pub weight_n: f64,
    /// `force_sign` that follows.
    pub sign: f64,
    /// `force_gain` that follows.
    pub gain: f64,
}

/// Why sign and gain are not known.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ForceCheckError {
    /// The robot.
    #[error("{0}")]
    Connect(#[from] super::devices::ConnectError),
    /// No readings.
    #[error("{found} readings came, {AVERAGED} are needed")]
    Readings {
        /// How many.
        found: usize,
    },
    /// Nobody hung a mass, or one of another weight.
    #[error("the reading changed by {change_n:.2} N within {waited_s:.0} s, the mass weighs {weight_n:.2} N")]
    Nothing {
        /// By how much it changed.
        change_n: f64,
        /// How long it was waited.
        waited_s: f64,
        /// What the mass weighs.
        weight_n: f64,
    },
}

/// Finds sign and gain of the force sensor: reads it, says that the mass is to be hung, and reads it again. Nothing moves.
///
/// # Errors
///
/// No connection, too few readings, or a change of the reading that is no weight.
pub fn check_force(
    config: &RigConfig,
    mass_kg: f64,
    hang: impl FnOnce(),
) -> Result<ForceCheck, ForceCheckError> {
    let robot = connect_listener(config, config.patient(REPLY))?;
    let average = || {
        let (rows, _) = readings(&robot, AVERAGED, config.patient(REPLY));
        if rows.len() < AVERAGED {
            return Err(ForceCheckError::Readings { found: rows.len() });
        }
        Ok(rows.iter().map(|r| r.force[2]).sum::<f64>() / rows.len() as f64)
    };
    let before_n = average()?;
    hang();
    let weight_n = mass_kg * GRAVITY_M_S2;
    let began = Instant::now();
    loop {
        let change_n = average()? - before_n;
        if change_n.abs() > 0.5 * weight_n {
            // It swings at first.
            std::thread::sleep(Duration::from_secs(1));
            while robot.events().try_recv().is_ok() {}
            let change_n = average()? - before_n;
            // The mass pulls down, as a part does that is pulled up.
            let gain = weight_n / change_n.abs();
            return Ok(ForceCheck { change_n, weight_n, sign: change_n.signum(), gain });
        }
        if began.elapsed() > HANG {
            return Err(ForceCheckError::Nothing {
                change_n,
                waited_s: began.elapsed().as_secs_f64(),
                weight_n,
            });
        }
    }
}

/// Grip centres that are closer than this are the same.
const SAME_TOOL_MM: f64 = 0.5;
/// A tool that is slower than this stands.
const STILL_M_S: f64 = 1e-3;

/// Why no pose is taught.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ReadPoseError {
    /// The robot.
    #[error("{0}")]
    Connect(#[from] super::devices::ConnectError),
    /// No reading.
    #[error("the robot is connected, but no reading came within {:.0} s", REPLY.as_secs_f64())]
    Silent,
    /// Its grip centre is another one.
    #[error(
        "the robot counts with a grip centre {found_mm:?} mm from its flange, the rig's file says {wanted_mm:?} mm: the pose would be off by \
         the difference"
    )]
    Tool {
        /// What the robot has.
        found_mm: [f64; 3],
        /// What the rig's file has.
        wanted_mm: [f64; 3],
    },
    /// It moves.
    #[error("the tool moves with {speed_mm_s:.1} mm/s, it must stand (below {max_mm_s} mm/s)")]
    Moving {
        /// Its speed.
        speed_mm_s: f64,
        /// What counts as standing.
        max_mm_s: f64,
    },
}

/// Where the tool stands: what is taught.
///
/// # Errors
///
/// No connection, no reading, a tool that moves, or another grip centre than that of the configuration.
pub fn read_pose(config: &RigConfig) -> Result<crate::program::TcpPose, ReadPoseError> {
    let found_mm = read_tool_mm(config)?;
    if !same_tool(found_mm, config) {
        return Err(ReadPoseError::Tool { found_mm, wanted_mm: config.robot.tool_mm });
    }
    let robot = connect_listener(config, config.patient(REPLY))?;
    let (rows, _) = readings(&robot, AVERAGED, config.patient(REPLY));
    let Some(last) = rows.last() else { return Err(ReadPoseError::Silent) };
    let speed_m_s = rows.iter().map(RobotRow::speed_m_s).fold(0.0, f64::max);
    if speed_m_s > STILL_M_S {
        return Err(ReadPoseError::Moving { speed_mm_s: 1e3 * speed_m_s, max_mm_s: 1e3 * STILL_M_S });
    }
    Ok(last.tcp)
}
