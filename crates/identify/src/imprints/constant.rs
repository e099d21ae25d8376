//! The imprint constant c of `V = c F` from presses that were fitted one by one.

use crate::diagnosis::ParameterEstimate;
use crate::grouped::t_quantile_95;

/// The constant that explains the images of one press best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FittedPress {
    /// Normal force of a jaw.
    pub force_n: f64,
    /// Volume of the imprint per newton.
    pub imprint_mm3_per_n: f64,
}

/// What presses of one part say together.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintEstimate {
    /// Constant c, mm^3/N.
    pub imprint_mm3_per_n: ParameterEstimate,
    /// Exponent p of `V ~ F^p`, where the forces are a factor of 1.5 apart; 1 where c is one.
    pub exponent: Option<ParameterEstimate>,
}

/// Smallest ratio of the forces at which an exponent is looked for.
const MIN_RATIO: f64 = 1.5;

/// Geometric mean of the constants with its 90 % interval (Student's t on the logarithms), and the exponent by the
/// regression of ln V on ln F. `None` for fewer than two presses, which have no interval.
pub fn imprint_constant(presses: &[FittedPress]) -> Option<ImprintEstimate> {
    let n = presses.len() as f64;
    if presses.len() < 2 {
        return None;
    }
    let ln_c: Vec<f64> = presses.iter().map(|p| libm::log(p.imprint_mm3_per_n)).collect();
    let ln_f: Vec<f64> = presses.iter().map(|p| libm::log(p.force_n)).collect();
    let mean = |x: &[f64]| x.iter().sum::<f64>() / n;
    let (c, f) = (mean(&ln_c), mean(&ln_f));
    let sum = |a: &[f64], a0: f64, b: &[f64], b0: f64| -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - a0) * (b - b0)).sum()
    };
    let (cc, cf, ff) = (sum(&ln_c, c, &ln_c, c), sum(&ln_c, c, &ln_f, f), sum(&ln_f, f, &ln_f, f));
    let half = t_quantile_95(n - 1.0) * (cc / (n - 1.0) / n).sqrt();
    let (least, most) =
        ln_f.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, m), &x| (l.min(x), m.max(x)));
    let exponent = (presses.len() > 2 && most - least >= libm::log(MIN_RATIO)).then(|| {
        let slope = cf / ff;
        let sd = ((cc - slope * cf).max(0.0) / (n - 2.0) / ff).sqrt();
        let half = t_quantile_95(n - 2.0) * sd;
        ParameterEstimate::new(1.0 + slope, (1.0 + slope - half, 1.0 + slope + half), "1")
    });
    Some(ImprintEstimate {
        imprint_mm3_per_n: ParameterEstimate::new(
            libm::exp(c),
            (libm::exp(c - half), libm::exp(c + half)),
            "mm^3/N",
        ),
        exponent,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn press(force_n: f64, imprint_mm3_per_n: f64) -> FittedPress {
        FittedPress { force_n, imprint_mm3_per_n }
    }

    /// V = 2 F^1.3 by construction, and a hand-made interval: ln c of 0 and 2 has the mean 1 and the standard error 1.
    #[test]
    fn power_laws_and_intervals_are_exact() {
        let law: Vec<_> = [5.0_f64, 10.0, 20.0, 40.0].map(|f| press(f, 2.0 * f.powf(0.3))).into();
        let found = imprint_constant(&law).unwrap().exponent.unwrap();
        assert!((found.value - 1.3).abs() < 1e-12 && found.high90 - found.low90 < 1e-6);
        let two = imprint_constant(&[press(10.0, 1.0), press(10.0, 2.0_f64.exp())]).unwrap();
        assert!((two.imprint_mm3_per_n.value - 1.0_f64.exp()).abs() < 1e-12);
        assert!((two.imprint_mm3_per_n.high90.ln() - 1.0 - 6.313_752).abs() < 1e-6);
        assert!(two.exponent.is_none() && imprint_constant(&law[..1]).is_none());
    }
}
