//! Which effects act: added one after another, exchanged, dropped, and compared with what has no name.

use super::candidates::press_effects;
use super::score::{Base, Design, Scored, differences, scored, with};
use super::unnamed::{Fields, PressCovariate, Unnamed};
use super::work::Work;
use gripgen_twin::effects::EffectSpec;

/// A gain of less than this share of the error is no effect, however surely it is there: every sensor file misfits its
/// own presses by some of everything.
pub(super) const MATERIAL: f64 = 0.02;

/// Gains are this many standard errors above 0 at least.
pub(super) const SURE: f64 = 3.0;

/// The same for effects after the first: where one was found, its formula is not quite that of nature either, and what
/// it leaves looks like others.
const MATERIAL_FURTHER: f64 = 0.05;

/// The same for what has no name: a smooth curve fits into more of a sensor file's own misfit.
const MATERIAL_UNNAMED: f64 = 0.12;

/// A further effect explains at least this share of what those before it do.
const FURTHER: f64 = 0.03;

/// What has no name explains at least this share of what the named effects do, beyond them.
const LEFT: f64 = 0.15;

/// Effects at most.
const MOST_EFFECTS: usize = 3;

/// A rival whose loss is less than this share of the gain is named beside the effect.
const NEAR: f64 = 0.05;

/// How one candidate did.
#[derive(Debug, Clone)]
pub(super) struct Trial {
    pub(super) round: usize,
    pub(super) name: String,
    pub(super) gain: f64,
    pub(super) standard_error: f64,
    /// Mean held-out cost with it; 1 is what the zones had before this round.
    pub(super) cost: f64,
    pub(super) values: String,
}

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
    pub(super) trials: Vec<Trial>,
    pub(super) design: Design,
    /// Mean cost with the model.
    pub(super) cost: f64,
}

/// Whether a gain counts.
fn counts(gain: f64, standard_error: f64, least: f64) -> bool {
    gain > least && gain > SURE * standard_error
}

/// Runs the search. `progress` hears what is done, from 0 to 1.
pub(super) fn search(
    work: &mut Work,
    covariates: &[PressCovariate],
    candidates: &[&'static EffectSpec],
    progress: &mut dyn FnMut(f64, &str),
) -> Found {
    let mut design = Design::new(work.views.len());
    let mut model = scored(work, &design, Vec::new());
    let mut trials = Vec::new();
    for round in 0..=MOST_EFFECTS {
        work.rescale(&model.acting);
        let costs: Vec<f64> = scored(work, &design, Vec::new()).held_out;
        model = scored(work, &design, model.acting);
        let now: Vec<f64> = model.fit.moments.iter().map(|m| m.cost).collect();
        design.reweigh(&now);
        model = scored(work, &design, model.acting);
        let base = design.mean(&model.held_out).0;
        let explained = (design.mean(&costs).0 - base).max(0.0);
        let mut best: Option<(f64, Scored)> = None;
        let left: Vec<_> =
            candidates.iter().filter(|s| model.acting.iter().all(|a| a.spec != **s)).copied().collect();
        let ground = Base::new(work, &model);
        for (k, spec) in left.iter().enumerate() {
            let share = (round as f64 + k as f64 / left.len() as f64) / (MOST_EFFECTS + 1) as f64;
            progress(share, spec.id);
            let material = if model.acting.is_empty() { MATERIAL } else { MATERIAL_FURTHER };
            let least = (material * base).max(FURTHER * explained);
            let tried = with(work, &design, &ground, spec, 0.5 * least);
            let (gain, standard_error) = design.mean(&differences(&model.held_out, &tried.held_out));
            trials.push(Trial {
                round,
                name: spec.id.into(),
                gain,
                standard_error,
                cost: base - gain,
                values: values_text(&tried),
            });
            if counts(gain, standard_error, least) && best.as_ref().is_none_or(|(g, _)| gain > *g) {
                best = Some((gain, tried));
            }
        }
        match best {
            Some((_, tried)) if round < MOST_EFFECTS => model = scored(work, &design, tried.acting),
            _ => break,
        }
        model = dropped(work, &design, model, MATERIAL * base / 2.0);
    }
    finish(work, covariates, candidates, design, model, trials, progress)
}

/// Without those effects whose loss is not felt any more.
fn dropped(work: &Work, design: &Design, mut model: Scored, least: f64) -> Scored {
    let mut e = 0;
    while model.acting.len() > 1 && e < model.acting.len() {
        let mut rest = model.acting.clone();
        rest.remove(e);
        let without = scored(work, design, rest);
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
    work: &mut Work,
    covariates: &[PressCovariate],
    candidates: &[&'static EffectSpec],
    design: Design,
    mut model: Scored,
    mut trials: Vec<Trial>,
    progress: &mut dyn FnMut(f64, &str),
) -> Found {
    work.rescale(&model.acting);
    model = scored(work, &design, model.acting);
    let (mut rivals, mut gains) = (Vec::new(), Vec::new());
    let mut e = 0;
    let mut exchanges = 0;
    while e < model.acting.len() {
        let spec = model.acting[e].spec;
        let mut rest = model.acting.clone();
        rest.remove(e);
        let without = scored(work, &design, rest);
        let ground = Base::new(work, &without);
        let gain = design.mean(&differences(&without.held_out, &model.held_out)).0;
        let mut tied = Vec::new();
        let mut better: Option<(f64, Scored)> = None;
        for other in candidates.iter().filter(|s| model.acting.iter().all(|a| a.spec != **s)) {
            progress(0.9, other.id);
            let tried = with(work, &design, &ground, other, 0.7 * gain);
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
                model = scored(work, &design, tried.acting);
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
    let costs = scored(work, &design, Vec::new()).held_out;
    let base = design.mean(&model.held_out).0;
    let explained = (design.mean(&costs).0 - base).max(0.0);
    let least = (MATERIAL_UNNAMED * base).max(LEFT * explained);
    progress(0.95, "what has no name");
    let fields = Fields::new(work, &model);
    let found = fields.rivals(covariates, &design);
    let mut unknown: Vec<(&Unnamed, f64, f64)> = Vec::new();
    for rival in &found {
        let (gain, standard_error) = design.mean(&differences(&model.held_out, &rival.held_out));
        trials.push(Trial {
            round: MOST_EFFECTS + 1,
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
            let mut rest = model.acting.clone();
            rest.remove(e);
            let with_it = Fields::new(work, &model).beside(rival, &design);
            let without = scored(work, &design, rest);
            let without_it = Fields::new(work, &without).beside(rival, &design);
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
    Found { model, rivals, gains, unknown, trials, design, cost }
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

/// The candidates that these data can speak of.
pub(super) fn candidates(marked: bool) -> Vec<&'static EffectSpec> {
    press_effects().filter(|(_, fit)| marked || !fit.needs_marks).map(|(spec, _)| spec).collect()
}
