//! Evidence, slopes and screenings, against the density written out with its whole covariance.

use super::*;

const NOISE: NoisePriors = NoisePriors {
    scatter: SdPrior { median: 0.03, spread: 0.7 },
    reading: SdPrior { median: 0.12, spread: 0.8 },
};

/// Fixed numbers that look random: a Weyl sequence through the normal quantile.
fn noise(n: usize, seed: f64) -> DVector<f64> {
    let of = |i: usize| {
        let u = ((i as f64 + 1.0) * 0.618_033_988_75 + seed).fract();
        gripgen_twin::random::normal_quantile(u.clamp(1e-9, 1.0 - 1e-9))
    };
    DVector::from_fn(n, |i, _| of(i))
}

fn measured(z: DVector<f64>) -> Measured {
    let n = z.len();
    Measured {
        z,
        of_reading: DVector::from_element(n, 0.01),
        wider: DVector::from_element(n, 1.0),
        log_jacobian: 0.0,
    }
}

fn block(features: DMatrix<f64>, range: Option<(f64, f64)>) -> Block {
    Block { features, sd: SdPrior { median: 0.06, spread: 1.0 }, range }
}

/// The density of the vector, written out with its whole covariance.
fn dense(measured: &Measured, blocks: &[&Block], log_sd: &[f64], log_noise: [f64; 2]) -> f64 {
    let n = measured.z.len();
    let [r, a] = log_noise.map(|t| libm::exp(2.0 * t));
    let mut k = DMatrix::from_diagonal(&DVector::from_fn(n, |i, _| {
        measured.wider[i] * (r + a * measured.of_reading[i])
    }));
    for (block, t) in blocks.iter().zip(log_sd) {
        k += libm::exp(2.0 * t) * &block.features * block.features.transpose();
    }
    let factor = Cholesky::new(k).unwrap();
    let log_det = 2.0 * factor.l().diagonal().iter().map(|d| d.ln()).sum::<f64>();
    -0.5 * (measured.z.dot(&factor.solve(&measured.z)) + log_det + n as f64 * std::f64::consts::TAU.ln())
}

#[test]
fn the_evidence_is_that_of_the_whole_covariance_and_the_gradient_is_its_slope() {
    let n = 30;
    let x = noise(n, 0.3);
    let line = block(DMatrix::from_fn(n, 1, |i, _| x[i]), None);
    let steps = block(DMatrix::from_fn(n, 3, |i, k| f64::from(u8::from(i % 3 == k))), None);
    let measured = measured(0.05 * &x + 0.04 * noise(n, 0.7));
    let blocks = [&steps, &line];
    let problem = Problem::new(&measured, &blocks, NOISE);
    let theta = [-2.0, -2.5, -3.2, -1.9];
    let at = problem.at(&theta).unwrap();
    let prior = |theta: &[f64]| {
        let far = |(t, p): (&f64, &SdPrior)| (t - p.at(0.0)) / p.spread;
        theta.iter().zip(&problem.priors).map(far).map(|far| -0.5 * far * far).sum::<f64>()
    };
    let whole = |t: &[f64]| dense(&measured, &blocks, &t[..2], [t[2], t[3]]) + prior(t);
    assert!((at.objective - whole(&theta)).abs() < 1e-9, "{} {}", at.objective, whole(&theta));
    for t in 0..4 {
        let moved = |step: f64| {
            let mut theta = theta;
            theta[t] += step;
            whole(&theta)
        };
        let slope = (moved(1e-5) - moved(-1e-5)) / 2e-5;
        assert!(
            (at.gradient[t] - slope).abs() < 1e-4 * (1.0 + slope.abs()),
            "{t}: {} {slope}",
            at.gradient[t]
        );
    }
}

#[test]
fn a_dependence_is_found_and_its_sign_counts() {
    let n = 60;
    let x = noise(n, 0.1);
    let parts = block(DMatrix::from_element(n, 1, 1.0), None);
    let of = |range| block(DMatrix::from_fn(n, 1, |i, _| x[i]), range);
    let measured = measured(0.08 * &x + 0.03 * noise(n, 0.45));
    let plain = Gaussian::fit(&measured, &[&parts], NOISE, None).unwrap();
    let gain = |range| {
        let line = of(range);
        let with = Gaussian::fit(&measured, &[&parts, &line], NOISE, Some(&plain)).unwrap();
        (with.log_evidence - plain.log_evidence, plain.screen(&line), with.mean[1])
    };
    let (free, screened, slope) = gain(None);
    assert!((slope - 0.08).abs() < 0.015, "{slope}");
    assert!(free > 20.0 && screened > 10.0, "{free} {screened}");
    assert!((gain(Some((0.0, f64::INFINITY))).0 - free - std::f64::consts::LN_2).abs() < 1e-3);
    assert!(gain(Some((f64::NEG_INFINITY, 0.0))).0 < free - 20.0);
    assert!(gain(Some((-0.02, 0.02))).0 < free - 10.0, "a bound rules it out");
}

#[test]
fn what_is_not_there_gains_nothing() {
    let n = 80;
    let parts = block(DMatrix::from_element(n, 1, 1.0), None);
    let measured = measured(0.03 * noise(n, 0.2));
    let plain = Gaussian::fit(&measured, &[&parts], NOISE, None).unwrap();
    for seed in [0.11, 0.37, 0.53, 0.71] {
        let x = noise(n, seed);
        let other = DMatrix::from_fn(n, 1, |i, _| x[(7 * i + 3) % n]);
        let gain = plain.screen(&block(other, None));
        assert!(gain < 1.0, "{seed}: {gain}");
    }
}
