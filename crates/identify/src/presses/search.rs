//! Which effects act: added one after another, exchanged, dropped, and compared with what has no name.

use super::candidates::is_drawn;
use super::gains::{Scatter, scatter};
use super::observed::Observed;
use super::predict::{ActingEffect, PRESS_ZONES};
use super::score::{
    Base, Design, MATERIAL, PressTrial, SURE, Scored, differences, left_out, scored, shares, with,
};
use super::unnamed::{Fields, PressCovariate, Unnamed};
use crate::Hint;
use gripgen_twin::effects::EffectSpec;

/// Least gain, as [`MATERIAL`], of an effect that is drawn: the sharpness with which any sensor file draws a contact is not quite that of its
/// camera, by 4 and 5 % of the error on the untouched halves of 22 real presses.
const MATERIAL_DRAWN: f64 = 0.06;

/// The same for effects after the first: where one was found, its formula is not quite that of nature either, and what
/// it leaves looks like others.
const MATERIAL_FURTHER: f64 = 0.05;

/// The same for what has no name: a smooth curve fits into more of a sensor file's own misfit.
const MATERIAL_UNNAMED: f64 = 0.12;

/// A further effect explains at least this share of what those before it do.
const FURTHER: f64 = 0.03;

/// What has no name explains at least this share of what the named effects do, beyond them.
const LEFT: f64 = 0.15;

/// Fewest presses that an effect acts on whose scatter says how sure it is: fewer do not say how much they scatter.
const MIN_ACTED: usize = 4;

/// Effects at most.
const MAX_EFFECTS: usize = 3;

/// Least gain, as [`MATERIAL`], of what is mentioned.
const MIN_HINT: f64 = 0.01;

/// An effect leaves each zone at most this factor worse, and all effects together at most this factor worse than none.
const WORSE: f64 = 1.05;

/// A rival whose loss is less than this share of the gain is named beside the effect.
const NEAR: f64 = 0.05;

/// A rival of a named effect.
#[derive(Debug, Clone)]
pub(super) struct TiedRival {
    pub(super) spec: &'static EffectSpec,
    /// Mean loss of cost against the effect, and its standard error.
    pub(super) loss: f64,
    pub(super) standard_error: f64,
}

/// What was found.
pub(super) struct Found {
    pub(super) model: Scored,
    /// Rivals of each effect.
    pub(super) rivals: Vec<Vec<TiedRival>>,
    /// Gain of each effect: what the error rises by without it.
    pub(super) gains: Vec<f64>,
    pub(super) unknown: Vec<(String, f64, f64)>,
    /// What would have lowered the error by too little.
    pub(super) hints: Vec<Hint>,
    pub(super) trials: Vec<PressTrial>,
    pub(super) design: Design,
    /// Mean cost with the model.
    pub(super) cost: f64,
    /// Gains that differ from press to press.
    pub(super) scatter: Scatter,
    /// Mean squared residual in each zone without effects.
    pub(super) zone_mse: [f64; PRESS_ZONES],
}

impl Found {
    fn of(
        design: Design,
        model: Scored,
        trials: Vec<PressTrial>,
        scatter: Scatter,
        zone_mse: [f64; PRESS_ZONES],
    ) -> Self {
        let (rivals, gains, unknown, hints) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Self { model, rivals, gains, unknown, hints, trials, design, cost: 0.0, scatter, zone_mse }
    }

    /// All effects that were named.
    pub(super) fn acting(&self) -> Vec<ActingEffect> {
        self.scatter.beside(self.model.acting.clone())
    }
}

/// Whether a gain counts.
fn counts(gain: f64, standard_error: f64, least: f64) -> bool {
    gain > least && gain > SURE * standard_error
}

/// Whether the last effect of `after` lowers the costs of presses surely: by their differences, or by their shares where an effect that grows
/// with the order does nothing to the first presses. One that acts from a press on makes two kinds of presses, and how much these differ
/// from each other is no doubt about it.
fn is_sure(observed: &Observed<'_>, design: &Design, before: &[f64], after: &Scored) -> bool {
    let gains = differences(before, &after.held_out);
    let (gain, error) = design.mean(&gains);
    let (share, share_error) = design.mean(&shares(before, &after.held_out));
    let by_kind = || {
        let acts = after.acting.last().and_then(|last| observed.acts(last));
        let enough = |acts: &&Vec<bool>| acts.iter().filter(|acts| **acts).count() >= MIN_ACTED;
        acts.as_ref().filter(enough).is_some_and(|acts| gain > SURE * design.error_by_kind(&gains, acts))
    };
    gain > SURE * error || gain > 0.0 && (share > SURE * share_error || by_kind())
}

/// Runs the search. `progress` hears what is done, from 0 to 1.
pub(super) fn search(
    observed: &mut Observed<'_>,
    covariates: &[PressCovariate],
    candidates: &[&'static EffectSpec],
    press_gain_sd: Option<[f64; 3]>,
    progress: &mut dyn FnMut(f64, &str),
) -> Found {
    let mut design = Design::new(observed.count());
    let plain = observed.zone_mse(&[]);
    let scatter = scatter(observed, &design, covariates, press_gain_sd);
    let zone_mse = if press_gain_sd.is_some() { observed.zone_mse(&[]) } else { plain };
    let mut model = scored(observed, &design, Vec::new());
    let mut trials: Vec<PressTrial> = scatter.trial.clone().into_iter().collect();
    let mut hints: Vec<Hint> = Vec::new();
    for round in 0..=MAX_EFFECTS {
        observed.rescale(&model.acting);
        let costs: Vec<f64> = scored(observed, &design, Vec::new()).held_out;
        model = scored(observed, &design, model.acting);
        let now: Vec<f64> = model.fit.moments.iter().map(|m| m.cost).collect();
        design.reweigh(&now);
        model = scored(observed, &design, model.acting);
        let base = design.mean(&model.held_out).0;
        let explained = (design.mean(&costs).0 - base).max(0.0);
        let mut best: Option<(f64, Scored)> = None;
        let left: Vec<_> =
            candidates.iter().filter(|s| model.acting.iter().all(|a| a.spec != **s)).copied().collect();
        let ground = Base::new(observed, &model);
        hints.clear();
        for (k, spec) in left.iter().enumerate() {
            let share = (round as f64 + k as f64 / left.len() as f64) / (MAX_EFFECTS + 1) as f64;
            progress(share, spec.id);
            let first = if model.acting.is_empty() { MATERIAL } else { MATERIAL_FURTHER };
            let material = if is_drawn(spec) { MATERIAL_DRAWN } else { first };
            let least = (material * base).max(FURTHER * explained);
            let tried = with(observed, &design, &ground, spec, 0.5 * least);
            let (gain, standard_error) = design.mean(&differences(&model.held_out, &tried.held_out));
            trials.push(PressTrial {
                round,
                name: spec.id.into(),
                gain,
                standard_error,
                cost: base - gain,
                values: values_text(&tried),
            });
            hints.extend(hint(spec.id, gain, standard_error, least, base));
            let is_sure = is_sure(observed, &design, &model.held_out, &tried);
            if gain > least
                && is_sure
                && best.as_ref().is_none_or(|(g, _)| gain > *g)
                && spares_zones(observed, &model.acting, &tried.acting)
            {
                best = Some((gain, tried));
            }
        }
        match best {
            Some((_, tried)) if round < MAX_EFFECTS => model = scored(observed, &design, tried.acting),
            _ => break,
        }
        model = dropped(observed, &design, model, MATERIAL * base / 2.0);
    }
    let found = Found::of(design, model, trials, scatter, zone_mse);
    let mut found = finish(observed, covariates, candidates, found, progress);
    hints.retain(|hint| found.acting().iter().all(|acting| acting.spec.id != hint.name));
    hints.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    found.hints = hints;
    found
}

/// A gain that is there and is too small to count.
fn hint(name: &str, gain: f64, standard_error: f64, least: f64, base: f64) -> Option<Hint> {
    let sure = gain > SURE * standard_error && gain > MIN_HINT * base;
    (sure && gain <= least).then(|| Hint {
        name: name.into(),
        gain: 1.0 - (1.0 - gain / base).max(0.0).sqrt(),
        reason: format!(
            "it explains {:.1} % of the squared error, {:.0} % are needed for a name",
            100.0 * gain / base,
            100.0 * least / base
        ),
    })
}

/// Whether no zone gets worse by an effect, the last of `after`, and one of the whole frame is seen away from the contact: a
/// field that is fitted to what the contact is drawn wrong by is not. Presses with gains of their own say the light there.
fn spares_zones(observed: &Observed<'_>, before: &[ActingEffect], after: &[ActingEffect]) -> bool {
    let (then, now) = (observed.zone_mse(before), observed.zone_mse(after));
    let never = if before.is_empty() { then } else { observed.zone_mse(&[]) };
    let far = PRESS_ZONES - 1;
    let of_frame = after.last().is_some_and(|last| !is_drawn(last.spec)) && !observed.divides_gains();
    let seen_far = then[far] == 0.0 || now[far] < (1.0 - MATERIAL) * then[far];
    let spares = |ground: &[f64]| ground.iter().zip(&now).all(|(then, now)| *now <= WORSE * then);
    (!of_frame || seen_far) && spares(&then) && spares(&never)
}

/// Without those effects whose loss is not felt any more.
fn dropped(observed: &Observed<'_>, design: &Design, mut model: Scored, least: f64) -> Scored {
    let mut e = 0;
    while model.acting.len() > 1 && e < model.acting.len() {
        let without = left_out(observed, design, &model.acting, e);
        if design.mean(&differences(&without.held_out, &model.held_out)).0 < least {
            model = without;
        } else {
            e += 1;
        }
    }
    model
}

/// Exchanges, ties and what has no name, in the scale of the final model.
fn finish(
    observed: &mut Observed<'_>,
    covariates: &[PressCovariate],
    candidates: &[&'static EffectSpec],
    found: Found,
    progress: &mut dyn FnMut(f64, &str),
) -> Found {
    let Found { design, mut model, mut trials, scatter, zone_mse, .. } = found;
    observed.rescale(&model.acting);
    model = scored(observed, &design, model.acting);
    let (mut rivals, mut gains) = (Vec::new(), Vec::new());
    let mut e = 0;
    let mut exchanges = 0;
    while e < model.acting.len() {
        let spec = model.acting[e].spec;
        let without = left_out(observed, &design, &model.acting, e);
        let ground = Base::new(observed, &without);
        let gain = design.mean(&differences(&without.held_out, &model.held_out)).0;
        let mut tied = Vec::new();
        let mut better: Option<(f64, Scored)> = None;
        for other in candidates.iter().filter(|s| model.acting.iter().all(|a| a.spec != **s)) {
            progress(0.9, other.id);
            let tried = with(observed, &design, &ground, other, 0.7 * gain);
            let (loss, standard_error) = design.mean(&differences(&tried.held_out, &model.held_out));
            if loss < 0.0 && better.as_ref().is_none_or(|(l, _)| loss < *l) {
                better = Some((loss, tried));
            }
            if loss < standard_error.max(NEAR * gain) {
                tied.push(TiedRival { spec: other, loss, standard_error });
            }
        }
        match better {
            Some((loss, tried)) if exchanges < 3 && loss < -0.01 * gain => {
                debug_assert!(tried.acting.last().is_some_and(|a| a.spec != spec));
                model = scored(observed, &design, tried.acting);
                exchanges += 1;
                (rivals, gains, e) = (Vec::new(), Vec::new(), 0);
            }
            _ => {
                rivals.push(tied);
                gains.push(gain);
                e += 1;
            }
        }
    }
    let costs = scored(observed, &design, Vec::new()).held_out;
    let base = design.mean(&model.held_out).0;
    let explained = (design.mean(&costs).0 - base).max(0.0);
    let least = (MATERIAL_UNNAMED * base).max(LEFT * explained);
    progress(0.95, "what has no name");
    let fields = Fields::new(observed, &model);
    let curves = fields.rivals(covariates, &design);
    let mut unknown: Vec<(&Unnamed, f64, f64)> = Vec::new();
    for rival in &curves {
        let (gain, standard_error) = design.mean(&differences(&model.held_out, &rival.held_out));
        trials.push(PressTrial {
            round: MAX_EFFECTS + 1,
            name: format!("curve in {}", rival.covariate),
            gain,
            standard_error,
            cost: base - gain,
            values: String::new(),
        });
        if counts(gain, standard_error, least) {
            unknown.push((rival, gain, standard_error));
        }
    }
    let best = unknown.first().map_or(0.0, |u| u.1);
    unknown.retain(|u| u.1 > 0.8 * best);
    if let Some((rival, ..)) = unknown.first() {
        // Effects that the rival makes needless were standing in for it.
        let mut e = 0;
        while e < model.acting.len() {
            let with_it = Fields::new(observed, &model).beside(rival, &design);
            let without = left_out(observed, &design, &model.acting, e);
            let without_it = Fields::new(observed, &without).beside(rival, &design);
            let loss = design.mean(&differences(&without_it, &with_it)).0;
            if loss < MATERIAL * base || loss < 0.1 * gains[e] {
                model = without;
                gains.remove(e);
                rivals.remove(e);
            } else {
                e += 1;
            }
        }
    }
    let total = design.mean(&costs).0.max(1e-12);
    let unknown = unknown
        .iter()
        .map(|(rival, gain, se)| (rival.covariate.clone(), gain / total, two_sided(gain / se.max(1e-12))))
        .collect();
    let cost = design.mean(&model.held_out).0;
    Found { rivals, gains, unknown, cost, ..Found::of(design, model, trials, scatter, zone_mse) }
}

/// Probability of a normal variable beyond `t` standard deviations to either side.
fn two_sided(t: f64) -> f64 {
    libm::erfc(t.abs() / std::f64::consts::SQRT_2)
}

fn values_text(scored: &Scored) -> String {
    let Some(last) = scored.acting.last() else { return String::new() };
    let pairs = last.spec.parameters.iter().zip(&last.values).take(5);
    pairs.map(|(p, v)| format!("{} {v:.3}", p.name)).collect::<Vec<_>>().join(", ")
}
