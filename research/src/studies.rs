//! One file per study.

mod coverage;
mod few_pulls;
mod few_pulls_ranks;
mod few_pulls_reference;
mod images_and_labels;
mod loop_force_sensor;
mod loop_imprints;
mod loop_presses;
mod loop_rock;
mod paper;
mod press_cases;
mod press_errors;
mod press_pictures;

use crate::StudyResult;

/// A study, as it is run.
type Study = fn() -> StudyResult;

/// Every study by the name of its file.
pub const ALL: [(&str, Study); 13] = [
    ("coverage", coverage::run),
    ("few-pulls", few_pulls::run),
    ("few-pulls-ranks", few_pulls_ranks::run),
    ("few-pulls-reference", few_pulls_reference::run),
    ("images-and-labels", images_and_labels::run),
    ("loop-force-sensor", loop_force_sensor::run),
    ("loop-imprints", loop_imprints::run),
    ("loop-presses", loop_presses::run),
    ("loop-rock", loop_rock::run),
    ("paper", paper::run),
    ("press-cases", press_cases::run),
    ("press-errors", press_errors::run),
    ("press-pictures", press_pictures::run),
];
