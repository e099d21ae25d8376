//! No output replaces a file without `--force`, and none is ever written onto an input or a run's own file: every verb.

use super::*;
use crate::args::Cli;
use crate::try_run;
use clap::{Arg, CommandFactory};
use std::any::TypeId;
use std::collections::BTreeSet;
use std::ffi::OsString;

/// Arguments that name an input.
const READ: &str =
    "rehearsal config run presses measured also sensor twin rig mesh campaign after separate target data";
/// Arguments that name a folder with rules of its own: a run (exit code 3), measurements, the files of `init`.
const FOLDERS: [(&str, &str); 4] =
    [("sweep", "out"), ("rig pull", "out"), ("campaign", "simulate"), ("init", "out")];
/// The content of a file that is there before.
const MINE: &[u8] = b"mine\n";

/// An output of a verb, and a command line that writes it.
struct Case {
    verb: &'static str,
    /// Id of the argument.
    id: &'static str,
    /// Ending of the file.
    ending: &'static str,
    /// All arguments but this output.
    line: String,
    /// Whether the command is run to its end: it is short and needs no devices.
    runs: bool,
}

/// Everything that the commands read, in one folder without spaces in its path.
struct World {
    folder: tempfile::TempDir,
    root: PathBuf,
}

impl World {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().canonicalize().unwrap();
        let world = Self { folder, root };
        let copy = |asset: &str, name: &str| world.put(name, gripgen::assets::get(asset).unwrap());
        copy("sensors/gelsight_synthetic/sensor.npz", "sensor.npz");
        copy("parts/gear/part.stl", "part.stl");
        copy("configs/rig.toml", "rig.toml");
        copy("configs/twin-baseline.toml", "shipped.toml");
        let shipped = std::fs::read_to_string(world.root.join("shipped.toml")).unwrap();
        world.put("twin.toml", shipped.replace("\"../", "\"asset:").as_bytes());
        let mut pulls = String::from("pull_id,part,grip_force_n,max_pull_force_n\n");
        for i in 0..12 {
            let force_n = [20.0, 40.0, 60.0][i % 3];
            pulls += &format!(
                "p{i},long_shaft,{force_n},{:.3}\n",
                0.4 * force_n * (1.0 + 0.01 * (i as f64 - 5.5))
            );
        }
        world.put("pulls/pulls.csv", pulls.as_bytes());
        let one = pulls.lines().take(2).map(|line| format!("{line}\n")).collect::<String>();
        world.put("one/pulls.csv", one.as_bytes());
        let mut sensor = String::from("time_s,reference_force_n,measured_force_n,session\n");
        for i in 0..60 {
            let force_n = f64::from(i % 20);
            let noise_n = 0.01 * f64::from(i * 7 % 11);
            sensor += &format!("{i},{force_n},{:.3},a\n", 1.05 * force_n + 0.2 + noise_n);
        }
        world.put("sensor/sensor.csv", sensor.as_bytes());
        let imprints = (1..9).map(|i| format!("i{i},{},{},g\n", 5 * i, 7.5 * f64::from(i)));
        let imprints = format!("imprint_id,grip_force_n,volume_mm3,grasp\n{}", imprints.collect::<String>());
        world.put("imprints/imprints.csv", imprints.as_bytes());
        world.put("presses/presses.csv", b"image,x_px,y_px,radius_px\na.png,40,40,20\n");
        world.put("presses/a.png", b"no picture");
        world.put(
            "sweep.toml",
            b"twin = \"twin.toml\"\nsamples = 2\nmechanics = \"reduced\"\ntrace = \"none\"\n[vary]\npart = [\"gear\"]\n",
        );
        world.line("sweep sweep.toml -o run -q").unwrap();
        // A run of assets alone has no copies of its inputs.
        std::fs::create_dir_all(world.root.join("run/inputs")).unwrap();
        world
    }

    fn put(&self, name: &str, bytes: &[u8]) {
        let path = self.root.join(name);
        std::fs::create_dir_all(path.parent().unwrap()).unwrap();
        std::fs::write(path, bytes).unwrap();
    }

    /// Runs a command line; a word that begins like one of our files is put into the folder.
    fn line(&self, line: &str) -> Result<u8, Failure> {
        let words = line.split(' ').map(|word| {
            let first = word.split('/').next().unwrap_or_default();
            let folders = ["run", "pulls", "one", "sensor", "imprints", "presses", "out"];
            let files = ["sweep.toml", "twin.toml", "rig.toml", "part.stl", "sensor.npz"];
            let is_path = folders.contains(&first) || files.contains(&word);
            if is_path { self.root.join(word).into_os_string() } else { OsString::from(word) }
        });
        // The first words are the verb; `sensor` and `pulls` are verbs there.
        let words: Vec<OsString> = words.collect();
        let mut plain: Vec<OsString> = line.split(' ').map(OsString::from).collect();
        let verbs = if ["calibrate", "rig"].contains(&plain[0].to_str().unwrap()) { 2 } else { 1 };
        plain.truncate(verbs);
        try_run([OsString::from("gripgen")].into_iter().chain(plain).chain(words.into_iter().skip(verbs)))
    }

    fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.root.join(name)).unwrap()
    }
}

fn cases() -> Vec<Case> {
    let case = |verb, id, ending, line: &str, runs| Case { verb, id, ending, line: line.into(), runs };
    let json = |verb, line, runs| case(verb, "json", "json", line, runs);
    vec![
        json("init", "out/start -q", true),
        json("try", "part.stl --grip 0 -o out/tried.html -q", true),
        case("try", "out", "html", "part.stl --grip 0 -q", true),
        json("check", "sweep.toml -q", true),
        json("sweep", "sweep.toml -o run -q", true),
        json("info", "run", true),
        json("verify", "run", true),
        json("show", "run 0 -o out/shown.png", true),
        case("show", "out", "png", "run 0", true),
        json("view", "run -o out/viewed.html -q", true),
        case("view", "out", "html", "run -q", true),
        json("export", "run --sample 0 -o out/exported.mcap", true),
        case("export", "out", "mcap", "run --sample 0", true),
        case("export", "out", "parquet", "run --to parquet", true),
        case("export", "out", "tar", "run --to webdataset -q", true),
        json("calibrate imprints", "imprints -q", true),
        case("calibrate imprints", "out", "toml", "imprints --part gear --twin twin.toml -q", true),
        json("calibrate presses", "presses -o out/s.npz", false),
        case("calibrate presses", "out", "npz", "presses", false),
        case("calibrate presses", "report", "html", "presses -o out/s.npz", false),
        json("calibrate pulls", "pulls -o out/fitted.toml --twin twin.toml -q", true),
        case("calibrate pulls", "out", "toml", "pulls --twin twin.toml -q", true),
        json("calibrate sensor", "sensor -q", true),
        case("calibrate sensor", "out", "toml", "sensor --twin twin.toml -q", true),
        json("compare", "pulls -q", true),
        case("compare", "report", "html", "pulls --twin twin.toml -q", true),
        json("diagnose", "one -q", true),
        case("diagnose", "out", "toml", "one --twin twin.toml -q", true),
        case("diagnose", "report", "html", "one -q", true),
        json("render", "part.stl --depth-mm 0.2 --sensor sensor.npz -o out/r.png", true),
        case("render", "out", "png", "part.stl --depth-mm 0.2 --sensor sensor.npz", true),
        case("render", "heights", "npy", "part.stl --depth-mm 0.2 --sensor sensor.npz -o out/h.png", true),
        case("render", "normals", "npy", "part.stl --depth-mm 0.2 --sensor sensor.npz -o out/n.png", true),
        case("render", "mask", "png", "part.stl --depth-mm 0.2 --sensor sensor.npz -o out/m.png", true),
        json("sensor check", "sensor.npz presses", false),
        case("sensor check", "out", "npz", "sensor.npz presses", false),
        case("sensor check", "report", "html", "sensor.npz presses", false),
        json("effects", "", true),
        case("effects", "plot", "svg", "load_power_law", true),
        json("campaign", "-o out/c.toml --parts gear --pulls 24", true),
        case("campaign", "out", "toml", "--parts gear --pulls 24 --twin twin.toml", true),
        case("campaign", "csv", "csv", "-o out/c.toml --parts gear --pulls 24", true),
        json("rig check", "rig.toml", false),
        json("rig teach", "bolt --rig rig.toml", false),
        json("rig rehearse", "rig.toml -o out/rehearsal.json", false),
        case("rig rehearse", "out", "json", "rig.toml", false),
        json("rig pull", "rig.toml --dry-run -o out/day", true),
        json("rig serve", "", false),
        case("rig serve", "write_rig", "toml", "twin.toml", false),
        json("bench", "--seconds 0.01 --sensor sensor.npz", false),
    ]
}

/// Verbs and their own arguments.
fn verbs() -> Vec<(String, Vec<Arg>)> {
    fn walk(command: &clap::Command, path: &str, found: &mut Vec<(String, Vec<Arg>)>) {
        if command.get_subcommands().next().is_none() {
            found.push((path.trim().into(), command.get_arguments().cloned().collect()));
        }
        command.get_subcommands().for_each(|sub| walk(sub, &format!("{path} {}", sub.get_name()), found));
    }
    let mut found = Vec::new();
    walk(&Cli::command(), "", &mut found);
    found
}

/// A new verb or flag that writes has to stand in the list of cases, or it fails here.
#[test]
fn every_argument_that_may_be_a_file_is_known_as_input_or_output() {
    let cases = cases();
    let mut outputs = BTreeSet::new();
    for (verb, arguments) in verbs() {
        for arg in &arguments {
            let id = arg.get_id().as_str();
            let names = arg.get_value_names().unwrap_or_default();
            let looks = names.iter().any(|n| {
                ["FILE", "FOLDER", "PATH", ".toml", ".png", ".npz", ".html"]
                    .iter()
                    .any(|part| n.contains(part))
            });
            let is_path = arg.get_value_parser().type_id() == TypeId::of::<PathBuf>();
            let known = cases.iter().any(|c| c.verb == verb && c.id == id);
            if known {
                outputs.insert((verb.clone(), id.to_string()));
                let force = arguments.iter().find(|a| a.get_id() == "force");
                let long = force.and_then(Arg::get_long);
                assert_eq!(long, Some("force"), "`gripgen {verb}` writes and has no --force");
            }
            let folder = FOLDERS.contains(&(verb.as_str(), id));
            let read = READ.split(' ').any(|name| name == id);
            assert!(
                !(looks || is_path) || known || folder || read,
                "`gripgen {verb}`: is `{id}` read or written? Then name it among READ, or write it through `Outputs` and \
                 give it a case"
            );
        }
    }
    let listed: BTreeSet<_> = cases.iter().map(|c| (c.verb.to_string(), c.id.to_string())).collect();
    assert_eq!(outputs, listed, "cases of arguments that are gone");
}

/// No verb writes files on its own.
#[test]
fn verbs_write_through_one_function() {
    fn walk(folder: &Path, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            match path.is_dir() {
                true => walk(&path, found),
                // Tests write what they read.
                false if path.ends_with("tests.rs") => {}
                false => found.push(path),
            }
        }
    }
    let mut sources = Vec::new();
    walk(&Path::new(env!("CARGO_MANIFEST_DIR")).join("src/commands"), &mut sources);
    assert!(sources.len() > 15, "{sources:?}");
    for source in sources {
        let text = std::fs::read_to_string(&source).unwrap();
        for writer in ["fs::write", "File::create", "OpenOptions", "fs::rename", "fs::copy"] {
            assert!(
                !text.contains(writer),
                "{} writes by `{writer}`, not through `Outputs`",
                source.display()
            );
        }
    }
}

/// The command line with this output.
fn with(case: &Case, output: &str, more: &str) -> String {
    let flag = format!("--{}", case.id.replace('_', "-"));
    let words = [case.verb, &case.line, &flag, output, more];
    words.iter().filter(|word| !word.is_empty()).copied().collect::<Vec<_>>().join(" ")
}

/// For every output of every verb: an existing file is refused before any work, inputs and files of a run even with `--force`; commands
/// that are short run to their end, twice with `--force` and to the same bytes.
#[test]
fn outputs_replace_files_only_with_force() {
    let world = World::new();
    for case in cases() {
        std::fs::create_dir_all(world.root.join("out")).unwrap();
        let refused = |line: &str, says: &str| {
            let refused = world.line(line).expect_err(line);
            let hint = refused.what_to_do().unwrap_or_default();
            assert_eq!(refused.exit_code(), 2, "{line}: {}", refused.message());
            assert!(refused.message().contains(says), "{line}: {} ({hint})", refused.message());
            assert!(hint.contains("--force"), "{line}: {hint}");
        };
        let mine = format!("out/mine.{}", case.ending);
        world.put(&mine, MINE);
        refused(&with(&case, &mine, ""), "this file exists");
        assert_eq!(world.read(&mine), MINE, "{} {}", case.verb, case.id);

        let mut taken: Vec<(String, &str)> = [
            "run/run.json",
            "run/index.csv",
            "run/shard-00000.mcap",
            "run/shard-00000.json",
            "run/inputs/new.stl",
        ]
        .map(|file| (file.into(), "belongs to the run"))
        .into();
        let words: Vec<&str> = case.line.split(' ').collect();
        let mut reads = |word: &str, file: &str| {
            if words.contains(&word) {
                taken.push((file.into(), "is what the command reads"));
            }
        };
        for file in ["sweep.toml", "twin.toml", "rig.toml", "part.stl", "sensor.npz"] {
            reads(file, file);
            // By another name too.
            let link = format!("out/link-{file}.{}", case.ending);
            std::fs::hard_link(world.root.join(file), world.root.join(&link)).unwrap();
            reads(file, &link);
        }
        // A configuration names files too.
        reads("sweep.toml", "twin.toml");
        for (folder, file) in [("pulls", "pulls.csv"), ("sensor", "sensor.csv"), ("presses", "a.png")] {
            reads(folder, &format!("{folder}/{file}"));
        }
        for (path, says) in taken {
            let before = std::fs::read(world.root.join(&path)).ok();
            refused(&with(&case, &path, "--force"), says);
            assert_eq!(std::fs::read(world.root.join(&path)).ok(), before, "{} {path}", case.verb);
        }
        let names =
            std::fs::read_dir(world.root.join("out")).unwrap().flatten().map(|entry| entry.file_name());
        let partial: Vec<_> = names.filter(|name| name.to_string_lossy().ends_with(".partial")).collect();
        assert!(partial.is_empty(), "{}: {partial:?}", case.verb);

        if case.runs {
            let line = with(&case, &mine, "--force");
            assert_eq!(world.line(&line).map_err(|e| e.message()), Ok(0), "{line}");
            let first = world.read(&mine);
            assert_ne!(first, MINE, "{line}");
            assert_eq!(world.line(&line).map_err(|e| e.message()), Ok(0), "again: {line}");
            assert!(case.id == "json" || world.read(&mine) == first, "{line}: not the same bytes");
        }
        std::fs::remove_dir_all(world.root.join("out")).unwrap();
    }
    drop(world.folder);
}

#[test]
fn own_files_of_a_run_and_data_of_inputs_are_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    let files = "run/run.json run/inputs/a.stl run/sample-000003.png pulls/pulls.csv pulls/campaign.toml pulls/twin.toml \
        pulls/twin.posterior.csv pulls/images/a_left.png presses/shapes.csv presses/balls/1.png presses/sensor.npz";
    for file in files.split_whitespace() {
        std::fs::create_dir_all(root.join(file).parent().unwrap()).unwrap();
        std::fs::write(root.join(file), "x").unwrap();
    }
    std::fs::create_dir(root.join("planned")).unwrap();
    let reads = ["run", "pulls", "presses"].map(|name| root.join(name));
    let allowed = |name: &str| {
        Outputs::new(true).reads_all(&reads).makes_run(root.join("planned")).allow(&root.join(name)).is_ok()
    };
    let never = "run/run.json run/shard-00000.mcap run/shard-00007.json run/rehearsal-0a1b2c3d.json run/index.csv \
        run/contact-sheet.png run/inputs/a.stl run/inputs/new.stl planned/run.json pulls/pulls.csv pulls/campaign.toml \
        pulls/images/a_left.png presses/shapes.csv presses/balls/1.png";
    let with_force = "run/report.html run/sample-000003.png pulls/report.html pulls/twin.toml pulls/twin.posterior.csv \
        presses/sensor.npz";
    assert_eq!(never.split_whitespace().filter(|name| allowed(name)).collect::<Vec<_>>(), [""; 0]);
    assert_eq!(with_force.split_whitespace().filter(|name| !allowed(name)).collect::<Vec<_>>(), [""; 0]);
}

#[test]
fn a_file_that_comes_while_the_work_is_done_stays_and_the_work_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late.html");
    let mut outputs = Outputs::new(false);
    outputs.allow(&path).unwrap();
    std::fs::write(&path, MINE).unwrap();
    let refused = outputs.write(&path, b"<p>made\n").unwrap_err();
    assert_eq!(std::fs::read(&path).unwrap(), MINE);
    let hint = refused.what_to_do().unwrap();
    let kept = hint.strip_prefix("what was made is in ").expect(hint);
    assert_eq!(std::fs::read_to_string(kept).unwrap(), "<p>made\n");
    // Two outputs cannot be one.
    assert!(outputs.allow(&folder.path().join("./late.html")).is_err());
}

/// The draws of an earlier command do not stay next to a twin that has none.
#[test]
fn draws_go_with_their_twin() {
    let folder = tempfile::tempdir().unwrap();
    let (twin, draws) = (folder.path().join("t.toml"), folder.path().join("t.posterior.csv"));
    std::fs::write(&draws, MINE).unwrap();
    assert!(Outputs::new(false).allow_twin(&twin).is_err());
    let mut forced = Outputs::new(true);
    forced.allow_twin(&twin).unwrap();
    forced.write_twin(&twin, "x = 1\n", None).unwrap();
    assert!(twin.is_file() && !draws.exists());
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_are_written_to() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("real.toml"), MINE).unwrap();
    std::os::unix::fs::symlink(at("real.toml"), at("link.toml")).unwrap();
    assert!(Outputs::new(true).reads(at("real.toml")).allow(&at("link.toml")).is_err());
    Outputs::new(true).write(&at("link.toml"), b"x = 1\n").unwrap();
    assert!(at("link.toml").is_symlink(), "the link is still one");
    assert_eq!(std::fs::read_to_string(at("real.toml")).unwrap(), "x = 1\n");
    let mut quiet = Outputs::new(false);
    quiet.allow(Path::new("/dev/null")).unwrap();
    quiet.write(Path::new("/dev/null"), b"{}").unwrap();
    use std::os::unix::fs::FileTypeExt;
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}
