//! A contact that holds a stress of its own, whatever presses it.

use super::{EffectSpec, GripPoint, Group, parameter, values};

/// `adhesion`: what a sticky gel holds without any load, an area times a stress. Without it friction goes through the origin; with it the
/// coefficient rises towards light grips.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "adhesion",
    group: Group::Friction,
    about: "friction stress that the contact has without pressure",
    formula: "mu' = mu + stress_kpa / p, p = pressure of the cell",
    source: "tau = tau_0 + alpha p: Briscoe and Tabor 1975; on silicone without load: Chateauminois and Fretigny 2008",
    parameters: &[
        parameter("stress_kpa", "kPa", 0.0, (0.0, 500.0)).about("shear stress that no pressure makes")
    ],
    covariates: &["grip_force_n"],
    of_pressure: true,
    friction: Some(friction),
    plainly: "The gel sticks: each area of contact holds something, however lightly it is pressed.",
    number_means: "stress_kpa = 10: a contact of 100 mm2 holds 1 N more than friction alone.",
    remedy: "Clean the gel with alcohol; use it in the twin where contact areas are known.",
    typical: &[("stress_kpa", 10.0)],
    pulls: Err("it is a law of the pressure field, which pulls do not show; load_offset stands for it"),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [stress_kpa] = values(parameters);
    match at.pressure_pa() {
        Some(pressure_pa) if stress_kpa > 0.0 && pressure_pa > 0.0 => mu + stress_kpa * 1e3 / pressure_pa,
        _ => mu,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Covariates;
    use crate::effects::testing::grip;

    /// The force is that of Coulomb plus area times stress, at any load.
    #[test]
    fn a_contact_holds_its_area_times_the_stress_in_addition() {
        let c = Covariates::default();
        for (force_n, area_m2) in [(0.5, 3e-5), (10.0, 1e-4), (80.0, 2e-4)] {
            let at = GripPoint { contact_area_m2: area_m2, ..grip(&c, force_n) };
            let held_n = friction(&[12.0], 0.2, &at) * force_n;
            assert!((held_n - (0.2 * force_n + 12e3 * area_m2)).abs() < 1e-12, "{force_n} N: {held_n} N");
        }
        let unknown = GripPoint { contact_area_m2: 0.0, ..grip(&c, 40.0) };
        assert_eq!(friction(&[12.0], 0.2, &unknown), 0.2, "without an area there is no pressure");
    }
}
