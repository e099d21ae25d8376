//! What a twin depends on and a sweep leaves at one value.

use gripgen::Project;
use gripgen::drawn_scenario;
use gripgen_twin::columns::{self, Column};
use gripgen_twin::config::ImageStorage;
use gripgen_twin::draw::{Drawn, VariedKey};
use gripgen_twin::effects::{Effect, EffectSpec};
use gripgen_twin::{Surface, Table, Values, can_be_drawn};
use std::fmt;

/// Columns that change over a campaign though nobody sets them. The others are settings, of which one value is a choice.
const CHANGE_BY_THEMSELVES: [&str; 5] = ["time_s", "pull_index", "temperature_c", "gel_id", "session"];

/// A column that a twin depends on and that is the same in every sample of a sweep.
#[derive(Debug, Clone, PartialEq)]
pub struct Unvaried {
    /// Its name in a table of pulls.
    pub column: String,
    /// What depends on it.
    pub causes: Vec<String>,
    /// Its value in every sample; `None` of a column of the user's own that no sample has.
    pub value: Option<Drawn>,
    /// The value lies outside of what a table was made from.
    pub outside: bool,
    /// Its key in `[vary]`.
    pub key: String,
    /// What `[vary]` may have there, as TOML, where it is known.
    pub values: Option<String>,
}

impl fmt::Display for Unvaried {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "the twin depends on {} ({}), ", self.column, self.causes.join(", "))?;
        match &self.value {
            None => write!(f, "which no sample of this sweep has, so that its table does nothing")?,
            Some(value) => {
                let outside = if self.outside { ", outside of it" } else { "" };
                write!(f, "this sweep has {value} in every sample{outside}")?;
            }
        }
        if !can_be_drawn(&self.key) {
            return write!(
                f,
                ": no sweep draws a column of this name, give it another in the pulls and in the table"
            );
        }
        write!(f, ": add vary.{}", self.key)?;
        self.values.iter().try_for_each(|values| write!(f, " = {values}"))
    }
}

/// The columns that the twin of a sweep depends on and that the sweep does not vary. A setting of the pull that has one value is one only
/// where a table was made from others.
pub fn unvaried(project: &Project) -> Vec<Unvaried> {
    let scenario = drawn_scenario(project, 0);
    let parts = project.sweep.drawn_parts();
    let drawn = |part: &Option<String>| part.as_ref().is_none_or(|name| parts.contains(&name.as_str()));
    let mut found: Vec<Unvaried> = Vec::new();
    let mut add = |column: &str, cause: String, table: Option<&Table>, places: Option<Values>| {
        let known = columns::covariate(column);
        let stated = stated(project, column);
        let value = columns::value(column, scenario.view());
        let outside = table.is_some_and(|table| value.as_ref().is_some_and(|at| lies_outside(table, at)));
        let own = known.is_none() || CHANGE_BY_THEMSELVES.contains(&column);
        if stated == Stated::Varies || !(outside || (own && stated == Stated::No)) {
            return;
        }
        match found.iter_mut().find(|unvaried| unvaried.column == column) {
            Some(unvaried) => {
                unvaried.outside |= outside;
                unvaried.causes.push(cause);
            }
            None => found.push(Unvaried {
                column: column.into(),
                causes: vec![cause],
                value,
                outside,
                key: known.map_or(column, |known| known.sweep_key()).into(),
                values: table
                    .map(|table| &table.axis)
                    .or(places.as_ref())
                    .and_then(|axis| values(known, axis)),
            }),
        }
    };
    for effect in project.twin.effects.iter().filter(|effect| drawn(&effect.part) && acts(project, effect)) {
        for column in effect.spec.covariates {
            add(column, format!("effect {}", effect.spec.id), None, None);
        }
    }
    for table in project.twin.tables.iter().filter(|table| drawn(&table.part)) {
        match table.covariate.split_once('*') {
            Some((a, b)) if table.centre.is_some() => {
                for column in [a, b] {
                    add(column, format!("a table of {}", table.covariate), None, None);
                }
            }
            _ => add(&table.covariate, of_table(table), Some(table), None),
        }
        for (column, word) in &table.only {
            if columns::value(column, scenario.view()).is_none_or(|at| at.to_string() != *word) {
                add(column, format!("a table where it is {word}"), None, None);
            }
        }
    }
    for surface in &project.twin.surfaces {
        for (d, column) in surface.columns().enumerate().filter(|(_, column)| *column != "part") {
            add(column, "a surface".into(), None, Some(places(surface, d)));
        }
    }
    found
}

/// The values of a column that the points of a surface have, in order, each once.
fn places(surface: &Surface, column: usize) -> Values {
    let (mut words, mut numbers) = (Vec::new(), Vec::new());
    for point in &surface.points {
        match &point[column] {
            Drawn::Number(x) => numbers.push(*x),
            Drawn::Text(word) => words.push(word.clone()),
        }
    }
    numbers.sort_by(f64::total_cmp);
    words.sort();
    words.dedup();
    if words.is_empty() { Values::Numbers(numbers) } else { Values::Words(words) }
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Stated {
    No,
    OneValue,
    Varies,
}

/// What `[vary]` says of a column.
fn stated(project: &Project, name: &str) -> Stated {
    match drawn_from(project, name) {
        // Groups of a sweep fill columns that its [vary] does not have.
        None if project.sweep.drawn_keys().any(|key| key == name) => Stated::Varies,
        None => Stated::No,
        Some(varied) if varied.distribution.constant().is_some() => Stated::OneValue,
        Some(_) => Stated::Varies,
    }
}

/// What `[vary]` draws a column of a table of pulls from, whichever of its names the key is.
pub(crate) fn drawn_from<'a>(project: &'a Project, name: &str) -> Option<&'a VariedKey> {
    let is_it = |key: &str| match columns::covariate(name) {
        Some(column) => columns::find(key).is_some_and(|drawn| drawn.name == column.name),
        None => key == name,
    };
    project.sweep.vary.iter().find(|varied| is_it(&varied.key))
}

/// Whether an effect does anything to a sample of the sweep.
fn acts(project: &Project, effect: &Effect) -> bool {
    let spec: &EffectSpec = effect.spec;
    let sizes = spec.parameters.iter().zip(&effect.values).take(spec.sizes);
    let drawn = project.sweep.vary.iter().any(|v| v.key.starts_with("effects"));
    if !drawn && sizes.into_iter().all(|(parameter, value)| *value == parameter.neutral) {
        return false;
    }
    let felt = spec.imprint_volume.is_some() || spec.is_felt();
    felt || (spec.optics.is_some() && project.sweep.images != ImageStorage::None)
}

fn lies_outside(table: &Table, at: &Drawn) -> bool {
    match (&table.axis, at) {
        (Values::Words(words), at) => !words.contains(&at.to_string()),
        (Values::Numbers(x), Drawn::Number(at)) => {
            x.first().is_some_and(|low| at < low) || x.last().is_some_and(|high| at > high)
        }
        (Values::Numbers(_), Drawn::Text(_)) => true,
    }
}

fn of_table(table: &Table) -> String {
    match &table.axis {
        Values::Numbers(x) => match (x.first(), x.last()) {
            (Some(low), Some(high)) if low < high => format!("a table from {low} to {high}"),
            _ => "a table".into(),
        },
        Values::Words(words) => format!("a table of {}", words.join(", ")),
    }
}

/// What `[vary]` may have of a column: where its table was made.
fn values(known: Option<&Column>, axis: &Values) -> Option<String> {
    match axis {
        Values::Words(words) => Some(format!("{words:?}")),
        Values::Numbers(x) => match (x.first(), x.last()) {
            (Some(low), Some(high)) if low < high && !known.is_some_and(Column::is_listed) => {
                Some(format!("{{ uniform = [{low}, {high}] }}"))
            }
            _ => None,
        },
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen::Location;

    fn said(sets: &[(&str, &str)]) -> Vec<String> {
        let sets: Vec<(String, String)> = sets.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
        let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap();
        unvaried(&project).iter().map(Unvaried::to_string).collect()
    }

    #[test]
    fn columns_that_change_by_themselves_are_columns() {
        assert!(CHANGE_BY_THEMSELVES.iter().all(|name| columns::covariate(name).is_some()));
    }

    #[test]
    fn what_a_twin_depends_on_and_a_sweep_does_not_vary_is_told_once() {
        assert_eq!(said(&[]), Vec::<String>::new());
        let drifts =
            "[{name=\"sensor_drift\", rate_n_per_h=0.5}, {name=\"sensor_gain_drift\", rate_per_h=0.02}]";
        let wanted = "the twin depends on time_s (effect sensor_drift, effect sensor_gain_drift), this sweep has 0 in every \
                      sample: add vary.time_s";
        assert_eq!(said(&[("effects", drifts)]), [wanted]);
        let varied = [("effects", drifts), ("vary.time_s", "[0, 3600]")];
        assert_eq!(said(&varied), Vec::<String>::new());
        // One value that somebody wrote down is a choice; so are settings of the pull, and what has no size.
        for (effects, vary) in [
            (drifts, ("vary.time_s", "[3600]")),
            ("[{name=\"dwell_ageing\", beta=0.03}]", ("vary.grip_force_n", "[40]")),
            ("[{name=\"temperature\"}]", ("vary.grip_force_n", "[40]")),
            ("[{name=\"wear\", depth=0.1, part=\"gear\"}]", ("vary.part", "[\"long_shaft\"]")),
        ] {
            assert_eq!(said(&[("effects", effects), vary]), Vec::<String>::new(), "{effects}");
        }
    }

    #[test]
    fn a_table_is_told_of_where_the_sweep_leaves_it() {
        let table = |covariate: &str, axis: &str| {
            format!(
                "[{{name=\"table\", covariate=\"{covariate}\", {axis}, factor=[1.0, 0.8], physical=false}}]"
            )
        };
        let of = |covariate: &str, axis: &str| said(&[("effects", &table(covariate, axis))]);
        assert_eq!(
            of("time_s", "x=[0, 7200]"),
            [
                "the twin depends on time_s (a table from 0 to 7200), this sweep has 0 in every sample: add vary.time_s = \
              { uniform = [0, 7200] }"
            ]
        );
        assert_eq!(of("dwell_s", "x=[0, 60]"), Vec::<String>::new(), "1 s is among them");
        let outside = of("dwell_s", "x=[5, 60]");
        assert!(
            outside.len() == 1 && outside[0].contains("has 1 in every sample, outside of it"),
            "{outside:?}"
        );
        let words = of("session", "words=[\"1\", \"2\"]");
        assert!(words.len() == 1 && words[0].ends_with("add vary.session = [\"1\", \"2\"]"), "{words:?}");
        let own = of("humidity_pct", "x=[30, 60]");
        assert_eq!(
            own,
            [
                "the twin depends on humidity_pct (a table from 30 to 60), which no sample of this sweep has, so that its table \
              does nothing: add vary.humidity_pct = { uniform = [30, 60] }"
            ]
        );
        let taken = of("mu_drawn", "x=[30, 60]");
        assert!(
            taken.len() == 1 && taken[0].ends_with("give it another in the pulls and in the table"),
            "{taken:?}"
        );
        let wet = table("humidity_pct", "x=[30, 60]");
        for (vary, wanted) in [("{ uniform = [30, 60] }", 0), ("[45]", 0), ("[80]", 1)] {
            let said = said(&[("effects", &wet), ("vary.humidity_pct", vary)]);
            assert_eq!(said.len(), wanted, "{vary}: {said:?}");
        }
    }
}
