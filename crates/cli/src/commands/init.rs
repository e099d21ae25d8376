//! `gripgen init`: something to start from.

use crate::args::InitArgs;
use crate::failure::Failure;
use crate::output::{print, write_file};
use gripgen::{StarterFile, part_starter, starter};
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &InitArgs) -> Result<u8, Failure> {
    let is_mesh = args
        .target
        .extension()
        .and_then(|e| e.to_str())
        .is_some_and(|e| ["stl", "obj"].contains(&e.to_ascii_lowercase().as_str()));
    let (folder, files, talk) = if is_mesh {
        let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
        let made = part_starter(&args.target, &folder, args.scale_mm_per_unit).map_err(|e| {
            Failure::usage(e).hint("--scale-mm-per-unit 1000 reads a file in metres, 25.4 one in inches")
        })?;
        (folder, made.files, made.summary)
    } else {
        if let Some(out) = &args.out {
            let problem = format!("--out {} goes with a mesh; a folder is its own target", out.display());
            return Err(Failure::usage(problem));
        }
        (args.target.clone(), starter(), String::new())
    };
    write_all(&folder, &files, args.force)?;
    if !args.talk.quiet {
        eprint!("{talk}");
        let sweep = folder.join("sweep.toml");
        eprintln!("next: gripgen check {0}, then gripgen sweep {0}", sweep.display());
    }
    let listed: String = files.iter().map(|f| format!("{}\n", folder.join(&f.name).display())).collect();
    print(&listed)?;
    Ok(0)
}

fn write_all(folder: &Path, files: &[StarterFile], force: bool) -> Result<(), Failure> {
    if let Some(taken) = files.iter().map(|f| folder.join(&f.name)).find(|p| p.exists() && !force) {
        return Err(Failure::usage(format!("{} exists already", taken.display()))
            .hint("choose another folder, or replace it with --force"));
    }
    std::fs::create_dir_all(folder).map_err(|e| Failure::new(format!("{}: {e}", folder.display())))?;
    files.iter().try_for_each(|f| write_file(&folder.join(&f.name), &f.bytes))
}
