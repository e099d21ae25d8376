//! Stage `shade`: from the slope of the gel to the change of colour against the frame at rest.

mod lambert;
pub(crate) mod regressor;
mod taxim;

pub(crate) use lambert::LambertRow;
pub use lambert::{Lambert, Light};
pub use regressor::Regressor;
use regressor::{DrawScratch, Planes};
pub(crate) use taxim::Sectors;
pub use taxim::{TableReading, TaximTable};

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

/// Models that draw the displacement of the gel alone.
#[derive(Debug, Clone, Copy)]
pub(crate) enum LocalColours<'a> {
    /// Lights.
    Lambert(&'a Lambert),
    /// Regression.
    Regressor(&'a Regressor),
}

impl ColourModel {
    /// Its name on screens and in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Lambert(_) => "lambert",
            Self::Taxim(_) => "taxim",
            Self::Regressor(_) => "regressor",
        }
    }

    /// Names of the arrays of a sensor file that make it unusable, because a number in them is not finite; `None` for one that
    /// can be used.
    pub(crate) fn unusable_arrays(&self) -> Option<&'static str> {
        match self {
            Self::Lambert(lambert) => (!lambert.is_finite()).then_some("lambert"),
            Self::Taxim(table) => (!table.is_finite()).then_some("grad_r, grad_g, grad_b"),
            Self::Regressor(model) => {
                (!model.is_usable()).then_some("regressor_near, regressor_around, regressor_limits")
            }
        }
    }

    /// Whether it is a function of the slope of the whole surface, as Taxim's is, and not of what the contact changes.
    pub(crate) fn takes_whole_slope(&self) -> bool {
        match self {
            Self::Taxim(_) => true,
            Self::Lambert(_) | Self::Regressor(_) => false,
        }
    }

    /// The model for pixels `factor` times as wide; `means` takes the means of a plane over them.
    pub(crate) fn of_wider_pixels(&self, factor: usize, means: impl Fn(&[f32]) -> Vec<f32>) -> Self {
        match self {
            Self::Lambert(lambert) => Self::Lambert(lambert.clone()),
            Self::Taxim(table) => Self::Taxim(Box::new(table.with_planes(means))),
            Self::Regressor(model) => {
                let mut model = model.clone();
                model.mm_per_px *= factor as f64;
                Self::Regressor(model)
            }
        }
    }

    /// The colours where the image is a function of the displacement of the gel alone; `flat` says that the gel is flat at rest.
    pub(crate) fn local(&self, flat: bool) -> Option<LocalColours<'_>> {
        match self {
            Self::Lambert(lambert) => flat.then_some(LocalColours::Lambert(lambert)),
            Self::Taxim(_) => None,
            Self::Regressor(model) => Some(LocalColours::Regressor(model)),
        }
    }

    /// Taxim's table, whose shadows are made with it.
    pub(crate) fn taxim(&self) -> Option<&TaximTable> {
        match self {
            Self::Taxim(table) => Some(table),
            Self::Lambert(_) | Self::Regressor(_) => None,
        }
    }
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
