//! Plates with holes: rectangles, triangles, hexagons, discs, links; round holes, slots and windows.

use super::{Builder, Edge, Numbers, Point, Prism, circle, cornered, polygon, rectangle, sin_cos_turn, slot};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let (a, c) = (n.between(28.0, 75.0), n.between(24.0, 55.0));
    let corner = Edge::Round(n.between(2.0, 6.0));
    let mut holes = Vec::new();
    let outline = match n.whole(0, 4) {
        0 => {
            let (columns, rows) = (n.whole(1, 4), n.whole(1, 3));
            let (dy, dz) = (a / columns as f64, c / rows as f64);
            let radius = n.between(0.15, 0.33) * dy.min(dz);
            for i in 0..columns {
                for j in 0..rows {
                    let at = [dy * (i as f64 + 0.5) - a / 2.0, dz * (j as f64 + 0.5) - c / 2.0];
                    holes.push(circle(at, radius, 40));
                }
            }
            cornered(&rectangle([0.0; 2], [a, c]), corner)
        }
        1 => {
            holes.push(slot([0.0; 2], n.between(0.3, 0.5) * a, n.between(4.0, 0.4 * c)));
            for side in [-1.0, 1.0] {
                holes.push(circle([side * 0.39 * a, 0.0], n.between(2.0, 3.4), 32));
            }
            cornered(&rectangle([0.0; 2], [a, c]), corner)
        }
        2 => {
            // A flange: holes on a circle, one in the middle.
            let (outer, count) = (n.between(15.0, 32.0), n.whole(3, 8));
            let radius = n.between(1.5, 3.0);
            for k in 0..count {
                let (s, cosine) = sin_cos_turn(k, count);
                holes.push(circle([0.72 * outer * cosine, 0.72 * outer * s], radius, 24));
            }
            holes.push(circle([0.0; 2], outer * n.between(0.2, 0.5), 64));
            circle([0.0; 2], outer, 96)
        }
        3 => {
            let sides = n.one_of(&[3, 5, 6]);
            let across = n.between(26.0, 50.0);
            holes.push(match n.chance(0.5) {
                true => circle([0.0; 2], 0.25 * across, 48),
                false => cornered(&rectangle([0.0; 2], [0.4 * across, 0.3 * across]), Edge::Round(1.5)),
            });
            cornered(&polygon([0.0; 2], across, sides), corner)
        }
        _ => link(n, a, &mut holes),
    };
    let thickness = n.between(3.0, 16.0);
    let edge = n.edge(0.2, 1.0);
    Prism { outline, holes, ends: [-thickness / 2.0, thickness / 2.0], edge, twist: 0.0 }.add(b);
}

/// Two eyes of different size and what joins them.
fn link(n: &mut Numbers, length: f64, holes: &mut Vec<Vec<Point>>) -> Vec<Point> {
    let (big, small) = (n.between(9.0, 16.0), n.between(6.0, 9.0));
    let half = length / 2.0;
    // Tangents of both circles leave them in this direction.
    let tilt = libm::asin((big - small) / length);
    let turn = std::f64::consts::PI;
    let arc = |middle: f64, radius: f64, from: f64, to: f64| {
        (0..=24).map(move |i| {
            let angle = from + (to - from) * f64::from(i) / 24.0;
            [middle + radius * libm::cos(angle), radius * libm::sin(angle)]
        })
    };
    let quarter = turn / 2.0;
    let right = arc(half, small, -quarter + tilt, quarter - tilt);
    let left = arc(-half, big, quarter - tilt, 2.0 * turn - quarter + tilt);
    holes.push(circle([-half, 0.0], 0.5 * big, 40));
    holes.push(circle([half, 0.0], 0.5 * small, 40));
    right.chain(left).collect()
}
