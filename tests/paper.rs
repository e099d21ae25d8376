//! Numbers that Wucherer et al. 2023 print: free oracles.

use crate::common::project;
use gripgen::tactile::metrics::{mean_squared_error, psnr_db};
use gripgen::twin::config::{Document, TwinFile};
use gripgen::twin::effects::GripPoint;
use gripgen::twin::{Covariates, FrictionError, Jaw, TactileImage, Twin, grip_friction};

/// The paper prints MSE and PSNR for six image pairs; one determines the other.
#[test]
fn psnr_matches_the_papers_six_image_pairs() {
    for (mse, printed_db) in
        [(262.95, 23.93), (399.47, 22.12), (238.76, 24.35), (387.21, 22.25), (256.81, 24.03), (278.60, 23.68)]
    {
        assert!((psnr_db(mse) - printed_db).abs() < 0.006, "MSE {mse}: {} dB", psnr_db(mse));
    }
}

/// And MSE is what the word says.
#[test]
fn mean_squared_error_of_known_images() {
    let image = |level: u8| TactileImage { width_px: 4, height_px: 3, rgb: vec![level; 36] };
    assert_eq!(mean_squared_error(&image(10), &image(13)), Ok(9.0));
    assert_eq!(mean_squared_error(&image(255), &image(0)), Ok(65025.0));
    let wide = TactileImage { width_px: 5, height_px: 3, rgb: vec![0; 45] };
    assert!(mean_squared_error(&image(0), &wide).unwrap_err().to_string().contains("4x3 against 5x3"));
}

/// Part, mu_sim, a, b [N] as printed, and mu_corr at 20 and 80 N that follows.
const TABLE: [(&str, f64, f64, f64); 4] = [
    ("ball_bearing", 0.14, 1.20, -4.34),
    ("long_shaft", 0.168, 1.05, -3.20),
    ("gear", 0.15, 1.36, -12.15),
    ("roller_bearing", 0.14, 1.10, 10.15),
];

/// A grip in the circumstances of the paper.
fn at(grip_force_n: f64) -> GripPoint<'static> {
    static COVARIATES: std::sync::LazyLock<Covariates> = std::sync::LazyLock::new(Covariates::default);
    GripPoint {
        jaw: Jaw::Left,
        grip_force_n,
        contact_area_m2: 1e-4,
        pull_rate_n_per_s: 1.0 / 0.104,
        covariates: &COVARIATES,
        grip: (0, 0),
    }
}

#[test]
fn the_shipped_twin_holds_the_papers_friction_table() {
    let p = project("asset:configs/paper.toml", &[]);
    for (name, mu, a, b) in TABLE {
        let part = &p.twin.parts[name];
        assert_eq!(part.mu, mu);
        for force in [20.0, 40.0, 80.0] {
            let found = grip_friction(&p.twin, name, part, &at(force)).unwrap();
            assert!((found.mu - mu * (a + b / force)).abs() < 1e-15, "{name} at {force} N");
            assert!(!found.outside_fit);
        }
    }
}

/// The gear's law is negative below 8.9 N. It refuses there, holds its last value, or stays at 0, as it is told.
#[test]
fn laws_refuse_hold_or_extrapolate_outside_their_fit() {
    let p = project("asset:configs/paper.toml", &[]);
    let gear = &p.twin.parts["gear"];
    let error = grip_friction(&p.twin, "gear", gear, &at(5.0)).unwrap_err();
    assert!(matches!(error, FrictionError::OutsideFit { .. }));
    for part in ["5 N", "20 to 80 N", "`gear`"] {
        assert!(error.to_string().contains(part), "{error}");
    }
    let with = |outside: &str| {
        let p = project(
            "asset:configs/paper.toml",
            &[&format!("effects.load_offset.gear.outside_fit={outside}")],
        );
        grip_friction(&p.twin, "gear", &p.twin.parts["gear"], &at(5.0))
    };
    let held = with("hold").unwrap();
    assert!((held.mu - 0.15 * (1.36 - 12.15 / 20.0)).abs() < 1e-15 && held.outside_fit);
    let extrapolated = with("extrapolate").unwrap();
    assert_eq!((extrapolated.mu, extrapolated.outside_fit), (0.0, true), "never below 0");
    // Without a fitted range the same law is caught by its sign.
    let text = "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n\
                [[effects]]\nname = \"load_offset\"\na = 1.36\nb_n = -12.15\noutside_fit = \"error\"\n";
    let mut document = Document::parse("t", text).unwrap();
    let baseline =
        std::fs::read_to_string(crate::common::root().join("assets/configs/twin-baseline.toml")).unwrap();
    document.fill_from(&baseline.parse().unwrap(), gripgen::twin::DEFAULTED_SECTIONS);
    let twin = Twin::new(&document.read::<TwinFile>().unwrap()).unwrap();
    let error = grip_friction(&twin, "gear", &twin.parts["gear"], &at(5.0)).unwrap_err();
    assert!(error.to_string().contains("-0.1605"), "{error}");
}
