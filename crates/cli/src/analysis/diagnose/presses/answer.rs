//! Remarks on how presses were recorded, and what the answer changes in the twin.

use super::work::{Work, optics_at};
use super::{ASSUMED_PRESS_S, PressDiagnosisInput};
use crate::analysis::twin_edits::{TwinEdits, effect_entry, put_estimate};
use gripgen_identify::{ActingEffect, Diagnosis};

/// Says before the other notes what was not recorded, and how the marks and the frame without contact fit; `scatter_px`:
/// how far circles were moved before anything was fitted, centres and radii, where there are any.
pub(super) fn remark(
    diagnosis: &mut Diagnosis,
    input: &PressDiagnosisInput<'_>,
    work: &Work<'_>,
    acting: &[ActingEffect],
    scatter_px: Option<[f64; 2]>,
) {
    let mut notes = Vec::new();
    if input.time_s.is_none() {
        diagnosis.not_recorded.push("time_s".into());
        notes.push(format!(
            "no column `time_s`: the order of the presses is their clock, {ASSUMED_PRESS_S} s from one to the next"
        ));
    }
    if let Some([centre, radius]) = scatter_px {
        notes.push(format!(
            "the marks scatter by {centre:.1} px in the centre and {radius:.1} px in the radius; fits are on straightened ones, errors on the marks as they are"
        ));
    }
    if !input.marked {
        diagnosis.not_recorded.extend(["x_px".into(), "y_px".into()]);
        notes.push(
            "the contacts were looked for in the images, so nothing is said of where they should have been"
                .into(),
        );
    }
    if input.set.rest.is_none() {
        diagnosis.not_recorded.push("rest.png".into());
    }
    if let (Some(before), Some(after)) =
        (rest_difference(input, work, &[]), rest_difference(input, work, acting))
    {
        let levels = |d: [f64; 3]| d.map(|v| format!("{v:.1}")).join(", ");
        notes.push(format!(
            "the frame without contact of the set differs from the sensor file's by {} grey levels (red, green, blue) on average, under the effects that were found by {}",
            levels(before),
            levels(after)
        ));
    }
    diagnosis.notes.splice(0..0, notes);
}

/// The optics effects of the new twin.
pub(super) fn edits(input: &PressDiagnosisInput<'_>, diagnosis: &Diagnosis) -> TwinEdits {
    let evidence = format!("diagnosed from {} presses", input.set.presses.len());
    let mut effects = input.kept_effects.clone();
    for named in &diagnosis.effects {
        let mut entry = effect_entry(&named.name, "gripgen diagnose, presses");
        for (name, estimate) in &named.parameters {
            put_estimate(&mut entry, name, estimate, &evidence, &input.sha256);
        }
        effects.push(entry);
    }
    TwinEdits { values: Vec::new(), effects: Some(effects) }
}

/// The frame without contact of the set against that of the sensor file under some effects at the start: mean
/// difference of each channel.
fn rest_difference(
    input: &PressDiagnosisInput<'_>,
    work: &Work<'_>,
    acting: &[ActingEffect],
) -> Option<[f64; 3]> {
    let rest = input.set.rest.as_ref()?;
    let optics = optics_at(&Default::default(), acting);
    let change = work.full.change_seen(None, &optics);
    let n = change[0].values.len() as f64;
    Some([0, 1, 2].map(|c| {
        let seen = input.sensor.rest[c].iter().zip(&change[c].values).map(|(r, d)| f64::from(r + d));
        let measured = rest.rgb.iter().skip(c).step_by(3).map(|&v| f64::from(v));
        measured.zip(seen).map(|(m, s)| m - s).sum::<f64>() / n
    }))
}
