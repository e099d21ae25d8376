//! Dots of a gel in presses: the pixels that they hide, and how a press moves them.
//!
//! A dot hides the colour of the gel, and a contact moves it by several pixels. A fit therefore leaves out the pixels of the dots at rest and of
//! the dots in each press; filling them in does not help. Errors are reported outside and inside of these pixels.

use super::{Press, PressSet, reference_frame};
use crate::grid::{Grid, Plane, levels_of};
use crate::markers::{
    Markers, find_dots, follow_dots, height_and_slope, marker_displacements_by_surface, window,
};
use gripgen_twin::TactileImage;
use std::sync::Arc;

/// Pixels around a dot that it still darkens, in an image 320 px wide; masks of 2 and 4 px give errors outside of the dots within 6 % of each other (measured apart).
const RIM_PX: f64 = 2.0;

impl PressSet {
    /// Looks for dots on the gel. Where it has any, each press gets the pixels that they hide; the dots are those of the frame at rest.
    pub fn mark_dots(&mut self) -> Option<Markers> {
        let rest = reference_frame(self)?;
        let first = &self.presses.first()?.image;
        let grid = Grid {
            width_px: first.width_px as usize,
            height_px: first.height_px as usize,
            metres_per_px: self.metres_per_px,
        };
        if rest[0].len() != grid.len() {
            return None;
        }
        let markers = Markers::of_rest(&rest, &grid)?;
        self.hide_dots(&markers);
        Some(markers)
    }

    /// Gives each press the pixels that these dots hide.
    pub(super) fn hide_dots(&mut self, markers: &Markers) {
        for press in &mut self.presses {
            press.hidden = Some(hidden(&press.image, markers));
        }
    }
}

/// Where each marker is in an image; `None` of one that is not seen.
pub(super) fn followed(image: &TactileImage, markers: &Markers) -> Vec<Option<[f64; 2]>> {
    let found = find_dots(&levels_of(image), image.width_px as usize, image.height_px as usize);
    let of_rest = follow_dots(&found, &markers.rest_px);
    of_rest.into_iter().map(|dot| dot.map(|i| found[i].centre_px)).collect()
}

/// The pixels that dots hide at rest or in an image, row by row.
fn hidden(image: &TactileImage, markers: &Markers) -> Arc<[bool]> {
    let (width, height) = (image.width_px as usize, image.height_px as usize);
    let mut hidden = vec![false; width * height];
    let radius_px = markers.radius_px + RIM_PX * width as f64 / 320.0;
    let seen = followed(image, markers).into_iter().flatten();
    for [x, y] in markers.rest_px.iter().copied().chain(seen) {
        let [left, right, top, bottom] = window(radius_px, &[[x, y]], width, height);
        for row in top..bottom {
            for column in left..right {
                let r2 = (column as f64 - x).powi(2) + (row as f64 - y).powi(2);
                hidden[row * width + column] |= r2 <= radius_px * radius_px;
            }
        }
    }
    hidden.into()
}

/// The sideways displacement of the surface for each pixel of height that moves markers to where they are seen.
pub(super) fn press_shear(
    surface_px: &Plane,
    grid: &Grid,
    markers: &Markers,
    seen: &[Option<[f64; 2]>],
) -> [f64; 2] {
    let unsheared =
        marker_displacements_by_surface(surface_px, grid.metres_per_px, [0.0; 2], &markers.rest_px);
    let (mut products, mut squares) = ([0.0; 2], 0.0);
    for ((rest, seen), tilted) in markers.rest_px.iter().zip(seen).zip(unsheared) {
        let Some(seen) = seen else { continue };
        let (height, _) = height_and_slope(surface_px, *rest);
        squares += height * height;
        (0..2).for_each(|a| products[a] += height * (seen[a] - rest[a] - tilted[a]));
    }
    products.map(|product| if squares > 0.0 { product / squares } else { 0.0 })
}

impl Press {
    /// Whether a dot of the gel hides a pixel.
    pub(super) fn hides(&self, pixel: usize) -> bool {
        self.hidden.as_ref().is_some_and(|hidden| hidden.get(pixel).copied().unwrap_or(false))
    }
}
