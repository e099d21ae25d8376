//! Gels to try: how a gel gives way around a contact, and its shape at rest.
//!
//! The surface around a contact is the undeformed part where it lies deeper than the rim of the contact, and around it the
//! part's overlap with the gel at rest, blurred by octaves from a widest kernel down to half a millimetre, the part put back
//! after each (Si & Yuan 2022 have kernels of another kind). Two numbers say what the gel does: the sink-in, the share of the
//! press that the gel gives way by at the rim, and the widest kernel, how far around the contact it gives way. Balls show
//! both: the first as the slope at the rim against that in the middle, the second as the halo. An elastic half-space has a
//! sink-in of 0.5 under a ball (Hertz 1882), a thin bonded layer less.

use super::moments::Moments;
use super::ridge::{Folds, Smoothness};
use super::samples::{GelModel, Samples};
use super::{Marked, domes};
use crate::convolve::Follow;
use crate::grid::Grid;
use crate::sensor::{GelShape, Pyramid};
use std::cell::OnceCell;

/// How the gel follows a part in the core of its contact. At least as deep draws balls
/// better (MSE held out 9.75 in place of 10.46, a sphere never shown 15 in place of 30) and a flat prism worse (142 in place of 94).
pub(super) const FOLLOW: Follow = Follow::Exactly;

/// Finest of the blurs, and the widest that are tried, in millimetres.
const FINEST_MM: f64 = 0.5;
const WIDEST_MM: [f64; 4] = [2.0, 4.0, 8.0, 16.0];
/// Largest kernel.
pub(in crate::presses) const MAX_KERNEL_PX: u32 = 255;

/// Sink-ins that are tried.
const SINK_INS: [f64; 9] = [0.2, 0.25, 0.3, 0.35, 0.4, 0.45, 0.5, 0.55, 0.6];

/// Where the search starts: a sink-in of 0.4, a widest kernel of 8 mm.
const USUAL: Choice = Choice { shape: 0, sink_in: 4, widest: 2 };

/// A dome has to be better than a flat gel by this factor.
const DOME_GAIN: f64 = 0.98;

/// One gel among those that are tried, by its places in the lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Choice {
    shape: usize,
    sink_in: usize,
    widest: usize,
}

/// A gel to try, with what the presses look like on it.
pub(super) struct Candidate {
    pub(super) gel: GelModel,
    pub(super) samples: Vec<Samples>,
    moments: Vec<Moments>,
}

impl Candidate {
    pub(super) fn new(gel: GelModel, marked: &[Marked<'_>], ball_m: f64, grid: &Grid) -> Self {
        let samples: Vec<Samples> = marked
            .iter()
            .enumerate()
            .map(|(i, marked)| Samples::draw(i, marked, ball_m, grid, &gel))
            .collect();
        let moments = samples.iter().map(Moments::of_inputs).collect();
        Self { gel, samples, moments }
    }

    /// The sums of some presses with their colours against a rest frame.
    pub(super) fn coloured(
        &self,
        marked: &[Marked<'_>],
        which: &[usize],
        rest: &[Vec<f32>; 3],
    ) -> Vec<Moments> {
        which
            .iter()
            .map(|&i| {
                let mut moments = self.moments[i].clone();
                moments.set_targets(&self.samples[i], &self.samples[i].targets(marked[i].0, rest));
                moments
            })
            .collect()
    }
}

/// All gels that may be tried for a set of presses. Each is drawn once, when it is first asked for.
pub(super) struct Gels<'a> {
    marked: &'a [Marked<'a>],
    ball_m: f64,
    grid: Grid,
    shapes: Vec<GelShape>,
    kernels_px: Vec<Vec<u32>>,
    drawn: Vec<OnceCell<Candidate>>,
}

impl<'a> Gels<'a> {
    /// `shape`: the gel at rest; `None`: flat or a dome, by what fits.
    pub(super) fn new(shape: Option<&GelShape>, marked: &'a [Marked<'a>], ball_m: f64, grid: Grid) -> Self {
        let shapes = match shape {
            Some(shape) => vec![shape.clone()],
            None => std::iter::once(GelShape::Flat).chain(domes(&grid)).collect(),
        };
        let mut kernels_px: Vec<Vec<u32>> = WIDEST_MM.iter().map(|&mm| octaves(mm, &grid)).collect();
        kernels_px.dedup();
        let drawn = (0..shapes.len() * SINK_INS.len() * kernels_px.len()).map(|_| OnceCell::new()).collect();
        Self { marked, ball_m, grid, shapes, kernels_px, drawn }
    }

    fn candidate(&self, choice: Choice) -> &Candidate {
        let at = (choice.shape * SINK_INS.len() + choice.sink_in) * self.kernels_px.len() + choice.widest;
        self.drawn[at].get_or_init(|| {
            let share = SINK_INS[choice.sink_in];
            let pyramid = Pyramid {
                kernels_px: self.kernels_px[choice.widest].clone(),
                restore_depth_fraction: share,
                sink_in_fraction: share,
                follow: FOLLOW,
            };
            let gel = GelModel { shape: self.shapes[choice.shape].clone(), pyramid };
            Candidate::new(gel, self.marked, self.ball_m, &self.grid)
        })
    }

    /// The gel with the least error on presses of `seen` that are held out in turn, and how freely its colours may vary:
    /// uphill in sink-in and widest kernel by turns, then the domes.
    pub(super) fn choose(&self, seen: &[usize], rest: &[Vec<f32>; 3]) -> (&Candidate, Smoothness) {
        let folds_of =
            |choice: Choice| Folds::split(&self.candidate(choice).coloured(self.marked, seen, rest), 4);
        let error_of = |choice: Choice| folds_of(choice).error(&Smoothness::USUAL);
        let mut best = Choice { widest: USUAL.widest.min(self.kernels_px.len() - 1), ..USUAL };
        let mut least = error_of(best);
        let steps: [fn(&Choice, bool) -> Choice; 2] = [
            |c, up| Choice { sink_in: if up { c.sink_in + 1 } else { c.sink_in.wrapping_sub(1) }, ..*c },
            |c, up| Choice { widest: if up { c.widest + 1 } else { c.widest.wrapping_sub(1) }, ..*c },
        ];
        let exists = |c: &Choice| c.sink_in < SINK_INS.len() && c.widest < self.kernels_px.len();
        loop {
            let before = best;
            for step in steps {
                for up in [false, true] {
                    loop {
                        let next = step(&best, up);
                        if !exists(&next) {
                            break;
                        }
                        let error = error_of(next);
                        if error >= least {
                            break;
                        }
                        (best, least) = (next, error);
                    }
                }
            }
            if best == before {
                break;
            }
        }
        for shape in 1..self.shapes.len() {
            let domed = Choice { shape, ..best };
            let error = error_of(domed);
            if error < DOME_GAIN * least {
                (best, least) = (domed, error);
            }
        }
        (self.candidate(best), folds_of(best).choose())
    }
}

/// Kernels from a widest one down by octaves.
fn octaves(widest_mm: f64, grid: &Grid) -> Vec<u32> {
    let mm_per_px = grid.metres_per_px * 1e3;
    let mut kernels_px = Vec::new();
    let mut mm = widest_mm;
    while mm >= FINEST_MM {
        kernels_px.push((2 * (mm / mm_per_px / 2.0).floor() as u32 + 1).min(MAX_KERNEL_PX));
        mm /= 2.0;
    }
    kernels_px.retain(|&k| k >= 3);
    kernels_px.dedup();
    kernels_px
}
