//! The posterior of few pulls beside a reference: Markov chains on the density that its draws are draws of.
//!
//!     cargo xtask research few-pulls-reference 40 [LINE...]
//!
//! A truth is drawn from the beliefs and gives pulls, as in `few-pulls-ranks`. Of both posteriors the logarithm of the density of mu (a of the law) at the
//! truth is taken, by the same kernel: how much is lost on average is what points, grids and 40 draws on each cost beside a chain that walks freely.
//! Means and 90 % intervals are compared too, over the deviation of the chain.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use crate::StudyResult;
use crate::truth::{Given, PART, Truth, asked};
use gripgen::in_parallel;
use gripgen::twin::random::{Purpose, Stream};
use gripgen_cli::{calibrate_twin, with_few_density};
use gripgen_identify::pulls::calibrate::CalibrateRequest;
use gripgen_identify::pulls::few::FewDensity;
use gripgen_identify::pulls::priors::PullPriors;
use std::sync::Mutex;

/// Steps of a chain, of which the first third adapts its step and is left out.
const STEPS: usize = 9000;

/// Values with weights.
type Weighted = Vec<(f64, f64)>;

/// A random walk (Metropolis et al. 1953) whose step takes the spread of what it saw, scaled for one acceptance in four (Haario, Saksman and Tamminen
/// 2001, of single variables here). Mu along it.
fn chain(density: &FewDensity<'_>, priors: &PullPriors, index: u64) -> Weighted {
    let n = density.dimensions();
    let mut draw = Stream::new(1953, index, Purpose::Draw);
    let mut at = vec![0.0; n];
    let mut log = density.log_at(&at);
    let (mut sum, mut square, mut size) = (vec![0.0; n], vec![0.0; n], 0.8);
    let mut spread = vec![0.5; n];
    let mut found = Vec::new();
    for step in 0..STEPS {
        // One variable after the other, and all at once.
        let only = step % (n + 1);
        let tried: Vec<f64> = (0..n)
            .map(|k| {
                let wide = if only == n { size / (n as f64).sqrt() } else { 2.0 };
                if only == n || only == k { at[k] + wide * spread[k] * draw.normal() } else { at[k] }
            })
            .collect();
        let other = density.log_at(&tried);
        let accepted = draw.uniform().ln() < other - log;
        if accepted {
            (at, log) = (tried, other);
        }
        if step < STEPS / 3 {
            if only == n {
                size *= if accepted { 1.03 } else { 0.99 };
            }
            for k in 0..n {
                sum[k] += at[k];
                square[k] += at[k] * at[k];
                let count = step as f64 + 1.0;
                let variance = square[k] / count - (sum[k] / count).powi(2);
                if step > 300 {
                    spread[k] = variance.max(1e-4).sqrt();
                }
            }
        } else {
            found.push((priors.mu.at(at[0]), 1.0));
        }
    }
    found
}

fn moments(values: &Weighted) -> (f64, f64) {
    let weight: f64 = values.iter().map(|v| v.1).sum();
    let mean = values.iter().map(|v| v.0 * v.1).sum::<f64>() / weight;
    (mean, (values.iter().map(|v| (v.0 - mean).powi(2) * v.1).sum::<f64>() / weight).sqrt())
}

fn quantile(values: &Weighted, share: f64) -> f64 {
    let mut sorted = values.clone();
    sorted.sort_by(|a, b| a.0.total_cmp(&b.0));
    let total: f64 = sorted.iter().map(|v| v.1).sum();
    let mut sum = 0.0;
    sorted
        .iter()
        .find(|v| {
            sum += v.1;
            sum >= share * total
        })
        .unwrap()
        .0
}

/// Logarithm of the density at a value by normal kernels of one width.
fn log_density(values: &Weighted, width: f64, at: f64) -> f64 {
    let weight: f64 = values.iter().map(|v| v.1).sum();
    let sum: f64 = values.iter().map(|v| v.1 * (-0.5 * ((v.0 - at) / width).powi(2)).exp()).sum();
    (sum / weight / (width * std::f64::consts::TAU.sqrt())).max(1e-30).ln()
}

pub fn run() -> StudyResult {
    let (count, lines) = asked(40);
    let Given { twin, library, priors } = Given::shipped();
    let given = twin.parts[PART].mu;
    for (name, forces_n, law) in lines {
        let found: Mutex<Vec<[f64; 4]>> = Mutex::default();
        in_parallel(count, 2, |k| {
            let index = 70_000 + k as u64;
            let truth = Truth::draw(&priors, law, index);
            let Some(measured) = truth.pulls(forces_n, index) else { return };
            let request = CalibrateRequest {
                offset_law: law,
                priors: Some(priors.clone()),
                ..CalibrateRequest::default()
            };
            let (fit, _) = calibrate_twin(&measured, &twin, &library, &request, 1).unwrap();
            let (key, of) = match law {
                true => (format!("effects.load_offset.{PART}.a"), given),
                false => (format!("parts.{PART}.mu"), 1.0),
            };
            let at = fit.posterior.keys.iter().position(|k| *k == key).unwrap();
            let ours: Weighted =
                fit.posterior.draws.iter().map(|d| (of * d.values[at].unwrap(), d.weight)).collect();
            let walked = with_few_density(&measured, &twin, &library, &priors, law, |density| {
                chain(density, &priors, index)
            });
            let walked = walked.unwrap().unwrap();
            let (mean, sd) = moments(&walked);
            let width = 0.25 * sd;
            found.lock().unwrap().push([
                log_density(&ours, width, truth.mu) - log_density(&walked, width, truth.mu),
                (moments(&ours).0 - mean) / sd,
                moments(&ours).1 / sd,
                (quantile(&ours, 0.95) - quantile(&ours, 0.05))
                    / (quantile(&walked, 0.95) - quantile(&walked, 0.05)),
            ]);
        });
        let found = found.into_inner().unwrap();
        let n = found.len() as f64;
        let of = |k: usize| {
            let values: Weighted = found.iter().map(|f| (f[k], 1.0)).collect();
            let (mean, sd) = moments(&values);
            format!("{mean:+.3} +- {:.3} (each {sd:.3})", sd / n.sqrt())
        };
        println!(
            "{name}: {n} campaigns. ours over the chain: log score {} nat, mean {} of its deviations, deviation {} times, interval {} times",
            of(0),
            of(1),
            of(2),
            of(3)
        );
    }
    Ok(())
}
