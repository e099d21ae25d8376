//! Imprint constants from tactile images: those that the images were made with come back.

use crate::common::{jobs, run, small_project};
use gripgen::Location;
use gripgen::record::{Dataset, RunFolder, ShardReader, encode_png};
use gripgen::twin::TactileImage;
use gripgen_cli::{ImprintCalibrations, calibrate_imprints};
use gripgen_measured::load_pulls;
use gripgen_measured::write_pull_folder;
use std::path::Path;

/// Sixteen grips of the gear and the shaft with noisy images; the twin that is calibrated has 1.5 mm^3/N for both.
fn sweep(out: &Path, sets: &[&str]) {
    let own = [
        "design=\"random\"",
        "samples=16",
        "shard_samples=64",
        "images=\"png\"",
        "mechanics=\"reduced\"",
        "vary.part=[\"gear\", \"long_shaft\"]",
        "vary.grip_force_n={ uniform = [8, 60] }",
    ];
    run(&small_project(&[&own, sets].concat()), out, jobs(2));
}

fn calibrate(folder: &Path) -> ImprintCalibrations {
    let measured = load_pulls(folder).unwrap().pulls;
    let twin = Location::parse("asset:configs/twin-baseline.toml");
    calibrate_imprints(folder, &measured, &twin, &[]).unwrap()
}

#[test]
fn imprint_constants_come_back_from_noisy_images() {
    let out = tempfile::tempdir().unwrap();
    sweep(out.path(), &["parts.gear.imprint_mm3_per_n=2.3"]);
    let found = calibrate(out.path());
    let of = |part: &str| found.parts.iter().find(|f| f.part == part).unwrap();
    for (part, c) in [("gear", 2.3), ("long_shaft", 1.5)] {
        let fitted = &of(part).estimate.imprint_mm3_per_n;
        assert!((fitted.value / c - 1.0).abs() < 0.01, "{part}: {fitted:?}");
        assert!(of(part).explained > 0.8, "{part}: {}", of(part).explained);
    }
}

/// The same images as files, the camera 12 grey levels brighter than on the day of its sensor file, with a rest frame.
#[test]
fn an_exponent_is_seen_in_files_of_a_brighter_camera() {
    let out = tempfile::tempdir().unwrap();
    sweep(out.path(), &["effects=[{ name = \"imprint_nonlinearity\", exponent = 0.7 }]"]);
    let folder = tempfile::tempdir().unwrap();
    write_pull_folder(folder.path(), &load_pulls(out.path()).unwrap().pulls).unwrap();
    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    let shard = ShardReader::open(&RunFolder::open(out.path()).unwrap().shard_path(0)).unwrap();
    for index in shard.indices() {
        let both = shard.record(index).unwrap().images.unwrap();
        for (jaw, image) in both.iter() {
            let rgb = image.rgb.iter().map(|v| v.saturating_add(12)).collect();
            let brighter = TactileImage { rgb, ..image.clone() };
            std::fs::write(images.join(format!("{index}_{jaw}.png")), encode_png(&brighter).unwrap())
                .unwrap();
        }
    }
    let found = calibrate(folder.path());
    assert_eq!(found.parts.len(), 2, "{:?}", found.notes);
    for part in &found.parts {
        let p = part.estimate.exponent.as_ref().unwrap();
        assert!((p.value - 0.7).abs() < 0.02, "{}: {p:?}", part.part);
    }
}

#[test]
fn images_of_another_part_or_size_are_not_believed() {
    let out = tempfile::tempdir().unwrap();
    sweep(out.path(), &["vary.part=[\"gear\"]"]);
    // The twin has the mesh of another part under this name.
    let measured = load_pulls(out.path()).unwrap().pulls;
    let mesh = ("parts.gear.mesh".to_string(), "\"asset:parts/long_shaft/part.stl\"".to_string());
    let twin = Location::parse("asset:configs/twin-baseline.toml");
    let found = calibrate_imprints(out.path(), &measured, &twin, &[mesh]).unwrap();
    assert!(found.notes.iter().any(|n| n.contains("do not look like")), "{found:?}");
    let folder = tempfile::tempdir().unwrap();
    write_pull_folder(folder.path(), &measured).unwrap();
    let images = folder.path().join("images");
    std::fs::create_dir(&images).unwrap();
    let small = encode_png(&TactileImage { width_px: 4, height_px: 3, rgb: vec![9; 36] }).unwrap();
    for jaw in ["left", "right"] {
        std::fs::write(images.join(format!("0_{jaw}.png")), &small).unwrap();
    }
    let e = calibrate_imprints(folder.path(), &measured, &twin, &[]).unwrap_err().to_string();
    assert!(e.contains("4x3") && e.contains("320x240"), "{e}");
}

/// 12 samples in shards of 5, the middle one not done: rows close up, samples keep their indices.
#[test]
fn samples_are_found_where_a_shard_is_missing() {
    let out = tempfile::tempdir().unwrap();
    run(&small_project(&["images=\"none\"", "mechanics=\"reduced\""]), out.path(), jobs(2));
    std::fs::remove_file(RunFolder::open(out.path()).unwrap().sidecar_path(1)).unwrap();
    let rows = Dataset::open(out.path()).unwrap();
    assert_eq!(rows.table().rows(), 7);
    for (sample, row) in
        [(0, Some(0)), (4, Some(4)), (5, None), (9, None), (10, Some(5)), (11, Some(6)), (12, None)]
    {
        assert_eq!(rows.row_of(&sample.to_string()), row, "sample {sample}");
        assert!(row.is_none_or(|row| rows.sample_index(row).unwrap() == sample));
    }
    assert_eq!(rows.row_of("p0001"), None);
}
