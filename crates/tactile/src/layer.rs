//! An elastic layer on a rigid base: how its surface yields to a load that varies as a wave along it.
//!
//! A load of wave number k moves the layer by the same wave. In the plane of the wave the displacements that keep
//! to the base are two functions of the height z above it, in the form of Papkovich and Neuber with kappa = 3 - 4 nu
//! (Johnson, Contact Mechanics, 1985, chapter 2; the compliance of the surface is that of Bufler 1971 and of
//! Nogi & Kato 1997 with a rigid base):
//!
//! ```text
//! along the wave    U1 = kz sinh kz                    U2 = kz cosh kz + kappa sinh kz
//! up                W1 = kappa sinh kz - kz cosh kz    W2 = -kz sinh kz
//! ```
//!
//! Across the wave it is a shear, `tanh(kt) / (G k)`. Written with `exp(-kt)` taken out, nothing overflows.

/// `C_layer / C_half_space` of the normal compliance of the surface for `x = k t`: 1 for waves much shorter than the
/// layer is thick.
///
/// ```text
/// ((3 - 4 nu) sinh 2x - 2x) / ((3 - 4 nu) cosh 2x + 2 x^2 + 5 - 12 nu + 8 nu^2)
/// ```
pub(crate) fn normal_ratio(x: f64, poisson_ratio: f64) -> f64 {
    let nu = poisson_ratio;
    let kappa = 3.0 - 4.0 * nu;
    let rest = 2.0 * x * x + 5.0 - 12.0 * nu + 8.0 * nu * nu;
    let decay = libm::exp(-2.0 * x);
    // Times 2 exp(-2x). An incompressible layer keeps only the third order of x, so the first ones go by hand.
    let numerator = if x < 0.1 {
        let y = 2.0 * x;
        let beyond_linear = y * y * y / 6.0 * (1.0 + y * y / 20.0 * (1.0 + y * y / 42.0));
        2.0 * decay * (kappa * beyond_linear + y * (kappa - 1.0))
    } else {
        kappa * (1.0 - decay * decay) - 4.0 * x * decay
    };
    numerator / (kappa * (1.0 + decay * decay) + 2.0 * rest * decay)
}

/// `integral of f(x) over 0..end` by Simpson's rule on `2 half` intervals.
pub(crate) fn simpson(end: f64, half: usize, f: impl Fn(f64) -> f64) -> f64 {
    let step = end / (2 * half) as f64;
    let mut sum = f(0.0) + f(end);
    for i in 1..2 * half {
        sum += f(i as f64 * step) * if i % 2 == 1 { 4.0 } else { 2.0 };
    }
    sum * step / 3.0
}

/// How far from a load, in thicknesses, a layer is taken to move.
///
/// The displacement decays as `exp(-0.74 r / t)` for nu = 0.5 (`cos y = y` is the first pole of the compliance), and
/// faster for smaller nu. Here it is 1/70 of that on a half-space.
pub(crate) const REACH: f64 = 5.0;

/// What the base changes of the displacement under a point load, as a function of distance.
#[derive(Debug, Clone)]
pub(crate) struct BaseEffect {
    values: Vec<f64>,
}

impl BaseEffect {
    const PER_THICKNESS: usize = 24;

    /// `q(r / t)`: a force F moves the surface of the layer by `F / (pi E* t) (t / r + q)`, with
    /// `q(rho) = integral of (C_layer / C_half_space - 1) J0(x rho) dx`.
    pub(crate) fn new(poisson_ratio: f64) -> Self {
        // Beyond x = 14 the ratio is 1 to the tenth digit.
        let (end, half) = (14.0, 240);
        let step = end / (2 * half) as f64;
        let ratio: Vec<f64> =
            (0..=2 * half).map(|i| normal_ratio(i as f64 * step, poisson_ratio) - 1.0).collect();
        let count = (REACH * Self::PER_THICKNESS as f64) as usize + 4;
        let value = |i: usize| {
            let rho = i as f64 / Self::PER_THICKNESS as f64;
            simpson(end, half, |x| ratio[libm::round(x / step) as usize] * libm::j0(x * rho))
        };
        Self { values: (0..count).map(value).collect() }
    }

    /// The value at `rho` up to [`REACH`], by cubic interpolation.
    pub(crate) fn at(&self, rho: f64) -> f64 {
        let x = rho * Self::PER_THICKNESS as f64;
        let i = (x as usize).min(self.values.len() - 3);
        let before = if i == 0 { self.values[1] } else { self.values[i - 1] };
        cubic([before, self.values[i], self.values[i + 1], self.values[i + 2]], x - i as f64)
    }
}

/// Lagrange's cubic through values at -1, 0, 1 and 2.
pub(crate) fn cubic(v: [f64; 4], t: f64) -> f64 {
    let (a, b, c) = (t + 1.0, t - 1.0, t - 2.0);
    -t * b * c / 6.0 * v[0] + a * b * c / 2.0 * v[1] - a * t * c / 2.0 * v[2] + a * t * b / 6.0 * v[3]
}

/// The displacement at (x, y) from the middle of a square of side 1 under pressure 1, times pi E*: the formula of
/// Love 1929 (Johnson 1985, eq. 3.25), summed over the corners of the square. From 20 sides away on two terms of its
/// multipoles are as good (1e-7).
pub(crate) fn love(x: f64, y: f64) -> f64 {
    let far = x * x + y * y;
    if far > 400.0 {
        return (1.0 + 1.0 / (24.0 * far)) / far.sqrt();
    }
    let corner = |x: f64, y: f64| {
        let r = (x * x + y * y).sqrt();
        // x ln(y + r) + y ln(x + r), by the side on which nothing cancels; 0 in the limit of x = 0 or y = 0.
        let term = |x: f64, y: f64| {
            if x == 0.0 {
                0.0
            } else if y >= 0.0 {
                x * libm::log(y + r)
            } else {
                x * libm::log(x * x / (r - y))
            }
        };
        term(x, y) + term(y, x)
    };
    let (a, b, c, d) = (x - 0.5, x + 0.5, y - 0.5, y + 0.5);
    corner(b, d) - corner(a, d) - corner(b, c) + corner(a, c)
}

/// Displacement at the middle of a square of side 1, times pi E*: `4 ln(1 + sqrt 2)`.
#[cfg(test)]
const LOVE_MIDDLE: f64 = 3.525_494_348_078_172;

#[cfg(test)]
mod tests {
    use super::*;

    /// Long waves press a compressible layer as a column (`t / M`); short waves do not feel the base.
    #[test]
    fn the_layer_is_a_column_for_long_waves_and_a_half_space_for_short_ones() {
        for nu in [0.0, 0.2, 0.3, 0.45] {
            let x = 1e-4;
            // C = ratio * 2 (1 - nu^2) / (E k), column: t (1 + nu) (1 - 2 nu) / (E (1 - nu)).
            let column = x * (1.0 + nu) * (1.0 - 2.0 * nu) / (1.0 - nu) / (2.0 * (1.0 - nu * nu));
            assert!((normal_ratio(x, nu) / column - 1.0).abs() < 1e-6, "{nu}");
        }
        for nu in [0.0, 0.3, 0.5] {
            assert!((normal_ratio(30.0, nu) - 1.0).abs() < 1e-12);
        }
        // A thin incompressible layer is a film that is squeezed sideways: u = k^2 t^3 p / (3 G).
        for x in [1e-3, 0.02] {
            assert!((normal_ratio(x, 0.5) / (2.0 * x * x * x / 3.0) - 1.0).abs() < 2.0 * x, "{x}");
        }
        for nu in [0.0, 0.3, 0.5] {
            let jump = normal_ratio(0.1, nu) / normal_ratio(0.1 - 1e-9, nu) - 1.0;
            assert!(jump.abs() < 2e-7, "the series meets the formula");
        }
    }

    #[test]
    fn loves_square_has_its_closed_form_and_is_a_point_from_afar() {
        assert!((love(0.0, 0.0) - LOVE_MIDDLE).abs() < 1e-14);
        assert!((love(30.0, -40.0) * 50.0 - 1.0).abs() < 2e-4);
        for (x, y) in [(20.0, 0.0), (0.0, -20.0), (14.143, 14.142), (16.0, 12.0)] {
            let jump = love(x * 1.0001, y * 1.0001) / love(x * 0.9999, y * 0.9999) * 1.0002 - 1.0;
            assert!(jump.abs() < 2e-7, "{jump}");
        }
        assert!((love(0.5, 0.5) - love(-0.5, 0.5)).abs() < 1e-14);
        // A square is the sum of the four quarters of it.
        let quarters: f64 =
            [(0.5, 0.5), (1.5, 0.5), (0.5, 1.5), (1.5, 1.5)].iter().map(|&(x, y)| 0.5 * love(x, y)).sum();
        assert!((love(0.5, 0.5) - quarters).abs() < 1e-12);
    }

    /// A point on the layer far away does not move, near by the base takes a constant off.
    #[test]
    fn the_base_cancels_the_far_field() {
        for nu in [0.3, 0.5] {
            let q = BaseEffect::new(nu);
            let left = |rho: f64| 1.0 / rho + q.at(rho);
            assert!(left(5.0).abs() < 4e-3, "{nu}: {}", left(5.0));
            assert!(left(4.0).abs() < 8e-3 && left(3.0).abs() < 0.02);
            assert!((left(4.0) / left(3.0)).abs() < 0.45, "it decays");
            assert!(q.at(0.0) < -1.0);
            let exact = simpson(40.0, 4000, |x| (normal_ratio(x, nu) - 1.0) * libm::j0(x * 0.77));
            assert!((q.at(0.77) - exact).abs() < 1e-5, "{} {exact}", q.at(0.77));
        }
    }
}
