//! Stage `deform`: the gel around a contact, by a pyramid of blurs.

mod core_share;
#[cfg(test)]
mod edge_tests;

pub use core_share::Edges;
pub(crate) use core_share::POINTS;

use crate::convolve::{Area, Follow, Restore, Sheet, Surface};
use crate::grid::Plane;
use crate::indent::Imprint;
use crate::simd::SimdLevel;
use core_share::write_core;

/// The last blur, which smooths the border of the contact too.
pub(crate) const FINAL_KERNEL_PX: u32 = 5;

/// Pixels beyond the deformed gel whose neighbours are not flat, and theirs: what the gradient looks at.
const RIM_PX: usize = 2;

/// The height of the gel surface above its rest state, towards the camera, in pixels.
///
/// Taxim's deformation (Si & Yuan 2022, and its source): the contact map is blurred with each kernel in turn, and
/// after each blur the core of the contact (deeper than `restore_depth_fraction` of the press) gets its own height
/// back; a last 5 x 5 blur is not restored. Gaussians are OpenCV's: `sigma = 0.3 ((k - 1) / 2 - 1) + 0.8`,
/// `[1, 4, 6, 4, 1] / 16` for k = 5, borders mirrored without repeating the edge.
///
/// Taxim blurs the height of the whole gel. With the rest surface G (blurred i times: G_i) and the height of the
/// gel z_i = G_i + E_i, a blur acts on E alone, which is exactly 0 far from the contact; the core is restored to
/// `E_i = depth + G_0 - G_i`, and the result is `E_n + G_n - G_0`. On a flat gel all G are 0; `rest` holds them for
/// one that is not.
pub fn deform(
    imprint: &Imprint,
    kernels_px: &[u32],
    restore_depth_fraction: f64,
    metres_per_px: f64,
    rest: Option<&BlurredRest>,
    level: SimdLevel,
) -> Plane {
    let core_px = restore_depth_fraction * imprint.press_depth_m / metres_per_px;
    let mut scratch = DeformScratch::default();
    let core = Core { from_px: core_px, follow: Follow::Exactly, whole_pixels: true };
    scratch.deform(imprint, core, &weights(kernels_px), rest, level);
    scratch.surface_plane()
}

/// [`deform`] with the weights of the kernels, of odd lengths, on a gel with any rest surface (towards the part).
pub(crate) fn deform_with(
    imprint: &Imprint,
    core: Core,
    kernels: &[Vec<f32>],
    rest_px: Option<&Plane>,
    level: SimdLevel,
) -> Plane {
    let last = gaussian(FINAL_KERNEL_PX);
    let halves: Vec<Vec<f32>> = kernels.iter().chain([&last]).map(|k| k[k.len() / 2..].to_vec()).collect();
    let rest = rest_px.map(|rest| BlurredRest::with_weights(rest, &halves, level));
    let mut scratch = DeformScratch::default();
    scratch.deform(imprint, core, &halves, rest.as_ref(), level);
    scratch.surface_plane()
}

/// A plane blurred along both axes with weights of odd length, borders mirrored.
pub(crate) fn blurred(plane: &Plane, weights: &[f32], level: SimdLevel) -> Plane {
    let half = &weights[weights.len() / 2..];
    let whole = Area::whole(plane.width, plane.height);
    let mut surface = Surface::default();
    surface.start(plane, whole, half.len() - 1);
    surface.blur(half, None, 0, level);
    surface.upright(level);
    surface.sheet.plane(whole)
}

/// The halves of all kernels, the last one included.
pub(crate) fn weights(kernels_px: &[u32]) -> Vec<Vec<f32>> {
    kernels_px
        .iter()
        .chain([&FINAL_KERNEL_PX])
        .map(|&size| gaussian(size).split_off(size as usize / 2))
        .collect()
}

/// How far the blurs of a pyramid lift a gel that is not flat at rest: `G_i - G_0`.
#[derive(Debug, Clone)]
pub struct BlurredRest {
    /// `G_0 - G_i` after each blur whose core is restored, in the orientation that the surface has then.
    lowered: Vec<Sheet>,
    /// `G_n - G_0`.
    raised: Plane,
}

impl BlurredRest {
    /// From the surface at rest in pixels towards the part (as [`crate::GelShape::rest_px`] gives it).
    pub fn new(rest_px: &Plane, kernels_px: &[u32], level: SimdLevel) -> Self {
        Self::with_weights(rest_px, &weights(kernels_px), level)
    }

    /// The same for the halves of any kernels, the last one not restored.
    fn with_weights(rest_px: &Plane, weights: &[Vec<f32>], level: SimdLevel) -> Self {
        let half = largest_half(weights);
        let whole = Area::whole(rest_px.width, rest_px.height);
        // Heights in the image are towards the camera.
        let towards_camera = rest_px.map(|h| -h);
        let mut surface = Surface::default();
        surface.start(&towards_camera, whole, half);
        let mut upright = Sheet::default();
        upright.reshape(rest_px.width, rest_px.height, half);
        upright.copy_area(&towards_camera, whole, 0.0, |v| v);
        let mut lying = Sheet::default();
        lying.reshape(rest_px.height, rest_px.width, half);
        lying.copy_transposed(&upright, whole, level);
        let mut lowered = Vec::new();
        for kernel in &weights[..weights.len() - 1] {
            surface.blur(kernel, None, 0, level);
            let mut difference = if surface.transposed { lying.clone() } else { upright.clone() };
            for y in 0..difference.height {
                for (d, &g) in difference.row_mut(y).iter_mut().zip(surface.sheet.row(y)) {
                    *d -= g;
                }
            }
            lowered.push(difference);
        }
        surface.blur(&weights[weights.len() - 1], None, 0, level);
        surface.upright(level);
        let mut raised = towards_camera;
        for y in 0..raised.height {
            let width = raised.width;
            for (r, &g) in raised.values[y * width..][..width].iter_mut().zip(surface.sheet.row(y)) {
                *r = g - *r;
            }
        }
        Self { lowered, raised }
    }
}

fn largest_half(weights: &[Vec<f32>]) -> usize {
    weights.iter().map(|w| w.len() - 1).max().unwrap_or(0)
}

/// The core of a contact, and how the gel follows the part there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Core {
    /// The depth below which it lies.
    pub(crate) from_px: f64,
    pub(crate) follow: Follow,
    /// Taxim's way: a pixel belongs to it or not, by its depth alone, and the core takes the place of what is blurred.
    pub(crate) whole_pixels: bool,
}

/// Memory of the stage, to be used again, and its result.
#[derive(Debug, Clone, Default)]
pub(crate) struct DeformScratch {
    surface: Surface,
    /// Depth of the core, upright and lying.
    core: [Sheet; 2],
    /// The share of each pixel that belongs to it.
    shares: [Sheet; 2],
}

impl DeformScratch {
    /// The stage; the result stays here. `weights` are those of [`weights`]; the core is what is deeper than that.
    pub(crate) fn deform(
        &mut self,
        imprint: &Imprint,
        core: Core,
        weights: &[Vec<f32>],
        rest: Option<&BlurredRest>,
        level: SimdLevel,
    ) {
        let depth_px = &imprint.depth_px;
        let (width, height) = (depth_px.width, depth_px.height);
        let half = largest_half(weights);
        let contact = Area::of_positive(depth_px, level);
        let core_px = core.from_px as f32;
        let Core { follow, whole_pixels, .. } = core;
        for [upright, lying] in [&mut self.core, &mut self.shares] {
            upright.reshape(width, height, half);
            lying.reshape(height, width, half);
        }
        let ([core, lying_core], [share, lying_share]) = (&mut self.core, &mut self.shares);
        if whole_pixels {
            core.copy_area(depth_px, contact, f32::NAN, |d| if d > core_px { d } else { f32::NAN });
        } else {
            write_core(depth_px, &imprint.edges, core_px, contact, (core, share), level);
            lying_share.copy_transposed(share, contact, level);
        }
        lying_core.copy_transposed(core, contact, level);
        let surface = &mut self.surface;
        surface.start(depth_px, contact, half);
        let (last, restored) = weights.split_last().expect("the last kernel is always there");
        for (i, kernel) in restored.iter().enumerate() {
            let lift = rest.map(|r| &r.lowered[i]);
            let restore = [0, 1].map(|lying| Restore {
                core: &self.core[lying],
                share: (!whole_pixels).then_some(&self.shares[lying]),
                follow,
                area: if lying == 0 { contact } else { contact.transposed() },
                lift,
            });
            surface.blur(kernel, Some(&restore), 0, level);
        }
        surface.blur(last, None, RIM_PX, level);
        surface.upright(level);
        if let Some(rest) = rest {
            surface.widen();
            for y in 0..height {
                for (e, &g) in surface.sheet.row_mut(y).iter_mut().zip(rest.raised.row(y)) {
                    *e += g;
                }
            }
        }
    }

    /// The rows of the surface, valid in the area beyond which it is 0 and in its rim.
    pub(crate) fn surface(&self) -> (&Sheet, Area) {
        (&self.surface.sheet, self.surface.area)
    }

    pub(crate) fn surface_plane(&self) -> Plane {
        let (sheet, area) = self.surface();
        sheet.plane(area)
    }
}

/// Centre and one side of a Gaussian up to 4 standard deviations (scipy's).
pub(crate) fn half_gaussian(sigma_px: f64) -> Vec<f64> {
    let radius = (4.0 * sigma_px + 0.5) as i32;
    let weight = |k: i32| libm::exp(-0.5 / (sigma_px * sigma_px) * f64::from(k * k));
    let sum: f64 = (-radius..=radius).map(weight).sum();
    (0..=radius).map(|k| weight(k) / sum).collect()
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
    use crate::reference::blur;
    use crate::testing::{assert_same_on_every_unit, bits};

    fn bumps(width: usize, height: usize) -> Plane {
        Plane::from_fn(width, height, |x, y| {
            let (fx, fy) = (x as f32 * 0.21, y as f32 * 0.37);
            (12.0 * fx.sin() * fy.cos() - 4.0).max(0.0)
        })
    }

    fn press(width: usize, height: usize) -> (Imprint, f64) {
        let grid = Grid { width_px: width, height_px: height, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
        (indent(&bumps(width, height), &grid, &gel, 20.0).unwrap(), grid.metres_per_px)
    }

    #[test]
    fn blurs_match_plain_sums_for_all_sizes_and_shapes() {
        for level in SimdLevel::available() {
            for (width, height) in [(40, 30), (64, 48), (33, 7), (5, 61), (1, 9)] {
                for size in [5, 7, 11, 21, 51, 71] {
                    let plane = bumps(width, height);
                    let mut scratch = DeformScratch::default();
                    let surface = &mut scratch.surface;
                    surface.start(&plane, Area::of_positive(&plane, level), size as usize / 2);
                    surface.blur(&gaussian(size)[size as usize / 2..], None, 0, level);
                    surface.upright(level);
                    let ours = scratch.surface_plane();
                    let values: Vec<f64> = plane.values.iter().map(|&v| f64::from(v)).collect();
                    let exact = blur(&values, width, height, size);
                    let off = ours.values.iter().zip(&exact).map(|(&a, b)| (f64::from(a) - b).abs());
                    let difference = off.fold(0.0, f64::max);
                    assert!(difference < 2e-5, "{level:?}, {width}x{height}, kernel {size}: {difference}");
                }
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
            assert_same_on_every_unit(&format!("{width}x{height}"), |level| {
                bits(&deform(&imprint, &[31, 21, 11, 5], 0.4, metres_per_px, None, level).values)
            });
        }
    }

    /// The core of the contact keeps its height up to the last small blur, and far away the gel is at rest.
    #[test]
    fn the_contact_is_restored_and_the_far_field_rests() {
        let grid = Grid { width_px: 160, height_px: 120, metres_per_px: 1e-4 };
        let gel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
        let inside = |x, y| (60..100).contains(&x) && (50..70).contains(&y);
        let stamp = Plane::from_fn(160, 120, |x, y| if inside(x, y) { 0.0 } else { f32::NEG_INFINITY });
        let imprint = indent(&stamp, &grid, &gel, 5.0).unwrap();
        let depth = (imprint.press_depth_m / 1e-4) as f32;
        let surface = deform(&imprint, &[21, 11, 5], 0.4, 1e-4, None, SimdLevel::best());
        assert!((surface.at(80, 60) - depth).abs() < 1e-4 * depth);
        assert_eq!(surface.at(5, 5), 0.0);
        let rim = surface.at(103, 60);
        assert!(
            rim > 0.05 * depth && rim < 0.9 * depth,
            "the gel rises around the contact: {rim} of {depth}"
        );
    }

    /// Real walls fall off monotonically. Where the core ends on a slanted wall, its own height lies below the blurred gel
    /// beside it; to go back to it leaves a moat with a second slope behind.
    #[test]
    fn beside_a_slanted_wall_there_is_no_moat() {
        for (press_px, steepness) in [(6.0, 1.0f32), (12.0, 1.0), (12.0, 2.0), (24.0, 2.0), (24.0, 4.0)] {
            let depth = Plane::from_fn(240, 160, |x, y| {
                let beyond = ((x as f32 - 100.0).abs() - 28.0).max(0.0);
                if (y as f32 - 80.0).abs() < 40.0 { (press_px - beyond * steepness).max(0.0) } else { 0.0 }
            });
            let imprint = crate::testing::imprint(depth);
            let kernels = [71, 51, 21, 11, 5].map(gaussian);
            let rise = |follow| {
                let core = Core { from_px: 0.4 * f64::from(press_px), follow, whole_pixels: false };
                let surface = deform_with(&imprint, core, &kernels, None, SimdLevel::best());
                let slope = |x: usize| (surface.at(x - 1, 80) - surface.at(x + 1, 80)) / 2.0;
                let steepest = (120..180).fold(124, |m, x| if slope(x) > slope(m) { x } else { m });
                let (mut least, mut rise) = (f32::INFINITY, 0.0f32);
                for x in steepest..190 {
                    least = least.min(slope(x));
                    rise = rise.max(slope(x) - least);
                }
                rise / slope(steepest)
            };
            let (at_least, exactly) = (rise(Follow::AtLeast), rise(Follow::Exactly));
            assert!(at_least < 0.002, "{press_px} px, {steepness}: the slope rises again by {at_least}");
            assert!(exactly > 0.1, "{press_px} px, {steepness}: {exactly}");
        }
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
