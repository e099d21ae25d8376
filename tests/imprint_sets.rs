//! Sets of imprints, from disk to answer: volumes of images, constants in a twin, real grasps.

use crate::common::{baseline, jobs, root, run, small_project, twin_at, twin_with_sets};
use gripgen::record::{RunFolder, ShardReader, encode_png};
use gripgen::twin::{Jaw, Twin};
use gripgen::{Location, load_twin_document};
use gripgen_cli::{
    LoadImprintsError, calibrate_imprint_table, compare_imprint_table, diagnose_imprint_table,
    edited_twin_toml, imprint_calibration_edits, load_imprint_set, load_twin_sensor,
};
use gripgen_identify::{SharedConstant, Verdict};
use std::fmt::Write as _;
use std::path::Path;

const TWIN: &str = "asset:configs/twin-baseline.toml";

/// The images of a sweep of the gear, with their true forces, as a set of imprints: left jaws only, one constant for all.
fn set_of_images(folder: &Path, sets: &[&str]) {
    let out = tempfile::tempdir().unwrap();
    let own = [
        "twin=asset:configs/twin-baseline.toml",
        "design=\"grid\"",
        "shard_samples=64",
        "images=\"png\"",
        "mechanics=\"reduced\"",
        "vary.part=[\"gear\"]",
        "vary.grip_force_n=[6, 9, 12, 15, 18, 22, 26, 30, 35, 40]",
        "repetitions=2",
    ];
    run(&small_project(&[&own, sets].concat()), out.path(), jobs(2));
    let mut table = String::from("imprint_id,grip_force_n,image,part\n");
    let shard = ShardReader::open(&RunFolder::open(out.path()).unwrap().shard_path(0)).unwrap();
    for index in shard.indices() {
        let record = shard.record(index).unwrap();
        let force_n = record.sample.grip_force_n;
        let _ = writeln!(table, "{index},{force_n},{index}.png,gear");
        let left = record.images.unwrap().left;
        std::fs::write(folder.join(format!("{index}.png")), encode_png(&left).unwrap()).unwrap();
    }
    std::fs::write(folder.join("imprints.csv"), table).unwrap();
}

#[test]
fn the_growth_of_imprints_is_read_off_noisy_images() {
    let folder = tempfile::tempdir().unwrap();
    set_of_images(folder.path(), &[]);
    let error = load_imprint_set(folder.path(), None).unwrap_err();
    assert!(matches!(error, LoadImprintsError::NoSensor { images: 20, rows: 20, .. }), "{error}");
    assert!(error.hint().is_some_and(|hint| hint.contains("--sensor")));
    let (sensor, twin) = (load_twin_sensor(&Location::parse(TWIN)).unwrap(), twin_at(&baseline()));
    let loaded = |folder: &Path| load_imprint_set(folder, Some((&sensor, &twin.gel[Jaw::Left]))).unwrap();
    let set = loaded(folder.path());
    let found = calibrate_imprint_table(&set, SharedConstant::Part).unwrap();
    let c = found.parts[0].imprint_mm3_per_n.value;
    let compared = compare_imprint_table(&set, &twin).unwrap();
    println!("c = {c}, {compared:?}, {:?}", set.notes);
    assert!((0.6..1.6).contains(&(c / 1.5)), "{c}");
    assert!(compared.rmse_pct_of_peak < 8.0, "{compared:?}");
    let plain = diagnose_imprint_table(&set, &twin).diagnosis;
    let bent = tempfile::tempdir().unwrap();
    set_of_images(bent.path(), &["effects=[{ name = \"imprint_nonlinearity\", exponent = 0.6 }]"]);
    let d = diagnose_imprint_table(&loaded(bent.path()), &twin).diagnosis;
    println!("{:?}\n{:?}", plain.effects, d.effects);
    let exponent = |d: &gripgen_identify::Diagnosis| {
        d.effects
            .iter()
            .find(|e| e.name == "imprint_nonlinearity")
            .map_or(1.0, |e| e.parameters["exponent"].value)
    };
    // Steep walls count too little, so that a straight line reads as a slightly bent one: the difference is that of the truth.
    assert!((exponent(&plain) - exponent(&d) - 0.4).abs() < 0.12, "{} {}", exponent(&plain), exponent(&d));
}

#[test]
fn constants_stand_in_the_twin_with_their_evidence() {
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from("imprint_id,grip_force_n,volume_mm3,grasp,part\n");
    for (g, c) in [("a", 1.8), ("b", 2.2)] {
        for k in 1..=6 {
            let _ = writeln!(table, "{g}{k},{},{},{g},gear", 5 * k, c * 5.0 * f64::from(k));
        }
    }
    std::fs::write(folder.path().join("imprints.csv"), &table).unwrap();
    let (set, twin) = (load_imprint_set(folder.path(), None).unwrap(), twin_at(&baseline()));
    let found = calibrate_imprint_table(&set, SharedConstant::Grasp).unwrap();
    let edits = imprint_calibration_edits(&found, &twin, None, &set.sha256).unwrap();
    let out = folder.path().join("twin.toml");
    let text = edited_twin_toml(&Location::parse(TWIN), &[], &edits, &out).unwrap();
    assert!(
        text.contains(&set.sha256) && text.contains("gripgen calibrate imprints, 12 rows of 2 grasps"),
        "{text}"
    );
    std::fs::write(&out, text).unwrap();
    let new = load_twin_document(&Location::Disk(out), &[]).unwrap().read_twin().unwrap();
    let c = Twin::new(&new).unwrap().parts["gear"].imprint_m3_per_n * 1e9;
    assert!((c - (1.8f64 * 2.2).sqrt()).abs() < 1e-9, "{c}");
    // On a gel that gives way four times as much, a file has a fourth of it: what the twin makes of it is what was measured.
    let soft = [("gel.left.compliance".to_string(), "4.0".to_string())];
    let edits = imprint_calibration_edits(&found, &twin_with_sets(&baseline(), &soft), None, "").unwrap();
    assert!((edits.values[0].value - c / 4.0).abs() < 1e-9, "{:?}", edits.values[0]);
    std::fs::write(folder.path().join("imprints.csv"), table.replace(",gear", ",bolt")).unwrap();
    let other = load_imprint_set(folder.path(), None).unwrap();
    let found = calibrate_imprint_table(&other, SharedConstant::Grasp).unwrap();
    let error = imprint_calibration_edits(&found, &twin, None, "").unwrap_err();
    assert!(error.contains("`bolt`") && error.contains("gear"), "{error}");
}

/// Real grasps of rigid objects: the delay that their README found by hand is named, and the error falls.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn real_grasps_show_a_delay_and_a_power() {
    let data = root().join("../shared/real/grasp_force_wedge");
    let folder = tempfile::tempdir().unwrap();
    let mut table = String::from("imprint_id,grip_force_n,volume_mm3,grasp,part,time_s,session\n");
    let grasps = std::fs::read_to_string(data.join("grasps.csv")).unwrap();
    for line in grasps.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        if cells[5] != "1" {
            continue;
        }
        for row in std::fs::read_to_string(data.join(format!("{}.csv", cells[0]))).unwrap().lines().skip(1) {
            let of: Vec<&str> = row.split(',').collect();
            let _ = writeln!(
                table,
                "{0}-{1},{2},{3},{0},{4},{5},{6}",
                cells[0], of[0], of[2], of[9], cells[2], of[1], cells[1]
            );
        }
    }
    std::fs::write(folder.path().join("imprints.csv"), table).unwrap();
    let set = load_imprint_set(folder.path(), None).unwrap();
    let d = diagnose_imprint_table(&set, &twin_at(&baseline())).diagnosis;
    assert_eq!(d.verdict, Verdict::Effect, "{:?}", d.hints);
    assert!(d.effects.iter().any(|e| e.name == "imprint_delay"), "{:?}", d.effects);
    let error = d.error.unwrap();
    let [before, after] = [error.before, error.after].map(|e| e.rmse_mm3.unwrap());
    assert!(after < 0.75 * before, "{before} {after}");
}
