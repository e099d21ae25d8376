//! Nuts: hexagonal, square, flanged, castle, cap and round with slots.

use super::{Builder, Edge, Numbers, Section, Turned};

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let thread = n.between(5.0, 24.0);
    let flats = thread * (1.55 + 0.2 * n.share()) / 2.0;
    let height = (thread * (0.6 + 0.6 * n.share())).max(5.0);
    let bore = Section::Round(0.44 * thread);
    let (edge, rim) = (n.edge(0.3, 1.0), Edge::Chamfer(0.07 * thread));
    let hexagon = Section::Polygon(flats, 6);
    let turned = Turned::new(96);
    let turned = match n.whole(0, 5) {
        0 => turned.step([0.0, height], hexagon, [edge; 2]).bore(bore, rim),
        1 => turned.step([0.0, height], Section::Polygon(flats, 4), [edge; 2]).bore(bore, rim),
        2 => turned
            .step([0.0, 0.2 * height], Section::Round(1.35 * flats), [Edge::Sharp, Edge::Round(0.1 * height)])
            .step([0.2 * height, 1.2 * height], hexagon, [Edge::Sharp, edge])
            .bore(bore, rim),
        3 => turned
            .step([0.0, 0.7 * height], hexagon, [edge, Edge::Sharp])
            .step(
                [0.7 * height, 1.1 * height],
                Section::Slotted(0.95 * flats, 0.5 * thread, 6),
                [Edge::Sharp; 2],
            )
            .bore(Section::Round(0.42 * thread), Edge::Sharp),
        4 => {
            let dome = 0.8 * flats;
            turned
                .step([-0.1 - dome, -0.1], Section::Round(0.9 * flats), [Edge::Round(dome), Edge::Sharp])
                .step([0.0, height], hexagon, [Edge::Sharp, edge])
                .recess(0.2 * height, bore, rim)
        }
        _ => turned
            .step([0.0, height], Section::Slotted(1.1 * flats, 0.95 * flats, 4), [edge; 2])
            .bore(bore, rim),
    };
    turned.add(b);
}
