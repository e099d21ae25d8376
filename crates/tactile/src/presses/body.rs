//! The picture of a body that is pressed in, with the surface that it is a picture of.

use super::Contact;
use super::compare::{gel_of, sink_in_fraction};
use super::indenter::Indenter;
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::indent::Imprint;
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
pub(super) fn render_imprint(imprint: &Imprint, sensor: &Sensor) -> RenderedBody {
    let gel = gel_of(sensor);
    let renderer = Renderer { sensor, gel: &gel, level: SimdLevel::best() };
    let touched = imprint.depth_px.values.iter().any(|&d| d > 0.0);
    let surface_px = renderer.surface(imprint);
    let (along_x, along_y) = gradient(&surface_px);
    let mut normals = [0, 1, 2].map(|_| Plane::filled(surface_px.width, surface_px.height, 0.0));
    for (pixel, (&gx, &gy)) in along_x.values.iter().zip(&along_y.values).enumerate() {
        let inverse = 1.0 / (1.0 + gx * gx + gy * gy).sqrt();
        // Rows count downwards, the normal's second component upwards.
        for (plane, component) in normals.iter_mut().zip([-gx * inverse, gy * inverse, inverse]) {
            plane.values[pixel] = component;
        }
    }
    let core_px = renderer.core_px(imprint) as f32;
    let mm_per_px = (sensor.grid.metres_per_px * 1e3) as f32;
    let mut heights_mm = surface_px;
    heights_mm.values.iter_mut().for_each(|h| *h *= mm_per_px);
    RenderedBody {
        image: renderer.image(touched.then_some(imprint), None),
        heights_mm,
        normals,
        contact: imprint.depth_px.values.iter().map(|&d| d > core_px).collect(),
    }
}
