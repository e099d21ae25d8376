//! Knobs and handles: fluted, star, polygonal and smooth heads on a shank, with a blind bore or a foot.

use super::{Builder, Edge, Numbers, Section, Turned};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let radius = n.between(8.0, 22.0);
    let height = n.between(9.0, 26.0);
    let head = match n.whole(0, 5) {
        0 => Section::Lobed(radius, 0.05 * radius, n.one_of(&[8, 12, 16, 24])),
        1 => Section::Lobed(radius, 0.18 * radius, n.one_of(&[3, 4, 5, 6])),
        2 => Section::Polygon(radius, n.one_of(&[3, 4, 6, 8])),
        3 => Section::Oval(radius, radius * (0.4 + 0.4 * n.share())),
        4 => Section::Slotted(radius, 0.92 * radius, n.one_of(&[8, 12, 16])),
        _ => Section::Round(radius),
    };
    let top = match n.whole(0, 2) {
        0 => Edge::Chamfer(n.between(0.5, 2.0)),
        1 => Edge::Round(n.between(0.5, 3.0)),
        _ => Edge::Round(0.35 * radius.min(height)),
    };
    let bottom = n.edge(0.3, 1.5);
    let narrow = match head {
        Section::Oval(_, z) => z,
        Section::Lobed(r, wave, _) => r - wave,
        _ => 0.9 * radius,
    };
    let neck = narrow * (0.45 + 0.25 * n.share());
    let length = n.between(4.0, 16.0);
    let mut turned = Turned::new(240);
    // From the top down to the foot, so that the blind bore opens there.
    turned = turned.step([-height, 0.0], head, [top, bottom]).step(
        [0.05, length],
        Section::Round(neck),
        [Edge::Sharp, n.edge(0.2, 0.8)],
    );
    if n.chance(0.4) {
        let foot = n.between(2.0, 4.0);
        let wide = Section::Round(neck + n.between(1.0, 4.0));
        turned = turned.step([length + 0.05, length + foot], wide, [Edge::Sharp, Edge::Chamfer(0.4)]);
    }
    if n.chance(0.7) {
        let shaft = 0.55 * neck;
        let section = if n.chance(0.5) { Section::Flat(shaft, 0.6 * shaft) } else { Section::Round(shaft) };
        turned = turned.recess(-0.4 * height, section, Edge::Chamfer(0.2));
    }
    turned.add(b);
}
