//! Tubes: round, square, hexagonal and oval, with collars, barbs and steps.

use super::{Builder, Edge, Numbers, Prism, Section, Turned, cornered, rectangle};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let outer = n.between(5.0, 20.0);
    let wall = n.between(1.2, 4.0).min(0.5 * outer);
    let length = n.between(20.0, 80.0);
    let edge = n.edge(0.2, 0.8).at_most(0.3 * wall);
    let turned = Turned::new(96);
    let bored = |turned: Turned, section| turned.bore(section, Edge::Chamfer(0.2 * wall));
    match n.whole(0, 5) {
        0 => {
            let steps = [(length, Section::Round(outer))];
            bored(turned.steps(0.0, &steps, edge), Section::Round(outer - wall)).add(b);
        }
        1 => {
            let sides = [2.0 * outer, (1.0 + n.share()) * outer];
            let inner = sides.map(|s| s - 2.0 * wall);
            Prism {
                outline: cornered(&rectangle([0.0; 2], sides), Edge::Round(0.8 * wall)),
                holes: vec![cornered(&rectangle([0.0; 2], inner), Edge::Round(0.3 * wall))],
                ends: [0.0, length],
                edge: edge.at_most(0.15 * wall),
                twist: 0.0,
            }
            .add(b);
        }
        2 => {
            let steps = [(length, Section::Polygon(outer, 6))];
            bored(turned.steps(0.0, &steps, edge), Section::Round(outer - wall)).add(b);
        }
        3 => {
            let other = outer * (0.45 + 0.35 * n.share());
            let steps = [(length, Section::Oval(outer, other))];
            bored(turned.steps(0.0, &steps, edge), Section::Oval(outer - 0.4 * wall, other - 0.4 * wall))
                .add(b);
        }
        4 => {
            // A nipple with barbs, and a collar.
            let mut turned = turned;
            let (count, step) = (n.whole(2, 5), n.between(3.0, 6.0));
            for k in 0..count {
                let x = step * k as f64;
                turned =
                    turned.step([x, x + 0.1], Section::Round(outer - 0.1 * wall), [Edge::Sharp; 2]).step(
                        [x + 0.8 * step, x + 0.9 * step],
                        Section::Round(outer + 0.3 * wall),
                        [Edge::Sharp; 2],
                    );
            }
            let end = step * count as f64;
            turned = turned
                .step([end + 0.2, end + 2.5], Section::Round(outer + wall), [Edge::Sharp, edge])
                .step([end + 2.5, end + 2.5 + 0.4 * length], Section::Round(outer), [Edge::Sharp, edge]);
            bored(turned, Section::Round(outer - wall)).add(b);
        }
        _ => {
            let (collar, wide) = (n.between(3.0, 10.0), n.between(2.0, 6.0));
            let steps = [
                (0.3 * length, Section::Round(outer)),
                (collar, Section::Round(outer + wide)),
                (0.5 * length, Section::Round(outer - 0.3 * wall)),
            ];
            bored(turned.steps(0.0, &steps, edge), Section::Round(outer - wall)).add(b);
        }
    }
}
