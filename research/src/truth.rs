//! Campaigns of few pulls whose truth is drawn from the beliefs: what the posterior of them is a posterior of.

#![expect(clippy::unwrap_used, reason = "a measurement that cannot go on panics")]

use crate::arguments;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Campaign, MeasuredPulls, PlannedPull, Twin};
use gripgen::{Library, Location, load_twin_document};
use gripgen_cli::{shipped_priors, simulate_campaign};
use gripgen_identify::pulls::priors::PullPriors;

const TWIN: &str = "asset:configs/twin-baseline.toml";
pub const PART: &str = "gear";

/// The twin that the beliefs are about, its files, and the beliefs.
pub struct Given {
    pub twin: Twin,
    pub library: Library,
    pub priors: PullPriors,
}

impl Given {
    pub fn shipped() -> Self {
        let place = Location::parse(TWIN);
        let twin = Twin::new(&load_twin_document(&place, &[]).unwrap().read_twin().unwrap()).unwrap();
        let library = Library::of_twin(&twin, &place).unwrap();
        let priors = shipped_priors(&twin);
        Self { twin, library, priors }
    }
}

/// How many campaigns are asked for, and the lines that are named; all where none is.
pub fn asked(count: usize) -> (usize, Vec<Line>) {
    let arguments: Vec<String> = arguments().collect();
    let count = arguments.first().and_then(|a| a.parse().ok()).unwrap_or(count);
    let named = |line: &Line| arguments.len() < 2 || arguments[1..].iter().any(|a| a == line.0);
    (count, LINES.into_iter().filter(named).collect())
}

/// Share of bad pulls, and how many times as far they lie from what is expected, as the posterior takes it.
const BAD: (f64, f64) = (0.05, 8.0);

/// Name, grip forces, whether the law is asked for.
type Line = (&'static str, &'static [f64], bool);

const LINES: [Line; 3] = [
    ("one", &[40.0], false),
    ("three", &[20.0, 40.0, 80.0], false),
    ("three-law", &[20.0, 40.0, 80.0], true),
];

/// What a rig and its part are, drawn from the beliefs. `offset_n` is 0 where no law is asked for.
pub struct Truth {
    pub mu: f64,
    pub offset_n: f64,
    pub kinetic_ratio: f64,
    pub lag_s: f64,
    pub noise_n: f64,
    pub scatter: f64,
}

impl Truth {
    pub fn draw(priors: &PullPriors, law: bool, index: u64) -> Self {
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
    pub fn pulls(&self, forces_n: &[f64], index: u64) -> Option<MeasuredPulls> {
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
