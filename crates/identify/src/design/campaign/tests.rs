use super::*;
use std::collections::BTreeMap;

fn options(parts: &[&str], pulls: usize) -> CampaignOptions {
    CampaignOptions { parts: parts.iter().map(|p| p.to_string()).collect(), pulls, ..Default::default() }
}

fn loaded(campaign: &Campaign) -> Vec<&PlannedPull> {
    campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull).collect()
}

fn levels(pulls: &[&PlannedPull], of: impl Fn(&PlannedPull) -> f64) -> Vec<f64> {
    let mut values: Vec<f64> = pulls.iter().map(|p| of(p)).collect();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

#[test]
fn a_campaign_varies_what_tells_effects_apart() {
    for pulls in [60, 120, 121, 440] {
        let campaign = plan_campaign(&options(&["gear", "long_shaft"], pulls)).unwrap();
        let made = loaded(&campaign);
        assert_eq!(made.len(), pulls);
        assert!(levels(&made, |p| p.grip_force_n).iter().filter(|&&f| f < 20.0).count() >= 3);
        assert_eq!(levels(&made, |p| p.force_increment_n), INCREMENTS_N);
        assert_eq!(levels(&made, |p| p.step_time_s), STEPS_S);
        assert_eq!(levels(&made, |p| p.dwell_s), DWELLS_S);
        assert_eq!(levels(&made, |p| p.pull_direction), [-1.0, 1.0]);
        let of_part = |part: &str| made.iter().filter(|p| p.part == part).count() as f64;
        assert!((of_part("gear") / of_part("long_shaft") - 1.0).abs() < 0.4, "{}", of_part("gear"));
        // Independent of each other and of the order.
        let owned: Vec<PlannedPull> = made.iter().map(|p| (*p).clone()).collect();
        assert!(worst_correlation(&owned) < 0.25, "{pulls}: {}", worst_correlation(&owned));
        let order: Vec<f64> = (0..pulls).map(|i| i as f64).collect();
        for k in 0..5 {
            let factor: Vec<f64> = owned.iter().map(|p| factors(p)[k]).collect();
            assert!(correlation(&order, &factor).abs() < 0.3, "{pulls}, factor {k}");
        }
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let dot = |x: &[f64], mx: f64, y: &[f64], my: f64| {
        x.iter().zip(y).map(|(x, y)| (x - mx) * (y - my)).sum::<f64>()
    };
    dot(a, ma, b, mb) / (dot(a, ma, a, ma) * dot(b, mb, b, mb)).sqrt()
}

/// The noise floor needs repetitions, and drift needs something that returns.
#[test]
fn settings_come_twice_and_the_reference_throughout() {
    let campaign = plan_campaign(&options(&["gear"], 120)).unwrap();
    let made = loaded(&campaign);
    let mut sessions: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for pull in &made {
        let plain = PlannedPull { session: String::new(), ..(*pull).clone() };
        sessions.entry(format!("{plain:?}")).or_default().push(&pull.session);
    }
    let alone = sessions.values().filter(|s| s.len() == 1).count();
    assert!(alone <= 2, "{alone} settings are made once");
    let across = sessions.values().filter(|s| s.iter().any(|x| *x != s[0])).count();
    assert!(2 * across > sessions.len(), "most settings are made in two sessions: {across}");
    let most = sessions.values().map(Vec::len).max().unwrap();
    assert!((14..=18).contains(&most), "{most} reference grips");
    let reference = made[0];
    let places: Vec<usize> =
        (0..120).filter(|&i| PlannedPull { session: "1".into(), ..made[i].clone() } == *reference).collect();
    assert!(places.windows(2).all(|p| p[1] - p[0] <= 9), "{places:?}");
}

#[test]
fn sessions_are_paused_and_read_without_a_load() {
    let campaign = plan_campaign(&options(&["gear"], 100)).unwrap();
    let paused: Vec<usize> = (0..campaign.pulls.len()).filter(|&i| campaign.pulls[i].pause_s > 0.0).collect();
    assert_eq!(paused.len(), 2);
    for (i, pull) in campaign.pulls.iter().enumerate() {
        let edge = i == 0
            || i + 1 == campaign.pulls.len()
            || campaign.pulls[i - 1].session != pull.session
            || campaign.pulls[i + 1].session != pull.session;
        assert_eq!(pull.kind == PullKind::NoLoad, edge, "{i}");
    }
    assert!(campaign.estimated_minutes() > 50.0, "two pauses alone are 50 minutes");
    assert_eq!(campaign, plan_campaign(&options(&["gear"], 100)).unwrap());
    let other = CampaignOptions { seed: 2, ..options(&["gear"], 100) };
    assert_ne!(campaign, plan_campaign(&other).unwrap());
}

#[test]
fn the_gripper_is_not_overloaded() {
    for max_force_n in [4.0, 18.0, 33.0, 50.0, 80.0, 120.0] {
        let campaign = plan_campaign(&CampaignOptions { max_force_n, ..options(&["gear"], 60) }).unwrap();
        let forces = levels(&loaded(&campaign), |p| p.grip_force_n);
        assert!(forces.len() >= 5 && forces.iter().all(|f| (0.1..=max_force_n).contains(f)), "{forces:?}");
        assert!(*forces.last().unwrap() > 0.8 * max_force_n, "{forces:?}");
        let known = CampaignOptions { min_force_n: 0.5 * max_force_n, max_force_n, ..options(&["gear"], 60) };
        let within = levels(&loaded(&plan_campaign(&known).unwrap()), |p| p.grip_force_n);
        let inside = within.iter().all(|f| (0.5 * max_force_n..=max_force_n).contains(f));
        assert!(within.len() >= 4 && inside, "{within:?}");
        assert!(forces.iter().filter(|&&f| f < 20.0).count() >= 3);
    }
}

#[test]
fn what_cannot_be_planned_is_refused_with_its_numbers() {
    let message = |o: CampaignOptions| plan_campaign(&o).unwrap_err().to_string();
    assert!(message(options(&[], 60)).contains("no parts"));
    assert!(message(options(&["a", "b"], 11)).contains("11 pulls are too few for 2 parts: at least 12"));
    assert!(message(CampaignOptions { sessions: 0, ..options(&["a"], 60) }).contains("0 sessions"));
    assert!(message(CampaignOptions { sessions: 21, ..options(&["a"], 60) }).contains("at most 20"));
    assert!(message(CampaignOptions { max_force_n: f64::NAN, ..options(&["a"], 60) }).contains("NaN"));
    assert!(plan_campaign(&CampaignOptions { sessions: 2, ..options(&["a"], 6) }).is_ok());
}
