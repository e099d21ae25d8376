//! The guard of `cargo bench`: what is past its tolerance fails by name.

#[path = "../benches/guard/mod.rs"]
mod guard;

use guard::Run;
use guard::baseline::{Baseline, Entry, Unit};
use guard::compare::{Row, compare, no_baseline, report, tolerance};
use guard::machine::{self, Machine};
use std::collections::BTreeMap;
use std::time::{Duration, SystemTime};

fn entries(of: &[(&str, Unit, &[f64])]) -> BTreeMap<String, Entry> {
    of.iter().map(|(name, unit, x)| (name.to_string(), Entry::new("t", *unit, x.to_vec()))).collect()
}

const MANY: [f64; 6] = [120.0, 100.0, 300.0, 110.0, 105.0, 104.0];

fn times(x: f64) -> Vec<f64> {
    MANY.iter().map(|y| x * y).collect()
}

#[test]
fn what_is_past_its_tolerance_fails_by_name() {
    let baseline = entries(&[("a/fast", Unit::Nanoseconds, &MANY), ("a/slow", Unit::Nanoseconds, &MANY)]);
    for (ratio, passes) in [(1.24, true), (1.26, false), (0.3, true)] {
        let slow = times(ratio);
        let now = entries(&[("a/fast", Unit::Nanoseconds, &MANY), ("a/slow", Unit::Nanoseconds, &slow)]);
        let rows = compare(&baseline, &now, |_, _| true);
        let (text, passed) = report(&rows, "t");
        assert_eq!(passed, passes, "{text}");
        assert_eq!(text.contains("past its tolerance: a/slow (1.26 x, at most 1.25)"), !passes, "{text}");
        assert!(!text.contains("a/fast ("), "{text}");
    }
    // One bad sample is no slower code, one good one is.
    let mut bad = MANY.to_vec();
    bad[0] = 1e4;
    let now = entries(&[("a/fast", Unit::Nanoseconds, &bad), ("a/slow", Unit::Nanoseconds, &MANY)]);
    assert!(report(&compare(&baseline, &now, |_, _| true), "t").1);
}

#[test]
fn tolerances_follow_what_disturbs_a_number() {
    let limit = |unit, samples| {
        let x = vec![1000.0; samples];
        let baseline = entries(&[("x", unit, &x)]);
        let fails = |ratio: f64| {
            let y: Vec<f64> = x.iter().map(|x| x * ratio).collect();
            compare(&baseline, &entries(&[("x", unit, &y)]), |_, _| true)[0].fails()
        };
        let tolerance = tolerance(unit, samples);
        assert!(!fails(tolerance - 0.005) && fails(tolerance + 0.005), "{unit:?}");
        tolerance
    };
    assert_eq!(limit(Unit::Instructions, 1), 1.02);
    assert_eq!(limit(Unit::Megabytes, 1), 1.15);
    assert_eq!((limit(Unit::Seconds, 1), limit(Unit::Seconds, 30)), (1.5, 1.25));
    let nothing =
        Row { name: "x".into(), unit: Unit::Seconds, baseline: Some(0.0), now: Some(0.0), tolerance: 1.25 };
    assert!(nothing.fails(), "a ratio that is no number does not pass");
}

#[test]
fn new_and_vanished_benchmarks_are_named() {
    let baseline = entries(&[("kept", Unit::Seconds, &[1.0]), ("gone", Unit::Seconds, &[1.0])]);
    let now = entries(&[("kept", Unit::Seconds, &[1.0]), ("fresh", Unit::Seconds, &[9.0])]);
    let (text, passed) = report(&compare(&baseline, &now, |_, _| true), "t");
    assert!(passed && text.contains("new: fresh;") && text.contains("vanished: gone;"), "{text}");
    let (text, _) = report(&compare(&baseline, &now, |name, _| name != "gone"), "t");
    assert!(!text.contains("gone"), "it was not asked for: {text}");
    // A number of another kind says nothing about the one before.
    let rows = compare(&baseline, &entries(&[("kept", Unit::Megabytes, &[50.0])]), |_, _| false);
    assert!(rows[0].is_new() && !rows[0].fails());
}

#[test]
fn a_machine_without_a_baseline_is_told_how_to_make_one() {
    let folder = tempfile::tempdir().unwrap();
    assert_eq!(Baseline::read(&folder.path().join("none.json")), Ok(None));
    let text = no_baseline("some-machine");
    assert!(text.contains("some-machine") && text.contains("cargo xtask bench record"), "{text}");
    assert!(Baseline::parse("{}").is_err());
}

#[test]
fn a_baseline_that_was_written_is_read_back() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("baselines/m.json");
    let benches = entries(&[
        ("a \"b\"", Unit::Nanoseconds, &[1234.5678, 1.0 / 3.0]),
        ("c", Unit::Instructions, &[2e9]),
    ]);
    let baseline = Baseline { machine: machine::this(), benches };
    baseline.write(&path).unwrap();
    assert_eq!(Baseline::read(&path), Ok(Some(baseline.clone())));
    assert_eq!(baseline.benches["a \"b\""].samples, [1234.57, 0.333333], "six digits");
    let text = std::fs::read_to_string(&path).unwrap();
    for part in ["\"cpu\"", "\"cores\"", "\"memory_gib\"", "\"os\"", "\"rustc\"", "\"profile\""] {
        assert!(text.contains(part), "{text}");
    }
    assert!(text.lines().any(|l| l.trim_start().starts_with("\"c\": {") && l.contains("[2000000000.0]")));
}

#[test]
fn machines_alike_share_a_name() {
    assert_eq!(machine::id("AMD EPYC 9R14 (Zen 4)", 2, "release"), "amd-epyc-9r14-zen-4-2-cores");
    assert_eq!(machine::id("Apple M3", 8, "dev"), "apple-m3-8-cores-dev");
    let Machine { id, cores, .. } = machine::this();
    assert!(cores > 0 && id.contains("cores"), "{id}");
}

#[test]
fn a_filter_compares_only_what_ran() {
    let run = |words: &[&str]| {
        let words: Vec<String> = words.iter().map(ToString::to_string).collect();
        Run::of("t", &words, SystemTime::now())
    };
    let all = run(&["--bench"]);
    assert!(all.wants("a/b") && all.expects("a/b", "t") && !all.expects("a/b", "u"));
    let some = run(&["--bench", "a/", "--sample-size", "10"]);
    assert!(some.expects("a/b", "t") && !some.expects("b/b", "t") && !some.wants("b/b"));
    assert!(some.wants_some_of("a/b") && some.wants_some_of("a") && !some.wants_some_of("c"));
    // What a regular expression or a flag leaves out is not known.
    for words in [&["--bench", "a/.*"][..], &["--bench", "--list"], &["--bench", "--exact", "a/b"]] {
        assert!(!run(words).expects("a/b", "t"), "{words:?}");
    }
    let file = run(&["--bench", "out/x.json"]);
    assert!(file.file().is_some() && file.wants("anything"));
}

#[test]
fn samples_of_criterion_are_read_and_old_ones_left() {
    let folder = tempfile::tempdir().unwrap();
    let new = folder.path().join("physics_pull/reduced/new");
    std::fs::create_dir_all(&new).unwrap();
    std::fs::write(new.join("benchmark.json"), r#"{"group_id":"g","full_id":"physics/pull/reduced"}"#)
        .unwrap();
    let sample = r#"{"sampling_mode":"Linear","iters":[1.0,2.0],"times":[30.0,50.0]}"#;
    std::fs::write(new.join("sample.json"), sample).unwrap();
    let began = SystemTime::now() - Duration::from_secs(60);
    let found = guard::criterion_samples::since(folder.path(), began);
    assert_eq!(found, BTreeMap::from([("physics/pull/reduced".to_string(), vec![30.0, 25.0])]));
    let later = SystemTime::now() + Duration::from_secs(60);
    assert!(guard::criterion_samples::since(folder.path(), later).is_empty(), "of another run");
}
