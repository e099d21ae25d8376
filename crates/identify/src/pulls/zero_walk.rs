//! What the zero of the sensor was in pulls without a trace: between two traces a zero that wanders slowly is known nearly, and labels and slips are
//! read with it. Left in them, a walk of 0.15 N is a bias, a drift or a contamination that labels testify to.
//!
//! The zero, less what a model says of it, is a stationary AR(1) process over the pulls about a mean, with something of its own in each. How far and how long it wanders,
//! whether it begins anew with a session, and whether it is that of the sensor or that of the pull (pulls in the other direction then have the other
//! sign), are most likely for the readings without a load; the rest is the smoother of Rauch, Tung and Striebel (1965). What a zero that walks has beside
//! its own in each pull is taken off: that may go with what was set, like the grip force, and then belongs to what the parts are found to hold.

/// A reading without a load less its prediction, and the standard deviation of its noise.
pub(super) type Zero = Option<(f64, f64)>;

/// How the zero of a sensor wanders.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct ZeroWalk {
    /// Standard deviation of the slow part.
    sd_n: f64,
    /// Correlation of neighbouring pulls.
    keep: f64,
    /// Standard deviation of what each pull has of its own.
    own_n: f64,
    /// Whether it begins anew with each session.
    anew: bool,
    /// Whether it has the other sign in pulls in the other direction.
    turns: bool,
}

/// Mean and slow part of the zero in a pull.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct SlowZero {
    pub mean_n: f64,
    pub variance_n2: f64,
}

/// What readings say of a walk, one after the other.
struct Filtered {
    /// Of each pull by those before it, and with its own.
    before: Vec<SlowZero>,
    with: Vec<SlowZero>,
    /// What is new in each reading, in that of a mean of one newton, and the variance of both.
    new: Vec<(f64, f64, f64)>,
}

impl Filtered {
    /// The most likely mean.
    fn mean_n(&self) -> f64 {
        let sum = |of: &dyn Fn(&(f64, f64, f64)) -> f64| self.new.iter().map(of).sum::<f64>();
        sum(&|(new, one, v)| new * one / v) / sum(&|(_, one, v)| one * one / v)
    }

    /// Logarithm of the likelihood of all readings, whatever the mean (restricted: Patterson and Thompson 1971).
    fn log_likelihood(&self) -> f64 {
        let mean_n = self.mean_n();
        let sum = |of: &dyn Fn(&(f64, f64, f64)) -> f64| self.new.iter().map(of).sum::<f64>();
        let information = sum(&|(_, one, v)| one * one / v);
        -0.5 * (sum(&|(new, one, v)| (new - mean_n * one).powi(2) / v + libm::log(*v))
            + libm::log(information))
    }
}

/// What a walk is looked for in.
pub(super) struct Pulls<'a> {
    /// Session of each pull.
    pub session_of: &'a [usize],
    /// Whether each pull goes in the other direction.
    pub turned: Vec<bool>,
}

/// Fewest readings without a load that say how it wanders.
const MIN_READINGS: usize = 6;

/// Logarithm of the likelihood that a walk has to gain over a zero that has nothing but its own in each pull: a walk has two parameters more (Akaike 1974).
const PRICE: f64 = 2.0;

/// Values that are tried: deviations of the slow part and of each pull's own, and pulls over which the slow part falls to 1/e.
const SLOW_N: [f64; 10] = [0.03, 0.05, 0.08, 0.12, 0.2, 0.3, 0.5, 0.8, 1.3, 2.0];
const OWN_N: [f64; 5] = [0.02, 0.04, 0.08, 0.15, 0.3];
const LENGTHS: [f64; 6] = [2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

impl ZeroWalk {
    /// The most likely one, if a walk is more likely than none.
    pub fn likely(zeros: &[Zero], pulls: &Pulls<'_>) -> Option<Self> {
        if zeros.iter().flatten().count() < MIN_READINGS {
            return None;
        }
        let log = |walk: &Self| walk.filtered(zeros, pulls).log_likelihood();
        let still = OWN_N.map(|own_n| Self { sd_n: 0.0, keep: 0.0, own_n, anew: false, turns: false });
        let none = still.iter().map(log).fold(f64::NEG_INFINITY, f64::max);
        let both = [false, true];
        let turns = if pulls.turned.iter().any(|t| *t) { &both[..] } else { &both[..1] };
        let sessions = pulls.session_of.iter().any(|s| *s != pulls.session_of[0]);
        let anew = if sessions { &both[..] } else { &both[..1] };
        let mut best = (None, none + PRICE);
        for &turns in turns {
            for &anew in anew {
                for (sd_n, own_n, length) in each() {
                    let walk = Self { sd_n, keep: libm::exp(-1.0 / length), own_n, anew, turns };
                    let found = log(&walk);
                    if found > best.1 {
                        best = (Some(walk), found);
                    }
                }
            }
        }
        best.0
    }

    /// Mean and slow part in each pull.
    pub fn smoothed(&self, zeros: &[Zero], pulls: &Pulls<'_>) -> Vec<SlowZero> {
        let mean_n = self.filtered(zeros, pulls).mean_n();
        let about_mean: Vec<Zero> = (zeros.iter().enumerate())
            .map(|(i, zero)| zero.map(|(zero_n, noise_n)| (zero_n - self.sign(i, pulls) * mean_n, noise_n)))
            .collect();
        let filtered = self.filtered(&about_mean, pulls);
        let mut smooth = filtered.with;
        for i in (0..smooth.len().saturating_sub(1)).rev() {
            let (ahead, later) = (filtered.before[i + 1], smooth[i + 1]);
            let keep = if self.begins(i + 1, pulls) { 0.0 } else { self.keep };
            let back = keep * smooth[i].variance_n2 / ahead.variance_n2.max(1e-12);
            smooth[i].mean_n += back * (later.mean_n - ahead.mean_n);
            smooth[i].variance_n2 += back * back * (later.variance_n2 - ahead.variance_n2);
        }
        smooth.iter_mut().enumerate().for_each(|(i, s)| s.mean_n = self.sign(i, pulls) * (mean_n + s.mean_n));
        smooth
    }

    /// The filter of Kalman (1960).
    fn filtered(&self, zeros: &[Zero], pulls: &Pulls<'_>) -> Filtered {
        let whole = self.sd_n * self.sd_n;
        let mut found = Filtered { before: Vec::new(), with: Vec::new(), new: Vec::new() };
        // Of the zeros, and of a mean of one newton.
        let (mut now, mut one_n) = (SlowZero::default(), 0.0);
        for (i, zero) in zeros.iter().enumerate() {
            let keep = if self.begins(i, pulls) { 0.0 } else { self.keep };
            let ahead = SlowZero {
                mean_n: keep * now.mean_n,
                variance_n2: keep * keep * now.variance_n2 + (1.0 - keep * keep) * whole,
            };
            (now, one_n) = (ahead, keep * one_n);
            if let Some((zero_n, noise_n)) = zero {
                let variance = ahead.variance_n2 + self.own_n * self.own_n + noise_n * noise_n;
                let part = ahead.variance_n2 / variance;
                let (new, one) = (self.sign(i, pulls) * zero_n - ahead.mean_n, 1.0 - one_n);
                now = SlowZero {
                    mean_n: ahead.mean_n + part * new,
                    variance_n2: (1.0 - part) * ahead.variance_n2,
                };
                one_n += part * one;
                found.new.push((new, one, variance));
            }
            found.before.push(ahead);
            found.with.push(now);
        }
        found
    }

    fn begins(&self, i: usize, pulls: &Pulls<'_>) -> bool {
        i == 0 || (self.anew && pulls.session_of[i] != pulls.session_of[i - 1])
    }

    fn sign(&self, i: usize, pulls: &Pulls<'_>) -> f64 {
        if self.turns && pulls.turned[i] { -1.0 } else { 1.0 }
    }
}

fn each() -> impl Iterator<Item = (f64, f64, f64)> {
    SLOW_N.into_iter().flat_map(|sd_n| {
        OWN_N.into_iter().flat_map(move |own_n| LENGTHS.map(move |length| (sd_n, own_n, length)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;
    use nalgebra::{DMatrix, DVector};

    /// A walk of 0.15 N that falls to 1/e in ten pulls, and its readings in every fourth of `n` pulls.
    fn walk(n: usize, draws: &mut Draws) -> (Vec<f64>, Vec<Zero>) {
        let keep = libm::exp(-0.1);
        let mut at = 0.15 * draws.normal();
        let zero_n: Vec<f64> = (0..n)
            .map(|_| {
                at = keep * at + 0.15 * (1.0 - keep * keep).sqrt() * draws.normal();
                at
            })
            .collect();
        let read = |i: usize, draws: &mut Draws| Some((zero_n[i] + 0.025 * draws.normal(), 0.015));
        let zeros = (0..n).map(|i| if i % 4 == 0 { read(i, draws) } else { None }).collect();
        (zero_n, zeros)
    }

    fn pulls(session_of: &[usize]) -> Pulls<'_> {
        Pulls { session_of, turned: session_of.iter().map(|_| false).collect() }
    }

    /// Filter and smoother say what the joint normal distribution says.
    #[test]
    fn the_smoother_is_the_normal_posterior() {
        let session_of: Vec<usize> = (0..20).map(|i| i / 8).collect();
        let pulls = Pulls { session_of: &session_of, turned: (0..20).map(|i| i % 3 == 0).collect() };
        let (_, zeros) = walk(20, &mut Draws::new(3, 1));
        let walk = ZeroWalk { sd_n: 0.2, keep: 0.8, own_n: 0.04, anew: true, turns: true };
        let sign = |i: usize| if i.is_multiple_of(3) { -1.0 } else { 1.0 };
        let prior = DMatrix::from_fn(20, 20, |i, j| {
            let together = f64::from(u8::from(session_of[i] == session_of[j]));
            0.04 * together * sign(i) * sign(j) * 0.8f64.powi((i as i32 - j as i32).abs())
        });
        let seen: Vec<usize> = (0..20).filter(|i| zeros[*i].is_some()).collect();
        let read = DVector::from_iterator(seen.len(), seen.iter().map(|&i| zeros[i].unwrap().0));
        let own = DMatrix::from_fn(seen.len(), seen.len(), |i, j| {
            prior[(seen[i], seen[j])] + if i == j { 0.04f64.powi(2) + 0.015f64.powi(2) } else { 0.0 }
        });
        let across = DMatrix::from_fn(20, seen.len(), |i, j| prior[(i, seen[j])]);
        let inverse = own.clone().try_inverse().unwrap();
        let one = DVector::from_iterator(seen.len(), seen.iter().map(|&i| sign(i)));
        let information = one.dot(&(&inverse * &one));
        let about = &read - &one * (one.dot(&(&inverse * &read)) / information);
        let gain = &across * &inverse;
        let (mean, variance) = (&gain * &about, &prior - &gain * across.transpose());
        for (i, s) in walk.smoothed(&zeros, &pulls).iter().enumerate() {
            let mean_n = mean[i] + sign(i) * one.dot(&(&inverse * &read)) / information;
            assert!((s.mean_n - mean_n).abs() < 1e-12, "{i} {s:?} {mean_n}");
            assert!((s.variance_n2 - variance[(i, i)]).abs() < 1e-12, "{i} {s:?} {}", variance[(i, i)]);
        }
        let log =
            -0.5 * (about.dot(&(&inverse * &about)) + libm::log(own.determinant()) + libm::log(information));
        assert!((walk.filtered(&zeros, &pulls).log_likelihood() - log).abs() < 1e-9);
    }

    /// Of the variance of a walk that every fourth pull shows, little is left in all pulls; it is stated.
    #[test]
    fn most_of_a_walk_is_known_between_traces() {
        let mut draws = Draws::new(7, 2);
        let session_of = vec![0; 60];
        let (mut found, mut left, mut stated, mut whole) = (0, 0.0, 0.0, 0.0);
        for _ in 0..100 {
            let (zero_n, zeros) = walk(60, &mut draws);
            let Some(likely) = ZeroWalk::likely(&zeros, &pulls(&session_of)) else { continue };
            found += 1;
            for (s, zero_n) in likely.smoothed(&zeros, &pulls(&session_of)).iter().zip(&zero_n) {
                left += (s.mean_n - zero_n).powi(2);
                stated += s.variance_n2;
                whole += zero_n * zero_n;
            }
        }
        // By 15 readings the others are not sure enough.
        assert!(found > 55, "{found} of 100");
        assert!(left < 0.35 * whole, "{} is left", left / whole);
        assert!((0.6..1.5).contains(&(stated / left)), "{}", stated / left);
    }

    /// A zero that each pull has of its own is no walk, about whatever mean.
    #[test]
    fn what_each_pull_has_of_its_own_stays() {
        let mut draws = Draws::new(9, 5);
        let session_of = vec![0; 60];
        let walks = (0..100).filter(|_| {
            let zeros: Vec<Zero> =
                (0..60).map(|i| (i % 3 == 0).then(|| (0.5 + 0.2 * draws.normal(), 0.015))).collect();
            ZeroWalk::likely(&zeros, &pulls(&session_of)).is_some()
        });
        let walks = walks.count();
        assert!(walks <= 12, "{walks} of 100");
    }
}
