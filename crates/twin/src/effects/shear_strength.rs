//! A contact that holds no more per area than its shear strength, however hard it is pressed.

use super::{EffectSpec, GripPoint, Group, parameter, values};

/// No interface here comes near it.
const NO_LIMIT_MPA: f64 = 1e6;

/// `shear_strength`: what a contact of a soft gel holds is the area that really touches times a shear strength that does
/// not depend on the pressure (Bowden and Tabor 1950). Under light pressure only summits touch, an area proportional to
/// the pressure, and friction is Coulomb's; under high pressure everything touches, and more pressure brings nothing. In
/// between the share that touches is that of Persson 2001, an error function; its slope at 0 is written as `mu`, so no
/// further constant is needed. Measured on rough silicone: Nguyen et al. 2013 (sub-linear in the local pressure), Trejo
/// et al. 2017 (share of area times a strength); on smooth silicone the strength alone: Chateauminois and Fretigny 2008.
///
/// It is a law of the local pressure: every cell of the contact has its own coefficient.
pub(super) const SPEC: EffectSpec = EffectSpec {
    id: "shear_strength",
    group: Group::Friction,
    about: "friction stress that stops at the shear strength of the interface",
    formula: "mu' = strength_mpa erf(sqrt(pi) mu p / (2 strength_mpa)) / p, p = pressure of the cell",
    source: "F = strength x real area: Bowden and Tabor 1950; share of real area: Persson 2001; rough silicone: \
             Nguyen et al. 2013, Trejo et al. 2017",
    parameters: &[parameter("strength_mpa", "MPa", NO_LIMIT_MPA, (1e-4, NO_LIMIT_MPA))
        .about("largest shear stress of the interface")],
    covariates: &["grip_force_n"],
    of_pressure: true,
    friction: Some(friction),
    plainly: "The surface lets go at a shear stress of its own, so points that are pressed hard hold less than in proportion.",
    number_means: "strength_mpa is the largest shear stress that the interface holds anywhere.",
    remedy: "Keep the law in the twin if pressure fields are known; on pulls alone use area_saturation or load_power_law.",
    typical: &[("strength_mpa", 0.05)],
    pulls: Err(
        "it is a law of the pressure field, which pulls do not show; area_saturation and load_power_law stand for it",
    ),
    ..EffectSpec::BARE
};

fn friction(parameters: &[f64], mu: f64, at: &GripPoint<'_>) -> f64 {
    let [strength_mpa] = values(parameters);
    let Some(pressure_pa) = at.pressure_pa() else { return mu };
    // Half the square root of pi: the slope of tau at 0 is mu.
    let share = 0.5 * libm::sqrt(std::f64::consts::PI) * mu * pressure_pa / (strength_mpa * 1e6);
    // Below it the error function is its slope to rounding.
    if strength_mpa >= NO_LIMIT_MPA || share < 1e-9 {
        return mu;
    }
    strength_mpa * 1e6 * libm::erf(share) / pressure_pa
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::testing::{grip, twin};
    use crate::{ContactPatch, Covariates, PressureCell, cell_friction, grip_friction};

    const STRENGTH_PA: f64 = 0.05e6;
    const LAW: &str = "[[effects]]\nname = \"shear_strength\"\nstrength_mpa = 0.05\n";

    /// Friction force of a patch of the part `rod`, mu 0.3.
    fn held_n(patch: &ContactPatch) -> f64 {
        let twin = twin(LAW).unwrap();
        let c = Covariates::default();
        let at = GripPoint { contact_area_m2: patch.area_m2(), ..grip(&c, patch.normal_force_n()) };
        let (mu, jaw) = cell_friction(&twin, "rod", &twin.parts["rod"], &at, patch).unwrap();
        let held_n: f64 = mu.iter().zip(&patch.cells).map(|(mu, cell)| mu * cell.force_n).sum();
        assert!((jaw.mu * patch.normal_force_n() - held_n).abs() < 1e-9, "the jaw is the mean of its cells");
        held_n
    }

    /// A round contact on m x n cells: areas and forces are those of a fine grid inside each.
    fn round([m, n]: [usize; 2], radius_m: f64, pressure_pa: impl Fn(f64) -> f64) -> ContactPatch {
        const FINE: usize = 512;
        let side = 2.0 * radius_m / FINE as f64;
        let mut cells = vec![PressureCell { x_m: 0.0, y_m: 0.0, area_m2: 0.0, force_n: 0.0 }; m * n];
        for i in 0..FINE {
            for j in 0..FINE {
                let at = |k: usize| (k as f64 + 0.5) * side - radius_m;
                let share = (at(i).powi(2) + at(j).powi(2)) / radius_m.powi(2);
                if share < 1.0 {
                    let cell = &mut cells[i * m / FINE * n + j * n / FINE];
                    cell.area_m2 += side * side;
                    cell.force_n += side * side * pressure_pa(share);
                }
            }
        }
        cells.retain(|cell| cell.area_m2 > 0.0);
        ContactPatch { cells, ..Default::default() }
    }

    /// A Hertz contact of a sphere: a = (3 F R / 4 E*)^(1/3), p0 = 3 F / (2 pi a^2).
    fn hertz(cells: [usize; 2], force_n: f64, modulus_pa: f64) -> ContactPatch {
        let radius_m = (0.75 * force_n * 8e-3 / modulus_pa).cbrt();
        let peak_pa = 1.5 * force_n / (std::f64::consts::PI * radius_m.powi(2));
        round(cells, radius_m, |share| peak_pa * (1.0 - share).sqrt())
    }

    /// Light contacts are Coulomb's, pressed ones hold their strength, and tau never falls with the pressure.
    #[test]
    fn stress_rises_with_mu_and_ends_at_the_strength() {
        let c = Covariates::default();
        let tau = |pressure_pa: f64| {
            let at = GripPoint { contact_area_m2: 1.0, ..grip(&c, pressure_pa) };
            pressure_pa * friction(&[0.05], 0.3, &at)
        };
        assert!((tau(100.0) / 30.0 - 1.0).abs() < 1e-6 && (tau(1e7) / STRENGTH_PA - 1.0).abs() < 1e-12);
        let mut last = 0.0;
        for i in 1..200 {
            let pressure_pa = 5e3 * f64::from(i);
            let bound = (0.3 * pressure_pa).min(STRENGTH_PA);
            assert!(tau(pressure_pa) >= last && tau(pressure_pa) <= bound && tau(pressure_pa) > 0.78 * bound);
            last = tau(pressure_pa);
        }
        let unknown = GripPoint { contact_area_m2: 0.0, ..grip(&c, 40.0) };
        assert_eq!(friction(&[0.05], 0.3, &unknown), 0.3, "without an area there is no pressure");
    }

    /// The integral over a Hertz contact, by hand: with z the share of area within a radius, p = p0 sqrt(1 - z). 64 cells are
    /// within 0.7 % of it, and half as many change the force by 0.7 % at most, a quarter by 1.4 %.
    #[test]
    fn the_number_of_cells_does_not_matter() {
        for force_n in [1.0_f64, 5.0, 20.0, 40.0] {
            let modulus_pa = 0.27e6;
            let area_m2 = std::f64::consts::PI * (0.75 * force_n * 8e-3 / modulus_pa).powf(2.0 / 3.0);
            let stress = |z: f64| {
                let p = 1.5 * force_n / area_m2 * (1.0 - z).sqrt();
                STRENGTH_PA * libm::erf(0.5 * std::f64::consts::PI.sqrt() * 0.3 * p / STRENGTH_PA)
            };
            let exact =
                area_m2 * (0..4000).map(|i| stress((f64::from(i) + 0.5) / 4000.0)).sum::<f64>() / 4000.0;
            let of = |cells| held_n(&hertz(cells, force_n, modulus_pa));
            let (whole, half, quarter) = (of([8, 8]), of([8, 4]), of([4, 4]));
            assert!((whole / exact - 1.0).abs() < 7e-3, "{force_n} N: {whole} and {exact} N");
            assert!((half / whole - 1.0).abs() < 0.01, "{force_n} N: {half} after {whole} N");
            assert!((quarter / whole - 1.0).abs() < 0.014, "{force_n} N: {quarter} after {whole} N");
            assert!(exact < 0.3 * force_n && exact < STRENGTH_PA * area_m2);
        }
    }

    /// Pressed into full contact a ball has F = strength x area and mu falls with the cube root of the load; a stamp of
    /// constant area holds the same whatever the load.
    #[test]
    fn a_hertz_contact_has_the_exponent_of_a_third_and_a_stamp_none() {
        // Stiff enough that even most of the rim is at its strength.
        let held = |force_n: f64| held_n(&hertz([8, 8], force_n, 50e6));
        let exponent = |force_n: f64| (held(8.0 * force_n) / held(force_n)).ln() / 8f64.ln() - 1.0;
        for force_n in [1.0, 5.0, 10.0] {
            assert!((exponent(force_n) + 1.0 / 3.0).abs() < 0.005, "{force_n} N: {}", exponent(force_n));
        }
        let area_m2 = std::f64::consts::PI * 4e-6;
        let stamp = |force_n: f64| held_n(&round([8, 8], 2e-3, |_| force_n / area_m2));
        for force_n in [10.0, 20.0, 80.0] {
            assert!((stamp(force_n) / (STRENGTH_PA * area_m2) - 1.0).abs() < 0.01, "{force_n} N");
        }
    }

    /// Asked for a jaw without its cells, it takes the mean pressure.
    #[test]
    fn a_jaw_without_cells_takes_the_mean_pressure() {
        let twin = twin(LAW).unwrap();
        let c = Covariates::default();
        let mu = grip_friction(&twin, "rod", &twin.parts["rod"], &grip(&c, 40.0)).unwrap().mu;
        let pressure_pa = 40.0 / 1e-4;
        let by_hand =
            STRENGTH_PA * libm::erf(0.5 * std::f64::consts::PI.sqrt() * 0.3 * pressure_pa / STRENGTH_PA);
        assert!((mu - by_hand / pressure_pa).abs() < 1e-12);
    }
}
