//! Pictures of docs/sensors.md: real presses beside drawn ones, and bodies that the sensor has never seen, drawn.
//!
//! A sensor is calibrated on the presses of a set with even numbers, and draws those with odd numbers. Run with
//! `cargo xtask research press-pictures PRESSES FOLDER [--ball-mm D --mm-per-px P]`; it writes
//! `FOLDER/sensor-real.png` and `FOLDER/sensor-shapes.png`, and says the errors.

use crate::{StudyResult, arguments};
use gripgen::record::encode_png;
use gripgen::tactile::Sensor;
use gripgen::tactile::presses::{
    CalibrateOptions, Indenter, IndenterPose, PressSet, USUAL_EDGE_RADIUS_M, calibrate_presses,
    compare_presses, predict_press, render_body,
};
use gripgen::twin::{TactileImage, TriMesh};
use gripgen_cli::{PressGeometry, load_presses};
use nalgebra::Point3;
use std::path::Path;
use std::sync::Arc;

/// Side of what is cut out, and how often it is made smaller.
const CUT_PX: usize = 320;
const SMALLER: usize = 2;

/// Side of a tile.
const TILE_PX: usize = CUT_PX / SMALLER;

/// How much larger than life differences are drawn.
const ENLARGED: f64 = 4.0;

const DEPTHS_MM: [f64; 4] = [0.25, 0.5, 0.75, 1.0];

pub fn run() -> StudyResult {
    let mut words: Vec<String> = arguments().collect();
    let mut number = |option: &str| {
        let at = words.iter().position(|w| w == option).filter(|at| at + 1 < words.len())?;
        words.drain(at..at + 2).nth(1)?.parse::<f64>().ok()
    };
    let geometry = PressGeometry {
        ball_m: number("--ball-mm").map(|mm| mm * 1e-3),
        metres_per_px: number("--mm-per-px").map(|mm| mm * 1e-3),
    };
    let [presses, folder] = words.as_slice() else {
        eprintln!("usage: press_pictures PRESSES FOLDER [--ball-mm D --mm-per-px P]");
        return Ok(());
    };
    let set = load_presses(Path::new(presses), geometry).expect("a press set");
    let half = |odd: usize| PressSet {
        presses: set.presses.iter().skip(odd).step_by(2).cloned().collect(),
        ..set.clone()
    };
    let options = CalibrateOptions { folds: Some(2), ..Default::default() };
    let sensor = calibrate_presses(&half(0), &options).expect("a calibration").sensor;
    let write = |name: &str, tiles: &[Vec<Tile>]| {
        let path = Path::new(folder).join(name);
        std::fs::write(&path, encode_png(&sheet(tiles)).expect("an image")).expect("a folder to write to");
        println!("{}", path.display());
    };
    write("sensor-real.png", &real_beside_drawn(&half(1), &sensor));
    write("sensor-shapes.png", &shapes(&sensor));
    Ok(())
}

/// Red, green and blue of a tile, row by row.
type Tile = Vec<[f64; 3]>;

/// Columns: the median press and the worst, by the error around the contact; rows: real, drawn, real minus drawn.
fn real_beside_drawn(unseen: &PressSet, sensor: &Sensor) -> Vec<Vec<Tile>> {
    let scores = compare_presses(unseen, sensor).expect("one size");
    let mut order: Vec<usize> = (0..unseen.presses.len()).collect();
    let mse = |i: usize| scores.each[i].scores.crop400.mse;
    order.sort_by(|&a, &b| mse(a).total_cmp(&mse(b)));
    println!("mean MSE of {} unseen presses, 400 px: {:.2}", order.len(), scores.mean.crop400.mse);
    let mut rows = vec![Vec::new(), Vec::new(), Vec::new()];
    for (rank, name) in [(order.len() / 2, "median"), (order.len() - 1, "worst")] {
        let press = &unseen.presses[order[rank]];
        println!("{name}: `{}`, MSE {:.1}", press.name, mse(order[rank]));
        let circle = press.circle.expect("a marked press");
        let at = (circle.x_px, circle.y_px);
        let drawn = predict_press(press, unseen.ball_m, sensor).expect("one size");
        let (real, drawn) = (tile(&press.image, at), tile(&drawn, at));
        let difference = |(a, b): (&[f64; 3], &[f64; 3])| [0, 1, 2].map(|c| 128.0 + ENLARGED * (a[c] - b[c]));
        rows[2].push(real.iter().zip(&drawn).map(difference).collect());
        rows[0].push(real);
        rows[1].push(drawn);
    }
    rows
}

/// Columns: depths; rows: a flat block of 5 x 7 mm, a ridge of 90 degrees across the image. The calibration has seen neither.
fn shapes(sensor: &Sensor) -> Vec<Vec<Tile>> {
    let grid = &sensor.grid;
    let middle = ((grid.width_px as f64 - 1.0) / 2.0, (grid.height_px as f64 - 1.0) / 2.0);
    let block = roof([[-2.5, -3.5], [2.5, 3.5]], [[-2.5, -3.5], [2.5, 3.5]]);
    let ridge = roof([[-3.0, -3.0], [3.0, 3.0]], [[-3.0, -0.01], [3.0, 0.01]]);
    let draw = |mesh: &TriMesh, depth_mm: f64| {
        let at = IndenterPose { x_px: middle.0, y_px: middle.1, rotation_rad: 0.3 };
        let body = Indenter::of_mesh("body", mesh, at, depth_mm * 1e-3, grid).expect("a body that is seen");
        let body = body.with_edge_radius(USUAL_EDGE_RADIUS_M, grid);
        tile(&render_body(&Arc::new(body), sensor).image, middle)
    };
    [block, ridge].iter().map(|mesh| DEPTHS_MM.iter().map(|depth| draw(mesh, *depth)).collect()).collect()
}

/// A body between two rectangles, the lower one 3 mm below the upper one; corners in mm.
fn roof(lower: [[f64; 2]; 2], upper: [[f64; 2]; 2]) -> TriMesh {
    let corners = |[[x0, y0], [x1, y1]]: [[f64; 2]; 2], z: f64| {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point3::new(x * 1e-3, y * 1e-3, z * 1e-3))
    };
    let vertices = [corners(lower, 0.0), corners(upper, 3.0)].concat();
    let mut triangles = vec![[4, 5, 6], [4, 6, 7], [0, 2, 1], [0, 3, 2]];
    for i in 0..4u32 {
        let next = (i + 1) % 4;
        triangles.extend([[i, next, next + 4], [i, next + 4, i + 4]]);
    }
    TriMesh::new(vertices, triangles).expect("a closed body")
}

/// What lies around a place, with means over squares; the border of the frame is continued.
fn tile(image: &TactileImage, (x, y): (f64, f64)) -> Tile {
    let (width, height) = (image.width_px as usize, image.height_px as usize);
    let first =
        |at: f64, n: usize| (at.round() as usize).saturating_sub(CUT_PX / 2).min(n.saturating_sub(CUT_PX));
    let (left, top) = (first(x, width), first(y, height));
    let mut out = vec![[0.0; 3]; TILE_PX * TILE_PX];
    for (i, sum) in out.iter_mut().enumerate() {
        for j in 0..SMALLER * SMALLER {
            let column = left + i % TILE_PX * SMALLER + j % SMALLER;
            let row = top + i / TILE_PX * SMALLER + j / SMALLER;
            let at = 3 * (row.min(height - 1) * width + column.min(width - 1));
            (0..3).for_each(|c| sum[c] += f64::from(image.rgb[at + c]) / (SMALLER * SMALLER) as f64);
        }
    }
    out
}

/// Tiles side by side.
fn sheet(rows: &[Vec<Tile>]) -> TactileImage {
    let (columns, width) = (rows[0].len(), rows[0].len() * TILE_PX);
    let mut rgb = vec![0; 3 * width * rows.len() * TILE_PX];
    for (k, tile) in rows.iter().flatten().enumerate() {
        for (i, colour) in tile.iter().enumerate() {
            let (x, y) = (k % columns * TILE_PX + i % TILE_PX, k / columns * TILE_PX + i / TILE_PX);
            let to = &mut rgb[3 * (y * width + x)..][..3];
            to.iter_mut().zip(colour).for_each(|(to, value)| *to = value.round().clamp(0.0, 255.0) as u8);
        }
    }
    TactileImage { width_px: width as u32, height_px: (rows.len() * TILE_PX) as u32, rgb }
}
