//! Gears: spur and helical, with chamfered faces, a bore with or without a keyway, and some with a hub.

use super::{Builder, Edge, InvoluteGear, Numbers, Point, Prism, Section, Turned, circle, sin_cos_turn};
use std::f64::consts::PI;

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let module = n.one_of(&[0.8, 1.0, 1.25, 1.5, 2.0, 2.5]);
    let most = (52.0 / module) as usize;
    let teeth = n.whole(13, most.clamp(14, 44));
    let pitch = module * teeth as f64 / 2.0;
    let width = n.between(5.0, 20.0);
    let bore = (n.between(0.2, 0.45) * pitch).clamp(1.5, pitch - 1.25 * module - 2.0);
    let half = width / 2.0;
    let hole = if n.chance(0.4) && bore > 3.0 {
        keyed(bore, n.between(1.0, 2.0))
    } else {
        circle([0.0; 2], bore, 48)
    };
    Prism {
        outline: outline(module, teeth),
        holes: vec![hole],
        ends: [-half, half],
        edge: Edge::Chamfer(0.12 * module),
        twist: if n.chance(0.35) { n.share() * width / (12.0 * PI * pitch) * 2.0 } else { 0.0 },
    }
    .add(b);
    if n.chance(0.4) {
        // A body of its own, a hundredth of a millimetre from the face.
        let hub = (1.6 * bore).min(0.8 * (pitch - 1.25 * module)).max(bore + 1.0);
        let length = n.between(3.0, 10.0);
        Turned::new(48)
            .steps(half + 0.01, &[(length, Section::Round(hub))], n.edge(0.3, 0.8))
            .bore(Section::Round(bore + 0.005), Edge::Sharp)
            .add(b);
    }
}

/// Teeth, counter-clockwise; involute flanks on which the tooth gets thinner towards its tip.
fn outline(module: f64, teeth: usize) -> Vec<Point> {
    let gear = InvoluteGear { module_mm: module, teeth: teeth as u32, ..InvoluteGear::default() };
    let pitch = module * teeth as f64 / 2.0;
    let (root, tip) = (pitch - 1.25 * module, pitch + module);
    let half_root = gear.tooth_half_angle_rad(root).min(0.92 * PI / teeth as f64);
    let mut flank: Vec<(f64, f64)> = vec![(half_root, root)];
    for i in 1..=6 {
        let radius = root + (tip - root) * f64::from(i) / 6.0;
        flank.push((gear.tooth_half_angle_rad(radius).min(half_root), radius));
    }
    let tooth = flank.iter().map(|&(a, r)| (-a, r)).chain(flank.iter().rev().copied());
    let tooth: Vec<(f64, f64)> = tooth.collect();
    (0..teeth)
        .flat_map(|k| {
            let (ts, tc) = sin_cos_turn(k, teeth);
            tooth.iter().map(move |&(angle, r)| {
                let (s, c) = (libm::sin(angle), libm::cos(angle));
                [r * (tc * c - ts * s), r * (ts * c + tc * s)]
            })
        })
        .collect()
}

/// A bore with a keyway.
fn keyed(bore: f64, depth: f64) -> Vec<Point> {
    let half = 0.3 * bore;
    let start = libm::asin(0.3);
    let arc = (0..=40).map(|i| {
        let angle = start + (2.0 * PI - 2.0 * start) * f64::from(i) / 40.0;
        [bore * libm::cos(angle), bore * libm::sin(angle)]
    });
    arc.chain([[bore + depth, -half], [bore + depth, half]]).collect()
}
