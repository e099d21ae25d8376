//! Stage `deform`: the gel around a contact, by a pyramid of blurs.

use crate::convolve::{Oriented, Padded};
use crate::grid::Plane;
use crate::indent::Imprint;
use crate::simd::SimdLevel;

/// The last blur, which smooths the border of the contact too.
const FINAL_KERNEL_PX: u32 = 5;

/// The height of the gel surface above its rest state, towards the camera, in pixels.
///
/// Taxim's deformation (Si & Yuan 2022, and its source): the contact map is blurred with each kernel in turn, and
/// after each blur the core of the contact (deeper than `restore_depth_fraction` of the press) gets its own height
/// back; a last 5 x 5 blur is not restored. Gaussians are OpenCV's: `sigma = 0.3 ((k - 1) / 2 - 1) + 0.8`,
/// `[1, 4, 6, 4, 1] / 16` for k = 5, borders mirrored without repeating the edge.
pub fn deform(
    imprint: &Imprint,
    kernels_px: &[u32],
    restore_depth_fraction: f64,
    metres_per_px: f64,
    level: SimdLevel,
) -> Plane {
    let contact = &imprint.depth_px;
    let core = (restore_depth_fraction * imprint.press_depth_m / metres_per_px) as f32;
    let restored = Plane {
        values: contact.values.iter().map(|&d| if d > core { d } else { f32::NAN }).collect(),
        ..*contact
    };
    let mut surface = Oriented::new(contact);
    let restore = [Padded::from_plane(&restored), Padded::from_plane(&restored).transposed()];
    for &kernel in kernels_px {
        surface.blur(&gaussian(kernel), Some(&restore), level);
    }
    surface.blur(&gaussian(FINAL_KERNEL_PX), None, level);
    surface.into_plane()
}

/// OpenCV's automatic Gaussian of an odd size.
pub(crate) fn gaussian(size: u32) -> Vec<f32> {
    match size {
        3 => return vec![0.25, 0.5, 0.25],
        5 => return vec![0.0625, 0.25, 0.375, 0.25, 0.0625],
        7 => return vec![0.03125, 0.109375, 0.21875, 0.28125, 0.21875, 0.109375, 0.03125],
        _ => {}
    }
    let half = f64::from(size / 2);
    let sigma = 0.3 * (f64::from(size - 1) * 0.5 - 1.0) + 0.8;
    let weights: Vec<f64> = (0..size)
        .map(|i| {
            let x = f64::from(i) - half;
            libm::exp(-x * x / (2.0 * sigma * sigma))
        })
        .collect();
    let sum: f64 = weights.iter().sum();
    weights.iter().map(|w| (w / sum) as f32).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convolve::mirrored;
    use crate::grid::Grid;
    use crate::indent::{PressedGel, indent};

    /// The same blur as plain sums in f64, with borders by definition.
    fn blur_reference(plane: &Plane, size: u32) -> Plane {
        let weights: Vec<f64> = gaussian(size).iter().map(|&w| f64::from(w)).collect();
        let half = size as isize / 2;
        let pass = |input: &[f64], width: usize, height: usize, dx: isize, dy: isize| -> Vec<f64> {
            let mut out = vec![0.0; width * height];
            for y in 0..height {
                for x in 0..width {
                    for (k, w) in weights.iter().enumerate() {
                        let o = k as isize - half;
                        let sx = mirrored(x as isize + o * dx, width);
                        let sy = mirrored(y as isize + o * dy, height);
                        out[y * width + x] += w * input[sy * width + sx];
                    }
                }
            }
            out
        };
        let values: Vec<f64> = plane.values.iter().map(|&v| f64::from(v)).collect();
        let vertical = pass(&values, plane.width, plane.height, 0, 1);
        let both = pass(&vertical, plane.width, plane.height, 1, 0);
        Plane { values: both.iter().map(|&v| v as f32).collect(), ..*plane }
    }

    fn bumps(width: usize, height: usize) -> Plane {
        let mut plane = Plane::filled(width, height, 0.0);
        for y in 0..height {
            for x in 0..width {
                let (fx, fy) = (x as f32 * 0.21, y as f32 * 0.37);
                plane.values[y * width + x] = (12.0 * fx.sin() * fy.cos() - 4.0).max(0.0);
            }
        }
        plane
    }

    fn largest_difference(a: &Plane, b: &Plane) -> f32 {
        a.values.iter().zip(&b.values).fold(0.0, |m, (x, y)| m.max((x - y).abs()))
    }

    fn press(width: usize, height: usize) -> (Imprint, f64) {
        let grid = Grid { width_px: width, height_px: height, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };
        (indent(&bumps(width, height), &grid, &gel, 20.0).unwrap(), grid.metres_per_px)
    }

    #[test]
    fn blurs_match_plain_sums_for_all_sizes_and_shapes() {
        for (width, height) in [(40, 30), (64, 48), (33, 7), (5, 61), (1, 9)] {
            for size in [5, 7, 11, 21, 51, 71] {
                let plane = bumps(width, height);
                let mut surface = Oriented::new(&plane);
                surface.blur(&gaussian(size), None, SimdLevel::best());
                let ours = surface.into_plane();
                let difference = largest_difference(&ours, &blur_reference(&plane, size));
                assert!(difference < 2e-5, "{width}x{height}, kernel {size}: {difference}");
            }
        }
    }

    /// OpenCV's reflect-101: `gfedcb|abcdefgh|gfedcba`.
    #[test]
    fn borders_are_mirrored_without_repeating_the_edge() {
        let around: Vec<usize> = (-5..10).map(|i| mirrored(i, 4)).collect();
        assert_eq!(around, [1, 2, 3, 2, 1, 0, 1, 2, 3, 2, 1, 0, 1, 2, 3]);
        assert_eq!(mirrored(-3, 1), 0);
    }

    #[test]
    fn every_vector_path_gives_the_same_bits() {
        for (width, height) in [(80, 61), (50, 34)] {
            let (imprint, metres_per_px) = press(width, height);
            let run = |level| deform(&imprint, &[31, 21, 11, 5], 0.4, metres_per_px, level).values;
            let portable: Vec<u32> = run(SimdLevel::Portable).iter().map(|v| v.to_bits()).collect();
            for level in SimdLevel::available() {
                let bits: Vec<u32> = run(level).iter().map(|v| v.to_bits()).collect();
                assert!(bits == portable, "{level:?} differs at {width}x{height}");
            }
        }
    }

    /// The core of the contact keeps its height up to the last small blur, and far away the gel is at rest.
    #[test]
    fn the_contact_is_restored_and_the_far_field_rests() {
        let grid = Grid { width_px: 160, height_px: 120, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9 };
        let mut stamp = Plane::filled(160, 120, f32::NEG_INFINITY);
        for y in 50..70 {
            for x in 60..100 {
                stamp.values[y * 160 + x] = 0.0;
            }
        }
        let imprint = indent(&stamp, &grid, &gel, 5.0).unwrap();
        let depth = (imprint.press_depth_m / 1e-4) as f32;
        let surface = deform(&imprint, &[21, 11, 5], 0.4, 1e-4, SimdLevel::best());
        assert!((surface.at(80, 60) - depth).abs() < 1e-4 * depth);
        assert_eq!(surface.at(5, 5), 0.0);
        let rim = surface.at(103, 60);
        assert!(
            rim > 0.05 * depth && rim < 0.9 * depth,
            "the gel rises around the contact: {rim} of {depth}"
        );
    }

    #[test]
    fn gaussians_are_opencvs() {
        assert!((gaussian(71)[35] - 0.036_312_7).abs() < 1e-7, "{}", gaussian(71)[35]);
        for size in [5, 11, 21, 51, 71] {
            let sum: f64 = gaussian(size).iter().map(|&w| f64::from(w)).sum();
            assert!((sum - 1.0).abs() < 1e-6);
        }
    }
}
