//! Brackets: L, U, Z, T, hat and gusset profiles of sheet or cast, drawn out; bends and edges are rounded.

use super::{Builder, Edge, Numbers, Point, Prism, circle, cornered};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let t = n.between(2.5, 8.0);
    let (a, c) = (n.between(25.0, 60.0).max(5.0 * t), n.between(20.0, 50.0).max(4.0 * t));
    let width = n.between(14.0, 50.0);
    let mut holes = Vec::new();
    let profile: Vec<Point> = match n.whole(0, 5) {
        0 => vec![[0.0, 0.0], [a, 0.0], [a, t], [t, t], [t, c], [0.0, c]],
        1 => vec![[0.0, 0.0], [a, 0.0], [a, c], [a - t, c], [a - t, t], [t, t], [t, c], [0.0, c]],
        2 => vec![[0.0, 0.0], [a, 0.0], [a, t], [t, t], [t, c], [t - a, c], [t - a, c - t], [0.0, c - t]],
        3 => {
            let h = a / 2.0;
            vec![
                [-h, 0.0],
                [h, 0.0],
                [h, t],
                [t / 2.0, t],
                [t / 2.0, c],
                [-t / 2.0, c],
                [-t / 2.0, t],
                [-h, t],
            ]
        }
        4 => {
            let (h, f) = (a / 2.0, 0.4 * a);
            vec![
                [-h, 0.0],
                [-h + t, 0.0],
                [-h + t, c - t],
                [h - t, c - t],
                [h - t, 0.0],
                [h + f, 0.0],
                [h + f, t],
                [h, t],
                [h, c],
                [-h, c],
                [-h, t],
                [-h - f, t],
                [-h - f, 0.0],
            ]
        }
        _ => {
            let hole = circle([0.28 * a, 0.28 * c], 0.14 * a.min(c), 40);
            holes.push(hole);
            vec![[0.0, 0.0], [a, 0.0], [a, 1.2 * t], [1.2 * t, c], [0.0, c]]
        }
    };
    let round = n.between(0.15, 0.45) * t;
    let width = if holes.is_empty() { width } else { n.between(6.0, 20.0) };
    Prism {
        outline: cornered(&profile, Edge::Round(round)),
        holes,
        ends: [-width / 2.0, width / 2.0],
        edge: n.edge(0.2, 0.8).at_most(0.1 * t.max(4.0)),
        twist: 0.0,
    }
    .add(b);
}
