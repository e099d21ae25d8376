//! Presses: what a sensor file lacks.

use crate::args::DiagnoseArgs;
use crate::failure::Failure;
use crate::load::{load_sensor_and_presses, say_circles};
use crate::progress::Share;
use gripgen::tactile::finish;
use gripgen::{
    Diagnosed, Location, PressDiagnosisInput, diagnose_presses, find_missing_circles, is_optics_effect,
    load_press_columns, load_twin_document, presses_sha256,
};

/// Diagnoses the presses of the arguments.
pub fn presses(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let (sensor, mut set) = load_sensor_and_presses(&args.measured, args.sensor.as_deref(), &args.twin)?;
    let mut columns = load_press_columns(&args.measured).map_err(Failure::usage)?;
    let sha256 = presses_sha256(&set);
    let given_rest = set.rest.is_some();
    if !given_rest {
        // Contacts are looked for against it.
        set.rest = Some(finish(&sensor, None, None));
    }
    let circles = find_missing_circles(&mut set);
    say_circles(&circles, &args.talk);
    columns.leave_out(&circles.without_contact);
    if !given_rest {
        set.rest = None;
    }
    let document = load_twin_document(&Location::parse(&args.twin), &args.set)?;
    let file = document.read_twin().map_err(|e| Failure::from(document.located(e)))?;
    let input = PressDiagnosisInput {
        set: &set,
        sensor: &sensor,
        time_s: columns.time_s,
        covariates: columns.covariates,
        marked: 2 * circles.found.len() <= set.presses.len(),
        sha256,
        kept_effects: file.effects.into_iter().filter(|e| !is_optics_effect(&e.name)).collect(),
    };
    let share = Share::start("diagnosing", &args.talk);
    let mut diagnosed = diagnose_presses(&input, &mut |x, _| share.at(x));
    share.finish();
    if !circles.without_contact.is_empty() {
        let names = circles.without_contact.join(", ");
        diagnosed.diagnosis.notes.push(format!("no contact is visible in {names}; left out"));
    }
    Ok(diagnosed)
}
