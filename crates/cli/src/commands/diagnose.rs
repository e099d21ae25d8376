//! `gripgen diagnose`: where a twin is wrong, and why.

use crate::args::DiagnoseArgs;
use crate::failure::Failure;
use gripgen::is_press_set;

/// Runs the verb.
pub fn run(args: &DiagnoseArgs) -> Result<u8, Failure> {
    if !args.measured.exists() {
        return Err(Failure::usage(format!("{}: there is no such file or folder", args.measured.display())));
    }
    if is_press_set(&args.measured) {
        return Err(Failure::usage("presses: not built yet"));
    }
    if args.measured.join("sensor.csv").is_file() {
        return Err(Failure::usage("force-sensor tables: not built yet"));
    }
    Err(Failure::usage("pulls: not built yet"))
}
