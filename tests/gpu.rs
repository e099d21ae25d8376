//! Sweeps with `backend = "gpu"`: the same labels, images within the tolerance, and clear words where there is no GPU.
//!
//! On Mesa's lavapipe, by name. Stages alone are compared in `crates/tactile/src/gpu/tests.rs`.

use crate::common::{jobs, project, run, small_project, write_project};
use gripgen::record::{Record, RunFolder, ShardReader};
use gripgen::tactile::gpu::GpuError;
use gripgen::{SweepError, SweepEvent, sweep};
use std::path::Path;
use std::sync::atomic::AtomicBool;

/// Share of the values of an image that may be more than one grey level apart.
const OUTLIERS: f64 = 0.0005;

const SOFTWARE: [&str; 2] = ["backend=gpu", "gpu_adapter=llvmpipe"];

fn images(folder: &Path, shards: u64) -> Vec<Option<[Vec<u8>; 2]>> {
    let folder = RunFolder::open(folder).unwrap();
    let mut all = vec![];
    for shard in 0..shards {
        let reader = ShardReader::open(&folder.shard_path(shard)).unwrap();
        for i in reader.indices() {
            all.push(reader.record(i).unwrap().images.map(|both| [both.left.rgb, both.right.rgb]));
        }
    }
    all
}

/// Labels, covariates and status of every sample.
fn index(folder: &Path) -> String {
    std::fs::read_to_string(folder.join("index.csv")).unwrap()
}

#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set: no Vulkan driver was found")]
fn a_gpu_sweep_has_the_same_labels_and_images_within_the_tolerance() {
    // Repetitions share a grip and differ in noise; several threads share the device.
    let sets = ["mechanics=reduced", "repetitions=2"];
    let (cpu, gpu) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let summary = run(&small_project(&sets), cpu.path(), jobs(2));
    let project = small_project(&[&sets[..], &SOFTWARE[..]].concat());
    let there = run(&project, gpu.path(), jobs(3));
    assert_eq!((there, there.failed), (summary, 0));
    assert_eq!(index(cpu.path()), index(gpu.path()), "labels and covariates");
    let shards = project.sweep.shards();
    let (ours, theirs) = (images(cpu.path(), shards), images(gpu.path(), shards));
    assert_eq!((ours.len(), theirs.len()), (24, 24));
    let mut changed = 0;
    for (sample, (a, b)) in ours.iter().zip(&theirs).enumerate() {
        let (a, b) = (a.as_ref().unwrap(), b.as_ref().unwrap());
        for (a, b) in a.iter().zip(b) {
            assert_eq!(a.len(), b.len());
            let off = a.iter().zip(b).filter(|(a, b)| a.abs_diff(**b) > 1).count();
            assert!(off as f64 <= OUTLIERS * a.len() as f64, "sample {sample}: {off} of {} values", a.len());
            changed += usize::from(a != b);
        }
    }
    println!("{changed} of {} images differ in some value", 2 * ours.len());
    let recorded = RunFolder::open(gpu.path()).unwrap().info().gpu_adapter.clone().unwrap();
    assert!(recorded.contains("llvmpipe") && recorded.contains("software"), "{recorded}");
    assert_eq!(RunFolder::open(cpu.path()).unwrap().info().gpu_adapter, None);
}

/// Files of a gear with `twin` behind it.
fn gear_sweep(twin: &str, sweep: &str) -> tempfile::TempDir {
    let gear = "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n\
                [[parts.gear.grips]]\norientation_deg = [0.0, 0.0, 90.0]\n";
    let folder = tempfile::tempdir().unwrap();
    write_project(folder.path(), &[gear, twin].concat(), sweep);
    folder
}

/// Optics effects are the processor's: what they change has the bytes of a sweep without a graphics processor. Samples
/// of the same sweep that they leave alone are the device's.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set: no Vulkan driver was found")]
fn images_that_optics_effects_change_are_those_of_the_processor() {
    let twin = "[[effects]]\nname = \"light_drift\"\nred_per_h = 0.2\nblue_per_h = -0.1\n";
    let sweep = "twin = \"twin.toml\"\nsamples = 6\nimages = \"png\"\nmechanics = \"reduced\"\n\
                 [vary]\ngrip_force_n = [30, 35, 40]\ntime_s = [0, 3600]\n";
    let folder = gear_sweep(twin, sweep);
    let config = folder.path().join("sweep.toml").display().to_string();
    let made = |sets: &[&str], out: &Path| {
        run(&project(&config, sets), out, jobs(2));
        let reader = ShardReader::open(&RunFolder::open(out).unwrap().shard_path(0)).unwrap();
        let records: Vec<_> = reader.indices().map(|i| reader.record(i).unwrap()).collect();
        records
    };
    let (ours, theirs) = (made(&[], &folder.path().join("cpu")), made(&SOFTWARE, &folder.path().join("gpu")));
    assert_eq!((ours.len(), theirs.len()), (6, 6));
    let drifted = |r: &Record| r.sample.time_s > 0.0;
    assert!((1..6).contains(&ours.iter().filter(|r| drifted(r)).count()));
    for (a, b) in ours.iter().zip(&theirs).filter(|(a, _)| drifted(a)) {
        assert!(a.images.is_some() && a.images == b.images);
    }
}

/// The contact of an elastic gel is solved on the processor, and so are its images: the bytes of a sweep without a graphics processor.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set: no Vulkan driver was found")]
fn images_of_an_elastic_gel_are_those_of_the_processor() {
    let twin = "[gel.left]\nmodel = \"elastic\"\nyoung_modulus_mpa = 0.3\n\
                [gel.right]\nmodel = \"elastic\"\nyoung_modulus_mpa = 0.3\n";
    let sweep = "twin = \"twin.toml\"\nsamples = 2\nimages = \"png\"\nmechanics = \"reduced\"\n\
                 [vary]\ngrip_force_n = [10, 20]\n";
    let folder = gear_sweep(twin, sweep);
    let config = folder.path().join("sweep.toml").display().to_string();
    let made = |sets: &[&str], out: &str| {
        let out = folder.path().join(out);
        assert_eq!(run(&project(&config, sets), &out, jobs(1)).failed, 0);
        images(&out, 1)
    };
    let ours = made(&[], "cpu");
    assert!(ours.len() == 2 && ours.iter().all(Option::is_some));
    assert!(ours == made(&SOFTWARE, "gpu"));
}

/// A run that another adapter began is continued, with a word about it.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set: no Vulkan driver was found")]
fn another_adapter_is_reported() {
    let project = small_project(&[&["mechanics=reduced"], &SOFTWARE[..]].concat());
    let out = tempfile::tempdir().unwrap();
    run(&project, out.path(), jobs(1));
    let heard = |out: &Path| {
        let mut heard = None;
        sweep(&project, out, jobs(1), &AtomicBool::new(false), |event| {
            if let SweepEvent::Gpu { another, .. } = event {
                heard = Some(another);
            }
        })
        .unwrap();
        heard.unwrap()
    };
    assert_eq!(heard(out.path()), None);
    let run_json = out.path().join("run.json");
    let text = std::fs::read_to_string(&run_json).unwrap();
    let adapter = RunFolder::open(out.path()).unwrap().info().gpu_adapter.clone().unwrap();
    std::fs::write(&run_json, text.replace(&adapter, "another card (vulkan)")).unwrap();
    assert_eq!(heard(out.path()), Some("another card (vulkan)".into()));
}

#[test]
fn a_missing_adapter_stops_a_sweep_before_anything_is_written() {
    let project = small_project(&["backend=gpu", "gpu_adapter=no such adapter"]);
    let parent = tempfile::tempdir().unwrap();
    let out = parent.path().join("run");
    let error = sweep(&project, &out, jobs(1), &AtomicBool::new(false), |_| {}).unwrap_err();
    let SweepError::Gpu(error @ GpuError::NoAdapter { .. }) = error else { panic!("{error}") };
    assert!(error.to_string().contains("no such adapter") && error.hint().contains("\"cpu\""));
    assert!(!out.exists());
    // Without images there is nothing for an adapter to do.
    let without = small_project(&["backend=gpu", "images=none", "mechanics=reduced"]);
    assert_eq!(run(&without, &out, jobs(1)).failed, 0);
}
