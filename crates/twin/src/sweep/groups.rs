//! Which rig, gel and session a sample comes from.

use super::Sweep;
use crate::config::{ConfigError, DesignFile, GroupsFile};
use crate::draw::{Distribution, Drawn, Level, VariedKey, random_coordinate};
use std::collections::BTreeMap;

/// Most rigs, gels of one, or sessions with one.
const MAX_GROUPS: u64 = 1_000_000;

/// Levels that `[groups]` has.
const LEVELS: [Level; 3] = [Level::Rig, Level::Gel, Level::Session];

/// Columns that `[groups]` fills, in the order of the levels.
pub(super) const COLUMNS: [&str; 3] = ["rig_id", "gel_id", "session"];

/// Whether the words of a key tell groups apart: they are drawn before what is drawn for each group.
pub(super) fn names_groups(key: &str) -> bool {
    Level::ALL.iter().any(|level| level.column() == Some(key))
}

impl Sweep {
    /// Names of rig, gel and session of a configuration: each session of each gel of each rig is equally likely, whatever the number
    /// of samples. Empty without `[groups]`.
    pub(super) fn groups_of(&self, group: u64) -> BTreeMap<String, Drawn> {
        let Some(sizes) = self.groups else { return BTreeMap::new() };
        let mut name = String::new();
        let of = |(column, (letter, size)): (&str, (&str, u64))| {
            let u = random_coordinate(self.seed, group, column);
            name += &format!("{letter}{}", ((u * size as f64) as u64).min(size - 1));
            (column.to_string(), Drawn::Text(name.clone()))
        };
        let sizes = [("r", sizes.rigs), ("g", sizes.gels_per_rig), ("s", sizes.sessions_per_gel)];
        COLUMNS.into_iter().zip(sizes).map(of).collect()
    }
}

/// Checks the sizes of groups, and that what is drawn for each has some.
pub(super) fn check(
    groups: Option<GroupsFile>,
    vary: &[VariedKey],
    design: DesignFile,
) -> Result<(), ConfigError> {
    if let Some(sizes) = groups {
        for (key, size) in [
            ("rigs", sizes.rigs),
            ("gels_per_rig", sizes.gels_per_rig),
            ("sessions_per_gel", sizes.sessions_per_gel),
        ] {
            if !(1..=MAX_GROUPS).contains(&size) {
                let problem =
                    format!("{size} is out of range, it must be at least 1 and at most {MAX_GROUPS}");
                return Err(ConfigError::new(format!("groups.{key}"), problem));
            }
        }
    }
    for varied in vary {
        let place = format!("vary.{}", varied.key);
        if groups.is_some() && COLUMNS.contains(&varied.key.as_str()) {
            let problem = format!("[groups] names every `{}`, and so does [vary]", varied.key);
            return Err(ConfigError::new(place, problem).hint("leave one of them out"));
        }
        if design == DesignFile::Grid
            && !varied.is_per_grip()
            && matches!(varied.distribution, Distribution::Choice(_))
        {
            let problem = "a grid takes every value of a list, this one is drawn per level";
            return Err(ConfigError::new(place, problem).hint("leave `per` out, or use design = \"random\""));
        }
        if names_groups(&varied.key) && varied.levels().any(|level| level != Level::default()) {
            let problem = format!("`{}` names the groups of a level, it is drawn per grip", varied.key);
            return Err(ConfigError::new(place, problem).hint("leave `per` out"));
        }
        let nameless = |level: &Level| {
            let drawn = level.column().is_none_or(|column| vary.iter().any(|v| v.key == column));
            let named = groups.is_some() && LEVELS.contains(level);
            !(drawn || named)
        };
        if let Some(level) = varied.levels().find(nameless) {
            let column = level.column().unwrap_or_default();
            let problem = format!("it is drawn per {level}, but this sweep has one {level}");
            return Err(ConfigError::new(place, problem).hint(format!(
                "say how many there are: [groups] rigs = 20, gels_per_rig = 2, sessions_per_gel = 3; or list them: {column} = [\"a\", \"b\"] in [vary]"
            )));
        }
    }
    Ok(())
}
