//! Gels that flow under shear.

use super::{Creep, EffectSpec, Experiment, Fit, GripPoint, Group, PullFit, Seen, parameter, values};

/// `shear_creep`: the tool goes on moving under a force that the jaws hold. What creeps far enough ends the pull at its
/// displacement stop before the jaws let go: the label is then the force of that moment, `sqrt(2 r x_stop / rate)` of a pull that
/// rises by r newtons a second from nothing, and no friction. Only displacements tell it from a limit.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "shear_creep",
    group: Group::Jaws,
    about: "tool that creeps under a force that the jaws hold",
    formula: "dx/dt = rate_mm_per_n_s (F_N / reference_force_n)^-load_exponent F (1 - F / L)^-rim_exponent, in series with the gels' shear",
    source: "dashpot of a Maxwell element (Johnson 1985, section 6.5) on what sticks of a contact: (1 - F / L)^(2/3) of the area of Cattaneo's and Mindlin's sphere; contact solvers that soften friction creep so by 0.04 to 4 mm/s (docs/peers.md)",
    parameters: &[
        parameter("rate_mm_per_n_s", "mm/(N s)", 0.0, (0.0, 5.0)).about("speed per newton of pull, at the reference force"),
        parameter("load_exponent", "1", 0.0, (0.0, 1.0)).about("how much slower a stronger grip creeps: 2/3 where the rate goes with the area of a sphere's contact, turned round"),
        parameter("rim_exponent", "1", 0.0, (0.0, 0.9)).about("how much faster it creeps while the rim slips: 2/3 of a sphere, 0 of a contact that lets go all at once"),
        parameter("reference_force_n", "N", 20.0, (0.1, 100.0)).about("normal force of a jaw at which the rate is the one above"),
    ],
    references: &["reference_force_n"],
    covariates: &["grip_force_n"],
    per_part: true,
    creep: Some(creep),
    plainly: "The jaws hold, and yet the tool moves on slowly: gel or contact flow under the pull.",
    number_means: "rate_mm_per_n_s = 0.02: held at 10 N for five seconds the tool moves by 1 mm.",
    remedy: "Pull faster, or take the displacement stop further out; look whether the gel comes off its backing.",
    typical: &[("rate_mm_per_n_s", 0.5)],
    pulls: Ok(PullFit {
        seen: Seen::InDisplacements,
        fit: |span| {
            let rate = span.creep_mm_per_n_s.unwrap_or(0.05).clamp(1e-3, 4.0);
            let free = [("rate_mm_per_n_s", 0.1 * rate), ("load_exponent", 0.05)];
            let of = |rim| vec![("rate_mm_per_n_s", rate), ("load_exponent", 0.2), ("rim_exponent", rim)];
            Fit { starts: RIMS.map(of).to_vec(), free: free.to_vec(), searched: 1 }
        },
        flat_at_neutral: true,
        ..PullFit::PLAIN
    }),
    experiments: &[Experiment::OtherPullRates],
    ..EffectSpec::BARE
};

/// Rim exponents that are tried: of a contact that lets go all at once, of a sphere, and between.
const RIMS: [f64; 3] = [0.0, 1.0 / 3.0, 2.0 / 3.0];

fn creep(parameters: &[f64], at: &GripPoint<'_>) -> Creep {
    let [rate_mm_per_n_s, load_exponent, rim_exponent, reference_force_n] = values(parameters);
    let load = libm::pow(at.positive_force_n() / reference_force_n, -load_exponent);
    Creep { rate_m_per_n_s: 1e-3 * rate_mm_per_n_s * load, rim_exponent }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    /// 0.02 mm/(N s): 10 N for five seconds move by 1 mm; eight times the load by a quarter of that where the area of a Hertz contact counts.
    #[test]
    fn a_held_force_moves_by_rate_times_force_times_time() {
        let c = Covariates::default();
        let at = |force_n: f64| creep(&[0.02, 2.0 / 3.0, 0.0, 10.0], &grip(&c, force_n));
        assert!((at(10.0).speed_m_per_s(10.0, 12.0) * 5.0 - 1e-3).abs() < 1e-15);
        assert!((at(80.0).rate_m_per_n_s / at(10.0).rate_m_per_n_s - 0.25).abs() < 1e-12);
        assert_eq!(creep(&[0.0, 0.5, 0.5, 20.0], &grip(&c, 3.0)).speed_m_per_s(3.0, 3.0), 0.0);
        assert!(creep(&[0.1, 1.0, 0.5, 20.0], &grip(&c, 0.0)).speed_m_per_s(1.0, 0.0).is_finite());
    }

    /// Seven eighths of the limit leave a quarter of the area of a sphere sticking; the mean over a pull is that of its steps.
    #[test]
    fn what_sticks_of_a_contact_creeps_faster_while_its_rim_slips() {
        let sphere = Creep { rate_m_per_n_s: 1e-5, rim_exponent: 2.0 / 3.0 };
        assert!((sphere.speed_m_per_s(7.0, 8.0) / 7e-5 - 4.0).abs() < 1e-12);
        for u in [0.1, 0.5, 0.9] {
            let step = |i: i32| u * (f64::from(i) + 0.5) / 4000.0;
            let way: f64 = (0..4000).map(|i| sphere.speed_m_per_s(step(i), 1.0)).sum();
            let whole: f64 = (0..4000).map(|i| 1e-5 * step(i)).sum();
            let mean = sphere.mean_rate_m_per_n_s(u) / 1e-5;
            assert!((way / whole / mean - 1.0).abs() < 1e-5, "{u}: {mean}");
        }
    }
}
