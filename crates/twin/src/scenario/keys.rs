//! The keys of a scenario that a sweep can vary.

use crate::columns::{self, COLUMNS, Column, PullEdit};
use crate::config::{ConfigError, JitteredStep, PullFile, StepFile, is_twin_key};
use crate::draw::Drawn;
use crate::{CAUSE_KEY, Covariates, Scenario, Twin};

/// Keys of `[pull]` that can vary and are no columns of a pull.
const SETTING_KEYS: [&str; 4] =
    ["pull.step_s.jitter", "pull.stop_mm", "pull.max_force_n", "pull.label_tolerance_n"];

/// Keys of the scenario that a sweep can vary, in the order of the columns of a pull.
pub fn scenario_keys() -> impl Iterator<Item = &'static str> + Clone {
    COLUMNS.iter().map(Column::sweep_key).filter(|key| !key.starts_with("pull."))
}

/// Keys of `[pull]` that a sweep can vary.
pub fn pull_keys() -> impl Iterator<Item = &'static str> + Clone {
    COLUMNS.iter().map(Column::sweep_key).filter(|key| key.starts_with("pull.")).chain(SETTING_KEYS)
}

/// The column that a key of `[vary]` draws; its name in tables is no key where it has one of its own.
pub(crate) fn drawn_column(key: &str) -> Option<&'static Column> {
    columns::find(key).filter(|column| column.aliases.is_empty() || column.name != key)
}

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
                let known = scenario_keys().chain(pull_keys()).collect::<Vec<_>>().join(", ");
                ConfigError::new(key, "there is no such key").hint(format!("keys of a pull: {known}"))
            }
        }
    }
}

/// Sets a key of the scenario, in the units of the sweep file. A number that is out of range is set too, so that the
/// record of a failed sample says what was drawn.
pub(crate) fn set(scenario: &mut Scenario, key: &str, value: &Drawn) -> Result<(), KeyError> {
    let column = drawn_column(key).ok_or(KeyError::Unknown)?;
    column.set_drawn(&mut scenario.edit(), key, value)?;
    if let Drawn::Number(x) = value
        && !column.holds_words()
    {
        column.check_drawn(key, *x)?;
    }
    Ok(())
}

/// Whether a drawn key is a column of the user's own: none that is known, and none of the twin or of `[pull]`.
pub fn is_own_column(key: &str) -> bool {
    columns::find(key).is_none() && !key.starts_with("pull.") && !is_twin_key(key) && key != CAUSE_KEY
}

/// Whether `[vary]` takes a column of a table of pulls: all but those of the user's own that have the name of something else.
pub fn can_be_drawn(key: &str) -> bool {
    columns::find(key).is_some()
        || (is_own_column(key) && !is_taken(key) && !key.contains(['.', '[', '"', ' ']))
}

/// Whether the name of a column of the user's own is that of a column which every sample has in `index.csv`.
pub(crate) fn is_taken(key: &str) -> bool {
    columns::is_of_sample(key)
}

/// The columns of the user's own that the tables of a twin depend on: sweeps draw them for these tables.
pub(crate) fn own_columns(twin: &Twin) -> Vec<&str> {
    let tables = twin.tables.iter().flat_map(|table| table.columns());
    let surfaces = twin.surfaces.iter().flat_map(|surface| surface.columns());
    tables.chain(surfaces).filter(|name| is_own_column(name)).collect()
}

/// Sets a column of the user's own.
pub(crate) fn set_own(scenario: &mut Scenario, key: &str, value: &Drawn) {
    scenario.covariates.extra.insert(key.into(), value.clone());
}

/// Sets a key of `[pull]`; its range is checked with the other keys of the pull.
pub(crate) fn set_pull(pull: &mut PullFile, key: &str, value: &Drawn) -> Result<(), KeyError> {
    let (mut step_s, mut jitter) = match pull.step_s {
        StepFile::Constant(mean) => (mean, 0.0),
        StepFile::Jittered(step) => (step.value, step.jitter),
    };
    let number = || match value {
        Drawn::Number(x) => Ok(*x),
        Drawn::Text(text) => Err(ConfigError::new(key, format!("a number is needed, found `{text}`"))),
    };
    match key {
        "pull.step_s.jitter" => jitter = number()?,
        "pull.stop_mm" => pull.stop_mm = number()?,
        "pull.max_force_n" => pull.max_force_n = Some(number()?),
        "pull.label_tolerance_n" => pull.label_tolerance_n = number()?,
        _ => {
            let column = drawn_column(key).ok_or(KeyError::Unknown)?;
            let mut edit = PullEdit {
                part: &mut String::new(),
                grip_pose: &mut 0,
                grip_force_n: &mut 0.0,
                increment_n: &mut pull.increment_n,
                start_n: &mut pull.start_n,
                step_s: &mut step_s,
                covariates: &mut Covariates::default(),
            };
            column.set_drawn(&mut edit, key, value)?;
        }
    }
    pull.step_s = StepFile::Jittered(JitteredStep { value: step_s, jitter });
    Ok(())
}

/// What only the twin can tell: whether the part and its grip exist and the gripper can press that hard.
pub(crate) fn check_against_twin(scenario: &Scenario, twin: &Twin) -> Result<(), ConfigError> {
    let Some(part) = twin.parts.get(&scenario.part) else {
        return Err(ConfigError::unknown_part("part", &scenario.part, twin.parts.keys()));
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
