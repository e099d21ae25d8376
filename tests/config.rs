//! Data-driven: every file in `configs/invalid` has one fault and says in its head what the answer must contain.

use crate::common::{baseline, overrides, project, root, twin_with_sets, write_project};
use gripgen::twin::config::ConfigError;
use gripgen::twin::draw::Drawn;
use gripgen::{LoadError, Location, Project};
use std::path::Path;

struct Expected {
    kind: String,
    key: String,
    says: Vec<String>,
    hint: Option<String>,
    at: Option<String>,
}

fn expected(text: &str) -> Expected {
    let all = |name: &str| -> Vec<String> {
        text.lines()
            .filter_map(|l| l.strip_prefix(&format!("# {name}:")))
            .map(|v| v.trim().to_string())
            .collect()
    };
    let one = |name: &str| all(name).into_iter().next();
    Expected {
        kind: one("kind").unwrap(),
        key: one("key").unwrap(),
        says: all("says"),
        hint: one("hint"),
        at: one("at"),
    }
}

/// Loads a faulty file: a sweep as it is, a twin through a minimal sweep beside it.
fn load(path: &Path, kind: &str) -> LoadError {
    let folder = tempfile::tempdir().unwrap();
    let sweep = match kind {
        "sweep" => path.to_path_buf(),
        "twin" => {
            let sweep = folder.path().join("sweep.toml");
            std::fs::write(&sweep, format!("twin = {:?}\nsamples = 1\n", path.display().to_string()))
                .unwrap();
            sweep
        }
        other => panic!("{}: kind {other}", path.display()),
    };
    match Project::load(&Location::Disk(sweep), &[]) {
        Ok(_) => panic!("{} was accepted", path.display()),
        Err(e) => e,
    }
}

fn check(path: &Path) {
    let text = std::fs::read_to_string(path).unwrap();
    let expected = expected(&text);
    let name = path.file_name().unwrap().to_string_lossy();
    let error = load(path, &expected.kind);
    let message = error.to_string();
    for part in &expected.says {
        assert!(message.contains(part), "{name}: `{message}` does not say `{part}`");
    }
    let LoadError::Config(error) = error else {
        assert!(expected.key.is_empty(), "{name}: `{message}` names no key");
        return;
    };
    let ConfigError { key, hint, place, .. } = error;
    assert_eq!(key, expected.key, "{name}: {message}");
    match (&expected.hint, &hint) {
        (None, _) => {}
        (Some(part), Some(hint)) => assert!(hint.contains(part), "{name}: hint `{hint}` lacks `{part}`"),
        (Some(part), None) => panic!("{name}: no hint, expected `{part}`"),
    }
    let place = place.unwrap_or_else(|| panic!("{name}: no place"));
    assert!(place.file.ends_with(&*name), "{name}: placed in {}", place.file);
    if let Some(at) = &expected.at {
        let span = place.span.unwrap_or_else(|| panic!("{name}: no span"));
        let shown = place.text[span].trim_matches('"');
        assert_eq!(shown, at.trim_matches('"'), "{name}: the caret");
    }
}

#[test]
fn every_invalid_configuration_gets_one_clear_error() {
    let mut files: Vec<_> =
        std::fs::read_dir(root().join("tests/configs/invalid")).unwrap().map(|e| e.unwrap().path()).collect();
    files.sort();
    assert!(files.len() >= 30, "{} cases", files.len());
    let failures: Vec<String> = files
        .iter()
        .filter_map(|f| {
            let result = std::panic::catch_unwind(|| check(f));
            result.err().map(|e| e.downcast_ref::<String>().cloned().unwrap_or_else(|| "?".into()))
        })
        .collect();
    assert!(failures.is_empty(), "{} of {} cases:\n{}", failures.len(), files.len(), failures.join("\n"));
}

#[test]
fn valid_and_shipped_configurations_load() {
    for file in std::fs::read_dir(root().join("tests/configs/valid")).unwrap() {
        let path = file.unwrap().path();
        project(path.to_str().unwrap(), &[]);
    }
    let quickstart = project("asset:configs/quickstart.toml", &[]);
    assert_eq!(quickstart.sweep.samples, 200);
    let on_disk = project(root().join("assets/configs/quickstart.toml").to_str().unwrap(), &[]);
    assert_eq!(on_disk.config_sha256, quickstart.config_sha256, "embedded and checked out are the same run");
    assert_eq!(project("asset:configs/paper.toml", &[]).sweep.samples, 4 * 13 * 10);
}

/// The baseline is the paper's twin without its effects, so the two cannot drift apart.
#[test]
fn the_two_shipped_twins_differ_in_effects_only() {
    let load = |name: &str| -> toml::Table {
        std::fs::read_to_string(root().join("assets/configs").join(name)).unwrap().parse().unwrap()
    };
    let (mut twin, baseline) = (load("twin.toml"), load("twin-baseline.toml"));
    assert!(twin.remove("effects").is_some());
    assert_eq!(twin, baseline);
}

#[test]
fn overrides_reach_sweep_and_twin_and_are_named_in_errors() {
    let p = project("asset:configs/quickstart.toml", &["seed=99", "parts.gear.mu=0.3", "images=none"]);
    assert_eq!((p.sweep.seed, p.twin.parts["gear"].mu), (99, 0.3));
    let sets = [("parts.gear.mu".to_string(), "-1".to_string())];
    let error = Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).err().unwrap();
    assert_eq!(
        error.to_string(),
        "command line:1:7: parts.gear.mu: -1 is out of range, it must be at least 0 and at most 5"
    );
}

/// With the WSG's own convention a commanded force is the sum over both jaws.
#[test]
fn a_total_grip_force_is_half_as_much_per_jaw() {
    let force = |convention: &str| {
        let sets = ["vary.grip_force_n=[40]", &format!("gripper.force_convention={convention}")];
        let p = project("asset:configs/quickstart.toml", &sets);
        p.sweep.scenario(0, &p.twin).0.grip_force_n
    };
    assert_eq!((force("per_jaw"), force("total")), (40.0, 20.0));
    // And the limit of the gripper is per jaw: 120 N in total are 60 N per jaw.
    let sets = ["vary.grip_force_n=[120]", "gripper.force_convention=total"];
    project("asset:configs/quickstart.toml", &sets);
}

/// A hash names what a sample depends on: contents, not paths or order.
#[test]
fn the_hash_covers_contents_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let write = |sub: &str, mesh: &[u8], twin_extra: &str| -> String {
        let at = folder.path().join(sub);
        std::fs::create_dir_all(&at).unwrap();
        std::fs::write(at.join("gear.stl"), mesh).unwrap();
        let twin =
            format!("[parts.gear]\nmesh = \"gear.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n{twin_extra}");
        std::fs::write(at.join("t.toml"), twin).unwrap();
        std::fs::write(at.join("s.toml"), "samples = 3\ntwin = \"t.toml\"\n").unwrap();
        project(at.join("s.toml").to_str().unwrap(), &[]).config_sha256
    };
    let mesh = gripgen::assets::get("parts/gear/part.stl").unwrap();
    let shaft = gripgen::assets::get("parts/long_shaft/part.stl").unwrap();
    let first = write("a", mesh, "");
    assert_eq!(first, write("b/c", mesh, ""), "moved");
    assert_ne!(first, write("d", shaft, ""), "another mesh under the same name");
    assert_ne!(first, write("e", mesh, "scatter = 0.01\n"), "another twin");
    assert_eq!(first, write("f", mesh, "scatter = 0.0\nscale_mm_per_unit = 1\n"), "defaults typed out");
    assert_eq!(first, write("g", mesh, "[wrist]\nrate_hz = 500\nnoise_n = 0.12\n"), "in another order");
}

/// What is resolved is a configuration again: split in two files it is the same run.
#[test]
fn a_resolved_configuration_resolves_to_itself() {
    for sets in [&[][..], &["vary.parts.gear.mu={ uniform = [0.1, 0.2] }", "design=random", "samples=9"][..]]
    {
        let first = project("asset:configs/quickstart.toml", sets);
        let both: toml::Table = first.config_toml.parse().unwrap();
        let folder = tempfile::tempdir().unwrap();
        for (section, file) in [("sweep", "again.toml"), ("twin", "twin.toml")] {
            std::fs::write(folder.path().join(file), both[section].as_table().unwrap().to_string()).unwrap();
        }
        let again = project(folder.path().join("again.toml").to_str().unwrap(), &[]);
        assert_eq!(again.config_toml, first.config_toml);
        assert_eq!(again.config_sha256, first.config_sha256);
    }
}

/// Broken files are found before any work is done, also those that only some samples draw, and the key is named.
#[test]
fn broken_files_are_errors_of_the_key_that_names_them() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, content: &str| std::fs::write(folder.path().join(name), content).unwrap();
    write("bad.stl", "solid x\nfacet normal 0 0 1\nouter loop\nvertex 0 0 nan\n");
    write("bad.npz", "no archive");
    write(
        "twin.toml",
        "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n",
    );
    for (vary, key, part) in [
        (
            "\"parts.gear.mesh\" = [\"asset:parts/gear/part.stl\", \"bad.stl\"]",
            "vary.parts.gear.mesh[1]",
            "bad.stl",
        ),
        ("\"parts.gear.mesh\" = [\"none.stl\"]", "vary.parts.gear.mesh[0]", "none.stl"),
        ("\"optics.left.sensor\" = [\"bad.npz\"]", "vary.optics.left.sensor[0]", "bad.npz"),
    ] {
        write("sweep.toml", &format!("twin = \"twin.toml\"\nsamples = 2\n[vary]\n{vary}\n"));
        let at = Location::Disk(folder.path().join("sweep.toml"));
        let Err(LoadError::Config(error)) = Project::load(&at, &[]) else { panic!("{vary} was accepted") };
        assert_eq!(error.key, key);
        assert!(error.problem.contains(part), "{error}");
        assert!(error.place.is_some_and(|p| p.span.is_some()), "{vary}: no place");
    }
}

#[test]
fn draws_follow_the_design() {
    let grid = project(root().join("tests/configs/valid/grid.toml").to_str().unwrap(), &[]);
    assert_eq!(grid.sweep.samples, 12);
    let seen: std::collections::BTreeSet<(String, String)> = (0..12)
        .map(|i| {
            let d = grid.sweep.drawn(i);
            (d["part"].to_string(), d["grip_force_n"].to_string())
        })
        .collect();
    assert_eq!(seen.len(), 4, "every combination");
    let offset = |i| grid.sweep.drawn(i)["grip_offset_mm"].clone();
    assert_eq!((offset(0), offset(1)), (offset(2), offset(2)), "repetitions share what was drawn");
    assert_ne!(offset(0), offset(3));

    let sobol = project(root().join("tests/configs/valid/sobol.toml").to_str().unwrap(), &[]);
    let mut cells = [0; 16];
    for i in 0..16 {
        let Drawn::Number(force) = sobol.sweep.drawn(i)["grip_force_n"] else { panic!("a number") };
        cells[((force - 20.0) / 60.0 * 16.0) as usize] += 1;
    }
    assert_eq!(cells, [1; 16], "16 points of a Sobol sequence fill 16 cells");
}

/// Adding a key leaves the draws of the others alone, and so does its position in the file.
#[test]
fn keys_are_drawn_independently() {
    let one = project("asset:configs/quickstart.toml", &["design=random", "samples=20"]);
    let two = project(
        "asset:configs/quickstart.toml",
        &["design=random", "samples=20", "vary.dwell_s={ uniform = [1, 9] }"],
    );
    for i in 0..20 {
        let (a, mut b) = (one.sweep.drawn(i), two.sweep.drawn(i));
        assert!(b.remove("dwell_s").is_some());
        assert_eq!(a, b);
    }
}

#[test]
fn calibrated_intervals_become_draws() {
    let folder = tempfile::tempdir().unwrap();
    let twin = "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n\
                [parts.gear.calibration.mu]\nlow90 = 0.14\nhigh90 = 0.16\nevidence = \"12 pulls\"\n";
    let sweep = "twin = \"twin.toml\"\nsamples = 4000\n[vary]\n\"parts.gear.mu\" = { from = \"interval\" }\n";
    let p = write_project(folder.path(), twin, sweep);
    let values: Vec<f64> = (0..4000)
        .map(|i| match p.sweep.drawn(i)["parts.gear.mu"] {
            Drawn::Number(x) => x,
            Drawn::Text(_) => panic!("a number"),
        })
        .collect();
    let inside = values.iter().filter(|x| (0.14..=0.16).contains(*x)).count() as f64 / 4000.0;
    assert!((inside - 0.9).abs() < 0.02, "{inside} of the draws lie in the 90 % interval");
    let twin = p.sweep.twin_of(3, &p.twin_table).unwrap();
    assert_eq!(twin.parts["gear"].mu, values[3]);
}

/// A robot description of the user's own: `package://` is looked for beside and above it, and a mesh that is not there is
/// an error that names it.
#[test]
fn a_robot_description_finds_its_meshes_or_says_which_it_does_not() {
    let folder = tempfile::tempdir().unwrap();
    let package = folder.path().join("ur_description");
    std::fs::create_dir_all(package.join("urdf")).unwrap();
    let own = std::str::from_utf8(gripgen::assets::get("robots/ur5e/ur5e.urdf").unwrap()).unwrap();
    let visual =
        "<visual><geometry><mesh filename=\"package://ur_description/meshes/base.stl\"/></geometry></visual>";
    let at = own.find("</link>").unwrap();
    std::fs::write(package.join("urdf/arm.urdf"), format!("{}{visual}{}", &own[..at], &own[at..])).unwrap();
    let load = || {
        let urdf = package.join("urdf/arm.urdf").display().to_string();
        Project::load(
            &Location::parse("asset:configs/quickstart.toml"),
            &[("robot.arm.urdf".to_string(), urdf)],
        )
    };
    let Err(LoadError::Config(error)) = load() else { panic!("a mesh is missing") };
    assert_eq!(error.key, "robot.arm.urdf");
    assert!(error.problem.contains("package://ur_description/meshes/base.stl"), "{error}");
    std::fs::create_dir_all(package.join("meshes")).unwrap();
    std::fs::write(package.join("meshes/base.stl"), b"solid x").unwrap();
    let whole = load().unwrap_or_else(|e| panic!("{e}"));
    assert!(whole.config_toml.contains("inputs/arm-"), "the description travels with the run");
}

/// Overrides `key=value`.
type Sets<'a> = &'a [(&'a str, &'a str)];

/// Overrides that load, or the key and words of the error they give.
fn refused(sets: Sets<'_>) -> Option<ConfigError> {
    let paper = [("twin", "asset:configs/twin.toml")];
    let sets = [&paper[..], sets].concat();
    match Project::load(&Location::parse("asset:configs/quickstart.toml"), &overrides(&sets)) {
        Ok(_) => None,
        Err(LoadError::Config(e)) => Some(e),
        Err(e) => panic!("{e}"),
    }
}

/// An arm with links has one model under two names, and the name of a gripper changes nothing.
#[test]
fn names_of_models_change_no_number() {
    let twin = |key: &str, value: &str| twin_with_sets(&baseline(), &overrides(&[(key, value)]));
    let shipped = twin("robot.model", "\"ur5e\"");
    assert!(shipped.arm.is_some());
    assert_eq!(twin("robot.model", "\"arm\""), shipped);
    assert_eq!(twin("gripper.model", "\"a gripper of our own\""), shipped);
    assert!(twin("robot.model", "\"carriage\"").arm.is_none());
}

#[test]
fn settings_that_do_not_go_together_are_refused() {
    let base = ("twin", "asset:configs/twin-baseline.toml");
    let cases: &[(Sets<'_>, &str, &str)] = &[
        (&[("robot.damping_n_s_per_m", "20000")], "robot.damping_n_s_per_m", "the arm's 16"),
        (
            &[("robot.model", "carriage"), ("robot.damping_n_s_per_m", "5000")],
            "robot.damping_n_s_per_m",
            "9.6",
        ),
        (
            &[base, ("effects", "[{name = \"jaw_tilt\", tilt_deg = 3.0}]"), ("pull.direction", "[0, 0, -1]")],
            "pull.direction",
            "`jaw_tilt`",
        ),
        (
            &[("robot.twist", "compliant"), ("robot.twist_stiffness_n_m_per_rad", "0")],
            "robot.twist_stiffness_n_m_per_rad",
            "0.001",
        ),
        (
            &[base, ("effects", "[{name = \"sensor_gain\", gain = 1.1, outside_fit = \"error\"}]")],
            "effects[0].outside_fit",
            "no friction law",
        ),
        (&[base, ("effects.wear.depth", "0.1")], "effects.wear.depth", "has no effects"),
        (&[("vary.robot.arm.joints_deg[2]", "[110, 0]")], "robot.arm.joints_deg", "singular"),
        (&[("robot.arm.tip", "nope")], "robot.arm.urdf", "nope"),
    ];
    for (sets, key, part) in cases {
        let error = refused(sets).unwrap_or_else(|| panic!("{sets:?} was accepted"));
        assert_eq!(&error.key, key, "{sets:?}: {error}");
        assert!(error.problem.contains(part) && error.hint.is_some(), "{sets:?}: {error}, {:?}", error.hint);
    }
    // And their neighbours load.
    for sets in [
        &[("robot.damping_n_s_per_m", "7000"), ("robot.moving_mass_kg", "0.2")][..],
        &[base, ("effects", "[{name = \"jaw_tilt\", tilt_deg = 3.0}]"), ("vary.pull_direction", "[-1]")],
        &[base, ("robot.model", "carriage"), ("vary.robot.model", "[\"carriage\", \"ur5e\"]")],
        &[("vary.gel.left.kernels_px[0]", "[51, 71]")],
        &[
            ("vary.parts.gear.mu", "[0.13, 0.17]"),
            ("vary.robot.twist", "[\"stiff\", \"free\", \"compliant\"]"),
        ],
        // A law of the offset and the mechanics of the contact are two losses, which may stand together.
        &[
            base,
            ("effects", "[{name = \"off_centre\", inverse_lever_per_mm = 0.1}]"),
            ("robot.twist", "free"),
        ],
    ] {
        assert!(refused(sets).is_none(), "{sets:?}: {:?}", refused(sets));
    }
}

/// Paths of files that no sample needs are nobody's business: they change no hash and stand in no run folder.
#[test]
fn paths_of_unused_files_stay_at_home() {
    let hash = |path: &str| {
        let sets = ["vary.part=[\"long_shaft\"]", &format!("parts.gear.mesh={path}"), "robot.model=carriage"];
        let p = project("asset:configs/quickstart.toml", &sets);
        assert!(!p.config_toml.contains(path), "{path}");
        p.config_sha256
    };
    assert_eq!(hash("/home/me/gear.stl"), hash("/elsewhere/gear.stl"));
}

/// What varies on the left gel varies on a right one that does not name it, before and after resolving.
#[test]
fn a_partial_right_jaw_follows_the_left_one() {
    let p = project(
        "asset:configs/quickstart.toml",
        &["gel.right.shear_stiffness_n_per_mm=10", "vary.gel.left.thickness_mm=[3, 5]"],
    );
    for index in 0..p.sweep.samples {
        let twin = p.twin_of(index).unwrap();
        assert_eq!(twin.gel.left.thickness_m, twin.gel.right.thickness_m);
        assert_eq!(
            (twin.gel.left.shear_stiffness_n_per_m, twin.gel.right.shear_stiffness_n_per_m),
            (2e4, 1e4)
        );
    }
}

/// A path of `--set` is one of the shell, whatever folder the configuration lies in, and inside gripgen too.
#[test]
fn paths_of_overrides_are_relative_to_the_shell() {
    let folder = tempfile::tempdir().unwrap();
    let here = std::env::current_dir().unwrap().canonicalize().unwrap();
    let real = folder.path().canonicalize().unwrap();
    // Up to the root and down again.
    let up: std::path::PathBuf = here.components().skip(1).map(|_| "..").collect();
    let from_here = up.join(real.components().skip(1).collect::<std::path::PathBuf>()).join("plate.stl");
    std::fs::write(real.join("plate.stl"), gripgen::assets::get("parts/gear/part.stl").unwrap()).unwrap();
    std::fs::create_dir(real.join("deep")).unwrap();
    std::fs::write(real.join("deep/twin.toml"), gripgen::assets::get("configs/twin-baseline.toml").unwrap())
        .unwrap();
    let sweep = "twin = \"twin.toml\"\nsamples = 1\n[vary]\npart = [\"gear\"]\n";
    std::fs::write(real.join("deep/sweep.toml"), sweep).unwrap();
    let set = ("parts.gear.mesh".to_string(), from_here.display().to_string());
    let on_disk = Location::Disk(real.join("deep/sweep.toml"));
    for at in [on_disk, Location::parse("asset:configs/quickstart.toml")] {
        let project = Project::load(&at, std::slice::from_ref(&set)).unwrap();
        assert!(project.config_toml.contains("inputs/plate-"), "{at}");
    }
    // Typed beside the twin it is none.
    let wrong = [("parts.gear.mesh".to_string(), "../plate.stl".to_string())];
    let Err(e) = Project::load(&Location::Disk(real.join("deep/sweep.toml")), &wrong) else {
        panic!("no such file")
    };
    assert!(e.to_string().contains("parts.gear.mesh"), "{e}");
}
