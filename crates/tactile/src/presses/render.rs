//! The picture of a body that is pressed in, or of a surface that is known by its height at each pixel, with the gel that it is a
//! picture of.

use super::Contact;
use super::compare::{gel_of, sink_in_fraction};
use super::contact::imprint;
use super::indenter::{Indenter, MAX_TRAVEL_M};
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::indent::Imprint;
use crate::npz::Array;
use crate::render::Renderer;
use crate::sensor::Sensor;
use crate::simd::SimdLevel;
use gripgen_twin::TactileImage;
use std::sync::Arc;

/// What a sensor sees of a body, without noise, and the gel that it sees. All of the size of the sensor's image, row by row.
#[derive(Debug, Clone, PartialEq)]
pub struct RenderedBody {
    /// The image.
    pub image: TactileImage,
    /// How far the gel's surface stands above its rest towards the camera, in millimetres; 0 where nothing moves it.
    pub heights_mm: Plane,
    /// Unit normal of that displaced surface: components to the image's right, to its top, and towards the camera.
    pub normals: [Plane; 3],
    /// Where the gel follows the body.
    pub contact: Vec<bool>,
}

/// Presses a body in and looks at it.
pub fn render_body(indenter: &Arc<Indenter>, sensor: &Sensor) -> RenderedBody {
    let contact = Contact { circle: indenter.circle(), travel_m: None, indenter: Some(Arc::clone(indenter)) };
    // No ball is looked at.
    render_imprint(&contact.imprint(0.0, &sensor.grid, &sensor.gel_shape, sink_in_fraction(sensor)), sensor)
}

/// Looks at an imprint. One without any depth is the gel at rest.
fn render_imprint(imprint: &Imprint, sensor: &Sensor) -> RenderedBody {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let touched = imprint.depth_px.values.iter().any(|&d| d > 0.0);
    let surface_px = renderer.surface(imprint);
    let (along_x, along_y) = gradient(&surface_px);
    let inverse = along_x.zip(&along_y, |gx, gy| 1.0 / (1.0 + gx * gx + gy * gy).sqrt());
    // Rows count downwards, the normal's second component upwards.
    let across = along_x.zip(&inverse, |gx, inverse| -gx * inverse);
    let up = along_y.zip(&inverse, |gy, inverse| gy * inverse);
    let core_px = renderer.core_px(imprint) as f32;
    let mm_per_px = (sensor.grid.metres_per_px * 1e3) as f32;
    RenderedBody {
        image: renderer.image(touched.then_some(imprint), None),
        heights_mm: surface_px.map(|h| h * mm_per_px),
        normals: [across, up, inverse],
        contact: imprint.depth_px.values.iter().map(|&d| d > core_px).collect(),
    }
}

/// Why heights cannot be pressed in.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum HeightsError {
    /// Not one height for each pixel.
    #[error("the heights have the shape {found:?}, the sensor's image has {wanted:?} (rows, columns)")]
    Shape {
        /// Their shape.
        found: Vec<usize>,
        /// Rows and columns of the sensor's image.
        wanted: [usize; 2],
    },
    /// A height that is no number.
    #[error("the height in row {row}, column {column} is no number")]
    NotANumber {
        /// Its row, from 0.
        row: usize,
        /// Its column, from 0.
        column: usize,
    },
    /// A travel was given, and there is no surface that could travel.
    #[error("none of the {count} heights is finite")]
    Nothing {
        /// How many there are.
        count: usize,
    },
    /// A press that cannot be.
    #[error("the surface is pressed in by {travel_mm} mm, it must be {least} and at most {most_mm} mm")]
    Travel {
        /// Its highest point, or the travel that was given.
        travel_mm: f64,
        /// The least there can be, in words.
        least: &'static str,
        /// The largest there can be.
        most_mm: f64,
    },
}

/// Presses in a surface that stands `heights_m` (rows, columns) above the gel at rest, towards the camera, and looks at it; where
/// it stands below, nothing touches, and `-inf` is no surface at all.
///
/// With `travel_m` the whole surface is moved first, until its highest point is so deep: its travel after first contact. Without
/// it that point's height is the travel, and a surface that nowhere reaches the gel leaves the frame at rest.
///
/// # Errors
/// Another number of heights than the sensor has pixels, one that is no number, and a press of more than 10 mm.
pub fn render_heights(
    heights_m: &Array,
    travel_m: Option<f64>,
    sensor: &Sensor,
) -> Result<RenderedBody, HeightsError> {
    let grid = &sensor.grid;
    let wanted = [grid.height_px, grid.width_px];
    let count = heights_m.values.len();
    if heights_m.shape != wanted || count != grid.width_px * grid.height_px {
        return Err(HeightsError::Shape { found: heights_m.shape.clone(), wanted });
    }
    if let Some(at) = heights_m.values.iter().position(|h| h.is_nan()) {
        return Err(HeightsError::NotANumber { row: at / grid.width_px, column: at % grid.width_px });
    }
    let highest_m = heights_m.values.iter().fold(f64::NEG_INFINITY, |m, &h| m.max(h));
    let refused = |travel_m: f64, least| {
        let (travel_mm, most_mm) = (travel_m * 1e3, MAX_TRAVEL_M * 1e3);
        Err(HeightsError::Travel { travel_mm, least, most_mm })
    };
    let lift_m = match travel_m {
        Some(_) if highest_m == f64::NEG_INFINITY => return Err(HeightsError::Nothing { count }),
        // NaN is refused too.
        Some(travel_m) if !(travel_m > 0.0 && travel_m <= MAX_TRAVEL_M) => {
            return refused(travel_m, "above 0");
        }
        Some(travel_m) if highest_m.is_finite() => travel_m - highest_m,
        _ if highest_m > MAX_TRAVEL_M => return refused(highest_m, "finite"),
        _ => 0.0,
    };
    let depth_px = |height_m: &f64| ((height_m + lift_m).max(0.0) / grid.metres_per_px) as f32;
    let values = heights_m.values.iter().map(depth_px).collect();
    let depth_px = Plane { width: grid.width_px, height: grid.height_px, values };
    let press_m = travel_m.unwrap_or(highest_m.max(0.0));
    Ok(render_imprint(&imprint(depth_px, press_m), sensor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::presses::IndenterPose;
    use gripgen_twin::TriMesh;
    use nalgebra::Point3;

    fn sensor() -> Sensor {
        let bytes = include_bytes!("../../../../assets/sensors/gelsight_synthetic/sensor.npz");
        Sensor::from_npz(bytes, None, None).unwrap()
    }

    /// A plate of 40 x 30 pixels, whose edges lie on borders of pixels.
    #[test]
    fn heights_are_drawn_as_the_mesh_that_has_them() {
        let sensor = sensor();
        let grid = &sensor.grid;
        let (w, h, side_m) = (grid.width_px, grid.height_px, grid.metres_per_px);
        let (half_x, half_y) = (20, 15);
        let at = |x: i32, y: i32| Point3::new(f64::from(x) * side_m, f64::from(y) * side_m, 0.0);
        let corners = [(-half_x, -half_y), (half_x, -half_y), (half_x, half_y), (-half_x, half_y)];
        let mesh = TriMesh::new(corners.map(|(x, y)| at(x, y)).to_vec(), vec![[0, 1, 2], [0, 2, 3]]).unwrap();
        let middle = IndenterPose::middle_of(grid);
        let block = Indenter::of_mesh("block", &mesh, middle, 0.4e-3, grid).unwrap();
        let of_mesh = render_body(&Arc::new(block), &sensor);
        let inside = |i: usize, n: usize, half: i32| (2 * i + 1).abs_diff(n) < 2 * half as usize;
        let top =
            |height_m: f64, beside_m: f64| Array {
                shape: vec![h, w],
                values: (0..w * h)
                    .map(|i| {
                        if inside(i % w, w, half_x) && inside(i / w, h, half_y) { height_m } else { beside_m }
                    })
                    .collect(),
            };
        let of_heights = render_heights(&top(0.4e-3, f64::NEG_INFINITY), None, &sensor).unwrap();
        assert_eq!(of_heights.image, of_mesh.image);
        assert_eq!(of_heights.contact, of_mesh.contact);
        let heights = of_heights.heights_mm.values.iter().zip(&of_mesh.heights_mm.values);
        assert!(heights.fold(0.0f32, |m, (a, b)| m.max((a - b).abs())) < 1e-5);
        // A travel moves the surface to where it is so deep.
        let moved = render_heights(&top(-7.0, -8.0), Some(0.4e-3), &sensor).unwrap();
        assert_eq!(moved.image, of_mesh.image);
        // What lies below the gel is not touched, however close it is.
        let beside = render_heights(&top(0.4e-3, -1e-3), None, &sensor).unwrap();
        assert_eq!(beside, of_heights);
        // The gel follows a roof where it is deeper than a share of the travel, wherever that comes from.
        let roof = |highest_m: f64| {
            let height = |i: usize| highest_m - 5e-6 * ((i % w) as f64 - 160.0).abs();
            Array { shape: vec![h, w], values: (0..w * h).map(height).collect() }
        };
        let plain = render_heights(&roof(0.4e-3), None, &sensor).unwrap();
        let lowered = render_heights(&roof(-7.0), Some(0.4e-3), &sensor).unwrap();
        let wide = |body: &RenderedBody| body.contact.iter().filter(|&&c| c).count() / h;
        // 0.4 of the travel are left 0.24 mm below the ridge: 48 px to either side.
        assert!(wide(&plain).abs_diff(96) <= 2 && wide(&plain) == wide(&lowered), "{}", wide(&plain));
        // Before it touches the gel is at rest.
        let before = render_heights(&top(-1e-4, -1.0), None, &sensor).unwrap();
        assert_eq!(before.image, crate::finish(&sensor, None, None));
        assert!(before.heights_mm.values.iter().all(|&h| h == 0.0) && !before.contact.contains(&true));
    }

    #[test]
    fn what_cannot_be_pressed_is_refused_with_its_numbers() {
        let sensor = sensor();
        let (w, h) = (sensor.grid.width_px, sensor.grid.height_px);
        let flat = |height_m: f64| Array { shape: vec![h, w], values: vec![height_m; w * h] };
        let refused = |heights: &Array, travel_m| {
            render_heights(heights, travel_m, &sensor).map(|_| ()).unwrap_err().to_string()
        };
        let turned = Array { shape: vec![w, h], values: vec![0.0; w * h] };
        let wanted =
            "the heights have the shape [320, 240], the sensor's image has [240, 320] (rows, columns)";
        assert_eq!(refused(&turned, None), wanted);
        let mut torn = flat(0.0);
        torn.values[3 * w + 5] = f64::NAN;
        assert_eq!(refused(&torn, None), "the height in row 3, column 5 is no number");
        assert_eq!(refused(&flat(f64::NEG_INFINITY), Some(1e-3)), "none of the 76800 heights is finite");
        let deep = "the surface is pressed in by 20 mm, it must be finite and at most 10 mm";
        assert_eq!(refused(&flat(0.02), None), deep);
        assert!(refused(&flat(f64::INFINITY), None).contains("inf mm"));
        assert!(refused(&flat(f64::INFINITY), Some(1e-3)).contains("inf mm"));
        assert!(refused(&flat(0.0), Some(0.0)).contains("by 0 mm, it must be above 0"));
        assert!(refused(&flat(0.0), Some(f64::NAN)).contains("NaN mm"));
    }
}
