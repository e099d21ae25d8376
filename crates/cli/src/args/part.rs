//! What was typed for the verbs that read a mesh: `init`, `try`, `render`.

use super::values::{edge_radius, friction, positive, scale};
use super::{JsonArgs, TalkArgs};
use clap::Args;
use gripgen::tactile::presses::USUAL_EDGE_RADIUS_M;
use std::path::PathBuf;

/// `gripgen init`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::INIT)]
pub struct InitArgs {
    /// A folder to write into, or meshes (STL, OBJ, PLY, GLB) of your parts.
    #[arg(default_value = ".")]
    pub target: Vec<PathBuf>,
    /// Folder to write into, where TARGET is a mesh.
    #[arg(short, long, value_name = "FOLDER")]
    pub out: Option<PathBuf>,
    /// Millimetres per unit of the mesh files; 1 where it is left out, 1000 of GLB, which is in metres.
    #[arg(long, value_name = "MM", value_parser = scale)]
    pub scale_mm_per_unit: Option<f64>,
    /// Take a mesh with holes as it is.
    #[arg(long)]
    pub accept_open_mesh: bool,
    /// Friction coefficient of the parts, if it was measured: F / (2 F_G) of their pulls.
    #[arg(long, value_name = "MU", value_parser = friction)]
    pub mu: Option<f64>,
    /// A sweep over the benchmark: two hundred parts in twelve families, with grips that were tried.
    #[arg(long, conflicts_with_all = ["scale_mm_per_unit", "accept_open_mesh", "mu"])]
    pub benchmark: bool,
    /// The first so many parts of each family only.
    #[arg(long, value_name = "N", requires = "benchmark", value_parser = clap::value_parser!(u64).range(1..))]
    pub per_family: Option<u64>,
    /// JSON: the files, the grips proposed, what the sweep varies and what is to be said of the mesh.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

/// `gripgen try`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::TRY)]
pub struct TryArgs {
    /// A mesh (STL, OBJ, PLY, GLB) of the part.
    pub mesh: PathBuf,
    /// Show this grip only, counted from 0.
    #[arg(long, value_name = "K")]
    pub grip: Option<usize>,
    /// Force of a jaw at which the images are made; 20 N where it is left out, or what the gel bears.
    #[arg(long, value_name = "N", value_parser = positive)]
    pub force_n: Option<f64>,
    /// Friction coefficient of the part, if it was measured.
    #[arg(long, value_name = "MU", value_parser = positive)]
    pub mu: Option<f64>,
    /// A sensor file for both jaws in place of the shipped one.
    #[arg(long, value_name = "FILE.npz")]
    pub sensor: Option<String>,
    /// Millimetres per unit of the mesh file; 1 where it is left out, 1000 of GLB, which is in metres.
    #[arg(long, value_name = "MM", value_parser = scale)]
    pub scale_mm_per_unit: Option<f64>,
    /// Take a mesh with holes as it is.
    #[arg(long)]
    pub accept_open_mesh: bool,
    /// The page to write, <part>-try.html where it is left out; the picture of the same name (.png) is written beside it.
    #[arg(short, long, value_name = "PAGE.html")]
    pub out: Option<PathBuf>,
    /// Print JSON to standard output, or to FILE: the grips, what they are expected to hold and where they fail.
    #[arg(long, value_name = "FILE", num_args = 0..=1, default_missing_value = "-")]
    pub json: Option<String>,
    /// Replace output files that exist. With a number it is --force-n.
    #[arg(long, value_name = "N", num_args = 0..=1, default_missing_value = "files", value_parser = forced)]
    pub force: Option<Forced>,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}

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
    /// Radius of the convex edges of a mesh; 0 leaves them sharp. Printed edges have some 0.2 mm.
    #[arg(long, value_name = "MM", default_value_t = 1e3 * USUAL_EDGE_RADIUS_M, value_parser = edge_radius)]
    pub edge_radius_mm: f64,
    /// Millimetres per unit of the file; 1 where it is left out, 1000 of GLB, which is in metres.
    #[arg(long, value_name = "MM", value_parser = scale)]
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

/// What `--force` stands for: the word of all verbs, or the force of a jaw.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Forced {
    /// Files are replaced.
    Files,
    /// Force of a jaw.
    Newtons(f64),
}

impl TryArgs {
    /// Force of a jaw at which the images are made.
    pub fn force_n(&self) -> Option<f64> {
        self.force_n.or(match self.force {
            Some(Forced::Newtons(force_n)) => Some(force_n),
            _ => None,
        })
    }

    /// Whether files are replaced.
    pub fn replaces(&self) -> bool {
        self.force == Some(Forced::Files)
    }
}

fn forced(text: &str) -> Result<Forced, String> {
    if text == "files" { Ok(Forced::Files) } else { positive(text).map(Forced::Newtons) }
}
