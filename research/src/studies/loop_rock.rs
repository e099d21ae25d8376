//! The tables of research/loop/rock.md: friction of rock through a step of the sliding speed, as traces beside a Coulomb twin.
//!
//! Run with `cargo xtask research loop-rock [DATA] [OUT]`: DATA is a folder with the tables of the steps
//! (`../shared/real/rock_velocity_steps` where it is left out), OUT where tables of pulls are written, a folder for each rock. Each
//! trace is used twice. Stretches of its two plateaus become pulls at two rates, which `diagnose` is handed; and the trace around
//! the step is fitted with the library's own laws: a constant, `rate_dependence`, and that with `dwell_ageing`, whose dwell is the age of
//! the contacts. Nothing is written where the data are absent.

use crate::{StudyResult, arguments};
use gripgen::twin::effects::{GripPoint, find};
use gripgen::twin::{Covariates, Jaw, Twin};
use gripgen::{BASELINE_TWIN, Library, Location, load_twin_document};
use gripgen_cli::{PullDiagnoseOptions, diagnose_pull_table};
use gripgen_identify::{FitOptions, FreeParameter, fit};
use gripgen_measured::load_pulls;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Stretches of each plateau that become pulls.
const PULLS: usize = 20;
/// Normal force of a jaw of these pulls: what stands for the normal stress.
const GRIP_N: f64 = 30.0;
/// Pull rate that stands for a sliding speed of 1 micrometre per second, in N/s: the stiffness of a press is not known.
const RATE_N_PER_UM: f64 = 4.0;
/// The part of the twin that stands for the rock: its coefficient is refitted.
const PART: &str = "long_shaft";
/// Contiguous stretches of a trace that are held out in turn.
const FOLDS: usize = 10;
/// Rows of a trace that is fitted, at most.
const ROWS: usize = 1500;

struct Trace {
    time_s: Vec<f64>,
    travel_um: Vec<f64>,
    friction: Vec<f64>,
    speed_um_s: Vec<f64>,
    /// First row of the second speed.
    step: usize,
}

pub fn run() -> StudyResult {
    let mut words = arguments();
    let data = PathBuf::from(words.next().unwrap_or_else(|| "../shared/real/rock_velocity_steps".into()));
    let out = PathBuf::from(words.next().unwrap_or_else(|| "target/rock".into()));
    for (name, file) in
        [("sepiolite", "velstep3_TR2_exp013_sepiolite.txt"), ("basalt", "velstep4_BRAVA_expb819_basalt.txt")]
    {
        let path = data.join(file);
        if !path.is_file() {
            println!("{} is absent: nothing to do", path.display());
            continue;
        }
        let trace = read(&path)?;
        let speeds = (plateau(&trace, 0, trace.step), plateau(&trace, trace.step, trace.time_s.len()));
        println!("## {name}: {} rows, {:.2} to {:.2} um/s\n", trace.time_s.len(), speeds.0, speeds.1);
        as_pulls(&trace, speeds, &out.join(name))?;
        as_trace(&trace, speeds);
    }
    Ok(())
}

fn read(path: &Path) -> Result<Trace, Box<dyn Error>> {
    let text = std::fs::read_to_string(path)?;
    let mut trace =
        Trace { time_s: vec![], travel_um: vec![], friction: vec![], speed_um_s: vec![], step: 0 };
    for line in text.lines().skip(1) {
        let cells: Vec<f64> = line.split_whitespace().filter_map(|c| c.parse().ok()).collect();
        if let [time_s, travel_um, friction, ..] = cells[..] {
            trace.time_s.push(time_s);
            trace.travel_um.push(travel_um);
            trace.friction.push(friction);
        }
    }
    let n = trace.time_s.len();
    let half = 25.min(n / 10);
    trace.speed_um_s = (0..n)
        .map(|i| {
            let (a, b) = (i.saturating_sub(half), (i + half).min(n - 1));
            (trace.travel_um[b] - trace.travel_um[a]) / (trace.time_s[b] - trace.time_s[a])
        })
        .collect();
    let between = (trace.speed_um_s[half] * trace.speed_um_s[n - 1 - half]).sqrt();
    trace.step = (0..n).find(|&i| trace.speed_um_s[i] > between).ok_or("the speed has no step")?;
    Ok(trace)
}

/// Mean speed of the inner part of some rows.
fn plateau(trace: &Trace, from: usize, to: usize) -> f64 {
    let (a, b) = (from + (to - from) / 10, to - 1 - (to - from) / 10);
    (trace.travel_um[b] - trace.travel_um[a]) / (trace.time_s[b] - trace.time_s[a])
}

/// Stretches of both plateaus, each a pull at the rate of its speed, in turns; a fifth of the rows after the step is left out.
fn as_pulls(trace: &Trace, speeds: (f64, f64), folder: &Path) -> Result<(), Box<dyn Error>> {
    let n = trace.time_s.len();
    let mut table =
        String::from("pull_id,part,grip_force_n,max_pull_force_n,force_increment_n,step_time_s\n");
    let plateaus =
        [(0, trace.step.saturating_sub(n / 50), speeds.0), (trace.step + (n - trace.step) / 5, n, speeds.1)];
    for k in 0..PULLS {
        for (p, (from, to, speed)) in plateaus.into_iter().enumerate() {
            let (a, b) = (from + (to - from) * k / PULLS, from + (to - from) * (k + 1) / PULLS);
            let mean = trace.friction[a..b].iter().sum::<f64>() / (b - a).max(1) as f64;
            let step_s = 1.0 / (RATE_N_PER_UM * speed);
            let _ = writeln!(table, "{p}-{k},{PART},{GRIP_N},{:.5},1,{step_s:.5}", 2.0 * mean * GRIP_N);
        }
    }
    std::fs::create_dir_all(folder)?;
    std::fs::write(folder.join("pulls.csv"), table)?;
    let at = Location::parse(BASELINE_TWIN);
    let twin = Twin::new(&load_twin_document(&at, &[])?.read_twin()?)?;
    let library = Library::of_twin(&twin, &at)?;
    let measured = load_pulls(folder)?;
    let options = PullDiagnoseOptions { jobs: 1, ..PullDiagnoseOptions::default() };
    let found = diagnose_pull_table(&measured.pulls, &twin, &library, &options, &|_| {})?.diagnosis;
    println!("{} pulls at two rates: {:?}", 2 * PULLS, found.verdict);
    for e in &found.effects {
        let values: Vec<String> = e
            .parameters
            .iter()
            .map(|(name, p)| format!("{name} = {:.4} ({:.4} to {:.4})", p.value, p.low90, p.high90))
            .collect();
        let rivals: Vec<&str> = e.indistinguishable_from.iter().map(|r| r.name.as_str()).collect();
        println!("  {} (weight {:.2}) {}; tied with {rivals:?}", e.name, e.weight, values.join(", "));
    }
    for hint in &found.hints {
        println!("  hint: {}: {}", hint.name, hint.reason);
    }
    if let Some(error) = &found.error {
        let rmse = |e: &gripgen_identify::HeldOutError| e.rmse_n.unwrap_or(f64::NAN) / (2.0 * GRIP_N);
        println!(
            "  held-out error of the coefficient: {:.5} -> {:.5}",
            rmse(&error.before),
            rmse(&error.after)
        );
    }
    Ok(())
}

/// What a law predicts of a trace.
#[derive(Clone, Copy, PartialEq)]
enum Law {
    Coulomb,
    Rate,
    RateAndState,
}

/// Predicted coefficients: `mu`, `k`, `beta`, and the logarithm of the distance over which contacts are renewed, in micrometres.
fn predict(trace: &Trace, rows: &[usize], law: Law, reference_um_s: f64, values: &[f64]) -> Vec<f64> {
    let (rate, ageing) = (find("rate_dependence"), find("dwell_ageing"));
    let hooks = rate.and_then(|s| s.friction).zip(ageing.and_then(|s| s.friction));
    let (rate, ageing) = hooks.expect("both are laws of friction");
    let renewed_um = libm::exp(values[3]);
    // Much shorter than any age, so that the logarithm is the one of a rate-and-state law.
    let young_s = 1e-3 * renewed_um / 10.0;
    let mut age_s = renewed_um / trace.speed_um_s[rows[0]].max(1e-6);
    let mut before_s = trace.time_s[rows[0]];
    let of = |&i: &usize| {
        let speed = trace.speed_um_s[i].max(1e-6);
        // Dieterich's ageing law: d age/dt = 1 - age speed / renewed, exact while the speed stands still.
        let steady_s = renewed_um / speed;
        age_s = steady_s + (age_s - steady_s) * libm::exp(-(trace.time_s[i] - before_s) / steady_s);
        before_s = trace.time_s[i];
        let covariates = Covariates { dwell_s: age_s, ..Default::default() };
        let at = GripPoint {
            jaw: Jaw::Left,
            grip_force_n: GRIP_N,
            contact_area_m2: 0.0,
            pull_rate_n_per_s: RATE_N_PER_UM * speed,
            covariates: &covariates,
            grip: (0, 0),
        };
        let mut mu = values[0];
        if law != Law::Coulomb {
            mu = rate(&[values[1], RATE_N_PER_UM * reference_um_s], mu, &at);
        }
        if law == Law::RateAndState {
            let steady = Covariates { dwell_s: renewed_um / reference_um_s, ..Default::default() };
            let aged = ageing(&[values[2], young_s], 1.0, &at);
            mu *= aged / ageing(&[values[2], young_s], 1.0, &GripPoint { covariates: &steady, ..at });
        }
        mu
    };
    rows.iter().map(of).collect()
}

fn as_trace(trace: &Trace, speeds: (f64, f64)) {
    // As far after the step as before it, at least 400 micrometres of the faster speed.
    let after = trace.time_s.iter().rposition(|t| *t < trace.time_s[trace.step] + 400.0 / speeds.1);
    let last = after.unwrap_or(trace.time_s.len() - 1);
    let first = trace.step.saturating_sub(last - trace.step);
    let thin = ((last - first) / ROWS).max(1);
    let rows: Vec<usize> = (first..=last).step_by(thin).collect();
    let fold = |k: usize| k * FOLDS / rows.len();
    println!("{} rows around the step, in {FOLDS} stretches, each held out:", rows.len());
    for (law, name) in [
        (Law::Coulomb, "Coulomb"),
        (Law::Rate, "rate_dependence"),
        (Law::RateAndState, "rate_dependence with the age of contacts"),
    ] {
        let free =
            |name: &str, start, bounds, scale| FreeParameter { name: name.into(), start, bounds, scale };
        let parameters = [
            free("mu", 0.5, (0.0, 2.0), 0.01),
            free("k", 0.01, (-0.1, 0.3), 0.01),
            free("beta", 0.01, (0.0, 0.2), 0.01),
            free("ln renewed_um", 3.0, (-1.0, 6.0), 0.5),
        ];
        let fitted = |used: &dyn Fn(usize) -> bool| {
            let best = [0.5, 2.5, 4.0].map(|start| {
                let mut parameters = parameters.clone();
                parameters[3].start = start;
                fit(&parameters, FitOptions::default(), |values| {
                    let predicted = predict(trace, &rows, law, speeds.0, values);
                    (0..rows.len())
                        .filter(|&k| used(k))
                        .map(|k| trace.friction[rows[k]] - predicted[k])
                        .collect()
                })
            });
            let found = best.into_iter().flatten().min_by(|a, b| a.cost.total_cmp(&b.cost));
            found.map_or_else(|| vec![f64::NAN; 4], |f| f.values)
        };
        let mut square = 0.0;
        for held in 0..FOLDS {
            let values = fitted(&|k| fold(k) != held);
            let predicted = predict(trace, &rows, law, speeds.0, &values);
            let left = |k: usize| (trace.friction[rows[k]] - predicted[k]).powi(2);
            square += (0..rows.len()).filter(|&k| fold(k) == held).map(left).sum::<f64>();
        }
        let all = fitted(&|_| true);
        let [mu, k, beta, renewed] = all[..] else { continue };
        println!(
            "  {name}: {:.5}   mu {mu:.4}, k {k:.4}, beta {beta:.4}, renewed over {:.2} um",
            (square / rows.len() as f64).sqrt(),
            libm::exp(renewed)
        );
    }
    println!();
}
