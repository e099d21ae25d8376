//! What is written is what was simulated.

use crate::common::{jobs, run, small_project};
use gripgen::record::proto::gripgen_v1::Status;
use gripgen::record::{INDEX_COLUMNS, NoiseMode, RunFolder, ShardReader, export_sample, verify};
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
            assert_eq!(
                record.sample.grip_angle_deg, 30.0,
                "as it was written, without the rounding of radians"
            );
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
    assert!(record.sample.failure.contains("20 to 80 N"), "{}", record.sample.failure);
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

    std::fs::remove_file(&shard).unwrap();
    let missing = check();
    assert!(missing.faults.iter().any(|f| f.contains("the shard it describes is missing")), "{missing:?}");
    std::fs::remove_file(folder.path().join("shard-00001.json")).unwrap();
    let missing = check();
    assert_eq!(missing.missing_shards, 1);
    assert!(missing.faults.iter().any(|f| f.contains("index.csv") && f.contains("1 shards are not")));
    std::fs::remove_file(&index).unwrap();
    assert!(check().faults.is_empty(), "a run under way");
}

/// A `run.json` whose numbers do not fit together is refused, not divided by.
#[test]
fn a_damaged_run_json_is_an_error() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&[]), folder.path(), jobs(2));
    let path = folder.path().join("run.json");
    let text = std::fs::read_to_string(&path).unwrap();
    for (from, to, part) in [
        ("\"shard_samples\": 5", "\"shard_samples\": 0", "shards of 0 do not make 3"),
        ("\"shards\": 3", "\"shards\": 4", "do not make 4 shards"),
        ("gripgen.run/1", "gripgen.run/9", "`gripgen.run/9`"),
    ] {
        assert!(text.contains(from), "{from}");
        std::fs::write(&path, text.replace(from, to)).unwrap();
        let error = RunFolder::open(folder.path()).unwrap_err().to_string();
        assert!(error.contains("run.json") && error.contains(part), "{error}");
    }
}

/// Grips that miss and pulls that end early go through encoder, shard, index and reader with their status and label.
#[test]
fn grips_that_miss_and_pulls_that_end_early_keep_their_meaning() {
    let project =
        small_project(&["vary.part=[\"gear\"]", "vary.grip_offset_mm=[0, 60]", "pull.max_force_n=3"]);
    let folder = tempfile::tempdir().unwrap();
    let summary = run(&project, folder.path(), jobs(2));
    assert_eq!((summary.samples, summary.failed, summary.no_contact, summary.censored), (6, 0, 3, 3));
    let index = std::fs::read_to_string(folder.path().join("index.csv")).unwrap();
    for shard in 0..2 {
        let reader = ShardReader::open(&folder.path().join(format!("shard-{shard:05}.mcap"))).unwrap();
        for k in reader.indices() {
            let record = reader.record(k).unwrap();
            let row = index.lines().nth(k as usize + 1).unwrap();
            let images = record.images.expect("every grip has images");
            if record.sample.grip_offset_mm == 60.0 {
                assert_eq!(record.sample.status(), Status::NoContact);
                assert_eq!((record.sample.max_pull_force_n, record.sample.mu_effective), (Some(0.0), None));
                assert!(record.trace.is_none() && record.sample.left.is_none());
                assert!(row.contains(",no_contact,"), "{row}");
            } else {
                assert_eq!(record.sample.status(), Status::Censored);
                let label = record.sample.max_pull_force_n.unwrap();
                assert!(record.sample.censored && (2.0..4.5).contains(&label), "{label} N");
                assert!(record.trace.is_some() && row.contains(",censored,"), "{row}");
            }
            assert_eq!(images.left.width_px, 320);
        }
    }
    assert!(verify(folder.path(), |_| {}).unwrap().faults.is_empty());
}

/// A Gaussian reaches where no grip can follow. Such a sample fails, and its record says what was drawn.
#[test]
fn a_draw_that_is_out_of_range_is_recorded_with_its_value() {
    let project = small_project(&[
        "design=random",
        "samples=40",
        "vary.grip_force_n={ normal = [70, 10] }",
        "vary.dwell_s={ normal = [1, 2] }",
        "images=none",
        "trace=none",
        "pull.max_force_n=2",
    ]);
    let folder = tempfile::tempdir().unwrap();
    let summary = run(&project, folder.path(), jobs(2));
    let mut failed = 0;
    for shard in 0..8 {
        let reader = ShardReader::open(&folder.path().join(format!("shard-{shard:05}.mcap"))).unwrap();
        for k in reader.indices() {
            let s = reader.sample(k).unwrap();
            let (force, dwell) = (s.drawn_number["grip_force_n"], s.drawn_number["dwell_s"]);
            assert_eq!((s.grip_force_n, s.dwell_s), (force, dwell));
            let key = if dwell < 0.0 { "dwell_s" } else { "grip_force_n" };
            let bad = force > 80.0 || dwell < 0.0;
            assert_eq!(s.status() == Status::Failed, bad, "{force} N, {dwell} s: {}", s.failure);
            assert!(!bad || s.failure.contains(key), "{}", s.failure);
            failed += u64::from(bad);
        }
    }
    assert!(failed > 5 && failed == summary.failed, "{failed}");
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

    // What would not give the same samples is refused: another version, a changed input, a changed configuration.
    let run_json = out.path().join("run.json");
    let text = std::fs::read_to_string(&run_json).unwrap();
    let refused = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        std::fs::write(&run_json, text.replacen(from, to, 1)).unwrap();
        let error = Project::from_run(&RunFolder::open(out.path()).unwrap()).err().unwrap().to_string();
        std::fs::write(&run_json, &text).unwrap();
        error
    };
    assert!(refused("\"gripgen_version\": \"", "\"gripgen_version\": \"9.").contains("gripgen 9."));
    assert!(refused("mu = 0.15", "mu = 0.16").contains("config_toml"));
    assert_eq!(verify(out.path(), |_| {}).unwrap().faults, [""; 0]);
    let input = std::fs::read_dir(out.path().join("inputs")).unwrap().next().unwrap().unwrap().path();
    std::fs::write(&input, gripgen::assets::get("parts/long_shaft/part.stl").unwrap()).unwrap();
    let error = Project::from_run(&RunFolder::open(out.path()).unwrap()).err().unwrap().to_string();
    assert!(error.contains("inputs/gear-"), "{error}");
    let faults = verify(out.path(), |_| {}).unwrap().faults;
    assert!(
        faults.len() == 1 && faults[0].contains("inputs/gear-") && faults[0].contains("SHA-256"),
        "{faults:?}"
    );
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

/// Frames that are stored small are those of `images = "clean"` when they are read, alone and as a data set.
#[test]
fn small_frames_are_read_as_they_were_made() {
    let sets = ["mechanics=reduced", "vary.part=[\"gear\"]", "vary.grip_force_n=[20, 25]", "trace=none"];
    let clean = small_project(&[&sets[..], &["images=clean"]].concat());
    let small = small_project(&[&sets[..], &["images={storage=\"clean\", compression=\"small\"}"]].concat());
    let [a, b] = [0, 1].map(|_| tempfile::tempdir().unwrap());
    run(&clean, a.path(), jobs(2));
    run(&small, b.path(), jobs(2));
    assert!(verify(b.path(), |_| {}).unwrap().faults.is_empty());
    let open =
        |folder: &tempfile::TempDir| ShardReader::open(&folder.path().join("shard-00000.mcap")).unwrap();
    let sets = [&a, &b].map(|folder| gripgen::record::Dataset::open(folder.path()).unwrap());
    for index in 0..2 {
        let (plain, found) = (open(&a).record(index).unwrap(), open(&b).record(index).unwrap());
        assert!(plain == found, "sample {index}");
        let size = 2 * 3 * 320 * 240;
        let [mut plain, mut found] = [vec![0; size], vec![0; size]];
        sets[0].images_with(index as usize, NoiseMode::Stored, &mut plain).unwrap();
        sets[1].images_with(index as usize, NoiseMode::Stored, &mut found).unwrap();
        assert!(plain == found, "row {index}");
        let pngs = sets.each_ref().map(|set| set.images_png(index as usize).unwrap());
        assert!(pngs[0] == pngs[1]);
    }
    let bytes = |index: usize| {
        let message = |folder: &tempfile::TempDir| {
            let path = folder.path().join("shard-00000.mcap");
            std::fs::metadata(path).unwrap().len()
        };
        message(if index == 0 { &a } else { &b })
    };
    println!("{} bytes clean, {} small", bytes(0), bytes(1));
    assert!(open(&b).has_clean_images() && open(&b).metadata()["background"] == "even");
}
