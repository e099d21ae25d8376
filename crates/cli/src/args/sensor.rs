//! What was typed after `gripgen sensor`.

use super::{JsonArgs, TalkArgs};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `gripgen sensor`
#[derive(Debug, Subcommand)]
pub enum SensorCommand {
    /// Say by a few presses of today what has changed since a sensor file was made: light, gel, scale, ball, force or nothing.
    Check(SensorCheckArgs),
}

/// `gripgen sensor check`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::SENSOR_CHECK)]
pub struct SensorCheckArgs {
    /// The sensor file.
    pub sensor: String,
    /// Presses of a ball on another day: a folder with presses.csv and images, or Taxim's dataPack.npz. Five are enough.
    pub presses: PathBuf,
    /// Diameter of the ball of these presses; that of the sensor file where it is left out.
    #[arg(long, value_name = "MM")]
    pub ball_mm: Option<f64>,
    /// The sensor file for that day to write.
    #[arg(short, long, value_name = "FILE.npz")]
    pub out: Option<PathBuf>,
    /// Write a page: what was found, the error of each press, and where on the gel it lies.
    #[arg(long, value_name = "FILE.html")]
    pub report: Option<PathBuf>,
    /// JSON: what changed, with its numbers, ties and doubts, and what it costs.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}
