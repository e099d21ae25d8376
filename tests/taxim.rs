//! Files of Taxim load, and look like what they are.

use crate::common::root;
use gripgen::record::decode_picture;
use gripgen::tactile::npz::Npz;
use gripgen::tactile::{ColourModel, Plane, Sensor, shade};
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
