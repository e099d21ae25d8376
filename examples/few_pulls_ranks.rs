//! Whether the posterior of few pulls is one: simulation-based calibration (Talts, Betancourt, Simpson, Vehtari and Gelman 2018).
//!
//!     cargo run --example few_pulls_ranks -- 1000 [LINE...]
//!
//! A truth is drawn from the beliefs, the twin that it makes gives the pulls, one in twenty of them bad, and the posterior of these is asked
//! which share of it lies below the truth. Over many campaigns these shares are even in (0, 1) if the posterior is worked out right: what is
//! tested is the computation, not the beliefs. Printed are the chi-square of ten bins with its p-value and the share of truths in the middle 90 %.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use gripgen::identify::pulls::calibrate::CalibrateRequest;
use gripgen::identify::pulls::priors::PullPriors;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Campaign, MeasuredPulls, PlannedPull, Posterior, Twin};
use gripgen::{
    Library, Location, calibrate_twin, in_parallel, load_twin_document, shipped_priors, simulate_campaign,
};
use std::sync::Mutex;

const TWIN: &str = "asset:configs/twin-baseline.toml";
const PART: &str = "gear";
const BINS: usize = 10;
/// Share of bad pulls, and how many times as far they lie from what is expected, as the posterior takes it.
const BAD: (f64, f64) = (0.05, 8.0);

/// Name, grip forces, whether the law is asked for.
const LINES: [(&str, &[f64], bool); 3] = [
    ("one", &[40.0], false),
    ("three", &[20.0, 40.0, 80.0], false),
    ("three-law", &[20.0, 40.0, 80.0], true),
];

/// What a rig and its part are, drawn from the beliefs. `offset_n` is 0 where no law is asked for.
struct Truth {
    mu: f64,
    offset_n: f64,
    kinetic_ratio: f64,
    lag_s: f64,
    noise_n: f64,
    scatter: f64,
}

impl Truth {
    fn draw(priors: &PullPriors, law: bool, index: u64) -> Self {
        let mut draw = Stream::new(2018, index, Purpose::Draw);
        let mut z = || draw.normal();
        Self {
            mu: priors.mu.at(z()),
            offset_n: if law { priors.offset_n.at(z()) } else { 0.0 },
            kinetic_ratio: priors.kinetic_ratio.at(z()),
            lag_s: priors.lag_s.at(z()),
            noise_n: priors.noise_n.at(z()),
            scatter: priors.scatter.at(z()),
        }
    }

    /// Overrides of the twin; `known` leaves scatter and noise away.
    fn sets(&self, known: bool) -> Vec<(String, String)> {
        let left = if known { 0.0 } else { 1.0 };
        let sets = vec![
            (format!("parts.{PART}.mu"), self.mu),
            (format!("parts.{PART}.kinetic_ratio"), self.kinetic_ratio),
            (format!("parts.{PART}.scatter"), left * self.scatter),
            ("robot.lag_s".into(), self.lag_s),
            ("wrist.noise_n".into(), left * self.noise_n),
        ];
        let mut sets: Vec<(String, String)> =
            sets.into_iter().map(|(key, value)| (key, format!("{value}"))).collect();
        if self.offset_n != 0.0 {
            let law = format!(
                "[{{name = \"load_offset\", part = \"{PART}\", a = 1.0, b_n = {}, outside_fit = \"extrapolate\"}}]",
                self.offset_n
            );
            sets.push(("effects".into(), law));
        }
        sets
    }

    /// Its pulls; `None` where one of them fails or does not slip.
    fn pulls(&self, forces_n: &[f64], index: u64) -> Option<MeasuredPulls> {
        let planned = forces_n.iter().map(|f| PlannedPull {
            part: PART.into(),
            grip_force_n: *f,
            ..PlannedPull::default()
        });
        let campaign =
            Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls: planned.collect() };
        let make = |known| {
            let made =
                simulate_campaign(&Location::parse(TWIN), &self.sets(known), &campaign, index).unwrap().pulls;
            (made.pulls.len() == forces_n.len()).then_some(made)
        };
        let (mut measured, expected) = (make(false)?, make(true)?);
        let mut bad = Stream::new(2019, index, Purpose::Draw);
        for (pull, own) in measured.pulls.iter_mut().zip(&expected.pulls) {
            pull.trace = None;
            if bad.uniform() < BAD.0 {
                let off_n = BAD.1 * (pull.max_pull_force_n - own.max_pull_force_n);
                pull.max_pull_force_n = (own.max_pull_force_n + off_n).max(0.1);
            }
        }
        Some(measured)
    }
}

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

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let count: usize = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(1000);
    let document = load_twin_document(&Location::parse(TWIN), &[]).unwrap();
    let twin = Twin::new(&document.read_twin().unwrap()).unwrap();
    let library = Library::of_twin(&twin, &Location::parse(TWIN)).unwrap();
    let priors = shipped_priors(&twin);
    let given = twin.parts[PART].mu;
    for (name, forces_n, law) in
        LINES.iter().filter(|l| arguments.len() < 2 || arguments[1..].iter().any(|a| a == l.0))
    {
        let found: Mutex<Vec<Vec<f64>>> = Mutex::default();
        in_parallel(count, 2, |k| {
            let truth = Truth::draw(&priors, *law, k as u64);
            let Some(measured) = truth.pulls(forces_n, k as u64) else { return };
            let request = CalibrateRequest {
                offset_law: *law,
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
            if *law {
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
}
