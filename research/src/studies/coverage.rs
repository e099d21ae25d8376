//! How often the 90 % intervals of `calibrate pulls` hold the truth: campaigns of a lab of its own, line by line.
//!
//!     cargo xtask research coverage [CAMPAIGNS] [LINE...]
//!
//! `FROM=5000` begins with campaign 5000: constants of the method were chosen on the first hundred, so they are no test of it.
//! `VERBOSE=1` prints every campaign.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use crate::lab::{Contact, Plan, World, campaign};
use crate::{StudyResult, arguments};
use gripgen::in_parallel;
use gripgen::twin::Twin;
use gripgen::twin::config::Feedback;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::{Library, Location, load_twin_document};
use gripgen_cli::calibrate_twin;
use gripgen_identify::ParameterEstimate;
use gripgen_identify::pulls::calibrate::CalibrateRequest;
use std::collections::BTreeMap;
use std::sync::Mutex;

/// A line of the table.
struct Line {
    name: &'static str,
    trace_every: usize,
    kinetic: Option<f64>,
    lag_s: Option<f64>,
    scatter: Option<f64>,
    contact: Contact,
    law: bool,
    feedback: Feedback,
}

const PLAIN: Line = Line {
    name: "",
    trace_every: 2,
    kinetic: None,
    lag_s: None,
    scatter: None,
    contact: Contact::Flat,
    law: false,
    feedback: Feedback::Independent,
};

fn lines() -> Vec<Line> {
    vec![
        Line { name: "traces", ..PLAIN },
        Line { name: "traces-kinetic1", kinetic: Some(1.0), ..PLAIN },
        Line { name: "traces-kinetic0.9", kinetic: Some(0.9), ..PLAIN },
        Line { name: "traces-lag0", lag_s: Some(0.0), ..PLAIN },
        Line { name: "traces-scatter0", scatter: Some(0.0), ..PLAIN },
        Line { name: "mindlin", contact: Contact::Mindlin, ..PLAIN },
        Line { name: "mindlin-kinetic1", contact: Contact::Mindlin, kinetic: Some(1.0), ..PLAIN },
        Line { name: "traces-law", law: true, ..PLAIN },
        Line { name: "traces-measured", feedback: Feedback::Measured, ..PLAIN },
        Line { name: "labels", trace_every: 0, ..PLAIN },
        Line { name: "labels-kinetic1", trace_every: 0, kinetic: Some(1.0), ..PLAIN },
        Line { name: "labels-scatter0", trace_every: 0, scatter: Some(0.0), ..PLAIN },
        Line { name: "labels-lag0", trace_every: 0, lag_s: Some(0.0), ..PLAIN },
        Line { name: "labels-law", trace_every: 0, law: true, ..PLAIN },
    ]
}

/// The truth of campaign `index` of a line, drawn from the range that the fits assume.
fn world(line: &Line, index: u64) -> World {
    let mut draw = Stream::new(77, index, Purpose::Draw);
    let mut uniform = |low: f64, high: f64| low + (high - low) * draw.uniform();
    let mu = (0..2).map(|_| uniform(0.12, 0.3)).collect();
    let (noise, damping, stiffness) = (uniform(0.0, 1.0), uniform(0.0, 1.0), uniform(14e3, 40e3));
    let dead_time_s = [0.0, 0.004, 0.008, 0.016, 0.030][(uniform(0.0, 5.0) as usize).min(4)];
    let traced = line.trace_every > 0;
    let (ratio, lag) = (uniform(0.84, 0.985), uniform(0.015, 0.12));
    let (scatter, a, b_n) = (uniform(0.02, 0.06), uniform(0.9, 1.3), uniform(-3.0, 3.0));
    // Without traces only what is assumed says how the loop and the kinetic branch are: they are drawn from that.
    let mut normal = Stream::new(78, index, Purpose::Draw);
    let ratio_prior = std::iter::repeat_with(|| 0.95 + 0.05 * normal.normal()).find(|r| *r <= 1.0).unwrap();
    let lag_prior = std::iter::repeat_with(|| 0.05 + 0.04 * normal.normal()).find(|l| *l >= 0.0).unwrap();
    World {
        mu,
        law: line.law.then_some((a, b_n)),
        kinetic_ratio: line.kinetic.unwrap_or(if traced { ratio } else { ratio_prior }),
        lag_s: line.lag_s.unwrap_or(if traced { lag } else { lag_prior }),
        dead_time_s: if traced { dead_time_s } else { 0.0 },
        stiffness_n_per_m: if traced { stiffness } else { 40e3 },
        damping_n_s_per_m: if traced { 80.0 * 25.0_f64.powf(damping) } else { 2000.0 },
        noise_n: if traced { 0.08 * 4.0_f64.powf(noise) } else { 0.12 },
        scatter: line.scatter.unwrap_or(scatter),
        contact: line.contact,
        feedback: line.feedback,
    }
}

/// A parameter, what is true, and what was stated.
type Row = (String, f64, ParameterEstimate);

#[derive(Default)]
struct Tally {
    errors: Vec<f64>,
    widths: Vec<f64>,
    held: usize,
    below: usize,
}

pub fn run() -> StudyResult {
    let arguments: Vec<String> = arguments().collect();
    let count: usize = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(50);
    let verbose = std::env::var_os("VERBOSE").is_some();
    let file = load_twin_document(&Location::parse("asset:configs/twin-baseline.toml"), &[]).unwrap();
    let twin = Twin::new(&file.read_twin().unwrap()).unwrap();
    let library = Library::of_twin(&twin, &Location::parse("asset:configs/twin-baseline.toml")).unwrap();
    for line in lines() {
        if arguments.len() > 1 && !arguments[1..].iter().any(|a| a == line.name) {
            continue;
        }
        let found: Mutex<BTreeMap<usize, Vec<Row>>> = Mutex::default();
        let begun = std::time::Instant::now();
        let from: usize = std::env::var("FROM").ok().and_then(|f| f.parse().ok()).unwrap_or(0);
        in_parallel(count, 2, |index| {
            let index = index + from;
            let world = world(&line, index as u64);
            let plan = Plan {
                pulls: 48,
                trace_every: line.trace_every,
                grip_force_n: vec![20.0, 30.0, 40.0, 60.0, 80.0],
                increment_n: vec![0.5, 1.0],
            };
            let measured = campaign(&world, &plan, 1000 + index as u64);
            let request = CalibrateRequest { offset_law: line.law, ..CalibrateRequest::default() };
            let Ok((fit, _)) = calibrate_twin(&measured, &twin, &library, &request, 1) else { return };
            let mut rows: Vec<Row> = Vec::new();
            let mut note = |name: &str, key: &str, truth: f64| {
                if let Some(p) = fit.baseline.get(key) {
                    rows.push((name.into(), truth, p.clone()));
                }
            };
            if !line.law {
                note("mu", "parts.gear.mu", world.mu[0]);
                note("mu", "parts.long_shaft.mu", world.mu[1]);
            }
            note("kinetic ratio", "kinetic_ratio", world.kinetic_ratio);
            note("lag", "robot.lag_s", world.lag_s);
            note("scatter", "scatter", world.scatter);
            for law in &fit.laws {
                let (a, b_n) = world.law.unwrap();
                let part = usize::from(law.part == "long_shaft");
                let factor = world.mu[part] / twin.parts[&law.part].mu;
                rows.push(("a".into(), a * factor, law.a.clone()));
                rows.push(("b".into(), b_n * factor, law.b_n.clone()));
            }
            if verbose {
                println!("{index} {world:?}");
                for (name, truth, p) in &rows {
                    let hit = if p.low90 <= *truth && *truth <= p.high90 { "" } else { "MISS" };
                    println!(
                        "   {name} {truth:.5} est {:.5} [{:.5}, {:.5}] {hit}",
                        p.value, p.low90, p.high90
                    );
                }
                println!(
                    "   k {:?} d {:?} T {:?}",
                    fit.model.stiffness_n_per_m, fit.model.damping_n_s_per_m, fit.model.dead_time_s
                );
            }
            found.lock().unwrap().insert(index, rows);
        });
        let mut table: BTreeMap<String, Tally> = BTreeMap::new();
        for (name, truth, p) in found.into_inner().unwrap().into_values().flatten() {
            let t = table.entry(name.clone()).or_default();
            // Of mu and a in parts of the truth, of the others in their unit.
            let unit = if name == "mu" || name == "a" { truth } else { 1.0 };
            t.errors.push((p.value - truth) / unit);
            t.widths.push((p.high90 - p.low90) / unit);
            let slack = 1e-9;
            t.held += usize::from(p.low90 <= truth + slack && truth <= p.high90 + slack);
            t.below += usize::from(p.high90 < truth - slack);
        }
        println!("{} ({:.0} s)", line.name, begun.elapsed().as_secs_f64());
        for (name, t) in table {
            let n = t.errors.len();
            let mean = t.errors.iter().sum::<f64>() / n as f64;
            let sd = (t.errors.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / n as f64).sqrt();
            let median = |mut x: Vec<f64>| {
                x.sort_by(f64::total_cmp);
                x[x.len() / 2]
            };
            let width = median(t.widths);
            println!(
                "  {name:14} held {:.3} of {n}, too low {:.3}; median width {width:.5}, bias {mean:+.5}, sd {sd:.5}, width/3.29sd {:.2}",
                t.held as f64 / n as f64,
                t.below as f64 / n as f64,
                width / (3.29 * sd),
            );
        }
    }
    Ok(())
}
