//! What a twin simulates is what it predicts: labels of campaigns made on a twin against the labels expected of it.

use crate::bristles;
use crate::common::{jobs, overrides, run, slow, twin_with, twin_with_sets};
use gripgen::twin::config::ConfigError;
use gripgen::twin::effects::{EffectSpec, LIBRARY};
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Campaign, PlannedPull, Twin};
use gripgen::{Library, Location, Project, load_twin_document};
use gripgen_cli::{compare_pulls, simulate_campaign};
use gripgen_measured::load_pulls;

/// A twin by what is added to the shipped baseline.
struct Case {
    name: String,
    sets: Vec<(String, String)>,
    effects: String,
}

fn set(key: &str, value: &str) -> (String, String) {
    (key.into(), value.into())
}

/// Neither noise nor scatter, on the two parts that are pulled.
fn quiet() -> Vec<(String, String)> {
    let parts = ["long_shaft", "gear"];
    let scatter = parts.iter().map(|p| set(&format!("parts.{p}.scatter"), "0"));
    scatter.chain([set("wrist.noise_n", "0"), set("robot.model", "\"carriage\"")]).collect()
}

/// Pulls over what a campaign varies.
fn campaign(pulls: usize) -> Campaign {
    let of = |i: usize| PlannedPull {
        part: ["long_shaft", "gear"][i % 2].into(),
        grip_force_n: [21.0, 33.0, 47.0, 62.0, 78.0][i % 5] - 0.37 * (i % 7) as f64,
        grip_offset_mm: [0.0, 2.0, -4.0][i % 3],
        grip_angle_deg: [0.0, 30.0, 90.0][i / 3 % 3],
        pull_direction: if i % 4 == 3 { -1.0 } else { 1.0 },
        dwell_s: [1.0, 10.0, 60.0][i / 2 % 3],
        force_increment_n: [1.0, 0.5][i / 4 % 2],
        step_time_s: [0.104, 0.05][i / 8 % 2],
        ..PlannedPull::default()
    };
    Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: (0..pulls).map(of).collect() }
}

/// How far simulated labels and expected labels lie from those of the integration in `bristles.rs`, on average, as shares of the
/// mean label; an error where the twin refuses.
fn differences(case: &Case, pulls: usize) -> Result<[f64; 2], ConfigError> {
    let (_folder, file) = twin_with(&case.effects);
    let at = Location::Disk(file);
    let sets = [quiet(), case.sets.clone()].concat();
    let twin = Twin::new(&load_twin_document(&at, &sets).unwrap().read_twin()?)?;
    let campaign = campaign(pulls);
    let mut measured = simulate_campaign(&at, &sets, &campaign, 3).unwrap().pulls;
    measured.pulls.iter_mut().for_each(|p| p.trace = None);
    let library = Library::of_twin(&twin, &at).unwrap();
    let found = compare_pulls(&measured, &twin, &library, 2).unwrap();
    let mut sums = (0.0, 0.0, 0.0);
    for (p, expected) in measured.pulls.iter().zip(&found.label_n) {
        let own = bristles::label_n(&twin, &library, p, campaign.stop_m, campaign.label_tolerance_n);
        sums.0 += (p.max_pull_force_n - own).abs();
        sums.1 += (expected - own).abs();
        sums.2 += p.max_pull_force_n;
    }
    // On soft gels strong grips reach the stop without a slip, and have no label.
    assert!(measured.pulls.len() * 3 > pulls, "{}: {} pulls", case.name, measured.pulls.len());
    Ok([sums.0 / sums.2, sums.1 / sums.2])
}

/// Values of an effect at a share of the way to a bound of parameter `size`; the others act where they have to.
fn strength(spec: &EffectSpec, size: usize, share: f64) -> Vec<f64> {
    let towards = |i: usize, share: f64| {
        let p = &spec.parameters[i];
        let (low, high) = p.bounds;
        // Over decades.
        if low > 0.0 && high / low > 1e3 {
            return low * (high / low).powf(if p.neutral == high { 0.2 + 0.1 * share } else { 0.6 * share });
        }
        if share >= 0.0 {
            p.neutral + share * (high - p.neutral)
        } else {
            p.neutral + share * (p.neutral - low)
        }
    };
    (0..spec.parameters.len())
        .map(|i| match i {
            i if i == size => towards(i, share),
            0 => towards(0, 0.15),
            i => spec.parameters[i].neutral,
        })
        .collect()
}

fn entry(spec: &EffectSpec, values: &[f64], more: &str) -> String {
    let parameters = spec.parameters.iter().zip(values).map(|(p, v)| format!("{} = {v:?}\n", p.name));
    format!("[[effects]]\nname = \"{}\"\n{}{more}\n", spec.id, parameters.collect::<String>())
}

/// Twins with each effect of the library on pulls, at several strengths, with the options that it allows.
fn effects() -> Vec<Case> {
    let mut cases = Vec::new();
    for spec in LIBRARY.iter().filter(|s| s.optics.is_none()) {
        for size in 0..spec.parameters.len() {
            if spec.references.contains(&spec.parameters[size].name) {
                continue;
            }
            for share in [-0.3, 0.1, 0.35] {
                let values = strength(spec, size, share);
                let name = format!("{} {values:?}", spec.id);
                cases.push(Case { name: name.clone(), sets: vec![], effects: entry(spec, &values, "") });
                if spec.friction.is_some() && share > 0.2 {
                    for kinetic in ["0.8", "0.93"] {
                        let sets = vec![
                            set("parts.long_shaft.kinetic_ratio", kinetic),
                            set("parts.gear.kinetic_ratio", kinetic),
                        ];
                        let name = format!("{name} kinetic {kinetic}");
                        cases.push(Case { name, sets, effects: entry(spec, &values, "") });
                    }
                }
                if spec.is_load_law() {
                    let own = [
                        "per = \"cell\"\nreference_area_mm2 = 80.0",
                        "fitted_grip_force_n = [30.0, 60.0]\noutside_fit = \"hold\"",
                        "fitted_grip_force_n = [30.0, 60.0]\noutside_fit = \"extrapolate\"",
                    ];
                    for more in own {
                        let loss = "[[effects]]\nname = \"grip_force_loss\"\nloss_n = 3.0\n";
                        let effects = format!("{loss}{}", entry(spec, &values, more));
                        cases.push(Case { name: format!("{name} {more}"), sets: vec![], effects });
                    }
                }
            }
        }
    }
    cases
}

/// Twins whose rig differs from the shipped one.
fn rigs() -> Vec<Case> {
    let kinetic = |ratio: &str| {
        vec![set("parts.long_shaft.kinetic_ratio", ratio), set("parts.gear.kinetic_ratio", ratio)]
    };
    let mut cases = vec![("kinetic 0.8", kinetic("0.8")), ("kinetic 0.93", kinetic("0.93"))];
    for lag in ["0.005", "0.2"] {
        for ratio in ["1.0", "0.8"] {
            cases.push(("lag", [kinetic(ratio), vec![set("robot.lag_s", lag)]].concat()));
        }
    }
    let own = |key: &str, value: &str| [kinetic("0.85"), vec![set(key, value)]].concat();
    cases.extend([
        ("dead time", own("robot.dead_time_s", "0.03")),
        ("independent", own("robot.feedback", "\"independent\"")),
        ("damping", own("robot.damping_n_s_per_m", "800")),
        ("light", own("robot.apparent_mass_kg", "6")),
        ("fast", own("robot.speed_limit_mm_s", "100")),
        ("soft gels", own("gel.left.shear_stiffness_n_per_mm", "4")),
        ("slips at once", own("gel.left.shear_by_area", "0.0")),
        ("bends half", own("gel.right.shear_by_area", "0.5")),
        ("falls", own("parts.long_shaft.kinetic_fall_s", "0.02")),
        ("rate", own("wrist.rate_hz", "1000")),
    ]);
    let named = |(name, sets): (&str, Vec<(String, String)>)| {
        let name = format!("{name} {}", sets.iter().map(|(k, v)| format!("{k}={v} ")).collect::<String>());
        Case { name, sets, effects: String::new() }
    };
    cases.into_iter().map(named).collect()
}

/// Asserts that simulated labels lie within 0.1 % of the integration, and expected ones within 0.5 %.
fn agree(cases: &[Case], pulls: usize) {
    let found = in_two_threads(cases, |case| differences(case, pulls).ok());
    let mut off: Vec<([f64; 2], &str)> =
        found.into_iter().zip(cases).filter_map(|(off, case)| Some((off?, case.name.as_str()))).collect();
    off.sort_by(|a, b| (b.0[0] + b.0[1]).total_cmp(&(a.0[0] + a.0[1])));
    println!("{} of {} twins can be read", off.len(), cases.len());
    for (off, name) in off.iter().take(12) {
        println!("{:8.4} % {:8.4} %  {}", 100.0 * off[0], 100.0 * off[1], name.replace('\n', " "));
    }
    assert!(off.len() * 20 > cases.len() * 19, "{} of {}", off.len(), cases.len());
    for (off, name) in &off {
        assert!(off[0] < 1e-3 && off[1] < 5e-3, "{name}: {off:?}");
    }
}

/// A few threads.
fn in_two_threads<T: Sync, R: Send>(of: &[T], f: impl Fn(&T) -> R + Sync) -> Vec<R> {
    let half = of.len() / 2;
    let (a, b) = of.split_at(half);
    std::thread::scope(|scope| {
        let other = scope.spawn(|| b.iter().map(&f).collect::<Vec<R>>());
        let mut all: Vec<R> = a.iter().map(&f).collect();
        all.extend(other.join().unwrap());
        all
    })
}

/// Pairs of effects, with what the rig may be.
fn pairs(n: usize) -> Vec<Case> {
    let (singles, rigs) = (effects(), rigs());
    let mut draws = Stream::new(5, 0, Purpose::Draw);
    let mut pick = |n: usize| (draws.uniform() * n as f64) as usize;
    (0..n)
        .map(|_| {
            let (a, b, rig) =
                (&singles[pick(singles.len())], &singles[pick(singles.len())], &rigs[pick(rigs.len())]);
            Case {
                name: format!("{} with {} on {}", a.name, b.name, rig.name),
                sets: [rig.sets.clone(), a.sets.clone()].concat(),
                effects: format!("{}{}", a.effects, b.effects),
            }
        })
        .collect()
}

/// Scatter and noise: the expected label against the mean of many simulated ones, within the largest of 0.5 %, 0.02 N and three
/// standard errors.
#[test]
fn the_expected_label_is_the_mean_of_many_noisy_pulls() {
    const PULLS: usize = 300;
    let kinetic = |ratio: &str| set("parts.long_shaft.kinetic_ratio", ratio);
    type Sets = Vec<(String, String)>;
    let cases: [(&str, Sets, &str); 8] = [
        ("plain", vec![], ""),
        ("kinetic", vec![kinetic("0.8")], ""),
        ("kinetic, no scatter", vec![kinetic("0.85"), set("parts.long_shaft.scatter", "0")], ""),
        ("noisy", vec![kinetic("0.9"), set("wrist.noise_n", "0.6")], ""),
        (
            "noisy, fast loop",
            vec![kinetic("0.9"), set("wrist.noise_n", "0.6"), set("robot.lag_s", "0.01")],
            "",
        ),
        ("slow loop", vec![kinetic("0.9"), set("robot.lag_s", "0.2")], ""),
        ("wide", vec![kinetic("0.85"), set("parts.long_shaft.scatter", "0.1")], ""),
        ("saturation", vec![kinetic("0.9")], "[[effects]]\nname = \"sensor_saturation\"\nlimit_n = 11.0\n"),
    ];
    for (name, sets, effects) in cases {
        let (_folder, file) = twin_with(effects);
        let at = Location::Disk(file);
        let twin = twin_with_sets(&at, &sets);
        let library = Library::of_twin(&twin, &at).unwrap();
        for grip_force_n in [22.0, 41.3] {
            let pull = PlannedPull { part: "long_shaft".into(), grip_force_n, ..PlannedPull::default() };
            let pulls = vec![pull; PULLS];
            let campaign = Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls };
            let mut measured = simulate_campaign(&at, &sets, &campaign, 11).unwrap().pulls;
            measured.pulls.iter_mut().for_each(|p| p.trace = None);
            let labels: Vec<f64> = measured.pulls.iter().map(|p| p.max_pull_force_n).collect();
            let n = labels.len() as f64;
            let mean = labels.iter().sum::<f64>() / n;
            let sd = (labels.iter().map(|l| (l - mean) * (l - mean)).sum::<f64>() / n).sqrt();
            measured.pulls.truncate(1);
            let expected = compare_pulls(&measured, &twin, &library, 1).unwrap().label_n[0];
            let most = (5e-3 * mean).max(0.02).max(3.0 * sd / n.sqrt());
            println!("{name}, {grip_force_n} N: {mean:.3} +- {:.3} N, expected {expected:.3}", sd / n.sqrt());
            assert!(
                (expected - mean).abs() < most,
                "{name}, {grip_force_n} N: {mean} N, expected {expected}"
            );
        }
    }
}

#[test]
fn a_twin_simulates_and_predicts_what_an_own_integration_says_with_every_effect() {
    agree(&effects(), if slow() { 48 } else { 8 });
}

#[test]
fn a_twin_simulates_and_predicts_what_an_own_integration_says_on_every_rig() {
    agree(&rigs(), if slow() { 48 } else { 16 });
}

#[test]
fn a_twin_simulates_and_predicts_what_an_own_integration_says_of_pairs() {
    agree(&pairs(if slow() { 200 } else { 24 }), if slow() { 24 } else { 8 });
}

/// The twin of the quickstart, through the folder of a run: its labels have friction by pressure cell.
#[test]
fn the_twin_of_the_quickstart_predicts_its_own_sweep() {
    let sets = [
        ("design", "random"),
        ("samples", "64"),
        ("mechanics", "reduced"),
        ("images", "none"),
        ("trace", "none"),
        ("wrist.noise_n", "0"),
        ("parts.ball_bearing.scatter", "0"),
        ("parts.long_shaft.scatter", "0"),
        ("parts.gear.scatter", "0"),
        ("parts.roller_bearing.scatter", "0"),
    ];
    let sets = overrides(&sets);
    let folder = tempfile::tempdir().unwrap();
    let twin_at = Location::parse("asset:configs/twin-contact.toml");
    let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap();
    let out = folder.path().join("run");
    run(&project, &out, jobs(2));
    let measured = load_pulls(&out).unwrap().pulls;
    let twin = twin_with_sets(&twin_at, &sets);
    let library = Library::of_twin(&twin, &twin_at).unwrap();
    let found = compare_pulls(&measured, &twin, &library, 2).unwrap();
    let mean = measured.pulls.iter().map(|p| p.max_pull_force_n).sum::<f64>() / measured.pulls.len() as f64;
    println!("{} pulls, mean {mean:.3} N: {:?}", measured.pulls.len(), found.pulls);
    assert!(found.pulls.rmse_n < 0.01 * mean, "{:?}", found.pulls);
}
