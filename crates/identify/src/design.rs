//! Design of campaigns: the first pulls, and the next ones that separate models which the data do not tell apart.

mod campaign;
mod separate;

pub use campaign::{CampaignError, CampaignOptions, DWELLS_S, FORCES_N, NO_LOAD_S, plan_campaign};
pub use separate::{CandidatePull, SeparableRival, SeparateError, SeparatingPlan, plan_separating};
