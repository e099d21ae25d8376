//! Does every device answer, and how fast. Nothing moves, and every device is left as it was found.

mod force;
mod readings;

pub use force::{ForceCheck, ForceCheckError, check_force};

use super::config::RigConfig;
use super::devices::{
    ConnectError, connect_camera, connect_dashboard, connect_for, connect_gripper, connect_listener,
    connect_primary, connect_robot,
};
use super::prepare::unsupported;
use super::robot::RobotRow;
use crate::camera::{SHIPPED_FRAME_LIMITS, decode_jpeg};
use crate::dashboard::{DashboardCommand, DashboardReply};
use crate::gcl::{GclClient, GclRunError, GripState, Query};
use crate::primary::PrimaryMessage;
use crate::program::registers;
use crate::robot_state::{RobotMode, SafetyStatus};
use crate::rtde::{Event, Value};
use readings::watch;
use std::time::{Duration, Instant};

/// How long a device may take.
const REPLY: Duration = Duration::from_secs(2);
/// How long readings and frames are counted.
const COUNT: Duration = Duration::from_millis(1500);
/// Readings that an average is made of.
const AVERAGED: usize = 250;
/// Largest force at rest: the accuracy of an e-Series' sensor is 4 N (data sheet), and a payload that is half a kilogram wrong
/// shows with 5 N.
const REST_N: f64 = 5.0;
/// A payload is that of the rig's file if it differs by less: 1 N.
const SAME_PAYLOAD_KG: f64 = 0.1;

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

fn robot_data(config: &RigConfig) -> Vec<CheckLine> {
    let began = Instant::now();
    let robot = match connect_listener(config, config.patient(REPLY)) {
        Ok(robot) => robot,
        Err(e) => return vec![line::<String>("RTDE", Ok((false, e.to_string())))],
    };
    let connected_ms = 1e3 * began.elapsed().as_secs_f64();
    let watch = watch(&robot, usize::MAX, COUNT);
    drop(robot);
    let stream = line::<String>("RTDE", Ok(watch.judged(config, connected_ms)));
    let rows = &watch.rows;
    let Some(last) = rows.last() else { return vec![stream] };
    let (mode, safety) = (RobotMode::from_number(last.mode), SafetyStatus::from_number(last.safety));
    let ready = mode == Some(RobotMode::Running) && safety.is_some_and(SafetyStatus::allows_motion);
    let state = format!(
        "{}, {}, speed slider {:.0} %, limiter {:.0} %, program {}",
        mode.map_or_else(|| format!("unknown mode {}", last.mode), |mode| mode.name().into()),
        safety.map_or_else(|| format!("unknown safety mode {}", last.safety), |safety| safety.name().into()),
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
        stream,
        line("registers", registers_free(config)),
        line::<String>("robot", Ok((ready && last.is_at_full_speed(), state))),
        line::<String>("tool", Ok((true, format!("at {x:.1}, {y:.1}, {z:.1} mm")))),
        line("tool offset", tool_offset(config)),
        line("payload", payload(config)),
        line::<String>("force", Ok((rest_n < REST_N, force))),
    ]
}

/// Whether the inputs can be had that an experiment writes. Nothing is written, and they are free again at once.
fn registers_free(config: &RigConfig) -> Result<(bool, String), ConnectError> {
    connect_robot(config)?;
    let (heartbeat, go) = (registers::HEARTBEAT, registers::GO);
    Ok((true, format!("input_int_register_{heartbeat} and input_int_register_{go} are free")))
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
        other => return Err(ReadPoseError::Type { field: "payload", found: format!("{other:?}") }),
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
    Err(robot.ended().map_or(ReadPoseError::Silent, |end| ReadPoseError::Ended(end.to_string())))
}

fn same_tool(found_mm: [f64; 3], config: &RigConfig) -> bool {
    (0..3).all(|i| (found_mm[i] - config.robot.tool_mm[i]).abs() < SAME_TOOL_MM)
}

fn read_tool_mm(config: &RigConfig) -> Result<[f64; 3], ReadPoseError> {
    match read_one(config, "tcp_offset")? {
        Value::Vector6d([x, y, z, ..]) => Ok([x, y, z].map(|m| 1e3 * m)),
        found => Err(ReadPoseError::Type { field: "tcp_offset", found: format!("{found:?}") }),
    }
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
                other => (false, format!("the controller answers {other:?} to `{}`", command.line())),
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
    match client.ended() {
        Some(end) => Err(format!("the connection ended before its version came: {end}")),
        None => Err(format!("no version came within {:.0} s", config.patient(REPLY).as_secs_f64())),
    }
}

fn gripper(config: &RigConfig) -> Result<(bool, String), String> {
    let mut client = connect_gripper(config).map_err(|e| e.to_string())?;
    let found = gripper_state(&mut client, config.patient(REPLY));
    // Whatever it said: a connection that is cut without a goodbye is an emergency to it.
    let closed = client.close();
    let found = found.map_err(|e| e.to_string())?;
    closed.map_err(|e| e.to_string())?;
    Ok(found)
}

/// Only questions: nothing is set.
fn gripper_state(client: &mut GclClient, reply: Duration) -> Result<(bool, String), GclRunError> {
    let began = Instant::now();
    let number = client.ask(Query::GripState, reply)?;
    let reply_ms = 1e3 * began.elapsed().as_secs_f64();
    let width_mm = client.ask(Query::Position, reply)?;
    let state = GripState::from_number(number);
    let words = format!(
        "{}, jaws at {width_mm:.1} mm, answers in {reply_ms:.1} ms",
        state.map_or(format!("unknown state {number}"), |s| format!("{s:?}").to_lowercase())
    );
    Ok((matches!(state, Some(GripState::Idle)), words))
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
        (Some(a), Some(b)) if b < a => {
            return Ok((false, format!("its clock went back from {a:.3} s to {b:.3} s")));
        }
        (Some(a), Some(_)) => {
            return Ok((false, format!("its stamps stand still at {a:.3} s: the picture is frozen")));
        }
        _ => "without stamps",
    };
    let words = format!(
        "{rate_hz:.0} frames per second of {} x {} px, {stamped}, images of {} x {} px",
        frame.width_px, frame.height_px, image.width_px, image.height_px
    );
    Ok((rate_hz > 5.0, words))
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
    Connect(#[from] ConnectError),
    /// No reading.
    #[error("the robot is connected, but no reading came within {:.0} s", REPLY.as_secs_f64())]
    Silent,
    /// The connection ended before.
    #[error("the connection to the robot ended: {0}")]
    Ended(String),
    /// A value of another type than that of the guide.
    #[error("the robot answers {found} to {field}, which cannot be read")]
    Type {
        /// What was asked.
        field: &'static str,
        /// What came.
        found: String,
    },
    /// Its clock stands: where the tool is now is unknown.
    #[error("the robot's clock stands at {time_s:.3} s: its readings say nothing new")]
    ClockStands {
        /// Where it stands.
        time_s: f64,
    },
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
    let watch = watch(&robot, AVERAGED, config.patient(REPLY));
    if let Some(end) = watch.ended {
        return Err(ReadPoseError::Ended(end));
    }
    let rows = watch.rows;
    let [first, .., last] = &rows[..] else { return Err(ReadPoseError::Silent) };
    if last.timestamp_s <= first.timestamp_s {
        return Err(ReadPoseError::ClockStands { time_s: last.timestamp_s });
    }
    let speed_m_s = rows.iter().map(RobotRow::speed_m_s).fold(0.0, f64::max);
    if speed_m_s > STILL_M_S {
        return Err(ReadPoseError::Moving { speed_mm_s: 1e3 * speed_m_s, max_mm_s: 1e3 * STILL_M_S });
    }
    Ok(last.tcp)
}
