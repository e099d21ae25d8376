//! Motions and joints, by the names and the parameters of the manual.

use super::builtins::{Outcome, list, numbers, pose};
use super::hands::Hands;
use super::value::Value;
use crate::virtual_rig::kinematics::{self, Joints, OutOfReachError};
use gripgen_twin::frames::Pose;

/// Acceleration and speed of a motion that names none (script manual): m/s^2 and m/s along a line, rad/s^2 and rad/s of the joints.
const LINE: (f64, f64) = (1.2, 0.25);
const TURN: (f64, f64) = (1.4, 1.05);

/// Parameters of the way from a pose to joints. What is found here is exact, so that no error is too small for it.
pub(super) const INVERSE: [&str; 5] = ["x", "qnear", "maxPositionError", "maxOrientationError", "tcp"];

type Ends = Result<Outcome, String>;

/// A pose in a line; joints are where the tool is with them.
pub(super) fn move_line(a: &[Value], h: &mut dyn Hands) -> Ends {
    let (acceleration_m_s2, speed_m_s) = pace(a, LINE)?;
    let target = match &a[0] {
        Value::List(_) => numbers(&(kinematics::base_from_flange(&a[0].numbers()?) * tool(&Value::None, h)?)).pose()?,
        value => value.pose()?,
    };
    h.move_line(target, acceleration_m_s2, speed_m_s)?;
    Ok(Outcome::Motion)
}

/// All joints at once, to others or to those that reach a pose.
pub(super) fn move_joints(a: &[Value], h: &mut dyn Hands) -> Ends {
    let (acceleration_rad_s2, speed_rad_s) = pace(a, TURN)?;
    let target_rad = match &a[0] {
        Value::List(_) => a[0].numbers()?,
        value => reaching(value, &Value::None, &Value::None, h)?.map_err(|e| e.to_string())?,
    };
    h.move_joints(target_rad, acceleration_rad_s2, speed_rad_s)?;
    Ok(Outcome::Motion)
}

pub(super) fn stop_line(a: &[Value], h: &mut dyn Hands) -> Ends {
    h.brake(deceleration(&a[0])?);
    Ok(Outcome::Motion)
}

pub(super) fn stop_joints(a: &[Value], h: &mut dyn Hands) -> Ends {
    h.brake_joints(deceleration(&a[0])?);
    Ok(Outcome::Motion)
}

/// The pose of the tool with joints.
pub(super) fn forward(a: &[Value], h: &mut dyn Hands) -> Ends {
    let joints_rad = joints(&a[0], h)?;
    Ok(Outcome::Value(numbers(&(kinematics::base_from_flange(&joints_rad) * tool(&a[1], h)?))))
}

/// The joints of a pose.
pub(super) fn inverse(a: &[Value], h: &mut dyn Hands) -> Ends {
    let found = reaching(&a[0], &a[1], &a[4], h)?;
    found.map(|joints_rad| Outcome::Value(list(&joints_rad))).map_err(|e| e.to_string())
}

pub(super) fn has_inverse(a: &[Value], h: &mut dyn Hands) -> Ends {
    Ok(Outcome::Value(Value::Bool(reaching(&a[0], &a[1], &a[4], h)?.is_ok())))
}

/// Where the flange is.
pub(super) fn flange(h: &dyn Hands) -> Value {
    numbers(&kinematics::base_from_flange(&h.joints()))
}

fn reaching(at: &Value, near: &Value, with: &Value, h: &dyn Hands) -> Result<Result<Joints, OutOfReachError>, String> {
    let base_from_flange = pose(at)? * tool(with, h)?.inverse();
    Ok(kinematics::nearest(&base_from_flange, &joints(near, h)?))
}

/// Joints that are given, or those of now.
fn joints(given: &Value, h: &dyn Hands) -> Result<Joints, String> {
    if matches!(given, Value::None) { Ok(h.joints()) } else { given.numbers() }
}

/// `flange_from_tool` that is given, or that of now. The name of the active one is a default of the manual.
fn tool(given: &Value, h: &dyn Hands) -> Result<Pose, String> {
    match given {
        Value::None => Ok(kinematics::rigid(h.tool())),
        Value::Text(name) if &**name == "active_tcp" => Ok(kinematics::rigid(h.tool())),
        value => pose(value),
    }
}

fn deceleration(value: &Value) -> Result<f64, String> {
    let deceleration = value.number()?;
    if deceleration > 0.0 { Ok(deceleration) } else { Err(format!("a stop with a deceleration of {deceleration}")) }
}

/// Acceleration and speed.
fn pace(a: &[Value], or: (f64, f64)) -> Result<(f64, f64), String> {
    let given = |value: &Value, or: f64| if matches!(value, Value::None) { Ok(or) } else { value.number() };
    if given(&a[3], 0.0)? != 0.0 || given(&a[4], 0.0)? != 0.0 {
        return Err("a motion with a time or a blend radius: this robot knows acceleration and speed alone".into());
    }
    let (acceleration, speed) = (given(&a[1], or.0)?, given(&a[2], or.1)?);
    if !(acceleration > 0.0 && speed > 0.0) {
        return Err(format!("a motion with an acceleration of {acceleration} and a speed of {speed}"));
    }
    Ok((acceleration, speed))
}
