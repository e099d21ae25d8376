//! Pictures for people: what a run, a sample or a part looks like; and what they are drawn with.

pub(crate) mod canvas;
mod colours;
mod film;
pub(crate) mod grips;
pub(crate) mod layout;
mod plot;
mod rig;
pub(crate) mod sample;
pub(crate) mod scene;
pub(crate) mod sheet;

pub use canvas::{Anchor, Canvas, Rgb, TextStyle};
pub use colours::{COMMAND, FAILED, GRID, INK, MEASURED, PANEL, PAPER, SLIP, SOFT_INK};
pub(crate) use plot::axes;
pub use plot::{Area, Curve, pull_curve};
