//! `gripgen calibrate sensor`: gain and offset of a force sensor.

use crate::args::CalibrateSensorArgs;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(args: &CalibrateSensorArgs) -> Result<u8, Failure> {
    let _ = args;
    Err(Failure::usage("not built yet"))
}
