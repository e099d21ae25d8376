//! What is never overwritten, for every verb that writes.

use super::*;
use crate::args::Cli;
use crate::try_run;
use clap::{Arg, CommandFactory};
use std::any::TypeId;
use std::collections::BTreeSet;
use std::ffi::OsString;

/// Arguments that name what is read.
const READ: [&str; 15] = [
    "rehearsal",
    "config",
    "run",
    "presses",
    "measured",
    "also",
    "sensor",
    "twin",
    "rig",
    "mesh",
    "campaign",
    "after",
    "separate",
    "target",
    "data",
];
/// Arguments that name a folder with rules of its own: a run (exit code 3), measurements, the files of `init`.
const FOLDERS: [(&str, &str); 4] =
    [("sweep", "out"), ("rig pull", "out"), ("campaign", "simulate"), ("init", "out")];
/// A file of somebody.
const MINE: &[u8] = b"mine, and nobody else's\n";

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
        copy("sensors/gelsight_r15/sensor.npz", "sensor.npz");
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
        world.put("traced/pulls.csv", pulls.as_bytes());
        world.put("traced/traces/p0.csv", b"time_s,desired_force_n,measured_force_n,displacement_mm\n");
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
            let folders = ["run", "pulls", "traced", "one", "sensor", "imprints", "presses", "out"];
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
        json("effects", "", true),
        case("effects", "plot", "svg", "load_power_law", true),
        json("campaign", "-o out/c.toml --parts gear --pulls 24", true),
        case("campaign", "out", "toml", "--parts gear --pulls 24 --twin twin.toml", true),
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
            let read = READ.contains(&id);
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
    assert!(sources.len() > 25, "{sources:?}");
    for source in sources {
        let text = std::fs::read_to_string(&source).unwrap();
        for writer in ["fs::write", "File::create", "OpenOptions", "fs::rename", "fs::copy", "write_twin("] {
            assert!(
                !text.contains(writer),
                "{} writes by `{writer}`, not through `Outputs`",
                source.display()
            );
        }
    }
}

fn flag(case: &Case) -> String {
    format!("--{}", case.id.replace('_', "-"))
}

/// The command line with this output.
fn with(case: &Case, output: &str, more: &str) -> String {
    let words = [case.verb, &case.line, &flag(case), output, more];
    words.iter().filter(|word| !word.is_empty()).copied().collect::<Vec<_>>().join(" ")
}

#[track_caller]
fn assert_refused(found: Result<u8, Failure>, line: &str, says: &str) {
    let refused = found.expect_err(line);
    let hint = refused.what_to_do().unwrap_or_default().to_string();
    assert_eq!(refused.exit_code(), 2, "{line}: {}", refused.message());
    assert!(refused.message().contains(says), "{line}: {} ({hint})", refused.message());
    assert!(hint.contains("--force"), "{line}: {hint}");
}

/// For every output of every verb: somebody's file is refused before anything is done, inputs and files of runs and
/// measurements even with `--force`.
#[test]
fn no_verb_overwrites_what_it_did_not_write() {
    let world = World::new();
    for case in cases() {
        std::fs::create_dir_all(world.root.join("out")).unwrap();
        let mine = format!("out/mine.{}", case.ending);
        world.put(&mine, MINE);
        let line = with(&case, &mine, "");
        assert_refused(world.line(&line), &line, "did not write it");
        assert_eq!(world.read(&mine), MINE, "{line}");

        let words: Vec<&str> = case.line.split(' ').collect();
        let inputs = ["sweep.toml", "twin.toml", "rig.toml", "part.stl", "sensor.npz"];
        let mut taken: Vec<(String, &str)> = vec![
            ("run/run.json".into(), "belongs to the run"),
            ("run/index.csv".into(), "belongs to the run"),
            ("run/shard-00000.mcap".into(), "belongs to the run"),
            ("run/shard-00000.json".into(), "belongs to the run"),
            ("pulls/pulls.csv".into(), "belongs to the measurements"),
            ("traced/traces/p0.csv".into(), "belongs to the measurements"),
            ("sensor/sensor.csv".into(), "belongs to the measurements"),
            ("presses/presses.csv".into(), "belongs to the measurements"),
            ("presses/a.png".into(), "belongs to the measurements"),
        ];
        for input in inputs.iter().filter(|input| words.contains(input)) {
            taken.push((input.to_string(), "is what the command reads"));
            // By another name too.
            let link = format!("out/link.{}", case.ending);
            let _ = std::fs::remove_file(world.root.join(&link));
            std::fs::hard_link(world.root.join(input), world.root.join(&link)).unwrap();
            taken.push((link, "is what the command reads"));
        }
        // A configuration names files too.
        if words.contains(&"sweep.toml") {
            taken.push(("twin.toml".into(), "is what the command reads"));
        }
        for (path, says) in taken {
            let before = world.read(&path);
            let line = with(&case, &path, "--force");
            assert_refused(world.line(&line), &line, says);
            assert_eq!(world.read(&path), before, "{line}");
        }
        let left: Vec<_> =
            std::fs::read_dir(world.root.join("out")).unwrap().map(|e| e.unwrap().file_name()).collect();
        let partial = left.iter().filter(|name| name.to_string_lossy().ends_with(".partial")).count();
        assert_eq!(partial, 0, "{line}: {left:?}");
        std::fs::remove_dir_all(world.root.join("out")).unwrap();
    }
    drop(world.folder);
}

/// The same command again replaces its own file, another verb's and an edited one it leaves alone; `--force` replaces all.
#[test]
fn a_verb_replaces_its_own_file_and_no_other() {
    let world = World::new();
    for case in cases().iter().filter(|case| case.runs) {
        std::fs::create_dir_all(world.root.join("out")).unwrap();
        let out = format!("out/file.{}", case.ending);
        // `init` is stopped by its own files, which are there to be edited.
        let force = if case.verb == "init" { "--force" } else { "" };
        let line = with(case, &out, "");
        assert_eq!(world.line(&line).map_err(|e| e.message()), Ok(0), "{line}");
        let bare = case.ending == "npy";
        let verb = mark_of(&world.root.join(&out)).map(|mark| mark.verb);
        assert_eq!(verb.as_deref(), Some(case.verb).filter(|_| !bare), "{line}");
        let line = with(case, &out, force);
        let first = world.read(&out);
        assert_eq!(world.line(&line).map_err(|e| e.message()), Ok(0), "again: {line}");
        if case.id != "json" {
            assert!(world.read(&out) == first, "{line}: not the same bytes");
        }
        if case.verb == "init" {
            std::fs::remove_dir_all(world.root.join("out")).unwrap();
            continue;
        }
        // Of another verb.
        let other = if case.verb == "compare" { "diagnose" } else { "compare" };
        std::fs::write(world.root.join(&out), marked(Format::Toml, other, b"x = 1\n", &[])).unwrap();
        assert_refused(world.line(&line), &line, &format!("`gripgen {other}` wrote it"));
        assert_eq!(world.line(&with(case, &out, "--force")).map_err(|e| e.message()), Ok(0), "{line}");
        // Edited.
        if ["toml", "html", "svg", "npy"].contains(&case.ending) {
            let edited = [b"# more\n".as_slice(), &world.read(&out), b"more\n"].concat();
            std::fs::write(world.root.join(&out), &edited).unwrap();
            assert_eq!(world.line(&line).expect_err(&line).exit_code(), 2, "{line}");
            assert_eq!(world.read(&out), edited, "{line}");
        }
        std::fs::remove_dir_all(world.root.join("out")).unwrap();
    }
}

#[test]
fn a_file_that_comes_while_the_work_is_done_stays_and_the_work_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("late.html");
    let mut outputs = Outputs::of("diagnose", false);
    outputs.allow(&path).unwrap();
    std::fs::write(&path, MINE).unwrap();
    let refused = outputs.write(&path, Format::Html, b"<p>made\n").unwrap_err();
    assert_eq!(std::fs::read(&path).unwrap(), MINE);
    let hint = refused.what_to_do().unwrap();
    let kept = hint.strip_prefix("what was made is in ").expect(hint);
    assert!(std::fs::read_to_string(kept).unwrap().starts_with("<p>made"));
    // Two outputs cannot be one.
    assert!(outputs.allow(&folder.path().join("./late.html")).is_err());
}

/// A file without room for a mark is known by the one that names it, however both are spelled.
#[test]
fn a_bare_file_is_known_by_its_picture() {
    let folder = tempfile::tempdir().unwrap();
    let (heights, image) = (folder.path().join("h.npy"), folder.path().join("i.png"));
    let picture = gripgen::twin::TactileImage { width_px: 1, height_px: 1, rgb: vec![0; 3] };
    let png = gripgen::record::encode_png(&picture).unwrap();
    let run = |heights: &Path| {
        let mut outputs = Outputs::of("render", false);
        outputs.allow(&image)?;
        outputs.allow_beside(heights, &image)?;
        outputs.write(heights, Format::Bare, b"numbers")?;
        outputs.write_with(&image, Format::Png, &png, &[short_hash(b"numbers")])
    };
    run(&heights).unwrap();
    std::fs::create_dir(folder.path().join("deep")).unwrap();
    run(&folder.path().join("deep/../h.npy")).unwrap();
    std::fs::write(&heights, MINE).unwrap();
    assert!(run(&heights).is_err());
    assert_eq!(std::fs::read(&heights).unwrap(), MINE);
}

#[cfg(unix)]
#[test]
fn links_are_followed_and_devices_are_written_to() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    std::fs::write(at("real.toml"), MINE).unwrap();
    std::os::unix::fs::symlink(at("real.toml"), at("link.toml")).unwrap();
    let outputs = Outputs::of("campaign", false).reads(at("real.toml"));
    assert!(outputs.judge(&at("link.toml")).is_err());
    let forced = Outputs::of("campaign", true);
    forced.write(&at("link.toml"), Format::Toml, b"x = 1\n").unwrap();
    assert!(at("link.toml").is_symlink(), "the link is still one");
    assert!(std::fs::read_to_string(at("real.toml")).unwrap().ends_with("\nx = 1\n"));
    let mut quiet = Outputs::of("info", false);
    quiet.allow(Path::new("/dev/null")).unwrap();
    quiet.write(Path::new("/dev/null"), Format::Json, b"{}").unwrap();
    use std::os::unix::fs::FileTypeExt;
    assert!(std::fs::metadata("/dev/null").unwrap().file_type().is_char_device());
}
