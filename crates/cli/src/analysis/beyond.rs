//! What a sweep draws beyond the tables of its twin.

use crate::analysis::unvaried::drawn_from;
use gripgen::Project;
use gripgen::drawn_scenario;
use gripgen_twin::columns;
use gripgen_twin::draw::{Drawn, VariedKey};
use gripgen_twin::{Table, Values};
use std::fmt;

/// Share of the width of a table by which a sweep may leave it without a word.
const FELT: f64 = 0.05;

/// Standard deviations of a normal distribution that count.
const DEVIATIONS: f64 = 2.0;

/// A column of which a sweep draws more than a table of its twin knows.
#[derive(Debug, Clone, PartialEq)]
pub struct Beyond {
    /// Its name in a table of pulls.
    pub column: String,
    /// Ends of the table.
    pub table: [f64; 2],
    /// Ends of what is drawn.
    pub drawn: [f64; 2],
}

impl fmt::Display for Beyond {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([low, high], [least, most]) = (self.table, self.drawn);
        write!(
            f,
            "the twin knows {} from {low} to {high} (a table), this sweep draws {least} to {most}: beyond the ends of the table their values \
             hold, which nobody measured",
            self.column
        )
    }
}

/// The columns whose tables a sweep leaves, once each. Tables over the product of two are not looked at.
pub fn beyond(project: &Project) -> Vec<Beyond> {
    let parts = project.sweep.drawn_parts();
    let drawn = |table: &&Table| {
        let part = table.part.as_ref().is_none_or(|name| parts.contains(&name.as_str()));
        part && table.only.iter().all(|(column, word)| may_be(project, column, word))
    };
    let mut found: Vec<Beyond> = Vec::new();
    for table in project.twin.tables.iter().filter(drawn) {
        let (Values::Numbers(x), Some([least, most])) = (&table.axis, range(project, &table.covariate))
        else {
            continue;
        };
        let (Some(&low), Some(&high)) = (x.first(), x.last()) else { continue };
        let room = FELT * (high - low);
        let leaves = least < low - room || most > high + room;
        if leaves && found.iter().all(|beyond| beyond.column != table.covariate) {
            found.push(Beyond { column: table.covariate.clone(), table: [low, high], drawn: [least, most] });
        }
    }
    found
}

/// The least and the largest number that `[vary]` gives a column; nothing of one value, which [`crate::analysis::unvaried()`] looks at.
fn range(project: &Project, name: &str) -> Option<[f64; 2]> {
    // A twin may count the force of both jaws; tables are over that of one.
    let inside = |x: f64| match name {
        "grip_force_n" => project.twin.force_per_jaw_n(x),
        _ => x,
    };
    drawn_from(project, name).and_then(ends).map(|ends| ends.map(inside))
}

/// Whether a sweep may draw a word of a column.
fn may_be(project: &Project, name: &str, word: &str) -> bool {
    let scenario = drawn_scenario(project, 0);
    let fixed = || columns::value(name, scenario.view()).is_some_and(|at| at.to_string() == word);
    match drawn_from(project, name) {
        Some(varied) => varied.distribution.extremes().iter().any(|value| value.to_string() == word),
        None => fixed(),
    }
}

/// The least and the largest number of a key that has more than one.
fn ends(varied: &VariedKey) -> Option<[f64; 2]> {
    if varied.distribution.constant().is_some() {
        return None;
    }
    let numbers = varied.reach(DEVIATIONS).into_iter().filter_map(|value| match value {
        Drawn::Number(x) => Some(x),
        Drawn::Text(_) => None,
    });
    let ends = numbers.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], x| [a.min(x), b.max(x)]);
    (ends[0] <= ends[1]).then_some(ends)
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen::Location;

    fn said(x: &str, column: &str, vary: &str) -> Vec<Beyond> {
        let table =
            format!("[{{name=\"table\", covariate=\"{column}\", x={x}, factor=[1.0, 0.8], physical=false}}]");
        let sets = [("effects".to_string(), table), (format!("vary.{column}"), vary.to_string())];
        beyond(&Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap())
    }

    #[test]
    fn a_sweep_that_leaves_a_table_is_told_of_it() {
        for (vary, ends) in [
            ("{ uniform = [5, 30] }", Some([5.0, 30.0])),
            ("{ normal = [20, 10] }", Some([0.0, 40.0])),
            ("[20, 25, 60]", Some([20.0, 60.0])),
            ("{ uniform = [20, 30.4] }", None),
            ("{ normal = [25, 1] }", None),
            ("[60]", None),
        ] {
            let found = said("[20, 30]", "humidity_pct", vary);
            assert_eq!(found.first().map(|b| b.drawn), ends, "{vary}: {found:?}");
        }
        // 40 to 60 N of both jaws are 20 to 30 N of one.
        let both = |vary: &str| {
            let table = "[{name=\"table\", covariate=\"grip_force_n\", x=[20, 30], factor=[1.0, 0.8], physical=false}]";
            let sets =
                [("effects", table), ("vary.grip_force_n", vary), ("gripper.force_convention", "total")];
            let sets = sets.map(|(key, value)| (key.to_string(), value.to_string()));
            beyond(&Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap())
        };
        assert_eq!(both("{ uniform = [40, 60] }"), []);
        assert_eq!(both("{ uniform = [20, 60] }")[0].drawn, [10.0, 30.0]);
        // A table of one session that the sweep does not have does nothing.
        let of_one = |session: &str| {
            let table = "[{name=\"table\", covariate=\"dwell_s\", where={session=\"3\"}, x=[1, 2], factor=[1.0, 0.8], physical=false}]";
            let sets = [("effects", table), ("vary.dwell_s", "[1, 60]"), ("vary.session", session)];
            let sets = sets.map(|(key, value)| (key.to_string(), value.to_string()));
            beyond(&Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap()).len()
        };
        assert_eq!((of_one("[\"1\"]"), of_one("[\"1\", \"3\"]")), (0, 1));
        let forces = said("[20, 30]", "grip_force_n", "{ uniform = [20, 60] }");
        assert_eq!(
            forces.iter().map(Beyond::to_string).collect::<Vec<_>>(),
            [
                "the twin knows grip_force_n from 20 to 30 (a table), this sweep draws 20 to 60: beyond the ends of the table their values \
              hold, which nobody measured"
            ]
        );
    }
}
