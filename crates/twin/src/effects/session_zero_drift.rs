//! A force sensor whose zero wanders from one zeroing to the next.

use super::{
    EffectSpec, Experiment, Fit, Group, PullFit, SensorMemory, SensorPoint, Visible, parameter, values,
};
use crate::SINCE_ZERO;

/// `session_zero_drift`: a bias that grows linearly from 0 at each zeroing of the sensor. Without a count, the zero was set at
/// the start of the campaign, and it is `sensor_drift`.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "session_zero_drift",
    group: Group::Robot,
    about: "constant added to the measured force that grows with the time since the sensor was zeroed",
    formula: "F_m = F + rate_n_per_h t_z, t_z = time since the first pull of the session, or since a pull with zeroed = 1",
    source: "rates as those of `sensor_drift`; zeroing takes off what there is when it is done",
    parameters: &[parameter("rate_n_per_h", "N/h", 0.0, (-30.0, 30.0))
        .about("change of the reading without load in an hour, along the sensor's axis (up)")],
    covariates: &["time_s"],
    sensor: Some(sensor),
    reads_clock: true,
    upright_only: true,
    visible: Visible::OverTheCampaign(0.05),
    plainly: "The zero of the force sensor moves with the time since it was zeroed.",
    number_means: "rate_n_per_h = 1: an hour after it was zeroed the sensor reads 1 N more than then.",
    remedy: "Zero the sensor before every pull; let it warm up.",
    typical: &[("rate_n_per_h", 0.5)],
    pulls: Ok(PullFit {
        spans: &[SINCE_ZERO],
        ..PullFit::of(|_| Fit::new(&[&[("rate_n_per_h", 0.0)]], &[("rate_n_per_h", 0.2)]))
    }),
    experiments: &[Experiment::NoLoadReading, Experiment::PullsUpAndDown, Experiment::LongPause],
    ..EffectSpec::BARE
};

fn sensor(parameters: &[f64], true_n: f64, _: &mut SensorMemory, at: &SensorPoint) -> f64 {
    let [rate_n_per_h] = values(parameters);
    // -0 + 0 is not -0.
    if rate_n_per_h == 0.0 { true_n } else { true_n + rate_n_per_h * (at.since_zero_s / 3600.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::Drawn;
    use crate::{Covariates, PullCount};

    /// Two sessions, the second zeroed again in its middle: the zero starts from 0 three times.
    #[test]
    fn each_zeroing_takes_off_what_there_is() {
        let mut count = PullCount::default();
        let pulls =
            [(0.0, "a", 0.0), (1800.0, "a", 0.0), (7200.0, "b", 0.0), (9000.0, "b", 1.0), (9900.0, "b", 0.0)];
        let zeros = pulls.map(|(time_s, session, zeroed)| {
            let mut pull = Covariates { time_s, session: session.into(), ..Covariates::default() };
            pull.extra.insert("zeroed".into(), Drawn::Number(zeroed));
            count.mark(&mut pull);
            sensor(&[0.4], 0.0, &mut SensorMemory::default(), &SensorPoint::start_of(&pull))
        });
        assert_eq!(zeros, [0.0, 0.2, 0.0, 0.0, 0.1]);
    }
}
