//! Motions and joints, by the names and the parameters of the manual.

use super::hands::Hands;
use super::outcome::{Outcome, list, numbers, pose};
use super::value::Value;
use crate::kinematics::{self, Joints, OutOfReachError};
use gripgen_twin::frames::Pose;

/// Acceleration and speed of a motion that names none (script manual): m/s^2 and m/s along a line, rad/s^2 and rad/s of the joints.
const LINE: (f64, f64) = (1.2, 0.25);
const TURN: (f64, f64) = (1.4, 1.05);

/// Parameters of the way from a pose to joints. What is found here is exact, so that no error is too small for it.
pub(super) const INVERSE: [&str; 5] = ["x", "qnear", "maxPositionError", "maxOrientationError", "tcp"];

type Ends = Result<Outcome, String>;

/// A pose in a line; joints are where the tool is with them.
pub(super) fn move_line(a: &[Value], h: &mut dyn Hands) -> Ends {
    let target = match &a[0] {
        Value::List(_) => {
            numbers(&(kinematics::base_from_flange(&a[0].numbers()?) * tool(&Value::None, h)?)).pose()?
        }
        value => value.pose()?,
    };
    let from = h.tcp_pose();
    let way_m = (0..3).map(|i| (target[i] - from[i]).powi(2)).sum::<f64>().sqrt();
    let (acceleration_m_s2, speed_m_s) = pace(a, LINE, way_m)?;
    h.move_line(target, acceleration_m_s2, speed_m_s)?;
    Ok(Outcome::Motion)
}

/// All joints at once, to others or to those that reach a pose.
pub(super) fn move_joints(a: &[Value], h: &mut dyn Hands) -> Ends {
    let target_rad: Joints = match &a[0] {
        Value::List(_) => a[0].numbers()?,
        value => reaching(value, &Value::None, &Value::None, h)?.map_err(|e| e.to_string())?,
    };
    let way_rad =
        h.joints().iter().zip(&target_rad).fold(0.0, |most: f64, (from, to)| most.max((to - from).abs()));
    let (acceleration_rad_s2, speed_rad_s) = pace(a, TURN, way_rad)?;
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

fn reaching(
    at: &Value,
    near: &Value,
    with: &Value,
    h: &dyn Hands,
) -> Result<Result<Joints, OutOfReachError>, String> {
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
        Value::None => pose(&Value::Pose(h.tool())),
        Value::Text(name) if &**name == "active_tcp" => pose(&Value::Pose(h.tool())),
        value => pose(value),
    }
}

fn deceleration(value: &Value) -> Result<f64, String> {
    let deceleration = value.number()?;
    if deceleration > 0.0 {
        Ok(deceleration)
    } else {
        Err(format!("a stop with a deceleration of {deceleration}"))
    }
}

/// Acceleration and speed of a motion over `way` (m or rad); a time comes before both.
fn pace(a: &[Value], or: (f64, f64), way: f64) -> Result<(f64, f64), String> {
    let given = |value: &Value, or: f64| if matches!(value, Value::None) { Ok(or) } else { value.number() };
    let (acceleration, speed, time_s) = (given(&a[1], or.0)?, given(&a[2], or.1)?, given(&a[3], 0.0)?);
    if given(&a[4], 0.0)? != 0.0 {
        return Err("a motion with a blend radius: this robot comes to rest at each pose".into());
    }
    if !(acceleration > 0.0 && speed > 0.0 && time_s >= 0.0) {
        return Err(format!(
            "a motion with an acceleration of {acceleration}, a speed of {speed} and a time of {time_s}"
        ));
    }
    Ok(if time_s > 0.0 && way > 0.0 { in_time(way, time_s, acceleration) } else { (acceleration, speed) })
}

/// Acceleration and speed of a way from rest to rest in a time: way = v (t - v / a). With too little acceleration half of the time speeds up and half
/// brakes, with as much as that takes.
fn in_time(way: f64, time_s: f64, acceleration: f64) -> (f64, f64) {
    let least = 4.0 * way / (time_s * time_s);
    let a = acceleration.max(least);
    (a, 0.5 * a * time_s * (1.0 - (1.0 - least / a).max(0.0).sqrt()))
}
