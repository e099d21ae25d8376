//! The command line of gripgen: arguments in, exit code out.
//!
//! ```
//! let run = |words: &str| gripgen_cli::run(words.split(' ').map(Into::into));
//! assert_eq!(run("gripgen effects load_power_law"), 0);
//! assert_eq!(run("gripgen effects load_powerlaw"), 2, "usage: no such effect");
//! ```
//!
//! Standard output is data, standard error is talk. Exit codes: 0 ok, 1 failed, 2 usage or configuration, 3 the folder
//! holds another run, 4 finished but samples failed, 5 verification found a mismatch, 130 interrupted.

mod analysis;
mod args;
mod bench;
mod commands;
mod examples;
mod failure;
mod interrupt;
mod live;
mod load;
mod mesh_file;
mod output;
mod outputs;
mod part;
mod plan;
mod progress;
mod render;
pub mod rig;
mod schema;
mod shell;

use args::{CalibrateCommand, Cli, Command, RigCommand, SensorCommand};
use clap::error::{ContextKind, ContextValue};
use clap::{CommandFactory, FromArgMatches};
use std::ffi::OsString;

pub use analysis::{
    Beyond, CalibrateImprintsError, CalibratePullsError, CompareImagesError, Diagnosed, EditedValue,
    EffectCurve, Engine, FoundCircles, ImageComparison, ImageScore, ImprintCalibration, ImprintCalibrations,
    ImprintImagesError, ImprintSet, LabelErrors, LabelShares, LoadImprintsError, LoadPressesError,
    LoadSensorError, MeasuredPresses, NextPulls, OwnParts, PressCovariate, PressDiagnosisInput,
    PressGeometry, PressValues, PullComparison, PullDiagnoseOptions, SimulateCampaignError, Source,
    TwinEdits, Unvaried, WriteTwinError, beyond, calibrate_imprint_table, calibrate_imprints,
    calibrate_sensor_table, calibrate_twin, compare_images, compare_imprint_table, compare_pulls,
    compare_pulls_with, compare_sensor_table, detectable_in_campaign, diagnose_imprint_table,
    diagnose_measured_presses, diagnose_presses, diagnose_pull_table, diagnose_sensor_table, edited_twin,
    edited_twin_toml, effect_curve, effects_of_geometry, find_circles_with_sensor, find_missing_circles,
    given_model, imprint_calibration_edits, imprint_data, is_imprint_set, is_press_set, is_sensor_table,
    jaws_of_grip_force, label_shares, load_imprint_set, load_presses, load_sensor, load_twin_sensor,
    measured_presses, own_parts, posterior_twins, presses_sha256, pull_predictor, pull_priors,
    sensor_calibration_edits, shipped_priors, simulate_campaign, unmeasured, unvaried, with_few_density,
    write_twin,
};
pub use bench::{BenchError, BenchOptions, BenchRate, BenchReport, bench};
pub use failure::Failure;
pub use part::{
    BenchmarkStarter, InitError, NoGrip, PartGrips, PartOptions, PartStarter, StarterFile, TryOptions,
    TryPartError, Varied, benchmark_starter, part_starter, rasterise, starter, try_part,
};
pub use plan::{Plan, Probe, TriedGrip, plan};
pub use render::{RenderError, RenderOptions, is_height_map, render_file, render_surface};
pub use schema::{campaign_schema, rosbag_schema, sweep_schema, twin_schema};

/// Runs gripgen with the arguments of a process (the first is its name) and returns its exit code.
pub fn run(arguments: impl IntoIterator<Item = OsString>) -> u8 {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    match parsed(&arguments) {
        Ok(cli) => execute(&cli).unwrap_or_else(|failure| {
            failure.print();
            failure.exit_code()
        }),
        Err(e) => {
            // Clap prints help and versions to standard output, everything else to standard error.
            let _ = e.print();
            if let Some(hint) = key_of_a_sweep(&arguments, &e) {
                eprintln!("\nhint: {hint}");
            }
            if e.use_stderr() { 2 } else { 0 }
        }
    }
}

/// The same for a caller that shows errors itself and wants nothing on standard output. `Ok` is the exit code of work that
/// was done.
///
/// # Errors
///
/// Arguments that are wrong, or work that failed.
pub fn try_run(arguments: impl IntoIterator<Item = OsString>) -> Result<u8, Failure> {
    let arguments: Vec<OsString> = arguments.into_iter().collect();
    let cli = parsed(&arguments)
        .map_err(|e| Failure::usage(e.to_string().trim_end()).hint_if(key_of_a_sweep(&arguments, &e)))?;
    output::silently(|| execute(&cli))
}

fn parsed(arguments: &[OsString]) -> Result<Cli, clap::Error> {
    output::remember_program(arguments.first());
    let matches = with_negative_numbers(Cli::command()).try_get_matches_from(arguments)?;
    Cli::from_arg_matches(&matches)
}

/// Keys of the file of a sweep that people take for options.
const OF_SWEEPS: [&str; 10] = [
    "samples",
    "design",
    "repetitions",
    "seed",
    "mechanics",
    "backend",
    "images",
    "trace",
    "shard_samples",
    "twin",
];

/// What was meant by an option of `sweep` or `check` that is a key of their file.
fn key_of_a_sweep(arguments: &[OsString], error: &clap::Error) -> Option<String> {
    let verb = arguments.get(1).and_then(|word| word.to_str())?;
    let Some(ContextValue::String(typed)) = error.get(ContextKind::InvalidArg) else { return None };
    let key = typed.trim_start_matches('-').replace('-', "_");
    let key =
        key.split('=').next().filter(|key| ["sweep", "check"].contains(&verb) && OF_SWEEPS.contains(key))?;
    Some(format!("{key} stands in the file of the sweep; --set {key}=VALUE changes it"))
}

/// `-0.3` is a number to be refused by who reads it, and no option of that name.
fn with_negative_numbers(command: clap::Command) -> clap::Command {
    let takes = |arg: clap::Arg| match arg.get_action().takes_values() {
        true => arg.allow_negative_numbers(true),
        false => arg,
    };
    command.mut_args(takes).mut_subcommands(with_negative_numbers)
}

fn execute(cli: &Cli) -> Result<u8, Failure> {
    match &cli.command {
        Command::Init(args) => commands::init::run(args),
        Command::Try(args) => commands::try_part::run(args),
        Command::Check(args) => commands::check::run(args),
        Command::Sweep(args) => commands::sweep::run(args),
        Command::Info(args) => commands::info::run(args),
        Command::Verify(args) => commands::verify::run(args),
        Command::Show(args) => commands::show::run(args),
        Command::View(args) => commands::view::run(args),
        Command::Export(args) => commands::export::run(args),
        Command::Import(_) => {
            let said = "`gripgen import` is in the Python package, which reads bags of ROS";
            Err(Failure::usage(said).hint(gripgen_measured::BAG_HINT))
        }
        Command::Calibrate(CalibrateCommand::Presses(args)) => commands::calibrate_presses::run(args),
        Command::Calibrate(CalibrateCommand::Pulls(args)) => commands::calibrate_pulls::run(args),
        Command::Calibrate(CalibrateCommand::Imprints(args)) => commands::calibrate_imprints::run(args),
        Command::Calibrate(CalibrateCommand::Sensor(args)) => commands::calibrate_sensor::run(args),
        Command::Rig(RigCommand::Check(args)) => commands::rig::check::run(args),
        Command::Rig(RigCommand::Pull(args)) => commands::rig::pull::run(args),
        Command::Rig(RigCommand::Rehearse(args)) => commands::rig::rehearse::run(args),
        Command::Rig(RigCommand::Teach(args)) => commands::rig::teach::run(args),
        Command::Rig(RigCommand::Serve(args)) => commands::rig::serve::run(args),
        Command::Compare(args) => commands::compare::run(args),
        Command::Diagnose(args) => commands::diagnose::run(args),
        Command::Sensor(SensorCommand::Check(args)) => commands::sensor_check::run(args),
        Command::Render(args) => commands::render::run(args),
        Command::Effects(args) => commands::effects::run(args),
        Command::Campaign(args) => commands::campaign::run(args),
        Command::Bench(args) => commands::bench::run(args),
        Command::Schema(args) => commands::schema::run(args),
        Command::Completions(args) => commands::schema::completions(args),
    }
}
