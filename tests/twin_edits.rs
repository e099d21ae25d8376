//! Twins that were changed: what is written is read back, and what is taken out leaves nothing behind.

use crate::common::{self, twin_at};
use gripgen::twin::Pulled;
use gripgen::twin::config::{CalibrationFile, EffectFile};
use gripgen::{Location, load_twin_document};
use gripgen_cli::{EditedValue, TwinEdits, edited_twin, write_twin};
use std::path::Path;

fn effect(text: &str) -> EffectFile {
    toml::from_str(text).unwrap()
}

fn calibration() -> CalibrationFile {
    CalibrationFile {
        low90: 0.19,
        high90: 0.22,
        evidence: Some("88 pulls".into()),
        data_sha256: Some("ab".into()),
        before: None,
    }
}

#[test]
fn a_twin_without_edits_is_the_same_twin() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["twin-baseline", "twin", "twin-training"] {
        let base = Location::parse(&format!("asset:configs/{name}.toml"));
        let out = folder.path().join(format!("{name}.toml"));
        write_twin(&base, &[], &TwinEdits::default(), &out).unwrap();
        assert_eq!(twin_at(&Location::Disk(out)), twin_at(&base), "{name}");
    }
}

#[test]
fn fitted_values_stand_in_the_new_twin_with_their_intervals() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("fitted.toml");
    let base = Location::parse("asset:configs/twin.toml");
    let value = |key: &str, value| EditedValue { key: key.into(), value, calibration: Some(calibration()) };
    let mut edits = TwinEdits {
        values: vec![
            value("parts.gear.mu", 0.1 + 0.2),
            value("robot.lag_s", 1.0 / 3.0),
            value("gel.left.shear_stiffness_n_per_mm", 17.0),
            value("gel.right.shear_stiffness_n_per_mm", 18.0),
            value("parts.gear.scatter", 0.03),
            value("effects.load_offset.gear.a", 1.25),
        ],
        effects: None,
    };
    let sets = [("wrist.noise_n".to_string(), "0.4".to_string())];
    write_twin(&base, &sets, &edits, &out).unwrap();
    let text = std::fs::read_to_string(&out).unwrap();
    assert!(text.starts_with("# Made by gripgen "), "{text}");
    let read = load_twin_document(&Location::Disk(out.clone()), &[]).unwrap().read_twin().unwrap();
    assert_eq!(read.parts["gear"].mu, 0.1 + 0.2);
    // What stood there before stays readable: a diagnosis of the same data starts from it.
    let old = load_twin_document(&base, &[]).unwrap().read_twin().unwrap();
    let after = |before: f64| CalibrationFile { before: Some(before), ..calibration() };
    assert_eq!(read.parts["gear"].calibration["mu"], after(old.parts["gear"].mu));
    assert_eq!((read.robot.lag_s, read.wrist.noise_n), (1.0 / 3.0, 0.4));
    assert_eq!(read.robot.calibration["lag_s"], after(old.robot.lag_s));
    assert_eq!((read.parts["gear"].scatter, read.gel.left.shear_stiffness_n_per_mm), (0.03, 17.0));
    let right = read.gel.right.as_ref().unwrap();
    assert_eq!((right.shear_stiffness_n_per_mm, right.thickness_mm), (18.0, read.gel.left.thickness_mm));
    let stiffness = old.gel.left.shear_stiffness_n_per_mm;
    assert_eq!(read.gel.left.calibration["shear_stiffness_n_per_mm"], after(stiffness));
    let gear = read.effects.iter().find(|e| e.part.as_deref() == Some("gear")).unwrap();
    assert_eq!(gear.parameters["a"], toml::Value::Float(1.25));
    assert_eq!(CalibrationFile { before: None, ..gear.calibration["a"].clone() }, calibration());
    assert_eq!(read.parts["long_shaft"], edited_twin(&base, &[], &edits).unwrap().parts["long_shaft"]);

    for (key, fault) in [("parts.gaer.mu", "parts.gaer"), ("robot.lag", "robot.lag")] {
        edits.values = vec![value(key, 1.0)];
        let error = write_twin(&base, &[], &edits, &out).unwrap_err().to_string();
        assert!(error.contains(fault), "{error}");
    }
    edits.values = vec![value("parts.gear.mu", f64::NAN)];
    let error = write_twin(&base, &[], &edits, &out).unwrap_err().to_string();
    assert!(error.contains("parts.gear.mu"), "{error}");
    assert_eq!(std::fs::read_to_string(&out).unwrap(), text, "a twin that is none is not written");
}

/// The same files from another folder, however the old twin called them.
#[test]
fn paths_name_the_same_files_from_the_new_place() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    for inner in ["rig/parts", "out/deep"] {
        std::fs::create_dir_all(root.join(inner)).unwrap();
    }
    let mesh = Location::parse("asset:parts/gear/part.stl").read().unwrap();
    std::fs::write(root.join("rig/parts/gear.stl"), &mesh).unwrap();
    std::fs::write(root.join("out/other.stl"), &mesh).unwrap();
    let absolute = root.join("out/other.stl");
    let text = format!(
        "[parts.a]\nmesh = \"parts/gear.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n\
         [parts.b]\nmesh = \"../out/other.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n\
         [parts.c]\nmesh = {absolute:?}\nmu = 0.2\nimprint_mm3_per_n = 1.5\n"
    );
    std::fs::write(root.join("rig/twin.toml"), text).unwrap();
    let base = Location::Disk(root.join("rig/twin.toml"));
    for out in ["rig/new.toml", "out/deep/new.toml", "new.toml"] {
        write_twin(&base, &[], &TwinEdits::default(), &root.join(out)).unwrap();
        let at = Location::Disk(root.join(out));
        let read = twin_at(&at);
        for part in ["a", "b", "c"] {
            let found = at.beside(&read.parts[part].mesh);
            assert_eq!(*found.read().unwrap(), *mesh, "{out}: {found}");
        }
        assert_eq!(read.optics.left.sensor, twin_at(&base).optics.left.sensor, "inside gripgen");
    }
    let error = write_twin(&base, &[], &TwinEdits::default(), Path::new("/no/such/folder/t.toml"));
    assert!(error.unwrap_err().to_string().contains("/no/such/folder/t.toml"));
}

/// A relative path of a twin that is named by a relative path itself.
#[test]
fn a_relative_base_is_followed() {
    let here = std::env::current_dir().unwrap();
    let folder = tempfile::tempdir_in(&here).unwrap();
    let base = folder.path().strip_prefix(&here).unwrap().join("twin.toml");
    std::fs::write(&base, "[parts.a]\nmesh = \"a.stl\"\nmu = 0.2\nimprint_mm3_per_n = 1.5\n").unwrap();
    let name = folder.path().file_name().unwrap().to_str().unwrap();
    std::fs::create_dir(folder.path().join("new")).unwrap();
    let out = folder.path().join("new/twin.toml");
    write_twin(&Location::Disk(base.clone()), &[], &TwinEdits::default(), &out).unwrap();
    assert_eq!(twin_at(&Location::Disk(out)).parts["a"].mesh, "../a.stl");
    let elsewhere = tempfile::tempdir().unwrap();
    let out = elsewhere.path().join("twin.toml");
    write_twin(&Location::Disk(base), &[], &TwinEdits::default(), &out).unwrap();
    assert!(twin_at(&Location::Disk(out)).parts["a"].mesh.ends_with(&format!("{name}/a.stl")));
}

fn pulled(twin: &Path) -> Box<Pulled> {
    let folder = twin.parent().unwrap();
    let sweep = "samples = 1\nimages = \"none\"\nmechanics = \"reduced\"\n[vary]\npart = [\"gear\"]\n\
                 grip_force_n = [40]\ndwell_s = [5]\npull_index = [40]\n";
    let name = twin.file_name().unwrap().to_str().unwrap();
    std::fs::write(folder.join("sweep.toml"), format!("twin = \"{name}\"\n{sweep}")).unwrap();
    common::pulled(&common::project_in(folder, &[]), 0).unwrap()
}

/// An effect and a table that are put into a twin change its pulls; taking them out restores every bit.
#[test]
fn taking_an_entry_out_restores_the_old_pulls() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let base = Location::parse("asset:configs/twin-baseline.toml");
    let write = |effects: Vec<EffectFile>, name: &str| {
        let edits = TwinEdits { values: Vec::new(), effects: Some(effects) };
        write_twin(&base, &[], &edits, &at(name)).unwrap();
        pulled(&at(name))
    };
    let table = effect(
        "name = \"table\"\ncovariate = \"dwell_s\"\nx = [1, 9]\nfactor = [1.0, 1.5]\nphysical = false\n",
    );
    let offset = effect(
        "name = \"table\"\ncovariate = \"pull_index\"\nx = [0, 80]\noffset_n = [0.0, 2.0]\nphysical = false\n",
    );
    let wear = effect("name = \"wear\"\ndepth = 0.3\nn0 = 20.0\n");
    let plain = write(vec![], "plain.toml");
    let with = write(vec![table.clone(), wear], "with.toml");
    assert!(
        (with.mu_effective - plain.mu_effective).abs() > 0.01,
        "{} {}",
        with.mu_effective,
        plain.mu_effective
    );
    let tabled = write(vec![table], "tabled.toml");
    assert!(
        (tabled.mu_effective / plain.mu_effective - 1.25).abs() < 1e-12,
        "{} {}",
        tabled.mu_effective,
        plain.mu_effective
    );
    let moved = write(vec![offset], "offset.toml");
    let first = |p: &Pulled| p.trace.measured_force_n[0];
    assert!((first(&moved) - first(&plain) - 1.0).abs() < 1e-9);
    let edits = TwinEdits { values: Vec::new(), effects: Some(vec![]) };
    write_twin(&Location::Disk(at("with.toml")), &[], &edits, &at("back.toml")).unwrap();
    assert!(pulled(&at("back.toml")) == plain, "bit for bit");
}
