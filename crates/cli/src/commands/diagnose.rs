//! `gripgen diagnose`: where a twin is wrong, and why.

pub mod output;
mod presses;

use super::rig::load_rig;
use crate::args::{DiagnoseArgs, TalkArgs};
use crate::failure::Failure;
use crate::output::{JsonSink, writable};
use crate::progress::Share;
use gripgen::twin::Twin;
use gripgen::twin::effects::LIBRARY;
use gripgen::{
    Diagnosed, Library, Location, PullDiagnoseOptions, Suspects, diagnose_pull_table, diagnose_sensor_table,
    is_press_set, is_sensor_table, load_pulls_with, load_sensor_table, load_twin_document,
};
use std::path::{Path, PathBuf};

/// Runs the verb.
pub fn run(args: &DiagnoseArgs) -> Result<u8, Failure> {
    if !args.measured.exists() {
        return Err(Failure::usage(format!("{}: there is no such file or folder", args.measured.display())));
    }
    for path in [args.out.as_deref(), args.report.as_deref()].into_iter().flatten() {
        writable(path)?;
    }
    // Opened before the work, so that a path that cannot be written costs nothing.
    let sink = JsonSink::open(args.json.json.as_deref())?;
    let diagnosed = if is_press_set(&args.measured) {
        presses::presses(args)?
    } else if is_sensor_table(&args.measured) {
        sensor(args)?
    } else {
        pulls(args)?
    };
    output::write(args, sink, diagnosed)
}

/// The twin that a verb starts from.
pub fn load_twin(path: &str, sets: &[(String, String)]) -> Result<Twin, Failure> {
    let document = load_twin_document(&Location::parse(path), sets)?;
    let file = document.read_twin().map_err(|e| Failure::from(document.located(e)))?;
    Twin::new(&file).map_err(|e| Failure::from(document.located(e)))
}

/// The files that the grips of a twin need. `path` is the twin's own.
pub fn load_library(twin: &Twin, path: &str) -> Result<Library, Failure> {
    let unread = |e| Failure::usage(e).hint("paths in a twin are relative to its file");
    Library::of_twin(twin, &Location::parse(path)).map_err(unread)
}

/// The twin with no more grip force than the gripper of a rig has.
pub fn within_rig(mut twin: Twin, rig: Option<&str>) -> Result<Twin, Failure> {
    if let Some(rig) = rig {
        let [_, most_n] = load_rig(rig, &[])?.gripper.force_per_jaw_n;
        twin.gripper.max_force_n = twin.gripper.max_force_n.min(most_n);
    }
    Ok(twin)
}

/// Worker threads.
pub fn jobs() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What becomes of suspect labels: what an effect of sensor or robot does to many pulls is no reason to leave them out.
pub fn suspects(include: bool) -> Suspects {
    if include { Suspects::Include } else { Suspects::Screen }
}

/// What cannot be read as pulls.
pub fn no_pulls(paths: &[&Path], e: impl std::fmt::Display) -> Failure {
    let known = paths.iter().all(|path| path.join("pulls.csv").is_file() || path.join("run.json").is_file());
    let failure = Failure::usage(e);
    if known {
        return failure;
    }
    failure.hint("measurements are a folder with pulls.csv, sensor.csv or presses.csv, a run folder, or a dataPack.npz")
}

fn sensor(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let table = load_sensor_table(&args.measured).map_err(Failure::usage)?;
    Ok(diagnose_sensor_table(&table))
}

fn pulls(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let twin = within_rig(load_twin(&args.twin, &args.set)?, args.rig.as_deref())?;
    let known = |id: &String| LIBRARY.iter().any(|spec| spec.id == id);
    if let Some(id) = args.without.iter().find(|id| !known(id)) {
        let ids: Vec<&str> = LIBRARY.iter().map(|spec| spec.id).collect();
        return Err(Failure::usage(format!("--without: there is no effect `{id}`"))
            .hint(format!("the effects: {}", ids.join(", "))));
    }
    let without: Vec<&str> = args.without.iter().map(String::as_str).collect();
    let library = load_library(&twin, &args.twin)?;
    let suspects = suspects(args.include_suspect);
    let measured = folders(&args.measured, &args.also);
    diagnose_folders(&measured, &twin, &library, &without, suspects, &args.talk)
}

/// Folders that are read as one campaign.
pub fn folders<'a>(measured: &'a Path, also: &'a [PathBuf]) -> Vec<&'a Path> {
    std::iter::once(measured).chain(also.iter().map(PathBuf::as_path)).collect()
}

/// Diagnoses the pulls of folders, with progress.
pub fn diagnose_folders(
    measured: &[&Path],
    twin: &Twin,
    library: &Library,
    without: &[&str],
    suspects: Suspects,
    talk: &TalkArgs,
) -> Result<Diagnosed, Failure> {
    let loaded = load_pulls_with(measured, suspects).map_err(|e| no_pulls(measured, e))?;
    let options = PullDiagnoseOptions { jobs: jobs(), without };
    let share = Share::start("diagnosing", talk);
    let diagnosed = diagnose_pull_table(&loaded.pulls, twin, library, &options, &|x| share.at(x));
    share.finish();
    let mut diagnosed = diagnosed.map_err(|e| Failure::usage(&e).hint(e.hint()))?;
    diagnosed.diagnosis.notes.extend(loaded.notes);
    Ok(diagnosed)
}
