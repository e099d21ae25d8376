//! The binary as users and schedulers see it: exit codes, what goes where, interruption.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

// Planning a campaign, and making it on a twin.
mod campaign;
// What is said of a configuration.
mod check;
// The catalogue of effects.
mod effects;
// What errors tell people to do.
mod hints;
// Files to start from.
mod init;
// A page of what is under way.
mod live;
// Calibrating a sensor and comparing with it.
mod measured;
mod presses;
// Measured pulls in other units than they seem to be.
mod pull_units;
// A rig whose devices tell half the truth.
mod rig_doubts;
// Faults in the middle of a campaign of a rig.
mod rig_faults;
// The loop over the wire.
mod rig_loop;
// What a lab notes of the pulls of a rig.
mod rig_notes;
// Runs of a rig.
mod rig_run;
mod rig_served;
mod rig_verbs;
// A sensor file on another day.
mod sensor_check;
// Parts at a glance.
mod try_part;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

const QUICKSTART: &str = "asset:configs/quickstart.toml";

/// A sweep of 24 samples in shards of 6.
const SMALL: [&str; 6] = [
    "--set",
    "vary.grip_force_n=[20, 25, 30]",
    "--set",
    "vary.grip_angle_deg=[30]",
    "--set",
    "shard_samples=6",
];

fn gripgen() -> Command {
    Command::new(env!("CARGO_BIN_EXE_gripgen"))
}

fn run(arguments: &[&str]) -> Output {
    gripgen().args(arguments).output().unwrap()
}

fn sweep_args<'a>(out: &'a str, more: &[&'a str]) -> Vec<&'a str> {
    let mut all = vec!["sweep", QUICKSTART, "-o", out];
    all.extend(SMALL);
    all.extend(more);
    all
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8(bytes.to_vec()).unwrap()
}

#[track_caller]
fn assert_code(output: &Output, code: i32) {
    assert_eq!(output.status.code(), Some(code), "stderr: {}", text(&output.stderr));
}

fn content(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    std::fs::read_dir(folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .filter(|p| p.is_file())
        .map(|p| (p.file_name().unwrap().to_string_lossy().into_owned(), std::fs::read(&p).unwrap()))
        .collect()
}

/// A folder of this name that is not there yet, in one that goes with the test.
fn unmade(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join(name);
    (folder, out)
}

/// A finished run of the small sweep.
fn reference() -> (tempfile::TempDir, PathBuf) {
    let (folder, out) = unmade("run");
    let output = run(&sweep_args(out.to_str().unwrap(), &["--jobs", "2"]));
    assert_code(&output, 0);
    (folder, out)
}

#[test]
fn standard_output_is_data_and_standard_error_is_talk() {
    let (_folder, out) = unmade("run");
    let output = run(&sweep_args(out.to_str().unwrap(), &[]));
    assert_code(&output, 0);
    assert_eq!(text(&output.stdout), format!("{}\n", out.display()));
    assert!(text(&output.stderr).contains("24 samples") && text(&output.stderr).contains("gripgen show"));
    for file in ["run.json", "index.csv", "contact-sheet.png", "shard-00003.mcap", "shard-00003.json"] {
        assert!(out.join(file).exists(), "{file}");
    }
    let quiet = run(&sweep_args(out.to_str().unwrap(), &["-q"]));
    assert_code(&quiet, 0);
    assert!(quiet.stderr.is_empty(), "{}", text(&quiet.stderr));
}

#[test]
fn json_is_one_event_a_line() {
    let (folder, out) = unmade("run");
    let output = run(&sweep_args(out.to_str().unwrap(), &["--json"]));
    assert_code(&output, 0);
    let events: Vec<serde_json::Value> =
        text(&output.stdout).lines().map(|l| serde_json::from_str(l).unwrap()).collect();
    let names: Vec<&str> = events.iter().map(|e| e["event"].as_str().unwrap()).collect();
    assert_eq!(names, ["plan", "shard", "shard", "shard", "shard", "done"]);
    assert_eq!(events[0]["samples"], 24);
    assert_eq!((&events[5]["complete"], &events[5]["failed"]), (&true.into(), &0.into()));

    let file = folder.path().join("events.json");
    let again = run(&sweep_args(out.to_str().unwrap(), &["--json", file.to_str().unwrap()]));
    assert_code(&again, 0);
    assert_eq!(text(&again.stdout), format!("{}\n", out.display()));
    assert_eq!(
        std::fs::read_to_string(file).unwrap().lines().count(),
        2,
        "plan and done: nothing was left to do"
    );
}

#[test]
fn configuration_errors_show_the_place_and_a_hint() {
    let folder = tempfile::tempdir().unwrap();
    let config = folder.path().join("sweep.toml");
    let sweep =
        "twin = \"asset:configs/twin.toml\"\nsamples = 4\n[vary]\ngrip_force_n = { uniform = [90, 20] }\n";
    std::fs::write(&config, sweep).unwrap();
    let output = run(&["check", config.to_str().unwrap()]);
    assert_code(&output, 2);
    let message = text(&output.stderr);
    for part in [
        "error: vary.grip_force_n: the lower end 90 is above the upper end 20",
        "sweep.toml:4:1",
        "^^^",
        "\nhint: swap",
    ] {
        assert!(message.contains(part), "`{part}` is missing in:\n{message}");
    }
    assert!(output.stdout.is_empty());
    let missing = run(&["sweep", "no-such.toml"]);
    assert_code(&missing, 2);
    assert!(text(&missing.stderr).contains("no-such.toml"));
    assert_code(&run(&["sweep"]), 2);
    assert_code(&run(&["frobnicate"]), 2);
    assert_code(&run(&["sweep", QUICKSTART, "--slice", "5/4"]), 2);
    assert_code(&run(&["--version"]), 0);
}

#[test]
fn another_run_in_the_folder_is_exit_code_3() {
    let (_folder, out) = reference();
    let before = content(&out);
    let output = run(&sweep_args(out.to_str().unwrap(), &["--set", "seed=8"]));
    assert_code(&output, 3);
    let message = text(&output.stderr);
    assert!(
        message.contains("sweep.seed is 7 there, 8 here") && message.contains("hint: choose another folder"),
        "{message}"
    );
    assert!(content(&out) == before, "nothing was touched");
}

#[test]
fn failed_samples_are_exit_code_4_and_are_named() {
    let (_folder, out) = unmade("run");
    // The laws of the paper's twin refuse below 20 N.
    let paper = ["--set", "twin=\"asset:configs/twin.toml\"", "--set", "vary.grip_force_n=[10, 20, 30]"];
    let output = run(&sweep_args(out.to_str().unwrap(), &paper));
    assert_code(&output, 4);
    let message = text(&output.stderr);
    assert!(message.contains("8 of 24 samples failed") && message.contains("sample 0 failed"), "{message}");
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);
}

/// A file that may not grow is a full disk: path, cause, hint, nothing left; the same command goes on.
#[cfg(unix)]
#[test]
fn a_shard_that_does_not_fit_says_where_and_leaves_nothing() {
    let (_folder, out) = unmade("run");
    let arguments = sweep_args(out.to_str().unwrap(), &["-q", "--jobs", "1"]);
    // With the signal ignored, writing past the limit is an error like any other.
    let limited = Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 300; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_gripgen")])
        .args(&arguments)
        .output()
        .unwrap();
    assert_code(&limited, 1);
    let said = text(&limited.stderr);
    let path = out.join("shard-00000.mcap.partial");
    assert!(said.contains(path.to_str().unwrap()) && said.contains("File too large"), "{said}");
    assert!(said.contains("hint: make room"), "{said}");
    assert!(content(&out).keys().all(|name| name == "run.json"), "{:?}", content(&out).keys());
    assert_code(&run(&arguments), 0);
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);
}

#[test]
fn a_damaged_run_is_exit_code_5() {
    let (_folder, out) = reference();
    let good = run(&["verify", out.to_str().unwrap()]);
    assert_code(&good, 0);
    assert_eq!(text(&good.stdout), "ok: 4 shards, 24 samples\n");
    let shard = out.join("shard-00002.mcap");
    let mut bytes = std::fs::read(&shard).unwrap();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    std::fs::write(&shard, bytes).unwrap();
    let bad = run(&["verify", out.to_str().unwrap(), "--json"]);
    assert_code(&bad, 5);
    let report: serde_json::Value = serde_json::from_slice(&bad.stdout).unwrap();
    assert_eq!((&report["ok"], &report["good_shards"]), (&false.into(), &3.into()));
    assert!(report["faults"][0].as_str().unwrap().contains("shard-00002.mcap"));
    let repair = format!("verify {} --repair`", out.display());
    assert!(text(&bad.stderr).contains(&repair), "{}", text(&bad.stderr));
}

/// What is broken is taken away, whatever is broken, and the same sweep gives the same bytes again; what is good is not touched.
#[test]
fn a_damaged_run_is_repaired_by_verify_and_the_same_sweep() {
    let (_folder, out) = reference();
    let whole = content(&out);
    let flip = |name: &str| {
        let mut bytes = std::fs::read(out.join(name)).unwrap();
        let middle = bytes.len() / 2;
        bytes[middle] ^= 1;
        std::fs::write(out.join(name), bytes).unwrap();
    };
    let cut = |name: &str| {
        let bytes = std::fs::read(out.join(name)).unwrap();
        std::fs::write(out.join(name), &bytes[..bytes.len() / 3]).unwrap();
    };
    let damage: [(&str, &dyn Fn(), usize); 5] = [
        ("a flipped bit", &|| flip("shard-00002.mcap"), 3),
        ("a shard that was cut off", &|| cut("shard-00001.mcap"), 3),
        ("a shard that is gone", &|| std::fs::remove_file(out.join("shard-00000.mcap")).unwrap(), 2),
        ("an index that was cut off", &|| cut("index.csv"), 1),
        ("two at once", &|| (0..2).for_each(|i| flip(&format!("shard-0000{i}.mcap"))), 5),
    ];
    for (what, damage, removed) in damage {
        damage();
        let path = out.to_str().unwrap();
        assert_code(&run(&["verify", path, "-q"]), 5);
        let repaired = run(&["verify", path, "--repair", "--json"]);
        assert_code(&repaired, 0);
        let report: serde_json::Value = serde_json::from_slice(&repaired.stdout).unwrap();
        assert_eq!(report["removed"].as_array().unwrap().len(), removed, "{what}: {report}");
        assert_code(&run(&["verify", path, "-q"]), 0);
        assert_code(&run(&sweep_args(path, &["-q"])), 0);
        assert!(content(&out) == whole, "{what}");
    }
}

fn spawn(out: &Path) -> Child {
    let mut command = gripgen();
    command.args(sweep_args(out.to_str().unwrap(), &["--jobs", "2"]));
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Waits until the child ends or `condition` holds.
fn wait_until(child: &mut Child, mut condition: impl FnMut() -> bool) {
    let start = Instant::now();
    while !condition() && child.try_wait().unwrap().is_none() {
        assert!(start.elapsed() < Duration::from_secs(120), "it hangs");
        std::thread::sleep(Duration::from_millis(2));
    }
}

fn assert_continues_to(out: &Path, reference: &BTreeMap<String, Vec<u8>>, what: &str) {
    let output = run(&sweep_args(out.to_str().unwrap(), &["--jobs", "1"]));
    assert_code(&output, 0);
    let mut found = content(out);
    // What a killed process was writing may lie there; it is never taken for more.
    found.retain(|name, _| !name.ends_with(".partial"));
    assert_eq!(found.keys().collect::<Vec<_>>(), reference.keys().collect::<Vec<_>>(), "{what}");
    for (name, bytes) in reference {
        assert!(found[name] == *bytes, "{what}: {name} differs");
    }
}

/// SIGKILL leaves nothing that could be taken for finished, and the same command continues to the same bytes.
#[test]
fn a_killed_run_continues_to_the_same_bytes() {
    let (_folder, out) = reference();
    let expected = content(&out);
    let shard = |n: usize| move |out: &Path| out.join(format!("shard-0000{n}.mcap")).exists();
    type Moment = Box<dyn Fn(&Path) -> bool>;
    let moments: [(&str, Moment); 5] = [
        ("at once", Box::new(|_: &Path| true)),
        ("after run.json", Box::new(|out: &Path| out.join("run.json").exists())),
        ("in the first shard", Box::new(|out: &Path| out.join("shard-00000.mcap.partial").exists())),
        ("after the first shard", Box::new(shard(0))),
        ("after the third shard", Box::new(shard(2))),
    ];
    for (what, moment) in moments {
        let (_folder, out) = unmade("run");
        let mut child = spawn(&out);
        wait_until(&mut child, || moment(&out));
        child.kill().unwrap();
        child.wait().unwrap();
        assert_continues_to(&out, &expected, what);
    }
    // Killed several times in a row.
    let (_folder, out) = unmade("run");
    for round in 0..4 {
        let mut child = spawn(&out);
        wait_until(&mut child, || out.join(format!("shard-0000{round}.mcap.partial")).exists());
        child.kill().unwrap();
        child.wait().unwrap();
    }
    assert_continues_to(&out, &expected, "killed four times");
}

/// Ctrl-C finishes the shards under way and says so: exit code 130, and the run continues later.
#[test]
#[cfg(unix)]
fn ctrl_c_finishes_what_is_under_way() {
    let (_folder, out) = reference();
    let expected = content(&out);
    let (_folder, out) = unmade("run");
    let mut child = spawn(&out);
    wait_until(&mut child, || out.join("shard-00000.mcap.partial").exists());
    let signal = Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    assert!(signal.success());
    let status = child.wait().unwrap();
    assert_eq!(status.code(), Some(130));
    let left = content(&out);
    assert!(left.contains_key("shard-00000.json") && !left.contains_key("index.csv"));
    assert!(left.keys().all(|name| !name.ends_with(".partial")), "{:?}", left.keys());
    assert_continues_to(&out, &expected, "interrupted");
}

/// Two processes in one folder share the work: neither waits for nothing, nothing is written twice.
#[test]
fn two_processes_in_one_folder_make_one_run() {
    let (_folder, out) = reference();
    let expected = content(&out);
    let (folder, out) = unmade("run");
    let events = [folder.path().join("a.json"), folder.path().join("b.json")];
    let mut children = events.clone().map(|file| {
        let mut command = gripgen();
        command.args(sweep_args(out.to_str().unwrap(), &["--jobs", "1", "--json", file.to_str().unwrap()]));
        command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
    });
    for child in &mut children {
        assert!(child.wait().unwrap().success());
    }
    let made: usize = events
        .iter()
        .map(|file| std::fs::read_to_string(file).unwrap().matches("\"event\":\"shard\"").count())
        .sum();
    assert_eq!(made, 4, "each shard is made once");
    let found = content(&out);
    assert!(found == expected, "{:?}", found.keys());
}

#[test]
fn info_show_and_export_read_a_run() {
    let (folder, out) = reference();
    let out = out.to_str().unwrap();
    let info = run(&["info", out]);
    assert_code(&info, 0);
    assert!(text(&info.stdout).contains("24 of 24 samples") && text(&info.stdout).contains("long_shaft"));
    let json: serde_json::Value = serde_json::from_slice(&run(&["info", out, "--json"]).stdout).unwrap();
    assert_eq!((&json["done"], &json["status"]["slipped"]), (&24.into(), &24.into()));

    let picture = folder.path().join("sample.png");
    let shown = run(&["show", out, "5", "-o", picture.to_str().unwrap()]);
    assert_code(&shown, 0);
    assert_eq!(&std::fs::read(&picture).unwrap()[..4], b"\x89PNG");
    assert_code(&run(&["show", out, "24"]), 2);
    let shown = run(&["show", out, "5", "-o", picture.to_str().unwrap(), "--json", "--force"]);
    let json: serde_json::Value = serde_json::from_slice(&shown.stdout).unwrap();
    assert_eq!((&json["sample"], json["file"].as_str()), (&5.into(), picture.to_str()));
    assert!(run(&["info", out, "-q"]).stdout.is_empty());

    let one = folder.path().join("one.mcap");
    assert_code(&run(&["export", out, "--sample", "7", "-o", one.to_str().unwrap()]), 0);
    assert_eq!(&std::fs::read(&one).unwrap()[1..5], b"MCAP");
    let quiet = run(&["export", out, "--sample", "7", "-o", one.to_str().unwrap(), "-q", "--force"]);
    assert!(quiet.status.success() && quiet.stdout.is_empty());
    let foreign = run(&["info", folder.path().to_str().unwrap()]);
    assert_code(&foreign, 1);
    assert!(text(&foreign.stderr).contains("hint:"));
}

#[test]
fn schema_and_completions_print() {
    for kind in ["sweep", "twin"] {
        let output = run(&["schema", kind]);
        assert_code(&output, 0);
        let schema: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(schema["properties"].as_object().unwrap().len() > 5, "{kind}");
    }
    for shell in ["bash", "zsh", "fish"] {
        let output = run(&["completions", shell]);
        assert_code(&output, 0);
        assert!(text(&output.stdout).contains("gripgen"));
    }
}

/// `gripgen schema | head -1` is no failure.
#[test]
#[cfg(unix)]
fn a_reader_that_hangs_up_is_no_failure() {
    let mut child =
        gripgen().args(["schema", "twin"]).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert_code(&output, 0);
    assert!(output.stderr.is_empty(), "{}", text(&output.stderr));
}

/// Without the adapter that is named there is one line, a hint, and no output; in a build without the backend too.
#[test]
fn a_missing_graphics_adapter_is_one_clear_error() {
    let (_folder, out) = unmade("run");
    let missing = ["--set", "backend=gpu", "--set", "gpu_adapter=no such adapter"];
    let sweep = run(&sweep_args(out.to_str().unwrap(), &missing));
    let bench = run(&["bench", "--backend", "gpu", "--adapter", "no such adapter"]);
    for output in [sweep, bench] {
        let (code, problem, hint) = match cfg!(feature = "gpu") {
            true => (1, "no adapter is called `no such adapter`; found ", "hint: use backend = \"cpu\""),
            false => (2, "this gripgen was built without the gpu backend", "--features gpu"),
        };
        assert_code(&output, code);
        let said = text(&output.stderr);
        assert!(said.contains(problem), "{said}");
        assert!(said.contains(hint), "{said}");
        assert!(output.stdout.is_empty());
    }
    assert!(!out.exists());
    assert_code(&run(&["bench", "--adapter", "llvmpipe"]), 2);
}

#[test]
fn a_benchmark_says_what_it_measured() {
    let missing = run(&["bench", "--seconds", "0.05", "--sensor", "no-such-sensor.npz"]);
    assert_code(&missing, 1);
    assert!(text(&missing.stderr).contains("no-such-sensor.npz"), "{}", text(&missing.stderr));
    let sensor = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/sensors/gelsight_synthetic/sensor.npz");
    let output = run(&["bench", "--seconds", "0.05", "--sensor", sensor, "--json"]);
    assert_code(&output, 0);
    let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let said = ["schema", "backend", "colour"].map(|key| report[key].as_str().unwrap());
    assert_eq!(said, ["gripgen.bench/1", "cpu", "lambert"]);
    assert!(report["adapter"].is_null() && report["triangles"].as_u64().unwrap() > 45_000);
    let rate = &report["rates"][0];
    let (images, seconds) = (rate["images"].as_f64().unwrap(), rate["seconds"].as_f64().unwrap());
    assert!(
        images >= 1.0
            && (rate["images_per_s"].as_f64().unwrap() - images / seconds).abs() < 1e-6 * images / seconds
    );
}
