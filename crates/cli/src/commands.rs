//! One file a verb.

pub mod bench;
pub mod calibrate_imprints;
pub mod calibrate_presses;
pub mod calibrate_pulls;
pub mod calibrate_sensor;
pub mod campaign;
pub mod check;
pub mod compare;
pub mod diagnose;
pub mod effects;
pub mod export;
pub mod imprints;
pub mod info;
pub mod init;
pub mod render;
pub mod rig;
pub mod schema;
pub mod sensor_check;
pub mod show;
pub mod sweep;
pub mod try_part;
pub mod verify;
pub mod view;

use gripgen::record::{RIG_SOURCE, RunFolder};

/// What makes the shards of a run.
fn maker(folder: &RunFolder) -> &'static str {
    if folder.info().source == RIG_SOURCE { "campaign" } else { "sweep" }
}
