//! A Sobol sequence with random access.
//!
//! Direction numbers: Joe & Kuo (2008), "Constructing Sobol sequences with better two-dimensional projections",
//! SIAM J. Sci. Comput. 30, 2635-2654, file new-joe-kuo-6.21201, the first 21 dimensions. A digital shift (one
//! random 32-bit word per dimension) keeps the point 0 out of the corner and makes the sequence depend on the
//! seed without changing how evenly it fills space.

/// Number of dimensions available.
pub const MAX_DIMENSIONS: usize = 21;

/// Number of points of the sequence.
pub const MAX_POINTS: u64 = 1 << 32;

/// (degree, coefficients, initial direction numbers) of dimensions 2, 3, ...
const POLYNOMIALS: [(u32, u32, &[u32]); MAX_DIMENSIONS - 1] = [
    (1, 0, &[1]),
    (2, 1, &[1, 3]),
    (3, 1, &[1, 3, 1]),
    (3, 2, &[1, 1, 1]),
    (4, 1, &[1, 1, 3, 3]),
    (4, 4, &[1, 3, 5, 13]),
    (5, 2, &[1, 1, 5, 5, 17]),
    (5, 4, &[1, 1, 5, 5, 5]),
    (5, 7, &[1, 1, 7, 11, 19]),
    (5, 11, &[1, 1, 5, 1, 1]),
    (5, 13, &[1, 1, 1, 3, 11]),
    (5, 14, &[1, 3, 5, 5, 31]),
    (6, 1, &[1, 3, 3, 9, 7, 49]),
    (6, 13, &[1, 1, 1, 15, 21, 21]),
    (6, 16, &[1, 3, 1, 13, 27, 49]),
    (6, 19, &[1, 1, 1, 15, 7, 5]),
    (6, 22, &[1, 3, 1, 15, 13, 25]),
    (6, 25, &[1, 1, 5, 5, 19, 61]),
    (7, 1, &[1, 3, 7, 11, 23, 15, 103]),
    (7, 4, &[1, 3, 7, 13, 13, 15, 69]),
];

/// The 32 direction numbers of a dimension, as fractions of 2^32.
fn directions(dimension: usize) -> [u32; 32] {
    let mut v = [0u32; 32];
    let Some(&(degree, coefficients, initial)) = dimension.checked_sub(1).map(|i| &POLYNOMIALS[i]) else {
        for (i, x) in v.iter_mut().enumerate() {
            *x = 1 << (31 - i);
        }
        return v;
    };
    let s = degree as usize;
    for i in 0..32 {
        v[i] = if i < s {
            initial[i] << (31 - i)
        } else {
            let mut x = v[i - s] ^ (v[i - s] >> s);
            for k in 1..s {
                if (coefficients >> (s - 1 - k)) & 1 == 1 {
                    x ^= v[i - k];
                }
            }
            x
        };
    }
    v
}

/// Coordinate `dimension` (below [`MAX_DIMENSIONS`]) of point `index`, in the open interval (0, 1).
pub fn coordinate(index: u64, dimension: usize, shift: u32) -> f64 {
    let v = directions(dimension);
    let gray = (index ^ (index >> 1)) as u32;
    let bits = (0..32).filter(|&i| (gray >> i) & 1 == 1).fold(shift, |x, i| x ^ v[i]);
    (f64::from(bits) + 0.5) / 4_294_967_296.0
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points 0..8 of the unshifted sequence in Gray code order, as printed by an independent implementation
    /// (`scipy.stats.qmc.Sobol(d=5, scramble=False)`, which uses the same direction numbers).
    #[test]
    fn first_points_match_scipy() {
        let expected = [
            [0.0, 0.0, 0.0, 0.0, 0.0],
            [0.5, 0.5, 0.5, 0.5, 0.5],
            [0.75, 0.25, 0.25, 0.25, 0.75],
            [0.25, 0.75, 0.75, 0.75, 0.25],
            [0.375, 0.375, 0.625, 0.875, 0.375],
            [0.875, 0.875, 0.125, 0.375, 0.875],
            [0.625, 0.125, 0.875, 0.625, 0.625],
            [0.125, 0.625, 0.375, 0.125, 0.125],
        ];
        for (i, point) in expected.iter().enumerate() {
            for (d, &x) in point.iter().enumerate() {
                let ours = coordinate(i as u64, d, 0);
                assert!((ours - x).abs() < 1e-9, "point {i}, dimension {d}: {ours} against {x}");
            }
        }
    }

    /// Point 1000 in all dimensions, from the same program.
    #[test]
    fn a_late_point_matches_scipy_in_all_dimensions() {
        let expected = [
            0.2197265625,
            0.0966796875,
            0.5185546875,
            0.6767578125,
            0.2802734375,
            0.9072265625,
            0.0458984375,
            0.8994140625,
            0.5009765625,
            0.0693359375,
            0.0849609375,
            0.2548828125,
            0.1611328125,
            0.3837890625,
            0.1435546875,
            0.3701171875,
            0.7197265625,
            0.3447265625,
            0.9912109375,
            0.7255859375,
            0.5224609375,
        ];
        for (d, &x) in expected.iter().enumerate() {
            assert!((coordinate(1000, d, 0) - x).abs() < 1e-9, "dimension {d}");
        }
    }

    #[test]
    fn every_dimension_is_a_permutation_of_the_dyadic_fractions() {
        for dimension in 0..MAX_DIMENSIONS {
            let mut seen = [false; 256];
            for i in 0..256 {
                seen[(coordinate(i, dimension, 0xdead_beef) * 256.0) as usize] = true;
            }
            assert!(seen.iter().all(|&s| s), "dimension {dimension} misses a cell");
        }
    }
}
