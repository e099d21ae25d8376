//! Screws: hexagonal, socket, pan, countersunk and flanged heads; the thread is a row of rings.

use super::{Builder, Edge, Numbers, Section, Turned};

/// Thread diameter, pitch, width across the flats of a hexagonal head (ISO 261, ISO 4017), of a socket (ISO 4762).
const SIZES_MM: [[f64; 4]; 7] = [
    [5.0, 0.8, 8.0, 4.0],
    [6.0, 1.0, 10.0, 5.0],
    [8.0, 1.25, 13.0, 6.0],
    [10.0, 1.5, 16.0, 8.0],
    [12.0, 1.75, 18.0, 10.0],
    [16.0, 2.0, 24.0, 14.0],
    [20.0, 2.5, 30.0, 17.0],
];

pub(super) fn make(n: &mut Numbers, b: &mut Builder) {
    let [thread, pitch, flats, socket] = n.one_of(&SIZES_MM);
    let length = n.between((2.0 * thread).max(16.0), (6.0 * thread).min(90.0));
    let threaded = length * (0.3 + 0.7 * n.share());
    let mut turned = Turned::new(96);
    // From the tip to the head.
    let mut x = -length;
    let (crest, root) = (thread / 2.0, thread / 2.0 - 0.61 * pitch);
    turned = turned.step(
        [x, x + 0.6 * pitch],
        Section::Round(root + 0.05),
        [Edge::Chamfer(0.3 * pitch), Edge::Sharp],
    );
    x += 0.6 * pitch;
    while x + pitch < threaded - length {
        // Crest and root of a ring, with flanks between them.
        turned = turned
            .step([x + 0.35 * pitch, x + 0.45 * pitch], Section::Round(crest), [Edge::Sharp; 2])
            .step([x + 0.85 * pitch, x + pitch], Section::Round(root), [Edge::Sharp; 2]);
        x += pitch;
    }
    turned = turned.step([x + 0.3 * pitch, 0.0], Section::Round(crest - 0.05), [Edge::Sharp; 2]);
    let edge = n.edge(0.3, 0.8);
    let one =
        |turned: Turned, length: f64, section: Section, edges| turned.step([0.0, length], section, edges);
    let turned = match n.whole(0, 4) {
        0 => one(turned, 0.65 * thread, Section::Polygon(flats / 2.0, 6), [Edge::Sharp, edge]),
        1 => one(turned, thread, Section::Round(0.75 * thread), [Edge::Sharp, edge]).recess(
            0.5 * thread,
            Section::Polygon(socket / 2.0, 6),
            Edge::Chamfer(0.2),
        ),
        2 => {
            let height = 0.6 * thread;
            one(turned, height, Section::Round(0.95 * thread), [Edge::Sharp, Edge::Round(0.9 * height)])
                .recess(0.4 * height, Section::Lobed(0.28 * thread, 0.05 * thread, 6), Edge::Sharp)
        }
        3 => turned
            .step(
                [0.05, 0.5 * thread],
                Section::Round(0.95 * thread),
                [Edge::Chamfer(0.4 * thread), Edge::Sharp],
            )
            .step([0.5 * thread, 0.55 * thread], Section::Round(0.95 * thread), [Edge::Sharp; 2])
            .recess(0.2 * thread, Section::Polygon(0.3 * thread, 6), Edge::Sharp),
        _ => turned
            .step(
                [0.0, 0.15 * thread],
                Section::Round(0.75 * flats),
                [Edge::Sharp, Edge::Round(0.1 * thread)],
            )
            .step([0.15 * thread, 0.8 * thread], Section::Polygon(flats / 2.0, 6), [Edge::Sharp, edge]),
    };
    turned.add(b);
}
