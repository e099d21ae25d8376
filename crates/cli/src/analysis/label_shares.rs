//! What the labels of a sweep depend on: shares of their variance.

use gripgen::tactile::SimdLevel;
use gripgen::{Project, SimulateOptions, in_parallel, simulate};
use gripgen_identify::{closed_share, total_share};
use gripgen_twin::config::{DesignFile, Mechanics};
use gripgen_twin::draw::Drawn;
use gripgen_twin::effects::{Group, find};
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Outcome, Sweep};
use serde_json::{Value, json};
use std::collections::BTreeMap;
use std::fmt;

/// Samples whose draws are compared. The standard error of a share is 0.09 at most.
const SAMPLES: u64 = 128;

/// What is drawn, in the order in which a predictor comes to know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The grip force.
    Force,
    /// Which part.
    Part,
    /// In which of its grips, where and how it is held and pulled.
    Pose,
    /// The rest of what the cameras see: how gels and jaws press.
    Contact,
    /// What they do not see: friction, sensor and robot of rig, gel and session.
    Hidden,
    /// What differs between repetitions of one grip.
    Repetition,
}

impl Source {
    /// All, in order.
    pub const ALL: [Source; 6] =
        [Source::Force, Source::Part, Source::Pose, Source::Contact, Source::Hidden, Source::Repetition];

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Source::Force => "grip force",
            Source::Part => "part",
            Source::Pose => "pose",
            Source::Contact => "rest of the contact",
            Source::Hidden => "rig, gel and session",
            Source::Repetition => "repetition",
        }
    }

    /// Its name in JSON.
    pub fn key(self) -> &'static str {
        match self {
            Source::Force => "grip_force",
            Source::Part => "part",
            Source::Pose => "pose",
            Source::Contact => "contact",
            Source::Hidden => "rig_gel_session",
            Source::Repetition => "repetition",
        }
    }

    /// What a key of `[vary]` belongs to.
    fn of(key: &str) -> Source {
        match key {
            "grip_force_n" => return Source::Force,
            "part" => return Source::Part,
            "grip_pose" | "grip_offset_mm" | "grip_angle_deg" | "pull_direction" => return Source::Pose,
            _ => {}
        }
        let effect = key.strip_prefix("effects.").and_then(|rest| find(rest.split('.').next()?));
        let presses = effect.is_some_and(|spec| spec.group == Group::Jaws);
        if presses || key.starts_with("gel.") || key.ends_with("imprint_mm3_per_n") {
            return Source::Contact;
        }
        Source::Hidden
    }
}

/// Shares of the variance of the labels.
#[derive(Debug, Clone, PartialEq)]
pub struct LabelShares {
    /// What each source adds to those before it. They sum to 1.
    pub shares: Vec<(Source, f64)>,
    /// Largest standard error of a share.
    pub error: f64,
    /// Share that goes when pose and contact are known in addition to all else: the most that images can show, of a part that is known.
    pub seen: f64,
    /// Pairs of pulls that slipped, of those that were made for the last source.
    pub pairs: usize,
}

impl LabelShares {
    /// As `check --json` and `info --json` print them.
    pub fn json(&self) -> Value {
        let of: serde_json::Map<String, Value> =
            self.shares.iter().map(|(source, share)| (source.key().into(), json!(share))).collect();
        json!({"shares": of, "error": self.error, "seen": self.seen, "pulls": self.pairs})
    }
}

/// Label of a sample with draws of its own, if it slipped.
fn label_n(project: &Project, index: u64, drawn: &BTreeMap<String, Drawn>) -> Option<f64> {
    let twin = Sweep::twin_of_drawn(drawn, &project.twin_table).ok()?;
    let (scenario, usable) = project.sweep.scenario_of(drawn.clone(), index, &twin);
    usable.ok()?;
    let level = SimdLevel::best();
    // Both mechanics slip at the same force.
    let mechanics = Mechanics::Reduced;
    let options = SimulateOptions {
        mechanics,
        images: false,
        trace: false,
        ..SimulateOptions::of(&project.sweep, level)
    };
    match simulate(&twin, &project.library, &scenario, options, None).ok()? {
        Outcome::Pulled(pulled) if !pulled.label.censored => Some(pulled.label.max_pull_force_n),
        _ => None,
    }
}

impl fmt::Display for LabelShares {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let percent = |share: f64| (100.0 * share).round();
        let of: Vec<String> = self
            .shares
            .iter()
            .map(|(source, share)| format!("{} {} %", source.name(), percent(*share)))
            .collect();
        write!(
            f,
            "label variance: {} (+- {} %); images can show at most {} %",
            of.join(", "),
            percent(self.error),
            percent(self.seen)
        )
    }
}

/// The samples that are compared, at random: neighbours in a grid or among repetitions are alike. A sweep that draws may have more
/// samples than it asks for.
fn compared(sweep: &Sweep, number: u64) -> u64 {
    let most = if sweep.design == DesignFile::Grid { sweep.samples } else { sweep.samples.max(2 * SAMPLES) };
    (Stream::new(sweep.seed, number, Purpose::Compared).uniform() * most as f64) as u64
}

/// Shares for a sweep, by simulating some of its labels again with a part of their draws exchanged. `None` where too few slip.
pub fn label_shares(project: &Project, jobs: usize) -> Option<LabelShares> {
    // The label of sample `at` with what `taken` says from `from`.
    let mixed = |at: u64, from: u64, taken: &dyn Fn(Source) -> bool| {
        let mut drawn = project.sweep.drawn(at);
        drawn.extend(project.sweep.drawn(from).into_iter().filter(|(key, _)| taken(Source::of(key))));
        label_n(project, at, &drawn)
    };
    let all = |label: &(dyn Fn(u64, u64) -> Option<f64> + Sync)| {
        let at = |number: usize| compared(&project.sweep, number as u64);
        in_parallel(SAMPLES as usize, jobs, |i| label(at(2 * i), at(2 * i + 1)))
    };
    let pairs = |a: &[Option<f64>], b: &[Option<f64>]| -> Vec<(f64, f64)> {
        a.iter().zip(b).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect()
    };
    let own = all(&|own, _| mixed(own, own, &|_| false));
    let is_seen = |source| matches!(source, Source::Pose | Source::Contact);
    let moved = all(&|own, other| mixed(own, other, &is_seen));
    let seen = total_share(&pairs(&own, &moved))?;
    let mut last = (0.0, 0.0_f64, 0);
    let mut shares = Vec::new();
    for source in &Source::ALL[..5] {
        let shared = all(&|own, other| mixed(other, own, &|of| of <= *source));
        let pairs = pairs(&own, &shared);
        let (share, error) = closed_share(&pairs)?;
        // Estimates of shares that contain each other need not.
        let share = share.max(last.0);
        shares.push((*source, share - last.0));
        last = (share, last.1.max(error), pairs.len());
    }
    shares.push((Source::Repetition, 1.0 - last.0));
    Some(LabelShares { shares, error: last.1, seen, pairs: last.2 })
}
