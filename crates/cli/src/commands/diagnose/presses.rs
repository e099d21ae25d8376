//! Presses: what a sensor file lacks.

use crate::Diagnosed;
use crate::args::DiagnoseArgs;
use crate::failure::Failure;
use crate::load::{drop_doubtful_rest, load_sensor_and_presses, note_jpegs, say_circles};
use crate::progress::Share;
use crate::{diagnose_measured_presses, measured_presses};
use gripgen::{Location, load_twin_document};
use gripgen_measured::load_press_columns;

/// Diagnoses the presses of the arguments.
pub fn presses(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let (sensor, mut set) = load_sensor_and_presses(&args.measured, args.sensor.as_deref(), &args.twin)?;
    note_jpegs(&args.measured, &args.talk);
    drop_doubtful_rest(&args.measured, &mut set, &args.talk);
    let columns = load_press_columns(&args.measured).map_err(Failure::usage)?;
    let presses = measured_presses(set, columns, &sensor);
    say_circles(&presses.circles, &args.talk);
    let document = load_twin_document(&Location::parse(&args.twin), &args.set)?;
    let file = document.read_twin().map_err(|e| Failure::from(document.located(e)))?;
    let share = Share::start("diagnosing", &args.talk);
    let diagnosed = diagnose_measured_presses(&presses, &sensor, file.effects, &mut |x, _| share.at(x));
    share.finish();
    Ok(diagnosed)
}
