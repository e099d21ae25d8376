//! The next pulls: those that best tell apart what a diagnosis could not.

use crate::analysis::expect::pull_predictor;
use gripgen::Library;
use gripgen_identify::pulls::answer::PullFits;
use gripgen_identify::pulls::fitting::Fitted;
use gripgen_identify::pulls::heldout::scatter;
use gripgen_identify::{CandidatePull, DWELLS_S, FORCES_N, NO_LOAD_S, SeparableRival, plan_separating};
use gripgen_twin::draw::Drawn;
use gripgen_twin::predict::{PredictPulls, PullModel};
use gripgen_twin::{
    Campaign, MeasuredPull, MeasuredPulls, PULLS_SINCE_REST, PlannedPull, PullKind, SINCE_ZERO, Twin,
};
use nalgebra::{DMatrix, DVector};

/// Pulls that are planned at most.
const MAX_PULLS: usize = 40;

/// Pulls that are planned at least.
const MIN_PULLS: usize = 6;

/// Noise variances between two models from which on one is rarely taken for the other: see [`plan_separating`].
const ENOUGH: f64 = 16.0;

/// Models that are told apart at most.
const MAX_RIVALS: usize = 5;

/// The rest between both halves of the plan: what comes with time moves on, what comes with use does not.
const REST_S: f64 = 1800.0;

/// Pulls that share the rest, for its cost.
const SHARE_REST: f64 = 8.0;

/// Height and length of a step: a fifth of the usual rate, the usual one, three times as fast. Force mode follows a UR5e's
/// command some 0.05 s late; a step and what is late together stay below the 3 N of the label rule (at 2 N in 0.0416 s they
/// reach 4.4 N: labels end a step early, and the check of pulls calls them suspect).
const STEPS: [(f64, f64); 3] = [(0.5, 0.26), (1.0, 0.104), (1.5, 0.052)];

/// Noise variances below which pulls do not tell two models apart: one is taken for the other in 30 % of cases.
const HOPELESS: f64 = 1.0;

/// Pulls that tell apart what a diagnosis could not.
#[derive(Debug, Clone, PartialEq)]
pub struct NextPulls {
    /// What to do.
    pub campaign: Campaign,
    /// Ids of two effects that are told apart, and their distance after these pulls in noise variances.
    pub apart: Vec<(String, String, f64)>,
    /// Ids of effects that no pull tells from the accepted one.
    pub left: Vec<String>,
}

impl NextPulls {
    /// Whether these pulls tell effect `id` from something.
    pub fn separates(&self, id: &str) -> bool {
        self.apart.iter().any(|(accepted, ..)| accepted == id)
    }

    /// A sentence or two.
    pub fn text(&self) -> String {
        let pulls = self.campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).count();
        let minutes = self.campaign.estimated_minutes();
        let each: Vec<String> = self
            .apart
            .iter()
            .map(|(a, b, t)| {
                // Of two equally likely models the further one wins with this probability, for Gaussian noise.
                let mistaken = 50.0 * libm::erfc(0.5 * t.sqrt() / std::f64::consts::SQRT_2);
                format!("{a} from {b} (mistaken in {:.0} % of cases)", mistaken.max(1.0))
            })
            .collect();
        if each.is_empty() {
            return format!(
                "the planned campaign ({pulls} pulls, {minutes:.0} min) varies what the force may depend on"
            );
        }
        let mut text =
            format!("the planned campaign ({pulls} pulls, {minutes:.0} min) tells {}", each.join(" and "));
        if !self.left.is_empty() {
            text += &format!("; {} stays tied", self.left.join(", "));
        }
        text
    }
}

/// Plans pulls that separate the accepted model of `fits` from what is tied with it. `None` where nothing is tied, or where
/// no pull of this robot tells it apart.
pub(crate) fn next_pulls(
    fits: &PullFits,
    measured: &MeasuredPulls,
    twin: &Twin,
    library: &Library,
    jobs: usize,
) -> Option<NextPulls> {
    // An accepted effect, what is tied with it, and the model with that in its place.
    let tied: Vec<(&str, &str, f64, &Fitted)> = fits
        .accepted
        .effects
        .iter()
        .flat_map(|(i, tied)| tied.iter().map(move |t| (*i, t)))
        .map(|(i, t)| (id(fits, i), id(fits, t.effect), libm::exp(t.less), &t.fitted))
        .take(MAX_RIVALS)
        .collect();
    if tied.is_empty() {
        return None;
    }
    let (planned, after_rest) = grid(measured, twin);
    let candidates = as_measured(measured, &planned, &after_rest);
    let predictor = pull_predictor(&candidates, twin, library, jobs);
    let rows: Vec<usize> = (0..planned.len()).collect();
    let labels =
        |model: &PullModel| -> Vec<f64> { predictor.pulls(model, &rows).iter().map(|p| p.label_n).collect() };
    let mut first = fits.after.with_values(&fits.after.values);
    first.scatter = scatter(&first, fits.after.likelihood.scale);
    let costs: Vec<CandidatePull> = predictor
        .pulls(&first, &rows)
        .iter()
        .zip(planned.iter().zip(&after_rest))
        .map(|(p, (pull, rest))| CandidatePull {
            noise_n: p.label_sd_n.max(0.02),
            minutes: (pull.estimated_s(measured.label_tolerance_n)
                + if *rest { REST_S / SHARE_REST } else { 0.0 })
                / 60.0,
        })
        .collect();
    let accepted = rival(1.0, &fits.after, &labels);
    let rivals: Vec<SeparableRival> = tied.iter().map(|t| rival(t.2, t.3, &labels)).collect();
    let of = |which: &[usize]| {
        let chosen = which.iter().map(|&k| rivals[k].clone());
        let all: Vec<SeparableRival> = std::iter::once(accepted.clone()).chain(chosen).collect();
        plan_separating(&costs, &all, MAX_PULLS, ENOUGH).ok()
    };
    // What no pull shows would draw all of them: such rivals are left to other experiments.
    let alone = |k: usize| of(&[k]).is_some_and(|plan| plan.separation[0].2 >= HOPELESS);
    let (apart, left): (Vec<usize>, Vec<usize>) = (0..tied.len()).partition(|&k| alone(k));
    let plan = of(&apart).filter(|plan| !apart.is_empty() && !plan.pulls.is_empty())?;
    let distance = |k: usize| plan.separation.iter().find(|s| (s.0, s.1) == (0, k + 1)).map_or(0.0, |s| s.2);
    let pairs = apart.iter().enumerate().map(|(at, &k)| (tied[k].0.into(), tied[k].1.into(), distance(at)));
    let pairs = pairs.collect();
    let left = left.into_iter().map(|k| tied[k].1.into()).collect();
    // One pull may be a bad one.
    let chosen: Vec<usize> =
        plan.pulls.iter().copied().cycle().take(plan.pulls.len().max(MIN_PULLS)).collect();
    let halves = [false, true].map(|rest| {
        chosen.iter().filter(|&&i| after_rest[i] == rest).map(|&i| planned[i].clone()).collect::<Vec<_>>()
    });
    let campaign = Campaign {
        label_tolerance_n: measured.label_tolerance_n,
        stop_m: measured.stop_m,
        feedback: measured.feedback,
        pulls: in_order(halves),
    };
    Some(NextPulls { campaign, apart: pairs, left })
}

fn id(fits: &PullFits, effect: usize) -> &'static str {
    fits.candidates[effect].spec.id
}

/// A fitted model as what it predicts of each candidate, with derivatives by its parameters.
fn rival(weight: f64, fitted: &Fitted, labels: &dyn Fn(&PullModel) -> Vec<f64>) -> SeparableRival {
    let predicted = labels(&fitted.with_values(&fitted.values));
    let n = fitted.values.len();
    let mut jacobian = DMatrix::zeros(predicted.len(), n);
    for k in 0..n {
        // A tenth of a standard error is small for every parameter.
        let step =
            (0.1 * fitted.covariance[(k, k)].max(0.0).sqrt()).max(1e-6 * fitted.values[k].abs() + 1e-9);
        let mut values = fitted.values.clone();
        values[k] += step;
        for (row, (new, old)) in labels(&fitted.with_values(&values)).iter().zip(&predicted).enumerate() {
            jacobian[(row, k)] = (new - old) / step;
        }
    }
    let information =
        fitted.covariance.clone().pseudo_inverse(1e-12).unwrap_or_else(|_| DMatrix::zeros(n, n));
    let information = 0.5 * (&information + information.transpose());
    SeparableRival { weight, predicted_n: DVector::from_vec(predicted), jacobian, information }
}

/// Everything that this rig could do next, and whether it is done after the rest.
fn grid(measured: &MeasuredPulls, twin: &Twin) -> (Vec<PlannedPull>, Vec<bool>) {
    let forces_n = forces_n(measured, twin.gripper.max_force_n);
    let mut parts: Vec<&str> = measured.pulls.iter().map(|p| p.part.as_str()).collect();
    parts.sort_unstable();
    parts.dedup();
    // Places at which nobody gripped so far are not proposed.
    let distinct = |of: &dyn Fn(&MeasuredPull) -> f64| {
        let mut found: Vec<f64> = measured.pulls.iter().map(|p| (of(p) * 1e3).round() / 1e3).collect();
        found.sort_by(f64::total_cmp);
        found.dedup();
        let last = found.len() - 1;
        let mut kept = vec![found[0], found[last / 2], found[last]];
        kept.dedup();
        kept
    };
    let angles_deg = distinct(&|p| p.covariates.grip_angle_rad.to_degrees());
    let offsets_mm = distinct(&|p| p.covariates.grip_offset_m * 1e3);
    let gel_id = measured.pulls.last().map_or_else(|| "g1".into(), |p| p.covariates.gel_id.clone());
    let (mut planned, mut after_rest) = (Vec::new(), Vec::new());
    for rest in [false, true] {
        for part in &parts {
            for &grip_force_n in &forces_n {
                for (k, &(force_increment_n, step_time_s)) in STEPS.iter().enumerate() {
                    for (d, &dwell_s) in DWELLS_S.iter().enumerate() {
                        for pull_direction in [1.0, -1.0] {
                            for (a, &grip_angle_deg) in angles_deg.iter().enumerate() {
                                for (o, &grip_offset_mm) in offsets_mm.iter().enumerate() {
                                    // One thing at a time beside force and direction: the usual rate and dwell, first place.
                                    let unusual =
                                        [k != 1, d != 0, a != 0, o != 0].into_iter().filter(|u| *u).count();
                                    if unusual > 1 {
                                        continue;
                                    }
                                    planned.push(PlannedPull {
                                        part: (*part).into(),
                                        grip_force_n,
                                        force_increment_n,
                                        step_time_s,
                                        dwell_s,
                                        pull_direction,
                                        grip_angle_deg,
                                        grip_offset_mm,
                                        session: if rest { "next-2" } else { "next-1" }.into(),
                                        gel_id: gel_id.clone(),
                                        ..PlannedPull::default()
                                    });
                                    after_rest.push(rest);
                                }
                            }
                        }
                    }
                }
            }
        }
    }
    (planned, after_rest)
}

/// Grip forces between the weakest that was measured and the strongest of the gripper. Where few of the usual ones lie there, the
/// ends of what was measured too.
fn forces_n(measured: &MeasuredPulls, most_n: f64) -> Vec<f64> {
    let all = || measured.pulls.iter().map(|pull| pull.grip_force_n);
    let (least_n, strongest_n) = (all().fold(most_n, f64::min), all().fold(0.0, f64::max).min(most_n));
    let mut forces: Vec<f64> = FORCES_N.into_iter().filter(|f| (least_n..=most_n).contains(f)).collect();
    if forces.len() < 3 {
        forces.extend([least_n, strongest_n]);
        forces.sort_by(f64::total_cmp);
        forces.dedup();
    }
    forces
}

/// Planned pulls as if they had been made right after the campaign.
fn as_measured(campaign: &MeasuredPulls, planned: &[PlannedPull], after_rest: &[bool]) -> MeasuredPulls {
    let last = |of: &dyn Fn(&MeasuredPull) -> f64| campaign.pulls.iter().map(of).fold(0.0, f64::max);
    let index = last(&|p| p.covariates.pull_index as f64) as u64;
    let time_s = last(&|p| p.covariates.time_s);
    let mut degrees: Vec<f64> = campaign.pulls.iter().map(|p| p.covariates.temperature_c).collect();
    degrees.sort_by(f64::total_cmp);
    let pull = |(i, (p, rest)): (usize, (&PlannedPull, &bool))| {
        // A new session, of which half the plan takes ten minutes.
        let since_zero_s = 600.0 + if *rest { REST_S } else { 0.0 };
        let mut covariates = gripgen_twin::Covariates {
            // Half of the plan lies before any pull of it, on average.
            pull_index: index + MAX_PULLS as u64 / 2,
            time_s: time_s + since_zero_s,
            temperature_c: degrees[degrees.len() / 2],
            ..p.covariates()
        };
        let since = if *rest { 2.0 } else { 12.0 };
        covariates.extra.insert(PULLS_SINCE_REST.into(), Drawn::Number(since));
        covariates.extra.insert(SINCE_ZERO.into(), Drawn::Number(since_zero_s));
        MeasuredPull {
            id: format!("next{i:05}"),
            part: p.part.clone(),
            grip_pose: 0,
            grip_force_n: p.grip_force_n,
            increment_n: p.force_increment_n,
            start_n: p.force_start_n,
            step_s: p.step_time_s,
            covariates,
            max_pull_force_n: 2.0 * p.grip_force_n,
            zero_shift_n: 0.0,
            trace: None,
        }
    };
    MeasuredPulls {
        pulls: planned.iter().zip(after_rest).enumerate().map(pull).collect(),
        recorded: campaign.recorded.clone(),
        extra: vec![],
        label_tolerance_n: campaign.label_tolerance_n,
        stop_m: campaign.stop_m,
        feedback: campaign.feedback,
        sha256: String::new(),
    }
}

/// Both halves, the second after the rest, each between two readings without a load. In a half the pulls take turns, so that
/// repetitions do not follow each other.
fn in_order(halves: [Vec<PlannedPull>; 2]) -> Vec<PlannedPull> {
    let mut order = Vec::new();
    for (mut half, pause_s) in halves.into_iter().zip([0.0, REST_S]) {
        if half.is_empty() {
            continue;
        }
        let reading = |pause_s: f64| PlannedPull {
            kind: PullKind::NoLoad,
            dwell_s: NO_LOAD_S,
            pause_s,
            session: half[0].session.clone(),
            gel_id: half[0].gel_id.clone(),
            ..PlannedPull::default()
        };
        let (before, after) = (reading(pause_s), reading(0.0));
        order.push(before);
        let mut turns: Vec<PlannedPull> = Vec::new();
        while !half.is_empty() {
            let mut left = Vec::new();
            let from = turns.len();
            for pull in half {
                if turns[from..].contains(&pull) { left.push(pull) } else { turns.push(pull) }
            }
            half = left;
        }
        order.extend(turns);
        order.push(after);
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pull(grip_force_n: f64) -> PlannedPull {
        PlannedPull { part: "rod".into(), grip_force_n, ..PlannedPull::default() }
    }

    #[test]
    fn repetitions_take_turns_and_a_rest_lies_between_the_halves() {
        let order = in_order([vec![pull(5.0), pull(5.0), pull(80.0)], vec![pull(5.0)]]);
        let forces: Vec<f64> = order.iter().map(|p| p.grip_force_n).collect();
        assert_eq!(forces, [0.0, 5.0, 80.0, 5.0, 0.0, 0.0, 5.0, 0.0]);
        let pauses: Vec<f64> = order.iter().map(|p| p.pause_s).collect();
        assert_eq!(pauses, [0.0, 0.0, 0.0, 0.0, 0.0, REST_S, 0.0, 0.0]);
        assert_eq!(order[5].kind, PullKind::NoLoad);
        assert_eq!(in_order([vec![], vec![pull(5.0)]]).len(), 3);
    }
}
