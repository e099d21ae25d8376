//! Files of Taxim load, and look like what they are.

use crate::common::{content, jobs, root, run, write_project};
use gripgen::record::{RunFolder, decode_picture};
use gripgen::tactile::npz::Npz;
use gripgen::tactile::{ColourModel, Plane, Sensor, SimdLevel, shade};
use gripgen::twin::Outcome;
use gripgen::{Project, generate};
use std::path::PathBuf;

fn taxim(path: &str) -> PathBuf {
    root().join("../shared/real/taxim").join(path)
}

/// The calibrations of three groups, with 125 and 120 bins.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn calibrations_of_any_bin_count_load() {
    let background = decode_picture(&std::fs::read(taxim("taxim_robot/bg.jpg")).unwrap()).unwrap();
    for (path, mm) in [
        ("gelsight/polycalib.npz", 0.0295),
        ("gelsight_r1.5/polycalib.npz", 0.0295),
        ("taxim_robot/polycalib.npz", 0.0295),
        ("digit/polycalib.npz", 0.0266),
    ] {
        let bytes = std::fs::read(taxim(path)).unwrap();
        let sensor = Sensor::from_npz(&bytes, Some(mm * 1e-3), Some(&background)).unwrap();
        assert_eq!((sensor.grid.width_px, sensor.grid.height_px), (640, 480), "{path}");
        assert!(matches!(sensor.colour, ColourModel::Taxim(_)));
        // What the file does not hold has to come from the twin.
        let missing = Sensor::from_npz(&bytes, None, Some(&background)).unwrap_err();
        assert!(missing.to_string().contains("mm_per_px"), "{missing}");
    }
}

/// The table's polynomial for one slope, read here straight from the file.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn a_slope_gets_the_colour_of_its_bin() {
    let bytes = std::fs::read(taxim("gelsight/polycalib.npz")).unwrap();
    let background = decode_picture(&std::fs::read(taxim("taxim_robot/bg.jpg")).unwrap()).unwrap();
    let sensor = Sensor::from_npz(&bytes, Some(0.0295e-3), Some(&background)).unwrap();
    let (gx, gy) = (0.31_f32, -0.12_f32);
    let planes = [0.0, gx, gy].map(|value| Plane::filled(640, 480, value));
    let change = shade(&sensor.colour, &planes[0], &planes[1], &planes[2], None);
    let step = std::f64::consts::FRAC_PI_2 / 124.0;
    let i = (f64::from(gx).hypot(f64::from(gy)).atan() / step).floor() as usize;
    let j = ((f64::from(gy).atan2(f64::from(gx)) + std::f64::consts::PI) / (4.0 * step)).floor() as usize;
    let ColourModel::Taxim(colour) = &sensor.colour else { panic!("no table of Taxim") };
    let mut npz = Npz::open(&bytes).unwrap();
    for (channel, key) in ["grad_b", "grad_g", "grad_r"].into_iter().enumerate() {
        let table = npz.array(key).unwrap();
        let value = |i: usize, j: usize, x: f64, y: f64| {
            let c = &table.values[(i * 125 + j) * 6..][..6];
            c[0] * x * x + c[1] * y * y + c[2] * x * y + c[3] * x + c[4] * y + c[5]
        };
        for (x, y) in [(0, 0), (320, 240), (639, 100)] {
            let (px, py) = (x as f64, y as f64);
            let exact = value(i, j, px, py);
            let at = y * 640 + x;
            let image = sensor.rest[channel][at] + change[channel].values[at];
            let ours = f64::from(image - colour.background()[channel][at]);
            assert!(
                (ours - exact).abs() < 1e-4 * (1.0 + exact.abs()),
                "{key} at ({x}, {y}): {ours} and {exact}"
            );
        }
    }
}

/// A twin that names Taxim's files: they are copied into the run folder, and the run goes on from the copies.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn a_run_keeps_the_files_of_a_taxim_sensor() {
    let folder = tempfile::tempdir().unwrap();
    for (from, to) in [
        ("gelsight/polycalib.npz", "polycalib.npz"),
        ("taxim_robot/bg.jpg", "bg.jpg"),
        ("gelsight/gelmap.npy", "gelmap.npy"),
        ("gelsight/shadowTable_dense.npz", "shadow.npz"),
    ] {
        std::fs::copy(taxim(from), folder.path().join(to)).unwrap();
    }
    let twin = "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n\
                [optics.left]\nsensor = \"polycalib.npz\"\nbackground = \"bg.jpg\"\nmm_per_px = 0.0295\n\
                gel_map = \"gelmap.npy\"\nshadow_table = \"shadow.npz\"\n";
    let sweep = "twin = \"twin.toml\"\nsamples = 1\nmechanics = \"reduced\"\n[vary]\ngrip_force_n = [20]\n";
    let out = folder.path().join("run");
    let whole = write_project(folder.path(), twin, sweep);
    let summary = run(&whole, &out, jobs(1));
    assert_eq!((summary.samples, summary.failed), (1, 0));
    let mut inputs: Vec<String> = content(&out.join("inputs")).into_keys().collect();
    inputs.retain(|name| !name.starts_with("twin"));
    let stems: Vec<&str> = inputs.iter().map(|name| name.split('-').next().unwrap()).collect();
    assert_eq!(stems, ["bg", "gelmap", "polycalib", "shadow"]);
    let again = Project::from_run(&RunFolder::open(&out).unwrap()).unwrap();
    assert_eq!(again.config_sha256, whole.config_sha256);
    let (one, two) = (generate(&whole, 0, SimdLevel::best()), generate(&again, 0, SimdLevel::Portable));
    let images = |sample| match sample {
        Outcome::Pulled(pulled) => pulled.images.unwrap(),
        other => panic!("{other:?}"),
    };
    let (one, two) = (images(one.outcome), images(two.outcome));
    assert!(one == two, "other bytes from the copies");
    // The shadow is drawn: without its table the same grip is brighter beside the contact.
    let plain = twin.replace("shadow_table = \"shadow.npz\"\n", "");
    let plain = write_project(folder.path(), &plain, sweep);
    let plain = images(generate(&plain, 0, SimdLevel::best()).outcome);
    let sum = |image: &gripgen::twin::TactileImage| image.rgb.iter().map(|&v| u64::from(v)).sum::<u64>();
    assert!(sum(&plain.left) > sum(&one.left));
}
