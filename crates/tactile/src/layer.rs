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

/// Displacements in the plane of the layer for a unit load of one wave number; all times `G k`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct InPlane {
    /// Along the wave, from a pressure `cos(k x)`: the factor of `sin(k x)`.
    pub(crate) normal: f64,
    /// Along the wave, from a shear along it.
    pub(crate) along: f64,
    /// Across the wave, from a shear across it.
    pub(crate) across: f64,
}

/// Displacements `depth` below the surface, both `x = k t` and `depth` in units of the thickness.
pub(crate) fn in_plane(x: f64, depth: f64, poisson_ratio: f64) -> InPlane {
    let nu = poisson_ratio;
    let kappa = 3.0 - 4.0 * nu;
    // exp(-x) times cosh and sinh, at the surface and at the height of interest.
    let (once, twice) = (libm::exp(-x * depth), libm::exp(-2.0 * x));
    let (ch, sh) = (0.5 * (1.0 + twice), 0.5 * (1.0 - twice));
    let below = twice / once;
    let (ch_z, sh_z) = (0.5 * (once + below), 0.5 * (once - below));
    let z = x * (1.0 - depth);
    let (u1, u2) = (z * sh_z, z * ch_z + kappa * sh_z);
    // Stresses at the surface of the two functions over 2 G k, and their determinant.
    let up = [2.0 * (1.0 - nu) * ch - x * sh, -(1.0 - 2.0 * nu) * sh - x * ch];
    let shear = [-(1.0 - 2.0 * nu) * sh + x * ch, 2.0 * (1.0 - nu) * ch + x * sh];
    let determinant = up[0] * shear[1] - up[1] * shear[0];
    InPlane {
        normal: 0.5 * (-shear[1] * u1 + shear[0] * u2) / determinant,
        along: 0.5 * (-up[1] * u1 + up[0] * u2) / determinant,
        across: sh_z / ch,
    }
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
    use std::f64::consts::PI;

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
            let short = in_plane(30.0, 0.0, nu);
            assert!((short.normal + 0.5 * (1.0 - 2.0 * nu)).abs() < 1e-12, "Johnson 1985, eq. 3.18");
            assert!((short.along - (1.0 - nu)).abs() < 1e-12);
            assert!((short.across - 1.0).abs() < 1e-12);
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

    /// Elasticity's own equations by finite differences, inside the layer and at its base.
    #[test]
    fn displacements_solve_elasticity_inside_the_layer() {
        for (x, nu) in [(0.3, 0.1), (1.0, 0.3), (2.5, 0.5)] {
            let (h, depth) = (1e-4, 0.3);
            // Across the wave: U'' = k^2 U.
            let u = |d: f64| in_plane(x, d, nu).across;
            let second = (u(depth + h) - 2.0 * u(depth) + u(depth - h)) / (h * h);
            assert!((second / (x * x * u(depth)) - 1.0).abs() < 1e-4);
            // Along the wave U solves the biharmonic equation (D^2 - k^2)^2 U = 0.
            for part in [|i: InPlane| i.normal, |i: InPlane| i.along] {
                let h = 0.02;
                let v = |j: f64| part(in_plane(x, depth + j * h, nu));
                let fourth = (v(2.0) - 4.0 * v(1.0) + 6.0 * v(0.0) - 4.0 * v(-1.0) + v(-2.0)) / h.powi(4);
                let second = (v(1.0) - 2.0 * v(0.0) + v(-1.0)) / (h * h);
                let residual = fourth - 2.0 * x * x * second + x.powi(4) * v(0.0);
                assert!(residual.abs() < 5e-3 * x.powi(4).max(1.0), "{x}, {nu}: {residual}");
                assert!(part(in_plane(x, 1.0, nu)).abs() < 1e-15, "the base holds");
            }
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

    /// Mean displacement of a disc under an even shear q: `2 q integral of (J1(k a) / k)^2 C(k) / (G k) k dk`, C the mean of along and
    /// across. On a half-space that is a little less stiff than a rigid disc, `8 G a / (2 - nu)`; a thin layer has `G A / t`.
    #[test]
    fn a_sheared_disc_has_the_stiffness_that_assets_say() {
        let stiffness = |area: f64, shear_modulus: f64, thickness: f64| {
            let a = (area / PI).sqrt();
            let at = |k: f64| {
                let both = in_plane(k * thickness, 0.0, 0.5);
                let bessel = libm::j1(k * a) / k;
                bessel * bessel * 0.5 * (both.along + both.across)
            };
            PI * a * a * shear_modulus / (2.0 * simpson(200.0 / a, 20_000, |k| at(k.max(1e-9))))
        };
        let rigid = 8.0 * PI.recip().sqrt() / 1.5;
        let half_space = stiffness(1.0, 1.0, 300.0) / rigid;
        assert!((0.9..1.0).contains(&half_space), "{half_space}");
        let thin = stiffness(1.0, 1.0, 0.01) / 100.0;
        assert!((thin - 1.0).abs() < 0.03, "{thin}");
        // mm and MPa: the shipped gel, assets/gels/README.md.
        for (area_mm2, wanted) in [(54.0, 8.8), (96.0, 13.2), (168.0, 20.0)] {
            let found = stiffness(area_mm2, 0.85 / 3.0, 4.0);
            assert!((found / wanted - 1.0).abs() < 0.01, "{area_mm2} mm2: {found} N/mm");
        }
    }
}
