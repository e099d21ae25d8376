//! Parts of a table that a twin lacks: labels need a coefficient and no mesh.

use gripgen_twin::config::suggestion;
use gripgen_twin::effects::LIBRARY;
use gripgen_twin::values::median;
use gripgen_twin::{MeasuredPulls, NO_MESH, Twin, rounded};
use std::collections::{BTreeMap, BTreeSet};

/// Coefficient of a part of which nothing is known yet: half of what most gels and parts have. Fits begin there.
const MU: f64 = 0.3;

/// Relative scatter of repetitions, inside the 3 to 7 % that such pulls have (`assets/configs/twin-baseline.toml`).
const SCATTER: f64 = 0.05;

/// Imprint constant of the shipped parts, which no label depends on.
const IMPRINT_MM3_PER_N: f64 = 1.5;

/// What a table adds to a twin.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OwnParts {
    /// Overrides of the twin that make the parts, as `--set` takes them.
    pub sets: Vec<(String, String)>,
    /// What people have to know of them.
    pub notes: Vec<String>,
}

/// Gives parts the spelling of the twin, and makes those that it lacks: with a coefficient, and without a geometry.
pub fn own_parts(measured: &mut MeasuredPulls, twin: &Twin) -> OwnParts {
    let mut found = OwnParts::default();
    let plain = |name: &str| -> String {
        name.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_lowercase()
    };
    let mut labels: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut respelled: BTreeSet<(String, String)> = BTreeSet::new();
    for pull in measured.pulls.iter_mut().filter(|pull| !twin.parts.contains_key(&pull.part)) {
        let mut same = twin.parts.keys().filter(|name| plain(name) == plain(&pull.part));
        if let (Some(name), None) = (same.next(), same.next()) {
            respelled.insert((std::mem::replace(&mut pull.part, name.clone()), name.clone()));
            continue;
        }
        // Keys of a twin are cut at points and brackets.
        let key = pull.part.replace(['.', '[', ']'], "_");
        if key != pull.part {
            respelled.insert((std::mem::replace(&mut pull.part, key.clone()), key));
        }
        let ratio = pull.max_pull_force_n / (2.0 * pull.grip_force_n);
        labels.entry(pull.part.clone()).or_default().push(ratio);
    }
    let taken = respelled
        .iter()
        .map(|(typed, name)| format!("the part `{typed}` of the table is `{name}` of the twin"));
    found.notes.extend(taken);
    for (part, ratios) in labels {
        let pulls = ratios.len();
        let mu = median(ratios).filter(|mu| (0.005..=3.0).contains(mu)).unwrap_or(MU);
        let near = suggestion(&part, twin.parts.keys().map(String::as_str));
        let near = near.map_or(String::new(), |name| format!("; did you mean `{name}`?"));
        found.notes.push(format!(
            "the twin has no part `{part}`: one was made for {} pulls, with a coefficient of {} (the median of its labels over twice the \
             grip force) and without a geometry. Effects of contact and image do not compete{near}",
            pulls,
            rounded(mu, &[])
        ));
        let section = toml::Table::from_iter([
            ("mesh".to_string(), NO_MESH.into()),
            ("mu".into(), mu.into()),
            ("scatter".into(), SCATTER.into()),
            ("imprint_mm3_per_n".into(), IMPRINT_MM3_PER_N.into()),
            ("source".into(), "made from labels alone; no geometry".into()),
        ]);
        found.sets.push((format!("parts.{part}"), toml::Value::Table(section).to_string()));
    }
    found
}

/// Effects of contact and image, which pulls on a part without a geometry say nothing of; none where every part has one.
pub fn effects_of_geometry(measured: &MeasuredPulls, twin: &Twin) -> Vec<&'static str> {
    let lacks = |part: &str| twin.parts.get(part).is_some_and(|part| !part.has_geometry());
    if !measured.pulls.iter().any(|pull| lacks(&pull.part)) {
        return Vec::new();
    }
    let of_contact = LIBRARY.iter().filter(|spec| {
        spec.of_pressure || spec.imprint_volume.is_some() || spec.tilt_rad.is_some() || spec.optics.is_some()
    });
    of_contact.map(|spec| spec.id).collect()
}

/// Labels over what a twin says of them, between which its grip forces look like those of both jaws: about a half, and about two.
const HALF: (f64, f64) = (0.4, 0.62);
const TWICE: (f64, f64) = (1.6, 2.5);

/// What grip forces were taken for, and what the other reading gives, where the coefficient is about half or twice that of the twin.
/// Parts that were made from these labels say nothing of it.
pub fn jaws_of_grip_force(measured: &MeasuredPulls, twin: &Twin, made: &OwnParts) -> Option<String> {
    if !made.sets.is_empty() {
        return None;
    }
    let known = measured.pulls.iter().filter_map(|pull| Some((pull, twin.parts.get(&pull.part)?.mu)));
    let mut each: Vec<(f64, f64)> = known
        .map(|(pull, mu)| (pull.max_pull_force_n / (2.0 * pull.grip_force_n), mu))
        .filter(|(ratio, mu)| *ratio > 0.0 && *mu > 0.0)
        .collect();
    each.sort_by(|a, b| (a.0 / a.1).total_cmp(&(b.0 / b.1)));
    let &(mu, of_twin) = each.get(each.len() / 2)?;
    let within = |(low, high): (f64, f64)| (low..=high).contains(&(mu / of_twin));
    let (factor, half_or_twice, as_taken, otherwise) = if within(HALF) {
        (2.0, "half", "those of one jaw (force_convention = \"per_jaw\")", "were they the sum of both jaws")
    } else if within(TWICE) {
        (
            0.5,
            "twice",
            "those of one jaw, a sum of both being halved (force_convention)",
            "were they half as large",
        )
    } else {
        return None;
    };
    let write =
        if factor == 2.0 { "; then write force_convention = \"total\" into campaign.toml" } else { "" };
    Some(format!(
        "the coefficient of these pulls is about {}, {half_or_twice} of the twin's {}: grip forces were taken as {as_taken}; {otherwise}, it \
         would be {}{write}",
        rounded(mu, &[]),
        rounded(of_twin, &[]),
        rounded(factor * mu, &[])
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::load::load_twin;
    use gripgen_twin::{Covariates, MeasuredPull};

    fn pulls(part: &str, mu: f64) -> MeasuredPulls {
        let pull = |i: usize| MeasuredPull {
            id: i.to_string(),
            part: part.into(),
            grip_pose: 0,
            grip_force_n: 10.0 + i as f64,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates::default(),
            max_pull_force_n: 2.0 * mu * (10.0 + i as f64),
            zero_shift_n: 0.0,
            trace: None,
        };
        MeasuredPulls {
            pulls: (0..9).map(pull).collect(),
            recorded: vec![],
            extra: vec![],
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            sha256: String::new(),
        }
    }

    #[test]
    fn a_part_that_the_twin_lacks_is_made_without_a_geometry() {
        let twin = load_twin(gripgen::BASELINE_TWIN, &[]).unwrap();
        let mut measured = pulls("foam \"a\" 5.5 mm", 0.42);
        let made = own_parts(&mut measured, &twin);
        assert!(
            made.notes[0].contains("`foam \"a\" 5.5 mm` of the table is `foam \"a\" 5_5 mm`"),
            "{made:?}"
        );
        assert!(made.notes[1].contains("has no part `foam \"a\" 5_5 mm`"), "{made:?}");
        assert!(made.notes[1].contains("a coefficient of 0.42"), "{made:?}");
        let with = load_twin(gripgen::BASELINE_TWIN, &made.sets).unwrap();
        let part = &with.parts["foam \"a\" 5_5 mm"];
        assert!(!part.has_geometry() && (part.mu - 0.42).abs() < 1e-12);
        let silent = effects_of_geometry(&measured, &with);
        assert!(
            silent.contains(&"shear_strength") && silent.contains(&"defocus") && !silent.contains(&"wear")
        );
        assert_eq!(effects_of_geometry(&pulls("gear", 0.2), &with), Vec::<&str>::new());
        assert_eq!(
            jaws_of_grip_force(&measured, &with, &made),
            None,
            "its coefficient is that of these pulls"
        );
    }

    #[test]
    fn a_part_of_another_spelling_is_that_of_the_twin() {
        let twin = load_twin(gripgen::BASELINE_TWIN, &[]).unwrap();
        for typed in ["Gear", "GEAR", " gear"] {
            let mut measured = pulls(typed, 0.15);
            let made = own_parts(&mut measured, &twin);
            assert!(made.sets.is_empty() && measured.pulls.iter().all(|p| p.part == "gear"), "{typed}");
            assert_eq!(made.notes, [format!("the part `{typed}` of the table is `gear` of the twin")]);
        }
        let mut measured = pulls("geer", 0.15);
        assert!(own_parts(&mut measured, &twin).notes[0].ends_with("did you mean `gear`?"));
    }

    #[test]
    fn a_sum_of_both_jaws_that_was_given_as_one_is_said() {
        let twin = load_twin(gripgen::BASELINE_TWIN, &[]).unwrap();
        let mu = twin.parts["gear"].mu;
        let said = |factor: f64| jaws_of_grip_force(&pulls("gear", factor * mu), &twin, &OwnParts::default());
        assert_eq!((said(1.0), said(0.75), said(1.4)), (None, None, None));
        let half = said(0.5).unwrap();
        assert!(
            half.contains("half of the twin's")
                && half.ends_with("force_convention = \"total\" into campaign.toml")
        );
        assert!(said(2.0).unwrap().contains("twice of the twin's"));
    }
}
