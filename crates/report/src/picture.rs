//! Pictures for people: what a run, a sample or a part looks like.

mod canvas;
mod colours;
mod film;
mod layout;
mod paper;
mod plot;
mod rig;
mod sample;
mod scene;
mod sheet;

pub(crate) use canvas::{Anchor, Canvas, Rgb, TextStyle};
pub(crate) use colours::{FAILED, INK, MEASURED, PANEL, PAPER, SOFT_INK};
pub(crate) use layout::{CAPTION, HEADER, IMAGE, MARGIN, fit, frame, pixel};
pub(crate) use paper::paper_picture;
pub(crate) use plot::{Area, axes};
pub use sample::{PictureSampleError, sample_picture};
pub(crate) use scene::{Scene, SceneMesh, View};
pub use sheet::{CONTACT_SHEET, contact_sheet, contact_sheet_samples, publish_contact_sheet};
