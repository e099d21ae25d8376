//! Whether the posterior of few pulls is one: simulation-based calibration (Talts, Betancourt, Simpson, Vehtari and Gelman 2018).
//!
//!     cargo xtask research few-pulls-ranks 1000 [LINE...]
//!
//! A truth is drawn from the beliefs, the twin that it makes gives the pulls, one in twenty of them bad, and the posterior of these is asked
//! which share of it lies below the truth. Over many campaigns these shares are even in (0, 1) if the posterior is worked out right: what is
//! tested is the computation, not the beliefs. Printed are the chi-square of ten bins with its p-value and the share of truths in the middle 90 %.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use crate::StudyResult;
use crate::truth::{Given, PART, Truth, asked};
use gripgen::in_parallel;
use gripgen::twin::Posterior;
use gripgen_cli::calibrate_twin;
use gripgen_identify::pulls::calibrate::CalibrateRequest;
use std::sync::Mutex;

const BINS: usize = 10;

/// A value of a draw by its key, and a quantity of such values.
type Draw<'a> = dyn Fn(&str) -> f64 + 'a;
type Quantity<'a> = dyn Fn(&Draw<'_>) -> f64 + 'a;

/// Share of the posterior below a value; half of what equals it.
fn share_below(posterior: &Posterior, of: &Quantity<'_>, truth: f64) -> f64 {
    let share = posterior.draws.iter().map(|draw| {
        let value = of(&|key: &str| {
            let at = posterior.keys.iter().position(|k| k == key).unwrap();
            draw.values[at].unwrap()
        });
        let below = if value < truth {
            1.0
        } else if value > truth {
            0.0
        } else {
            0.5
        };
        draw.weight * below
    });
    share.sum()
}

/// Upper tail of chi-square with nine degrees of freedom (Abramowitz and Stegun 26.4.4).
fn p_of_nine(x: f64) -> f64 {
    let root = x.sqrt();
    let series = root + root.powi(3) / 3.0 + root.powi(5) / 15.0 + root.powi(7) / 105.0;
    libm::erfc(root * std::f64::consts::FRAC_1_SQRT_2)
        + 2.0 * (-0.5 * x).exp() / std::f64::consts::TAU.sqrt() * series
}

pub fn run() -> StudyResult {
    let (count, lines) = asked(1000);
    let Given { twin, library, priors } = Given::shipped();
    let given = twin.parts[PART].mu;
    for (name, forces_n, law) in lines {
        let found: Mutex<Vec<Vec<f64>>> = Mutex::default();
        in_parallel(count, 2, |k| {
            let truth = Truth::draw(&priors, law, k as u64);
            let Some(measured) = truth.pulls(forces_n, k as u64) else { return };
            let request = CalibrateRequest {
                offset_law: law,
                priors: Some(priors.clone()),
                ..CalibrateRequest::default()
            };
            let (fit, _) = calibrate_twin(&measured, &twin, &library, &request, 1).unwrap();
            let a = |of: &Draw<'_>| match law {
                true => given * of(&format!("effects.load_offset.{PART}.a")),
                false => of(&format!("parts.{PART}.mu")),
            };
            let b = |of: &Draw<'_>| given * of(&format!("effects.load_offset.{PART}.b_n"));
            let mut shares = vec![share_below(&fit.posterior, &a, truth.mu)];
            if law {
                shares.push(share_below(&fit.posterior, &b, truth.mu * truth.offset_n));
            }
            let rig = [
                (format!("parts.{PART}.kinetic_ratio"), truth.kinetic_ratio),
                ("robot.lag_s".into(), truth.lag_s),
                ("wrist.noise_n".into(), truth.noise_n),
                (format!("parts.{PART}.scatter"), truth.scatter),
            ];
            shares.extend(rig.iter().map(|(key, value)| share_below(&fit.posterior, &|of| of(key), *value)));
            found.lock().unwrap().push(shares);
        });
        let found = found.into_inner().unwrap();
        let n = found.len() as f64;
        let mut names = vec!["mu"];
        names.extend(law.then_some("mu b"));
        names.extend(["kinetic_ratio", "lag_s", "noise_n", "scatter"]);
        println!("{name}: {n} of {count} campaigns slip");
        for (at, name) in names.iter().enumerate() {
            let mut bins = [0.0; BINS];
            found.iter().for_each(|s| bins[((s[at] * BINS as f64) as usize).min(BINS - 1)] += 1.0);
            let expected = n / BINS as f64;
            let chi2: f64 = bins.iter().map(|b| (b - expected).powi(2) / expected).sum();
            let held = found.iter().filter(|s| (0.05..=0.95).contains(&s[at])).count() as f64 / n;
            println!(
                "  {name:14} chi2 {chi2:6.1} p {:.3}  in 90 % {held:.3}  bins {bins:?}",
                p_of_nine(chi2)
            );
        }
    }
    Ok(())
}
