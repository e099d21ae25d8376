//! The next pulls: those that best separate models which the data at hand do not tell apart.
//!
//! Suppose that rival a is true. Rival b is then refitted to old and new pulls together, and what remains between them is
//!
//! ```text
//! T_ab = min over d of  sum_i (y_a,i - y_b,i - J_b,i d)^2 / s_i^2  +  d' M_b d
//! ```
//!
//! with predictions y, derivatives J_b of b, noise s and the information M_b that the old pulls hold on b's parameters: the
//! T-criterion of Atkinson and Fedorov (Biometrika 62, 1975), linear around the fits. Pull after pull is chosen as in Box and
//! Hill (Technometrics 9, 1967), who weigh all pairs of rivals, here by what a pull takes off the bound
//! w_a w_b exp(-T_ab / 8) on the probability of taking one for the other (Bhattacharyya, for equal noise), per minute of the
//! robot's time: a pair that is separated no longer draws pulls.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// A pull that could be made.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CandidatePull {
    /// Standard deviation of its label, scatter included.
    pub noise_n: f64,
    /// What it costs.
    pub minutes: f64,
}

/// A model that the data at hand do not rule out, fitted to them.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparableRival {
    /// Its share of the evidence.
    pub weight: f64,
    /// What it predicts for each candidate.
    pub predicted_n: DVector<f64>,
    /// Derivatives of that by its parameters: candidates x parameters.
    pub jacobian: DMatrix<f64>,
    /// Information of the data at hand on its parameters (inverse covariance): parameters x parameters.
    pub information: DMatrix<f64>,
}

/// Pulls in the order in which they should be made.
#[derive(Debug, Clone, PartialEq)]
pub struct SeparatingPlan {
    /// Indices of candidates; one may stand there several times.
    pub pulls: Vec<usize>,
    /// What they take together.
    pub minutes: f64,
    /// For each two rivals (a, b), a < b: the smaller of both T in noise variances, after these pulls.
    pub separation: Vec<(usize, usize, f64)>,
}

/// Why pulls cannot be planned.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum SeparateError {
    /// Nothing to separate.
    #[error("{0} rivals: two are needed")]
    Rivals(usize),
    /// Sizes that do not fit.
    #[error("rival {rival}: {what} has {found} rows or columns, {wanted} are needed")]
    Size {
        /// Which rival.
        rival: usize,
        /// Which of its fields.
        what: &'static str,
        /// Its size.
        found: usize,
        /// What it should be.
        wanted: usize,
    },
    /// A number that cannot be.
    #[error("{what} {index} is {value}, it must be a number above 0")]
    Number {
        /// What it belongs to.
        what: &'static str,
        /// Which one.
        index: usize,
        /// The number.
        value: f64,
    },
    /// Predictions or derivatives that are no numbers, or information that is none.
    #[error("rival {rival}: {what}")]
    Values {
        /// Which rival.
        rival: usize,
        /// What is wrong.
        what: &'static str,
    },
}

/// Chooses up to `most` pulls, one after the other, and stops early where every pair is separated by `enough` noise
/// variances. Of two equal rivals 16 of them apart, one is taken for the other in at most 7 % (by the bound; 2.3 % with
/// Gaussian noise).
///
/// # Errors
///
/// Fewer than two rivals, arrays of other sizes than the candidates and parameters ask for, or numbers that are not
/// finite and above 0 where they must be.
pub fn plan_separating(
    candidates: &[CandidatePull],
    rivals: &[SeparableRival],
    most: usize,
    enough: f64,
) -> Result<SeparatingPlan, SeparateError> {
    check(candidates, rivals)?;
    let mut pairs = Vec::new();
    for a in 0..rivals.len() {
        for b in (0..rivals.len()).filter(|&b| b != a) {
            pairs.push(
                Pair::new(a, b, rivals)
                    .ok_or(SeparateError::Values { rival: b, what: "its information is not positive" })?,
            );
        }
    }
    let mut plan = SeparatingPlan { pulls: Vec::new(), minutes: 0.0, separation: Vec::new() };
    while plan.pulls.len() < most && pairs.iter().any(|pair| pair.t < enough) {
        let gain = |i: usize| {
            let taken = pairs.iter().map(|pair| pair.gain(rivals, i, candidates[i].noise_n));
            taken.sum::<f64>() / candidates[i].minutes
        };
        let best =
            (0..candidates.len()).map(|i| (i, gain(i))).fold(None, |best: Option<(usize, f64)>, new| {
                if best.is_none_or(|b| new.1 > b.1) { Some(new) } else { best }
            });
        // Where no pull tells anything apart, none is worth its minutes.
        let Some((chosen, _)) = best.filter(|b| b.1 > 0.0) else { break };
        for pair in &mut pairs {
            pair.add(rivals, chosen, candidates[chosen].noise_n);
        }
        plan.pulls.push(chosen);
        plan.minutes += candidates[chosen].minutes;
    }
    for a in 0..rivals.len() {
        for b in a + 1..rivals.len() {
            let both = pairs.iter().filter(|p| (p.truth.min(p.other), p.truth.max(p.other)) == (a, b));
            plan.separation.push((a, b, both.map(|p| p.t).fold(f64::INFINITY, f64::min)));
        }
    }
    Ok(plan)
}

fn check(candidates: &[CandidatePull], rivals: &[SeparableRival]) -> Result<(), SeparateError> {
    if rivals.len() < 2 {
        return Err(SeparateError::Rivals(rivals.len()));
    }
    for (index, candidate) in candidates.iter().enumerate() {
        for (what, value) in
            [("noise of candidate", candidate.noise_n), ("minutes of candidate", candidate.minutes)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(SeparateError::Number { what, index, value });
            }
        }
    }
    for (rival, r) in rivals.iter().enumerate() {
        if !(r.weight.is_finite() && r.weight > 0.0) {
            return Err(SeparateError::Number { what: "weight of rival", index: rival, value: r.weight });
        }
        let p = r.jacobian.ncols();
        for (what, found, wanted) in [
            ("`predicted_n`", r.predicted_n.len(), candidates.len()),
            ("`jacobian`", r.jacobian.nrows(), candidates.len()),
            ("`information`", r.information.nrows(), p),
            ("`information`", r.information.ncols(), p),
        ] {
            if found != wanted {
                return Err(SeparateError::Size { rival, what, found, wanted });
            }
        }
        let finite = r.predicted_n.iter().chain(&r.jacobian).chain(&r.information).all(|x| x.is_finite());
        if !finite {
            return Err(SeparateError::Values {
                rival,
                what: "a prediction or a derivative is not a number",
            });
        }
    }
    Ok(())
}

/// Rival `truth` makes the pulls, rival `other` is refitted to them.
struct Pair {
    truth: usize,
    other: usize,
    /// Product of the weights.
    weight: f64,
    /// M + J' W J over the pulls chosen so far, factored.
    information: Cholesky<f64, Dyn>,
    /// By how much `other` has moved to follow `truth`.
    moved: DVector<f64>,
    /// The criterion so far.
    t: f64,
}

impl Pair {
    fn new(truth: usize, other: usize, rivals: &[SeparableRival]) -> Option<Self> {
        let mut information = rivals[other].information.clone();
        // Directions on which the data hold nothing are free; without a trace of information they would have no inverse.
        let largest = information.diagonal().iter().fold(0.0f64, |m, x| m.max(x.abs()));
        for i in 0..information.nrows() {
            information[(i, i)] += 1e-9 * if largest > 0.0 { largest } else { 1.0 };
        }
        let moved = DVector::zeros(information.nrows());
        let weight = rivals[truth].weight * rivals[other].weight;
        Some(Self { truth, other, weight, information: information.cholesky()?, moved, t: 0.0 })
    }

    /// Difference that remains at a candidate, its variance with that of the refit, and the gain vector of the refit.
    fn innovation(&self, rivals: &[SeparableRival], i: usize, noise_n: f64) -> (f64, f64, DVector<f64>) {
        let derivative = rivals[self.other].jacobian.row(i).transpose();
        let difference = rivals[self.truth].predicted_n[i] - rivals[self.other].predicted_n[i];
        let left = difference - derivative.dot(&self.moved);
        let gain = self.information.solve(&derivative);
        (left, noise_n * noise_n + derivative.dot(&gain), gain)
    }

    /// What candidate `i` would take off the bound on the probability of a mistake.
    fn gain(&self, rivals: &[SeparableRival], i: usize, noise_n: f64) -> f64 {
        let (left, variance, _) = self.innovation(rivals, i, noise_n);
        let more = left * left / variance;
        self.weight * libm::exp(-self.t / 8.0) * -libm::expm1(-more / 8.0)
    }

    /// Adds candidate `i` to the pulls; recursive least squares, so that T needs no refit.
    fn add(&mut self, rivals: &[SeparableRival], i: usize, noise_n: f64) {
        let (left, variance, gain) = self.innovation(rivals, i, noise_n);
        self.t += left * left / variance;
        self.moved += gain * (left / variance);
        let derivative = rivals[self.other].jacobian.row(i).transpose();
        self.information.rank_one_update(&derivative, 1.0 / (noise_n * noise_n));
    }
}

#[cfg(test)]
mod tests;
