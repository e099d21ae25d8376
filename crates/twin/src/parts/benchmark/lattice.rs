//! Lattices: plates of square, round, hexagonal or diamond cells, and cubes of struts.

use super::{Builder, Edge, Grid, Numbers, Prism, circle, cornered, polygon, rectangle};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    if n.chance(0.45) { struts(n, b) } else { plate(n, b) }
}

fn plate(n: &mut Numbers, b: &mut Builder) {
    let cell = n.between(4.0, 11.0);
    let wall = n.between(1.2, 2.6);
    let pitch = cell + wall;
    let (columns, rows) = (n.whole(2, (62.0 / pitch) as usize), n.whole(2, (40.0 / pitch) as usize));
    let kind = n.whole(0, 3);
    let rim = n.between(1.5, 4.0);
    let size = [pitch * columns as f64 + 2.0 * rim, pitch * rows as f64 + 2.0 * rim];
    let mut holes = Vec::new();
    for i in 0..columns {
        for j in 0..rows {
            // Every other row of hexagons is moved by half a cell, and one shorter.
            let moved = kind == 2 && j % 2 == 1;
            if moved && i + 1 == columns {
                continue;
            }
            let at = [
                pitch * (i as f64 + if moved { 1.0 } else { 0.5 }) - pitch * columns as f64 / 2.0,
                pitch * (j as f64 + 0.5) - pitch * rows as f64 / 2.0,
            ];
            holes.push(match kind {
                0 => cornered(&rectangle(at, [cell; 2]), Edge::Round(0.6)),
                1 => circle(at, cell / 2.0, 28),
                2 => polygon(at, 0.92 * cell, 6),
                _ => [[0.5, 0.0], [0.0, 0.5], [-0.5, 0.0], [0.0, -0.5]]
                    .map(|p| [at[0] + cell * p[0], at[1] + cell * p[1]])
                    .to_vec(),
            });
        }
    }
    let height = n.between(6.0, 24.0);
    Prism {
        outline: cornered(&rectangle([0.0; 2], size), Edge::Round(2.0)),
        holes,
        ends: [-height / 2.0, height / 2.0],
        edge: n.edge(0.1, 0.3),
        twist: 0.0,
    }
    .add(b);
}

/// Square struts along the edges of cubes.
fn struts(n: &mut Numbers, b: &mut Builder) {
    let strut = n.between(1.6, 4.0);
    let gap = n.between(3.0, 9.0);
    let cells = [0, 1, 2].map(|_| n.whole(1, 5).min((60.0 / (strut + gap)) as usize).max(1));
    let planes = cells.map(|count| {
        (0..=count)
            .flat_map(|i| [(strut + gap) * i as f64, (strut + gap) * i as f64 + strut])
            .collect::<Vec<f64>>()
    });
    let closed = n.chance(0.3);
    let full = move |at: [usize; 3]| {
        let solid = at.iter().filter(|&&i| i % 2 == 0).count();
        // A closed one has a floor and a lid across x.
        solid >= 2 || (closed && (at[0] == 0 || at[0] == 2 * cells[0]))
    };
    Grid { planes, full: &full }.add(b);
}
