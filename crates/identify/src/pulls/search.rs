//! The competition: every effect and every unnamed curve is fitted beside all baseline parameters, and has to earn its
//! place.

use super::candidates::Candidate;
use super::context::Context;
use super::curves::{Curve, curves_in, periodic, product};
use super::fitting::{Fitted, Terms};
use super::model::PullModel;
use super::power::ScoreTest;
use super::screen::test;
use std::sync::Mutex;

/// Score that a named effect has to gain: odds of 20 to 1, beyond what its parameters cost. Set on the development split of
/// the blind benchmark.
pub const NAMED_GAIN: f64 = 3.0;

/// Score that a second effect has to gain: what the first one leaves imitates others.
pub const SECOND_GAIN: f64 = 6.0;

/// Score that an unnamed curve has to gain.
pub const CURVE_GAIN: f64 = 4.5;

/// Rivals within this score of the best are not told apart: odds of about 20 to 1.
pub const TIED_WITHIN: f64 = 3.0;

/// Entries within this score of the best, and how many at most, are fitted again with everything free.
const REFIT_WITHIN: f64 = 6.0;
const MOST_REFITS: usize = 6;

/// Share of what the best curve in its own covariate explains that a named effect has to explain.
const EXPLAINED: f64 = 0.75;

/// Share of the variance that an effect leaves which a curve in its own covariate may explain: formulas differ a little
/// from what nature does. More than that, and the effect is not what acts.
const MISFIT: f64 = 0.3;

/// Gain of log-likelihood that the slope at nothing has to promise for an effect on signals to be fitted, and for anything
/// beside such an effect: these fits are slow.
const LEAST_PROMISE: f64 = 1.5;
const LEAST_PROMISE_BESIDE: f64 = 2.5;

/// Level of the permutation test that a curve has to pass beside its score.
const LEVEL: f64 = 0.02;

/// Effects of the surface, which parts may have each in their own way; those of gel, gripper, sensor and robot are common.
const PER_PART: [&str; 7] = [
    "load_offset",
    "load_power_law",
    "area_saturation",
    "rate_dependence",
    "dwell_ageing",
    "anisotropy",
    "temperature",
];

/// Parts at most, and pulls of each at least, of an effect that differs by part.
const MOST_PARTS: usize = 6;
const FEWEST_OF_PART: usize = 10;

/// Score by which a curve in a clock has to be better than steps from session to session.
const RATHER_SESSION: f64 = 4.0;

/// Correlation of ranks from which on two columns are the same clock.
const SAME_CLOCK: f64 = 0.9;

/// Something that may be added to a model.
#[derive(Debug, Clone)]
pub enum Rival {
    /// An effect of the library, by position.
    Effect(usize),
    /// The same with parameters of its own for each part.
    ByPart(usize),
    /// An unnamed curve, by position.
    Curve(usize),
}

/// A rival with its fit.
#[derive(Debug, Clone)]
pub struct Entry {
    /// What was added.
    pub rival: Rival,
    /// The model with it.
    pub fitted: Fitted,
    /// Its score less that of the model without it.
    pub gain: f64,
}

impl Rival {
    /// Position of the effect, if it is one.
    pub fn effect(&self) -> Option<usize> {
        match self {
            Rival::Effect(i) | Rival::ByPart(i) => Some(*i),
            Rival::Curve(_) => None,
        }
    }
}

/// An effect that the data do not tell from an accepted one.
#[derive(Debug, Clone)]
pub struct Tied {
    /// Which, by position.
    pub effect: usize,
    /// Its score less that of the accepted one.
    pub less: f64,
    /// The model with it in place of the accepted one.
    pub fitted: Fitted,
}

/// What was accepted: a model, and for each of its effects what else could stand in its place.
#[derive(Debug, Clone)]
pub struct Accepted {
    /// The model.
    pub fitted: Fitted,
    /// Effects by position, in the order in which their terms stand, each with what is tied with it. One that differs by
    /// part has a term for every part.
    pub effects: Vec<(usize, Vec<Tied>)>,
    /// Unnamed curves by position.
    pub curves: Vec<usize>,
    /// Everything that competed for the first place, best first.
    pub entries: Vec<Entry>,
}

/// A competition on a campaign.
pub struct Search<'a> {
    /// The campaign.
    pub context: &'a Context<'a>,
    /// The effects that compete.
    pub candidates: Vec<Candidate>,
    /// The curves that compete.
    pub curves: Vec<Curve>,
    /// The pulls that are fitted.
    pub rows: Vec<usize>,
}

impl<'a> Search<'a> {
    /// With the curves of all columns that vary, and of the products of pairs of them.
    pub fn new(context: &'a Context<'a>, candidates: Vec<Candidate>) -> Self {
        let data = context.data;
        let n = data.len();
        let mut curves = Vec::new();
        let mut numbers = Vec::new();
        for (name, column) in &data.columns {
            let distinct = column.distinct();
            let words = matches!(column, super::data::Column::Word(..));
            if name == "part" || distinct < 2 || (words && distinct * 4 > n) {
                continue;
            }
            for curve in curves_in(name, column) {
                if curve.cost * 5 > n {
                    continue;
                }
                if curve.cost <= 3 {
                    curves.push(curve.added());
                }
                curves.push(curve);
            }
            if !words {
                numbers.push(name.as_str());
            }
        }
        curves.extend(wave(context, &["time_s", "pull_index"]));
        for (i, a) in numbers.iter().enumerate() {
            for b in &numbers[i + 1..] {
                curves.extend(product(data, a, b).filter(|_| n >= 40));
            }
        }
        Self { context, candidates, curves, rows: (0..n).collect() }
    }

    fn score(&self, fitted: &Fitted) -> f64 {
        fitted.score(self.rows.len())
    }

    /// `terms` with one rival more, from all its starts; the best fit. `test` is a score test beside them.
    fn with(&self, start: &PullModel, terms: &Terms, rival: &Rival, test: &ScoreTest<'_>) -> Option<Fitted> {
        let slow = terms.act_on_signals();
        let mut best: Option<Fitted> = None;
        let keep = |fitted: Option<Fitted>, best: &mut Option<Fitted>| {
            if let Some(f) = fitted
                && best.as_ref().is_none_or(|b| self.score(&f) > self.score(b))
            {
                *best = Some(f);
            }
        };
        match rival {
            Rival::Curve(i) => {
                let curve = &self.curves[*i];
                if slow && test.curve(curve) < LEAST_PROMISE_BESIDE {
                    return None;
                }
                let mut terms = terms.clone();
                terms.hold_signals = slow;
                terms.curves.push((curve.clone(), vec![0.0; curve.len()]));
                keep(self.context.fit(start, &terms, &self.rows), &mut best);
            }
            Rival::ByPart(i) => {
                let candidates = self.candidates[*i].by_part(&self.context.data.parts);
                for from in &self.candidates[*i].starts {
                    let mut terms = terms.clone();
                    terms.hold_signals = slow;
                    terms.effects.extend(candidates.iter().map(|c| (c.clone(), from.clone())));
                    keep(self.context.fit(start, &terms, &self.rows), &mut best);
                }
            }
            Rival::Effect(i) => {
                let candidate = &self.candidates[*i];
                let least = match (slow, candidate.acts_on_signals()) {
                    (true, _) => LEAST_PROMISE_BESIDE,
                    (false, true) => LEAST_PROMISE,
                    (false, false) => 0.0,
                };
                for from in &candidate.starts {
                    if least > 0.0 && test.effect(candidate, from) < least {
                        continue;
                    }
                    let mut terms = terms.clone();
                    terms.hold_signals = slow && !candidate.acts_on_signals();
                    terms.effects.push((candidate.clone(), from.clone()));
                    keep(self.context.fit(start, &terms, &self.rows), &mut best);
                }
            }
        }
        best
    }

    /// Fits `terms` with each rival added, best first. `done` is called after each.
    fn compete(
        &self,
        before: &Fitted,
        terms: &Terms,
        rivals: &[Rival],
        done: &(dyn Fn() + Sync),
    ) -> Vec<Entry> {
        let results: Vec<Mutex<Option<Fitted>>> = rivals.iter().map(|_| Mutex::new(None)).collect();
        let test = ScoreTest::new(self.context, &before.model, terms, &self.rows, true);
        self.context.predictor.for_each(rivals.len(), &|i| {
            let fitted = self.with(&before.model, terms, &rivals[i], &test);
            if let Ok(mut slot) = results[i].lock() {
                *slot = fitted;
            }
            done();
        });
        let old = self.score(before);
        let mut entries: Vec<Entry> = rivals
            .iter()
            .zip(results)
            .filter_map(|(rival, slot)| {
                let fitted = slot.into_inner().ok().flatten()?;
                let gain = self.score(&fitted) - old;
                Some(Entry { rival: rival.clone(), fitted, gain })
            })
            .collect();
        entries.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        self.refit(&mut entries, old);
        entries
    }

    /// Fits the best entries again with everything free, where signals were held.
    fn refit(&self, entries: &mut [Entry], old: f64) {
        let Some(best) = entries.first().map(|e| e.gain) else { return };
        let held = |e: &Entry| e.fitted.terms.hold_signals && e.gain > best - REFIT_WITHIN && e.gain > 0.0;
        let chosen: Vec<usize> =
            (0..entries.len()).filter(|&k| held(&entries[k])).take(MOST_REFITS).collect();
        let results: Vec<Mutex<Option<Fitted>>> = chosen.iter().map(|_| Mutex::new(None)).collect();
        self.context.predictor.for_each(chosen.len(), &|i| {
            let entry = &entries[chosen[i]];
            let terms = Terms { hold_signals: false, ..entry.fitted.terms.clone() };
            if let Ok(mut slot) = results[i].lock() {
                *slot = self.context.fit(&entry.fitted.model, &terms, &self.rows);
            }
        });
        for (&k, slot) in chosen.iter().zip(results) {
            if let Some(fitted) = slot.into_inner().ok().flatten() {
                let gain = self.score(&fitted) - old;
                entries[k] = Entry { rival: entries[k].rival.clone(), fitted, gain };
            }
        }
        entries.sort_by(|a, b| b.gain.total_cmp(&a.gain));
    }

    fn all(&self, without: &[usize]) -> Vec<Rival> {
        // The slow ones first, so that threads end together.
        let mut effects: Vec<usize> = (0..self.candidates.len()).filter(|i| !without.contains(i)).collect();
        effects.sort_by_key(|&i| !self.candidates[i].acts_on_signals());
        let differing: Vec<usize> = effects.iter().copied().filter(|&i| self.may_differ(i)).collect();
        effects
            .into_iter()
            .map(Rival::Effect)
            .chain(differing.into_iter().map(Rival::ByPart))
            .chain((0..self.curves.len()).map(Rival::Curve))
            .collect()
    }

    /// Whether effect `i` may have other parameters for each part, and every part has pulls enough to show them.
    fn may_differ(&self, i: usize) -> bool {
        let data = self.context.data;
        let parts = data.parts.len();
        let fewest = (0..parts).map(|p| data.part_of.iter().filter(|&&q| q == p).count()).min();
        (2..=MOST_PARTS).contains(&parts)
            && fewest >= Some(FEWEST_OF_PART)
            && PER_PART.contains(&self.candidates[i].spec.id)
    }

    /// Terms of accepted effect `place`, which start at the first.
    fn terms_of(&self, fitted: &Fitted, i: usize) -> usize {
        fitted.terms.effects.iter().filter(|(c, _)| c.spec == self.candidates[i].spec).count()
    }

    /// Runs the competition. `progress` is told the share that is done.
    pub fn run(&self, progress: &(dyn Fn(f64) + Sync)) -> Option<(Fitted, Accepted)> {
        let none = Terms::default();
        let baseline = self.context.fit(&self.context.base, &none, &self.rows)?;
        let rivals = self.all(&[]);
        let count = Mutex::new(0.0);
        let total = 2.2 * rivals.len() as f64;
        let tick = || {
            if let Ok(mut count) = count.lock() {
                *count += 1.0;
                progress((*count / total).min(1.0));
            }
        };
        let first = self.compete(&baseline, &none, &rivals, &tick);
        let mut accepted =
            Accepted { fitted: baseline.clone(), effects: vec![], curves: vec![], entries: first.clone() };
        let Some(mut winner) = self.winner(&baseline, &first, NAMED_GAIN, CURVE_GAIN) else {
            return Some((baseline, accepted));
        };
        if let Some(i) = winner.rival.effect()
            && let Some(curve) = self.misfit(&baseline, &winner, i, &tick)
        {
            winner = curve;
        }
        self.accept(&mut accepted, &winner, &first);
        for _ in 0..2 {
            let without: Vec<usize> = accepted.effects.iter().map(|(i, _)| *i).collect();
            let terms = accepted.fitted.terms.clone();
            let mut rivals = self.all(&without);
            rivals.retain(|r| self.stands_beside(r, &without, &accepted.curves));
            let entries = self.compete(&accepted.fitted, &terms, &rivals, &tick);
            let Some(winner) = self.winner(&accepted.fitted, &entries, SECOND_GAIN, CURVE_GAIN + 1.0) else {
                break;
            };
            // One unnamed curve at most, and two effects.
            let full = match winner.rival {
                Rival::Curve(_) => !accepted.curves.is_empty(),
                Rival::Effect(_) | Rival::ByPart(_) => accepted.effects.len() >= 2,
            };
            if full {
                break;
            }
            self.accept(&mut accepted, &winner, &entries);
            self.exchange(&mut accepted, &tick);
            self.prune(&mut accepted);
        }
        progress(1.0);
        Some((baseline, accepted))
    }

    /// Whether a rival says something else than the effects and curves that are there already.
    fn stands_beside(&self, rival: &Rival, effects: &[usize], curves: &[usize]) -> bool {
        match rival {
            Rival::Effect(i) | Rival::ByPart(i) => {
                // A drift that is not straight looks like a straight one from another start.
                let of_drift = self.candidates[*i].spec.id == "sensor_bias"
                    && effects.iter().any(|&k| self.candidates[k].spec.id == "sensor_drift");
                !of_drift && !curves.iter().any(|&k| self.shares_covariate(*i, k))
            }
            Rival::Curve(k) => !effects.iter().any(|&i| self.shares_covariate(i, *k)),
        }
    }

    /// Whether curve `k` is in a covariate of effect `i`, or in one that runs with it.
    fn shares_covariate(&self, i: usize, k: usize) -> bool {
        let name = self.curves[k].name.as_str();
        let own = self.candidates[i].spec.covariates;
        let readings = own.is_empty() && self.candidates[i].acts_on_signals();
        if own.contains(&name) || (readings && name == "grip_force_n") {
            return true;
        }
        let rate = ["force_increment_n", "step_time_s"];
        if rate.contains(&name) && own.iter().any(|c| rate.contains(c)) {
            return true;
        }
        own.iter().any(|c| ["pull_index", "time_s"].contains(c) && self.same_clock(c, name))
    }

    fn same_clock(&self, a: &str, b: &str) -> bool {
        let data = self.context.data;
        let (Some(x), Some(y)) = (data.numbers(a), data.numbers(b)) else { return false };
        b == "session" || rank_correlation(&x, &y).abs() > SAME_CLOCK
    }

    /// The best curve in the covariates of an accepted effect, if it explains so much beside it that the effect is not what
    /// acts: the effect goes, the curve stays.
    fn misfit(&self, before: &Fitted, winner: &Entry, i: usize, tick: &(dyn Fn() + Sync)) -> Option<Entry> {
        let own: Vec<Rival> =
            (0..self.curves.len()).filter(|&k| self.shares_covariate(i, k)).map(Rival::Curve).collect();
        let beside = self.compete(&winner.fitted, &winner.fitted.terms, &own, tick);
        let best = beside.first().filter(|e| e.gain >= CURVE_GAIN)?;
        let left = best.fitted.likelihood.scale / winner.fitted.likelihood.scale;
        if 1.0 - left * left <= MISFIT {
            return None;
        }
        let alone = self.compete(before, &before.terms, &own, tick);
        alone.into_iter().next().filter(|e| e.gain > winner.gain)
    }

    /// Sessions themselves rather than a clock that runs along with them.
    fn rather_session(&self, best: &Entry, entries: &[Entry]) -> Entry {
        let name = |e: &Entry| match e.rival {
            Rival::Curve(k) => self.curves[k].name.as_str(),
            _ => "",
        };
        let clock = name(best).split('*').all(|c| ["time_s", "pull_index"].contains(&c));
        let session = entries.iter().find(|e| name(e) == "session");
        session.filter(|s| clock && s.gain > best.gain - RATHER_SESSION).unwrap_or(best).clone()
    }

    /// Whether an effect on signals is larger than what a first-order loop gets wrong of an arm: less than 2 % of the
    /// readings, or of a few hundredths of a newton or a second, is no effect, however often it was measured.
    fn visible(&self, entry: &Entry) -> bool {
        let Rival::Effect(i) = entry.rival else { return true };
        let spec = self.candidates[i].spec;
        let Some(effect) = entry.fitted.model.effects.iter().find(|e| e.spec == spec) else { return true };
        let size = (effect.values[self.candidates[i].size()]
            - spec.parameters[self.candidates[i].size()].neutral)
            .abs();
        let pulls = &self.context.data.measured.pulls;
        let last_s = pulls.iter().map(|p| p.covariates.time_s).fold(0.0, f64::max);
        let first_s = pulls.iter().map(|p| p.covariates.time_s).fold(last_s, f64::min);
        let hours = (last_s - first_s) / 3600.0;
        let most_n = self.context.data.label_n.iter().copied().fold(0.0, f64::max);
        match spec.id {
            "sensor_gain" | "controller_gain" | "sensor_creep" => size >= 0.02,
            "sensor_gain_drift" => size * hours >= 0.02,
            "sensor_quadratic" => size * most_n >= 0.02,
            "sensor_bias" | "sensor_hysteresis" => size >= 0.05,
            "sensor_drift" => size * hours >= 0.05,
            "sensor_lowpass" => size >= 0.02,
            _ => true,
        }
    }

    /// The entry that is accepted, if one is.
    fn winner(&self, before: &Fitted, entries: &[Entry], named_gain: f64, curve_gain: f64) -> Option<Entry> {
        let named =
            entries.iter().find(|e| e.rival.effect().is_some() && e.gain >= named_gain && self.visible(e));
        let curve = entries.iter().filter(|e| e.gain >= curve_gain).find(|e| match e.rival {
            Rival::Curve(k) => {
                let found = test(self.context.data, before, &before.residuals, &self.curves[k]);
                found.p_value <= LEVEL
            }
            _ => false,
        });
        match (named, curve) {
            (Some(named), None) => Some(named.clone()),
            (None, Some(curve)) => Some(self.rather_session(curve, entries)),
            (None, None) => None,
            (Some(named), Some(curve)) => {
                let gained = |e: &Entry| {
                    (e.fitted.likelihood.log - e.fitted.trace_cost)
                        - (before.likelihood.log - before.trace_cost)
                };
                let enough = gained(named) >= EXPLAINED * gained(curve) || named.gain >= curve.gain - 1.0;
                Some(if enough { named.clone() } else { self.rather_session(curve, entries) })
            }
        }
    }

    /// A fit with everything free.
    fn freed(&self, fitted: &Fitted) -> Fitted {
        if !fitted.terms.hold_signals {
            return fitted.clone();
        }
        let terms = Terms { hold_signals: false, ..fitted.terms.clone() };
        self.context.fit(&fitted.model, &terms, &self.rows).unwrap_or_else(|| fitted.clone())
    }

    /// Takes out effects that later terms have made superfluous.
    fn prune(&self, accepted: &mut Accepted) {
        if accepted.effects.len() + accepted.curves.len() < 2 {
            return;
        }
        for place in (0..accepted.effects.len()).rev() {
            let spec = self.candidates[accepted.effects[place].0].spec;
            let mut terms = Terms { hold_signals: false, ..accepted.fitted.terms.clone() };
            terms.effects.retain(|(c, _)| c.spec != spec);
            let mut start = accepted.fitted.model.clone();
            start.effects.retain(|e| e.spec != spec);
            let Some(fewer) = self.context.fit(&start, &terms, &self.rows) else { continue };
            if self.score(&accepted.fitted) - self.score(&fewer) < NAMED_GAIN {
                accepted.effects.remove(place);
                accepted.fitted = fewer;
            }
        }
    }

    fn accept(&self, accepted: &mut Accepted, winner: &Entry, entries: &[Entry]) {
        accepted.fitted = self.freed(&winner.fitted);
        match winner.rival {
            Rival::Curve(i) => accepted.curves.push(i),
            Rival::Effect(i) | Rival::ByPart(i) => {
                accepted.effects.push((i, tied(i, winner.gain, entries)));
            }
        }
    }

    /// With a second term in the model, the first may have stood for both: every effect is tried in the place of each.
    fn exchange(&self, accepted: &mut Accepted, tick: &(dyn Fn() + Sync)) {
        let count = accepted.effects.len();
        if count + accepted.curves.len() < 2 {
            return;
        }
        // What is fitted anew goes to the end, so that the first place is always the next.
        for _ in 0..count {
            let others: Vec<usize> = accepted.effects[1..].iter().map(|(i, _)| *i).collect();
            let old = accepted.effects[0].0;
            let width = self.terms_of(&accepted.fitted, old);
            let mut terms = accepted.fitted.terms.clone();
            terms.effects.drain(..width);
            let mut start = accepted.fitted.clone();
            start.model.effects.drain(..width);
            let mut rivals = self.all(&others);
            rivals.retain(|r| {
                let own = r.effect() == Some(old);
                r.effect().is_some() && (own || self.stands_beside(r, &others, &accepted.curves))
            });
            let entries = self.compete(&start, &terms, &rivals, tick);
            let Some(best) = entries.first() else { return };
            let same = |e: &&Entry| e.rival.effect() == Some(old);
            let chosen = match entries.iter().find(same) {
                Some(own) if own.gain + 0.5 >= best.gain => own,
                _ => best,
            };
            let Some(i) = chosen.rival.effect() else { return };
            accepted.fitted = self.freed(&chosen.fitted);
            accepted.effects.remove(0);
            accepted.effects.push((i, tied(i, chosen.gain, &entries)));
        }
    }
}

/// The sine in the first clock that was written down that fits the residuals of the baseline best.
fn wave(context: &Context<'_>, clocks: &[&str]) -> Option<Curve> {
    let data = context.data;
    let name = *clocks.iter().find(|name| data.columns.contains_key(**name))?;
    let at = data.numbers(name)?;
    let rows: Vec<usize> = (0..data.len()).collect();
    let baseline = context.fit(&context.base, &Terms::default(), &rows)?;
    let most = 3.0 * baseline.likelihood.scale;
    let residuals: Vec<f64> = baseline.residuals.iter().map(|r| r.clamp(-most, most)).collect();
    periodic(name, &at, &residuals)
}

/// Spearman's correlation.
fn rank_correlation(x: &[f64], y: &[f64]) -> f64 {
    let ranks = |v: &[f64]| {
        let mut order: Vec<usize> = (0..v.len()).collect();
        order.sort_by(|&a, &b| v[a].total_cmp(&v[b]));
        let mut rank = vec![0.0; v.len()];
        order.iter().enumerate().for_each(|(r, &i)| rank[i] = r as f64);
        rank
    };
    let (a, b) = (ranks(x), ranks(y));
    let mean = (x.len() as f64 - 1.0) / 2.0;
    let sum = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(p, q)| (p - mean) * (q - mean)).sum::<f64>();
    sum(&a, &b) / (sum(&a, &a) * sum(&b, &b)).sqrt().max(1e-300)
}

/// Rivals of effect `i` that the data do not tell from it.
fn tied(i: usize, gain: f64, entries: &[Entry]) -> Vec<Tied> {
    let mut found: Vec<Tied> = Vec::new();
    for e in entries.iter().filter(|e| e.gain > gain - TIED_WITHIN) {
        // The better one of a common effect and one that differs by part comes first.
        match e.rival.effect() {
            Some(k) if k != i && found.iter().all(|t| t.effect != k) => {
                found.push(Tied { effect: k, less: e.gain - gain, fitted: e.fitted.clone() });
            }
            _ => {}
        }
    }
    found
}
