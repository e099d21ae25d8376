//! `gripgen init`: something to start from.

use crate::args::InitArgs;
use crate::failure::Failure;
use crate::load::jobs;
use crate::output::{JsonSink, print, program};
use crate::outputs::Outputs;
use crate::shell;
use crate::{PartOptions, benchmark_starter, part_starter, starter};
use gripgen::twin::{MESH_FORMATS, usual_scale_mm_per_unit};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &InitArgs) -> Result<u8, Failure> {
    let extension = args.target.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    // Every kind of start has a sweep; grips are tried for minutes.
    let free = |folder: &Path| match folder.is_dir() {
        true => Outputs::new(args.json.force).allow(&folder.join("sweep.toml")),
        false => Ok(()),
    };
    let (folder, files, talk, made) = if args.benchmark {
        let folder = args.out.clone().unwrap_or_else(|| args.target.clone());
        no_mesh(&folder, "")?;
        free(&folder)?;
        let made = benchmark_starter(args.per_family.map(|n| n as usize), jobs()).map_err(Failure::new)?;
        (folder, made.files, made.summary, None)
    } else if MESH_FORMATS.contains(&extension.as_str()) {
        let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
        free(&folder)?;
        let options = PartOptions {
            scale_mm_per_unit: args.scale_mm_per_unit.unwrap_or(usual_scale_mm_per_unit(&extension)),
            accept_open_mesh: args.accept_open_mesh,
            mu: args.mu,
            threads: jobs(),
        };
        let mut made = part_starter(&args.target, &folder, options).map_err(|e| {
            let hint = e.hint(options.scale_mm_per_unit);
            Failure::usage(e).hint(hint)
        })?;
        let files = std::mem::take(&mut made.files);
        (folder, files, std::mem::take(&mut made.summary), Some(made))
    } else {
        no_mesh(&args.target, &extension)?;
        if args.mu.is_some() {
            return Err(Failure::usage("--mu goes with a mesh: it is that of its part")
                .hint("mu of each part stands in twin.toml"));
        }
        if let Some(out) = &args.out {
            let problem = format!("--out {} goes with a mesh; a folder is its own target", out.display());
            return Err(Failure::usage(problem));
        }
        (args.target.clone(), starter(), String::new(), None)
    };
    let mut outputs = Outputs::new(args.json.force).reads_all(made.is_some().then_some(&args.target));
    let paths: Vec<PathBuf> = files.iter().map(|f| folder.join(&f.name)).collect();
    std::fs::create_dir_all(&folder).map_err(|e| Failure::new(format!("{}: {e}", folder.display())))?;
    outputs.allow_all(paths.iter().map(PathBuf::as_path))?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    paths.iter().zip(&files).try_for_each(|(path, file)| outputs.write(path, &file.bytes))?;
    if !args.talk.quiet {
        eprint!("{talk}");
        let sweep = shell::path(&folder.join("sweep.toml"));
        let command = |verb: &str| shell::command_line(&[program(), verb, &sweep]);
        eprintln!("next: {}, then {}", command("check"), command("sweep"));
    }
    if sink.wanted() {
        let grips: Vec<_> = made
            .iter()
            .flat_map(|made| &made.grips)
            .map(|g| {
                json!({
                    "origin_mm": g.origin_mm, "orientation_deg": g.orientation_deg, "width_mm": g.width_mm,
                    "contact_mm2": g.contact_mm2, "lever_mm": g.lever_mm, "clearance_mm": g.clearance_mm,
                })
            })
            .collect();
        let mut document = json!({"schema": "gripgen.init/1", "files": paths, "grips": grips});
        if let Some(made) = &made {
            let varied = &made.varied;
            document["varied"] = json!({
                "grip_force_n": varied.grip_force_n, "grip_offset_sd_mm": varied.grip_offset_sd_mm,
                "grip_angle_deg": varied.grip_angle_deg,
            });
            document["mesh"] = json!(made.mesh_words);
            for (grip, words) in made.doubts.iter().enumerate() {
                document["grips"][grip]["warnings"] = json!(words);
            }
        }
        sink.document(&document)?;
        if sink.on_stdout() {
            return Ok(0);
        }
    }
    let listed: String = paths.iter().map(|path| format!("{}\n", path.display())).collect();
    print(&listed)?;
    Ok(0)
}

/// What to do with a file of a part that is not read; `None` for everything else.
fn unread(extension: &str) -> Option<&'static str> {
    match extension {
        "step" | "stp" | "iges" | "igs" | "sldprt" | "ipt" | "f3d" | "fcstd" | "brep" => Some(
            "it holds curved surfaces and no triangles: export it from your CAD as binary STL in millimetres, with a tolerance \
             of 0.01 mm",
        ),
        "gltf" | "off" | "3mf" | "dae" | "fbx" | "x3d" | "wrl" => Some(
            "convert it: python -c \"import trimesh; trimesh.load('part.3mf', force='mesh').export('part.stl')\"",
        ),
        _ => None,
    }
}

/// The ending of a path that has to be a mesh.
pub(super) fn mesh_wanted(path: &Path) -> Result<String, Failure> {
    let extension = path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase());
    if MESH_FORMATS.contains(&extension.as_str()) {
        return Ok(extension);
    }
    let hint = unread(&extension).unwrap_or("export the part as STL, OBJ, PLY or GLB");
    Err(Failure::usage(format!(
        "{}: .STL, .OBJ, .PLY and .GLB are the meshes that can be read",
        path.display()
    ))
    .hint(hint))
}

/// A target that is no mesh has to be a folder: a file of another kind, or one that is not there, makes none of its name.
fn no_mesh(target: &Path, extension: &str) -> Result<(), Failure> {
    if target.is_dir() {
        return Ok(());
    }
    // `v1.2` is a folder to be.
    let of_a_file = extension.chars().any(char::is_alphabetic);
    let problem = match target.exists() {
        true => "this is neither a folder nor a mesh that can be read",
        false if of_a_file => {
            "there is no such file, and .STL, .OBJ, .PLY and .GLB are the meshes that can be read"
        }
        false => return Ok(()),
    };
    let hint = unread(extension)
        .unwrap_or("export the part as STL, OBJ, PLY or GLB; or name a folder, which is made");
    Err(Failure::usage(format!("{}: {problem}", target.display())).hint(hint))
}
