//! What was typed for the verbs that close the loop.

use super::{JsonArgs, TalkArgs, key_value};
use crate::Engine;
use clap::{Args, ValueEnum};
use std::path::PathBuf;

/// `gripgen calibrate pulls`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CALIBRATE_PULLS)]
pub struct CalibratePullsArgs {
    /// A folder with pulls.csv, or a run folder.
    pub measured: PathBuf,
    /// Of pulls: a folder that was measured later on the same rig; may be given many times.
    #[arg(long, value_name = "FOLDER")]
    pub also: Vec<PathBuf>,
    /// Of pulls: take those whose label is suspect too: evidence that was recorded contradicts it.
    #[arg(long)]
    pub include_suspect: bool,
    /// The twin to start from.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Override a key of the twin; may be given many times. Paths are relative to where you are.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// A friction law to fit to each part: `offset` is mu (a + b / F_G).
    #[arg(long, value_name = "offset")]
    pub law: Option<LawKind>,
    /// Effects to fit beside the baseline, by name.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    pub fit: Vec<String>,
    /// The twin to write.
    #[arg(short, long, value_name = "FILE.toml")]
    pub out: PathBuf,
    /// JSON: what was fitted.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Friction laws of `calibrate pulls`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum LawKind {
    /// mu (a + b / F_G), of Wucherer et al. 2023.
    Offset,
}

/// `gripgen calibrate sensor`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CALIBRATE_SENSOR)]
pub struct CalibrateSensorArgs {
    /// A folder with sensor.csv.
    pub measured: PathBuf,
    /// The twin to start from.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// The twin to write.
    #[arg(short, long, value_name = "FILE.toml")]
    pub out: Option<PathBuf>,
    /// JSON: gain and offset of each session.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen calibrate imprints`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CALIBRATE_IMPRINTS)]
pub struct CalibrateImprintsArgs {
    /// A folder with imprints.csv.
    pub measured: PathBuf,
    /// Of rows with an image: the sensor file through which volumes are read.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: Option<String>,
    /// What has a constant of its own; that of a part is then the mean over its grasps.
    #[arg(long, value_name = "WHAT", default_value = "grasp")]
    pub constant: ConstantOf,
    /// The part of rows that name none.
    #[arg(long, value_name = "PART")]
    pub part: Option<String>,
    /// The twin to start from.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// The twin to write.
    #[arg(short, long, value_name = "FILE.toml")]
    pub out: Option<PathBuf>,
    /// JSON: the constants of parts and grasps.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// What has an imprint constant of its own.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ConstantOf {
    /// Each grasp.
    Grasp,
    /// Each part: all its rows have one constant.
    Part,
}

/// `gripgen diagnose`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::DIAGNOSE)]
pub struct DiagnoseArgs {
    /// A folder with pulls.csv, sensor.csv, presses.csv or imprints.csv, a run folder, or a dataPack.npz.
    pub measured: PathBuf,
    /// Of pulls: a folder that was measured later on the same rig; may be given many times.
    #[arg(long, value_name = "FOLDER")]
    pub also: Vec<PathBuf>,
    /// Of pulls: take those whose label is suspect too: evidence that was recorded contradicts it.
    #[arg(long)]
    pub include_suspect: bool,
    /// The twin to start from.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Override a key of the twin; may be given many times. Paths are relative to where you are.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Plan only what this rig's gripper can do (the rig.toml of `gripgen rig pull`).
    #[arg(long, value_name = "RIG.toml")]
    pub rig: Option<String>,
    /// Of presses: a sensor file in place of the twin's. Of imprints with images: the sensor file through which volumes are read.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: Option<String>,
    /// Of pulls: effects that must not be named, because something else is known to rule them out.
    #[arg(long, value_name = "EFFECT,...", value_delimiter = ',')]
    pub without: Vec<String>,
    /// Of pulls: how causes are found. `search` lets effects compete; `model` is one Gaussian model of the labels; `auto` takes the answer of
    /// the search unless the model predicts held-out pulls better.
    #[arg(long, value_enum, default_value_t = Engine::Auto)]
    pub engine: Engine,
    /// The twin to write, with the effects that were found.
    #[arg(short, long, value_name = "FILE.toml")]
    pub out: Option<PathBuf>,
    /// The report.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// JSON: the diagnosis.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen campaign`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CAMPAIGN)]
pub struct CampaignArgs {
    /// The twin.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Override a key of the twin; may be given many times. Paths are relative to where you are.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Plan only what this rig's gripper can do (the rig.toml of `gripgen rig pull`); the shipped rig where this is left
    /// out, 40 N per jaw.
    #[arg(long, value_name = "RIG.toml")]
    pub rig: Option<String>,
    /// Parts to pull; all of the twin where this is left out.
    #[arg(long, value_name = "PART,...", value_delimiter = ',')]
    pub parts: Vec<String>,
    /// Pulls to make.
    #[arg(long, value_name = "N", default_value_t = 120)]
    pub pulls: usize,
    /// Sessions, with pauses between them.
    #[arg(long, value_name = "N", default_value_t = 3)]
    pub sessions: usize,
    /// Grip angles to use.
    #[arg(
        long,
        value_name = "DEG,...",
        value_delimiter = ',',
        default_value = "0",
        allow_negative_numbers = true
    )]
    pub angles_deg: Vec<f64>,
    /// Grip offsets to use.
    #[arg(
        long,
        value_name = "MM,...",
        value_delimiter = ',',
        default_value = "0",
        allow_negative_numbers = true
    )]
    pub offsets_mm: Vec<f64>,
    /// Instead of a first campaign: the pulls that best tell apart, per minute, what a diagnosis of these measurements
    /// leaves tied.
    #[arg(
        long,
        value_name = "MEASURED",
        conflicts_with_all = ["parts", "pulls", "sessions", "angles_deg", "offsets_mm"]
    )]
    pub separate: Option<PathBuf>,
    /// Also make the campaign on the twin, into this folder of measurements.
    #[arg(long, value_name = "FOLDER")]
    pub simulate: Option<PathBuf>,
    /// Also write the pulls as a table to print and fill in by hand; once its empty cells are filled it is a pulls.csv.
    #[arg(long, value_name = "FILE.csv")]
    pub csv: Option<PathBuf>,
    /// Seed of the order.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub seed: u64,
    /// The campaign to write.
    #[arg(short, long, value_name = "FILE.toml", default_value = "campaign.toml")]
    pub out: PathBuf,
    /// JSON: what was planned.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}
