//! Arguments of `gripgen view`.

use super::{JsonArgs, TalkArgs};
use clap::Args;
use std::path::PathBuf;

/// `gripgen view`
#[derive(Debug, Args)]
#[command(after_help = crate::examples::VIEW)]
pub struct ViewArgs {
    /// A run folder, a folder with pulls.csv, or a shard (.mcap).
    pub data: PathBuf,
    /// Pulls that are shown with images and curves; of more, the strangest, those that failed, and the others evenly.
    #[arg(long, value_name = "N", default_value_t = 96, value_parser = clap::value_parser!(u32).range(1..=2000))]
    pub pulls: u32,
    /// The page to write; view.html in the folder, or beside the shard, where it is left out.
    #[arg(short, long, value_name = "PAGE.html")]
    pub out: Option<PathBuf>,
    /// JSON: the page and how much of the data it shows.
    #[command(flatten)]
    pub json: JsonArgs,
    /// How much is said.
    #[command(flatten)]
    pub talk: TalkArgs,
}
