//! Measured data: what people hand in, from files to checked observations.
//!
//! ```
//! use gripgen_measured::read_pull_folder;
//!
//! let folder = tempfile::tempdir()?;
//! let table = "pull_id,part,grip_force_n,max_pull_force_n\na,gear,20,5.4\nb,gear,40,10.9\n";
//! std::fs::write(folder.path().join("pulls.csv"), table)?;
//! let measured = read_pull_folder(folder.path())?;
//! assert_eq!(measured.pulls[1].max_pull_force_n, 10.9);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Four kinds of tables: pulls (`pulls.csv` with traces and images, or a run folder), presses (`presses.csv`), grasps
//! (`imprints.csv`) and a force sensor (`sensor.csv`). Readers check units and cells, keep empty cells as missing values, and
//! apply the label check of `gripgen_twin`. `docs/format.md` describes the files. This crate fits nothing.

mod campaign;
mod dataset;
mod imprint_table;
mod load;
mod press_columns;
mod press_table;
mod pulls;
mod sensor_table;
mod table;
#[cfg(test)]
mod tests;

pub use campaign::{
    CAMPAIGN_FILE, CampaignFile, CampaignFileError, CampaignHeader, campaign_toml, read_campaign,
};
pub use dataset::{OpenDatasetError, open_dataset};
pub use imprint_table::{
    IMPRINTS_FILE, ImprintTable, MeasuredImprint, read_imprint_picture, read_imprint_table,
};
pub use load::{
    BAG_HINT, ImplausibleLabels, LoadPullsError, LoadedPulls, Suspects, is_pulls, load_pulls, load_pulls_of,
    load_pulls_with,
};
pub use press_columns::{PressColumn, PressColumns, load_press_columns};
pub use press_table::{
    PRESSES_FILE, PressColumnTable, PressFolder, PressRecord, PressedBody, jpeg_presses, press_table,
    read_press_columns, read_press_folder,
};
pub use pulls::{
    JudgedPulls, MissingCells, PULLS_FILE, PullFolderError, PullImages, Standing, TRACES_FOLDER,
    pulls_with_images, read_judged_pulls, read_pull_folder, read_pull_images, write_pull_folder,
};
pub use sensor_table::{SENSOR_FILE, SensorTable, read_sensor_table};
pub use table::TableError;
