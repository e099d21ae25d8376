//! What a twin depends on and measured pulls do not have.

use gripgen_twin::columns::{self, InTable};
use gripgen_twin::effects::Effect;
use gripgen_twin::{MeasuredPulls, Twin};

/// The columns that tables and effects of a twin depend on and that were not recorded of all pulls, a sentence each: of those the usual value is
/// taken, or the table does nothing.
pub fn unmeasured(twin: &Twin, measured: &MeasuredPulls) -> Vec<String> {
    let pulled = |part: &Option<String>| {
        part.as_ref().is_none_or(|name| measured.pulls.iter().any(|pull| pull.part == *name))
    };
    let missing = |column: &str| match columns::covariate(column) {
        Some(known) => {
            known.in_table == InTable::Covariate && measured.recorded.iter().all(|name| name != column)
        }
        None => measured.pulls.iter().any(|pull| !pull.covariates.extra.contains_key(column)),
    };
    let mut found: Vec<(&str, Vec<String>)> = Vec::new();
    let mut add = |column, cause: String| match found.iter_mut().find(|(name, _)| *name == column) {
        Some((_, causes)) if causes.contains(&cause) => {}
        Some((_, causes)) => causes.push(cause),
        None => found.push((column, vec![cause])),
    };
    for effect in twin.effects.iter().filter(|effect| pulled(&effect.part) && is_felt(effect)) {
        let own = effect.spec.covariates.iter().filter(|column| missing(column));
        own.for_each(|column| add(*column, format!("effect {}", effect.spec.id)));
    }
    for table in twin.tables.iter().filter(|table| pulled(&table.part)) {
        let own = table.columns().filter(|column| missing(column));
        own.for_each(|column| add(column, format!("a table of {}", table.covariate)));
    }
    for surface in &twin.surfaces {
        let own = surface.columns().filter(|column| missing(column));
        own.for_each(|column| add(column, "a surface".into()));
    }
    let said = |(column, causes): (&str, Vec<String>)| {
        let some = measured.pulls.iter().any(|pull| pull.covariates.extra.contains_key(column));
        let then = match (columns::covariate(column), some) {
            (Some(_), _) => {
                "which was not recorded of all these pulls: without it a pull counts with its usual value"
            }
            (None, true) => "which some of these pulls do not have: the table does nothing to them",
            (None, false) => "which these pulls do not have: the table does nothing to them",
        };
        format!("the twin depends on {column} ({}), {then}", causes.join(", "))
    };
    found.into_iter().map(said).collect()
}

/// Whether an effect has a size, and labels or traces feel it.
fn is_felt(effect: &Effect) -> bool {
    let spec = effect.spec;
    let sizes = spec.parameters.iter().zip(&effect.values).take(spec.sizes);
    let has_size = sizes.into_iter().any(|(parameter, value)| *value != parameter.neutral);
    has_size && spec.is_felt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen::Location;
    use gripgen::Project;
    use gripgen_twin::draw::Drawn;
    use gripgen_twin::{Covariates, MeasuredPull};

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
        let (mut pull, mut without) = (pull.clone(), pull);
        for name in own {
            let both = [&mut pull, &mut without].into_iter().take(if name.ends_with('?') { 1 } else { 2 });
            both.for_each(|p| {
                p.covariates.extra.insert(name.trim_end_matches('?').into(), Drawn::Number(45.0));
            });
        }
        MeasuredPulls {
            pulls: vec![pull, without],
            recorded: recorded.iter().map(|name| (*name).into()).collect(),
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 0.005,
            feedback: None,
            sha256: String::new(),
        }
    }

    #[test]
    fn a_column_of_the_twin_that_nobody_measured_is_told() {
        let effects = "[{name=\"temperature\", k_per_k=0.01}, {name=\"dwell_ageing\", beta=0.0}, {name=\"wear\", depth=0.1, part=\"gear\"}, {name=\"light_drift\", green_per_h=0.1}, \
                       {name=\"table\", covariate=\"humidity_pct\", x=[30, 60], factor=[1.0, 0.8], physical=false}]";
        let sets = [("effects".to_string(), effects.to_string())];
        let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap();
        let said = |recorded: &[&str], own: &[&str]| unmeasured(&project.twin, &pulls(recorded, own));
        assert_eq!(said(&["temperature_c"], &["humidity_pct"]), Vec::<String>::new());
        assert_eq!(
            said(&[], &["humidity"]),
            [
                "the twin depends on temperature_c (effect temperature), which was not recorded of all these pulls: without it a pull counts \
              with its usual value",
                "the twin depends on humidity_pct (a table of humidity_pct), which these pulls do not have: the table does nothing to them",
            ]
        );
        let some = said(&["temperature_c"], &["humidity_pct?"]);
        assert!(some.len() == 1 && some[0].contains("which some of these pulls do not have"), "{some:?}");
    }
}
