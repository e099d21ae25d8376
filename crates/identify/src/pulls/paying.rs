//! Names that pay. What looks like an effect, and neither excludes nothing nor lowers the error on data that no fit has seen, is a
//! hint: it is said and is not in the twin.

use super::estimates::parameters;
use super::fitting::Fitted;
use super::heldout::UNFELT;
use super::profiled::ended;
use super::search::{Accepted, ByChance, Search};
use super::terms::Terms;
use super::trace_residuals::Widening;
use crate::diagnosis::Hint;

/// Share of the error on held-out data that a name, or what is learnt without one, has to take off.
pub(super) const PAYS: f64 = 0.03;

/// Least standard deviation of a label.
const LEAST_SD_N: f64 = 0.03;

/// The accepted model without the effects that do not pay, the last first, and these as hints. `rows` are the pulls that
/// count: an error is not that of pulls that are known to be bad.
pub(super) fn paying(
    search: &Search<'_>,
    before: &Fitted,
    mut accepted: Accepted,
    repetitions: &[Vec<usize>],
    rows: &[usize],
) -> (Accepted, Vec<Hint>) {
    let context = search.context;
    let expected = context.predictor.pulls(&before.model, &search.rows);
    let sd_n: Vec<f64> = expected.iter().map(|p| p.label_sd_n.max(LEAST_SD_N)).collect();
    let mut hints = Vec::new();
    for place in (0..accepted.effects.len()).rev() {
        let spec = search.candidates[accepted.effects[place].0].spec;
        let fewer = if accepted.effects.len() + accepted.curves.len() == 1 {
            Some(before.clone())
        } else {
            let mut terms = accepted.fitted.terms.clone();
            terms.effects.retain(|(c, _)| c.spec != spec);
            context.fit(&before.model, &terms, &search.rows)
        };
        let Some(fewer) = fewer else { continue };
        let errors = [&fewer, &accepted.fitted].map(|f| search.held_out(f, repetitions, rows));
        let plain = share([&errors[0], &errors[1]].map(|e| root_mean_square(e.iter().map(|(_, e)| *e))));
        // A weak grip that is predicted well says as much as a strong one.
        let weighed =
            share([&errors[0], &errors[1]].map(|e| root_mean_square(e.iter().map(|(i, e)| e / sd_n[*i]))));
        let mut gain = plain.max(weighed);
        let traces = !context.observations.is_empty();
        let signals = search.candidates[accepted.effects[place].0].acts_on_signals();
        if traces && signals {
            // A zero that wanders without the effect is no witness for it.
            let all: Vec<usize> = (0..context.data.len()).collect();
            let readings = [&fewer, &accepted.fitted].map(|f| context.trace_residuals(&f.model, &all));
            let widening = Widening { zero: readings[0].widening().zero, ..Widening::NONE };
            gain = gain.max(share(readings.map(|r| root_mean_square(r.widened(widening).into_iter()))));
        }
        let mut nothing = neutral(&accepted.fitted, spec);
        // An effect on readings whose size is open may be friction that changes with the rate.
        if nothing.is_some()
            && !signals
            && gain >= PAYS
            && let Some(found) = ended(context, &accepted.fitted, spec, &search.rows)
        {
            (accepted.fitted, nothing) = (found, None);
        }
        let unfelt = || unfelt(search, &accepted.fitted, spec, &sd_n);
        let reason = match nothing.or_else(unfelt) {
            Some(text) => text,
            None if gain < PAYS => format!(
                "it takes {:.1} % off the error on held-out pulls, a name needs {:.0} %",
                100.0 * gain,
                100.0 * PAYS
            ),
            None => continue,
        };
        hints.push(Hint { name: spec.id.into(), gain: plain, reason });
        accepted.effects.remove(place);
        accepted.fitted = fewer;
    }
    if let Some((accepted, hint)) = without_curve(search, before, &accepted, repetitions, rows, &sd_n) {
        hints.push(hint);
        return (accepted, hints);
    }
    (accepted, hints)
}

/// The accepted model without its unnamed curves, if these do not pay.
fn without_curve(
    search: &Search<'_>,
    before: &Fitted,
    accepted: &Accepted,
    repetitions: &[Vec<usize>],
    rows: &[usize],
    sd_n: &[f64],
) -> Option<(Accepted, Hint)> {
    let context = search.context;
    let curve = &search.curves[*accepted.curves.first()?];
    let fewer = if accepted.effects.is_empty() {
        before.clone()
    } else {
        let terms = Terms { curves: vec![], ..accepted.fitted.terms.clone() };
        context.fit(&before.model, &terms, &search.rows)?
    };
    let errors = [&fewer, &accepted.fitted].map(|f| search.held_out(f, repetitions, rows));
    let plain = share([&errors[0], &errors[1]].map(|e| root_mean_square(e.iter().map(|(_, e)| *e))));
    let weighed =
        share([&errors[0], &errors[1]].map(|e| root_mean_square(e.iter().map(|(i, e)| e / sd_n[*i]))));
    if plain.max(weighed) >= PAYS {
        return None;
    }
    let reason = format!(
        "it takes {:.1} % off the error on held-out pulls, a dependence needs {:.0} %",
        100.0 * plain.max(weighed),
        100.0 * PAYS
    );
    let hint = Hint { name: curve.name.clone(), gain: plain, reason };
    Some((Accepted { fitted: fewer, curves: vec![], ..accepted.clone() }, hint))
}

/// What the best rival gained where it gains as much by chance.
pub(super) fn by_chance(
    search: &Search<'_>,
    before: &Fitted,
    found: &ByChance,
    repetitions: &[Vec<usize>],
    rows: &[usize],
) -> Hint {
    Hint {
        name: search.name_of(&found.entry.rival),
        gain: share([before, &found.entry.fitted].map(|f| held_out_n(search, f, repetitions, rows))),
        reason: format!(
            "where nothing acts, the best of everything that competes looks as good in {:.0} % of campaigns like this one",
            100.0 * found.chance
        ),
    }
}

/// Why an effect may be nothing at all: its size holds its neutral value in all its terms.
fn neutral(fitted: &Fitted, spec: &'static gripgen_twin::effects::EffectSpec) -> Option<String> {
    let own: Vec<_> = fitted.terms.effects.iter().map(|(c, _)| c).filter(|c| c.spec == spec).collect();
    let size = own.first().map(|c| &spec.parameters[c.size()])?;
    let intervals = own.iter().filter_map(|c| parameters(fitted, c).remove(size.name));
    let mut widest = None;
    for p in intervals {
        if p.low90 > size.neutral || p.high90 < size.neutral {
            return None;
        }
        widest = Some(p);
    }
    let p = widest?;
    let (low, high) = (p.low90, p.high90);
    Some(format!("the 90 % interval of its {}, {low:.3} to {high:.3}, holds {}", size.name, size.neutral))
}

/// Why an effect that does nothing near its neutral value may be nothing at all: at the end of its interval towards that value no label
/// is another. (A limit of 49 N is not excluded by pulls that end at 20 N.)
fn unfelt(
    search: &Search<'_>,
    fitted: &Fitted,
    spec: &'static gripgen_twin::effects::EffectSpec,
    sd_n: &[f64],
) -> Option<String> {
    if !spec.pulls.is_ok_and(|fit| fit.flat_at_neutral) {
        return None;
    }
    let candidate =
        fitted.terms.effects.iter().map(|(c, _)| c).find(|c| c.spec == spec && c.part.is_none())?;
    let size = &spec.parameters[candidate.size()];
    let p = parameters(fitted, candidate).remove(size.name)?;
    let end = if p.value < size.neutral { p.high90 } else { p.low90 };
    let labels = |value: f64| {
        let mut model = fitted.model.clone();
        let own = model.effects.iter_mut().find(|e| e.spec == spec)?;
        own.values[candidate.size()] = value;
        Some(search.context.predictor.pulls(&model, &search.rows))
    };
    let (there, without) = (labels(end)?, labels(size.neutral)?);
    let felt = there
        .iter()
        .zip(&without)
        .zip(sd_n)
        .any(|((a, b), sd_n)| (a.label_n - b.label_n).abs() > UNFELT * sd_n);
    let (low, high) = (p.low90, p.high90);
    (!felt).then(|| {
        format!(
            "the 90 % interval of its {}, {low:.3} to {high:.3}, holds {end:.3}, which changes no label",
            size.name
        )
    })
}

/// Error of a fit on held-out pulls of `rows`.
pub(super) fn held_out_n(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    rows: &[usize],
) -> f64 {
    root_mean_square(search.held_out(fitted, repetitions, rows).into_iter().map(|(_, e)| e))
}

pub(super) fn root_mean_square(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, n) = values.fold((0.0, 0_usize), |(sum, n), v| (sum + v * v, n + 1));
    (sum / n.max(1) as f64).sqrt()
}

pub(super) fn share([before, after]: [f64; 2]) -> f64 {
    if before > 0.0 { 1.0 - after / before } else { 0.0 }
}
