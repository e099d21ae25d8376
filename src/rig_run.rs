//! What a run of a rig is made with, as one text.

use gripgen_record::campaign_toml;
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Campaign, PlannedPull};
use serde::Serialize;

/// Covariates that a rig knows of its pulls; the temperature is not among them.
const RECORDED: [&str; 12] = [
    "part",
    "grip_force_n",
    "gel_id",
    "session",
    "force_increment_n",
    "step_time_s",
    "dwell_s",
    "pull_index",
    "time_s",
    "grip_offset_mm",
    "grip_angle_deg",
    "pull_direction",
];

/// Sections `[rig]` and `[campaign]`: addresses, limits and poses, and every pull that is to be made. Two campaigns of the same
/// text are the same run.
pub fn rig_run_toml(rig: &impl Serialize, campaign: &Campaign) -> Result<String, toml::ser::Error> {
    let campaign = campaign_toml(campaign, "");
    let mut campaign: toml::Table =
        campaign.parse().unwrap_or_else(|e| unreachable!("what campaign_toml writes can be read: {e}"));
    let recorded: Vec<toml::Value> = RECORDED.iter().map(|&name| name.into()).collect();
    campaign.insert("recorded".into(), recorded.into());
    let mut run = toml::Table::new();
    run.insert("rig".into(), toml::Value::try_from(rig)?);
    run.insert("campaign".into(), campaign.into());
    Ok(run.to_string())
}

/// A campaign without a plan: every part with every grip force, so often, in an order drawn from the seed.
pub fn plain_campaign(parts: &[String], grip_forces_n: &[f64], repetitions: usize, seed: u64) -> Campaign {
    let mut pulls = Vec::new();
    for part in parts {
        for &grip_force_n in grip_forces_n {
            let pull = PlannedPull { part: part.clone(), grip_force_n, ..PlannedPull::default() };
            pulls.extend(std::iter::repeat_n(pull, repetitions));
        }
    }
    // Fisher and Yates.
    let mut order = Stream::new(seed, 0, Purpose::Draw);
    for last in (1..pulls.len()).rev() {
        pulls.swap(last, (order.uniform() * (last + 1) as f64) as usize);
    }
    Campaign { label_tolerance_n: 3.0, stop_m: 5e-3, feedback: None, pulls }
}
