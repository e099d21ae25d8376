//! Errors of sensors on real presses that their fit has not seen, for three sensors:
//! `cargo xtask research press-errors FOLDER`, the folder of shared measured data (`../shared/real` where it is left out).
//! Mean squared errors in grey levels squared: whole frame, 400 x 400 and 200 x 200 px around the contact.

use crate::{StudyResult, arguments};
use gripgen::tactile::presses::{CalibrateOptions, PressSet, Scores, calibrate_presses, compare_presses};
use gripgen_cli::{PressGeometry, load_presses};
use std::error::Error;
use std::path::{Path, PathBuf};

/// Diameter of a ball and size of a pixel in millimetres, where no file says them.
type SizesMm = Option<(f64, f64)>;

/// Sets of presses: name and path.
const SETS: [(&str, &str, SizesMm); 3] = [
    ("Taxim's GelSight", "taxim/gelsight/dataPack.npz", None),
    ("shapes' GelSight", "gelsight_shapes/balls", Some((5.84, 0.059_259_259_2))),
    ("FOTS' GelSight", "gelsight_fots", Some((4.70, 0.051_072_5))),
];

pub fn run() -> StudyResult {
    let folder = PathBuf::from(arguments().next().unwrap_or_else(|| "../shared/real".into()));
    for (name, path, sizes_mm) in SETS {
        let set = load(&folder.join(path), sizes_mm)?;
        let found = calibrate_presses(&set, &CalibrateOptions::default())?;
        report(
            name,
            &format!("{} presses in {} folds", set.presses.len(), found.folds),
            &found.held_out.mean,
        );
        if let Some(sd) = found.sensor.press_gain_sd {
            println!("    gains of presses scatter by {:.3}, {:.3}, {:.3}", sd[0], sd[1], sd[2]);
        }
        // Twelve presses, all over the set; scored on the others.
        let every = set.presses.len() / 12;
        let part = |fitted: bool| PressSet {
            presses: (0..set.presses.len())
                .filter(|i| (i % every == 0 && i / every < 12) == fitted)
                .map(|i| set.presses[i].clone())
                .collect(),
            ..set.clone()
        };
        if every > 1 {
            let sensor =
                calibrate_presses(&part(true), &CalibrateOptions { folds: Some(2), ..Default::default() })?;
            report(name, "12 presses, the others", &compare_presses(&part(false), &sensor.sensor)?.mean);
        }
    }
    Ok(())
}

fn load(path: &Path, sizes_mm: SizesMm) -> Result<PressSet, Box<dyn Error>> {
    let geometry = PressGeometry {
        ball_m: sizes_mm.map(|(ball, _)| 1e-3 * ball),
        metres_per_px: sizes_mm.map(|(_, pixel)| 1e-3 * pixel),
    };
    Ok(load_presses(path, geometry)?)
}

fn report(name: &str, what: &str, mean: &Scores) {
    let [full, large, small] = [mean.full.mse, mean.crop400.mse, mean.crop200.mse];
    println!("{name}, {what}: frame {full:.2}, 400 px {large:.2}, 200 px {small:.2}");
}
