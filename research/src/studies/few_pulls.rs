//! What few pulls are worth: the error of a twin calibrated with 1 to 12 of them on unseen pulls, over the least that there can be, and how
//! often its intervals hold the truth.
//!
//!     cargo xtask research few-pulls 40 [LINE...]
//!
//! Pulls come from the lab of `coverage`, which shares no mechanics with the twin. `WIDER=2` makes all beliefs twice as wide,
//! `WIDER=mu:0.5` that on mu half as wide.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use crate::lab::{Contact, Plan, World, campaign};
use crate::{StudyResult, arguments};
use gripgen::in_parallel;
use gripgen::twin::config::Feedback;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{MeasuredPulls, Twin};
use gripgen::{Library, Location, load_twin_document};
use gripgen_cli::{calibrate_twin, compare_pulls_with, edited_twin, shipped_priors};
use gripgen_identify::pulls::calibrate::CalibrateRequest;
use gripgen_identify::pulls::priors::{Prior, PullPriors};
use std::sync::Mutex;

const TWIN: &str = "asset:configs/twin-baseline.toml";
/// Forces of unseen pulls, and how many there are of each.
const UNSEEN_N: [f64; 4] = [20.0, 35.0, 55.0, 80.0];
const REPEATED: usize = 24;
/// Twins that stand for a posterior.
const DRAWS: usize = 12;

struct Line {
    name: &'static str,
    forces_n: &'static [f64],
    law: bool,
    traces: bool,
}

const LINES: [Line; 7] = [
    Line { name: "one", forces_n: &[40.0], law: false, traces: false },
    Line { name: "one-trace", forces_n: &[40.0], law: false, traces: true },
    Line { name: "three", forces_n: &[20.0, 40.0, 80.0], law: false, traces: false },
    Line { name: "three-law", forces_n: &[20.0, 40.0, 80.0], law: true, traces: false },
    Line { name: "three-law-trace", forces_n: &[20.0, 40.0, 80.0], law: true, traces: true },
    Line { name: "six-law", forces_n: &[20.0, 40.0, 80.0, 20.0, 40.0, 80.0], law: true, traces: false },
    Line {
        name: "twelve",
        forces_n: &[20.0, 30.0, 40.0, 60.0, 80.0, 50.0, 20.0, 30.0, 40.0, 60.0, 80.0, 50.0],
        law: false,
        traces: false,
    },
];

/// The truth of campaign `index`: mu and the law over what the paper's table has, the rig over what its twins have.
fn world(line: &Line, index: u64) -> World {
    let mut draw = Stream::new(177, index, Purpose::Draw);
    let mut uniform = |low: f64, high: f64| low + (high - low) * draw.uniform();
    let (mu, b) = (uniform(0.1, 0.35), uniform(-6.0, 9.0));
    World {
        mu: vec![mu],
        law: line.law.then_some((1.0, b)),
        kinetic_ratio: uniform(0.86, 1.0),
        lag_s: uniform(0.015, 0.12),
        dead_time_s: 0.0,
        stiffness_n_per_m: 40e3,
        damping_n_s_per_m: 2000.0,
        noise_n: 0.08 * 4.0_f64.powf(uniform(0.0, 1.0)),
        scatter: uniform(0.02, 0.07),
        contact: Contact::Flat,
        feedback: Feedback::Independent,
    }
}

/// Pulls at these forces, in order.
fn pulls(world: &World, forces_n: &[f64], traces: bool, seed: u64) -> MeasuredPulls {
    let one = |(i, force_n): (usize, &f64)| {
        let plan = Plan {
            pulls: 1,
            trace_every: usize::from(traces),
            grip_force_n: vec![*force_n],
            increment_n: vec![1.0],
        };
        campaign(world, &plan, seed * 1000 + i as u64)
    };
    let mut all: Vec<MeasuredPulls> = forces_n.iter().enumerate().map(one).collect();
    let mut first = all.remove(0);
    first.pulls.extend(all.into_iter().flat_map(|m| m.pulls));
    for (i, pull) in first.pulls.iter_mut().enumerate() {
        (pull.id, pull.covariates.pull_index) = (format!("p{i}"), i as u64);
        pull.covariates.time_s = 40.0 * i as f64;
    }
    first
}

fn widened(mut priors: PullPriors) -> PullPriors {
    let Ok(asked) = std::env::var("WIDER") else { return priors };
    let (name, factor) = asked.split_once(':').unwrap_or(("all", &asked));
    let factor: f64 = factor.parse().expect("WIDER is a number, or NAME:NUMBER");
    let PullPriors { mu, offset_n, kinetic_ratio, lag_s, noise_n, scatter } = &mut priors;
    let all: [(&str, &mut Prior); 6] = [
        ("mu", mu),
        ("offset_n", offset_n),
        ("kinetic_ratio", kinetic_ratio),
        ("lag_s", lag_s),
        ("noise_n", noise_n),
        ("scatter", scatter),
    ];
    for (own, prior) in all {
        if name == "all" || name == own {
            *prior = prior.wider(factor);
        }
    }
    priors
}

pub fn run() -> StudyResult {
    let arguments: Vec<String> = arguments().collect();
    let count: usize = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(40);
    let from: usize = std::env::var("FROM").ok().and_then(|f| f.parse().ok()).unwrap_or(0);
    let document = load_twin_document(&Location::parse(TWIN), &[]).unwrap();
    let twin = Twin::new(&document.read_twin().unwrap()).unwrap();
    let library = Library::of_twin(&twin, &Location::parse(TWIN)).unwrap();
    println!(
        "{:16} {:>4} {:>7} {:>7} {:>9} {:>9} {:>9}",
        "line", "n", "median", "p90", "mu or a", "b", "labels"
    );
    for line in LINES.iter().filter(|l| arguments.len() < 2 || arguments[1..].iter().any(|a| a == l.name)) {
        let found: Mutex<Vec<(f64, [f64; 3])>> = Mutex::default();
        in_parallel(count, 2, |k| {
            let index = (from + k) as u64;
            let world = world(line, index);
            let measured = pulls(&world, line.forces_n, line.traces, 2 * index + 1);
            let priors = Some(widened(shipped_priors(&twin)));
            let request = CalibrateRequest { offset_law: line.law, priors, ..CalibrateRequest::default() };
            let (fit, edits) = calibrate_twin(&measured, &twin, &library, &request, 1).unwrap();
            let file = edited_twin(&Location::parse(TWIN), &[], &edits).unwrap();
            let table = toml::Table::try_from(&file).unwrap();
            let calibrated = Twin::new(&file).unwrap();
            let unseen: Vec<f64> = UNSEEN_N.iter().flat_map(|f| [*f; REPEATED]).collect();
            let unseen = pulls(&world, &unseen, false, 2 * index + 2);
            let mut some = unseen.clone();
            some.pulls = some.pulls.into_iter().step_by(REPEATED / 2).collect();
            let draw = |k: usize| {
                fit.posterior.twin(fit.posterior.at((k as f64 + 0.5) / DRAWS as f64), &table).unwrap()
            };
            let draws: Vec<Twin> = (0..DRAWS).map(draw).collect();
            let compared = compare_pulls_with(&some, &calibrated, &draws, &library, 1).unwrap();
            let (mut error, mut floor) = (0.0, 0.0);
            for (f, own) in unseen.pulls.chunks(REPEATED).enumerate() {
                let predicted_n = compared.label_n[2 * f];
                let n = own.len() as f64;
                let mean = own.iter().map(|p| p.max_pull_force_n).sum::<f64>() / n;
                error += own.iter().map(|p| (p.max_pull_force_n - predicted_n).powi(2)).sum::<f64>() / n;
                floor += own.iter().map(|p| (p.max_pull_force_n - mean).powi(2)).sum::<f64>() / (n - 1.0);
            }
            let holds = |low: f64, high: f64, truth: f64| f64::from(u8::from((low..=high).contains(&truth)));
            let factor = world.mu[0] / twin.parts["gear"].mu;
            let held = match fit.laws.first() {
                Some(law) => [
                    holds(law.a.low90, law.a.high90, factor),
                    holds(law.b_n.low90, law.b_n.high90, factor * world.law.unwrap().1),
                    compared.coverage90,
                ],
                None => {
                    let p = &fit.baseline["parts.gear.mu"];
                    [holds(p.low90, p.high90, world.mu[0]), f64::NAN, compared.coverage90]
                }
            };
            found.lock().unwrap().push(((error / floor).sqrt(), held));
        });
        let found = found.into_inner().unwrap();
        let mut ratios: Vec<f64> = found.iter().map(|f| f.0).collect();
        ratios.sort_by(f64::total_cmp);
        let share = |k: usize| found.iter().map(|f| f.1[k]).sum::<f64>() / found.len() as f64;
        println!(
            "{:16} {count:4} {:7.2} {:7.2} {:9.2} {:9.2} {:9.2}",
            line.name,
            ratios[count / 2],
            ratios[(count * 9 / 10).min(count - 1)],
            share(0),
            share(1),
            share(2)
        );
    }
    Ok(())
}
