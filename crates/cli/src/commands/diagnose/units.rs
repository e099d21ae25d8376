//! Forces that are in another unit.

use gripgen::identify::{Diagnosis, Verdict};

/// Whether the data cannot answer because their forces look as if they were not in newtons: a note asks for the unit.
pub fn asks_for_newtons(diagnosis: &Diagnosis) -> bool {
    let asks = |note: &String| note.contains("newton") && note.ends_with('?');
    diagnosis.verdict == Verdict::Insufficient && diagnosis.notes.iter().any(asks)
}
