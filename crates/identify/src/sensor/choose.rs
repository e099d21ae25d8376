//! From scores to names: one effect after the other, then what they cannot be told apart from.

use super::SensorOptions;
use super::candidates::Kind;
use super::moments::Model;
use super::search::{Round, Score, Weighing, Workspace};
use crate::draws::Draws;
use crate::statistics::mean_and_error;

/// Most effects and curves in an answer.
const MAX_PICKED: usize = 3;
/// Chance of a further effect where there is none.
const FURTHER_FALSE_ALARM: f64 = 0.01;
/// A further effect explains at least this part of what the first one does; less is the first one's formula. One that acts through
/// other covariates than all that were picked may be smaller.
const MIN_SHARE: f64 = 0.06;
const MIN_SHARE_OF_OTHERS: f64 = 0.02;
/// Chance of a first effect where there is none, where only blocks decide: they are few, and what they cannot decide is
/// said beside the name.
const BLOCKS_FALSE_ALARM: f64 = 0.1;
/// Where only blocks decide: what is less significant by itself is none.
const MAX_P_VALUE: f64 = 0.1;
/// An effect that explains this part of what a free curve in its own covariate does has the right name.
const SAME_SHAPE: f64 = 0.6;

/// An effect with fewer parameters that explains this part of what another one does is the better name.
const NEARLY: f64 = 0.92;

/// What was chosen.
#[derive(Debug, Clone, Default)]
pub(crate) struct Choice {
    /// Candidates and points of their grids, in the order in which they were found.
    pub picked: Vec<(usize, usize)>,
    /// P-value of each.
    pub p_values: Vec<f64>,
    /// All candidates against the baseline.
    pub first: Option<Round>,
}

/// An effect that is as good as one that was chosen.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tie {
    pub candidate: usize,
    pub weight: f64,
}

/// The model with everything that was picked.
pub(crate) fn model_of(ws: &Workspace<'_>, picked: &[(usize, usize)]) -> Model {
    picked.iter().fold(Model::baseline(), |model, &(k, point)| ws.candidates[k].points[point].1.on(&model))
}

/// Everything that was picked but for one.
pub(crate) fn without(picked: &[(usize, usize)], at: usize) -> Vec<(usize, usize)> {
    (0..picked.len()).filter(|&i| i != at).map(|i| picked[i]).collect()
}

/// Chooses greedily by the noise that all smooth effects together leave, takes out again what slow noise explains as well beside the
/// others, then looks once whether another one fits better in the place of each.
///
/// Slow noise that is fitted beside one effect of two takes the other one in, and explains the first as well: each is asked for
/// with the other one in its place.
pub(crate) fn choose(ws: &mut Workspace<'_>, options: &SensorOptions) -> Choice {
    let mut choice = Choice::default();
    let mut first_gain = 0.0;
    let mut rounds = Vec::new();
    for turn in 0..MAX_PICKED {
        let base = model_of(ws, &choice.picked);
        let skip: Vec<usize> = choice.picked.iter().map(|p| p.0).collect();
        let round = ws.round(&base, &skip, options.simulations, options.seed);
        let alarm = alarm(ws, turn, options);
        let picked = pick(ws, &base, &round);
        let found = picked.and_then(|k| {
            let score = round.scores[k].as_ref()?;
            let after = ws.candidates[k].points[score.point].1.on(&base);
            let better: f64 = ws.held_out_gain(&base, &after).iter().sum();
            let family_p = match ws.weighing {
                Weighing::Blocks => round.family_p(score.p_value, ws.candidates[k].is_effect()),
                Weighing::Likelihood => round.family_p(score.p_value, false),
            };
            (better > 0.0 && family_p <= alarm).then_some((k, score.point, score.gain, score.p_value))
        });
        rounds.push(round);
        let Some((k, point, gain, p_value)) = found else { break };
        if turn == 0 {
            first_gain = gain;
        } else if gain < least_share(ws, &choice.picked, k) * first_gain || is_misfit(ws, &choice.picked, k) {
            break;
        }
        choice.picked.push((k, point));
        choice.p_values.push(p_value);
    }
    if ws.weighing == Weighing::Likelihood {
        beyond_slow_noise(ws, &mut choice, &rounds, options);
    }
    choice.first = rounds.into_iter().next();
    exchange(ws, &mut choice);
    if ws.weighing == Weighing::Likelihood {
        let noise = ws.noise_of(&model_of(ws, &choice.picked));
        ws.weigh(noise);
    }
    choice
}

/// Part of the first gain that a further effect or curve has to explain.
fn least_share(ws: &Workspace<'_>, picked: &[(usize, usize)], k: usize) -> f64 {
    let through = |k: usize| ws.candidates[k].acts_through();
    let apart = picked.iter().all(|&(p, _)| through(p).iter().all(|c| !through(k).contains(c)));
    if ws.candidates[k].is_effect() && apart { MIN_SHARE_OF_OTHERS } else { MIN_SHARE }
}

/// Chance of one more where there is none.
fn alarm(ws: &Workspace<'_>, turn: usize, options: &SensorOptions) -> f64 {
    match (turn, ws.weighing) {
        (0, Weighing::Likelihood) => options.false_alarm,
        (0, Weighing::Blocks) => BLOCKS_FALSE_ALARM,
        _ => FURTHER_FALSE_ALARM,
    }
}

/// Takes out, one after the other, what is picked and gains too little over noise that is fitted without it, the least likely first.
/// `rounds` are those in which they were picked.
fn beyond_slow_noise(ws: &Workspace<'_>, choice: &mut Choice, rounds: &[Round], options: &SensorOptions) {
    let mut turns: Vec<usize> = (0..choice.picked.len()).collect();
    while !choice.picked.is_empty() {
        let with = model_of(ws, &choice.picked);
        let chance = |at: usize| {
            let (k, turn) = (choice.picked[at].0, turns[at]);
            let others = without(&choice.picked, at);
            let gain = ws.profile_gain(&model_of(ws, &others), &with);
            let p_value = rounds[turn].p_of(k, gain).max(choice.p_values[at]);
            let place = if others.is_empty() { 0 } else { turn };
            rounds[turn].family_p(p_value, false) / alarm(ws, place, options)
        };
        let chances: Vec<f64> = (0..choice.picked.len()).map(chance).collect();
        let worst = (0..chances.len()).max_by(|&a, &b| chances[a].total_cmp(&chances[b]));
        let Some(worst) = worst.filter(|&at| chances[at] > 1.0) else { return };
        choice.picked.remove(worst);
        choice.p_values.remove(worst);
        turns.remove(worst);
    }
}

/// A curve in the own covariate of an effect that was picked is what the effect's formula leaves.
fn is_misfit(ws: &Workspace<'_>, picked: &[(usize, usize)], k: usize) -> bool {
    let curve = &ws.candidates[k];
    let named =
        |p: usize| ws.candidates[p].is_effect() && ws.candidates[p].acts_through().contains(&curve.name());
    !curve.is_effect() && picked.iter().any(|&(p, _)| named(p))
}

/// The best effect, or the best curve where it is clearly better.
fn pick(ws: &Workspace<'_>, base: &Model, round: &Round) -> Option<usize> {
    let blocks = ws.weighing == Weighing::Blocks;
    let counts = |score: &Score| !blocks || (score.p_value <= MAX_P_VALUE && ws.is_worth(score));
    let best = |effects: bool| {
        let scored = (0..ws.candidates.len()).filter(|&k| ws.candidates[k].is_effect() == effects);
        scored
            .filter_map(|k| Some((k, round.scores[k].as_ref()?)))
            .filter(|(_, score)| counts(score))
            .max_by(|a, b| a.1.evidence.total_cmp(&b.1.evidence))
    };
    let (effect, curve) = (best(true).map(|b| simpler(ws, round, b)), best(false));
    let (Some((e, named)), Some((c, free))) = (effect, curve) else { return effect.or(curve).map(|b| b.0) };
    // Where the noise is no plain noise, every free curve finds something: a name that holds goes first.
    if blocks || named.evidence >= free.evidence {
        return Some(e);
    }
    let at = |k: usize, point: usize| ws.candidates[k].points[point].1.on(base);
    let (with_effect, with_curve) = (at(e, named.point), at(c, free.point));
    let (mean, error) = mean_and_error(&ws.held_out_gain(&with_effect, &with_curve));
    let clearly = mean > error && free.evidence > named.evidence + 3.0;
    let same = ws.candidates[e].acts_through().contains(&ws.candidates[c].name());
    let right_name = same && named.gain >= SAME_SHAPE * free.gain;
    Some(if clearly && !right_name { c } else { e })
}

/// The effect with the fewest parameters among those that explain nearly as much as the best.
fn simpler<'r>(ws: &Workspace<'_>, round: &'r Round, best: (usize, &'r Score)) -> (usize, &'r Score) {
    let parameters = |k: usize| match ws.candidates[k].kind {
        Kind::Effect(spec) => spec.parameters.len() - spec.references.len(),
        Kind::Curve(_) => usize::MAX,
    };
    (0..ws.candidates.len())
        .filter(|&k| parameters(k) < parameters(best.0))
        .filter_map(|k| Some((k, round.scores[k].as_ref()?)))
        .filter(|(_, score)| strength(ws, score) >= NEARLY * strength(ws, best.1))
        .max_by(|a, b| strength(ws, a.1).total_cmp(&strength(ws, b.1)))
        .unwrap_or(best)
}

/// Looks whether another effect fits better in the place of one that was picked, given the others.
fn exchange(ws: &Workspace<'_>, choice: &mut Choice) {
    for at in 0..choice.picked.len() {
        if !ws.candidates[choice.picked[at].0].is_effect() {
            continue;
        }
        let others = without(&choice.picked, at);
        let base = model_of(ws, &others);
        let skip: Vec<usize> = others.iter().map(|p| p.0).collect();
        let round = ws.round(&base, &skip, 0, 0);
        let best = (0..ws.candidates.len())
            .filter(|&k| ws.candidates[k].is_effect())
            .filter_map(|k| Some((k, round.scores[k].as_ref()?)))
            .max_by(|a, b| strength(ws, a.1).total_cmp(&strength(ws, b.1)));
        if let Some((k, score)) = best {
            let now =
                round.scores[choice.picked[at].0].as_ref().map_or(f64::NEG_INFINITY, |s| strength(ws, s));
            if k == choice.picked[at].0 || strength(ws, score) * NEARLY > now + 1.0 {
                choice.picked[at] = (k, score.point);
            }
        }
    }
}

fn strength(ws: &Workspace<'_>, score: &Score) -> f64 {
    match ws.weighing {
        Weighing::Likelihood => score.gain,
        Weighing::Blocks => score.held_out.iter().sum(),
    }
}

/// Effects that predict held-out blocks as well as the one picked at `at`, within one paired standard error, and the
/// weight of that one: shares of the resampled data in which each is the best.
pub(crate) fn ties(ws: &Workspace<'_>, picked: &[(usize, usize)], at: usize, seed: u64) -> (f64, Vec<Tie>) {
    let others = without(picked, at);
    let base = model_of(ws, &others);
    let best = ws.candidates[picked[at].0].points[picked[at].1].1.on(&base);
    let skip: Vec<usize> = picked.iter().map(|p| p.0).collect();
    let round = ws.round(&base, &skip, 0, seed);
    let mut rivals: Vec<(usize, Vec<f64>, bool)> = Vec::new();
    let gained: f64 = ws.held_out_gain(&base, &best).iter().sum();
    for (k, score) in round.scores.iter().enumerate() {
        let Some(score) = score.as_ref().filter(|_| ws.candidates[k].is_effect()) else { continue };
        let rival = ws.candidates[k].points[score.point].1.on(&base);
        let difference = ws.held_out_gain(&best, &rival);
        let (mean, error) = mean_and_error(&difference);
        let own: f64 = ws.held_out_gain(&base, &rival).iter().sum();
        let tied = mean > -error && own > 0.25 * gained && own > 0.0;
        rivals.push((k, difference, tied));
    }
    let blocks = rivals.first().map_or(0, |r| r.1.len());
    let mut wins = vec![0_usize; rivals.len()];
    let mut draws = Draws::new(seed, 31);
    const RESAMPLES: usize = 1000;
    for _ in 0..RESAMPLES {
        let weight: Vec<f64> = (0..blocks).map(|_| -libm::log(draws.uniform())).collect();
        let sums = rivals.iter().map(|r| r.1.iter().zip(&weight).map(|(d, w)| d * w).sum::<f64>());
        let top = sums.enumerate().filter(|(i, _)| rivals[*i].2).max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, sum)) = top {
            wins[i] += usize::from(sum > 0.0);
        }
    }
    let share = |n: usize| n as f64 / RESAMPLES as f64;
    let mut tied: Vec<Tie> = rivals
        .iter()
        .zip(&wins)
        .filter(|(r, _)| r.2)
        .map(|(r, &n)| Tie { candidate: r.0, weight: share(n) })
        .collect();
    tied.sort_by(|a, b| b.weight.total_cmp(&a.weight));
    (1.0 - share(wins.iter().sum()), tied)
}
