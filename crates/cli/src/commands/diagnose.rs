//! `gripgen diagnose`: where a twin is wrong, and why.

pub mod next;
mod notes;
mod output;
mod presses;

use crate::Diagnosed;
use crate::args::{DiagnoseArgs, TalkArgs};
use crate::commands::imprints;
use crate::failure::Failure;
use crate::load::{TwinOfPulls, folders, jobs, load_pulls_to_fit, suspects, there_is};
use crate::output::JsonSink;
use crate::outputs::Outputs;
use crate::progress::Share;
use crate::{
    Engine, PullDiagnoseOptions, diagnose_pull_table, diagnose_sensor_table, effects_of_geometry,
    is_imprint_set, is_press_set, is_sensor_table,
};
use gripgen::twin::effects::LIBRARY;
use gripgen_measured::{Suspects, read_sensor_table};
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
    let table = read_sensor_table(&args.measured).map_err(Failure::usage)?;
    Ok(diagnose_sensor_table(&table))
}

fn pulls(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let known = |id: &String| LIBRARY.iter().any(|spec| spec.id == id);
    if let Some(id) = args.without.iter().find(|id| !known(id)) {
        let ids: Vec<&str> = LIBRARY.iter().map(|spec| spec.id).collect();
        return Err(Failure::usage(format!("--without: there is no effect `{id}`"))
            .hint(format!("the effects: {}", ids.join(", "))));
    }
    let without: Vec<&str> = args.without.iter().map(String::as_str).collect();
    let twin = TwinOfPulls { path: &args.twin, sets: &args.set, rig: args.rig.as_deref() };
    let measured = folders(&args.measured, &args.also);
    diagnose_folders(&measured, &twin, (&without, args.engine), suspects(args.include_suspect), &args.talk)
}

/// Diagnoses the pulls of folders, with progress.
pub fn diagnose_folders(
    measured: &[&Path],
    twin: &TwinOfPulls<'_>,
    (without, engine): (&[&str], Engine),
    suspects: Suspects,
    talk: &TalkArgs,
) -> Result<Diagnosed, Failure> {
    let mut loaded = load_pulls_to_fit(measured, suspects, talk, true)?;
    let (twin, library, own) = twin.for_fit(&mut loaded)?;
    if !talk.quiet {
        loaded.missing.notes().for_each(|note| eprintln!("note: {note}"));
    }
    let without = [without, &effects_of_geometry(&loaded.pulls, &twin)].concat();
    let options = PullDiagnoseOptions { jobs: jobs(), without: &without, engine };
    let share = Share::start("diagnosing", talk);
    let diagnosed = diagnose_pull_table(&loaded.pulls, &twin, &library, &options, &|x| share.at(x));
    share.finish();
    let mut diagnosed = diagnosed.map_err(|e| Failure::usage(&e).hint(e.hint()))?;
    diagnosed.sets = own.sets;
    diagnosed.diagnosis.data.missing_cells = loaded.missing.counts();
    own.notes.into_iter().for_each(|note| diagnosed.diagnosis.decides(note));
    diagnosed.diagnosis.notes.extend(loaded.notes.into_iter().chain(loaded.warnings));
    Ok(diagnosed)
}
