//! `gripgen init`: something to start from.

use crate::args::InitArgs;
use crate::failure::Failure;
use crate::mark::Format;
use crate::output::{JsonSink, print, program};
use crate::outputs::Outputs;
use gripgen::{part_starter, starter};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &InitArgs) -> Result<u8, Failure> {
    let is_mesh = args
        .target
        .extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| ["stl", "obj"].contains(&e.to_ascii_lowercase().as_str()));
    let (folder, files, talk, grips) = if is_mesh {
        let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
        let made = part_starter(&args.target, &folder, args.scale_mm_per_unit).map_err(|e| {
            Failure::usage(e).hint("--scale-mm-per-unit 1000 reads a file in metres, 25.4 one in inches")
        })?;
        (folder, made.files, made.summary, made.grips)
    } else {
        no_mesh(&args.target)?;
        if let Some(out) = &args.out {
            let problem = format!("--out {} goes with a mesh; a folder is its own target", out.display());
            return Err(Failure::usage(problem));
        }
        (args.target.clone(), starter(), String::new(), vec![])
    };
    let mut outputs = Outputs::of("init", args.json.force).reads_all(is_mesh.then_some(&args.target));
    let paths: Vec<PathBuf> = files.iter().map(|f| folder.join(&f.name)).collect();
    paths.iter().try_for_each(|path| outputs.judge(path))?;
    std::fs::create_dir_all(&folder).map_err(|e| Failure::new(format!("{}: {e}", folder.display())))?;
    outputs.allow_all(paths.iter().map(PathBuf::as_path))?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    // They are there to be edited, and carry no mark: who runs it again means --force.
    paths.iter().zip(&files).try_for_each(|(path, file)| outputs.write(path, Format::Bare, &file.bytes))?;
    if !args.talk.quiet {
        eprint!("{talk}");
        let sweep = folder.join("sweep.toml");
        eprintln!("next: {1} check {0}, then {1} sweep {0}", sweep.display(), program());
    }
    if sink.wanted() {
        let grips: Vec<_> = grips
            .iter()
            .map(|g| {
                json!({
                    "origin_mm": g.origin_mm, "orientation_deg": g.orientation_deg, "width_mm": g.width_mm,
                    "contact_mm2": g.contact_mm2,
                })
            })
            .collect();
        sink.document(&json!({"schema": "gripgen.init/1", "files": paths, "grips": grips}))?;
        if sink.on_stdout() {
            return Ok(0);
        }
    }
    let listed: String = paths.iter().map(|path| format!("{}\n", path.display())).collect();
    print(&listed)?;
    Ok(0)
}

/// A target that is no mesh has to be a folder: a file of another kind, or one that is not there, makes none of its name.
fn no_mesh(target: &Path) -> Result<(), Failure> {
    if target.is_dir() {
        return Ok(());
    }
    let ending = target.extension().map(|e| e.to_string_lossy().into_owned()).unwrap_or_default();
    // `v1.2` is a folder to be.
    let of_a_file = ending.chars().any(char::is_alphabetic);
    let problem = match target.exists() {
        true => "this is neither a folder nor a mesh that can be read",
        false if of_a_file => "there is no such file, and .STL and .OBJ are the meshes that can be read",
        false => return Ok(()),
    };
    Err(Failure::usage(format!("{}: {problem}", target.display()))
        .hint("export the part as STL or OBJ; or name a folder, which is made"))
}
