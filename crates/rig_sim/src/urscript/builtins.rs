//! Functions of the language, by the names and the parameters of the manual.

use super::hands::{ForceMode, Hands, Watchdog, WatchdogAction};
use super::motion;
use super::outcome::{Outcome, list, numbers, pose};
use super::value::{MAX_TEXT, Value};
use gripgen_twin::frames::Pose;
use nalgebra::Translation3;
use std::fmt;
use std::sync::Arc;

/// Control step of an e-Series robot.
const STEP_S: f64 = 0.002;

type Pure = fn(&[Value]) -> Result<Value, String>;
type Handed = fn(&[Value], &mut dyn Hands) -> Result<Outcome, String>;

pub(super) enum Run {
    Pure(Pure),
    Hands(Handed),
    /// A word of the language that this robot cannot follow.
    Missing,
}

/// A function of the language.
pub(super) struct Builtin {
    pub(super) name: &'static str,
    pub(super) parameters: &'static [&'static str],
    /// How many of them have no default.
    pub(super) required: usize,
    pub(super) run: Run,
}

impl fmt::Debug for Builtin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl PartialEq for Builtin {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

/// Words of the language that are no names.
const KEYWORDS: [&str; 24] = [
    "def",
    "sec",
    "thread",
    "end",
    "if",
    "elif",
    "else",
    "while",
    "break",
    "continue",
    "return",
    "halt",
    "run",
    "join",
    "kill",
    "global",
    "local",
    "True",
    "False",
    "and",
    "or",
    "not",
    "xor",
    "enter_critical",
];

/// Functions of the language that are known by name and cannot be followed here: they need masses, tools or other machines.
const MISSING: [&str; 58] = [
    "enable_external_ft_sensor",
    "ft_rtde_input_enable",
    "get_actual_joint_positions_history",
    "get_coriolis_and_centrifugal_torques",
    "get_freedrive_status",
    "get_jacobian",
    "get_jacobian_time_derivative",
    "get_mass_matrix",
    "get_target_joint_accelerations",
    "get_target_payload_cog",
    "get_target_payload_inertia",
    "get_target_waypoint",
    "servoj",
    "servoc",
    "speedj",
    "speedl",
    "movec",
    "movep",
    "freedrive_mode",
    "end_freedrive_mode",
    "teach_mode",
    "end_teach_mode",
    "is_within_safety_limits",
    "tool_contact",
    "socket_open",
    "socket_close",
    "socket_send_string",
    "socket_send_line",
    "socket_read_string",
    "socket_read_binary_integer",
    "socket_read_ascii_float",
    "socket_send_int",
    "socket_get_var",
    "socket_set_var",
    "set_digital_out",
    "set_standard_digital_out",
    "set_configurable_digital_out",
    "set_tool_digital_out",
    "set_standard_analog_out",
    "set_analog_out",
    "get_digital_in",
    "get_standard_digital_in",
    "get_joint_torques",
    "get_joint_temp",
    "conveyor_pulse_decode",
    "track_conveyor_linear",
    "path_offset_enable",
    "path_offset_disable",
    "path_offset_set",
    "position_deviation_warning",
    "protective_stop",
    "modbus_add_signal",
    "rpc_factory",
    "direct_torque",
    "set_gravity",
    "set_tool_voltage",
    "optimovej",
    "optimovel",
];

/// Whether this is a word of the language: no function of a program can have its name.
pub fn is_word(name: &str) -> bool {
    is_keyword(name) || find(name).is_some()
}

/// Whether this is a word that builds sentences: no variable can have its name. A variable may be called as a function is, `length` for example.
pub(super) fn is_keyword(name: &str) -> bool {
    KEYWORDS.contains(&name) || name == "exit_critical"
}

/// The function of this name.
pub(super) fn find(name: &str) -> Option<&'static Builtin> {
    TABLE.iter().find(|b| b.name == name).or_else(|| {
        let at = MISSING.iter().position(|missing| *missing == name)?;
        MISSING_TABLE.get(at)
    })
}

static MISSING_TABLE: [Builtin; MISSING.len()] = {
    let mut table =
        [const { Builtin { name: "", parameters: &[], required: 0, run: Run::Missing } }; MISSING.len()];
    let mut i = 0;
    while i < MISSING.len() {
        table[i].name = MISSING[i];
        i += 1;
    }
    table
};

const fn pure(name: &'static str, parameters: &'static [&'static str], run: Pure) -> Builtin {
    Builtin { name, parameters, required: parameters.len(), run: Run::Pure(run) }
}

const fn hands(
    name: &'static str,
    parameters: &'static [&'static str],
    required: usize,
    run: Handed,
) -> Builtin {
    Builtin { name, parameters, required, run: Run::Hands(run) }
}

macro_rules! of_one {
    ($name:literal, $of:expr) => {
        pure($name, &["f"], |a| real(($of)(a[0].number()?)))
    };
}

static TABLE: &[Builtin] = &[
    // Numbers.
    of_one!("sqrt", f64::sqrt),
    of_one!("sin", f64::sin),
    of_one!("cos", f64::cos),
    of_one!("tan", f64::tan),
    of_one!("asin", f64::asin),
    of_one!("acos", f64::acos),
    of_one!("atan", f64::atan),
    of_one!("d2r", f64::to_radians),
    of_one!("r2d", f64::to_degrees),
    pure("atan2", &["x", "y"], |a| real(a[0].number()?.atan2(a[1].number()?))),
    pure("log", &["b", "f"], |a| real(a[1].number()?.log(a[0].number()?))),
    pure("pow", &["base", "exponent"], |a| real(a[0].number()?.powf(a[1].number()?))),
    pure("floor", &["f"], |a| whole(a[0].number()?.floor())),
    pure("ceil", &["f"], |a| whole(a[0].number()?.ceil())),
    pure("norm", &["a"], norm),
    pure("get_steptime", &[], |_| Ok(Value::Float(STEP_S))),
    pure("length", &["v"], length),
    pure("get_list_length", &["v"], length),
    pure("to_str", &["val"], |a| text(a[0].to_string())),
    pure("str_cat", &["op1", "op2"], |a| text(format!("{}{}", a[0], a[1]))),
    // Poses.
    pure("pose_trans", &["p_from", "p_from_to"], |a| Ok(numbers(&(pose(&a[0])? * pose(&a[1])?)))),
    pure("pose_inv", &["p_from"], |a| Ok(numbers(&pose(&a[0])?.inverse()))),
    pure("pose_add", &["p_1", "p_2"], |a| added(&a[0], &a[1], false)),
    pure("pose_sub", &["p_to", "p_from"], |a| added(&a[0], &a[1], true)),
    pure("point_dist", &["p_from", "p_to"], |a| {
        let (from, to) = (a[0].pose()?, a[1].pose()?);
        real((0..3).map(|i| (to[i] - from[i]).powi(2)).sum::<f64>().sqrt())
    }),
    // Waiting.
    hands("sync", &[], 0, |_, _| Ok(Outcome::Sync)),
    hands("sleep", &["t"], 1, |a, _| Ok(Outcome::Sleep(least(&a[0], 0.0, "the time of a sleep")?))),
    // What is felt.
    hands("get_actual_tcp_pose", &[], 0, |_, h| give(Value::Pose(h.tcp_pose()))),
    hands("get_target_tcp_pose", &[], 0, |_, h| give(Value::Pose(h.tcp_pose()))),
    hands("get_actual_tcp_speed", &[], 0, |_, h| give(list(&h.tcp_speed()))),
    hands("get_target_tcp_speed", &[], 0, |_, h| give(list(&h.tcp_speed()))),
    hands("get_tcp_force", &[], 0, |_, h| give(Value::Pose(h.tcp_force()))),
    hands("get_actual_joint_positions", &[], 0, |_, h| give(list(&h.joints()))),
    // An older name, which UR's client library uses.
    hands("get_joint_positions", &[], 0, |_, h| give(list(&h.joints()))),
    hands("get_target_joint_positions", &[], 0, |_, h| give(list(&h.joints()))),
    hands("get_actual_joint_speeds", &[], 0, |_, h| give(list(&h.joint_speeds()))),
    hands("get_target_joint_speeds", &[], 0, |_, h| give(list(&h.joint_speeds()))),
    hands("get_tcp_offset", &[], 0, |_, h| give(Value::Pose(h.tool()))),
    hands("get_target_payload", &[], 0, |_, h| give(Value::Float(h.payload_kg()))),
    hands("is_steady", &[], 0, |_, h| {
        let still = h.tcp_speed().iter().all(|v| *v == 0.0);
        give(Value::Bool(still))
    }),
    // Registers.
    hands("read_input_integer_register", &["address"], 1, |a, h| {
        h.input_int(register(&a[0])?).map(|x| Outcome::Value(Value::Int(x))).ok_or_else(|| no_register(&a[0]))
    }),
    hands("read_input_float_register", &["address"], 1, |a, h| {
        h.input_float(register(&a[0])?)
            .map(|x| Outcome::Value(Value::Float(x)))
            .ok_or_else(|| no_register(&a[0]))
    }),
    hands("read_input_boolean_register", &["address"], 1, |a, h| {
        h.input_bool(register(&a[0])?)
            .map(|x| Outcome::Value(Value::Bool(x)))
            .ok_or_else(|| no_register(&a[0]))
    }),
    hands("read_output_integer_register", &["address"], 1, |a, h| {
        let found = h.output_int(register(&a[0])?).map(|x| *x);
        found.map(|x| Outcome::Value(Value::Int(x))).ok_or_else(|| no_register(&a[0]))
    }),
    hands("read_output_float_register", &["address"], 1, |a, h| {
        let found = h.output_float(register(&a[0])?).map(|x| *x);
        found.map(|x| Outcome::Value(Value::Float(x))).ok_or_else(|| no_register(&a[0]))
    }),
    hands("write_output_integer_register", &["address", "value"], 2, |a, h| {
        *h.output_int(register(&a[0])?).ok_or_else(|| no_register(&a[0]))? = a[1].int()?;
        done()
    }),
    hands("write_output_float_register", &["address", "value"], 2, |a, h| {
        *h.output_float(register(&a[0])?).ok_or_else(|| no_register(&a[0]))? = a[1].number()?;
        done()
    }),
    hands("write_output_boolean_register", &["address", "value"], 2, |a, h| {
        let there = h.write_output_bool(register(&a[0])?, a[1].truth()?);
        if there { done() } else { Err(no_register(&a[0])) }
    }),
    // Settings.
    hands("set_payload", &["m", "cog"], 1, |a, h| payload(a, h)),
    hands("set_target_payload", &["m", "cog", "inertia", "transition_time"], 1, |a, h| payload(a, h)),
    hands("set_tcp", &["pose", "tcp_name"], 1, |a, h| {
        h.set_tool(a[0].pose()?)?;
        done()
    }),
    hands("zero_ftsensor", &[], 0, |_, h| {
        h.zero_sensor();
        done()
    }),
    // Force.
    hands("force_mode", &["task_frame", "selection_vector", "wrench", "type", "limits"], 5, force_mode),
    hands("end_force_mode", &[], 0, |_, h| {
        h.end_force_mode();
        done()
    }),
    hands("force_mode_set_damping", &["damping"], 1, |a, h| {
        h.set_damping(within(&a[0], 0.0, 1.0, "the damping")?);
        done()
    }),
    hands("force_mode_set_gain_scaling", &["scaling"], 1, |a, h| {
        h.set_gain(within(&a[0], 0.0, 2.0, "the gain")?);
        done()
    }),
    // Motion.
    hands("movel", &["pose", "a", "v", "t", "r"], 1, motion::move_line),
    hands("movej", &["q", "a", "v", "t", "r"], 1, motion::move_joints),
    hands("stopl", &["a", "aRot"], 1, motion::stop_line),
    hands("stopj", &["a"], 1, motion::stop_joints),
    // Joints.
    hands("get_forward_kin", &["q", "tcp"], 0, motion::forward),
    hands("get_inverse_kin", &motion::INVERSE, 1, motion::inverse),
    hands("get_inverse_kin_has_solution", &motion::INVERSE, 1, motion::has_inverse),
    hands("get_actual_tool_flange_pose", &[], 0, |_, h| give(motion::flange(h))),
    // The host.
    hands("rtde_set_watchdog", &["variable_name", "min_frequency", "action"], 2, watchdog),
    hands("textmsg", &["s1", "s2"], 1, |a, h| {
        let second = if matches!(a[1], Value::None) { String::new() } else { a[1].to_string() };
        h.message(short(format!("{}{second}", a[0])));
        done()
    }),
    hands("popup", &["s", "title", "warning", "error", "blocking"], 1, |a, h| {
        if matches!(a[4], Value::Bool(true)) {
            return Err("a popup that blocks: nobody is at the pendant".into());
        }
        h.message(short(a[0].to_string()));
        done()
    }),
];

fn done() -> Result<Outcome, String> {
    Ok(Outcome::Value(Value::None))
}

fn give(value: Value) -> Result<Outcome, String> {
    Ok(Outcome::Value(value))
}

fn real(x: f64) -> Result<Value, String> {
    if x.is_finite() { Ok(Value::Float(x)) } else { Err("the result is no number".into()) }
}

fn whole(x: f64) -> Result<Value, String> {
    if x.abs() < 2_147_483_648.0 {
        Ok(Value::Int(x as i32))
    } else {
        Err(format!("{x} is no whole number of 32 bits"))
    }
}

fn short(text: String) -> String {
    if text.len() > MAX_TEXT { text.chars().take(MAX_TEXT / 4).collect() } else { text }
}

fn text(text: String) -> Result<Value, String> {
    if text.len() > MAX_TEXT {
        return Err(format!("a text of {}, at most {MAX_TEXT} are kept", text.len()));
    }
    Ok(Value::Text(Arc::from(text)))
}

fn length(a: &[Value]) -> Result<Value, String> {
    match &a[0] {
        Value::List(list) => whole(list.len() as f64),
        Value::Text(text) => whole(text.chars().count() as f64),
        Value::Pose(_) => Ok(Value::Int(6)),
        other => Err(format!("{} has no length", other.kind())),
    }
}

/// A number: its size. A list: the root of the sum of squares. A pose: the length of its position.
fn norm(a: &[Value]) -> Result<Value, String> {
    match &a[0] {
        Value::List(list) => {
            let squares = list.iter().map(|x| x.number().map(|x| x * x)).sum::<Result<f64, String>>();
            real(squares?.sqrt())
        }
        Value::Pose([x, y, z, ..]) => real((x * x + y * y + z * z).sqrt()),
        other => real(other.number()?.abs()),
    }
}

/// Positions are added, rotations follow each other.
fn added(a: &Value, b: &Value, less: bool) -> Result<Value, String> {
    let (a, b) = (pose(a)?, pose(b)?);
    let (t, r) = match less {
        false => (a.translation.vector + b.translation.vector, a.rotation * b.rotation),
        true => (a.translation.vector - b.translation.vector, a.rotation * b.rotation.inverse()),
    };
    Ok(numbers(&Pose::from_parts(Translation3::from(t), r)))
}

fn least(value: &Value, least: f64, what: &str) -> Result<f64, String> {
    within(value, least, f64::MAX, what)
}

fn within(value: &Value, least: f64, most: f64, what: &str) -> Result<f64, String> {
    let x = value.number()?;
    if x >= least && x <= most {
        Ok(x)
    } else {
        Err(format!("{what} is {x}, from {least} to {most} are taken"))
    }
}

fn register(value: &Value) -> Result<usize, String> {
    usize::try_from(value.int()?).map_err(|_| no_register(value))
}

fn no_register(value: &Value) -> String {
    format!("there is no register {value}")
}

fn payload(a: &[Value], h: &mut dyn Hands) -> Result<Outcome, String> {
    let centre = if matches!(a[1], Value::None) { None } else { Some(a[1].numbers()?) };
    h.set_payload(a[0].number()?, centre)?;
    done()
}

fn force_mode(a: &[Value], h: &mut dyn Hands) -> Result<Outcome, String> {
    let (frame, selection, wrench) = (a[0].pose()?, a[1].numbers::<6>()?, a[2].numbers::<6>()?);
    if a[3].int()? != 2 {
        return Err(format!("force_mode of type {}: this robot knows type 2 alone", a[3]));
    }
    let limits = a[4].numbers::<6>()?;
    if let Some(wrong) = selection.iter().find(|s| **s != 0.0 && **s != 1.0) {
        return Err(format!("{wrong} in the selection of force_mode, 0 and 1 are known"));
    }
    if let Some(wrong) = limits.iter().find(|limit| **limit < 0.0) {
        return Err(format!("a limit of force_mode is {wrong}"));
    }
    h.force_mode(ForceMode { frame, compliant: selection.map(|s| s == 1.0), wrench, limits })?;
    done()
}

fn watchdog(a: &[Value], h: &mut dyn Hands) -> Result<Outcome, String> {
    let name = a[0].text()?;
    let register = name.strip_prefix("input_int_register_").and_then(|digits| digits.parse().ok());
    let register = register.filter(|register| h.input_int(*register).is_some());
    let register = register.ok_or_else(|| format!("a watchdog on `{name}`: no integer input"))?;
    let action = match &a[2] {
        Value::None => WatchdogAction::Pause,
        word => match word.text()?.to_ascii_lowercase().as_str() {
            "ignore" => WatchdogAction::Ignore,
            "pause" => WatchdogAction::Pause,
            "stop" => WatchdogAction::Stop,
            other => return Err(format!("a watchdog that does `{other}`")),
        },
    };
    h.set_watchdog(Watchdog { register, rate_hz: least(&a[1], 0.0, "the rate of a watchdog")?, action });
    done()
}
