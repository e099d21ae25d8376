//! What was typed for the rig.

use super::{JsonArgs, TalkArgs, key_value};
use clap::{Args, Subcommand};

/// `gripgen rig`
#[derive(Debug, Subcommand)]
pub enum RigCommand {
    /// Serve a virtual rig on this machine: RTDE, dashboard, script ports, gripper and cameras, moved by a twin.
    Serve(RigServeArgs),
}

/// `gripgen rig serve`
#[derive(Debug, Args)]
pub struct RigServeArgs {
    /// The twin that moves it; it may hold effects that nobody else knows.
    #[arg(value_name = "TWIN", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Override a key of the twin; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Seed of scatter and noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// How many times faster than real time the rig's clock runs.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = clock_rate)]
    pub speed: f64,
    /// Begin with the tool at the fixture of this part, instead of above the first.
    #[arg(long, value_name = "PART")]
    pub at: Option<String>,
    /// Let the system choose every port that is not named here.
    #[arg(long)]
    pub any_ports: bool,
    /// Port of RTDE; 30004 where it is left out.
    #[arg(long, value_name = "PORT")]
    pub rtde_port: Option<u16>,
    /// Port of the dashboard; 29999.
    #[arg(long, value_name = "PORT")]
    pub dashboard_port: Option<u16>,
    /// Port of the primary interface; 30001.
    #[arg(long, value_name = "PORT")]
    pub primary_port: Option<u16>,
    /// Port of the secondary interface; 30002.
    #[arg(long, value_name = "PORT")]
    pub secondary_port: Option<u16>,
    /// Port of the real-time interface; 30003.
    #[arg(long, value_name = "PORT")]
    pub real_time_port: Option<u16>,
    /// Port of the gripper's text interface; 31000.
    #[arg(long, value_name = "PORT")]
    pub gripper_port: Option<u16>,
    /// Port of the camera behind the left gel; 38080.
    #[arg(long, value_name = "PORT")]
    pub camera_left_port: Option<u16>,
    /// Port of the camera behind the right gel; 38081.
    #[arg(long, value_name = "PORT")]
    pub camera_right_port: Option<u16>,
    #[arg(long, value_name = "FILE.toml")]
    /// Read faults from standard input, one a line, and let them happen: `drop rtde`, `delay gripper 0.5`, `estop`, `freeze left`.
    #[arg(long)]
    pub faults: bool,
    /// JSON: the `ready` line.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

fn clock_rate(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(rate) if (0.01..=200.0).contains(&rate) => Ok(rate),
        _ => Err("a number from 0.01 to 200 is needed; 1 is real time".into()),
    }
}
