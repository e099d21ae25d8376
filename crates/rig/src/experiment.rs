//! The experiment: go to a part, zero, grip, look, pull until the jaws slip, let go, come back.
//!
//! ```text
//! rig.toml, campaign --check--> plan --connect--> rest images, program, zero --grip--> images --go--> staircase on the robot
//!                                                                                                   |
//!      ExecutedPull <-- release, retract <-- reason, still? <-------------- slip, limit, or safe stop
//! ```
//!
//! Safety comes first. Every number is checked before anything moves; the robot's program has the same limits again and is
//! watched by a heartbeat that only an experiment which is alive keeps up; and whatever goes wrong ends in [`stop`], the one
//! way to stop.

mod campaign;
pub mod check;
mod clock;
pub mod config;
pub mod devices;
mod event;
mod executed;
pub mod fault;
pub mod film;
mod gripper;
mod images;
pub mod plan;
pub mod prepare;
pub mod pull;
pub mod rehearse;
pub mod response;
mod rest;
mod robot;
mod run;
pub mod slowing;
pub mod stop;
mod zero;

pub use campaign::{Ask, CampaignError, CampaignPlan, run_campaign};
pub use config::{RigConfig, rig_schema};
pub use devices::Devices;
pub use event::{ExecutedPull, PullOutcome, RigEvent, Stopped};
pub use fault::Fault;
pub use plan::{PlanError, check_campaign};
pub use rehearse::{RehearsalPlan, RehearseError, rehearse};
pub use robot::RobotRow;
pub use run::Experiment;
