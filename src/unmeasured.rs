//! What a twin depends on and measured pulls do not have.

use gripgen_twin::columns::{self, InTable};
use gripgen_twin::effects::Effect;
use gripgen_twin::{MeasuredPulls, Twin};

/// The columns that tables and effects of a twin depend on and that nobody recorded, a sentence each: the pulls are taken for such with the
/// usual value there, or without the table.
pub fn unmeasured(twin: &Twin, measured: &MeasuredPulls) -> Vec<String> {
    let pulled = |part: &Option<String>| {
        part.as_ref().is_none_or(|name| measured.pulls.iter().any(|pull| pull.part == *name))
    };
    let missing = |column: &str| match columns::covariate(column) {
        Some(known) => {
            known.in_table == InTable::Covariate && measured.recorded.iter().all(|name| name != column)
        }
        None => measured.extra.iter().all(|own| own.name != column),
    };
    let mut found: Vec<(&str, Vec<String>)> = Vec::new();
    let mut add = |column, cause: String| match found.iter_mut().find(|(name, _)| *name == column) {
        Some((_, causes)) if causes.contains(&cause) => {}
        Some((_, causes)) => causes.push(cause),
        None => found.push((column, vec![cause])),
    };
    for effect in twin.effects.iter().filter(|effect| pulled(&effect.part) && !is_nothing(effect)) {
        let own = effect.spec.covariates.iter().filter(|column| missing(column));
        own.for_each(|column| add(*column, format!("effect {}", effect.spec.id)));
    }
    for table in twin.tables.iter().filter(|table| pulled(&table.part)) {
        let own = table.columns().filter(|column| missing(column));
        own.for_each(|column| add(column, format!("a table of {}", table.covariate)));
    }
    let said = |(column, causes): (&str, Vec<String>)| {
        let then = match columns::covariate(column) {
            Some(_) => "all of them count as pulls with its usual value",
            None => "the table does nothing to them",
        };
        format!("the twin depends on {column} ({}), which these pulls do not have: {then}", causes.join(", "))
    };
    found.into_iter().map(said).collect()
}

/// Whether an effect has no size.
fn is_nothing(effect: &Effect) -> bool {
    let sizes = effect.spec.parameters.iter().zip(&effect.values).take(effect.spec.sizes);
    sizes.into_iter().all(|(parameter, value)| *value == parameter.neutral)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::location::Location;
    use crate::project::Project;
    use gripgen_twin::{Covariates, ExtraColumn, MeasuredPull, Values};

    fn pulls(recorded: &[&str], own: &[&str]) -> MeasuredPulls {
        let pull = MeasuredPull {
            id: "p0".into(),
            part: "long_shaft".into(),
            grip_pose: 0,
            grip_force_n: 20.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates::default(),
            max_pull_force_n: 6.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        let extra =
            own.iter().map(|name| ExtraColumn { name: (*name).into(), values: Values::Numbers(vec![45.0]) });
        MeasuredPulls {
            pulls: vec![pull],
            recorded: recorded.iter().map(|name| (*name).into()).collect(),
            extra: extra.collect(),
            label_tolerance_n: 3.0,
            stop_m: 0.005,
            feedback: None,
            sha256: String::new(),
        }
    }

    #[test]
    fn a_column_of_the_twin_that_nobody_measured_is_told() {
        let effects = "[{name=\"temperature\", k_per_k=0.01}, {name=\"dwell_ageing\", beta=0.0}, {name=\"wear\", depth=0.1, part=\"gear\"}, \
                       {name=\"table\", covariate=\"humidity_pct\", x=[30, 60], factor=[1.0, 0.8], physical=false}]";
        let sets = [("effects".to_string(), effects.to_string())];
        let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap();
        let said = |recorded: &[&str], own: &[&str]| unmeasured(&project.twin, &pulls(recorded, own));
        assert_eq!(said(&["temperature_c"], &["humidity_pct"]), Vec::<String>::new());
        assert_eq!(
            said(&[], &["humidity"]),
            [
                "the twin depends on temperature_c (effect temperature), which these pulls do not have: all of them count as pulls with its \
              usual value",
                "the twin depends on humidity_pct (a table of humidity_pct), which these pulls do not have: the table does nothing to them",
            ]
        );
    }
}
