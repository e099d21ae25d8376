//! Presses as somebody measured them, from what was read to the answer.

use super::diagnosed::Diagnosed;
use super::presses::{PressDiagnosisInput, diagnose_presses};
use crate::analysis::presses::{FoundCircles, find_circles_with_sensor, presses_sha256};
use gripgen_identify::PressCovariate;
use gripgen_measured::PressColumns;
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::PressSet;
use gripgen_twin::config::EffectFile;
use gripgen_twin::effects::find;

/// Presses whose contacts are all known.
#[derive(Debug, Clone, PartialEq)]
pub struct MeasuredPresses {
    /// The presses that show a contact.
    pub set: PressSet,
    /// Their circumstances.
    pub columns: PressColumns,
    /// Contacts that were looked for, and presses that were left out.
    pub circles: FoundCircles,
    /// Whether the contacts of half of the presses at least were marked.
    pub marked: bool,
    /// Hash of all presses with their marks, as they were read.
    pub sha256: String,
}

/// Looks for the contacts that nobody marked; presses without a visible one are left out, with their rows of the table.
pub fn measured_presses(mut set: PressSet, mut columns: PressColumns, sensor: &Sensor) -> MeasuredPresses {
    let sha256 = presses_sha256(&set);
    let circles = find_circles_with_sensor(&mut set, sensor);
    columns.leave_out(&circles.without_contact);
    let marked = 2 * circles.found.len() <= set.presses.len();
    MeasuredPresses { set, columns, circles, marked, sha256 }
}

/// Diagnoses measured presses. `twin_effects`: effects of the twin; those of the optics give way to what is found. `progress`
/// hears how far it is, from 0 to 1, and what is tried.
pub fn diagnose_measured_presses(
    presses: &MeasuredPresses,
    sensor: &Sensor,
    twin_effects: Vec<EffectFile>,
    progress: &mut dyn FnMut(f64, &str),
) -> Diagnosed {
    let is_optics = |name: &str| find(name).is_some_and(|spec| spec.optics.is_some());
    let columns = presses.columns.covariates.iter();
    let input = PressDiagnosisInput {
        set: &presses.set,
        sensor,
        time_s: presses.columns.time_s.clone(),
        covariates: columns
            .map(|c| PressCovariate { name: c.name.clone(), values: c.values.clone() })
            .collect(),
        marked: presses.marked,
        sha256: presses.sha256.clone(),
        kept_effects: twin_effects.into_iter().filter(|e| !is_optics(&e.name)).collect(),
    };
    let mut diagnosed = diagnose_presses(&input, progress);
    if !presses.circles.without_contact.is_empty() {
        let names = presses.circles.without_contact.join(", ");
        diagnosed.diagnosis.notes.push(format!("no contact is visible in {names}; left out"));
    }
    diagnosed
}
