//! Staircases that force mode and sensor can follow.

use gripgen_twin::{Campaign, PlannedPull, PullKind};

/// What rate times lag of a staircase may be, N: it is that much of the label that the loop trails.
pub const TRAILS_N: f64 = 0.3;
/// Share of the spread of rates, on a log scale, that slowing leaves: who slows all staircases to one rate can no longer see what
/// depends on it, who keeps all of it waits hours.
const SPREAD_KEPT: f64 = 0.5;

/// A campaign whose staircases rise no faster than what trails by `trails_s` can follow: rate times lag is [`TRAILS_N`] at most.
/// The fastest one rises at that rate; slower ones are slowed too, by less, so that rates stay apart, but to no less than
/// `least_n_s` (the rate that reaches the largest force within the longest pull), unless what trails asks for it.
/// Gives how many pulls were slowed.
pub fn slowed(campaign: &mut Campaign, trails_s: f64, least_n_s: f64) -> usize {
    let mut pulls: Vec<_> = campaign.pulls.iter_mut().filter(|p| p.kind == PullKind::Pull).collect();
    let rate_of = |planned: &PlannedPull| planned.force_increment_n / planned.step_time_s;
    let fastest_n_s = pulls.iter().map(|p| rate_of(p)).fold(0.0, f64::max);
    let most_n_s = TRAILS_N / trails_s;
    if !(trails_s > 0.0 && fastest_n_s > most_n_s) {
        return 0;
    }
    let mut count = 0;
    for planned in &mut pulls {
        let rate_n_s = rate_of(planned);
        let apart_n_s = most_n_s * (rate_n_s / fastest_n_s).powf(SPREAD_KEPT);
        let wanted_n_s = apart_n_s.max(least_n_s.min(most_n_s));
        if rate_n_s > wanted_n_s {
            planned.step_time_s = (planned.force_increment_n / wanted_n_s * 1e3).ceil() * 1e-3;
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    fn staircases(steps: &[(f64, f64)]) -> Campaign {
        let pull = |&(force_increment_n, step_time_s): &(f64, f64)| PlannedPull {
            force_increment_n,
            step_time_s,
            ..PlannedPull::default()
        };
        Campaign {
            label_tolerance_n: 3.0,
            stop_m: 5e-3,
            feedback: None,
            pulls: steps.iter().map(pull).collect(),
        }
    }

    fn rates_n_s(campaign: &Campaign) -> Vec<f64> {
        campaign.pulls.iter().map(|p| p.force_increment_n / p.step_time_s).collect()
    }

    #[test]
    fn a_staircase_is_slowed_until_it_can_be_followed() {
        let mut campaign = staircases(&[(1.0, 0.104); 2]);
        assert_eq!(slowed(&mut campaign, 0.03, 0.75), 0);
        assert_eq!(slowed(&mut campaign, 0.0, 0.75), 0, "nothing trails");
        assert_eq!(slowed(&mut campaign, 0.35, 0.75), 2);
        let step_s = campaign.pulls[0].step_time_s;
        assert!((1.0 / step_s * 0.35 - TRAILS_N).abs() < 1e-3, "{step_s} s");
        assert_eq!(slowed(&mut campaign, 0.35, 0.75), 0, "slow enough");
    }

    #[test]
    fn slowing_leaves_rates_apart() {
        let mut campaign = staircases(&[(1.5, 0.052), (1.0, 0.104), (0.5, 0.208)]);
        assert_eq!(slowed(&mut campaign, 0.1, 0.75), 3);
        let rates = rates_n_s(&campaign);
        let wanted = [3.0, 3.0 / 3_f64.sqrt(), 3.0 / 12_f64.sqrt()];
        assert!(rates.iter().zip(wanted).all(|(r, w)| (r / w - 1.0).abs() < 2e-3), "{rates:?}");
        // A pull has to end in time.
        let mut campaign = staircases(&[(1.5, 0.052), (0.5, 0.208)]);
        slowed(&mut campaign, 0.1, 2.0);
        assert!((rates_n_s(&campaign)[1] - 2.0).abs() < 0.01, "{:?}", rates_n_s(&campaign));
        // What trails goes first.
        let mut campaign = staircases(&[(1.5, 0.052), (0.5, 0.208)]);
        slowed(&mut campaign, 0.3, 2.0);
        assert!(rates_n_s(&campaign).iter().all(|r| (r - 1.0).abs() < 0.01), "{:?}", rates_n_s(&campaign));
    }
}
