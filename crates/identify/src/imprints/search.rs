//! Which effects act.
//!
//! Every set of up to three effects is fitted to all rows and without each unit. A set counts where each of its effects pays: the
//! held-out error with it is lower by [`MIN_GAIN`] and by more than chance over the units makes it, and its value differs from
//! the neutral one by more than the fits without one unit scatter. The largest such set is the answer.

use super::errors::{HeldOut, hold_out};
use super::model::{Acting, candidates, refit, size_of, starts};
use super::prepare::Prepared;
use crate::diagnosis::Hint;
use crate::grouped::t_quantile_95;
use crate::statistics::mean_and_error;
use gripgen_twin::effects::EffectSpec;
use std::collections::BTreeMap;

/// Effects at most.
const MOST: usize = 3;
/// Share of the root mean squared held-out error that an effect takes off at least.
const MIN_GAIN: f64 = 0.03;
/// Share from which on it does not matter how the gain is spread: a delay acts in the stretches where the force changes, and nowhere else.
const LARGE_GAIN: f64 = 0.2;
/// What a 95 % quantile is multiplied by: four candidates are looked at, so that each needs a chance of about 1 %.
const STRICTER: f64 = 1.5;

/// Positions of effects in the list of candidates, rising.
pub(super) type Set = Vec<usize>;

/// All sets that were tried.
pub(super) struct Tried {
    pub(super) specs: Vec<&'static EffectSpec>,
    pub(super) sets: BTreeMap<Set, HeldOut>,
}

/// How an effect of a set does beside the others of it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Payment {
    /// Share of the root mean squared held-out error that it takes off.
    pub(super) gain: f64,
    /// Gain over its standard error, in units of what is asked for.
    pub(super) certain: f64,
    /// Distance of its value from the neutral one, in units of what is asked for.
    pub(super) distant: f64,
}

impl Payment {
    pub(super) fn pays(&self) -> bool {
        self.gain >= MIN_GAIN && self.is_certain() && self.distant >= 1.0
    }

    fn is_certain(&self) -> bool {
        self.certain >= 1.0 || self.gain >= LARGE_GAIN
    }

    fn why_not(&self) -> String {
        if self.gain < MIN_GAIN {
            return format!(
                "it takes {:.1} % off the held-out error, {:.0} % are asked for",
                100.0 * self.gain,
                100.0 * MIN_GAIN
            );
        }
        if !self.is_certain() {
            return "what it takes off the held-out error differs as much between grasps as chance makes it"
                .into();
        }
        "its value is not told from one that does nothing".into()
    }
}

impl Tried {
    /// Fits and holds out every set.
    pub(super) fn new(prepared: &Prepared) -> Self {
        let specs = candidates(prepared);
        let mut sets: BTreeMap<Set, HeldOut> = BTreeMap::new();
        sets.insert(Vec::new(), hold_out(prepared, Vec::new()));
        for size in 1..=MOST.min(specs.len()) {
            for set in subsets(specs.len(), size) {
                let best = fit_set(prepared, &specs, &set, &sets);
                sets.insert(set, hold_out(prepared, best));
            }
        }
        Self { specs, sets }
    }

    pub(super) fn of(&self, set: &[usize]) -> &HeldOut {
        &self.sets[set]
    }

    /// How one effect of a set does.
    pub(super) fn payment(&self, prepared: &Prepared, set: &[usize], effect: usize) -> Payment {
        let (with, without) = (self.of(set), self.of(&less(set, effect)));
        let at = set.iter().position(|&e| e == effect).unwrap_or(0);
        let saved: Vec<f64> = without.squares.iter().zip(&with.squares).map(|(b, a)| b - a).collect();
        let (mean, deviation) = mean_and_error(&saved);
        let asked = STRICTER * t_quantile_95(prepared.units as f64 - 1.0);
        let spec = self.specs[effect];
        let size = size_of(prepared, spec);
        let (value, scatter) = with.value(at, size);
        let distance = (value - spec.parameters[size].neutral).abs();
        let ratio = |a: f64, b: f64| if a > 0.0 { a / (asked * b).max(1e-12 * a) } else { 0.0 };
        Payment {
            gain: 1.0 - libm::sqrt(with.all() / without.all().max(f64::MIN_POSITIVE)),
            certain: ratio(mean, deviation),
            distant: ratio(distance, scatter),
        }
    }

    /// The answer, and what looked like an effect on the way there.
    pub(super) fn choose(&self, prepared: &Prepared) -> (Set, Vec<Hint>) {
        let mut hints: BTreeMap<usize, Hint> = BTreeMap::new();
        for size in (0..=MOST.min(self.specs.len())).rev() {
            let of_size = self.sets.iter().filter(|(set, _)| set.len() == size);
            let Some((set, _)) = of_size.min_by(|a, b| a.1.all().total_cmp(&b.1.all())) else { continue };
            let payments: Vec<Payment> = set.iter().map(|&e| self.payment(prepared, set, e)).collect();
            if payments.iter().all(Payment::pays) {
                let told = hints.into_iter().filter(|(e, _)| !set.contains(e)).map(|(_, hint)| hint);
                return (set.clone(), told.collect());
            }
            // What a smaller set shows of an effect is nearer to the answer.
            for (&effect, payment) in set.iter().zip(&payments).filter(|(_, p)| !p.pays() && p.gain > 0.005) {
                let name = self.specs[effect].id.to_string();
                hints.insert(effect, Hint { name, gain: payment.gain, reason: payment.why_not() });
            }
        }
        (Vec::new(), hints.into_values().collect())
    }

    /// What stands in for an effect of the answer as well: candidates with their held-out sum of squares.
    pub(super) fn rivals(&self, prepared: &Prepared, set: &[usize], effect: usize) -> Vec<(usize, f64)> {
        let best = self.of(set);
        let others = (0..self.specs.len()).filter(|e| !set.contains(e));
        let as_good = |rival: usize| {
            let mut other = less(set, effect);
            other.push(rival);
            other.sort_unstable();
            let found = self.of(&other);
            let worse: Vec<f64> = found.squares.iter().zip(&best.squares).map(|(r, b)| r - b).collect();
            let (mean, deviation) = mean_and_error(&worse);
            let pays = self.payment(prepared, &other, rival).gain >= MIN_GAIN;
            (pays && mean <= deviation).then(|| (rival, found.all()))
        };
        others.filter_map(as_good).collect()
    }
}

/// A set without one of its effects.
pub(super) fn less(set: &[usize], effect: usize) -> Set {
    set.iter().copied().filter(|&e| e != effect).collect()
}

fn subsets(n: usize, size: usize) -> Vec<Set> {
    let members = |mask: u32| (0..n).filter(|e| mask >> e & 1 == 1).collect::<Set>();
    (0..1u32 << n).map(members).filter(|set| set.len() == size).collect()
}

/// The best fit to all rows: from the fit without each effect, with each start of that.
fn fit_set(
    prepared: &Prepared,
    specs: &[&'static EffectSpec],
    set: &[usize],
    known: &BTreeMap<Set, HeldOut>,
) -> Vec<Acting> {
    let mut best: Option<(Vec<Acting>, f64)> = None;
    for (at, &effect) in set.iter().enumerate() {
        for start in starts(prepared, specs[effect]) {
            let mut all = known[&less(set, effect)].effects.clone();
            all.insert(at, start);
            let found = refit(prepared, &all, &|_| true);
            if best.as_ref().is_none_or(|b| found.1 < b.1) {
                best = Some(found);
            }
        }
    }
    best.map_or_else(Vec::new, |(effects, _)| effects)
}
