//! Diagnoses by one Gaussian model of the labels.

use crate::common::{baseline, library, root, twin_at};
use crate::diagnose::{names, simulated};
use gripgen::twin::draw::Drawn;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{ExtraColumn, MeasuredPulls, Twin, Values};
use gripgen_cli::{Diagnosed, Engine, PullDiagnoseOptions, compare_pulls, diagnose_pull_table, edited_twin};
use gripgen_identify::Verdict;
use gripgen_measured::load_pulls;

fn diagnose(measured: &MeasuredPulls) -> Diagnosed {
    diagnose_by(Engine::Model, measured)
}

fn diagnose_by(engine: Engine, measured: &MeasuredPulls) -> Diagnosed {
    let twin = twin_at(&baseline());
    let options = PullDiagnoseOptions { jobs: 2, engine, ..PullDiagnoseOptions::default() };
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
    let stated = found.diagnosis.error.as_ref().unwrap();
    let (before_n, after_n) = (stated.before.rmse_n.unwrap(), stated.after.rmse_n.unwrap());
    let new_n = new_n(&found, &unseen);
    assert!(after_n < 0.8 * before_n, "{before_n} {after_n}");
    assert!((0.75..1.35).contains(&(new_n / after_n)), "new pulls {new_n} N, stated {after_n} N");
}

/// The error of the written twin on pulls that were not there.
fn new_n(found: &Diagnosed, unseen: &MeasuredPulls) -> f64 {
    let twin = Twin::new(&edited_twin(&baseline(), &[], &found.edits).unwrap()).unwrap();
    compare_pulls(unseen, &twin, &library(&twin), 2).unwrap().pulls.rmse_n
}

/// Pulls with two columns of numbers that act together as a wave, whose phase is `by_hand` larger where a third one says `left`. It is
/// empty in every eleventh pull, and one of the numbers in every thirteenth.
fn with_a_wave(by_hand: f64) -> MeasuredPulls {
    let mut all = simulated("", 240, &[]);
    let mut draws = Stream::new(3, 0, Purpose::ForceNoise);
    let [first, second] = [0, 1].map(|_| all.pulls.iter().map(|_| draws.uniform()).collect::<Vec<f64>>());
    let mut columns: [Vec<Option<Drawn>>; 3] = Default::default();
    for (i, pull) in all.pulls.iter_mut().enumerate() {
        let left = draws.uniform() < 0.5;
        let phase = 5.0 * (first[i] + second[i]) + if left { by_hand } else { 0.0 };
        pull.trace = None;
        pull.max_pull_force_n *= (0.25 * phase.sin()).exp();
        let hand = Drawn::Text(if left { "left" } else { "right" }.into());
        columns[0].push(Some(Drawn::Number(first[i])).filter(|_| i % 13 != 12));
        columns[1].push(Some(Drawn::Number(second[i])));
        columns[2].push(Some(hand).filter(|_| i % 11 != 10));
    }
    let each = columns.into_iter().zip(["left_mm", "right_mm", "hand"]);
    all.extra = each
        .map(|(values, name)| {
            for (pull, value) in all.pulls.iter_mut().zip(&values) {
                pull.covariates.extra.extend(value.clone().map(|value| (name.into(), value)));
            }
            ExtraColumn { name: name.into(), values: Values::of_drawn(values.iter().map(Option::as_ref)) }
        })
        .collect();
    all
}

/// A column of words that counts, with cells that are empty: such pulls are no points of the surface.
#[test]
fn a_surface_over_a_column_with_gaps_has_points_without() {
    let (seen, unseen) = {
        let all = with_a_wave(3.0);
        (all.kept(|i| i % 4 != 0), all.kept(|i| i % 4 == 0))
    };
    let [search, auto] = [Engine::Search, Engine::Auto].map(|engine| diagnose_by(engine, &seen));
    let unknown: Vec<&str> = auto.diagnosis.unknown.iter().map(|u| u.covariate.as_str()).collect();
    assert!(unknown.iter().any(|u| u.contains("hand") && u.contains("left_mm")), "{unknown:?}");
    let (without_n, with_n) = (new_n(&search, &unseen), new_n(&auto, &unseen));
    assert!(with_n < 0.8 * without_n, "{with_n} N with a surface, {without_n} N without");
}

/// Two columns without a meaning that act together as a wave: no effect, no curve of one column and no product describes them.
#[test]
fn what_no_effect_describes_is_a_surface_that_predicts_new_pulls() {
    let all = with_a_wave(0.0);
    let (seen, unseen) = (all.kept(|i| i % 2 == 0), all.kept(|i| i % 2 == 1));
    let [search, auto] = [Engine::Search, Engine::Auto].map(|engine| diagnose_by(engine, &seen));
    let unknown: Vec<&str> = auto.diagnosis.unknown.iter().map(|u| u.covariate.as_str()).collect();
    assert!(unknown.iter().any(|u| u.contains("left_mm") && u.contains("right_mm")), "{unknown:?}");
    let (without_n, with_n) = (new_n(&search, &unseen), new_n(&auto, &unseen));
    assert!(with_n < 0.6 * without_n, "{with_n} N with a surface, {without_n} N without");
    assert!(
        auto.diagnosis.notes.iter().any(|note| note.contains("one smooth model")),
        "{:?}",
        auto.diagnosis.notes
    );
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
