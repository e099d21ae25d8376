//! The competition: every effect and every unnamed curve is fitted beside all baseline parameters, and has to earn its
//! place.

use super::candidates::Candidate;
use super::chosen::{at_one_word, periodic};
use super::context::Context;
use super::curves::{CLOCKS, Curve, PART, SESSION, curves_in, product};
use super::data::Column;
use super::fitting::Fitted;
use super::terms::Terms;
use super::written::Written;
use std::cell::OnceCell;
use std::sync::Mutex;

/// Score that a named effect has to gain: odds of 20 to 1, beyond what its parameters cost. Set on the development split of
/// the blind benchmark.
pub const NAMED_GAIN: f64 = 3.0;

/// The same of the first one, which also has to be rarer than chance on the shuffled residuals of the campaign (`null.rs`).
pub const FIRST_GAIN: f64 = 1.5;

/// Score that a second effect has to gain: what the first one leaves imitates others.
pub const SECOND_GAIN: f64 = 6.0;

/// Score that an unnamed curve has to gain.
pub const CURVE_GAIN: f64 = 4.5;

/// Rivals within this score of the best are not told apart: odds of about 20 to 1.
pub const TIED_WITHIN: f64 = 3.0;

/// Pulls from which on pairs of columns are looked at, and words that a column of a pair may have.
const MIN_OF_PRODUCT: usize = 40;
const MAX_WORDS: usize = 12;

/// Effects at most.
const MAX_EFFECTS: usize = 3;

/// Something that may be added to a model.
#[derive(Debug, Clone)]
pub enum ModelTerm {
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
    pub rival: ModelTerm,
    /// The model with it.
    pub fitted: Fitted,
    /// Its score less that of the model without it.
    pub gain: f64,
}

impl ModelTerm {
    /// Position of the effect, if it is one.
    pub fn effect(&self) -> Option<usize> {
        match self {
            ModelTerm::Effect(i) | ModelTerm::ByPart(i) => Some(*i),
            ModelTerm::Curve(_) => None,
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
    /// What would have been accepted if it were not as good by chance.
    pub by_chance: Option<ByChance>,
}

/// The best rival, where the best gains as much by chance.
#[derive(Debug, Clone)]
pub struct ByChance {
    /// The rival.
    pub entry: Entry,
    /// Share of campaigns without an effect in which a rival of its kind gains as much.
    pub chance: f64,
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
    /// What was worked out of fits as they are written.
    pub(super) written: Written<'a>,
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
            let words = matches!(column, Column::Word(..));
            if name == PART || distinct < 2 || (words && distinct * 4 > n) {
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
        let residuals = baseline_residuals(context);
        curves.extend(residuals.as_ref().and_then(|r| wave(context, &CLOCKS, r)));
        for (i, a) in numbers.iter().enumerate() {
            for b in &numbers[i + 1..] {
                curves.extend(product(data, a, b).filter(|_| n >= MIN_OF_PRODUCT));
            }
        }
        if let Some(residuals) = residuals.filter(|_| n >= MIN_OF_PRODUCT) {
            let few = |column: &Column| matches!(column, Column::Word(..)) && column.distinct() <= MAX_WORDS;
            let words: Vec<&String> =
                data.columns.iter().filter(|(_, column)| few(column)).map(|(name, _)| name).collect();
            for (k, name) in words.iter().enumerate() {
                for number in &numbers {
                    curves.extend(at_one_word(data, number, name, &residuals));
                }
                // Sessions differ from each other in their own way: see `session`.
                let others = words[k + 1..].iter().filter(|other| *name != SESSION && **other != SESSION);
                for other in others {
                    let (steps, at) = if *name == PART { (other, name) } else { (name, other) };
                    curves.extend(at_one_word(data, steps, at, &residuals));
                }
            }
        }
        curves.iter_mut().for_each(|curve| curve.silence(data));
        Self { context, candidates, curves, rows: (0..n).collect(), written: Written::default() }
    }

    /// A fit as it is written into a twin, with the context that predicts it.
    pub(super) fn stated(&self, fitted: &Fitted) -> (Context<'a>, Fitted) {
        self.written.stated(self.context, fitted)
    }

    /// Errors on held-out labels of the twin that is written for a fit, by pull of `rows`. What traces show is held, which is fast.
    pub(super) fn held_out(
        &self,
        fitted: &Fitted,
        repetitions: &[Vec<usize>],
        rows: &[usize],
    ) -> Vec<(usize, f64)> {
        self.written.held_out(self.context, fitted, repetitions, rows)
    }

    /// Id of an effect, or the columns of a curve.
    pub fn name_of(&self, rival: &ModelTerm) -> String {
        match rival {
            ModelTerm::Effect(i) | ModelTerm::ByPart(i) => self.candidates[*i].spec.id.into(),
            ModelTerm::Curve(k) => self.curves[*k].name.clone(),
        }
    }

    /// How many terms of a fit are those of effect `i`: one, or one for each part.
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
        let mut accepted = Accepted {
            fitted: baseline.clone(),
            effects: vec![],
            curves: vec![],
            entries: first.clone(),
            by_chance: None,
        };
        // Worked out for a campaign that has something to judge.
        let null = OnceCell::new();
        let chance = |e: &Entry| {
            let shuffled = null.get_or_init(|| self.null_gains(&baseline)).p_value(&e.rival, e.gain);
            shuffled.max(self.zero_chance(&baseline, e))
        };
        let Some(mut winner) = self.winner(&baseline, &first, (FIRST_GAIN, CURVE_GAIN), &chance) else {
            let best = self.winner(&baseline, &first, (NAMED_GAIN, CURVE_GAIN), &|_| 0.0);
            accepted.by_chance = best.map(|entry| ByChance { chance: chance(&entry), entry });
            return Some((baseline, accepted));
        };
        if let Some(i) = winner.rival.effect()
            && let Some(curve) = self.misfit(&baseline, &winner, i, &tick)
        {
            winner = curve;
        }
        self.accept(&mut accepted, &winner, &first);
        for _ in 0..MAX_EFFECTS {
            let without: Vec<usize> = accepted.effects.iter().map(|(i, _)| *i).collect();
            let terms = accepted.fitted.terms.clone();
            let mut rivals = self.all(&without);
            rivals.retain(|r| self.stands_beside(r, &without, &accepted.curves));
            let entries = self.compete(&accepted.fitted, &terms, &rivals, &tick);
            let Some(winner) =
                self.winner(&accepted.fitted, &entries, (SECOND_GAIN, CURVE_GAIN + 1.0), &|_| 0.0)
            else {
                break;
            };
            // One unnamed curve at most.
            let full = match winner.rival {
                ModelTerm::Curve(_) => !accepted.curves.is_empty(),
                ModelTerm::Effect(_) | ModelTerm::ByPart(_) => accepted.effects.len() >= MAX_EFFECTS,
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
            ModelTerm::Curve(i) => accepted.curves.push(i),
            ModelTerm::Effect(i) | ModelTerm::ByPart(i) => {
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

/// What the baseline leaves of each pull, bad ones not by more than three deviations.
fn baseline_residuals(context: &Context<'_>) -> Option<Vec<f64>> {
    let rows: Vec<usize> = (0..context.data.len()).collect();
    let baseline = context.fit(&context.base, &Terms::default(), &rows)?;
    let most = 3.0 * baseline.likelihood.scale;
    Some(baseline.residuals.iter().map(|r| r.clamp(-most, most)).collect())
}

/// The sine in the first clock that was written down that fits the residuals of the baseline best.
fn wave(context: &Context<'_>, clocks: &[&str], residuals: &[f64]) -> Option<Curve> {
    let name = *clocks.iter().find(|name| context.data.columns.contains_key(**name))?;
    periodic(name, &context.data.numbers(name)?, residuals)
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
