//! Real presses with changes of the optics that nobody declares, diagnosed: what is named, what is missed.
//!
//! A sensor is calibrated on some presses of a set; the others are changed by formulas that differ from those of the effects
//! library, and diagnosed against it. Run with
//! `cargo xtask research press-cases PRESSES [--ball-mm D --mm-per-px P] [words of cases]`. `--untouched N` diagnoses
//! N halves that are drawn, without any change; `--from K` begins with half K, so that a run can be continued.

use crate::{StudyResult, arguments};
use gripgen::tactile::Sensor;
use gripgen::tactile::presses::{CalibrateOptions, Press, PressSet, calibrate_presses};
use gripgen::twin::TactileImage;
use gripgen::twin::random::{Purpose, Stream};
use gripgen_cli::{
    PressCovariate, PressDiagnosisInput, PressGeometry, PressValues, diagnose_presses, load_presses,
    presses_sha256,
};
use gripgen_identify::{Diagnosis, Verdict};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

mod changes;

use changes::{Change, changed};

struct Case {
    name: &'static str,
    /// Ids of what is there; `unknown` and a covariate for what the library lacks.
    truth: Vec<&'static str>,
    changes: Vec<Change>,
}

fn case(name: &'static str, truth: &[&'static str], changes: &[Change]) -> Case {
    Case { name, truth: truth.to_vec(), changes: changes.to_vec() }
}

fn cases() -> Vec<Case> {
    use Change::*;
    vec![
        case("none", &[], &[]),
        case("drift-4", &["light_drift"], &[Drift([-0.04, -0.03, -0.05])]),
        case("drift-8", &["light_drift"], &[Drift([-0.08, -0.05, -0.06])]),
        case("drift-20", &["light_drift"], &[Drift([-0.15, -0.20, -0.12])]),
        case("background-4", &["background_change"], &[Background { from: 0.4, levels: 4.0 }]),
        case("background-10", &["background_change"], &[Background { from: 0.6, levels: 10.0 }]),
        case("background-all", &["background_change"], &[Background { from: 0.0, levels: 8.0 }]),
        case("exposure-3", &["exposure"], &[Gain(0.96)]),
        case("exposure-8", &["exposure"], &[Gain(1.08)]),
        case("gamma-10", &["exposure"], &[Gamma(1.1)]),
        case("balance", &["press_gain"], &[Balance([1.06, 1.0, 0.94])]),
        case("balance-wanders", &["press_gain"], &[Wandering(0.05)]),
        case("defocus-2", &["defocus"], &[Blur(2)]),
        case("defocus-4", &["defocus"], &[Blur(4)]),
        case("defocus-8", &["defocus"], &[Blur(8)]),
        case("defocus-12", &["defocus"], &[Blur(12)]),
        case("shift-3", &["misregistration"], &[Shift(3.0, -2.0)]),
        case("shift-6", &["misregistration"], &[Shift(-4.0, 4.5)]),
        case("offset-2", &["rest_offset"], &[Offset([2.0, -2.0, 1.5])]),
        case("offset-5", &["rest_offset"], &[Offset([5.0, -4.0, 3.0])]),
        case(
            "drift+shift",
            &["light_drift", "misregistration"],
            &[Drift([-0.10, -0.08, -0.12]), Shift(4.0, 3.0)],
        ),
        case(
            "defocus+background",
            &["defocus", "background_change"],
            &[Blur(10), Background { from: 0.5, levels: 8.0 }],
        ),
        case("exposure+defocus", &["exposure", "defocus"], &[Blur(10), Gain(0.92)]),
        case(
            "offset+shift",
            &["rest_offset", "misregistration"],
            &[Offset([5.0, -4.0, 3.0]), Shift(4.0, 3.0)],
        ),
        case(
            "drift+background",
            &["light_drift", "background_change"],
            &[Drift([-0.10, -0.08, -0.12]), Background { from: 0.5, levels: 8.0 }],
        ),
        case("hue", &["unknown", "colour"], &[Hue(0.12)]),
        case("vignette", &["unknown", "pull_index"], &[Vignette(0.15)]),
        case("flicker", &["unknown", "lamp_v"], &[Flicker(0.05)]),
    ]
}

pub fn run() -> StudyResult {
    let mut words: Vec<String> = arguments().collect();
    let mut number = |option: &str| {
        let at = words.iter().position(|w| w == option).filter(|at| at + 1 < words.len())?;
        words.drain(at..at + 2).nth(1)?.parse::<f64>().ok()
    };
    let geometry = PressGeometry {
        ball_m: number("--ball-mm").map(|mm| mm * 1e-3),
        metres_per_px: number("--mm-per-px").map(|mm| mm * 1e-3),
    };
    let untouched = number("--untouched");
    let first = number("--from").unwrap_or(0.0);
    let Some(pack) = words.first() else {
        eprintln!(
            "usage: press_cases PRESSES [--ball-mm D --mm-per-px P] [--untouched N [--from K]] [CASE...]"
        );
        return Ok(());
    };
    let verbose = std::env::var("VERBOSE").is_ok();
    let set = load_presses(Path::new(pack), geometry).expect("a press set");
    if let Some(splits) = untouched {
        halves(&set, first as u64, splits as u64, verbose);
        return Ok(());
    }
    let set_name = presses_sha256(&set);
    let splits: [(&str, usize, usize); 5] =
        [("half0", 2, 0), ("half1", 2, 1), ("third0", 3, 0), ("third1", 3, 1), ("third2", 3, 2)];
    let (mut right, mut all) = (0, 0);
    for (split, every, at) in splits {
        if words[1..].iter().any(|w| w.starts_with("half") || w.starts_with("third"))
            && !words.iter().any(|w| w == split)
        {
            continue;
        }
        let chosen = |test: bool| PressSet {
            presses: set
                .presses
                .iter()
                .enumerate()
                .filter(|(i, _)| (i % every == at) == test)
                .map(|(_, p)| p.clone())
                .collect(),
            ..set.clone()
        };
        let sensor = sensor_of(&chosen(false), &format!("{set_name}-{split}"));
        for case in cases() {
            let named: Vec<&String> =
                words[1..].iter().filter(|w| !w.starts_with("half") && !w.starts_with("third")).collect();
            if !named.is_empty() && !named.iter().any(|w| case.name.starts_with(w.as_str())) {
                continue;
            }
            if every == 3 && case.name != "none" && named.is_empty() && at != 0 {
                continue;
            }
            let start = Instant::now();
            let d = diagnosed(&chosen(true), &sensor, &case.changes, verbose);
            let ok = judged(&d, &case.truth);
            all += 1;
            right += usize::from(ok);
            println!(
                "{:>7} {:<20} {} {} [{:.0} s]",
                split,
                case.name,
                if ok { "ok   " } else { "WRONG" },
                summary(&d),
                start.elapsed().as_secs_f64()
            );
        }
    }
    println!("{right} of {all}");
    Ok(())
}

/// What is named in halves of a set that nobody changed, against a sensor of the other half; halves `first` to `first + splits - 1`.
fn halves(set: &PressSet, first: u64, splits: u64, verbose: bool) {
    // The sensor is the last fit, to all presses that are given: the folds only say its error, which nobody reads here.
    let options = CalibrateOptions { folds: Some(2), ..Default::default() };
    let mut names: BTreeMap<String, u64> = BTreeMap::new();
    for split in first..first + splits {
        let start = Instant::now();
        let mut draws = Stream::new(split, 0, Purpose::Draw);
        let mut order: Vec<(f64, usize)> = (0..set.presses.len()).map(|i| (draws.uniform(), i)).collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0));
        let fitted: Vec<usize> = order.iter().take(order.len() / 2).map(|o| o.1).collect();
        let half = |test: bool| PressSet {
            presses: (0..set.presses.len())
                .filter(|i| fitted.contains(i) != test)
                .map(|i| set.presses[i].clone())
                .collect(),
            ..set.clone()
        };
        let sensor = calibrate_presses(&half(false), &options).expect("a calibration").sensor;
        let calibrated_s = start.elapsed().as_secs_f64();
        let d = diagnosed(&half(true), &sensor, &[], verbose);
        let mut named: Vec<&str> = d.effects.iter().map(|e| e.name.as_str()).collect();
        named.extend(d.unknown.iter().map(|_| "unknown"));
        for name in if named.is_empty() { vec!["none"] } else { named } {
            *names.entry(name.to_string()).or_default() += 1;
        }
        println!(
            "split {split:>3} {} [{calibrated_s:.0} + {:.0} s]",
            summary(&d),
            start.elapsed().as_secs_f64() - calibrated_s
        );
    }
    println!("of {splits}: {names:?}");
}

fn sensor_of(train: &PressSet, split: &str) -> Sensor {
    let cache = std::env::temp_dir().join(format!("gripgen-press-cases-{split}.npz"));
    if let Ok(bytes) = std::fs::read(&cache)
        && let Ok(sensor) = Sensor::from_npz(&bytes, None, None)
    {
        return sensor;
    }
    let found = calibrate_presses(train, &CalibrateOptions::default()).expect("a calibration");
    if let Some(Ok(bytes)) = found.sensor.to_npz() {
        let _ = std::fs::write(&cache, bytes);
    }
    found.sensor
}

fn diagnosed(test: &PressSet, sensor: &Sensor, changes: &[Change], verbose: bool) -> Diagnosis {
    let n = test.presses.len();
    let lamp: Vec<f64> = (0..n).map(|i| ((i * 7 + 3) % 11) as f64 / 10.0).collect();
    let apply = |image: &TactileImage, share: f64, lamp: f64, contact: bool| {
        changes.iter().fold(image.clone(), |image, change| changed(&image, *change, share, lamp, contact))
    };
    let set = PressSet {
        presses: test
            .presses
            .iter()
            .enumerate()
            .map(|(i, p)| Press { image: apply(&p.image, i as f64 / n as f64, lamp[i], true), ..p.clone() })
            .collect(),
        rest: test.rest.as_ref().map(|r| apply(r, 0.0, 0.5, false)),
        ..test.clone()
    };
    let input = PressDiagnosisInput {
        set: &set,
        sensor,
        time_s: None,
        covariates: vec![PressCovariate { name: "lamp_v".into(), values: PressValues::Numbers(lamp) }],
        marked: true,
        sha256: String::new(),
        kept_effects: Vec::new(),
    };
    let found = {
        let start = Instant::now();
        let mut last = (String::new(), 0.0);
        diagnose_presses(&input, &mut |share, what| {
            let now = start.elapsed().as_secs_f64();
            if verbose {
                println!("    {share:.2} {:>20} {:.1} s", last.0, now - last.1);
            }
            last = (what.to_string(), now);
        })
    };
    if verbose {
        for row in &found.report.evidence {
            println!(
                "    {:<28} {:8.3} +- {:6.3}  {:7.3}  {} [{}]",
                row.name, row.heldout_gain, row.standard_error, row.heldout_error, row.values, row.fate
            );
        }
        for group in &found.report.groups[..1] {
            println!(
                "    zones {:?}",
                group.plots[0]
                    .series
                    .iter()
                    .map(|s| s.points.iter().map(|p| (10.0 * p.1).round() / 10.0).collect::<Vec<_>>())
                    .collect::<Vec<_>>()
            );
        }
        println!("    {}", serde_json::to_string(&found.diagnosis.would_have_seen).unwrap_or_default());
    }
    found.diagnosis
}

fn judged(d: &Diagnosis, truth: &[&str]) -> bool {
    let mut names: Vec<&str> = d.effects.iter().map(|e| e.name.as_str()).collect();
    names.sort_unstable();
    match truth {
        [] => d.verdict == Verdict::None,
        ["unknown", covariate] => {
            d.verdict == Verdict::Unknown && d.unknown.iter().any(|u| u.covariate == *covariate)
        }
        truth => {
            let mut wanted = truth.to_vec();
            wanted.sort_unstable();
            names == wanted && d.unknown.is_empty()
        }
    }
}

fn summary(d: &Diagnosis) -> String {
    let effects: Vec<String> = d
        .effects
        .iter()
        .map(|e| {
            let rivals: Vec<String> =
                e.indistinguishable_from.iter().map(|r| format!("{} {:.2}", r.name, r.weight)).collect();
            let values: Vec<String> = e
                .parameters
                .iter()
                .take(3)
                .map(|(n, p)| format!("{n} {:.3} ({:.3}..{:.3})", p.value, p.low90, p.high90))
                .collect();
            format!("{} {:.2} ~[{}] {{{}}}", e.name, e.weight, rivals.join(", "), values.join(", "))
        })
        .collect();
    let unknown: Vec<String> =
        d.unknown.iter().map(|u| format!("{} {:.2}", u.covariate, u.strength)).collect();
    let mse = d.error.as_ref().map_or(String::new(), |e| {
        format!("mse {:.2} -> {:.2}", e.before.mse.unwrap_or(f64::NAN), e.after.mse.unwrap_or(f64::NAN))
    });
    format!("{:?} {} unknown {:?} {}", d.verdict, effects.join("; "), unknown, mse)
}
