//! A gel that is not flat at rest: its surface, and how far each blur moves it. CPU twin: `BlurredRest` in
//! src/deform.rs, where the formulas are.

use crate::convolve::mirrored;
use crate::deform::{FINAL_KERNEL_PX, gaussian};
use crate::grid::{Grid, Plane};

/// What depends on the surface at rest.
pub(super) struct RestShape {
    /// Heights towards the part in pixels, at most 0.
    pub(super) rest_px: Vec<f32>,
    /// Deepest of them below 0.
    pub(super) sag_px: f64,
    /// Whether it is not flat.
    pub(super) domed: bool,
    /// After each blur what is added: `G_0 - G_i` to the core, after the last blur `G_n - G_0` to all. None if it is
    /// flat, or the blurs work on the displacement alone.
    pub(super) lift_px: Vec<Vec<f32>>,
}

impl RestShape {
    /// `whole_gel`: whether the blurs work on the whole gel (`Renderer::blurs_whole_gel`).
    pub(super) fn new(rest: Option<Plane>, grid: &Grid, kernels_px: &[u32], whole_gel: bool) -> Self {
        let Some(rest) = rest else {
            return Self { rest_px: vec![0.0; grid.len()], sag_px: 0.0, domed: false, lift_px: vec![] };
        };
        let first: Vec<f64> = rest.values.iter().map(|&h| -f64::from(h)).collect();
        let mut blurred = first.clone();
        let mut lift_px = vec![];
        for &kernel_px in kernels_px.iter().chain([&FINAL_KERNEL_PX]).take_while(|_| whole_gel) {
            blurred = blur(&blurred, grid, &gaussian(kernel_px));
            lift_px.push(first.iter().zip(&blurred).map(|(g0, g)| (g0 - g) as f32).collect::<Vec<f32>>());
        }
        if let Some(last) = lift_px.last_mut() {
            last.iter_mut().for_each(|l| *l = -*l);
        }
        let sag_px = first.iter().fold(0.0, |m: f64, &s| m.max(s));
        Self { rest_px: rest.values, sag_px, domed: true, lift_px }
    }
}

/// A blur along both axes with mirrored borders.
fn blur(values: &[f64], grid: &Grid, weights: &[f32]) -> Vec<f64> {
    let (w, h) = (grid.width_px, grid.height_px);
    let half = weights.len() as isize / 2;
    let along = |from: &[f64], dx: isize, dy: isize| -> Vec<f64> {
        (0..w * h)
            .map(|i| {
                let (x, y) = ((i % w) as isize, (i / w) as isize);
                weights.iter().enumerate().fold(0.0, |sum, (k, &weight)| {
                    let o = k as isize - half;
                    let at = mirrored(y + o * dy, h) * w + mirrored(x + o * dx, w);
                    sum + f64::from(weight) * from[at]
                })
            })
            .collect()
    };
    along(&along(values, 0, 1), 1, 0)
}
