//! Three coloured lights on a matt gel.
//!
//! A matt surface lit by distant lights reflects `sum_k E_k (n . l_k)` as long as every light is above its horizon:
//! linear in the normal n, for any number of lights. A colour channel is then three fields over the image, one for
//! each component of n, and since the lights stand close to the gel these fields vary slowly: polynomials of second
//! degree. That is the whole model; it has no shadows and no highlights.

use crate::grid::Plane;
use crate::simd::{Kernel, Lanes, SimdLevel};
use std::ops::Range;

/// Terms of a field over the image: `1, u, v, u^2, u v, v^2`, with u and v measured from the centre in units of
/// half the image width.
const TERMS: usize = 6;

/// The coefficients of three channels, three components of the normal, six terms.
#[derive(Debug, Clone, PartialEq)]
pub struct Lambert {
    fields: [[[f64; TERMS]; 3]; 3],
}

/// One light at the rim of the gel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Light {
    /// Where it stands, seen in the image: 0 = right, 90 degrees = down.
    pub azimuth_rad: f64,
    /// Height above the gel plane.
    pub elevation_rad: f64,
    /// What it adds to red, green and blue on a surface that faces it, in grey levels.
    pub colour: [f64; 3],
    /// Linear and quadratic change of its brightness along the way towards it, per half image width.
    pub falloff: [f64; 2],
}

impl Lambert {
    /// From coefficients in the order channel, component, term.
    ///
    /// # Panics
    /// Unless there are 54 of them; the reader of sensor files checks the shape.
    pub fn new(coefficients: &[f64]) -> Self {
        assert_eq!(coefficients.len(), 3 * 3 * TERMS);
        let mut fields = [[[0.0; TERMS]; 3]; 3];
        for (i, &x) in coefficients.iter().enumerate() {
            fields[i / (3 * TERMS)][i / TERMS % 3][i % TERMS] = x;
        }
        Self { fields }
    }

    /// The model of lights that stand around the gel.
    pub fn from_lights(lights: &[Light]) -> Self {
        let mut fields = [[[0.0; TERMS]; 3]; 3];
        for light in lights {
            let (sa, ca) = (libm::sin(light.azimuth_rad), libm::cos(light.azimuth_rad));
            let (se, ce) = (libm::sin(light.elevation_rad), libm::cos(light.elevation_rad));
            let towards = [ca * ce, sa * ce, se];
            // Brightness 1 + a s + b s^2 with s = u cos + v sin.
            let [a, b] = light.falloff;
            let brightness = [1.0, a * ca, a * sa, b * ca * ca, 2.0 * b * ca * sa, b * sa * sa];
            for channel in 0..3 {
                for component in 0..3 {
                    for term in 0..TERMS {
                        fields[channel][component][term] +=
                            light.colour[channel] * towards[component] * brightness[term];
                    }
                }
            }
        }
        Self { fields }
    }

    /// Coefficients in the order channel, component, term.
    pub fn coefficients(&self) -> Vec<f64> {
        self.fields.iter().flatten().flatten().copied().collect()
    }

    /// Whether all coefficients are.
    pub(crate) fn is_finite(&self) -> bool {
        self.fields.iter().flatten().flatten().all(|c| c.is_finite())
    }

    /// Brightness of a flat gel: the fields of the normal's z component.
    pub fn flat(&self, channel: usize, u: f64, v: f64) -> f64 {
        let terms = [1.0, u, v, u * u, u * v, v * v];
        self.fields[channel][2].iter().zip(terms).map(|(c, t)| c * t).sum()
    }

    /// Writes `sum_j field_j (n_j - n0_j)` with `n = (-gx, -gy, 1) / |..|` and the rest normal (0, 0, 1).
    pub(super) fn shade(&self, along_x: &Plane, along_y: &Plane, change: &mut [Plane; 3]) {
        SimdLevel::best().run(Shade {
            row: self.row(along_x.width, along_x.height),
            along_x,
            along_y,
            change,
        });
    }

    /// For images of a size.
    pub(crate) fn row(&self, width: usize, height: usize) -> LambertRow<'_> {
        let unit = 2.0 / width as f64;
        let u = (0..width).map(|x| ((x as f64 + 0.5 - width as f64 / 2.0) * unit) as f32).collect();
        LambertRow { model: self, height, unit, u, normal: [0, 1, 2].map(|_| vec![0.0; width]) }
    }
}

/// The model on rows of an image.
pub(crate) struct LambertRow<'a> {
    model: &'a Lambert,
    height: usize,
    unit: f64,
    u: Vec<f32>,
    /// Memory for normals, less the normal at rest.
    normal: [Vec<f32>; 3],
}

impl LambertRow<'_> {
    /// Writes the change of colour in some columns of row `y`; the slices are whole rows.
    #[inline(always)]
    pub(crate) fn shade(
        &mut self,
        y: usize,
        columns: Range<usize>,
        gx: &[f32],
        gy: &[f32],
        change: [&mut [f32]; 3],
    ) {
        let n = columns.len();
        let (gx, gy, u) = (&gx[columns.clone()], &gy[columns.clone()], &self.u[columns.clone()]);
        let [nx, ny, nz] = self.normal.each_mut().map(|v| &mut v[..n]);
        for i in 0..n {
            let length = (1.0 + gx[i] * gx[i] + gy[i] * gy[i]).sqrt();
            let inverse = 1.0 / length;
            nx[i] = -gx[i] * inverse;
            ny[i] = -gy[i] * inverse;
            nz[i] = inverse - 1.0;
        }
        let v = (y as f64 + 0.5 - self.height as f64 / 2.0) * self.unit;
        for (channel, out) in change.into_iter().enumerate() {
            // For this row each field is c0 + c1 u + c2 u^2.
            let f = self.model.fields[channel]
                .map(|c| [c[0] + v * (c[2] + v * c[5]), c[1] + v * c[4], c[3]].map(|k| k as f32));
            let out = &mut out[columns.clone()];
            for i in 0..n {
                let field = |k: &[f32; 3]| k[0] + u[i] * (k[1] + u[i] * k[2]);
                out[i] = field(&f[0]) * nx[i] + field(&f[1]) * ny[i] + field(&f[2]) * nz[i];
            }
        }
    }
}

struct Shade<'a> {
    row: LambertRow<'a>,
    along_x: &'a Plane,
    along_y: &'a Plane,
    change: &'a mut [Plane; 3],
}

impl Kernel for Shade<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(mut self) {
        let w = self.along_x.width;
        for y in 0..self.along_x.height {
            let out = self.change.each_mut().map(|plane| &mut plane.values[y * w..(y + 1) * w]);
            self.row.shade(y, 0..w, self.along_x.row(y), self.along_y.row(y), out);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn red_light_from_the_right() -> Lambert {
        Lambert::from_lights(&[Light {
            azimuth_rad: 0.0,
            elevation_rad: 0.5,
            colour: [100.0, 0.0, 0.0],
            falloff: [0.0, 0.0],
        }])
    }

    fn shade_slope(model: &Lambert, gx: f32, gy: f32) -> [f32; 3] {
        let (x, y) = (Plane::filled(9, 7, gx), Plane::filled(9, 7, gy));
        let mut change = [0, 1, 2].map(|_| Plane::filled(9, 7, 0.0));
        model.shade(&x, &y, &mut change);
        [0, 1, 2].map(|c| change[c].at(4, 3))
    }

    #[test]
    fn a_slope_towards_a_light_is_brighter_by_lamberts_law() {
        let model = red_light_from_the_right();
        // The surface falls towards the right, so it faces the light.
        let [red, green, blue] = shade_slope(&model, -0.3, 0.0);
        let n = [0.3, 0.0, 1.0].map(|c: f64| c / (1.09_f64).sqrt());
        let exact = 100.0 * (n[0] * 0.5_f64.cos() + (n[2] - 1.0) * 0.5_f64.sin());
        assert!((f64::from(red) - exact).abs() < 1e-4);
        assert_eq!((green, blue), (0.0, 0.0));
        assert!(shade_slope(&model, 0.3, 0.0)[0] < 0.0, "the other side is darker");
        assert_eq!(shade_slope(&model, 0.0, 0.0), [0.0; 3], "no slope, no change");
    }

    #[test]
    fn brightness_follows_the_falloff() {
        let model = Lambert::from_lights(&[Light {
            azimuth_rad: std::f64::consts::FRAC_PI_2,
            elevation_rad: 1.0,
            colour: [0.0, 50.0, 0.0],
            falloff: [0.4, 0.1],
        }]);
        for v in [-0.7, 0.0, 0.7] {
            let exact = 50.0 * 1.0_f64.sin() * (1.0 + 0.4 * v + 0.1 * v * v);
            assert!((model.flat(1, 0.3, v) - exact).abs() < 1e-12);
        }
    }
}
