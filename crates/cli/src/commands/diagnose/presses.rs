//! Presses: what a sensor file lacks.

use crate::args::DiagnoseArgs;
use crate::commands::compare::say_circles;
use crate::failure::Failure;
use crate::progress::Share;
use gripgen::tactile::finish;
use gripgen::{
    Diagnosed, LoadPressesError, LoadSensorError, Location, PressDiagnosisInput, PressGeometry,
    diagnose_presses, find_missing_circles, is_optics_effect, load_press_columns, load_presses, load_sensor,
    load_twin_document, load_twin_sensor, presses_sha256,
};

/// Diagnoses the presses of the arguments.
pub fn presses(args: &DiagnoseArgs) -> Result<Diagnosed, Failure> {
    let sensor = match &args.sensor {
        Some(path) => load_sensor(&Location::parse(path)),
        None => load_twin_sensor(&Location::parse(&args.twin)),
    };
    let sensor = sensor.map_err(|e| match e {
        LoadSensorError::Twin(e) => Failure::from(e),
        other => Failure::usage(other).hint("`gripgen calibrate presses` writes a sensor file for --sensor"),
    })?;
    let geometry = PressGeometry { ball_m: sensor.ball_m, metres_per_px: Some(sensor.grid.metres_per_px) };
    let mut set = load_presses(&args.measured, geometry).map_err(|e| match e {
        LoadPressesError::Geometry { .. } => Failure::usage(e)
            .hint("a sensor file of `gripgen calibrate presses` holds both; name it with --sensor"),
        other => Failure::usage(other),
    })?;
    if let Some(press) = set.presses.first() {
        let (found, wanted) =
            ((press.image.width_px, press.image.height_px), (sensor.grid.width_px, sensor.grid.height_px));
        if (found.0 as usize, found.1 as usize) != wanted {
            let sizes = format!("{}x{} pixels, the sensor has {}x{}", found.0, found.1, wanted.0, wanted.1);
            return Err(Failure::usage(format!("{}: the images are {sizes}", args.measured.display()))
                .hint("name the sensor file that belongs to these presses with --sensor"));
        }
    }
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
    let diagnosed = diagnose_presses(&input, &mut |x, _| share.at(x));
    share.finish();
    let mut diagnosed = diagnosed;
    if !circles.without_contact.is_empty() {
        let names = circles.without_contact.join(", ");
        diagnosed.diagnosis.notes.push(format!("no contact is visible in {names}; left out"));
    }
    Ok(diagnosed)
}
