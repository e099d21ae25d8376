//! Bodies about the x axis whose cross-sections are seen from it without hiding anything: round, flattened, hexagonal, lobed.

use super::outline::Edge;
use super::{Builder, sin_cos_turn};

/// A cross-section: a radius for each direction. Lengths in millimetres.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Section {
    /// A circle of this radius.
    Round(f64),
    /// A regular polygon: distance from the axis to the middle of each side, number of sides.
    Polygon(f64, usize),
    /// A circle with a flat: radius, and distance of the flat from the axis, towards +y.
    Flat(f64, f64),
    /// A circle with two flats opposite each other.
    TwoFlats(f64, f64),
    /// Waves about a circle: mean radius, height of the waves above it, number.
    Lobed(f64, f64, usize),
    /// Half axes along y and z.
    Oval(f64, f64),
    /// A circle of a radius whose middle lies so far off, towards +y.
    Beside(f64, f64),
    /// Deep, narrow slots cut into a circle: outer radius, radius at their floor, number.
    Slotted(f64, f64, usize),
}

impl Section {
    /// Radius in direction `i` of `n`, from +y towards +z.
    fn radius(self, i: usize, n: usize) -> f64 {
        let (s, c) = sin_cos_turn(i, n);
        match self {
            Section::Round(r) => r,
            Section::Polygon(inner, sides) => {
                // Direction from the middle of the nearest side.
                let step = n as f64 / sides as f64;
                let off = i as f64 - (i as f64 / step).round() * step;
                inner / libm::cos(std::f64::consts::TAU * off / n as f64)
            }
            Section::Flat(r, flat) => {
                if c > 0.0 {
                    r.min(flat / c)
                } else {
                    r
                }
            }
            Section::TwoFlats(r, flat) => r.min(flat / c.abs().max(1e-9)),
            Section::Lobed(r, wave, lobes) => r + wave * sin_cos_turn(i * lobes, n).1,
            Section::Oval(y, z) => y * z / libm::hypot(z * c, y * s),
            Section::Beside(r, off) => off * c + libm::sqrt((r * r - off * off * s * s).max(0.0)),
            Section::Slotted(outer, floor, slots) => {
                let along = (i * slots) % n;
                if 10 * along < 2 * n { floor } else { outer }
            }
        }
    }

    /// Mean radius.
    fn mean(self) -> f64 {
        (0..48).map(|i| self.radius(i, 48)).sum::<f64>() / 48.0
    }
}

/// A turned body, built from steps along x.
#[derive(Debug, Clone)]
pub(super) struct Turned {
    segments: usize,
    outside: Vec<(f64, Section, f64)>,
    inside: Vec<(f64, Section, f64)>,
    through: bool,
}

impl Turned {
    /// With so many facets around; a multiple of the number of sides and lobes.
    pub(super) fn new(segments: usize) -> Self {
        Self { segments, outside: Vec::new(), inside: Vec::new(), through: false }
    }

    /// A step of the outside from one x to the next, with its edges at both ends. Steps come in the order of x.
    pub(super) fn step(mut self, x: [f64; 2], section: Section, edges: [Edge; 2]) -> Self {
        let first = edges[0].steps().into_iter().map(|(dx, inside)| (x[0] + dx, section, -inside));
        let last = edges[1].steps().into_iter().rev().map(|(dx, inside)| (x[1] - dx, section, -inside));
        self.outside.extend(first.chain(last));
        self
    }

    /// Steps of the outside from `from` on, each with a length. Edges that stick out are finished, those in a corner are sharp.
    pub(super) fn steps(mut self, from: f64, steps: &[(f64, Section)], edge: Edge) -> Self {
        let mut x = from;
        for (i, &(length, section)) in steps.iter().enumerate() {
            let own = section.mean();
            let most = (0.3 * length).min(0.3 * own);
            let sticks_out = |beside: Option<&(f64, Section)>| match beside {
                Some((_, other)) if other.mean() >= own - 0.05 => Edge::Sharp,
                Some((_, other)) => edge.at_most(most.min(0.8 * (own - other.mean()))),
                None => edge.at_most(most),
            };
            let edges =
                [sticks_out(i.checked_sub(1).and_then(|j| steps.get(j))), sticks_out(steps.get(i + 1))];
            self = self.step([x, x + length], section, edges);
            x += length;
        }
        self
    }

    /// A hole through the whole length, whose rims are finished.
    pub(super) fn bore(mut self, section: Section, edge: Edge) -> Self {
        let (low, high) = (self.outside[0].0, self.outside[self.outside.len() - 1].0);
        self.hole([low, high], section, [edge, edge]);
        self.through = true;
        self
    }

    /// A hole from the far end down to a floor at `x`.
    pub(super) fn recess(mut self, x: f64, section: Section, edge: Edge) -> Self {
        let high = self.outside[self.outside.len() - 1].0;
        self.hole([x, high], section, [Edge::Sharp, edge]);
        self
    }

    fn hole(&mut self, x: [f64; 2], section: Section, edges: [Edge; 2]) {
        let first = edges[0].steps().into_iter().map(|(dx, wider)| (x[0] + dx, section, wider));
        let last = edges[1].steps().into_iter().rev().map(|(dx, wider)| (x[1] - dx, section, wider));
        self.inside.extend(first.chain(last));
    }

    /// Adds the body to a mesh.
    pub(super) fn add(&self, b: &mut Builder) {
        // The profile runs along the outside, back along the inside, so that the body lies to its right: it is turned around below.
        let mut profile = self.outside.clone();
        profile.extend(self.inside.iter().rev());
        let mut rings: Vec<Vec<u32>> = Vec::new();
        if !self.through {
            let pole = b.vertex(profile[0].0 * 1e-3, 0.0, 0.0);
            rings.push(vec![pole; self.segments]);
        }
        let mut before: Option<(f64, Vec<f64>)> = None;
        for &(x, section, wider) in &profile {
            let radii: Vec<f64> =
                (0..self.segments).map(|i| (section.radius(i, self.segments) + wider).max(0.05)).collect();
            if before.as_ref() == Some(&(x, radii.clone())) {
                continue;
            }
            let ring = radii.iter().enumerate().map(|(i, r)| {
                let (s, c) = sin_cos_turn(i, self.segments);
                b.vertex(x * 1e-3, r * c * 1e-3, r * s * 1e-3)
            });
            rings.push(ring.collect());
            before = Some((x, radii));
        }
        if !self.through {
            let last = profile[profile.len() - 1].0;
            let pole = b.vertex(last * 1e-3, 0.0, 0.0);
            rings.push(vec![pole; self.segments]);
        }
        let pairs = if self.through { rings.len() } else { rings.len() - 1 };
        for p in 0..pairs {
            let (ring, next) = (&rings[p], &rings[(p + 1) % rings.len()]);
            for i in 0..self.segments {
                let j = (i + 1) % self.segments;
                if ring[i] != ring[j] {
                    b.triangles.push([ring[i], ring[j], next[j]]);
                }
                if next[i] != next[j] {
                    b.triangles.push([ring[i], next[j], next[i]]);
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    fn volume_mm3(turned: &Turned) -> f64 {
        let mut b = Builder::default();
        turned.add(&mut b);
        let look = b.finish().look();
        assert!(
            look.is_closed() && look.turned_edges + look.crowded_edges == 0 && look.bodies == 1,
            "{look:?}"
        );
        look.volume_m3 * 1e9
    }

    #[test]
    fn turned_bodies_are_closed_and_have_their_volumes() {
        let sharp = [Edge::Sharp; 2];
        let rod = Turned::new(360).step([0.0, 10.0], Section::Round(5.0), sharp);
        assert!((volume_mm3(&rod) / (PI * 250.0) - 1.0).abs() < 1e-3);
        let tube = rod.clone().bore(Section::Round(3.0), Edge::Sharp);
        assert!((volume_mm3(&tube) / (PI * 160.0) - 1.0).abs() < 1e-3);
        let cup = rod.recess(4.0, Section::Round(3.0), Edge::Chamfer(0.2));
        assert!((volume_mm3(&cup) / (PI * (250.0 - 54.0)) - 1.0).abs() < 1e-2);
        let nut = Turned::new(96).step([0.0, 5.0], Section::Polygon(6.0, 6), sharp);
        assert!((volume_mm3(&nut) / (5.0 * 2.0 * 3.0_f64.sqrt() * 36.0) - 1.0).abs() < 1e-9, "exact corners");
        let oval = Turned::new(360).step([0.0, 5.0], Section::Oval(4.0, 6.0), sharp);
        assert!((volume_mm3(&oval) / (PI * 24.0 * 5.0) - 1.0).abs() < 1e-3);
        let beside = Turned::new(360).step([0.0, 5.0], Section::Beside(6.0, 2.0), sharp);
        assert!((volume_mm3(&beside) / (PI * 36.0 * 5.0) - 1.0).abs() < 1e-3);
    }

    /// A shoulder has no groove: only edges that stick out are finished.
    #[test]
    fn shoulders_are_sharp_and_edges_are_cut() {
        let steps = [(10.0, Section::Round(4.0)), (10.0, Section::Round(8.0)), (10.0, Section::Round(4.0))];
        let cut = volume_mm3(&Turned::new(360).steps(0.0, &steps, Edge::Chamfer(1.0)));
        let plain = PI * (16.0 * 20.0 + 64.0 * 10.0);
        // A ring of half a square millimetre on each of four edges.
        let rings = PI * (2.0 * 0.5 * 2.0 * (8.0 - 1.0 / 3.0) + 2.0 * 0.5 * 2.0 * (4.0 - 1.0 / 3.0));
        assert!((cut - (plain - rings)).abs() < 2.0, "{cut}, {plain} less {rings}");
    }
}
