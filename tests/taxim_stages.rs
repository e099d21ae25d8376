//! Colour and shadow against Taxim's own output, stage by stage. What Taxim wrote is in `real/taxim`, 640 x 480.

use crate::common::root;
use gripgen::record::decode_picture;
use gripgen::tactile::npz::{Array, ElementType, Npz, write_npz};
use gripgen::tactile::{ColourModel, Plane, Relief, Sensor, SensorFiles, SimdLevel, gradient, shade, shadow};
use gripgen::twin::TactileImage;

const W: usize = 640;
const H: usize = 480;

pub(crate) fn bytes(path: &str) -> Vec<u8> {
    std::fs::read(root().join("../shared/real/taxim").join(path)).unwrap()
}

fn array(npz: &str, key: &str) -> Array {
    Npz::open(&bytes(npz)).unwrap().array(key).unwrap()
}

/// The frame without contact of the calibration, whose channel 0 is blue.
pub(crate) fn frame() -> TactileImage {
    let bgr = array("gelsight/dataPack.npz", "f0").values;
    let rgb = bgr.chunks_exact(3).flat_map(|p| [p[2] as u8, p[1] as u8, p[0] as u8]).collect();
    TactileImage { width_px: W as u32, height_px: H as u32, rgb }
}

/// Taxim's default sensor, from its own files.
pub(crate) fn sensor() -> Sensor {
    Sensor::from_files(&SensorFiles {
        sensor: &bytes("gelsight/polycalib.npz"),
        metres_per_px: Some(0.0295e-3),
        background: Some(&frame()),
        gel_map: Some(&bytes("gelsight/gelmap.npy")),
        shadow_table: Some(&bytes("gelsight/shadowTable_dense.npz")),
    })
    .unwrap()
}

fn plane(array: &Array) -> Plane {
    Plane { width: W, height: H, values: array.values.iter().map(|&v| v as f32).collect() }
}

/// A whole image from a change of the rest frame, in the order of Taxim's files.
fn image_bgr(sensor: &Sensor, change: &[Plane; 3]) -> Vec<f64> {
    let value = |i: usize, c: usize| f64::from(sensor.rest[c][i]) + f64::from(change[c].values[i]);
    (0..W * H).flat_map(|i| [2, 1, 0].map(|c| value(i, c))).collect()
}

/// Mean and largest difference, and the share of differences above 1.
fn compare(ours: &[f64], theirs: &[f64]) -> (f64, f64, f64) {
    let n = ours.len() as f64;
    let differences = || ours.iter().zip(theirs).map(|(a, b)| (a - b).abs());
    (
        differences().sum::<f64>() / n,
        differences().fold(0.0, f64::max),
        differences().filter(|d| *d > 1.0).count() as f64 / n,
    )
}

/// Prints and asserts what equality with Taxim means: 0.01 grey levels in the mean, 1 in 10^4 channels off by 1.
fn assert_equal(what: &str, ours: &[f64], theirs: &[f64]) {
    let (mean, largest, share) = compare(ours, theirs);
    println!("{what}: mean {mean:.6}, largest {largest:.4}, off by more than 1: {:.5} %", share * 100.0);
    assert!(mean <= 0.01 && share <= 1e-4, "{what}: mean {mean}, share {share}");
}

/// Rounded to the 1/16 of a grey level that the reference images are stored in.
fn sixteenths(values: &[f64]) -> Vec<f64> {
    values.iter().map(|v| (v * 16.0).round() / 16.0).collect()
}

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn the_background_is_taxims() {
    let sensor = sensor();
    let ColourModel::Taxim(table) = &sensor.colour else { panic!("no table of Taxim") };
    let theirs = array("reference/rest.npz", "bg_proc").values;
    let ours: Vec<f64> =
        (0..W * H).flat_map(|i| [2, 1, 0].map(|c| f64::from(table.background()[c][i]))).collect();
    assert_equal("background", &ours, &theirs);
    assert_eq!(ours, theirs);
}

#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn the_gel_map_is_taxims() {
    let sensor = sensor();
    let ours = sensor.gel_shape.rest_px(&sensor.grid).unwrap();
    let theirs = array("reference/rest.npz", "gel");
    // Towards the camera, as Taxim has it, a bulging gel is a hollow.
    let worst =
        ours.values.iter().zip(&theirs.values).map(|(a, b)| (f64::from(-a) - b).abs()).fold(0.0, f64::max);
    println!("gel map: largest difference {worst:.2e} px");
    assert!(worst < 5e-5, "{worst} px");
}

/// From Taxim's own deformed heights to its images without and with shadow.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn images_and_shadows_of_given_heights_are_taxims() {
    let sensor = sensor();
    let rest = array("reference/rest.npz", "gel");
    for scene in ["press03_dome", "shaft20_dome"] {
        let of = |key: &str| array(&format!("reference/{scene}.npz"), key);
        let surface = plane(&of("H"));
        let raised = plane(&Array {
            shape: vec![H, W],
            values: of("H").values.iter().zip(&rest.values).map(|(h, r)| h - r).collect(),
        });
        let core: Vec<u8> = of("mask")
            .values
            .iter()
            .flat_map(|&byte| (0..8).map(move |bit| (byte as u8 >> (7 - bit)) & 1))
            .collect();
        let (along_x, along_y) = gradient(&surface);
        let mut change = shade(&sensor.colour, &raised, &along_x, &along_y, None);
        let stored = |key: &str| of(key).values.iter().map(|v| v / 16.0).collect::<Vec<_>>();
        assert_equal(
            &format!("{scene}, without shadow"),
            &sixteenths(&image_bgr(&sensor, &change)),
            &stored("img_x16"),
        );
        let before = change.clone();
        let relief = Relief {
            raised_px: &raised,
            surface_px: &surface,
            along_x: &along_x,
            along_y: &along_y,
            core: &core,
        };
        let table = sensor.shadow.as_ref().unwrap();
        shadow(table, &sensor.colour, &relief, &mut change, SimdLevel::best());
        assert_equal(
            &format!("{scene}, with shadow"),
            &sixteenths(&image_bgr(&sensor, &change)),
            &stored("img_shadow_x16"),
        );
        for level in SimdLevel::available() {
            let mut again = before.clone();
            shadow(table, &sensor.colour, &relief, &mut again, level);
            assert!(again == change, "{scene}: {level:?} differs");
        }
    }
}

/// Taxim's published example images, which are JPEGs. A JPEG of the same image by another encoder differs by less than
/// one grey level; raw pixels by 0.70 to 0.73, which is what JPEG loses.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn published_examples_are_reproduced() {
    let sensor = sensor();
    for name in ["square", "cylinder6"] {
        let surface = plane(&array(&format!("examples/{name}_height.npz"), "height"));
        let (along_x, along_y) = gradient(&surface);
        let change = shade(&sensor.colour, &surface, &along_x, &along_y, None);
        let ours: Vec<f64> =
            image_bgr(&sensor, &change).iter().map(|v| v.clamp(0.0, 255.0).round()).collect();
        let published = decode_picture(&bytes(&format!("examples/{name}_sim.jpg"))).unwrap();
        let theirs: Vec<f64> =
            published.rgb.chunks_exact(3).flat_map(|p| [p[2], p[1], p[0]].map(f64::from)).collect();
        if let Ok(folder) = std::env::var("TAXIM_DUMP") {
            let pixels = Array { shape: vec![H, W, 3], values: ours.clone() };
            let file = write_npz(&[("bgr", pixels, ElementType::U8)]).unwrap();
            std::fs::write(format!("{folder}/{name}.npz"), file).unwrap();
        }
        let (mean, largest, _) = compare(&ours, &theirs);
        println!("{name}: raw against the published JPEG, mean {mean:.4}, largest {largest:.1}");
        assert!((0.6..0.8).contains(&mean), "{name}: {mean}");
    }
}
