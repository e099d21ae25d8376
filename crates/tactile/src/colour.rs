//! Stage `shade`: from the slope of the gel to the change of colour against the frame at rest.

mod lambert;
pub(crate) mod regressor;
mod taxim;

pub(crate) use lambert::LambertRow;
pub use lambert::{Lambert, Light};
pub use regressor::Regressor;
pub use taxim::TaximTable;

use crate::grid::Plane;

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
/// `surface` is the height of the gel surface above its rest state, towards the camera, in pixels; `along_x` and
/// `along_y` are its slopes. A gel at rest gives exactly 0.
pub fn shade(model: &ColourModel, surface: &Plane, along_x: &Plane, along_y: &Plane) -> [Plane; 3] {
    let mut change = [0, 1, 2].map(|_| Plane::filled(along_x.width, along_x.height, 0.0));
    match model {
        ColourModel::Lambert(lambert) => lambert.shade(along_x, along_y, &mut change),
        ColourModel::Taxim(table) => table.shade(along_x, along_y, &mut change),
        ColourModel::Regressor(model) => model.shade(surface, along_x, along_y, &mut change),
    }
    change
}
