//! Stage `shade`: from the slope of the gel to the change of colour against the frame at rest.

mod lambert;
pub(crate) mod regressor;
mod taxim;

pub(crate) use lambert::LambertRow;
pub use lambert::{Lambert, Light};
pub use regressor::Regressor;
use regressor::{DrawScratch, Planes};
pub(crate) use taxim::Sectors;
pub use taxim::TaximTable;

use crate::gradient::gradient;
use crate::grid::Plane;
use crate::simd::SimdLevel;

/// How a sensor turns slope into colour.
#[derive(Debug, Clone, PartialEq)]
pub enum ColourModel {
    /// Coloured lights on a matt surface.
    Lambert(Box<Lambert>),
    /// Taxim's table of polynomials.
    Taxim(Box<TaximTable>),
    /// Smooth regression, fitted to presses.
    Regressor(Box<Regressor>),
}

/// Colour change against the frame at rest, in grey levels: planes of red, green and blue.
///
/// `raised_px` is the height of the gel surface above its rest state, towards the camera, in pixels. `along_x`, `along_y`
/// are the slopes of the whole surface, in pixels of height per pixel, `rest` those of the gel at rest, `None` for a flat
/// gel. Taxim's table is a function of the whole slope alone, and its image differs from the rest frame everywhere. The
/// other models are exactly 0 for a gel at rest: lights draw the difference of the two slopes, the regression takes
/// `raised_px` and its slopes, whatever the shape of the gel; around a contact it changes pixels that are not displaced too.
pub fn shade(
    model: &ColourModel,
    raised_px: &Plane,
    along_x: &Plane,
    along_y: &Plane,
    rest: Option<&(Plane, Plane)>,
) -> [Plane; 3] {
    let mut change = [0, 1, 2].map(|_| Plane::filled(along_x.width, along_x.height, 0.0));
    match model {
        ColourModel::Lambert(lambert) => {
            lambert.shade(along_x, along_y, &mut change);
            if let Some((rest_x, rest_y)) = rest {
                let mut at_rest = change.clone();
                lambert.shade(rest_x, rest_y, &mut at_rest);
                for (c, r) in change.iter_mut().zip(&at_rest) {
                    for (value, at_rest) in c.values.iter_mut().zip(&r.values) {
                        *value -= at_rest;
                    }
                }
            }
        }
        ColourModel::Taxim(table) => table.shade(along_x, along_y, &mut change),
        ColourModel::Regressor(model) => {
            let (scratch, level) = (&mut DrawScratch::default(), SimdLevel::best());
            match rest {
                None => model.shade(&Planes::new(raised_px, along_x, along_y), &mut change, scratch, level),
                Some(_) => {
                    let (along_x, along_y) = gradient(raised_px);
                    model.shade(&Planes::new(raised_px, &along_x, &along_y), &mut change, scratch, level);
                }
            }
        }
    }
    change
}
