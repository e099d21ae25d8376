//! What people look at: pages with plots and pictures inside, and pictures of runs, pulls and parts.
//!
//! ```
//! use gripgen_report::{Plot, Series};
//!
//! let mut measured = Series::points("gear", [(20.0, 6.1), (40.0, 12.3)]);
//! measured.errors = vec![0.3, 0.5];
//! let expected = Series::line("gear, expected", [(20.0, 6.0), (40.0, 12.0)]);
//! let plot = Plot::new("labels", "grip force of a jaw, N", "label, N", vec![measured, expected]);
//! assert!(plot.to_svg().starts_with("<svg"));
//! ```
//!
//! A page is one HTML file that needs neither a network nor, but for `view` and `--live`, a script. This crate fits
//! nothing, opens no engine and knows no sensor: it is given what it shows.

mod axis;
mod bars;
mod comparison;
mod diagnosis;
mod histogram;
mod page;
pub mod picture;
mod plot;
mod presses;
mod svg;
mod text;
mod tried;
mod view;

pub use comparison::{ComparedPulls, pull_comparison_page};
pub use diagnosis::doubt::doubt;
pub use diagnosis::imprints::imprint_report;
pub use diagnosis::presses::{PressPlace, press_report};
pub use diagnosis::pulls::{Predictions, SimulatePull, prediction_report, pull_report};
pub use diagnosis::sensor::sensor_report;
pub use diagnosis::{EvidenceRow, ReportData, WorstRow, diagnosis_page};
pub use page::live_page;
pub use picture::grips::grips_picture;
pub use picture::sample::{JawPress, PictureSampleError, sample_picture};
pub use picture::scene::{Rasterise, View};
pub use picture::sheet::{
    CONTACT_SHEET, SheetError, contact_sheet, contact_sheet_samples, publish_contact_sheet,
};
pub use plot::{Mark, Plot, PlotGroup, Series};
pub use presses::{PressMap, PressPage, PressScores, PressShown, Score, press_page};
pub use tried::{FrictionRange, GripTried, Holding, TriedPart, WorksAt, tried_page, tried_picture};
pub use view::{ViewOptions, ViewPage, view_page};
