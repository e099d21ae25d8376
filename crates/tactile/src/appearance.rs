//! From the surface of a pressed gel to the change of its image: stages `gradient`, `shade` and `shadow`.

use crate::colour::{ColourModel, shade};
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::sensor::Sensor;
use crate::shadow::{Relief, shadow};
use crate::simd::SimdLevel;

/// What a pressed gel changes in the image against the frame at rest, in grey levels of red, green and blue.
///
/// `raised_px` is the height of the surface over the gel at rest, towards the camera, in pixels; `core` tells for an index
/// of its pixels whether it lies in the core of the contact, where the gel follows the part and from whose rim shadows
/// are cast. Slopes are those of the whole surface, the shape of the gel at rest included.
pub fn appearance(
    sensor: &Sensor,
    raised_px: &Plane,
    core: impl Fn(usize) -> bool,
    level: SimdLevel,
) -> [Plane; 3] {
    let rest = sensor.gel_shape.rest_px(&sensor.grid).map(|gel| {
        // Towards the camera a gel that bulges towards the part is a hollow.
        Plane { values: gel.values.iter().map(|h| -h).collect(), ..gel }
    });
    let whole = rest.as_ref().map(|rest| {
        let values = raised_px.values.iter().zip(&rest.values).map(|(a, b)| a + b).collect();
        Plane { values, ..*raised_px }
    });
    let surface_px = whole.as_ref().unwrap_or(raised_px);
    let (along_x, along_y) = gradient(surface_px);
    let rest_slope = match (&sensor.colour, &rest) {
        (ColourModel::Taxim(_), _) | (_, None) => None,
        (_, Some(rest)) => Some(gradient(rest)),
    };
    let mut change = shade(&sensor.colour, raised_px, &along_x, &along_y, rest_slope.as_ref());
    if let Some(table) = &sensor.shadow {
        let core: Vec<u8> = (0..raised_px.values.len()).map(|i| u8::from(core(i))).collect();
        let relief = Relief { raised_px, surface_px, along_x: &along_x, along_y: &along_y, core: &core };
        shadow(table, &sensor.colour, &relief, &mut change, level);
    }
    change
}
