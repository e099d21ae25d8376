//! Shafts: one to five steps, some flat or beside the axis, with grooves, a bore.

use super::{Builder, Edge, Numbers, Section, Turned};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let count = n.whole(1, 5);
    let edge = n.edge(0.3, 1.2);
    let mut steps: Vec<(f64, Section)> = Vec::new();
    let thickest = n.between(9.0, 30.0);
    for i in 0..count {
        // Thickest in the middle, as shafts are.
        let from_middle = (i as f64 - (count - 1) as f64 / 2.0).abs();
        let radius =
            (thickest / 2.0 * (1.0 - 0.16 * from_middle) * (0.9 + 0.1 * n.share()) * 10.0).round() / 10.0;
        let length = n.between(14.0, 42.0).min(100.0 / count as f64);
        let section = match n.whole(0, 6) {
            0 => Section::Flat(radius, 0.7 * radius),
            1 => Section::TwoFlats(radius, 0.75 * radius),
            2 => Section::Beside(radius, 0.15 * radius),
            _ => Section::Round(radius),
        };
        if n.chance(0.3) && length > 16.0 {
            // A groove for a ring.
            let (width, depth) = (n.between(1.1, 2.2), n.between(0.4, 1.0));
            let at = length * n.one_of(&[0.25, 0.5, 0.8]);
            steps.push((at - width / 2.0, section));
            steps.push((width, Section::Round(0.7 * radius - depth.min(0.2 * radius))));
            steps.push((length - at - width / 2.0, section));
        } else {
            steps.push((length, section));
        }
    }
    let whole: f64 = steps.iter().map(|s| s.0).sum();
    let mut turned = Turned::new(96).steps(-whole / 2.0, &steps, edge);
    if n.chance(0.25) {
        turned = turned.bore(Section::Round(thickest * n.one_of(&[0.1, 0.15, 0.2])), Edge::Chamfer(0.3));
    }
    turned.add(b);
}
