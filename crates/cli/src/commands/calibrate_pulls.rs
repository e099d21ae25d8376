//! `gripgen calibrate pulls`: fit a twin to measured pulls.

use crate::args::CalibratePullsArgs;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(args: &CalibratePullsArgs) -> Result<u8, Failure> {
    let _ = args;
    Err(Failure::usage("not built yet"))
}
