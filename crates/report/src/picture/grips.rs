//! The picture of proposed grips: part, jaws and axes with a scale.

use super::scene::{Rasterise, SceneMesh, View};
use super::{Anchor, Canvas, INK, PAPER, Rgb, SOFT_INK, TextStyle};
use gripgen_twin::frames::pose;
use gripgen_twin::{Jaw, Proposal, TriMesh};
use nalgebra::{Point3, Rotation3, Vector3};

pub(crate) const PANEL: (u32, u32) = (620, 460);
const HEADER: u32 = 56;
const STEEL: Rgb = Rgb(176, 184, 194);
const GEL: [Rgb; 2] = [Rgb(96, 150, 214), Rgb(232, 140, 70)];
const AXES: [(Rgb, &str); 3] =
    [(Rgb(200, 40, 40), "x long axis"), (Rgb(30, 140, 60), "y jaw axis"), (Rgb(40, 70, 200), "z up")];
/// Size of a drawn pad: gel and what carries it.
const PAD_M: [f64; 3] = [28e-3, 6e-3, 21e-3];

/// A PNG with one panel for each grip.
pub fn grips_picture(name: &str, mesh: &TriMesh, grips: &[Proposal], rasterise: &Rasterise<'_>) -> Vec<u8> {
    let columns = if grips.len() > 1 { 2 } else { 1 };
    let rows = grips.len().div_ceil(columns as usize) as u32;
    let mut canvas = Canvas::new(columns * PANEL.0, HEADER + rows * PANEL.1, PAPER);
    let [x, y, z] = mesh.extent_m().map(|s| s * 1e3);
    let title = format!("{name}: {x:.1} x {y:.1} x {z:.1} mm in its mesh frame");
    canvas.text(&title, 14.0, 8.0, Anchor::Left, TextStyle::title(INK));
    let legend = "blue: left jaw, orange outline: right jaw, at a grip angle of 0; the pull is along z";
    canvas.text(legend, 14.0, 32.0, Anchor::Left, TextStyle::small(SOFT_INK));
    for (i, grip) in grips.iter().enumerate() {
        let at = (i as u32 % columns * PANEL.0, HEADER + i as u32 / columns * PANEL.1);
        panel(&mut canvas, at, mesh, (i, grip), rasterise);
    }
    canvas.into_png()
}

/// A PNG of one grip.
pub(crate) fn grip_picture(mesh: &TriMesh, grip: (usize, &Proposal), rasterise: &Rasterise<'_>) -> Vec<u8> {
    let mut canvas = Canvas::new(PANEL.0, PANEL.1, PAPER);
    panel(&mut canvas, (0, 0), mesh, grip, rasterise);
    canvas.into_png()
}

/// Part, jaws and axes of a grip, with the top left corner at a place.
pub(crate) fn panel(
    canvas: &mut Canvas,
    (x, y): (u32, u32),
    mesh: &TriMesh,
    (grip_pose, grip): (usize, &Proposal),
    rasterise: &Rasterise<'_>,
) {
    let part = grip.part_from_mesh();
    let reach = mesh.vertices_m().iter().map(|v| (part * v).coords.norm()).fold(0.02, f64::max);
    let view = View {
        azimuth_rad: 0.6,
        elevation_rad: 0.5,
        metres_per_px: 2.3 * reach.max(0.03) / f64::from(PANEL.1),
        size_px: PANEL,
    };
    let pads = Jaw::BOTH.map(|jaw| {
        let distance = grip.width_mm * 0.5e-3 + PAD_M[1] / 2.0;
        pose(&Rotation3::identity(), Vector3::new(0.0, jaw.side() * distance, 0.0))
    });
    let pad = cuboid(PAD_M);
    let meshes = [
        SceneMesh { mesh, world_from_mesh: part, colour: STEEL },
        SceneMesh { mesh: &pad, world_from_mesh: pads[0], colour: GEL[0] },
    ];
    view.draw(canvas, (x, y), &meshes, rasterise);
    // The near jaw as an outline: a small part would be hidden behind it.
    for (a, b) in edges(&pad) {
        let place = |corner: usize| {
            let (u, v) = view.project(pads[1] * pad.vertices_m()[corner]);
            (f64::from(x) + u, f64::from(y) + v)
        };
        canvas.line(&[place(a), place(b)], 2.0, GEL[1]);
    }
    draw_axes(canvas, (x, y), &view, reach);
    let text = format!(
        "grip_pose = {grip_pose}: {:.1} mm between the jaws, {:.0} mm\u{b2} in contact",
        grip.width_mm, grip.contact_mm2
    );
    canvas.text(&text, f64::from(x + 14), f64::from(y + 6), Anchor::Left, TextStyle::small(INK));
}

/// The axes of the part frame, and a bar of a round length.
fn draw_axes(canvas: &mut Canvas, (x, y): (u32, u32), view: &View, reach: f64) {
    let place = |p: Point3<f64>| {
        let (u, v) = view.project(p);
        (f64::from(x) + u, f64::from(y) + v)
    };
    let length = 0.9 * reach;
    for (axis, (ink, label)) in AXES.into_iter().enumerate() {
        let mut tip = Point3::origin();
        tip[axis] = length;
        canvas.line(&[place(Point3::origin()), place(tip)], 2.0, ink);
        let (u, v) = place(tip);
        canvas.disc(u, v, 3.0, ink);
        let anchor = if u > f64::from(x + PANEL.0) * 0.8 { Anchor::Right } else { Anchor::Left };
        canvas.text(label, u + 6.0, v - 18.0, anchor, TextStyle { ink, large: false, bold: true });
    }
    let bar_mm = [1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]
        .into_iter()
        .rev()
        .find(|mm| mm * 1e-3 < 0.6 * reach)
        .unwrap_or(1.0);
    let width = bar_mm * 1e-3 / view.metres_per_px;
    let (left, bottom) = (f64::from(x) + 16.0, f64::from(y + PANEL.1) - 18.0);
    canvas.line(&[(left, bottom), (left + width, bottom)], 3.0, INK);
    let text = format!("{bar_mm} mm");
    canvas.text(&text, left, bottom - 20.0, Anchor::Left, TextStyle::small(INK));
}

/// Corners that an edge of a box joins: their numbers differ in one bit.
fn edges(cuboid: &TriMesh) -> impl Iterator<Item = (usize, usize)> {
    let corners = cuboid.vertices_m().len();
    (0..corners)
        .flat_map(|a| [1, 2, 4].into_iter().filter(move |bit| a & bit == 0).map(move |bit| (a, a | bit)))
}

/// A box centred on the origin.
fn cuboid(sides_m: [f64; 3]) -> TriMesh {
    let vertices = (0..8)
        .map(|i| {
            let sign = |bit: usize| if i >> bit & 1 == 1 { 0.5 } else { -0.5 };
            Point3::new(sign(0) * sides_m[0], sign(1) * sides_m[1], sign(2) * sides_m[2])
        })
        .collect();
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = quads.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    TriMesh::new(vertices, triangles).expect("a box is a mesh")
}
