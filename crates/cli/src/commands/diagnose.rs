//! `gripgen diagnose`: where a twin is wrong, and why.

pub mod next;
mod notes;
mod output;
mod presses;

use crate::Diagnosed;
use crate::args::{DiagnoseArgs, TalkArgs};
use crate::commands::imprints;
use crate::failure::Failure;
use crate::load::{
    folders, jobs, load_library, load_pulls_to_fit, load_twin, suspects, there_is, within_rig,
};
use crate::output::JsonSink;
use crate::outputs::Outputs;
use crate::progress::Share;
use crate::{
    PullDiagnoseOptions, diagnose_pull_table, diagnose_sensor_table, is_imprint_set, is_press_set,
    is_sensor_table, load_sensor_table,
};
use gripgen::Library;
use gripgen::twin::Twin;
use gripgen::twin::effects::LIBRARY;
use gripgen_measured::Suspects;
use std::path::Path;

/// Runs the verb.
pub fn run(args: &DiagnoseArgs) -> Result<u8, Failure> {
    there_is(&args.measured)?;
    let mut outputs = Outputs::new(args.json.force)
        .reads(&args.measured)
        .reads_all(&args.also)
        .reads_all(&args.rig)
        .reads_all(&args.sensor)
        .reads_config(&args.twin, &args.set);
    args.out.as_deref().map_or(Ok(()), |out| outputs.allow_twin(out))?;
    outputs.allow_all(args.report.as_deref())?;
    let sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let diagnosed = if is_press_set(&args.measured) {
        presses::presses(args)?
    } else if is_imprint_set(&args.measured) {
        imprints::diagnose(args)?
    } else if is_sensor_table(&args.measured) {
        sensor(args)?
    } else {
        outputs.allow_all(next::next_file(args).as_deref())?;
        pulls(args)?
    };
    output::write(args, &outputs, sink, diagnosed)
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

/// Diagnoses the pulls of folders, with progress.
pub fn diagnose_folders(
    measured: &[&Path],
    twin: &Twin,
    library: &Library,
    without: &[&str],
    suspects: Suspects,
    talk: &TalkArgs,
) -> Result<Diagnosed, Failure> {
    let loaded = load_pulls_to_fit(measured, suspects, talk, true)?;
    let options = PullDiagnoseOptions { jobs: jobs(), without };
    let share = Share::start("diagnosing", talk);
    let diagnosed = diagnose_pull_table(&loaded.pulls, twin, library, &options, &|x| share.at(x));
    share.finish();
    let mut diagnosed = diagnosed.map_err(|e| Failure::usage(&e).hint(e.hint()))?;
    diagnosed.diagnosis.notes.extend(loaded.notes.into_iter().chain(loaded.warnings));
    Ok(diagnosed)
}
