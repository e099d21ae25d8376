//! Times of the tactile stages on one core, as the JSON that `benches/peers/tactile.py` reads:
//! `cargo bench --bench tactile_stages -- FILE.json`. The press and the surfaces of the shipped and of a calibrated sensor that belong
//! to it go into FILE.json.f32, so that the peers work on the same contact.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;
mod scenes;

use gripgen::tactile::{
    ClusteredMesh, Plane, PressedGel, Renderer, SimdLevel, finish, gradient, indent, shade,
};
use gripgen::twin::Jaw;
use gripgen::twin::frames::world_from_gel;
use gripgen::{Location, Project};
use guard::baseline::Unit;
use std::hint::black_box;
use std::process::ExitCode;
use std::time::Instant;

fn main() -> ExitCode {
    let Some(mut run) =
        guard::Run::from_args("tactile_stages").filter(|run| run.wants_some_of("tactile_stages"))
    else {
        return ExitCode::SUCCESS;
    };
    let project = Project::load(&Location::parse("asset:configs/quickstart.toml"), &[]).unwrap();
    let twin = &project.twin;
    let sensor = project.library.sensor(&twin.optics[Jaw::Left]).unwrap();
    let (gel, grid) = (&twin.gel[Jaw::Left], sensor.grid);
    let (mesh, at) = (scenes::bumpy_ball(), scenes::gel_from_ball());
    let clustered = ClusteredMesh::new(&mesh);
    let best = Renderer { sensor: &sensor, gel, level: SimdLevel::best() };
    let press =
        |r: &Renderer<'_>| r.press(&clustered, &at, scenes::IMPRINT_M3_PER_N, scenes::FORCE_N).unwrap();
    let imprint = press(&best);
    let surface = best.surface(&imprint);
    let depth_px = gel.thickness_m / grid.metres_per_px;
    let heights = clustered.raster(&at, &grid, depth_px);
    let pressed = PressedGel::of(gel, scenes::IMPRINT_M3_PER_N);
    let (along_x, along_y) = gradient(&surface);
    let change = shade(&sensor.colour, &surface, &along_x, &along_y, None);
    let contact = imprint.depth_px.values.iter().filter(|&&d| d > 0.0).count() as f64 / grid.len() as f64;

    let mut stages = serde_json::Map::new();
    let mut stage = |name: String, us: Vec<f64>| {
        let min_us = us.iter().copied().fold(f64::INFINITY, f64::min);
        println!("{name:<28} {min_us:8.1} us");
        let path = format!("tactile_stages/{}", name.replace(", ", "/").replace(' ', "_"));
        run.measured(&path, Unit::Nanoseconds, us.iter().map(|us| 1e3 * us).collect());
        stages.insert(name, min_us.into());
    };
    stage("raster, whole gel".into(), us(|| clustered.raster(&at, &grid, depth_px)));
    stage("indent".into(), us(|| indent(&heights, &grid, &pressed, scenes::FORCE_N)));
    stage("gradient".into(), us(|| gradient(&surface)));
    stage("shade".into(), us(|| shade(&sensor.colour, &surface, &along_x, &along_y, None)));
    stage("finish".into(), us(|| finish(&sensor, Some(&change), Some(7))));
    for level in SimdLevel::available().into_iter().filter(|&l| l != SimdLevel::Portable) {
        let renderer = Renderer { level, ..best };
        let name = |stage: &str| format!("{stage}, {}", format!("{level:?}").to_lowercase());
        stage(name("press"), us(|| press(&renderer)));
        stage(name("surface"), us(|| renderer.surface(&imprint)));
        stage(name("change"), us(|| renderer.change(&imprint)));
        stage(name("image"), us(|| renderer.image(Some(&imprint), Some(7))));
        stage(name("press and image"), us(|| renderer.image(Some(&press(&renderer)), Some(7))));
    }
    let known = scenes::with_modulus(gel);
    let kinds = scenes::sensors(&sensor);
    // A sensor as `calibrate presses` writes it has blurs of its own.
    let (_, calibrated) = kinds.iter().find(|(kind, _)| *kind == "regressor").unwrap();
    let pyramid = calibrated.pyramid.as_ref().unwrap();
    let calibrated_surface = Renderer { sensor: calibrated, gel: &known, ..best }.surface(&imprint);
    let (cal_x, cal_y) = gradient(&calibrated_surface);
    let renderer = Renderer { sensor: calibrated, gel: &known, ..best };
    stage("surface of regressor".into(), us(|| renderer.surface(&imprint)));
    stage(
        "shade of regressor".into(),
        us(|| shade(&calibrated.colour, &calibrated_surface, &cal_x, &cal_y, None)),
    );
    for (kind, sensor) in &kinds {
        for level in SimdLevel::available().into_iter().filter(|&l| l != SimdLevel::Portable) {
            let renderer = Renderer { level, sensor, gel: &known };
            let name = |stage: &str| format!("{stage}, {kind}, {}", format!("{level:?}").to_lowercase());
            stage(name("image"), us(|| renderer.image(Some(&imprint), Some(7))));
            stage(name("press and image"), us(|| renderer.image(Some(&press(&renderer)), Some(7))));
        }
    }
    // Presses of parts with sharp edges, in each of their grips.
    for (name, part) in &twin.parts {
        let mesh = project.library.clustered_mesh(part).unwrap();
        for (i, grip) in part.grips.iter().enumerate() {
            let at = world_from_gel(Jaw::Left, 0.03).inverse() * grip;
            let press = || best.press(&mesh, &at, part.imprint_m3_per_n, 40.0);
            if press().is_ok() {
                stage(format!("press of {name}, {i}"), us(press));
            }
        }
    }
    println!("{} triangles, {:.1} % of the image in contact", mesh.triangles().len(), 100.0 * contact);
    let Some(file) = run.file() else { return run.finish() };
    let json = serde_json::json!({
        "width_px": grid.width_px, "height_px": grid.height_px, "triangles": mesh.triangles().len(),
        "contact_share": contact, "press_px": imprint.press_depth_m / grid.metres_per_px,
        "kernels_px": gel.kernels_px, "restore_depth_fraction": gel.restore_depth_fraction, "us": stages,
        "calibrated": {
            "kernels_px": pyramid.kernels_px, "restore_depth_fraction": pyramid.restore_depth_fraction,
        },
    });
    std::fs::write(file, serde_json::to_string_pretty(&json).unwrap()).unwrap();
    let bytes = |plane: &Plane| plane.values.iter().flat_map(|v| v.to_le_bytes()).collect::<Vec<u8>>();
    let arrays = format!("{}.f32", file.display());
    std::fs::write(arrays, [&imprint.depth_px, &surface, &calibrated_surface].map(bytes).concat()).unwrap();
    run.finish()
}

/// Many runs, in microseconds; the shortest is the one that was not interrupted.
fn us<T>(mut run: impl FnMut() -> T) -> Vec<f64> {
    let once = |_| {
        let start = Instant::now();
        black_box(run());
        1e6 * start.elapsed().as_secs_f64()
    };
    (0..300).map(once).collect()
}
