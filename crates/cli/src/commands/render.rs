//! `gripgen render`: the image of any mesh or surface, without noise.

use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::output::JsonSink;
use crate::outputs::Outputs;
use crate::{RenderOptions, is_height_map, load_sensor, render_file};
use gripgen::Location;
use gripgen::record::encode_png;
use gripgen::tactile::npz::{Array, ElementType, write_npy};
use gripgen::tactile::presses::RenderedBody;
use gripgen::twin::{TactileImage, usual_scale_mm_per_unit};
use serde_json::json;
use std::path::Path;

/// Runs the verb.
pub fn run(args: &RenderArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads(&args.mesh).reads_config(&args.sensor, &[]);
    let written = [Some(&args.out), args.heights.as_ref(), args.normals.as_ref(), args.mask.as_ref()];
    outputs.allow_all(written.iter().flatten().map(|path| path.as_path()))?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let sensor = load_sensor(&Location::parse(&args.sensor))?;
    let extension = args.mesh.extension().map_or_else(String::new, |e| e.to_string_lossy().into_owned());
    let options = RenderOptions {
        travel_m: args.depth_mm.map(|mm| mm * 1e-3),
        x_px: args.x_px,
        y_px: args.y_px,
        rotation_rad: args.rotation_deg.to_radians(),
        edge_radius_m: args.edge_radius_mm * 1e-3,
        metres_per_unit: args.scale_mm_per_unit.unwrap_or(usual_scale_mm_per_unit(&extension)) * 1e-3,
    };
    let rendered = render_file(&args.mesh, &options, &sensor)?;
    let size = (rendered.heights_mm.height, rendered.heights_mm.width);
    let array = |path: &Path, shape: Vec<usize>, values: Vec<f64>| {
        outputs.write(path, &write_npy(&Array { shape, values }, ElementType::F32))
    };
    if let Some(path) = &args.heights {
        let values = rendered.heights_mm.values.iter().map(|&h| f64::from(h)).collect();
        array(path, vec![size.0, size.1], values)?;
    }
    if let Some(path) = &args.normals {
        let [x, y, z] = &rendered.normals;
        let values = (0..size.0 * size.1)
            .flat_map(|p| [x.values[p], y.values[p], z.values[p]].map(f64::from))
            .collect();
        array(path, vec![size.0, size.1, 3], values)?;
    }
    let image = encode_png(&rendered.image).map_err(Failure::new)?;
    outputs.write(&args.out, &image)?;
    if let Some(path) = &args.mask {
        outputs.write(path, &encode_png(&mask(&rendered)).map_err(Failure::new)?)?;
    }
    let document = || {
        let pixels = rendered.contact.iter().filter(|&&c| c).count();
        let at = (!is_height_map(&args.mesh)).then(|| options.pose(&sensor.grid));
        let side_mm = sensor.grid.metres_per_px * 1e3;
        json!({
            "schema": "gripgen.render/1", "image": args.out, "heights": args.heights, "normals": args.normals,
            "mask": args.mask, "width_px": size.1, "height_px": size.0,
            "x_px": at.map(|at| at.x_px), "y_px": at.map(|at| at.y_px),
            "contact_area_mm2": pixels as f64 * side_mm * side_mm,
        })
    };
    let lines = || written.iter().flatten().map(|path| format!("{}\n", path.display())).collect();
    sink.finish(args.talk.quiet, document, lines)
}

fn mask(rendered: &RenderedBody) -> TactileImage {
    let rgb = rendered.contact.iter().flat_map(|&c| [if c { 255 } else { 0 }; 3]).collect();
    TactileImage { rgb, ..rendered.image }
}
