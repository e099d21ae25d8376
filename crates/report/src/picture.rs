//! Pictures for people: what a run, a sample or a part looks like.

mod canvas;
mod colours;
mod film;
mod layout;
mod plot;
mod rig;
mod sample;
mod scene;
mod sheet;

pub use canvas::{Anchor, Canvas, Rgb, TextStyle};
pub use colours::{COMMAND, FAILED, GRID, INK, MEASURED, PANEL, PAPER, SLIP, SOFT_INK};
pub(crate) use layout::{CAPTION, HEADER, IMAGE, MARGIN, fit, frame, pixel};
pub(crate) use plot::axes;
pub use plot::{Area, Curve, pull_curve};
pub use sample::{PictureSampleError, sample_picture};
pub(crate) use scene::{Scene, SceneMesh, View};
pub use sheet::{CONTACT_SHEET, contact_sheet, contact_sheet_samples, publish_contact_sheet};
