//! Background patterns of higher degree.

use gripgen_twin::FINER_TERMS;

/// Degrees 0 to 6.
const DEGREES: usize = 7;

/// The pattern `sum of c_ij (P_i(u) P_j(v) - its mean over the frame)` of a channel.
pub(super) struct FinerPattern {
    coefficients: [f64; FINER_TERMS.len()],
    width: usize,
    height: usize,
    mean: f64,
}

impl FinerPattern {
    /// `None` where there is none.
    pub(super) fn new(coefficients: &[f64; FINER_TERMS.len()], width: usize, height: usize) -> Option<Self> {
        if coefficients.iter().all(|c| *c == 0.0) {
            return None;
        }
        let (of_u, of_v) = (means(width), means(height));
        let mean = coefficients.iter().zip(FINER_TERMS).map(|(c, (i, j))| c * of_u[i] * of_v[j]).sum();
        Some(Self { coefficients: *coefficients, width, height, mean })
    }

    /// What a row makes of the polynomials of u: their coefficients.
    pub(super) fn row(&self, y: usize) -> [f64; DEGREES] {
        let of_v = legendre(normalised(y, self.height));
        let mut row = [0.0; DEGREES];
        for (c, (i, j)) in self.coefficients.iter().zip(FINER_TERMS) {
            row[i] += c * of_v[j];
        }
        row[0] -= self.mean;
        row
    }

    /// The pattern at a column of a row, in grey levels.
    pub(super) fn at(&self, row: &[f64; DEGREES], x: usize) -> f32 {
        let of_u = legendre(normalised(x, self.width));
        row.iter().zip(of_u).map(|(c, p)| c * p).sum::<f64>() as f32
    }
}

/// Position of pixel `i` of `n`, from -1 at one edge of the frame to 1 at the other.
pub(super) fn normalised(i: usize, n: usize) -> f64 {
    (2 * i + 1) as f64 / n as f64 - 1.0
}

/// Mean of the square of [`normalised`] over `n` pixels.
pub(super) fn mean_square(n: usize) -> f64 {
    let n = n as f64;
    (1.0 - 1.0 / (n * n)) / 3.0
}

/// Legendre polynomials of degree 0 to 6, by Bonnet's recursion `(n + 1) P_(n+1) = (2n + 1) x P_n - n P_(n-1)`.
fn legendre(x: f64) -> [f64; DEGREES] {
    let mut p = [1.0; DEGREES];
    p[1] = x;
    for n in 1..DEGREES - 1 {
        p[n + 1] = ((2 * n + 1) as f64 * x * p[n] - n as f64 * p[n - 1]) / (n + 1) as f64;
    }
    p
}

/// Their means over the middles of `n` pixels, from the means of even powers there (sums of powers, Faulhaber).
fn means(n: usize) -> [f64; DEGREES] {
    let s = 1.0 / ((n * n) as f64);
    let x2 = mean_square(n);
    let x4 = 1.0 / 5.0 - 2.0 / 3.0 * s + 7.0 / 15.0 * s * s;
    let x6 = 1.0 / 7.0 - s + 7.0 / 3.0 * s * s - 31.0 / 21.0 * s * s * s;
    let p2 = (3.0 * x2 - 1.0) / 2.0;
    let p4 = (35.0 * x4 - 30.0 * x2 + 3.0) / 8.0;
    let p6 = (231.0 * x6 - 315.0 * x4 + 105.0 * x2 - 5.0) / 16.0;
    [1.0, 0.0, p2, 0.0, p4, 0.0, p6]
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rodrigues' formula at a few places, worked out.
    #[test]
    fn polynomials_are_legendres() {
        for x in [-1.0, -0.3, 0.0, 0.7, 1.0f64] {
            let p = legendre(x);
            let p3 = 0.5 * (5.0 * x.powi(3) - 3.0 * x);
            let p6 = (231.0 * x.powi(6) - 315.0 * x.powi(4) + 105.0 * x * x - 5.0) / 16.0;
            assert!((p[3] - p3).abs() < 1e-14 && (p[6] - p6).abs() < 1e-14, "{x}: {p:?}");
        }
    }

    #[test]
    fn means_are_those_of_the_pixels() {
        for n in [1, 2, 16, 33] {
            let all = (0..n).map(|i| legendre(normalised(i, n)));
            let sums = all.fold([0.0; DEGREES], |s, p| std::array::from_fn(|d| s[d] + p[d]));
            for (sum, mean) in sums.into_iter().zip(means(n)) {
                assert!((sum / n as f64 - mean).abs() < 1e-12);
            }
        }
    }
}
