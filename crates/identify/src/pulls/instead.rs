//! Beside a dependence without a name, what is tied with a name may explain more together with it: humid heat looks like a step of friction
//! in the coldest hours beside a slope of the humidity, until the temperature stands beside both.

use super::fitting::Fitted;
use super::paying::{PAYS, held_out_n, paying, share};
use super::residual::{Kept, in_place_of_curves};
use super::search::{Accepted, Search, TIED_WITHIN, Tied};

/// An answer with a tied rival in the place of a name.
pub(super) struct Instead {
    /// What is accepted then.
    pub accepted: Accepted,
    /// What was learnt in the place of its curve.
    pub left: Option<Kept>,
}

/// The rival of a name whose model, with a curve or what is learnt in its place, predicts held-out pulls best, if that is better than `fitted`
/// does, the model of now. `accepted` has its curve; `near` are the pulls that count.
pub(super) fn tied_instead(
    search: &Search<'_>,
    before: &Fitted,
    accepted: &Accepted,
    fitted: &Fitted,
    repetitions: &[Vec<usize>],
    near: &[usize],
) -> Option<Instead> {
    let error_n = |f: &Fitted| held_out_n(search, f, repetitions, near);
    let now_n = error_n(fitted);
    let places = accepted.effects.iter().enumerate();
    let rivals = places.flat_map(|(place, (_, tied))| tied.iter().map(move |rival| (place, rival)));
    let each = rivals.filter_map(|(place, rival)| {
        let with = in_the_place_of(search, accepted, place, rival)?;
        let (effects, curves) = (with.effects.len(), with.curves.len());
        let (mut with, _) = paying(search, before, with, repetitions, near);
        if with.effects.len() < effects || with.curves.len() < curves {
            return None;
        }
        let left = in_place_of_curves(search, &with.fitted, repetitions, near);
        let own_n = error_n(left.as_ref().map_or(&with.fitted, |l| &l.fitted));
        // What is held out says by how much it is the better one, in the units of a score.
        let ahead = near.len() as f64 * libm::log(now_n / own_n.max(1e-300));
        let tied = &mut with.effects.last_mut()?.1;
        tied.iter_mut().for_each(|t| t.less -= rival.less + ahead);
        tied.retain(|t| t.less > -TIED_WITHIN);
        if left.is_some() {
            with.curves.clear();
        }
        Some((own_n, Instead { accepted: with, left }))
    });
    let (best_n, best) = each.min_by(|a, b| a.0.total_cmp(&b.0))?;
    (share([now_n, best_n]) >= PAYS).then_some(best)
}

/// With a rival in the place of the name there, which is tied with it then. `None` if the rival was fitted beside something that is gone since.
fn in_the_place_of(search: &Search<'_>, accepted: &Accepted, place: usize, rival: &Tied) -> Option<Accepted> {
    let mut with = Accepted { fitted: search.freed(&rival.fitted), ..accepted.clone() };
    let (name, mut tied) = with.effects.remove(place);
    tied.retain(|t| t.effect != rival.effect);
    tied.push(Tied { effect: name, less: 0.0, fitted: accepted.fitted.clone() });
    with.effects.push((rival.effect, tied));
    let terms = &with.fitted.terms;
    let known = |e: &(usize, Vec<Tied>)| search.candidates[e.0].spec;
    let same = terms.effects.iter().all(|(c, _)| with.effects.iter().any(|e| known(e) == c.spec))
        && with.effects.iter().all(|e| terms.effects.iter().any(|(c, _)| c.spec == known(e)))
        && terms.curves.len() == with.curves.len();
    same.then_some(with)
}
