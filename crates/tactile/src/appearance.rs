//! From the surface of a pressed gel to the change of its image: stages `gradient`, `shade` and `shadow`.

use crate::colour::shade;
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
    appearance_on(sensor, raised_px, sensor.gel_shape.rest_px(&sensor.grid).as_ref(), core, level)
}

/// [`appearance`] on a gel of another shape at rest than the sensor's, in pixels towards the part; `None` is flat.
pub(crate) fn appearance_on(
    sensor: &Sensor,
    raised_px: &Plane,
    rest_px: Option<&Plane>,
    core: impl Fn(usize) -> bool,
    level: SimdLevel,
) -> [Plane; 3] {
    // Towards the camera a gel that bulges towards the part is a hollow.
    let rest = rest_px.map(|gel| gel.map(|h| -h));
    let whole = rest.as_ref().map(|rest| raised_px.zip(rest, |a, b| a + b));
    let surface_px = whole.as_ref().unwrap_or(raised_px);
    let (along_x, along_y) = gradient(surface_px);
    let rest_slope = rest.as_ref().filter(|_| !sensor.colour.takes_whole_slope()).map(gradient);
    let mut change = shade(&sensor.colour, raised_px, &along_x, &along_y, rest_slope.as_ref());
    if let Some(table) = &sensor.shadow {
        let core: Vec<u8> = (0..raised_px.values.len()).map(|i| u8::from(core(i))).collect();
        let relief = Relief { raised_px, surface_px, along_x: &along_x, along_y: &along_y, core: &core };
        shadow(table, &sensor.colour, &relief, &mut change, level);
    }
    change
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::colour::ColourModel;
    use crate::grid::Grid;
    use crate::sensor::GelShape;
    use crate::shadow::{Shadow, ShadowKind, ShadowTable};
    use crate::testing::lights;

    fn sensor(gel_shape: GelShape) -> Sensor {
        let lights = lights(0.6, [0.2, 0.1], &[(23.0, [90.0, 50.0, 20.0])]);
        let grid = Grid { width_px: 64, height_px: 48, metres_per_px: 1e-4 };
        let rest = [0, 1, 2].map(|_| vec![100.0; 64 * 48]);
        let colour = ColourModel::Lambert(Box::new(lights));
        Sensor { gel_shape, ..Sensor::new(grid, rest, [0.0; 3], colour) }
    }

    fn bump() -> Plane {
        Plane::from_fn(64, 48, |x, y| {
            let (x, y) = (x as f32 - 30.0, y as f32 - 25.0);
            6.0 * (-(x * x + y * y) / 60.0).exp()
        })
    }

    fn change(sensor: &Sensor, raised: &Plane) -> [Plane; 3] {
        appearance(sensor, raised, |i| raised.values[i] > 3.0, SimdLevel::best())
    }

    /// The rest frame already shows the shape of the gel: only what an imprint adds to it is a change.
    #[test]
    fn a_domed_gel_changes_by_what_the_imprint_adds() {
        let (flat, domed) = (sensor(GelShape::Flat), sensor(GelShape::Dome { sag_m: 1e-3 }));
        let at_rest = change(&domed, &Plane::filled(64, 48, 0.0));
        assert!(at_rest.iter().all(|plane| plane.values.iter().all(|&v| v == 0.0)), "no imprint, no change");
        // By hand: a flat gel of that surface against a flat gel of the surface at rest.
        let dome = domed.gel_shape.rest_px(&domed.grid).unwrap();
        let hollow = dome.map(|g| -g);
        let both = bump().zip(&hollow, |a, b| a + b);
        let (whole, rest) = (change(&flat, &both), change(&flat, &hollow));
        let domed = change(&domed, &bump());
        for c in 0..3 {
            for i in 0..64 * 48 {
                let by_hand = whole[c].values[i] - rest[c].values[i];
                assert!((domed[c].values[i] - by_hand).abs() < 1e-4);
            }
        }
        assert!(domed[0] != change(&flat, &bump())[0], "the shape of the gel matters");
    }

    #[test]
    fn a_sensor_with_shadows_is_darker_beside_the_contact_only() {
        let mut with = sensor(GelShape::Flat);
        let table = ShadowTable {
            kind: ShadowKind::Darkening,
            directions_rad: (0..63).map(|i| f64::from(i) * std::f64::consts::TAU / 63.0).collect(),
            first_height_m: 0.1e-3,
            height_step_m: 0.1e-3,
            heights: 3,
            step_m: 1e-4,
            rays: vec![[vec![-9.0; 8], vec![-9.0; 8], vec![]]; 63 * 3],
        };
        with.shadow = Some(Box::new(Shadow::new(table, 1e-4, 64, &with.colour)));
        let (with, without) = (change(&with, &bump()), change(&sensor(GelShape::Flat), &bump()));
        let darker = |c: usize, x: usize, y: usize| without[c].at(x, y) - with[c].at(x, y);
        assert!(darker(0, 43, 25) > 6.0 && darker(1, 30, 37) > 6.0, "beside the contact");
        assert!(darker(0, 30, 25).abs() < 1e-3 && darker(0, 2, 2).abs() < 1e-3, "in it and far away");
        assert_eq!(with[2], without[2], "a channel without shadow");
    }
}
