//! The label check: whether what was recorded of a pull agrees with its label.
//!
//! One pure function, [`check_label`], for pulls that were simulated, imported or made on a rig. It looks only at evidence that
//! is there; what is missing is no reason. A difference counts where it is larger than both the noise explains and a
//! label may be off ([`cap_n`]).

mod cross_axis;
mod follow;
mod rule;
mod signal;
mod slip;
#[cfg(test)]
mod tests;
mod zero;

pub use cross_axis::{GripForceEvidence, WrenchRow};
pub use zero::ZERO_SHIFT;

use crate::{PullTrace, Scenario, SlipLabel, Twin};
use signal::Signal;
use std::fmt;

/// A label may be off by this much before anything is a reason, N: the least of UR's precision and of the label rule that
/// can be asked for.
const CAP_N: f64 = 0.5;

/// The same as a share of the label.
const CAP_SHARE: f64 = 0.05;

/// Standard deviations that chance explains: some ten comparisons per pull, and less than one false alarm in 10000 pulls.
const SIGMAS: f64 = 4.5;

/// By how much a label of this size may be off, N.
pub fn cap_n(label_n: f64) -> f64 {
    CAP_N.max(CAP_SHARE * label_n.abs())
}

/// By how much the zero of its readings may be off: less, because noise and rule have their share.
fn zero_cap_n(label_n: f64) -> f64 {
    0.6 * cap_n(label_n)
}

/// What was recorded of a pull.
#[derive(Debug, Clone, Copy)]
pub struct LabelEvidence<'a> {
    /// The label.
    pub label_n: f64,
    /// It is a lower bound.
    pub censored: bool,
    /// Tolerance of the label rule.
    pub tolerance_n: f64,
    /// Displacement stop.
    pub stop_m: f64,
    /// The force over time; rows before 0 are the reading without a load.
    pub trace: Option<&'a PullTrace>,
    /// The trace holds every reading that the label was chosen from; otherwise the label may lie between its rows.
    pub every_reading: bool,
    /// Readings without a load after the pull, along the pull.
    pub no_load_after_n: &'a [f64],
    /// What the gripper said of its force.
    pub grip_force: Option<GripForceEvidence>,
    /// Forces across the pull and torques, row by row.
    pub wrench: &'a [WrenchRow],
}

impl<'a> LabelEvidence<'a> {
    /// A label with its trace and nothing else.
    pub fn of_trace(label_n: f64, tolerance_n: f64, stop_m: f64, trace: Option<&'a PullTrace>) -> Self {
        Self {
            label_n,
            censored: false,
            tolerance_n,
            stop_m,
            trace,
            every_reading: false,
            no_load_after_n: &[],
            grip_force: None,
            wrench: &[],
        }
    }
}

/// What is known of the rig beforehand. The default knows nothing: noise and time constant are estimated from the trace.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Expected {
    /// Noise of a reading.
    pub noise_n: Option<f64>,
    /// Time constant and dead time of the force loop together.
    pub lag_s: Option<f64>,
    /// The twin has effects on its sensor or its command, a tool that creeps and so stays behind its command, or a loop so slow
    /// that the label rule may fire before the slip: what they do to a trace is predicted, and no reason. Only label and trace
    /// have to agree then.
    pub own_effects: bool,
}

impl Expected {
    /// What a twin says of a pull that it simulates.
    pub fn of(twin: &Twin, scenario: &Scenario) -> Self {
        let acts = |e: &&crate::effects::Effect| e.acts_on(&scenario.part);
        let shapes_trace = |e: &crate::effects::Effect| {
            e.spec.sensor.is_some() || e.spec.command.is_some() || e.spec.creep.is_some()
        };
        let pull = &scenario.pull;
        let lag_s = twin.robot.lag_s + twin.robot.dead_time_s;
        // Gels that give way let the arm move, which takes its damping over their stiffness.
        let stiffness_n_per_m =
            twin.gel.left.shear_stiffness_n_per_m + twin.gel.right.shear_stiffness_n_per_m;
        let trails_s = lag_s + twin.robot.damping_n_s_per_m / stiffness_n_per_m;
        let trails_n = pull.increment_n / pull.step_s * trails_s;
        Self {
            noise_n: Some(twin.wrist.noise_n),
            lag_s: Some(lag_s),
            own_effects: twin.effects.iter().filter(acts).any(shapes_trace)
                || twin.table_offset_n(scenario) != 0.0
                || trails_n > 0.5 * pull.label_tolerance_n,
        }
    }
}

/// What a finding is about.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FindingKind {
    /// The label rule, applied to the trace, gives another label.
    Rule,
    /// The force still rose after the label: the loop trailed, the jaws had not slipped.
    Early,
    /// A larger force before the label.
    LargerBefore,
    /// The displacement begins at another force.
    Displacement,
    /// The sensor reads something without a load.
    Zero,
    /// The zero is another one after the pull, or in it.
    ZeroShift,
    /// The reading leaves the command all at once while the part is held.
    Jump,
    /// The gripper reports another force than was asked.
    GripForce,
    /// A force across the pull, which friction holds too.
    Lateral,
    /// A torque that no constant lever of the force explains.
    Torque,
}

/// What may be behind a finding, the narrowest first.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Behind {
    /// An accident of this pull.
    Pull,
    /// A contact that sticks and slips, in any of its pulls.
    Contact,
    /// An effect of sensor or robot that all pulls of a campaign have.
    Rig,
}

impl FindingKind {
    /// Every kind.
    pub const ALL: [Self; 10] = [
        Self::Rule,
        Self::Early,
        Self::LargerBefore,
        Self::Displacement,
        Self::Zero,
        Self::ZeroShift,
        Self::Jump,
        Self::GripForce,
        Self::Lateral,
        Self::Torque,
    ];

    /// What may be behind it.
    pub fn behind(self) -> Behind {
        match self {
            Self::Early | Self::Zero | Self::ZeroShift | Self::Displacement => Behind::Rig,
            Self::Jump | Self::LargerBefore => Behind::Contact,
            Self::Rule | Self::GripForce | Self::Lateral | Self::Torque => Behind::Pull,
        }
    }
}

/// Two numbers that should agree.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Finding {
    /// What they are of.
    pub kind: FindingKind,
    /// What the evidence says, N (Nm for a torque).
    pub found: f64,
    /// What it should be by the label or the command.
    pub wanted: f64,
    /// How far they may be apart.
    pub allowed: f64,
    /// Seconds into the pull, where it has a time.
    pub time_s: Option<f64>,
}

impl Finding {
    /// Whether they are farther apart than they may be.
    pub fn is_reason(&self) -> bool {
        // What is not a number contradicts nothing.
        (self.found - self.wanted).abs() > self.allowed
    }
}

impl fmt::Display for Finding {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { found, wanted, allowed, .. } = self;
        match self.kind {
            FindingKind::Rule if found.is_finite() => {
                write!(f, "the label rule gives {found:.2} N on the trace, the label is {wanted:.2} N")?;
            }
            FindingKind::Rule => {
                return write!(f, "no reading of the trace is near its command, the label is {wanted:.2} N");
            }
            FindingKind::Early => {
                write!(f, "the force rose to {found:.2} N after the label of {wanted:.2} N")?;
            }
            FindingKind::LargerBefore => {
                write!(f, "the jaws held {found:.2} N before the label of {wanted:.2} N")?;
            }
            FindingKind::Displacement => {
                write!(f, "the jaws begin to move at {found:.2} N, the label is {wanted:.2} N")?;
            }
            FindingKind::Zero => write!(f, "the sensor reads {found:.2} N without a load")?,
            FindingKind::ZeroShift => {
                write!(f, "the sensor's zero is {found:.2} N, and was {wanted:.2} N before the pull")?;
            }
            FindingKind::Jump => write!(f, "the reading jumps by {found:.2} N while the part is held")?,
            FindingKind::GripForce => {
                write!(f, "the gripper reports {found:.2} N per jaw, {wanted:.2} N were asked")?;
            }
            FindingKind::Lateral => {
                write!(
                    f,
                    "with the force across it the pull takes {found:.2} N of friction, its label is {wanted:.2} N"
                )?;
            }
            FindingKind::Torque => {
                write!(f, "{found:.2} Nm of torque are no lever of the pull")?;
            }
        }
        let unit = if self.kind == FindingKind::Torque { "Nm" } else { "N" };
        write!(f, " ({allowed:.2} {unit} are allowed")?;
        match self.time_s {
            Some(time_s) => write!(f, "; at {time_s:.2} s)"),
            None => write!(f, ")"),
        }
    }
}

/// Standard errors of a label by their cause, N; 0 where the evidence for it is missing.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct LabelBudget {
    /// Noise of the one reading that the label is.
    pub noise_n: f64,
    /// The rule: what the jaws held before the label and more than it, and steps that jump over its tolerance.
    pub rule_n: f64,
    /// The loop's time constant times the slope of the force after the label.
    pub lag_n: f64,
    /// The reading without a load.
    pub zero_n: f64,
    /// What the reading is more or less than a share of the command.
    pub gain_n: f64,
    /// Half the time between two rows times the slope at the label, where the label may lie between them.
    pub timing_n: f64,
}

impl LabelBudget {
    /// All causes together, as if they were independent.
    pub fn total_n(&self) -> f64 {
        let Self { noise_n, rule_n, lag_n, zero_n, gain_n, timing_n } = *self;
        [noise_n, rule_n, lag_n, zero_n, gain_n, timing_n].iter().map(|x| x * x).sum::<f64>().sqrt()
    }
}

/// What the evidence says of a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// There is no evidence.
    NoEvidence,
    /// Nothing contradicts the label.
    Holds,
    /// Something does.
    Suspect,
}

/// A label judged.
#[derive(Debug, Clone, PartialEq)]
pub struct Judgement {
    /// What came out.
    pub verdict: Verdict,
    /// All comparisons that could be made.
    pub findings: Vec<Finding>,
    /// By how much the label may be off.
    pub budget: LabelBudget,
}

impl Judgement {
    /// The findings that contradict the label.
    pub fn reasons(&self) -> impl Iterator<Item = &Finding> {
        self.findings.iter().filter(|finding| finding.is_reason())
    }

    /// Why the label is suspect, with numbers; `None` if it is not.
    pub fn reason(&self) -> Option<String> {
        (self.verdict == Verdict::Suspect)
            .then(|| self.reasons().map(Finding::to_string).collect::<Vec<_>>().join("; "))
    }

    /// What may be behind all that contradicts the label.
    pub fn behind(&self) -> Behind {
        self.reasons().map(|finding| finding.kind.behind()).min().unwrap_or(Behind::Pull)
    }
}

/// Judges a label by the evidence that is there.
pub fn check_label(evidence: &LabelEvidence<'_>, expected: &Expected) -> Judgement {
    let mut findings = Vec::new();
    let mut budget = LabelBudget::default();
    let signal = evidence.trace.and_then(|trace| Signal::of(trace, evidence, expected));
    if let Some(signal) = &signal {
        budget.noise_n = signal.noise_n;
        findings.push(rule::label_rule(signal, evidence));
        if !expected.own_effects {
            zero::without_load(signal, evidence, &mut findings, &mut budget);
            slip::slip(signal, evidence, expected, &mut findings, &mut budget);
        }
    }
    cross_axis::grip_force(evidence, &mut findings);
    cross_axis::across(evidence, &mut findings);
    let verdict = match () {
        () if findings.iter().any(Finding::is_reason) => Verdict::Suspect,
        () if findings.is_empty() => Verdict::NoEvidence,
        () => Verdict::Holds,
    };
    Judgement { verdict, findings, budget }
}

/// Why the label of a simulated pull is suspect; `None` if it is not, as it ought to be. The trace holds every reading.
pub fn suspect_simulated(
    twin: &Twin,
    scenario: &Scenario,
    trace: &PullTrace,
    label: &SlipLabel,
) -> Option<String> {
    let pull = &scenario.pull;
    let of_trace =
        LabelEvidence::of_trace(label.max_pull_force_n, pull.label_tolerance_n, pull.stop_m, Some(trace));
    let evidence = LabelEvidence { censored: label.censored, every_reading: true, ..of_trace };
    check_label(&evidence, &Expected::of(twin, scenario)).reason()
}

/// What may be behind a reason that was recorded ([`Judgement::reason`], perhaps with others after it, joined by
/// semicolons). A camera that fell silent is an accident of its pull.
pub fn recorded_behind(reason: &str) -> Behind {
    let known = FindingKind::ALL.map(|kind| {
        let finding = Finding { kind, found: 0.0, wanted: 0.0, allowed: 0.0, time_s: None };
        (plain(&finding.to_string()), kind.behind())
    });
    let behind = |reason: &str| {
        let reason = plain(reason);
        known.iter().find(|(text, _)| *text == reason).map_or(Behind::Pull, |(_, behind)| *behind)
    };
    reasons_of(reason).map(behind).min().unwrap_or(Behind::Pull)
}

/// The reasons of a record. In the brackets of one there is a semicolon too: "(0.33 N are allowed; at 0.10 s)".
fn reasons_of(reason: &str) -> impl Iterator<Item = &str> {
    reason.split("; ").filter(|part| !part.is_empty() && !part.starts_with("at "))
}

/// A reason without its numbers and what stands in brackets.
fn plain(reason: &str) -> String {
    let before = reason.split(" (").next().unwrap_or_default();
    before.chars().filter(|c| !c.is_ascii_digit() && !matches!(c, '-' | '.')).collect()
}
