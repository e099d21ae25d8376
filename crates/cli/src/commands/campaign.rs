//! `gripgen campaign`: plan a campaign.

use crate::args::CampaignArgs;
use crate::failure::Failure;

/// Runs the verb.
pub fn run(args: &CampaignArgs) -> Result<u8, Failure> {
    let _ = args;
    Err(Failure::usage("not built yet"))
}
