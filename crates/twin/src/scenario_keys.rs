//! The keys of a scenario that a sweep can vary.

use crate::config::{ConfigError, JitteredStep, PullFile, StepFile, in_range};
use crate::draw::Drawn;
use crate::{Scenario, Twin};

/// Keys of the scenario, in the order of a pull table's columns.
pub const SCENARIO_KEYS: &[&str] = &[
    "part",
    "grip_pose",
    "gel_id",
    "session",
    "grip_force_n",
    "dwell_s",
    "pull_index",
    "time_s",
    "temperature_c",
    "grip_offset_mm",
    "grip_angle_deg",
    "pull_direction",
];

/// Keys of `[pull]` that can vary.
pub const PULL_KEYS: &[&str] = &[
    "pull.increment_n",
    "pull.start_n",
    "pull.step_s",
    "pull.step_s.jitter",
    "pull.stop_mm",
    "pull.max_force_n",
    "pull.label_tolerance_n",
];

/// Keys that take names or whole numbers.
pub(crate) const LISTED_KEYS: &[&str] =
    &["part", "grip_pose", "gel_id", "session", "pull_index", "pull_direction"];

/// Why a drawn value could not be put in.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum KeyError {
    /// There is no such key.
    Unknown,
    /// The value is not allowed.
    Bad(ConfigError),
}

impl From<ConfigError> for KeyError {
    fn from(e: ConfigError) -> Self {
        KeyError::Bad(e)
    }
}

impl KeyError {
    /// What is wrong with the value of `key`.
    pub(crate) fn into_config_error(self, key: &str) -> ConfigError {
        match self {
            KeyError::Bad(e) => e,
            KeyError::Unknown => {
                let known = SCENARIO_KEYS.iter().chain(PULL_KEYS).copied().collect::<Vec<_>>().join(", ");
                ConfigError::new(key, "there is no such key").hint(format!("keys of a pull: {known}"))
            }
        }
    }
}

/// Sets a key of the scenario, in the units of the sweep file. A number that is out of range is set too, so that the
/// record of a failed sample says what was drawn.
pub(crate) fn set(scenario: &mut Scenario, key: &str, value: &Drawn) -> Result<(), KeyError> {
    let c = &mut scenario.covariates;
    match key {
        "part" => scenario.part = text(key, value)?,
        "gel_id" => c.gel_id = value.to_string(),
        "session" => c.session = value.to_string(),
        "grip_pose" => scenario.grip_pose = whole(key, value, 0.0..=1e6)? as usize,
        "pull_index" => c.pull_index = whole(key, value, 0.0..=1e12)? as u64,
        "pull_direction" => {
            c.pull_direction = number(key, value)?;
            if c.pull_direction.abs() != 1.0 {
                let problem = format!("{} is neither 1 (up) nor -1 (down)", c.pull_direction);
                return Err(ConfigError::new(key, problem).into());
            }
        }
        "grip_force_n" => {
            scenario.grip_force_n = number(key, value)?;
            in_range(key, scenario.grip_force_n, 0.05..=2000.0, "N")?;
        }
        "dwell_s" => {
            c.dwell_s = number(key, value)?;
            in_range(key, c.dwell_s, 0.0..=1e6, "s")?;
        }
        "time_s" => {
            c.time_s = number(key, value)?;
            in_range(key, c.time_s, 0.0..=1e9, "s")?;
        }
        "temperature_c" => {
            c.temperature_c = number(key, value)?;
            in_range(key, c.temperature_c, -40.0..=120.0, "C")?;
        }
        "grip_offset_mm" => {
            let offset_mm = number(key, value)?;
            c.grip_offset_m = offset_mm * 1e-3;
            in_range(key, offset_mm, -1000.0..=1000.0, "mm")?;
        }
        "grip_angle_deg" => {
            let angle_deg = number(key, value)?;
            c.grip_angle_rad = angle_deg.to_radians();
            in_range(key, angle_deg, -3600.0..=3600.0, "deg")?;
        }
        _ => return Err(KeyError::Unknown),
    }
    Ok(())
}

/// Sets a key of `[pull]` (given without the prefix); its range is checked with the other keys of the pull.
pub(crate) fn set_pull(pull: &mut PullFile, key: &str, value: &Drawn) -> Result<(), KeyError> {
    let full = format!("pull.{key}");
    let any = |value| number(&full, value);
    let (mean, jitter) = match pull.step_s {
        StepFile::Constant(mean) => (mean, 0.0),
        StepFile::Jittered(step) => (step.value, step.jitter),
    };
    match key {
        "increment_n" => pull.increment_n = any(value)?,
        "start_n" => pull.start_n = Some(any(value)?),
        "step_s" | "step_s.value" => {
            pull.step_s = StepFile::Jittered(JitteredStep { value: any(value)?, jitter });
        }
        "step_s.jitter" => {
            pull.step_s = StepFile::Jittered(JitteredStep { value: mean, jitter: any(value)? });
        }
        "stop_mm" => pull.stop_mm = any(value)?,
        "max_force_n" => pull.max_force_n = Some(any(value)?),
        "label_tolerance_n" => pull.label_tolerance_n = any(value)?,
        _ => return Err(KeyError::Unknown),
    }
    Ok(())
}

/// What only the twin can tell: whether the part and its grip exist and the gripper can press that hard.
pub(crate) fn check_against_twin(scenario: &Scenario, twin: &Twin) -> Result<(), ConfigError> {
    let Some(part) = twin.parts.get(&scenario.part) else {
        let error = ConfigError::new("part", format!("the twin has no part `{}`", scenario.part));
        return Err(crate::twin::unknown_part_hint(error, &scenario.part, twin.parts.keys()));
    };
    if scenario.grip_pose >= part.grips.len() {
        let problem = format!(
            "grip {} of part `{}` does not exist, it has {} (counted from 0)",
            scenario.grip_pose,
            scenario.part,
            part.grips.len()
        );
        return Err(ConfigError::new("grip_pose", problem));
    }
    let limit = twin.gripper.max_force_n;
    if scenario.grip_force_n > limit {
        let problem =
            format!("{} N per jaw, the gripper has at most {limit} N per jaw", scenario.grip_force_n);
        return Err(
            ConfigError::new("grip_force_n", problem).hint("the limit is gripper.max_force_n of the twin")
        );
    }
    Ok(())
}

fn text(key: &str, value: &Drawn) -> Result<String, ConfigError> {
    match value {
        Drawn::Text(text) => Ok(text.clone()),
        Drawn::Number(x) => Err(ConfigError::new(key, format!("a name is needed, found the number {x}"))),
    }
}

fn number(key: &str, value: &Drawn) -> Result<f64, ConfigError> {
    match value {
        Drawn::Number(x) => Ok(*x),
        Drawn::Text(text) => Err(ConfigError::new(key, format!("a number is needed, found `{text}`"))),
    }
}

fn whole(key: &str, value: &Drawn, range: std::ops::RangeInclusive<f64>) -> Result<f64, ConfigError> {
    let x = in_range(key, number(key, value)?, range, "1")?;
    if x.fract() == 0.0 { Ok(x) } else { Err(ConfigError::new(key, format!("{x} is not a whole number"))) }
}
