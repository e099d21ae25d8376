//! What was typed for the rig.

use super::{JsonArgs, TalkArgs, key_value};
use clap::{Args, Subcommand};
use std::path::PathBuf;

/// `gripgen rig`
#[derive(Debug, Subcommand)]
pub enum RigCommand {
    /// Say whether every device of a rig answers; nothing moves.
    Check(RigCheckArgs),
    /// Store where the tool is as the pose of a part.
    Teach(RigTeachArgs),
    /// Find out what the rig is like today: sensor, force mode, clocks; in air, then with a pull of 5 N.
    Rehearse(RigRehearseArgs),
    /// Make pulls on a rig and record them. Running it again makes what is missing.
    Pull(RigPullArgs),
    /// Serve a virtual rig on this machine: RTDE, dashboard, script ports, gripper and cameras, moved by a twin.
    Serve(RigServeArgs),
}

/// `gripgen rig check`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RIG_CHECK)]
pub struct RigCheckArgs {
    /// The rig.
    #[arg(value_name = "RIG.toml", default_value = "asset:configs/rig.toml")]
    pub rig: String,
    /// Override a key of the rig's file; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// What `rig rehearse` found: versions, payload and tool have to be the same.
    #[arg(long, value_name = "FILE")]
    pub rehearsal: Option<PathBuf>,
    /// Find sign and gain of the force sensor with a known mass, which is to be hung on the tool when it says so.
    #[arg(long, value_name = "KG", value_parser = mass)]
    pub mass_kg: Option<f64>,
    /// JSON.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen rig rehearse`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RIG_REHEARSE)]
pub struct RigRehearseArgs {
    /// The rig.
    #[arg(value_name = "RIG.toml", default_value = "asset:configs/rig.toml")]
    pub rig: String,
    /// Override a key of the rig's file; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Part that is pulled; the first that is taught where it is left out.
    #[arg(long, value_name = "NAME")]
    pub part: Option<String>,
    /// Grip force, of one jaw. It has to hold 5 N of pull.
    #[arg(long, value_name = "N", default_value_t = 30.0)]
    pub grip_force_n: f64,
    /// How long the zeroed sensor is read.
    #[arg(long, value_name = "S", default_value_t = 5.0)]
    pub dwell_s: f64,
    /// Where what was found is stored, for `rig check` and `rig pull`.
    #[arg(short, long, value_name = "FILE", default_value = "rehearsal.json")]
    pub out: PathBuf,
    /// JSON: the same as the file.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen rig teach`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RIG_TEACH)]
pub struct RigTeachArgs {
    /// Name of the part, as in campaigns and twins.
    pub name: String,
    /// The rig's file, which the pose is written into.
    #[arg(long, value_name = "RIG.toml", default_value = "rig.toml")]
    pub rig: PathBuf,
    /// Override a key of the rig's file; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// JSON: the pose.
    #[command(flatten)]
    pub json: JsonArgs,
}

/// `gripgen rig pull`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RIG_PULL)]
pub struct RigPullArgs {
    /// The rig.
    #[arg(value_name = "RIG.toml", default_value = "asset:configs/rig.toml")]
    pub rig: String,
    /// Override a key of the rig's file; may be given many times.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// The pulls to make, as `gripgen campaign` plans them. Without it they are those of the flags below.
    #[arg(long, value_name = "CAMPAIGN.toml")]
    pub campaign: Option<PathBuf>,
    /// What `rig rehearse` found: staircases are slowed until force mode and sensor can follow them.
    #[arg(long, value_name = "FILE")]
    pub rehearsal: Option<PathBuf>,
    /// Parts to pull; all that are taught where it is left out.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',', conflicts_with = "campaign")]
    pub parts: Vec<String>,
    /// Grip forces, of one jaw.
    #[arg(long, value_name = "N,...", value_delimiter = ',', default_values_t = [20.0], conflicts_with = "campaign")]
    pub grip_force_n: Vec<f64>,
    /// How often each is pulled.
    #[arg(long, value_name = "N", default_value_t = 1, conflicts_with = "campaign")]
    pub repetitions: usize,
    /// Seed of the order.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// A run on the same rig and gels before this one: its pulls and its clock are counted on.
    #[arg(long, value_name = "FOLDER")]
    pub after: Option<PathBuf>,
    /// Note this of every pull, for example operator=anna; may be given many times.
    #[arg(long, value_name = "NAME=VALUE", value_parser = key_value)]
    pub column: Vec<(String, String)>,
    /// Ask for these columns before each pull, for example temperature_c; an empty answer notes nothing.
    #[arg(long, value_name = "NAME,...", value_delimiter = ',')]
    pub ask: Vec<String>,
    /// Run folder; runs/<name of the campaign> where it is left out.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Only check everything against the limits; nothing is sent.
    #[arg(long)]
    pub dry_run: bool,
    /// Print the robot's program of the first pull; nothing is sent.
    #[arg(long)]
    pub print_program: bool,
    /// Somebody stands beside the robot: power on, brakes off.
    #[arg(long)]
    pub power_on: bool,
    /// Somebody has looked at the robot: leave a protective stop.
    #[arg(long)]
    pub unlock: bool,
    /// How often a fault after which the robot stands still may be answered by a new connection, between two pulls.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub reconnect: u32,
    /// Show it while it is under way on a page of this machine, --live=8080 for a port of your choice.
    #[arg(long, value_name = "PORT", num_args = 0..=1, require_equals = true, default_missing_value = "0")]
    pub live: Option<u16>,
    /// JSON: one event a line.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

fn mass(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(kg) if (0.2..=4.0).contains(&kg) => Ok(kg),
        _ => Err("a number of kilograms from 0.2 to 4 is needed, for example 1.0".into()),
    }
}

/// `gripgen rig serve`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RIG_SERVE)]
pub struct RigServeArgs {
    /// The twin that moves it; it may hold effects that nobody else knows.
    #[arg(value_name = "TWIN", default_value = gripgen::BASELINE_TWIN)]
    pub twin: String,
    /// Override a key of the twin; may be given many times. Paths are relative to where you are.
    #[arg(long, value_name = "KEY=VALUE", value_parser = key_value)]
    pub set: Vec<(String, String)>,
    /// Seed of scatter and noise.
    #[arg(long, value_name = "N", default_value_t = 0)]
    pub seed: u64,
    /// How many times faster than real time the rig's clock runs.
    #[arg(long, value_name = "FACTOR", default_value_t = 1.0, value_parser = clock_rate)]
    pub speed: f64,
    /// Let the rig's clock wait for its client: a busy machine slows the rig down, and spoils no pull.
    #[arg(long)]
    pub in_step: bool,
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
    /// Write a rig.toml for this rig: its ports, and the fixtures of its parts as taught poses.
    #[arg(long, value_name = "RIG.toml")]
    pub write_rig: Option<PathBuf>,
    /// Read faults from standard input, one per line, and let them happen: `drop rtde`, `delay gripper 0.5`, `estop`, `freeze left`.
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
