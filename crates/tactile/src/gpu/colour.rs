//! Colour models as the stage `shade` wants them.

use super::GpuError;
use super::source::Shade;
use crate::colour::ColourModel;
use crate::sensor::Sensor;
use gripgen_twin::Gel;
use gripgen_twin::config::GelModel;

/// The colours of a sensor for the device.
pub(super) struct Colours {
    pub(super) shade: Shade,
    /// Bins of a table; 0 with lights.
    pub(super) bins: u32,
    /// In the order that `shade_lambert.wgsl` and `shade_taxim.wgsl` describe.
    pub(super) coefficients: Vec<f32>,
    /// Rest frame, and what a table adds to it where the gel is pressed.
    pub(super) rest: Vec<f32>,
}

impl Colours {
    pub(super) fn new(sensor: &Sensor, gel: &Gel) -> Result<Self, GpuError> {
        if gel.model == GelModel::Elastic {
            return Err(GpuError::Unsupported { what: "an elastic gel" });
        }
        if sensor.markers.is_some() && gel.elastic.is_some() {
            return Err(GpuError::Unsupported { what: "markers" });
        }
        if sensor.shadow.is_some() {
            return Err(GpuError::Unsupported { what: "shadows" });
        }
        let mut rest = sensor.rest.concat();
        match &sensor.colour {
            ColourModel::Lambert(lambert) => {
                let coefficients = lambert.coefficients().iter().map(|&c| c as f32).collect();
                Ok(Self { shade: Shade::Lambert, bins: 0, coefficients, rest })
            }
            ColourModel::Taxim(table) => {
                let (slopes, directions) = table.borders();
                let mut coefficients = slopes.to_vec();
                coefficients.extend(directions.iter().flatten().map(|&x| x as f32));
                let channels = |bin: &[[f32; 4]; 6]| [0, 1, 2].map(|c| bin.map(|term| term[c]));
                coefficients.extend(table.packed().iter().flat_map(channels).flatten());
                rest.extend(table.offset().iter().flatten());
                Ok(Self { shade: Shade::Taxim, bins: table.bins() as u32, coefficients, rest })
            }
            // Its surroundings are a pyramid of their own, which has no WGSL twin yet.
            ColourModel::Regressor(_) => Err(GpuError::Unsupported { what: "colours by regression" }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::Regressor;
    use crate::grid::Grid;
    use crate::sensor::GelShape;

    #[test]
    fn what_has_no_twin_is_refused() {
        let regressor = Regressor {
            mm_per_px: 0.1,
            near: vec![],
            around: vec![],
            slope_limit: 1.0,
            height_limit_mm: 1.0,
            around_limit: vec![],
        };
        let sensor = Sensor {
            grid: Grid { width_px: 16, height_px: 16, metres_per_px: 1e-4 },
            rest: [0, 1, 2].map(|_| vec![0.0; 256]),
            noise_rgb: [0.0; 3],
            colour: ColourModel::Regressor(Box::new(regressor)),
            gel_shape: GelShape::Flat,
            shadow: None,
            markers: None,
            pyramid: None,
            ball_m: None,
        };
        let mut gel = crate::gpu::tests::gel(&[5]);
        let refused = |gel: &Gel| Colours::new(&sensor, gel).err().map(|e| e.to_string());
        assert_eq!(refused(&gel).unwrap(), "the gpu backend cannot do colours by regression");
        gel.model = GelModel::Elastic;
        assert_eq!(refused(&gel).unwrap(), "the gpu backend cannot do an elastic gel");
    }
}
