//! What no name explains is still learnt: a residual over several columns at once, beside the named effects. It multiplies the friction, is
//! shrunk (`evidence.rs`), and is kept where it is rarer than chance and pays on pulls, levels and sessions that it has not seen.

use super::context::Context;
use super::curves::Session;
use super::evidence::MOST;
use super::fitting::Fitted;
use super::heldout::{by_value, predicted, scatter};
use super::learnt::{grouped, learnt_beside_memory, with_residual};
use super::paying::{PAYS, held_out_n, root_mean_square, share};
use super::search::Search;
use super::smooth::smooths;
use super::terms::Terms;
use crate::diagnosis::{Residual, UnknownCovariate};

/// How often chance may look as good.
const CHANCE: f64 = 0.015;

/// Share of the error that a residual may add on held-out levels and sessions.
const WORSE: f64 = 0.01;

/// Fewest pulls.
const MIN_PULLS: usize = 16;

/// Share of what a slope of one session explains on held-out pulls that the other columns have to explain to be what acts. A slope that all of
/// two sessions share explains half of what it would in one of them, of more sessions less.
const OF_A_SESSION: f64 = 0.55;

/// Part of a residual that held-out pulls have to confirm.
const CONFIRMED: f64 = 0.4;

/// Error on the pulls that a residual was learnt from, over that on held-out pulls, at most: it is learnt by slopes, and a further group may
/// be what slopes miss of a first one that does much. Then the last groups go.
const MOST_SEEN: f64 = 1.1;

/// A residual that is kept.
pub(super) struct Kept {
    /// The model with it.
    pub fitted: Fitted,
    /// As it is reported.
    pub report: Residual,
    /// Its columns, as structure that no name explains.
    pub unknown: Vec<UnknownCovariate>,
}

/// What is left beside `fitted` in several columns at once, if it is rarer than chance and pays. `near` are the pulls that count.
pub(super) fn kept(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Kept> {
    learnt_beside(search, fitted, repetitions, near, true)
}

/// The same; with `strict` levels and sessions that are held out count too.
fn learnt_beside(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
    strict: bool,
) -> Option<Kept> {
    let context = search.context;
    let data = context.data;
    let curves = smooths(data);
    if data.len() < MIN_PULLS || curves.is_empty() {
        return None;
    }
    // What traces show of signals stays as it is, which is fast.
    let held = Terms { hold_signals: fitted.terms.act_on_signals(), ..fitted.terms.clone() };
    let plain = context.fit_again(&fitted.model, &held, &search.rows)?;
    // Memory stays that of the model without where chance decides; in the place of a curve the evidence is there already.
    let own = grouped(context, &plain, &search.rows, &curves)?;
    if strict && own.learn(1).groups.is_empty() {
        return None;
    }
    let p_value = own.p_value();
    if strict && p_value > CHANCE {
        return None;
    }
    let (left, learnt) = learnt_beside_memory(context, &plain, &search.rows, &curves, MOST)?;
    if learnt.groups.is_empty() {
        return None;
    }
    let full = with_residual(context, &plain, &search.rows, &curves, 1.0, MOST)?;
    // As much of it as held-out pulls confirm.
    let expected = context.predictor.pulls(&plain.model, &search.rows);
    let [without, with] = [&plain, &full].map(|f| search.held_out(f, repetitions, near));
    let (mut along, mut square) = (0.0, 0.0);
    for ((i, before), (k, after)) in without.iter().zip(&with) {
        if i != k {
            return None;
        }
        let sd = expected[*i].label_sd_n.max(0.03);
        let moved = (after - before) / sd;
        // A few bad pulls decide nothing.
        let error = (before / sd).clamp(-4.0, 4.0);
        along -= moved * error;
        square += moved * moved;
    }
    let confirmed = (along / square.max(1e-300)).clamp(0.0, 1.0);
    if confirmed < CONFIRMED {
        return None;
    }
    let mut chosen = with_residual(context, &plain, &search.rows, &curves, confirmed, MOST)?;
    let with = search.held_out(&chosen, repetitions, near);
    let unseen_n = root_mean_square(with.iter().map(|(_, e)| *e));
    for most in (1..learnt.groups.len()).rev() {
        if own_error_n(context, &chosen, near) <= MOST_SEEN * unseen_n {
            break;
        }
        let fewer = with_residual(context, &plain, &search.rows, &curves, confirmed, most)?;
        if own_error_n(context, &fewer, near) < own_error_n(context, &chosen, near) {
            chosen = fewer;
        }
    }
    let error = |e: &[(usize, f64)]| root_mean_square(e.iter().map(|(_, e)| *e));
    let weighed =
        |e: &[(usize, f64)]| root_mean_square(e.iter().map(|(i, e)| e / expected[*i].label_sd_n.max(0.03)));
    let gain = share([error(&without), error(&with)]);
    if gain.max(share([weighed(&without), weighed(&with)])) < PAYS
        || gain < 0.0
        || (strict && !holds(context, &plain, &chosen, near))
    {
        return None;
    }
    let mut strengths: Vec<UnknownCovariate> = Vec::new();
    for (curve, shrunk) in &chosen.terms.learnt {
        let Some(group) = curves.iter().position(|c| c == curve) else { continue };
        let coefficients: Vec<f64> = shrunk.iter().map(|c| c / confirmed).collect();
        let (covariate, strength) = (&curve.name, left.strength(group, &coefficients));
        match strengths.iter_mut().find(|u| u.covariate == *covariate) {
            Some(known) => known.strength += strength,
            None => strengths.push(UnknownCovariate { covariate: covariate.clone(), strength, p_value }),
        }
    }
    strengths.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    let report = Residual { gain, covariates: strengths.iter().map(|u| u.covariate.clone()).collect() };
    let mut fitted = chosen;
    fitted.terms.hold_signals = false;
    Some(Kept { fitted, report, unknown: strengths })
}

/// A residual in the place of the unnamed curves of `fitted`, where it predicts pulls and sessions that were held out better together:
/// a curve of few knots, or one at one word, may stand for several columns.
///
/// A session is the last explanation, because it does not come back: its steps are shrunk where that costs nothing, and a slope of its own
/// has to explain on held-out pulls what the other columns cannot.
pub(super) fn in_place_of_curves(
    search: &Search<'_>,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Kept> {
    let context = search.context;
    let terms = Terms { curves: vec![], hold_signals: fitted.terms.act_on_signals(), ..fitted.terms.clone() };
    let bare = context.fit(&fitted.model, &terms, &search.rows)?;
    let found = learnt_beside(search, &bare, repetitions, near, false)?;
    let [without, with, own] =
        [&bare, &found.fitted, fitted].map(|f| held_out_n(search, f, repetitions, near));
    let pulls = with / own.max(1e-300);
    let session = fitted.terms.curves.first().map_or(Session::Elsewhere, |(curve, _)| curve.session());
    let instead = gives_way(session, without, with, own);
    let sessions = by_value(&context.data.session_of.iter().map(|&s| s as u64).collect::<Vec<_>>());
    let together = || match (3..=20).contains(&sessions.len()) {
        true => {
            pulls * error_on(context, &found.fitted, &sessions, near)
                / error_on(context, fitted, &sessions, near).max(1e-300)
        }
        false => pulls,
    };
    (instead || pulls < 1.0 || (pulls <= 1.0 + PAYS && together() < 1.0)).then_some(found)
}

/// Whether a curve of sessions gives way to what the other columns say: from the errors on held-out pulls without either, with the other
/// columns, and with the curve.
fn gives_way(session: Session, without: f64, columns: f64, curve: f64) -> bool {
    let explained = |error: f64| without * without - error * error;
    match session {
        Session::Elsewhere => false,
        Session::Steps => columns <= (1.0 + PAYS) * curve,
        Session::Slope => explained(columns) > OF_A_SESSION * explained(curve).max(0.0),
    }
}

/// Error on the pulls of `near`, which the fit has seen.
fn own_error_n(context: &Context<'_>, fitted: &Fitted, near: &[usize]) -> f64 {
    let mut model = fitted.model.clone();
    model.scatter = scatter(&model, fitted.likelihood.scale);
    let labels_n = context.labels_n(&model, near);
    root_mean_square(near.iter().zip(labels_n).map(|(&i, label_n)| label_n - context.data.label_n[i]))
}

/// Error on sets that are held out, of the pulls of `near`.
fn error_on(context: &Context<'_>, fitted: &Fitted, sets: &[Vec<usize>], near: &[usize]) -> f64 {
    let labels = predicted(context, fitted, sets, true);
    let known = near.iter().map(|&i| labels[i] - context.data.label_n[i]).filter(|e| e.is_finite());
    root_mean_square(known)
}

/// Whether levels and sessions that were held out are predicted no worse with a residual, where there are enough of them.
fn holds(context: &Context<'_>, plain: &Fitted, with: &Fitted, near: &[usize]) -> bool {
    let data = context.data;
    let force: Vec<u64> = data.measured.pulls.iter().map(|p| p.grip_force_n.to_bits()).collect();
    let session: Vec<u64> = data.session_of.iter().map(|&s| s as u64).collect();
    [by_value(&force), by_value(&session)].iter().all(|sets| {
        if !(3..=20).contains(&sets.len()) {
            return true;
        }
        let errors = [plain, with].map(|f| error_on(context, f, sets, near));
        share(errors) >= -WORSE
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Humidity and temperature explain three fifths of what a slope of the warmest of three sessions does: they are what acts. A slope that
    /// acts in one of two sessions is half explained by one that both share, and stays.
    #[test]
    fn a_session_is_the_last_explanation() {
        let error = |left: f64| left.sqrt();
        assert!(gives_way(Session::Slope, 1.0, error(0.4), error(0.0)));
        assert!(!gives_way(Session::Slope, 1.0, error(0.5), error(0.0)));
        assert!(!gives_way(Session::Slope, 1.0, 1.01, error(0.2)));
        assert!(gives_way(Session::Steps, 1.0, 0.51, 0.5));
        assert!(!gives_way(Session::Steps, 1.0, 0.53, 0.5));
        assert!(!gives_way(Session::Elsewhere, 1.0, 0.1, 0.5));
    }
}
