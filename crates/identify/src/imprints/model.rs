//! The force that imprints show under some effects, their constants, and the fit of effects.

use super::prepare::Prepared;
use crate::least_squares::{FitOptions, FreeParameter, fit};
use gripgen_twin::effects::{EffectSpec, ImprintFit, LIBRARY};

/// An effect with values in the order of its spec.
pub(crate) type Acting = (&'static EffectSpec, Vec<f64>);

/// Effects that imprints can show, in the order in which they act.
pub(super) fn candidates(prepared: &Prepared) -> Vec<&'static EffectSpec> {
    let shown = |s: &&EffectSpec| s.imprints.is_some_and(|f| !f.timed || !prepared.series.is_empty());
    LIBRARY.iter().copied().filter(shown).collect()
}

/// What the spec says of a fit to imprints.
pub(super) fn fit_of(spec: &EffectSpec) -> ImprintFit {
    spec.imprints.expect("candidates can be fitted")
}

/// Force that each imprint shows, in N: its volume is c times that.
pub(super) fn shown(prepared: &Prepared, effects: &[Acting]) -> Vec<f64> {
    let mut force_n = prepared.force_n.clone();
    for (spec, values) in effects {
        if let Some(hook) = spec.grasp_force {
            for (rows, time_s) in &prepared.series {
                let before: Vec<f64> = rows.iter().map(|&i| force_n[i]).collect();
                let after = hook(values, time_s, &before);
                rows.iter().zip(after).for_each(|(&i, f)| force_n[i] = f.max(0.0));
            }
        }
        if let Some(hook) = spec.imprint_volume {
            force_n.iter_mut().for_each(|f| *f = hook(values, *f, *f));
        }
        if let Some(factor) = spec.imprints.and_then(|f| f.factor) {
            for (rows, time_s) in &prepared.series {
                rows.iter().zip(time_s).for_each(|(&i, t)| force_n[i] *= factor(values, *t));
            }
        }
    }
    force_n
}

/// Least-squares constant of each group in mm^3/N over the rows that are `used`; 0 where none presses.
pub(super) fn constants(prepared: &Prepared, shown_n: &[f64], used: impl Fn(usize) -> bool) -> Vec<f64> {
    let of = |rows: &[usize]| {
        let (mut fv, mut ff) = (0.0, 0.0);
        for &i in rows.iter().filter(|&&i| used(i)) {
            fv += shown_n[i] * prepared.volume_mm3[i];
            ff += shown_n[i] * shown_n[i];
        }
        if ff > 0.0 { (fv / ff).max(0.0) } else { 0.0 }
    };
    prepared.groups.iter().map(|g| of(&g.rows)).collect()
}

/// Residuals of used rows as shares of the largest volume of their group.
fn residuals(prepared: &Prepared, effects: &[Acting], used: &dyn Fn(usize) -> bool) -> Vec<f64> {
    let shown_n = shown(prepared, effects);
    let c = constants(prepared, &shown_n, used);
    let of = |i: usize| {
        let c = prepared.group[i].map_or(0.0, |g| c[g]);
        (prepared.volume_mm3[i] - c * shown_n[i]) / prepared.peak(i)
    };
    prepared.rows().filter(|&i| used(i)).map(of).collect()
}

/// Fits the free values of some effects from a start, and returns them with the sum of squares.
pub(super) fn refit(
    prepared: &Prepared,
    start: &[Acting],
    used: &dyn Fn(usize) -> bool,
) -> (Vec<Acting>, f64) {
    let mut free = Vec::new();
    let mut at = Vec::new();
    for (k, (spec, values)) in start.iter().enumerate() {
        for (name, scale) in (fit_of(spec).fit)(&prepared.span).free {
            let Some(p) = spec.position(name) else { continue };
            let bounds = (fit_of(spec).bounds)(&prepared.span, spec.parameters[p].bounds);
            free.push(FreeParameter { name: name.into(), start: values[p], bounds, scale });
            at.push((k, p));
        }
    }
    let with = |numbers: &[f64]| {
        let mut effects = start.to_vec();
        for (&(k, p), x) in at.iter().zip(numbers) {
            let (spec, values) = &mut effects[k];
            values[p] = *x;
            let first = (fit_of(spec).fit)(&prepared.span).free.first().map(|(name, _)| *name);
            if first == Some(spec.parameters[p].name) {
                let alike = fit_of(spec).alike.iter().filter_map(|name| spec.position(name));
                alike.for_each(|other| values[other] = *x);
            }
        }
        effects
    };
    let found = fit(&free, FitOptions::default(), |numbers| residuals(prepared, &with(numbers), used));
    match found {
        Ok(found) => (with(&found.values), found.cost),
        Err(_) => (start.to_vec(), f64::INFINITY),
    }
}

/// The starts of an effect.
pub(super) fn starts(prepared: &Prepared, spec: &'static EffectSpec) -> Vec<Acting> {
    let fixed = (fit_of(spec).fixed)(&prepared.span);
    let start = |named: &Vec<(&'static str, f64)>| {
        let all: Vec<(&'static str, f64)> = named.iter().chain(&fixed).copied().collect();
        let mut values = spec.values(&all);
        if let Some((_, x)) = named.first() {
            let alike = fit_of(spec).alike.iter().filter_map(|name| spec.position(name));
            alike.for_each(|other| values[other] = *x);
        }
        (spec, values)
    };
    (fit_of(spec).fit)(&prepared.span).starts.iter().map(start).collect()
}

/// Place of the value that says how large an effect is.
pub(super) fn size_of(prepared: &Prepared, spec: &EffectSpec) -> usize {
    let fit = (fit_of(spec).fit)(&prepared.span);
    fit.free.first().and_then(|(name, _)| spec.position(name)).unwrap_or(0)
}
