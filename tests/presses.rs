//! Real presses of a ball, calibrated with and predicted.

use crate::common::root;
use gripgen::tactile::presses::{
    CalibrateOptions, DATA_PACK_BALL_M, DATA_PACK_METRES_PER_PX, PressSet, calibrate_presses, find_circle,
    reference_frame,
};
use std::time::Instant;

fn gelsight() -> PressSet {
    let path = root().join("../shared/real/taxim/gelsight/dataPack.npz");
    PressSet::from_data_pack(&std::fs::read(path).unwrap(), DATA_PACK_BALL_M, DATA_PACK_METRES_PER_PX)
        .unwrap()
}

/// 36 presses in four folds, everything refitted without the fold. On the same crops Taxim with its shadow reaches
/// MSE 44.9, PSNR 31.7 dB, SSIM 0.972; the averaged rest frame with a regression on normals 16.7, 36.1 dB, 0.979.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn presses_that_were_held_out_are_predicted() {
    let set = gelsight();
    assert_eq!(set.presses.len(), 36);
    let start = Instant::now();
    let found = calibrate_presses(&set, &CalibrateOptions::default()).unwrap();
    let mean = found.held_out.mean;
    println!("{:.1} s, {:?}", start.elapsed().as_secs_f64(), found.smoothness);
    for (name, s) in [("full", mean.full), ("400", mean.crop400), ("200", mean.crop200)] {
        println!("{name}: MSE {:.2}, PSNR {:.2} dB, SSIM {:.4}, L1 {:.2}", s.mse, s.psnr_db, s.ssim, s.l1);
    }
    assert!(found.doubtful.is_empty(), "{:?}", found.doubtful);
    assert!(mean.full.mse <= 12.0);
    assert!(mean.crop400.mse <= 12.0 && mean.crop400.psnr_db >= 37.5 && mean.crop400.ssim >= 0.98);
    // Measured: 6.5 and 14.5; a step back shows here before it shows above.
    assert!(mean.crop400.mse <= 7.0 && mean.crop200.mse <= 16.0);
}

/// The circles were marked by hand, and are themselves unsure by one or two pixels.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn circles_are_found_where_people_marked_them() {
    let set = gelsight();
    let rest = reference_frame(&set).unwrap();
    let ball_radius_px = set.ball_m / 2.0 / set.metres_per_px;
    let (mut centre, mut radius) = (Vec::new(), Vec::new());
    for press in &set.presses {
        let marked = press.circle.unwrap();
        let found = find_circle(&press.image, &rest, ball_radius_px).unwrap();
        centre.push((found.x_px - marked.x_px).hypot(found.y_px - marked.y_px));
        radius.push((found.radius_px - marked.radius_px).abs());
    }
    let quantiles = |mut list: Vec<f64>| {
        list.sort_by(f64::total_cmp);
        (list[list.len() / 2], list[list.len() - 1])
    };
    let (centre, radius) = (quantiles(centre), quantiles(radius));
    println!("median and worst: centre {centre:.1?} px, radius {radius:.1?} px");
    assert!(centre.0 < 2.0 && centre.1 < 6.0);
    assert!(radius.0 < 1.5 && radius.1 < 4.0);
}
