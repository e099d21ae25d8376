//! Diagnoses by one Gaussian model of the labels.

use crate::common::{baseline, library, root, twin_at};
use crate::diagnose::{names, simulated};
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{MeasuredPulls, Twin};
use gripgen_cli::{Diagnosed, Engine, PullDiagnoseOptions, compare_pulls, diagnose_pull_table, edited_twin};
use gripgen_identify::Verdict;
use gripgen_measured::load_pulls;

fn diagnose(measured: &MeasuredPulls) -> Diagnosed {
    let twin = twin_at(&baseline());
    let options = PullDiagnoseOptions { jobs: 2, engine: Engine::Model, ..PullDiagnoseOptions::default() };
    diagnose_pull_table(measured, &twin, &library(&twin), &options, &|_| {}).unwrap()
}

/// The campaign of another generator: ageing by a stretched exponential.
#[test]
fn the_model_names_the_effect_of_the_example() {
    let measured = load_pulls(&root().join("assets/campaigns/example")).unwrap().pulls;
    let found = diagnose(&measured).diagnosis;
    assert_eq!((found.verdict, names(&found)), (Verdict::Effect, vec!["dwell_ageing"]), "{found:?}");
    assert!(found.unknown.is_empty() && found.data.outliers.len() <= 4, "{found:?}");
}

/// What is stated is what the twin that is written does on pulls that were not there.
#[test]
fn the_twin_of_the_model_predicts_new_pulls_as_well_as_is_stated() {
    let effect = "[[effects]]\nname = \"dwell_ageing\"\nbeta = 0.05\n";
    let all = simulated(effect, 180, &[]);
    let (seen, unseen) = (all.kept(|i| i % 2 == 0), all.kept(|i| i % 2 == 1));
    let found = diagnose(&seen);
    let named = &found.diagnosis.effects;
    assert_eq!(names(&found.diagnosis), ["dwell_ageing"]);
    let beta = &named[0].parameters["beta"];
    assert!(beta.low90 < 0.05 && 0.05 < beta.high90, "{beta:?}");
    let stated = found.diagnosis.error.unwrap();
    let (before_n, after_n) = (stated.before.rmse_n.unwrap(), stated.after.rmse_n.unwrap());
    let twin = Twin::new(&edited_twin(&baseline(), &[], &found.edits).unwrap()).unwrap();
    let new_n = compare_pulls(&unseen, &twin, &library(&twin), 2).unwrap().pulls.rmse_n;
    assert!(after_n < 0.8 * before_n, "{before_n} {after_n}");
    assert!((0.75..1.35).contains(&(new_n / after_n)), "new pulls {new_n} N, stated {after_n} N");
}

/// Labels that are shuffled among the pulls of one part and force depend on nothing else.
#[test]
fn nothing_is_found_in_shuffled_labels() {
    let mut measured = load_pulls(&root().join("assets/campaigns/example")).unwrap().pulls;
    let key = |i: usize, m: &MeasuredPulls| (m.pulls[i].part.clone(), m.pulls[i].grip_force_n.to_bits());
    let mut draws = Stream::new(1, 0, Purpose::ForceNoise);
    for _ in 0..2 {
        for i in 0..measured.pulls.len() {
            let rest: Vec<usize> =
                (i..measured.pulls.len()).filter(|&k| key(k, &measured) == key(i, &measured)).collect();
            let other = rest[((draws.uniform() * rest.len() as f64) as usize).min(rest.len() - 1)];
            let (a, b) = (measured.pulls[i].max_pull_force_n, measured.pulls[other].max_pull_force_n);
            (measured.pulls[i].max_pull_force_n, measured.pulls[other].max_pull_force_n) = (b, a);
        }
        let found = diagnose(&measured).diagnosis;
        assert_eq!((found.verdict, names(&found)), (Verdict::None, vec![]), "{found:?}");
    }
}
