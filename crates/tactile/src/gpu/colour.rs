//! Colour models as the stage `shade` wants them.

use super::GpuError;
use super::layout::Regression;
use super::regression::{around_coefficients, near_coefficients, regression};
use super::source::Shade;
use crate::colour::ColourModel;
use crate::gpu_types::missing;
use crate::sensor::Sensor;
use crate::shadow::Shadow;
use gripgen_twin::Gel;

/// The colours of a sensor for the device.
pub(super) struct Colours {
    pub(super) shade: Shade,
    /// Bins of a table; 0 with lights.
    pub(super) bins: u32,
    /// In the order that `shade_*.wgsl` describe.
    pub(super) coefficients: Vec<f32>,
    /// Limits and planes of colours by regression, and the coefficients of the surroundings.
    pub(super) regression: Option<Regression>,
    pub(super) around: Vec<f32>,
    pub(super) shadows: Option<Box<Shadow>>,
    /// Rest frame, what a table adds to it where the gel is pressed, and what takes its place under Taxim's shadows.
    pub(super) rest: Vec<f32>,
}

impl Colours {
    pub(super) fn new(sensor: &Sensor, gel: &Gel) -> Result<Self, GpuError> {
        if let Some(what) = missing(sensor, gel) {
            return Err(GpuError::Unsupported { what });
        }
        let shadows = sensor.shadow.clone();
        let rest = sensor.rest.concat();
        let plain = Self {
            shade: Shade::Lambert,
            bins: 0,
            coefficients: vec![],
            regression: None,
            around: vec![],
            shadows: None,
            rest,
        };
        let colours = match &sensor.colour {
            ColourModel::Lambert(lambert) => {
                let (c, each) = (lambert.coefficients(), lambert.coefficients().len() / 3);
                let together = |k: usize| [c[k] as f32, c[each + k] as f32, c[2 * each + k] as f32, 0.0];
                Self { coefficients: (0..each).flat_map(together).collect(), ..plain }
            }
            ColourModel::Taxim(table) => {
                let (slopes, directions) = table.borders();
                let mut coefficients = slopes.to_vec();
                coefficients.extend(directions.iter().flatten().map(|&x| x as f32));
                let channels = |bin: &[[f32; 4]; 6]| [0, 1, 2].map(|c| bin.map(|term| term[c]));
                coefficients.extend(table.packed().iter().flat_map(channels).flatten());
                let mut rest = plain.rest.clone();
                rest.extend(table.offset().iter().flatten());
                rest.extend(shadows.iter().filter_map(|s| s.base.as_ref()).flatten().flatten());
                Self { shade: Shade::Taxim, bins: table.bins() as u32, coefficients, rest, ..plain }
            }
            ColourModel::Regressor(model) => Self {
                shade: Shade::Regressor,
                coefficients: near_coefficients(model),
                regression: Some(regression(model, &sensor.grid)),
                around: around_coefficients(model),
                ..plain
            },
        };
        Ok(Self { shadows, ..colours })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::tests::{lit, sensor};
    use crate::markers::Markers;
    use crate::testing::gel;
    use gripgen_twin::config::GelModel;

    #[test]
    fn what_has_no_twin_is_refused() {
        let mut marked = sensor(16, 16, lit());
        let plain = gel(&[5]);
        let refused = |sensor: &Sensor, gel: &Gel| Colours::new(sensor, gel).err().map(|e| e.to_string());
        assert_eq!(refused(&marked, &plain), None);
        marked.markers = Some(Markers { rest_px: vec![[8.0, 8.0]], radius_px: 2.0, darkness_rgb: [0.5; 3] });
        assert_eq!(refused(&marked, &plain).unwrap(), "the gpu backend cannot do markers");
        let elastic = Some(gripgen_twin::Elastic { young_modulus_pa: 2e5, poisson_ratio: 0.48 });
        let solved = Gel { model: GelModel::Elastic, elastic, ..plain };
        assert_eq!(refused(&marked, &solved).unwrap(), "the gpu backend cannot do an elastic gel");
    }
}
