//! What a run of a rig is made with, as one text.

use gripgen_measured::campaign_toml;
use gripgen_record::RunFolder;
use gripgen_record::differences;
use gripgen_twin::columns::covariates;
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Campaign, PlannedPull};
use serde::Serialize;
use std::collections::BTreeSet;
use std::path::Path;

/// Keys of a rig's file that no measurement depends on: where the devices are, and how patient the host is.
const OF_THE_NETWORK: [(&[&str], &[&str]); 6] = [
    (&["robot"], &["address", "rtde_port", "dashboard_port", "primary_port"]),
    (&["gripper"], &["address", "port"]),
    (&["cameras", "left"], &["address", "port"]),
    (&["cameras", "right"], &["address", "port"]),
    (&["limits"], &["robot_silence_s", "patience"]),
    (&["images"], &["frame_s"]),
];

/// Sections `[rig]` and `[campaign]`: limits and poses, and every pull that is to be made. Two campaigns of the same text are the
/// same run, wherever the devices are, and whatever a person notes of each pull: `noted` are the names of those columns.
///
/// # Errors
///
/// A configuration that TOML cannot hold.
pub fn rig_run_toml<'a>(
    rig: &impl Serialize,
    campaign: &'a Campaign,
    noted: impl Iterator<Item = &'a String>,
) -> Result<String, toml::ser::Error> {
    let noted: BTreeSet<&String> =
        noted.chain(campaign.pulls.iter().flat_map(|pull| pull.notes.keys())).collect();
    let campaign = campaign_toml(campaign, "");
    let mut campaign: toml::Table =
        campaign.parse().unwrap_or_else(|e| unreachable!("what campaign_toml writes can be read: {e}"));
    let known = covariates().filter(|c| c.known_to_rig).map(|c| c.name.into());
    let recorded: Vec<toml::Value> =
        known.chain(noted.into_iter().map(|name| name.as_str().into())).collect();
    campaign.insert("recorded".into(), recorded.into());
    let mut run = toml::Table::new();
    let mut rig = toml::Table::try_from(rig)?;
    for (section, keys) in OF_THE_NETWORK {
        let inner = section.iter().try_fold(&mut rig, |table, name| table.get_mut(*name)?.as_table_mut());
        if let Some(table) = inner {
            keys.iter().for_each(|key| drop(table.remove(*key)));
        }
    }
    run.insert("rig".into(), rig.into());
    run.insert("campaign".into(), campaign.into());
    Ok(run.to_string())
}

/// The keys in which the run of a folder differs from one that would be made with `config_toml` (of [`rig_run_toml`]), with both
/// values; `None` where the folder cannot be read or is the same.
pub fn rig_run_differences(folder: &Path, config_toml: &str) -> Option<String> {
    let there = RunFolder::open(folder).ok()?;
    differences(&there.info().config_toml, config_toml)
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_the_same_on_other_ports_and_another_with_other_limits() {
        let rig = |text: &str| -> toml::Table { text.parse().unwrap() };
        let campaign = plain_campaign(&["gear".into()], &[20.0], 2, 1);
        let of = |text: &str| rig_run_toml(&rig(text), &campaign, [].iter()).unwrap();
        let here = "[robot]\naddress = \"a\"\nrtde_port = 1\npayload_kg = 1.0\n[cameras.left]\nport = 3\nrotate_deg = 90\n";
        assert_eq!(
            of(here),
            of(&here.replace("rtde_port = 1", "rtde_port = 2").replace("port = 3", "port = 4"))
        );
        assert_ne!(of(here), of(&here.replace("payload_kg = 1.0", "payload_kg = 1.1")));
        assert_ne!(of(here), of(&here.replace("rotate_deg = 90", "rotate_deg = 270")));
    }

    #[test]
    fn a_plain_campaign_has_every_setting_in_an_order_of_its_seed() {
        let parts = ["a".to_string(), "b".to_string()];
        let campaign = |seed| plain_campaign(&parts, &[10.0, 20.0, 30.0], 4, seed);
        let count = |part: &str, n: f64| {
            campaign(1).pulls.iter().filter(|p| p.part == part && p.grip_force_n == n).count()
        };
        assert!(parts.iter().all(|part| [10.0, 20.0, 30.0].iter().all(|n| count(part, *n) == 4)));
        assert_eq!(campaign(1), campaign(1));
        assert_ne!(campaign(1), campaign(2));
    }
}
