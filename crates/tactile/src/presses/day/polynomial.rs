//! Polynomials over the frame, as the colours of a sensor file have them: `1, u, v, u^2, u v, v^2, u^3, ...`.

use super::light::{FIELD, Light};
use nalgebra::{Cholesky, DMatrix};

/// Places along an axis at which two polynomials are compared.
const PLACES: usize = 21;

/// Exponents of u and v.
fn exponents(count: usize) -> Vec<(i32, i32)> {
    (0..).flat_map(|degree: i32| (0..=degree).map(move |j| (degree - j, j))).take(count).collect()
}

fn monomials(count: usize, u: f64, v: f64) -> Vec<f64> {
    exponents(count).into_iter().map(|(i, j)| u.powi(i) * v.powi(j)).collect()
}

/// A linear map of the coefficients of a polynomial.
pub(super) struct Mapped(DMatrix<f64>);

impl Mapped {
    /// The polynomial of places that are `u / zoom + shift`.
    pub(super) fn zoomed(count: usize, zoom: f64, shift: [f64; 2]) -> Self {
        let list = exponents(count);
        let mut map = DMatrix::zeros(count, count);
        for (from, &(i, j)) in list.iter().enumerate() {
            for (to, &(k, l)) in list.iter().enumerate().filter(|(_, (k, l))| *k <= i && *l <= j) {
                let along = |n: i32, k: i32, shift: f64| choose(n, k) * zoom.powi(-k) * shift.powi(n - k);
                map[(to, from)] = along(i, k, shift[0]) * along(j, l, shift[1]);
            }
        }
        Self(map)
    }

    /// The polynomial that is most like a gain over the frame times the given one, in squares over a frame of this height in units of
    /// its width.
    pub(super) fn times(count: usize, field: &[f64; FIELD], height: f64) -> Option<Self> {
        let mut products = DMatrix::<f64>::zeros(count, count);
        let mut targets = DMatrix::<f64>::zeros(count, count);
        let at = |i: usize| 2.0 * i as f64 / (PLACES - 1) as f64 - 1.0;
        for place in 0..PLACES * PLACES {
            let (u, v) = (at(place % PLACES), height * at(place / PLACES));
            let gain: f64 = Light::terms(u, v).iter().zip(field).map(|(t, f)| t * f).sum();
            let terms = monomials(count, u, v);
            for j in 0..count {
                for i in 0..count {
                    products[(i, j)] += terms[i] * terms[j];
                    targets[(i, j)] += gain * terms[i] * terms[j];
                }
            }
        }
        Some(Self(Cholesky::new(products)?.solve(&targets)))
    }

    pub(super) fn of(&self, coefficients: &[f64]) -> Vec<f64> {
        let n = coefficients.len();
        // Plain loops: a matrix product of the library sums in an order that depends on the processor.
        (0..n).map(|i| (0..n).map(|j| self.0[(i, j)] * coefficients[j]).sum()).collect()
    }
}

fn choose(n: i32, k: i32) -> f64 {
    (0..k).map(|i| f64::from(n - i) / f64::from(i + 1)).product()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn value(coefficients: &[f64], u: f64, v: f64) -> f64 {
        monomials(coefficients.len(), u, v).iter().zip(coefficients).map(|(m, c)| m * c).sum()
    }

    fn cubic() -> Vec<f64> {
        (0..10).map(|i| f64::from(i * 7 % 5) - 1.7).collect()
    }

    #[test]
    fn a_zoomed_polynomial_has_the_values_of_the_old_places() {
        let (zoom, shift) = (1.07, [0.03, -0.05]);
        let zoomed = Mapped::zoomed(10, zoom, shift).of(&cubic());
        for (u, v) in [(0.0, 0.0), (0.8, -0.3), (-1.0, 0.7)] {
            let old = value(&cubic(), u / zoom + shift[0], v / zoom + shift[1]);
            assert!((value(&zoomed, u, v) - old).abs() < 1e-12);
        }
    }

    #[test]
    fn a_gain_is_exact_where_the_degree_suffices_and_close_elsewhere() {
        let field = [0.2, -0.1, 0.0, 0.0, 0.0];
        let plane = [1.0, 0.5, -0.3, 0.0, 0.0, 0.0];
        let exact = Mapped::times(6, &field, 0.75).unwrap().of(&plane);
        let gain = |u: f64, v: f64| 0.2 * u - 0.1 * v;
        for (u, v) in [(0.0, 0.0), (0.8, -0.3), (-1.0, 0.7)] {
            assert!((value(&exact, u, v) - gain(u, v) * value(&plane, u, v)).abs() < 1e-12);
        }
        let close = Mapped::times(10, &field, 0.75).unwrap().of(&cubic());
        let off = (value(&close, 0.4, 0.3) - gain(0.4, 0.3) * value(&cubic(), 0.4, 0.3)).abs();
        assert!(off < 0.05, "{off}");
    }
}
