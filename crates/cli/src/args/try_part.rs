//! Arguments of `gripgen try`.

use super::TalkArgs;
use clap::Args;
use std::path::PathBuf;

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
    #[arg(long, value_name = "MM", value_parser = super::scale)]
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

fn positive(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(x) if x > 0.0 && x.is_finite() => Ok(x),
        _ => Err("a number above 0 is wanted".into()),
    }
}
