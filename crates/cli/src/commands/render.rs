//! `gripgen render`: the image of any mesh, without noise.

use crate::args::RenderArgs;
use crate::failure::Failure;
use crate::output::{JsonSink, print, writable, write_file};
use gripgen::record::encode_png;
use gripgen::tactile::npz::{Array, ElementType, write_npy};
use gripgen::tactile::presses::{IndenterPose, RenderedBody};
use gripgen::twin::TactileImage;
use gripgen::{Location, RenderError, load_sensor, render_mesh};
use serde_json::json;
use std::path::PathBuf;

/// Runs the verb.
pub fn run(args: &RenderArgs) -> Result<u8, Failure> {
    let outputs: Vec<&PathBuf> =
        [Some(&args.out), args.heights.as_ref(), args.normals.as_ref(), args.mask.as_ref()]
            .into_iter()
            .flatten()
            .collect();
    for (i, path) in outputs.iter().enumerate() {
        writable(path)?;
        if **path == args.mesh || outputs[..i].contains(path) {
            return Err(Failure::usage(format!("{}: two files would be one", path.display()))
                .hint("give every output a name of its own"));
        }
    }
    let mut sink = JsonSink::open(args.json.json.as_deref())?;
    let sensor = load_sensor(&Location::parse(&args.sensor)).map_err(|e| {
        Failure::usage(e).hint("`gripgen calibrate presses` writes a sensor file; one of ours is asset:sensors/gelsight_r15/sensor.npz")
    })?;
    let middle = |n: usize| (n as f64 - 1.0) / 2.0;
    let at = IndenterPose {
        x_px: args.x_px.unwrap_or(middle(sensor.grid.width_px)),
        y_px: args.y_px.unwrap_or(middle(sensor.grid.height_px)),
        rotation_rad: args.rotation_deg.to_radians(),
    };
    let rendered = render_mesh(&args.mesh, args.scale_mm_per_unit * 1e-3, at, args.depth_mm * 1e-3, &sensor)
        .map_err(|e| failure(args, &e))?;
    write_file(&args.out, &encode_png(&rendered.image).map_err(Failure::new)?)?;
    let size = (rendered.heights_mm.height, rendered.heights_mm.width);
    if let Some(path) = &args.heights {
        let values = rendered.heights_mm.values.iter().map(|&h| f64::from(h)).collect();
        let array = Array { shape: vec![size.0, size.1], values };
        write_file(path, &write_npy(&array, ElementType::F32))?;
    }
    if let Some(path) = &args.normals {
        let [x, y, z] = &rendered.normals;
        let values = (0..size.0 * size.1)
            .flat_map(|p| [x.values[p], y.values[p], z.values[p]].map(f64::from))
            .collect();
        let array = Array { shape: vec![size.0, size.1, 3], values };
        write_file(path, &write_npy(&array, ElementType::F32))?;
    }
    if let Some(path) = &args.mask {
        write_file(path, &encode_png(&mask(&rendered)).map_err(Failure::new)?)?;
    }
    if sink.wanted() {
        let pixels = rendered.contact.iter().filter(|&&c| c).count();
        let side_mm = sensor.grid.metres_per_px * 1e3;
        sink.document(&json!({
            "schema": "gripgen.render/1", "image": args.out, "heights": args.heights, "normals": args.normals,
            "mask": args.mask, "width_px": size.1, "height_px": size.0,
            "x_px": at.x_px, "y_px": at.y_px, "contact_area_mm2": pixels as f64 * side_mm * side_mm,
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        let lines: Vec<String> = outputs.iter().map(|path| format!("{}\n", path.display())).collect();
        print(&lines.concat())?;
    }
    Ok(0)
}

fn mask(rendered: &RenderedBody) -> TactileImage {
    let rgb = rendered.contact.iter().flat_map(|&c| [if c { 255 } else { 0 }; 3]).collect();
    TactileImage { rgb, ..rendered.image }
}

fn failure(args: &RenderArgs, error: &RenderError) -> Failure {
    let failure = Failure::usage(format!("{}: {error}", args.mesh.display()));
    match error {
        RenderError::Body(_) => failure.hint(
            "--x-px and --y-px are the place of the mesh's origin in the image; --scale-mm-per-unit is the size of its unit",
        ),
        _ => Failure::usage(error),
    }
}
