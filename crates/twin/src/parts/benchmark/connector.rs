//! Connectors: housings with rows of cavities, with pins in them or without, round ones with a collar, and trapezoids.

use super::{Builder, Edge, Numbers, Prism, Section, Turned, circle, cornered, rectangle};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    if n.chance(0.3) { round(n, b) } else { block(n, b) }
}

fn block(n: &mut Numbers, b: &mut Builder) {
    let pitch = n.one_of(&[3.96, 5.0, 5.08, 7.5, 10.0]);
    let (columns, rows) = (n.whole(2, if pitch > 6.0 { 5 } else { 8 }), n.whole(1, 3));
    let wall = n.between(1.5, 4.0);
    let size = [pitch * columns as f64 + 2.0 * wall, pitch * rows as f64 + 2.0 * wall];
    let height = n.between(9.0, 24.0);
    let cavity = pitch * (0.55 + 0.2 * n.share());
    let edge = n.edge(0.2, 0.4);
    let round_cavities = n.chance(0.4);
    let pins = n.chance(0.6);
    let sticks_out = n.between(0.0, 5.0);
    let (mut holes, mut pin_prisms) = (Vec::new(), Vec::new());
    for i in 0..columns {
        for j in 0..rows {
            let at = [
                pitch * (i as f64 + 0.5) - pitch * columns as f64 / 2.0,
                pitch * (j as f64 + 0.5) - pitch * rows as f64 / 2.0,
            ];
            holes.push(match round_cavities {
                true => circle(at, cavity / 2.0, 24),
                false => cornered(&rectangle(at, [cavity; 2]), Edge::Round(0.4)),
            });
            if pins {
                pin_prisms.push(Prism {
                    outline: rectangle(at, [0.3 * pitch; 2]),
                    holes: vec![],
                    ends: [-height / 2.0 + 2.0, height / 2.0 + sticks_out],
                    edge: Edge::Chamfer(0.3),
                    twist: 0.0,
                });
            }
        }
    }
    let outline = match n.whole(0, 2) {
        0 => cornered(&rectangle([0.0; 2], size), Edge::Round(1.0)),
        // Wider at one side, so that it goes in one way only.
        1 => {
            let [y, z] = size.map(|s| s / 2.0);
            let lean = 0.18 * size[1];
            let outline = [[-y - lean, -z], [y + lean, -z], [y + 0.05, z], [-y - 0.05, z]];
            cornered(&outline, Edge::Round(1.2))
        }
        _ => {
            // A key on one side.
            let [y, z] = size.map(|s| s / 2.0);
            let k = 0.25 * size[0];
            let outline = [
                [-y, -z],
                [y, -z],
                [y, z],
                [k / 2.0, z],
                [k / 2.0, z + 1.5],
                [-k / 2.0, z + 1.5],
                [-k / 2.0, z],
                [-y, z],
            ];
            cornered(&outline, Edge::Round(0.5))
        }
    };
    Prism { outline, holes, ends: [-height / 2.0, height / 2.0], edge, twist: 0.0 }.add(b);
    pin_prisms.iter().for_each(|pin| pin.add(b));
}

fn round(n: &mut Numbers, b: &mut Builder) {
    let radius = n.between(7.0, 16.0);
    let edge = n.edge(0.3, 1.0);
    let grip = match n.chance(0.5) {
        true => Section::Lobed(1.25 * radius, 0.04 * radius, n.one_of(&[12, 16, 24])),
        false => Section::Polygon(1.25 * radius, 6),
    };
    let steps = [
        (n.between(8.0, 16.0), Section::Round(radius)),
        (n.between(6.0, 14.0), grip),
        (n.between(6.0, 18.0), Section::Round(0.85 * radius)),
    ];
    let depth: f64 = steps.iter().map(|s| s.0).sum();
    let floor = depth - 0.7 * steps[2].0;
    Turned::new(96)
        .steps(0.0, &steps, edge)
        .recess(floor, Section::Round(0.7 * radius), Edge::Chamfer(0.3))
        .add(b);
    for k in 0..n.whole(2, 6) {
        // Pins on the floor, a hundredth of a millimetre above it.
        let at = circle([0.0; 2], 0.4 * radius, 7)[k];
        let pin = circle(at, 0.1 * radius, 16);
        let ends = [floor + 0.01, depth - 1.0];
        Prism { outline: pin, holes: vec![], ends, edge: Edge::Chamfer(0.2), twist: 0.0 }.add(b);
    }
}
