//! Cams: discs beside their axis, eggs, lobes, hearts and snails, with a bore and some with a hub.

use super::{
    Builder, Edge, Numbers, Point, Prism, Section, Turned, circle, cornered, rectangle, sin_cos_turn,
};

const AROUND: usize = 144;

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let base = n.between(9.0, 18.0);
    let lift = n.between(0.15, 0.5) * base;
    let kind = n.whole(0, 4);
    let lobes = n.whole(2, 4);
    let sharpness = n.one_of(&[2, 3, 4]);
    let outline: Vec<Point> = (0..AROUND)
        .map(|i| {
            let (s, c) = sin_cos_turn(i, AROUND);
            let share = i as f64 / AROUND as f64;
            let rise = match kind {
                // A circle about a point beside the axis.
                0 => lift * c + libm::sqrt(base * base - lift * lift * s * s) - base,
                // One lobe, round or pointed.
                1 => lift * libm::pow((1.0 + c) / 2.0, f64::from(sharpness)),
                2 => lift * 0.5 * (1.0 + sin_cos_turn(i * lobes, AROUND).1),
                // A heart: the same rise for the same turn, up and down.
                3 => 2.0 * lift * share.min(1.0 - share),
                // A snail: it rises all around and drops on a short way.
                _ => lift * if share < 0.94 { share / 0.94 } else { (1.0 - share) / 0.06 },
            };
            [(base + rise) * c, (base + rise) * s]
        })
        .collect();
    let bore = n.between(0.2, 0.42) * base;
    let hole = match n.whole(0, 2) {
        0 => cornered(&rectangle([0.0; 2], [1.5 * bore; 2]), Edge::Round(0.5)),
        _ => circle([0.0; 2], bore, 48),
    };
    let width = n.between(6.0, 18.0);
    let edge = n.edge(0.2, 0.8);
    Prism { outline, holes: vec![hole], ends: [-width / 2.0, width / 2.0], edge, twist: 0.0 }.add(b);
    if n.chance(0.4) {
        // A body of its own, a hundredth of a millimetre from the face.
        let hub = [(n.between(3.0, 9.0), Section::Round(0.75 * base))];
        Turned::new(48)
            .steps(width / 2.0 + 0.01, &hub, Edge::Chamfer(0.5))
            .bore(Section::Round(0.5 * base), Edge::Sharp)
            .add(b);
    }
}
