//! An imprint that grows with another power of the grip force than the first.

use super::{EffectSpec, Experiment, Fit, Group, ImprintFit, parameter, positive, values};

/// `imprint_nonlinearity`: `V = c F` becomes a power law through the same volume at `f_ref_n`. A Hertzian
/// half-space under a sphere has 4/3; a thin layer on a hard backing has less than 1.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "imprint_nonlinearity",
    group: Group::Jaws,
    about: "imprint volume as a power of the normal force",
    formula: "V = c f_ref_n (F_N / f_ref_n)^exponent",
    source: "Hertz: 4/3 for a sphere; Wucherer et al. 2023 take 1, their images differ more at 55 N than at 25 N; 0.5 to 1.2 on rigid objects in a GelSight Wedge",
    parameters: &[
        parameter("exponent", "1", 1.0, (0.4, 1.5)).about("exponent"),
        parameter("f_ref_n", "N", 40.0, (1.0, 500.0)).about("normal force at which the volume is c F"),
    ],
    references: &["f_ref_n"],
    covariates: &["grip_force_n"],
    imprint_volume: Some(imprint_volume),
    plainly: "The imprint does not grow in proportion to the force that presses it.",
    number_means: "exponent = 0.9: twice the force displaces 1.87 times the volume.",
    remedy: "Calibrate the gel at the grip forces that are used; compare pictures of one grip at several forces.",
    typical: &[("exponent", 0.85)],
    not_on_elastic_gel: Some("changes the imprint constant, which an elastic gel does not use"),
    pulls: Err("it changes imprints, which labels of a constant coefficient do not feel"),
    imprints: Some(ImprintFit {
        fit: |_| Fit::new(&[&[("exponent", 0.8)], &[("exponent", 1.15)]], &[("exponent", 0.1)]),
        fixed: |span| vec![("f_ref_n", span.middle_n.clamp(1.0, 500.0))],
        ..ImprintFit::PLAIN
    }),
    experiments: &[Experiment::ForceLadder],
    ..EffectSpec::BARE
};

fn imprint_volume(parameters: &[f64], volume_m3: f64, force_n: f64) -> f64 {
    let [exponent, f_ref_n] = values(parameters);
    volume_m3 * libm::pow(positive(force_n) / f_ref_n, exponent - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn volumes_follow_the_power_and_meet_the_line_at_the_reference() {
        let (c, p) = (1.5e-9, 4.0 / 3.0);
        let volume = |force_n: f64| imprint_volume(&[p, 40.0], c * force_n, force_n);
        assert!((volume(40.0) / (c * 40.0) - 1.0).abs() < 1e-15);
        // 8^(4/3) = 16
        assert!((volume(80.0) / volume(10.0) - 16.0).abs() < 1e-11);
        assert_eq!(volume(0.0), 0.0);
        assert_eq!(imprint_volume(&[0.6, 40.0], 0.0, 0.0), 0.0);
    }
}
