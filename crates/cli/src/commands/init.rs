//! `gripgen init`: something to start from.

use crate::args::InitArgs;
use crate::failure::Failure;
use crate::load::jobs;
use crate::output::{JsonSink, print, program};
use crate::outputs::Outputs;
use crate::shell;
use crate::{PartGrips, PartOptions, benchmark_starter, part_starter, starter};
use gripgen::twin::{MESH_FORMATS, Proposal, usual_scale_mm_per_unit};
use serde_json::json;
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &InitArgs) -> Result<u8, Failure> {
    // Every kind of start has a sweep; grips are tried for minutes.
    let free = |folder: &Path| match folder.is_dir() {
        true => Outputs::new(args.json.force).allow(&folder.join("sweep.toml")),
        false => Ok(()),
    };
    let first = args.target[0].as_path();
    let is_mesh = |path: &PathBuf| MESH_FORMATS.contains(&extension_of(path).as_str());
    let (folder, files, talk, made) = if args.benchmark {
        let folder = args.out.clone().unwrap_or_else(|| first.to_path_buf());
        no_mesh(&folder, "")?;
        free(&folder)?;
        let made = benchmark_starter(args.per_family.map(|n| n as usize), jobs()).map_err(Failure::new)?;
        (folder, made.files, made.summary, None)
    } else if args.target.iter().all(is_mesh) {
        let folder = args.out.clone().unwrap_or_else(|| PathBuf::from("."));
        free(&folder)?;
        let options = |path: &Path| PartOptions {
            scale_mm_per_unit: args.scale_mm_per_unit.unwrap_or(usual_scale_mm_per_unit(&extension_of(path))),
            accept_open_mesh: args.accept_open_mesh,
            mu: args.mu,
            threads: jobs(),
        };
        let meshes: Vec<(&Path, PartOptions)> =
            args.target.iter().map(|path| (path.as_path(), options(path))).collect();
        let mut made = part_starter(&meshes, &folder).map_err(|e| {
            let hint = e.hint(meshes[0].1.scale_mm_per_unit);
            Failure::usage(e).hint(hint)
        })?;
        let files = std::mem::take(&mut made.files);
        (folder, files, std::mem::take(&mut made.summary), Some(made))
    } else {
        if let Some(other) = args.target.iter().find(|path| args.target.len() > 1 && !is_mesh(path)) {
            return Err(
                mesh_wanted(other).map_or_else(|e| e, |_| Failure::usage("several meshes are wanted"))
            );
        }
        no_mesh(first, &extension_of(first))?;
        if args.mu.is_some() {
            return Err(Failure::usage("--mu goes with a mesh: it is that of its part")
                .hint("mu of each part stands in twin.toml"));
        }
        if let Some(out) = &args.out {
            let problem = format!("--out {} goes with a mesh; a folder is its own target", out.display());
            return Err(Failure::usage(problem));
        }
        (first.to_path_buf(), starter(), String::new(), None)
    };
    let mut outputs = Outputs::new(args.json.force).reads_all(made.iter().flat_map(|_| &args.target));
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
        let grips_of = |part: &PartGrips| -> Vec<_> {
            let grip = |(g, words): (&Proposal, &Vec<String>)| {
                json!({
                    "origin_mm": g.origin_mm, "orientation_deg": g.orientation_deg, "width_mm": g.width_mm,
                    "contact_mm2": g.contact_mm2, "lever_mm": g.lever_mm, "clearance_mm": g.clearance_mm,
                    "warnings": words,
                })
            };
            part.grips.iter().zip(&part.doubts).map(grip).collect()
        };
        let parts: Vec<_> = made.iter().flat_map(|made| &made.parts).collect();
        let mut document = json!({
            "schema": "gripgen.init/1", "files": paths,
            "grips": parts.first().map(|part| grips_of(part)).unwrap_or_default(),
        });
        if let Some(made) = &made {
            let varied = &made.varied;
            document["varied"] = json!({
                "grip_force_n": varied.grip_force_n, "grip_offset_sd_mm": varied.grip_offset_sd_mm,
                "grip_angle_deg": varied.grip_angle_deg,
            });
            document["mesh"] = json!(made.parts[0].mesh_words);
            let each = made
                .parts
                .iter()
                .map(|part| json!({"name": part.name, "grips": grips_of(part), "mesh": part.mesh_words}));
            document["parts"] = each.collect();
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

fn extension_of(path: &Path) -> String {
    path.extension().map_or_else(String::new, |e| e.to_string_lossy().to_lowercase())
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
    let extension = extension_of(path);
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
