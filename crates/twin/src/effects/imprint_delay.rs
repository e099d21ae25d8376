//! A picture that was taken earlier or later than the force that stands beside it.

use super::{EffectSpec, Experiment, Fit, Group, ImprintFit, parameter, values};

/// `imprint_delay`: camera and load cell have clocks, or buffers, of their own. It acts on grasps beside a load cell and on nothing
/// else: a grip that is simulated holds its force while the pictures are taken.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "imprint_delay",
    group: Group::Jaws,
    about: "time by which the reading of a force comes after the picture of it",
    formula: "V(t) = c F(t + delay_s)",
    source: "50 to 120 ms between a camera stream of 30 Hz and a load cell of 5 to 8 readings per second (Burgess 2024, example data of EstimateModulus)",
    parameters: &[parameter("delay_s", "s", 0.0, (-0.5, 0.5))
        .about("how much later than its picture a force is read; below 0 the picture is the later one")],
    covariates: &["time_s"],
    grasp_force: Some(grasp_force),
    plainly: "Pictures and force readings that stand side by side were not taken at the same time.",
    number_means: "delay_s = 0.1: the force of a picture is read a tenth of a second later.",
    remedy: "Stamp pictures and readings with one clock where they are taken, or hold every force for a second.",
    typical: &[("delay_s", 0.08)],
    pulls: Err("a label is read while the grip force stands still"),
    imprints: Some(ImprintFit {
        timed: true,
        fit: |span| {
            let step_s = (2.0 * span.step_s).clamp(0.01, 0.2);
            let free = [("delay_s", 0.5 * step_s)];
            let starts = [-1.0, 1.0, 3.0].map(|k: f64| vec![("delay_s", (k * step_s).min(0.5))]);
            Fit { starts: starts.to_vec(), free: free.to_vec(), searched: 0 }
        },
        ..ImprintFit::PLAIN
    }),
    experiments: &[Experiment::HeldForces],
    ..EffectSpec::BARE
};

/// Forces at `t + delay_s`, straight between readings; before the first and after the last one they stand still.
fn grasp_force(parameters: &[f64], time_s: &[f64], force_n: &[f64]) -> Vec<f64> {
    let [delay_s] = values(parameters);
    if delay_s == 0.0 {
        return force_n.to_vec();
    }
    let last = time_s.len().saturating_sub(1);
    let at = |t: f64| {
        let k = time_s.partition_point(|x| *x <= t);
        if k == 0 {
            return force_n[0];
        }
        if k > last {
            return force_n[last];
        }
        let share = (t - time_s[k - 1]) / (time_s[k] - time_s[k - 1]);
        force_n[k - 1] + share * (force_n[k] - force_n[k - 1])
    };
    time_s.iter().map(|t| at(t + delay_s)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ramp_is_moved_in_time_and_its_ends_stand_still() {
        let time_s: Vec<f64> = (0..11).map(|i| 0.1 * f64::from(i)).collect();
        let ramp: Vec<f64> = time_s.iter().map(|t| 20.0 * t).collect();
        let later = grasp_force(&[0.25], &time_s, &ramp);
        assert!((later[3] - 20.0 * 0.55).abs() < 1e-12 && later[10] == 20.0);
        let earlier = grasp_force(&[-0.25], &time_s, &ramp);
        assert!((earlier[3] - 20.0 * 0.05).abs() < 1e-12 && earlier[1] == 0.0);
        assert!(grasp_force(&[0.1], &[], &[]).is_empty());
        assert_eq!(grasp_force(&[0.1], &[3.0], &[7.0]), [7.0]);
    }
}
