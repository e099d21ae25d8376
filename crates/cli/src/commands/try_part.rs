//! `gripgen try`: what becomes of a part, on one page and in one picture.

use crate::args::TryArgs;
use crate::commands::init::mesh_wanted;
use crate::failure::Failure;
use crate::load::jobs;
use crate::output::{JsonSink, program};
use crate::outputs::Outputs;
use crate::shell;
use crate::{PartOptions, TryOptions, TryPartError, rasterise, try_part};
use gripgen::twin::usual_scale_mm_per_unit;
use gripgen_report::{GripTried, TriedPart, tried_page, tried_picture};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &TryArgs) -> Result<u8, Failure> {
    let extension = mesh_wanted(&args.mesh)?;
    let stem =
        args.mesh.file_stem().map_or_else(|| "part".into(), |stem| stem.to_string_lossy().into_owned());
    let page = args.out.clone().unwrap_or_else(|| PathBuf::from(format!("{stem}-try.html")));
    let picture = page.with_extension("png");
    let mut outputs = Outputs::new(args.replaces()).reads(&args.mesh);
    if let Some(sensor) = &args.sensor {
        outputs = outputs.reads_config(sensor, &[]);
    }
    outputs.allow_all([page.as_path(), picture.as_path()])?;
    let sink = JsonSink::open(args.json.as_deref(), &mut outputs)?;
    let options = TryOptions {
        part: PartOptions {
            scale_mm_per_unit: args.scale_mm_per_unit.unwrap_or(usual_scale_mm_per_unit(&extension)),
            accept_open_mesh: args.accept_open_mesh,
            mu: args.mu,
            threads: jobs(),
        },
        grip: args.grip,
        force_n: args.force_n(),
        sensor: args.sensor.clone(),
    };
    let tried = try_part(&args.mesh, &options).map_err(|e| refused(e, options.part.scale_mm_per_unit))?;
    outputs.write(&page, tried_page(&tried, &rasterise).as_bytes())?;
    outputs.write(&picture, &tried_picture(&tried, &rasterise))?;
    if !args.talk.quiet {
        eprint!("{}", summary(&tried));
        eprintln!("next: {}", next(args, &stem));
    }
    let files = || format!("{}\n{}\n", page.display(), picture.display());
    sink.finish(false, || document(&tried, &page, &picture), files)
}

/// The command that makes a sweep of the part as it was read here.
fn next(args: &TryArgs, stem: &str) -> String {
    let mut words = vec![program().to_string(), "init".into(), shell::path(&args.mesh)];
    if let Some(scale) = args.scale_mm_per_unit {
        words.extend(["--scale-mm-per-unit".into(), scale.to_string()]);
    }
    if args.accept_open_mesh {
        words.push("--accept-open-mesh".into());
    }
    if let Some(mu) = args.mu {
        words.extend(["--mu".into(), mu.to_string()]);
    }
    words.extend(["-o".into(), shell::operand(stem)]);
    shell::command_line(&words)
}

fn refused(error: TryPartError, scale_mm_per_unit: f64) -> Failure {
    let hint = match &error {
        TryPartError::Init(e) => e.hint(scale_mm_per_unit),
        TryPartError::NoSuchGrip { .. } => "leave --grip out to see them all".into(),
        TryPartError::Friction { .. } => "mu is the pull at slip over both grip forces: F / (2 F_G)".into(),
        TryPartError::Fails { .. } | TryPartError::Force { .. } => "try a smaller --force-n".into(),
        _ => "name a sensor file that `gripgen calibrate presses` wrote".into(),
    };
    Failure::usage(error).hint(hint)
}

fn summary(tried: &TriedPart) -> String {
    let [x, y, z] = tried.size_mm;
    let mut text = format!("{}: {x:.1} x {y:.1} x {z:.1} mm, {} grips were tried\n", tried.name, tried.tried);
    for words in &tried.mesh_words {
        text += &format!("note: {words}\n");
    }
    for grip in &tried.grips {
        let held = grip.holding.iter().find(|h| h.grip_force_n == grip.force_n);
        let holds = held.and_then(|h| h.max_pull_force_n.as_ref().ok()).map_or_else(
            String::new,
            |[low, value, high]| {
                format!(", holds about {value:.1} N at {} N a jaw ({low:.1} to {high:.1} N)", grip.force_n)
            },
        );
        let fails = match grip.fails.len() {
            0 => String::new(),
            _ => format!("; would fail: {}", grip.fails[0]),
        };
        let p = &grip.proposal;
        text += &format!(
            "grip {}: {:.1} mm between the jaws, {:.0} mm2 in contact{holds}{fails}\n",
            grip.grip_pose, p.width_mm, p.contact_mm2
        );
        for words in &grip.doubts {
            text += &format!("warning: grip {}: {words}\n", grip.grip_pose);
        }
    }
    text
}

fn document(tried: &TriedPart, page: &Path, picture: &Path) -> Value {
    let grip = |g: &GripTried| {
        let holding = g.holding.iter().map(|h| match &h.max_pull_force_n {
            Ok([low, value, high]) => json!({
                "grip_force_n": h.grip_force_n,
                "max_pull_force_n": {"value": value, "low": low, "high": high},
            }),
            Err(why) => json!({"grip_force_n": h.grip_force_n, "failure": why}),
        });
        let works = g.works.iter().map(|w| {
            json!({
                "grip_angle_deg": w.grip_angle_deg, "grip_offset_mm": w.grip_offset_mm,
                "largest_force_n": w.largest_n,
            })
        });
        json!({
            "grip_pose": g.grip_pose, "origin_mm": g.proposal.origin_mm,
            "orientation_deg": g.proposal.orientation_deg, "width_mm": g.proposal.width_mm,
            "contact_mm2": g.proposal.contact_mm2, "lever_mm": g.proposal.lever_mm,
            "clearance_mm": g.proposal.clearance_mm, "image_force_n": g.force_n,
            "holding": holding.collect::<Vec<_>>(), "works": works.collect::<Vec<_>>(), "fails": g.fails,
            "warnings": g.doubts,
        })
    };
    json!({
        "schema": "gripgen.try/1", "part": tried.name, "size_mm": tried.size_mm, "mesh": tried.mesh_words,
        "tried": tried.tried,
        "mu": {
            "value": tried.mu.value, "low": tried.mu.low, "high": tried.mu.high, "measured": tried.mu.is_measured,
        },
        "grips": tried.grips.iter().map(grip).collect::<Vec<_>>(), "page": page, "picture": picture,
    })
}
