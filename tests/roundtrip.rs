//! What is written is what was simulated.

use crate::common::{jobs, run, small_project};
use gripgen::record::proto::gripgen_v1::Status;
use gripgen::record::{INDEX_COLUMNS, RunFolder, ShardReader, export_sample, verify};
use gripgen::tactile::SimdLevel;
use gripgen::twin::Outcome;
use gripgen::{Project, generate};

#[test]
fn a_shard_holds_the_samples_that_were_generated() {
    for images in ["png", "raw"] {
        let project = small_project(&[&format!("images={images}")]);
        let folder = tempfile::tempdir().unwrap();
        run(&project, folder.path(), jobs(2));
        let reader = ShardReader::open(&folder.path().join("shard-00001.mcap")).unwrap();
        assert_eq!(reader.indices(), 5..10);
        for index in [9, 5] {
            let record = reader.record(index).unwrap();
            let sample = generate(&project, index, SimdLevel::best());
            let Outcome::Pulled(pulled) = sample.outcome else { panic!("pulled") };
            assert_eq!(record.images, pulled.images, "{images}: lossless");
            assert_eq!(record.sample.max_pull_force_n, Some(pulled.label.max_pull_force_n));
            assert_eq!(record.sample.part, sample.scenario.part);
            assert_eq!(record.sample.status(), Status::Slipped);
            let trace = record.trace.unwrap();
            assert_eq!(trace.len(), pulled.trace.len());
            for (stored, row) in trace.rows().zip(pulled.trace.rows()) {
                assert!((stored.time_s - row.time_s).abs() < 1e-9);
                assert_eq!(stored.measured_force_n, f64::from(row.measured_force_n as f32));
                assert_eq!(stored.desired_force_n, row.desired_force_n);
            }
            let left = record.sample.left.unwrap();
            let force: f32 = left.cell_force_n.iter().sum();
            assert!((f64::from(force) / sample.scenario.grip_force_n - 1.0).abs() < 1e-5);
        }
        assert!(reader.record(4).is_err() && reader.record(10).is_err());
    }
}

/// Failed samples keep their place, carry their reason and have no label; the others are not touched.
#[test]
fn failed_samples_keep_their_place() {
    let project = small_project(&["vary.grip_force_n=[10, 20, 30]"]);
    let folder = tempfile::tempdir().unwrap();
    let summary = run(&project, folder.path(), jobs(2));
    assert_eq!((summary.samples, summary.failed), (12, 4), "10 N lie outside the fit of every part");
    let reader = ShardReader::open(&folder.path().join("shard-00000.mcap")).unwrap();
    let record = reader.record(0).unwrap();
    assert_eq!((record.sample.status(), record.sample.max_pull_force_n), (Status::Failed, None));
    assert!(record.images.is_none() && record.trace.is_none());
    assert!(record.sample.failure.contains("20..=80 N"), "{}", record.sample.failure);
    let index = std::fs::read_to_string(folder.path().join("index.csv")).unwrap();
    assert_eq!(index.lines().count(), 13);
    assert!(index.lines().nth(1).unwrap().contains("failed"));
    assert!(verify(folder.path(), |_| {}).unwrap().faults.is_empty());
}

#[test]
fn without_images_and_trace_the_label_is_the_same() {
    let label = |sets: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        run(&small_project(sets), folder.path(), jobs(2));
        let record = ShardReader::open(&folder.path().join("shard-00000.mcap")).unwrap().record(3).unwrap();
        (record.sample.max_pull_force_n, record.images.is_some(), record.trace.is_some())
    };
    let (full, bare) = (label(&[]), label(&["images=none", "trace=none"]));
    assert_eq!(full.0, bare.0);
    assert_eq!(((full.1, full.2), (bare.1, bare.2)), ((true, true), (false, false)));
}

#[test]
fn verify_finds_what_is_wrong() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&[]), folder.path(), jobs(2));
    let check = || verify(folder.path(), |_| {}).unwrap();
    let good = check();
    assert_eq!((good.good_shards, good.samples, good.faults.len()), (3, 12, 0));

    let shard = folder.path().join("shard-00001.mcap");
    let bytes = std::fs::read(&shard).unwrap();
    let mut broken = bytes.clone();
    broken[bytes.len() / 2] ^= 0x40;
    std::fs::write(&shard, &broken).unwrap();
    let faults = check().faults;
    assert!(faults.iter().any(|f| f.contains("shard-00001.mcap") && f.contains("SHA-256")), "{faults:?}");
    std::fs::write(&shard, &bytes).unwrap();

    let index = folder.path().join("index.csv");
    let text = std::fs::read_to_string(&index).unwrap();
    std::fs::write(&index, text.replacen("ball_bearing", "ball_barings", 1)).unwrap();
    let faults = check().faults;
    assert!(faults.len() == 1 && faults[0].contains("line 2"), "{faults:?}");
    std::fs::write(&index, text + "13,\n").unwrap();
    assert!(check().faults[0].contains("goes on after line 13"));
}

/// An export is a file of its own: one sample from time 0, every reading as a message.
#[test]
fn an_exported_sample_is_a_readable_shard() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&[]), folder.path(), jobs(2));
    let reader = ShardReader::open(&folder.path().join("shard-00001.mcap")).unwrap();
    let bytes = export_sample(&reader, 7).unwrap();
    let path = folder.path().join("one.mcap");
    std::fs::write(&path, bytes).unwrap();
    let one = ShardReader::open(&path).unwrap();
    assert_eq!(one.indices(), 7..8);
    let (mut a, mut b) = (reader.record(7).unwrap(), one.record(7).unwrap());
    assert_eq!(b.sample.timestamp.unwrap().seconds, 0);
    (a.sample.timestamp, b.sample.timestamp) = (None, None);
    assert!(a == b);
}

/// A run folder holds what is needed to make its samples again, also when the files it was made from are gone.
#[test]
fn a_run_can_be_repeated_from_its_folder() {
    let inputs = tempfile::tempdir().unwrap();
    std::fs::write(inputs.path().join("gear.stl"), gripgen::assets::get("parts/gear/part.stl").unwrap())
        .unwrap();
    let twin = "[parts.gear]\nmesh = \"gear.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n";
    std::fs::write(inputs.path().join("twin.toml"), twin).unwrap();
    let config = inputs.path().join("sweep.toml");
    std::fs::write(&config, "twin = \"twin.toml\"\nsamples = 2\n").unwrap();
    let project = crate::common::project(config.to_str().unwrap(), &[]);
    let out = tempfile::tempdir().unwrap();
    run(&project, out.path(), jobs(2));
    drop(inputs);
    let again = Project::from_run(&RunFolder::open(out.path()).unwrap()).unwrap();
    assert_eq!(again.config_sha256, project.config_sha256);
    assert!(generate(&again, 1, SimdLevel::best()) == generate(&project, 1, SimdLevel::best()));
}

/// The index has the columns of a measured pull table, under the same names.
#[test]
fn the_index_speaks_the_language_of_pull_tables() {
    for column in [
        "part",
        "grip_force_n",
        "max_pull_force_n",
        "gel_id",
        "force_increment_n",
        "step_time_s",
        "dwell_s",
        "pull_index",
        "time_s",
        "temperature_c",
        "grip_offset_mm",
        "grip_angle_deg",
        "pull_direction",
        "session",
    ] {
        assert!(INDEX_COLUMNS.contains(&column), "{column}");
    }
}
