//! Arguments of `gripgen render`.

use super::{JsonArgs, TalkArgs};
use clap::Args;
use std::path::PathBuf;

/// `gripgen render`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::RENDER)]
pub struct RenderArgs {
    /// A mesh (STL, OBJ, PLY, GLB): its tip points along its +z into the gel, +x is the image's right, +y the image's top. Or heights
    /// above the gel at rest in mm (.npy, rows and columns of the sensor's image).
    pub mesh: PathBuf,
    /// Travel after the highest point touched the gel. Without it heights are taken as they are.
    #[arg(long, value_name = "MM")]
    pub depth_mm: Option<f64>,
    /// A sensor file: size, colours and frame at rest are its own.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: String,
    /// Place of the mesh's origin, columns from the centre of the first pixel; the middle of the image where it is left out.
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    pub x_px: Option<f64>,
    /// Place of the mesh's origin, rows from the centre of the first pixel.
    #[arg(long, value_name = "PX", allow_negative_numbers = true)]
    pub y_px: Option<f64>,
    /// Turn, counter-clockwise in the image.
    #[arg(long, value_name = "DEG", default_value_t = 0.0, allow_negative_numbers = true)]
    pub rotation_deg: f64,
    /// Millimetres per unit of the file; 1 where it is left out, 1000 of GLB, which is in metres.
    #[arg(long, value_name = "MM", value_parser = super::scale)]
    pub scale_mm_per_unit: Option<f64>,
    /// Write how far the gel stands above its rest, in mm: a (rows, columns) array.
    #[arg(long, value_name = "FILE.npy")]
    pub heights: Option<PathBuf>,
    /// Write the normals of that surface (right, up, towards the camera): a (rows, columns, 3) array.
    #[arg(long, value_name = "FILE.npy")]
    pub normals: Option<PathBuf>,
    /// Write where the gel follows the mesh, white on black.
    #[arg(long, value_name = "FILE.png")]
    pub mask: Option<PathBuf>,
    /// The image to write.
    #[arg(short, long, value_name = "FILE.png")]
    pub out: PathBuf,
    /// JSON: what was written, and the size of the contact.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}
