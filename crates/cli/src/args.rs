//! What was typed.

mod identify;
mod part;
mod rig;
mod sensor;
mod values;

use clap::{Args, Parser, Subcommand, ValueEnum};
use gripgen::twin::config::Backend;
pub use identify::{
    CalibrateImprintsArgs, CalibratePullsArgs, CalibrateSensorArgs, CampaignArgs, ConstantOf, DiagnoseArgs,
};
pub use part::{InitArgs, RenderArgs, TryArgs};
pub use rig::{RigCheckArgs, RigCommand, RigPullArgs, RigRehearseArgs, RigServeArgs, RigTeachArgs};
pub use sensor::{SensorCheckArgs, SensorCommand};
use std::path::PathBuf;
use values::{key_value, seconds, slice};

/// A digital twin of grip, pull and slip: tactile images, force traces and slip labels, as many as you like.
#[derive(Debug, Parser)]
#[command(name = "gripgen", version, max_term_width = 100, arg_required_else_help = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// The verbs.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Write a commented sweep and twin to start from, or those for a part of your own.
    Init(InitArgs),
    /// Show what becomes of a part: grips that work, what the gels see, what it holds, what would fail.
    Try(TryArgs),
    /// Check a sweep, try out a few samples, and say what it will take.
    Check(CheckArgs),
    /// Run a sweep. Running it again continues where it stopped.
    Sweep(SweepArgs),
    /// Say what a run folder holds.
    Info(InfoArgs),
    /// Read a whole run folder and compare it with its checksums.
    Verify(VerifyArgs),
    /// Draw samples of a run: images, height, pressure and the pull curve.
    Show(ShowArgs),
    /// Show a run, measured pulls or a shard on one page: pictures, distributions, curves, what is strange.
    View(ViewArgs),
    /// Write a run in another format (Parquet, WebDataset, LeRobot), or one sample as a file of its own with every reading.
    Export(ExportArgs),
    /// Make a folder of measured pulls of ROS bags; with the Python package.
    Import(ImportArgs),
    /// Fit a sensor file to measurements.
    #[command(subcommand)]
    Calibrate(CalibrateCommand),
    /// Say how far a twin or a sensor file is from measurements.
    Compare(CompareArgs),
    /// Check a sensor file on another day.
    #[command(subcommand)]
    Sensor(SensorCommand),
    /// Find out where a twin is wrong, and why: pulls, force-sensor tables, presses.
    Diagnose(DiagnoseArgs),
    /// Draw what a sensor sees of a mesh that is pressed in.
    Render(RenderArgs),
    /// List what a twin may be missing, or explain one effect: formula, source, what it does, what to do about it.
    Effects(EffectsArgs),
    /// Plan the pulls of a campaign.
    Campaign(CampaignArgs),
    /// The experiment on a robot, and a virtual one that speaks the same protocols.
    #[command(subcommand)]
    Rig(RigCommand),
    /// Measure how many tactile images per second this machine makes.
    Bench(BenchArgs),
    /// Print the JSON Schema of a configuration file.
    Schema(SchemaArgs),
    /// Print shell completions.
    Completions(CompletionsArgs),
}

/// Flags of commands that read a configuration.
#[derive(Debug, Args)]
pub struct ConfigArgs {
    /// The sweep configuration (a TOML file, or `asset:configs/quickstart.toml`).
    pub config: String,
    /// Override a key of the sweep or of its twin; may be given many times. Paths are relative to where you are.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
}

/// Flags of commands that write: files, or JSON.
#[derive(Debug, Args)]
pub struct JsonArgs {
    /// Print JSON to standard output, or to FILE.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub json: Option<String>,
    /// Replace output files that exist. Inputs and a run's own files are never replaced.
    #[arg(long)]
    pub force: bool,
}

/// How much is said on standard error.
#[derive(Debug, Args)]
pub struct TalkArgs {
    /// Say nothing but errors.
    #[arg(short, long)]
    pub quiet: bool,
    /// Say more.
    #[arg(short, long, conflicts_with = "quiet")]
    pub verbose: bool,
}

/// `gripgen check`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CHECK)]
pub struct CheckArgs {
    /// What to check.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// JSON.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen sweep`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::SWEEP)]
pub struct SweepArgs {
    /// What to run.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Run folder; runs/<name of the configuration> where it is left out.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Worker threads; one per processor where it is left out.
    #[arg(short, long, value_name = "N")]
    pub jobs: Option<usize>,
    /// Make only piece I of N, for job arrays. I counts from 0, or from 1.
    #[arg(long, value_name = "I/N", value_parser = slice)]
    pub slice: Option<(u64, u64)>,
    /// Only check, like `gripgen check`.
    #[arg(long)]
    pub dry_run: bool,
    /// Make samples though the twin depends on a column that `[vary]` leaves at one value.
    #[arg(long)]
    pub allow_constant: bool,
    /// Show it while it is under way on a page of this machine, --live=8080 for a port of your choice.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub live: Option<u16>,
    /// JSON: one event a line.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
    /// Vector unit of the image pipeline, to compare them; the result is the same.
    #[arg(long, value_name = "portable|avx2", hide = true)]
    pub simd: Option<String>,
}

/// `gripgen info`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::INFO)]
pub struct InfoArgs {
    /// A run folder, or a folder with pulls.csv.
    pub run: PathBuf,
    /// JSON.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen verify`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::VERIFY)]
pub struct VerifyArgs {
    /// A run folder.
    pub run: PathBuf,
    /// Remove what is broken, so that the sweep makes it again. Measured pulls are never removed.
    #[arg(long)]
    pub repair: bool,
    /// JSON.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen show`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::SHOW)]
pub struct ShowArgs {
    /// A run folder.
    pub run: PathBuf,
    /// A sample; an overview of the run where it is left out.
    pub sample: Option<u64>,
    /// The picture; in the run folder where it is left out.
    #[arg(short, long, value_name = "FILE.png")]
    pub out: Option<PathBuf>,
    /// JSON: the picture's path, and what the sample is.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen view`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::VIEW)]
pub struct ViewArgs {
    /// A run folder, a folder with pulls.csv, or a shard (.mcap).
    pub data: PathBuf,
    /// Pulls that are shown with images and curves; of more, the strangest, those that failed, and the others evenly.
    #[arg(long, value_name = "N", default_value_t = 96, value_parser = clap::value_parser!(u32).range(1..=2000))]
    pub pulls: u32,
    /// The page to write; view.html in the folder, or beside the shard, where it is left out.
    #[arg(short, long, value_name = "PAGE.html")]
    pub out: Option<PathBuf>,
    /// JSON: the page and how much of the data it shows.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen export`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::EXPORT)]
pub struct ExportArgs {
    /// A run folder; for --to also a folder of measured pulls, or a shard.
    pub run: PathBuf,
    /// One sample as an MCAP file with every reading.
    #[arg(long, value_name = "K", required_unless_present = "to")]
    pub sample: Option<u64>,
    /// All samples in another format: table, images as PNG, traces.
    #[arg(long, value_enum, value_name = "FORMAT", conflicts_with = "sample")]
    pub to: Option<ExportFormat>,
    /// Without images.
    #[arg(long, requires = "to")]
    pub no_images: bool,
    /// Without traces.
    #[arg(long, requires = "to")]
    pub no_traces: bool,
    /// The file to write; of lerobot a new folder.
    #[arg(short, long, value_name = "FILE")]
    pub out: PathBuf,
    /// JSON: the file's path and size.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// Formats of `gripgen export --to`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ExportFormat {
    /// One Apache Parquet file.
    Parquet,
    /// A folder in the LeRobot format 3.0: an episode for each pull, images as PNG.
    Lerobot,
    /// A tar file for WebDataset, or with a number in its name (`train-%05d.tar`) one for each thousand rows.
    Webdataset,
}

/// `gripgen import`: the Python package has its arguments.
#[derive(Debug, Args)]
#[command(after_help = crate::examples::IMPORT)]
pub struct ImportArgs {
    /// A bag, a folder with rosbag.toml, or that file; the folder to write behind -o.
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    pub arguments: Vec<std::ffi::OsString>,
}

/// `gripgen calibrate`
#[derive(Debug, Subcommand)]
pub enum CalibrateCommand {
    /// Fit colours, rest frame, noise and gel shape of a tactile sensor to presses of a ball.
    Presses(CalibratePressesArgs),
    /// Fit friction, lag, stiffness and noise of a twin to measured pulls.
    Pulls(CalibratePullsArgs),
    /// Fit gain and offset of a force sensor to a table beside a reference.
    Sensor(CalibrateSensorArgs),
    /// Fit the imprint constant of each part to grasps beside the normal force of the jaw.
    Imprints(CalibrateImprintsArgs),
}

/// `gripgen calibrate presses`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::CALIBRATE_PRESSES)]
pub struct CalibratePressesArgs {
    /// Taxim's dataPack.npz, or a folder with presses.csv and images.
    pub presses: PathBuf,
    /// Diameter of the ball; 4.0 for a dataPack.npz.
    #[arg(long, value_name = "MM")]
    pub ball_mm: Option<f64>,
    /// Side of a pixel on the gel; 0.0295 for a dataPack.npz.
    #[arg(long, value_name = "MM")]
    pub mm_per_px: Option<f64>,
    /// The sensor file to write.
    #[arg(short, long, value_name = "FILE.npz")]
    pub out: PathBuf,
    /// The report; beside the sensor file where it is left out.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// JSON: what was fitted, and the error on held-out presses.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen compare`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::COMPARE)]
pub struct CompareArgs {
    /// Pulls: a run folder, or a folder with pulls.csv; images that they have are compared too. Presses: Taxim's dataPack.npz, or
    /// a folder with presses.csv and images. A force-sensor table: a folder with sensor.csv. Imprints: a folder with imprints.csv.
    pub measured: PathBuf,
    /// Of pulls: a folder that was measured later on the same rig; may be given many times.
    #[arg(long, value_name = "FOLDER")]
    pub also: Vec<PathBuf>,
    /// Of pulls: take those whose label is suspect too: evidence that was recorded contradicts it.
    #[arg(long)]
    pub include_suspect: bool,
    /// Of presses, and of imprints with images: a sensor file.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: Option<String>,
    /// A twin; its left sensor is taken where --sensor is left out.
    #[arg(long, value_name = "FILE.toml", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Write a page: of pulls mean and RMS over grip force, a pull profile and the ratio to what is predicted with its fit; of presses
    /// the error of each and pictures of the worst.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// JSON: the errors.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen effects`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::EFFECTS)]
pub struct EffectsArgs {
    /// An effect; all of them in a list where it is left out.
    pub id: Option<String>,
    /// Draw what it does to the label, the measured force at slip.
    #[arg(long, value_name = "FILE.svg", requires = "id")]
    pub plot: Option<PathBuf>,
    /// JSON: everything that is known of the effect, or of each.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Where tactile images are made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum BackendKind {
    /// The processor.
    Cpu,
    /// A graphics processor.
    Gpu,
}

impl From<BackendKind> for Backend {
    fn from(kind: BackendKind) -> Self {
        match kind {
            BackendKind::Cpu => Backend::Cpu,
            BackendKind::Gpu => Backend::Gpu,
        }
    }
}

/// `gripgen bench`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::BENCH)]
pub struct BenchArgs {
    /// Where images are made.
    #[arg(long, value_name = "cpu|gpu", default_value = "cpu")]
    pub backend: BackendKind,
    /// Part of the name of the graphics adapter; the first graphics processor where it is left out.
    #[arg(long, value_name = "NAME")]
    pub adapter: Option<String>,
    /// A sensor file, for example a calibrated one; the shipped sensor where it is left out.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: Option<PathBuf>,
    /// Shortest time of each measurement.
    #[arg(long, value_name = "S", default_value_t = 2.0, value_parser = seconds)]
    pub seconds: f64,
    /// JSON: the adapter and the rates.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// Which configuration file.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum SchemaKind {
    /// sweep.toml
    Sweep,
    /// twin.toml
    Twin,
    /// rig.toml
    Rig,
    /// campaign.toml
    Campaign,
    /// rosbag.toml
    Rosbag,
}

/// `gripgen schema`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::SCHEMA)]
pub struct SchemaArgs {
    /// Which file.
    #[arg(default_value = "sweep")]
    pub kind: SchemaKind,
}

/// `gripgen completions`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::COMPLETIONS)]
pub struct CompletionsArgs {
    /// Which shell.
    pub shell: clap_complete::Shell,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
