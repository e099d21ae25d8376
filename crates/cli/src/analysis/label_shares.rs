//! What the labels of a sweep depend on: shares of their variance.

use gripgen::tactile::SimdLevel;
use gripgen::{Project, SimulateOptions, in_parallel, simulate};
use gripgen_identify::closed_share;
use gripgen_twin::config::Mechanics;
use gripgen_twin::draw::Drawn;
use gripgen_twin::effects::{Group, find};
use gripgen_twin::{Outcome, Sweep};
use std::collections::BTreeMap;
use std::fmt;

/// Samples whose draws are compared. The standard error of a share is 0.06 at most.
const SAMPLES: u64 = 256;

/// What is drawn, in the order in which a predictor comes to know it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Source {
    /// The grip force.
    Force,
    /// Which part, and which of its grips.
    Part,
    /// Where and how it is gripped and pulled.
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
            "part" | "grip_pose" => return Source::Part,
            "grip_offset_mm" | "grip_angle_deg" | "pull_direction" => return Source::Pose,
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
    /// Standard deviation of the labels in newtons.
    pub sd_n: f64,
    /// Pairs of pulls that slipped, of those that were made for the last source.
    pub pairs: usize,
}

impl LabelShares {
    /// The share of a source.
    pub fn of(&self, source: Source) -> f64 {
        self.shares.iter().find(|(s, _)| *s == source).map_or(0.0, |(_, share)| *share)
    }

    /// The share of what cameras see beyond grip force and part.
    pub fn seen(&self) -> f64 {
        self.of(Source::Pose) + self.of(Source::Contact)
    }
}

/// Label of a sample with draws of its own, if it slipped.
fn label_n(project: &Project, index: u64, drawn: &BTreeMap<String, Drawn>) -> Option<f64> {
    let twin = Sweep::twin_of_drawn(drawn, project.twin_table.clone()).ok()?;
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
        write!(f, "label variance: {} (+- {} %)", of.join(", "), percent(self.error))?;
        let left = 1.0 - self.of(Source::Force) - self.of(Source::Part);
        match left > 0.01 {
            true => write!(
                f,
                "; of what force and part leave, images see at most {} %",
                percent(self.seen() / left)
            ),
            false => Ok(()),
        }
    }
}

/// Shares for a sweep, by simulating some of its labels again with a part of their draws exchanged. `None` where too few slip.
pub fn label_shares(project: &Project, jobs: usize) -> Option<LabelShares> {
    let of = |i: usize, known: Option<Source>| {
        let (own, other) = (i as u64, SAMPLES + i as u64);
        let Some(known) = known else { return label_n(project, own, &project.sweep.drawn(own)) };
        let mut drawn = project.sweep.drawn(other);
        for (key, value) in project.sweep.drawn(own) {
            if Source::of(&key) <= known {
                drawn.insert(key, value);
            }
        }
        label_n(project, other, &drawn)
    };
    let of_all = |known| in_parallel(SAMPLES as usize, jobs, |i| of(i, known));
    let own = of_all(None);
    let mut last = (0.0, 0.0_f64, 0);
    let mut shares = Vec::new();
    for source in &Source::ALL[..5] {
        let pairs: Vec<(f64, f64)> =
            own.iter().zip(of_all(Some(*source))).filter_map(|(a, b)| Some(((*a)?, b?))).collect();
        let (share, error) = closed_share(&pairs)?;
        // Estimates of shares that contain each other need not.
        let share = share.max(last.0);
        shares.push((*source, share - last.0));
        last = (share, last.1.max(error), pairs.len());
    }
    shares.push((Source::Repetition, 1.0 - last.0));
    let labels: Vec<f64> = own.iter().flatten().copied().collect();
    let mean = labels.iter().sum::<f64>() / labels.len() as f64;
    let variance = labels.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / labels.len() as f64;
    Some(LabelShares { shares, error: last.1, sd_n: libm::sqrt(variance), pairs: last.2 })
}
