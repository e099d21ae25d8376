//! Marks of contacts that scatter.
//!
//! Circles marked by hand are unsure by a pixel or two, each in its own way, and at the rim of a contact that outweighs
//! most of what is looked for. Each press is therefore registered by itself. What the presses have in common in that,
//! as a whole and along the frame, is left in: it is what an effect of the library is about.

use super::work::{Work, for_each};
use gripgen_tactile::presses::{Circle, Zone};
use gripgen_twin::OpticsState;
use nalgebra::{DMatrix, DVector};

/// Presses from which on the common part has a slope along the frame.
const SLOPES_FROM: usize = 8;

/// Largest correction, in pixels of the images.
const MAX_PX: f64 = 8.0;

/// Rounds of registration.
const ROUNDS: usize = 2;

/// Moves the circles of the presses by what they deviate from a common displacement. Returns the root mean square of
/// the moves of centre and radius, in pixels; `None` without balls.
pub(super) fn straighten(work: &mut Work<'_>) -> Option<[f64; 2]> {
    let n = work.views.len();
    let marked = work.circles.clone();
    let balls = marked.iter().flatten().count();
    if balls == 0 {
        return None;
    }
    for _ in 0..ROUNDS {
        let off = for_each(n, |i| deviation(work, i));
        let moved: Vec<[f64; 3]> = (0..n)
            .map(|i| match (work.circles[i], marked[i]) {
                (Some(now), Some(then)) => {
                    let [dx, dy, dr] = off[i];
                    [
                        now.x_px - then.x_px + dx,
                        now.y_px - then.y_px + dy,
                        now.radius_px - then.radius_px + dr,
                    ]
                }
                _ => [0.0; 3],
            })
            .collect();
        let common = common(work, &moved);
        for i in 0..n {
            if let Some(then) = marked[i] {
                let d: [f64; 3] =
                    std::array::from_fn(|k| (moved[i][k] - common[i][k]).clamp(-MAX_PX, MAX_PX));
                work.circles[i] = Some(Circle {
                    x_px: then.x_px + d[0],
                    y_px: then.y_px + d[1],
                    radius_px: (then.radius_px + d[2]).max(1.0),
                });
            }
        }
        work.forget();
    }
    let square = |of: &dyn Fn(&Circle, &Circle) -> f64| {
        let all = work.circles.iter().zip(&marked).filter_map(|(a, b)| Some(of(a.as_ref()?, b.as_ref()?)));
        (all.sum::<f64>() / balls as f64).sqrt()
    };
    let centre = square(&|a, b| 0.5 * ((a.x_px - b.x_px).powi(2) + (a.y_px - b.y_px).powi(2)));
    let radius = square(&|a, b| (a.radius_px - b.radius_px).powi(2));
    Some([centre, radius])
}

/// How far one press lies off its circle, (x, y, radius) in pixels of the images: linear least squares on the contact
/// and its rim, beside an offset and a gain of each channel.
fn deviation(work: &Work<'_>, press: usize) -> [f64; 3] {
    let Some(circle) = work.circles[press] else { return [0.0; 3] };
    let plain = OpticsState::default();
    let view = &work.views[press];
    let drawn = |change: [f64; 3]| {
        let moved = Circle {
            x_px: circle.x_px + change[0],
            y_px: circle.y_px + change[1],
            radius_px: circle.radius_px + change[2],
        };
        view.levels(&work.scene, &view.contact(&work.scene, &plain, Some(&moved)), &plain)
    };
    let step = work.scene.factor() as f64;
    let here = drawn([0.0; 3]);
    let slopes = [0, 1, 2].map(|k| {
        let mut change = [0.0; 3];
        change[k] = 0.5 * step;
        let ahead = drawn(change);
        change[k] = -0.5 * step;
        let behind = drawn(change);
        (ahead, behind)
    });
    let mut normal = DMatrix::<f64>::zeros(9, 9);
    let mut right = DVector::<f64>::zeros(9);
    for (p, (zone, measured)) in view.zones().iter().zip(view.measured()).enumerate() {
        if !matches!(zone, Zone::Contact | Zone::Rim) {
            continue;
        }
        for c in 0..3 {
            let mut row = [0.0; 9];
            for k in 0..3 {
                row[k] = f64::from(slopes[k].0[p][c] - slopes[k].1[p][c]) / step;
            }
            row[3 + c] = 1.0;
            row[6 + c] = f64::from(here[p][c]) / 64.0;
            let residual = f64::from(measured[c] - here[p][c]);
            for a in 0..9 {
                right[a] += row[a] * residual;
                for b in 0..9 {
                    normal[(a, b)] += row[a] * row[b];
                }
            }
        }
    }
    for a in 0..9 {
        normal[(a, a)] += 1e-6 * normal[(a, a)].max(1e-9);
    }
    normal.cholesky().map_or([0.0; 3], |c| {
        let solved = c.solve(&right);
        [0, 1, 2].map(|k| solved[k].clamp(-MAX_PX, MAX_PX))
    })
}

/// The part of the moves that the presses share: their mean, with slopes along rows, columns and radii where there are
/// enough presses.
fn common(work: &Work<'_>, moved: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let n = moved.len();
    let grid = &work.scene.sensor().grid;
    let full = work.scene.factor() as f64;
    let terms = if n >= SLOPES_FROM { 3 } else { 1 };
    let row = |i: usize| -> [f64; 3] {
        let c = work.views[i].press().map(|p| *p.circle()).unwrap_or(Circle {
            x_px: 0.0,
            y_px: 0.0,
            radius_px: 1.0,
        });
        [1.0, c.x_px / (grid.width_px as f64 * full) - 0.5, c.y_px / (grid.height_px as f64 * full) - 0.5]
    };
    let design = DMatrix::from_fn(n, terms, |i, k| row(i)[k]);
    let mut normal = design.tr_mul(&design);
    for k in 0..terms {
        normal[(k, k)] += 1e-9 * n as f64;
    }
    let Some(solver) = normal.cholesky() else { return vec![[0.0; 3]; n] };
    let fitted = [0, 1, 2].map(|k| {
        let values = DVector::from_fn(n, |i, _| moved[i][k]);
        &design * solver.solve(&design.tr_mul(&values))
    });
    (0..n).map(|i| [0, 1, 2].map(|k| fitted[k][i])).collect()
}
