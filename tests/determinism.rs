//! One promise: a sample's bytes depend on (version, resolved configuration, seed, index) and on nothing else.

use crate::common::{assert_same, content, jobs, run, small_project};
use gripgen::record::{ShardReader, sha256_hex};
use gripgen::tactile::SimdLevel;
use gripgen::{SweepError, SweepEvent, SweepOptions, sweep};
use std::sync::atomic::{AtomicBool, Ordering};

#[test]
fn threads_slices_and_vector_units_give_the_same_bytes() {
    let project = small_project(&[]);
    let reference = tempfile::tempdir().unwrap();
    let summary = run(&project, reference.path(), jobs(1));
    assert_eq!((summary.samples, summary.failed, summary.complete), (12, 0, true));

    let two = tempfile::tempdir().unwrap();
    run(&project, two.path(), jobs(2));
    assert_same(reference.path(), two.path(), "2 threads");

    let many = tempfile::tempdir().unwrap();
    run(&project, many.path(), jobs(7));
    assert_same(reference.path(), many.path(), "7 threads");

    for simd in SimdLevel::available() {
        let folder = tempfile::tempdir().unwrap();
        run(&project, folder.path(), SweepOptions { simd, ..jobs(2) });
        assert_same(reference.path(), folder.path(), &format!("{simd:?}"));
    }

    let sliced = tempfile::tempdir().unwrap();
    for i in [2, 0, 1] {
        let summary = run(&project, sliced.path(), SweepOptions { slice: Some((i, 3)), ..jobs(1) });
        assert_eq!(summary.complete, i == 1, "the last piece writes the index");
    }
    assert_same(reference.path(), sliced.path(), "slices");
    // Counting from 1 names the same pieces.
    let from_one = tempfile::tempdir().unwrap();
    for i in 1..=3 {
        run(&project, from_one.path(), SweepOptions { slice: Some((i, 3)), ..jobs(1) });
    }
    assert_same(reference.path(), from_one.path(), "slices from 1");
}

#[test]
fn an_interrupted_run_continues_to_the_same_bytes() {
    let project = small_project(&[]);
    let reference = tempfile::tempdir().unwrap();
    run(&project, reference.path(), jobs(2));

    let folder = tempfile::tempdir().unwrap();
    let stop = AtomicBool::new(false);
    let summary = sweep(&project, folder.path(), jobs(2), &stop, |event| {
        if matches!(event, SweepEvent::Sample { .. }) {
            stop.store(true, Ordering::SeqCst);
        }
    })
    .unwrap();
    assert!(summary.interrupted && !summary.complete && summary.samples < 12);
    assert!(!folder.path().join("index.csv").exists());
    let again = run(&project, folder.path(), jobs(2));
    assert!(again.complete);
    assert_same(reference.path(), folder.path(), "continued");
}

/// What a crash can leave behind: a partial shard, a shard without sidecar, a truncated shard.
#[test]
fn only_what_is_missing_or_broken_is_made_again() {
    let project = small_project(&[]);
    let reference = tempfile::tempdir().unwrap();
    run(&project, reference.path(), jobs(1));
    let folder = tempfile::tempdir().unwrap();
    run(&project, folder.path(), jobs(1));
    let file = |name: &str| folder.path().join(name);
    std::fs::remove_file(file("shard-00000.json")).unwrap();
    std::fs::write(file("shard-00000.mcap.partial"), b"half a shard").unwrap();
    let bytes = std::fs::read(file("shard-00002.mcap")).unwrap();
    std::fs::write(file("shard-00002.mcap"), &bytes[..bytes.len() / 2]).unwrap();
    std::fs::remove_file(file("index.csv")).unwrap();
    let untouched = std::fs::metadata(file("shard-00001.mcap")).unwrap().modified().unwrap();

    let mut planned = None;
    sweep(&project, folder.path(), jobs(2), &AtomicBool::new(false), |event| {
        if let SweepEvent::Planned { done, shards, .. } = event {
            planned = Some((done, shards));
        }
    })
    .unwrap();
    assert_eq!(planned, Some((5, 2)), "one shard of five samples was good");
    assert_eq!(std::fs::metadata(file("shard-00001.mcap")).unwrap().modified().unwrap(), untouched);
    assert_same(reference.path(), folder.path(), "repaired");
}

#[test]
fn another_configuration_in_the_same_folder_is_refused_and_touches_nothing() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&[]), folder.path(), jobs(2));
    let before = content(folder.path());
    let other = small_project(&["seed=8"]);
    let error = sweep(&other, folder.path(), jobs(1), &AtomicBool::new(false), |_| {}).unwrap_err();
    assert!(matches!(error, SweepError::AnotherConfig { .. }), "{error}");
    assert!(error.to_string().ends_with("holds another run: sweep.seed is 7 there, 8 here"), "{error}");
    assert_eq!(content(folder.path()), before);

    let foreign = tempfile::tempdir().unwrap();
    std::fs::write(foreign.path().join("thesis.tex"), b"dear diary").unwrap();
    let error = sweep(&other, foreign.path(), jobs(1), &AtomicBool::new(false), |_| {}).unwrap_err();
    assert!(error.to_string().contains("thesis.tex"), "{error}");
    assert_eq!(content(foreign.path()).len(), 1);
}

/// Where a configuration and its files lie, and what it is called, changes no byte; a renamed one continues its run.
#[test]
fn paths_and_names_change_no_byte() {
    let twin = "[parts.gear]\nmesh = \"MESH\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n";
    let sweep = "twin = \"TWIN\"\nsamples = 4\nshard_samples = 2\n[vary]\ngrip_force_n = [20, 25]\n";
    let write = |folder: &std::path::Path, names: [&str; 2], mesh: &std::path::Path| {
        std::fs::create_dir_all(mesh.parent().unwrap()).unwrap();
        std::fs::write(mesh, gripgen::assets::get("parts/gear/part.stl").unwrap()).unwrap();
        let config = folder.join(names[0]);
        std::fs::write(folder.join(names[1]), twin.replace("MESH", mesh.to_str().unwrap())).unwrap();
        std::fs::write(&config, sweep.replace("TWIN", names[1])).unwrap();
        crate::common::project(config.to_str().unwrap(), &[])
    };
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let first = write(a.path(), ["one.toml", "t.toml"], &a.path().join("part.stl"));
    let second = write(b.path(), ["two.toml", "u.toml"], &b.path().join("meshes/part.stl"));
    assert_eq!((first.name.as_str(), second.name.as_str()), ("one", "two"));
    let (x, y) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(&first, x.path(), jobs(2));
    run(&second, y.path(), jobs(2));
    let (mut one, mut two) = (content(x.path()), content(y.path()));
    // The name of the run stands in run.json alone.
    assert!(one.remove("run.json") != two.remove("run.json"));
    assert!(one == two);

    std::fs::remove_file(x.path().join("shard-00001.json")).unwrap();
    let before = content(x.path())["run.json"].clone();
    assert!(run(&second, x.path(), jobs(1)).complete);
    let mut after = content(x.path());
    assert_eq!(after.remove("run.json"), Some(before), "a run keeps its name");
    assert!(after == two);
}

/// A sample belongs to its index, not to its shard: cutting shards differently changes files, not samples.
#[test]
fn the_size_of_shards_changes_no_sample() {
    let (small, large) = (small_project(&[]), small_project(&["shard_samples=12"]));
    let (a, b) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    run(&small, a.path(), jobs(2));
    run(&large, b.path(), jobs(2));
    let one = ShardReader::open(&b.path().join("shard-00000.mcap")).unwrap();
    for index in 0..12 {
        let path = a.path().join(format!("shard-{:05}.mcap", index / 5));
        let (mut x, mut y) =
            (ShardReader::open(&path).unwrap().record(index).unwrap(), one.record(index).unwrap());
        // The time slot in the file follows the place in it.
        (x.sample.timestamp, y.sample.timestamp) = (None, None);
        assert!(x == y, "sample {index}");
    }
}

/// The bytes of this version. A change here is a change of every user's data: it needs a line in the changelog.
#[test]
fn the_bytes_of_a_sample_are_those_of_this_version() {
    let folder = tempfile::tempdir().unwrap();
    run(&small_project(&["vary.part=[\"gear\"]", "shard_samples=3"]), folder.path(), jobs(2));
    let golden = include_str!("goldens/shard.sha256").trim();
    let found = sha256_hex(&std::fs::read(folder.path().join("shard-00000.mcap")).unwrap());
    if std::env::var_os("GRIPGEN_UPDATE").is_some() {
        std::fs::write(crate::common::root().join("tests/goldens/shard.sha256"), format!("{found}\n"))
            .unwrap();
    }
    assert_eq!(found, golden, "GRIPGEN_UPDATE=1 cargo test accepts the new bytes");
}
