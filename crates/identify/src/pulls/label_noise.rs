//! How noisy a force sensor is of which there are labels alone, and how fast jaws slide then.
//!
//! A label is the last reading near the command, so a noisy sensor reads it higher, by one or two deviations, and scatters it where the
//! friction hardly does: at small forces. Together they are known from an offset of the friction or of the sensor, which moves labels
//! without scattering them. What was taken for granted instead came back as such an offset.

use super::context::Context;
use super::terms::Terms;
use gripgen_twin::predict::PullModel;
use std::sync::Mutex;

/// Noises that are tried, in newtons: a factor of 1.5 apart.
const TRIED_N: [f64; 9] = [TRIED_FROM_N, 0.05, 0.08, 0.12, 0.18, 0.27, 0.4, 0.6, TRIED_TO_N];

/// The least of them and the largest: what lies beyond is not found.
pub(super) const TRIED_FROM_N: f64 = 0.03;
pub(super) const TRIED_TO_N: f64 = 0.9;

/// Standard deviation of the logarithm of a sensor's noise about what a twin says of it: recorded forces of URs have 0.07 to
/// 0.19 N in quiet stretches, and more while they move.
const KNOWN: f64 = 0.7;

/// Dampings that are tried beside that of the twin. A tool that slides fast is at the stop before the command is far enough ahead for
/// a noisy reading to be the label: labels then rise with the rate of the pull, and in the place of the rig's damping friction would.
const DAMPINGS_N_S_PER_M: [f64; 3] = [60.0, 130.0, 300.0];

/// Noises that are tried with them, by places from the best one with the twin's damping: fewer readings are chosen for their
/// noise, so that there is more of it.
const NOISIER: [usize; 2] = [0, 2];

/// Factor from the best of them to the two that are tried beside it.
const NEARER: f64 = 1.4;

/// Standard deviation of the logarithm of a damping about that of the twin: from the shipped 2000 N s/m the 100 of light arms are
/// two away.
const DAMPED: f64 = 1.5;

/// Loss of log-likelihood at the ends of a 90 % interval.
const HALF_CHI_SQUARED: f64 = 1.353;

/// A fit with a noise and a damping: logarithm of the noise, log-likelihood with what is believed of both, model.
type Tried = (f64, f64, PullModel);

impl Context<'_> {
    /// The baseline with lag, dead time, damping and noise that labels say, and the 90 % interval of the noise (profile likelihood).
    pub(super) fn noise_of_labels(&self, rows: &[usize]) -> Option<(PullModel, (f64, f64))> {
        let given_n = self.base.noise_n.clamp(TRIED_FROM_N, TRIED_TO_N);
        let given = libm::log(given_n);
        let noises = if self.knows_noise { vec![given_n] } else { TRIED_N.to_vec() };
        // Fits with lag and dead time free are most of what a diagnosis of labels takes: but for the first, each begins at one that is
        // near, and threads share them.
        let at = |log_noise: f64, damping_n_s_per_m: f64, near: Option<&PullModel>| {
            let start = near.unwrap_or(&self.base).clone();
            let start = PullModel { noise_n: libm::exp(log_noise), damping_n_s_per_m, ..start };
            let found = match near {
                Some(_) => self.fit_near(&start, &Terms::default(), rows)?,
                None => self.fit(&start, &Terms::default(), rows)?,
            };
            let noisy = log_noise_prior(log_noise - given);
            let damped = libm::log(damping_n_s_per_m / self.given_damping_n_s_per_m) / DAMPED;
            let score = found.likelihood.log - found.trace_cost + noisy - 0.5 * damped * damped;
            Some((log_noise, score, found.model))
        };
        let all = |places: &[(usize, f64)], near: &[Tried]| -> Vec<Tried> {
            let slots: Vec<Mutex<Option<Tried>>> = places.iter().map(|_| Mutex::new(None)).collect();
            self.predictor.for_each(slots.len(), &|k| {
                let log_noise = libm::log(noises[places[k].0]);
                let from = |t: &&Tried| (t.0 - log_noise).abs();
                let near = near.iter().min_by(|a, b| from(a).total_cmp(&from(b)));
                let found = at(log_noise, places[k].1, near.map(|t| &t.2));
                if let Ok(mut slot) = slots[k].lock() {
                    *slot = found;
                }
            });
            slots.into_iter().filter_map(|slot| slot.into_inner().ok().flatten()).collect()
        };
        let given_damping = self.given_damping_n_s_per_m;
        let noise_of = |t: &Tried| noises.iter().position(|noise_n| libm::log(*noise_n) == t.0);
        let most_likely = |tried: &[Tried]| tried.iter().max_by(|a, b| a.1.total_cmp(&b.1)).cloned();
        let away = |k: &usize| (libm::log(noises[*k]) - given).abs();
        let first = (0..noises.len()).min_by(|a, b| away(a).total_cmp(&away(b)))?;
        let mut tried = all(&[(first, given_damping)], &[]);
        let others = (0..noises.len()).filter(|k| *k != first).map(|k| (k, given_damping));
        tried.extend(all(&others.collect::<Vec<_>>(), &tried));
        tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        if !self.predictor.winds_up() {
            let noise = noise_of(&most_likely(&tried)?)?;
            let lighter = DAMPINGS_N_S_PER_M.into_iter().filter(|d| *d < given_damping);
            let places = lighter.flat_map(|d| NOISIER.map(|k| ((noise + k).min(noises.len() - 1), d)));
            tried.extend(all(&places.collect::<Vec<_>>(), &tried));
        }
        let near = most_likely(&tried)?;
        if near.2.damping_n_s_per_m != given_damping {
            let (noise, damping) = (noise_of(&near)?, near.2.damping_n_s_per_m);
            tried.extend(all(&[damping / NEARER, damping * NEARER].map(|d| (noise, d)), &[near]));
        }
        let damping = most_likely(&tried)?.2.damping_n_s_per_m;
        tried.retain(|t| t.2.damping_n_s_per_m == damping);
        let known: Vec<usize> = tried.iter().filter_map(noise_of).collect();
        if damping != given_damping {
            let others = (0..noises.len()).filter(|k| !known.contains(k));
            tried.extend(all(&others.map(|k| (k, damping)).collect::<Vec<_>>(), &tried));
            tried.sort_by(|a, b| a.0.total_cmp(&b.0));
        }
        let best = (0..tried.len()).max_by(|&a, &b| tried[a].1.total_cmp(&tried[b].1))?;
        let peak = match (best.checked_sub(1).map(|k| &tried[k]), tried.get(best + 1)) {
            (Some(below), Some(above)) => summit([below, &tried[best], above].map(|t| (t.0, t.1))),
            _ => tried[best].0,
        };
        let (log_noise, most, model) = at(peak, damping, Some(&tried[best].2))
            .filter(|found| found.1 >= tried[best].1)
            .unwrap_or_else(|| tried[best].clone());
        let profile: Vec<(f64, f64)> = tried.iter().map(|t| (t.0, t.1 - most + HALF_CHI_SQUARED)).collect();
        let low = end(profile.iter().filter(|t| t.0 < log_noise).rev(), log_noise);
        let high = end(profile.iter().filter(|t| t.0 > log_noise), log_noise);
        Some((model, (libm::exp(low), libm::exp(high))))
    }
}

/// What is believed of a noise: the logarithm of its density, by how far its logarithm is from that of the twin's.
pub(super) fn log_noise_prior(away: f64) -> f64 {
    -0.5 * (away / KNOWN) * (away / KNOWN)
}

/// Where the parabola through three points is highest.
fn summit([a, b, c]: [(f64, f64); 3]) -> f64 {
    let (left, right) = ((b.1 - a.1) / (b.0 - a.0), (c.1 - b.1) / (c.0 - b.0));
    let bend = (right - left) / (0.5 * (c.0 - a.0));
    if bend < 0.0 { (0.5 * (a.0 + b.0) - left / bend).clamp(a.0, c.0) } else { b.0 }
}

/// Where a profile goes through nothing on its way from the best value; the last point where it does not.
fn end<'a>(points: impl Iterator<Item = &'a (f64, f64)>, best: f64) -> f64 {
    let mut inside = (best, HALF_CHI_SQUARED);
    for &(x, left) in points {
        if left < 0.0 {
            return inside.0 + (x - inside.0) * inside.1 / (inside.1 - left);
        }
        inside = (x, left);
    }
    inside.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A parabola has its summit at its middle, and its interval where it has lost 1.353.
    #[test]
    fn the_summit_and_the_ends_are_those_of_a_parabola() {
        let of = |x: f64| (x, -0.5 * (x - 0.3) * (x - 0.3) / 0.04);
        assert!((summit([of(0.0), of(0.25), of(0.7)]) - 0.3).abs() < 1e-9);
        let points: Vec<(f64, f64)> =
            (1..400).map(|k| of(0.3 + 0.002 * f64::from(k))).map(|p| (p.0, p.1 + HALF_CHI_SQUARED)).collect();
        assert!((end(points.iter(), 0.3) - 0.3 - 1.645 * 0.2).abs() < 2e-3);
    }
}
