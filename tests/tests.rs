//! The one integration binary of the root package.

#![expect(clippy::unwrap_used, reason = "a test that cannot go on panics")]

// The shipped files and the numbers that they are made from.
mod assets;
// The guard of the benchmarks.
mod bench_guard;
// The benchmark of two hundred parts.
mod benchmark;
// A pull, integrated by other code.
mod bristles;
// Campaigns: planned, made on a twin, written, and read as measurements.
mod campaign;
// The catalogue of effects.
mod catalogue;
// What several tests share.
mod common;
// Images of measured pulls beside those of a twin.
mod compare_images;
// The paper's panels for any measurements.
mod compare_report;
// Every configuration fault is one clear error that names its key.
mod config;
// The same bytes for any number of threads, slices, vector units, and after an interruption.
mod determinism;
// Diagnoses of pulls.
mod diagnose;
mod diagnose_awkward;
mod diagnose_lacking;
mod diagnose_model;
// Lost grips of a real robot, by rows and by events.
mod event_log;
// Files that were changed at random.
mod fuzz_inputs;
// Random parts in random grips.
mod fuzz_parts;
// Effects of the library, through the whole pipeline.
mod effects;
// Levels of randomness.
mod levels;
// Labels of a sample, and what they depend on.
mod labels;
// The elastic gel, also beside the pyramid on real presses.
mod elastic;
// Films of pulls.
mod film;
// Images by a graphics processor are those of the processor, within the tolerance.
#[cfg(feature = "gpu")]
mod gpu;
mod imprint;
// Imprints of grasps without a pull.
mod imprint_sets;
// Parts of one's own.
mod init;
// Intervals of calibrations, against a lab of its own.
mod intervals;
// What the shipped sets can teach.
mod teaches;
// Runs of other versions.
mod later_version;
// Measured pulls from every place they may be in.
mod measured;
mod missing_cells;
// Two mechanics, one result.
mod mechanics;
// Numbers that Wucherer et al. 2023 print.
mod paper;
// Predictions that fits are made with.
mod predict;
// Few pulls, and what pulls leave open.
mod posterior;
// Presses whose optics were changed, diagnosed.
mod press_diagnosis;
// Presses of a ball into a real sensor.
mod presses;
// A sensor file on another day.
mod sensor_check;
// Labels against closed forms, through the whole pipeline.
mod pull;
// What a twin simulates is what it predicts.
mod one_physics;
// Columns that gripgen does not know, in sweeps.
mod own_columns;
// Meshes that were reported.
mod reported_meshes;
// What is written is what was simulated.
mod roundtrip;
// The wrist sensor against logs of a real arm.
mod real_force;
// Runs of a rig, read by everything that reads sweeps.
mod rig_run;
// Shadows learnt from real presses.
mod shadows;
// Parts for tests, as meshes and as formulas.
mod solids;
// Labels against their own traces.
mod suspect;
// Files of Taxim.
mod taxim;
// Heights of Taxim.
mod taxim_heights;
// Taxim's own images, stage by stage.
mod taxim_stages;
// The repository itself.
mod tidy;
// Parts at a glance.
mod try_part;
// Twins that were changed.
mod twin_edits;
