//! A shaded view of parts and jaws, through the height map rasteriser.

use super::canvas::{Canvas, Rgb};
use gripgen_twin::TriMesh;
use gripgen_twin::frames::{Pose, pose, rotation_about_axis};
use nalgebra::{Point3, Vector3};

/// Heights of a mesh, turned as the pose says, towards the eye of a view: in pixels, row by row, not finite where there is
/// nothing. z grows away from the eye.
pub type Rasterise<'a> = dyn Fn(&TriMesh, &Pose, &View) -> Vec<f32> + 'a;

/// Something to draw.
pub(crate) struct SceneMesh<'a> {
    pub(crate) mesh: &'a TriMesh,
    pub(crate) world_from_mesh: Pose,
    pub(crate) colour: Rgb,
}

/// Where a scene is seen from.
#[derive(Debug, Clone, Copy)]
pub struct View {
    /// Turn about the vertical.
    pub azimuth_rad: f64,
    /// Height of the eye above the horizon.
    pub elevation_rad: f64,
    /// Side of a pixel.
    pub metres_per_px: f64,
    /// Size in pixels.
    pub size_px: (u32, u32),
}

impl View {
    /// The frame that the rasteriser looks along: x right, y down, z away from the eye.
    fn eye_from_world(&self) -> Pose {
        let down = rotation_about_axis(0, std::f64::consts::FRAC_PI_2 + self.elevation_rad);
        pose(&(down * rotation_about_axis(2, self.azimuth_rad)), Vector3::zeros())
    }

    /// Pixel of a point in `world`.
    pub(crate) fn project(&self, point: Point3<f64>) -> (f64, f64) {
        let p = self.eye_from_world() * point;
        let place = |x: f64, n: u32| x / self.metres_per_px + f64::from(n) / 2.0;
        (place(p.x, self.size_px.0), place(p.y, self.size_px.1))
    }
}

impl View {
    /// Draws meshes into the canvas at (`x`, `y`); the nearest surface wins.
    pub(crate) fn draw(
        &self,
        canvas: &mut Canvas,
        (x, y): (u32, u32),
        meshes: &[SceneMesh<'_>],
        rasterise: &Rasterise<'_>,
    ) {
        let (width, height) = self.size_px;
        let size = (width as usize, height as usize);
        let map = |m: &SceneMesh<'_>| Heights {
            size,
            values: rasterise(m.mesh, &(self.eye_from_world() * m.world_from_mesh), self),
        };
        let maps: Vec<Heights> = meshes.iter().map(map).collect();
        for row in 0..size.1 {
            for column in 0..size.0 {
                let nearest = (0..maps.len())
                    .filter(|&i| maps[i].at(column, row).is_finite())
                    .reduce(|a, b| if maps[b].at(column, row) > maps[a].at(column, row) { b } else { a });
                if let Some(i) = nearest {
                    let ink = shaded(meshes[i].colour, slope(&maps[i], column, row));
                    canvas.put(x + column as u32, y + row as u32, ink);
                }
            }
        }
    }
}

/// What [`Rasterise`] gives.
struct Heights {
    size: (usize, usize),
    values: Vec<f32>,
}

impl Heights {
    fn at(&self, column: usize, row: usize) -> f32 {
        self.values[row * self.size.0 + column]
    }
}

/// Slope of the surface in pixels of height per pixel, to the side where there is a surface.
fn slope(map: &Heights, x: usize, y: usize) -> (f64, f64) {
    let here = map.at(x, y);
    let difference = |ax: usize, ay: usize, bx: usize, by: usize| {
        let (a, b) = (map.at(ax, ay), map.at(bx, by));
        match (a.is_finite(), b.is_finite()) {
            (true, true) => f64::from(b - a) / 2.0,
            (true, false) => f64::from(here - a),
            (false, true) => f64::from(b - here),
            _ => 0.0,
        }
    };
    let (l, r) = (x.saturating_sub(1), (x + 1).min(map.size.0 - 1));
    let (u, d) = (y.saturating_sub(1), (y + 1).min(map.size.1 - 1));
    (difference(l, y, r, y), difference(x, u, x, d))
}

fn shaded(colour: Rgb, (gx, gy): (f64, f64)) -> Rgb {
    let normal = Vector3::new(-gx, -gy, 1.0).normalize();
    let light = Vector3::new(-0.35, -0.55, 0.76);
    let brightness = 0.45 + 0.55 * normal.dot(&light).max(0.0);
    let part = |c: u8| (f64::from(c) * brightness).round().clamp(0.0, 255.0) as u8;
    Rgb(part(colour.0), part(colour.1), part(colour.2))
}
