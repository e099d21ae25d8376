//! Stage `shade`: from the slope of the gel to the change of colour against the frame at rest.

mod lambert;
mod taxim;

pub(crate) use lambert::LambertRow;
pub use lambert::{Lambert, Light};
pub use taxim::TaximTable;

use crate::grid::Plane;

/// How a sensor turns slope into colour.
#[derive(Debug, Clone, PartialEq)]
pub enum ColourModel {
    /// Coloured lights on a matt surface.
    Lambert(Box<Lambert>),
    /// Taxim's table of polynomials.
    Taxim(Box<TaximTable>),
}

/// Colour change against the frame at rest, in grey levels: planes of red, green and blue.
///
/// `along_x`, `along_y` are the slopes of the gel surface towards the camera; without slope the change is exactly 0.
pub fn shade(model: &ColourModel, along_x: &Plane, along_y: &Plane) -> [Plane; 3] {
    let mut change = [0, 1, 2].map(|_| Plane::filled(along_x.width, along_x.height, 0.0));
    match model {
        ColourModel::Lambert(lambert) => lambert.shade(along_x, along_y, &mut change),
        ColourModel::Taxim(table) => table.shade(along_x, along_y, &mut change),
    }
    change
}
