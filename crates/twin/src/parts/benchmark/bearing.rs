//! Bearings: rolling ones of ordinary sizes, and plain bushes with and without a flange.

use super::{BallBearing, Builder, Numbers, RollerBearing, Section, Turned};
use std::f64::consts::PI;

/// Bore, outer diameter and width of ordinary bearings (ISO 15).
const SIZES_MM: [[f64; 3]; 14] = [
    [5.0, 16.0, 5.0],
    [6.0, 19.0, 6.0],
    [8.0, 22.0, 7.0],
    [8.0, 16.0, 5.0],
    [9.0, 26.0, 8.0],
    [10.0, 26.0, 8.0],
    [10.0, 30.0, 9.0],
    [12.0, 28.0, 8.0],
    [12.0, 32.0, 10.0],
    [15.0, 32.0, 9.0],
    [15.0, 35.0, 11.0],
    [17.0, 40.0, 12.0],
    [20.0, 42.0, 12.0],
    [20.0, 47.0, 14.0],
];

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let [bore_mm, outer_mm, width_mm] = n.one_of(&SIZES_MM);
    let wall = (outer_mm - bore_mm) / 2.0;
    let pitch = (outer_mm + bore_mm) / 2.0;
    let chamfer_mm = n.one_of(&[0.3, 0.5, 0.6]);
    match n.whole(0, 3) {
        0 => {
            let ball_mm = (0.55 + 0.1 * n.share()) * wall.min(width_mm);
            BallBearing {
                bore_mm,
                outer_mm,
                width_mm,
                balls: (0.8 * PI * pitch / ball_mm) as usize,
                ball_mm,
                inner_shoulder_mm: pitch - 0.8 * ball_mm,
                outer_shoulder_mm: pitch + 0.8 * ball_mm,
                chamfer_mm,
            }
            .add(b);
        }
        1 => {
            let roller_mm = (0.45 + 0.1 * n.share()) * wall;
            RollerBearing {
                bore_mm,
                outer_mm,
                width_mm,
                rollers: (0.85 * PI * pitch / roller_mm) as usize,
                roller_mm,
                roller_length_mm: 0.85 * width_mm,
                // A gap, so that rollers touch no ring and no two corners are one.
                inner_shoulder_mm: pitch - roller_mm - 0.1,
                outer_shoulder_mm: pitch + roller_mm + 0.1,
                chamfer_mm,
            }
            .add(b);
        }
        kind => {
            let length = n.between(0.8 * bore_mm, 2.2 * bore_mm).max(6.0);
            let outer = bore_mm / 2.0 + n.between(1.5, 4.0);
            let mut steps = vec![(length, Section::Round(outer))];
            if kind == 3 {
                steps.push((n.between(1.5, 4.0), Section::Round(outer + n.between(2.0, 6.0))));
            }
            let (edge, rim) = (n.edge(0.3, 1.0), n.edge(0.3, 0.8));
            Turned::new(96)
                .steps(-length / 2.0, &steps, edge)
                .bore(Section::Round(bore_mm / 2.0), rim)
                .add(b);
        }
    }
}
