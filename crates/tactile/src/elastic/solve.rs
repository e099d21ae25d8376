//! The contact problem on one grid: Polonsky & Keer 1999, "A numerical method for solving rough contact problems
//! based on the multi-level multi-summation and conjugate gradient techniques", Wear 231, section 3.

use crate::fft::Convolver;

/// Most steps; contacts of 50 to 300 pixels across take 7 to 20.
const MAX_STEPS: usize = 300;

/// A part over a gel. Lengths in pixels of this grid, pressures in contact moduli.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Problem {
    pub(super) width: usize,
    pub(super) height: usize,
    /// Height of the part's surface, 0 at its top; `-inf` where there is none.
    pub(super) below: Vec<f64>,
    /// Sum of the pressures.
    pub(super) load: f64,
}

/// A solution.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Contact {
    pub(super) pressure: Vec<f64>,
    /// How far the top lies in the gel.
    pub(super) press: f64,
}

impl Problem {
    /// The whole grid as a region.
    pub(super) fn whole(&self) -> [usize; 4] {
        [0, self.width, 0, self.height]
    }

    /// The same part in pixels `scale` times as wide, each as high as the highest in it.
    pub(super) fn binned(&self, scale: usize) -> Problem {
        let (width, height) = (self.width.div_ceil(scale), self.height.div_ceil(scale));
        let mut below = vec![f64::NEG_INFINITY; width * height];
        for y in 0..self.height {
            for x in 0..self.width {
                let bin = &mut below[y / scale * width + x / scale];
                *bin = bin.max(self.below[y * self.width + x] / scale as f64);
            }
        }
        Problem { width, height, below, load: self.load / (scale * scale) as f64 }
    }

    /// A pressure to begin with: that of a Winkler bed as stiff as a half-space under a contact of this size.
    pub(super) fn first_guess(&self) -> Vec<f64> {
        let wanted = self.load;
        let load = |press: f64| {
            let (mut sum, mut count) = (0.0, 0.0);
            for b in self.below.iter().filter(|&&b| b + press > 0.0) {
                sum += b + press;
                count += 1.0;
            }
            // The mean pressure of a stamp of area A is d / (pi / 2 sqrt(A / pi)).
            if count > 0.0 { sum / (0.886 * f64::sqrt(count)) } else { 0.0 }
        };
        let (mut low, mut high) = (0.0, 1e-3);
        while load(high) < wanted && high < 1e6 {
            high *= 2.0;
        }
        for _ in 0..40 {
            let middle = 0.5 * (low + high);
            *(if load(middle) < wanted { &mut low } else { &mut high }) = middle;
        }
        self.below.iter().map(|b| (b + high).max(0.0)).collect()
    }

    /// The region of the contact that a grid twice as coarse found, with three of its pixels around it.
    pub(super) fn around(&self, coarse: &Problem, contact: &Contact) -> [usize; 4] {
        let [mut left, mut right, mut top, mut bottom] = [usize::MAX, 0, usize::MAX, 0];
        for (i, _) in contact.pressure.iter().enumerate().filter(|(_, p)| **p > 0.0) {
            let (x, y) = (i % coarse.width, i / coarse.width);
            (left, right) = (left.min(x), right.max(x + 1));
            (top, bottom) = (top.min(y), bottom.max(y + 1));
        }
        let low = |v: usize| 2 * v.saturating_sub(3);
        [low(left), (2 * (right + 3)).min(self.width), low(top), (2 * (bottom + 3)).min(self.height)]
    }

    /// The pressure of a grid twice as coarse, between its pixels on a line.
    pub(super) fn refined(&self, coarse: &Problem, contact: &Contact) -> Vec<f64> {
        let near = |v: usize, n: usize| {
            let (here, step) = (v / 2, v % 2);
            let other = if step == 0 { here.saturating_sub(1) } else { (here + 1).min(n - 1) };
            [(here, 0.75), (other, 0.25)]
        };
        let mut pressure = Vec::with_capacity(self.below.len());
        for y in 0..self.height {
            for x in 0..self.width {
                let mut sum = 0.0;
                for (v, wy) in near(y, coarse.height) {
                    for (u, wx) in near(x, coarse.width) {
                        sum += wx * wy * contact.pressure[v * coarse.width + u];
                    }
                }
                pressure.push(sum);
            }
        }
        pressure
    }

    /// The part of the problem in `[left, right, top, bottom]`.
    pub(super) fn cut(&self, region: [usize; 4]) -> Problem {
        let [left, right, top, bottom] = region;
        let below = self.cut_values(region, &self.below);
        Problem { width: right - left, height: bottom - top, below, load: self.load }
    }

    pub(super) fn cut_values(&self, [left, right, top, bottom]: [usize; 4], values: &[f64]) -> Vec<f64> {
        (top..bottom).flat_map(|y| &values[y * self.width + left..y * self.width + right]).copied().collect()
    }

    /// The inverse of `cut_values`, zeros around.
    pub(super) fn pasted(&self, [left, right, top, bottom]: [usize; 4], values: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.below.len()];
        for (y, row) in (top..bottom).zip(values.chunks_exact(right - left)) {
            all[y * self.width + left..y * self.width + right].copy_from_slice(row);
        }
        all
    }
}

/// Conjugate gradients over the pixels in contact. Each step moves the pressure against the gap, drops pixels that
/// would pull, takes in pixels where part and gel overlap, and scales to the load. Where Polonsky & Keer begin anew
/// when the contact grows, the factor of Polak & Ribiere forgets as much as it has to: half as many steps on stamps.
///
/// It stands when the root mean square of the gap over the contact is below `tolerance` of the press.
pub(super) fn solve(problem: &Problem, start: &[f64], convolver: &mut Convolver, tolerance: f64) -> Contact {
    let n = problem.below.len();
    let below = &problem.below;
    let mut p: Vec<f64> =
        start.iter().zip(below).map(|(&p, b)| if b.is_finite() { p } else { 0.0 }).collect();
    let mut scale = problem.load / p.iter().sum::<f64>();
    if !scale.is_finite() {
        // Nothing of the coarse contact is left on this grid.
        p = below.iter().map(|&b| if b.is_finite() { 1.0 } else { 0.0 }).collect();
        scale = problem.load / p.iter().sum::<f64>();
    }
    p.iter_mut().for_each(|p| *p *= scale);
    let (mut u, mut direction, mut pull) = (vec![0.0; n], vec![0.0; n], vec![0.0; n]);
    convolver.apply(&p, &mut u);
    let (mut last, mut last_square, mut press) = (vec![0.0; n], f64::INFINITY, 0.0);
    for _ in 0..MAX_STEPS {
        press = mean_in_contact(&p, |i| u[i] - below[i]);
        let (mut square, mut change, mut count) = (0.0, 0.0, 0usize);
        for i in 0..n {
            if p[i] > 0.0 {
                let gap = u[i] - below[i] - press;
                square += gap * gap;
                change += gap * (gap - last[i]);
                count += 1;
                last[i] = gap;
            }
        }
        let rms = (square / count as f64).sqrt();
        let overlap = (0..n).any(|i| p[i] == 0.0 && u[i] - below[i] - press < -5.0 * tolerance * press.abs());
        if rms <= tolerance * press.abs() && !overlap {
            return Contact { pressure: p, press };
        }
        // Polak & Ribiere: forgets the past by itself where the contact changes.
        let keep = f64::max(change / last_square, 0.0);
        last_square = square;
        for i in 0..n {
            direction[i] = if p[i] > 0.0 { u[i] - below[i] - press + keep * direction[i] } else { 0.0 };
        }
        convolver.apply(&direction, &mut pull);
        let mean = mean_in_contact(&p, |i| pull[i]);
        let (mut along, mut across) = (0.0, 0.0);
        for i in 0..n {
            if p[i] > 0.0 {
                along += (u[i] - below[i] - press) * direction[i];
                across += (pull[i] - mean) * direction[i];
            }
        }
        if across <= 0.0 {
            return Contact { pressure: p, press };
        }
        let length = along / across;
        let mut changed = false;
        for i in 0..n {
            if p[i] > 0.0 {
                p[i] -= length * direction[i];
                if p[i] <= 0.0 {
                    (p[i], changed) = (0.0, true);
                }
            } else if below[i].is_finite() {
                let gap = u[i] - below[i] - press;
                if gap < 0.0 {
                    (p[i], changed) = (-length * gap, true);
                }
            }
        }
        let scale = problem.load / p.iter().sum::<f64>();
        p.iter_mut().for_each(|p| *p *= scale);
        if changed {
            convolver.apply(&p, &mut u);
        } else {
            for i in 0..n {
                u[i] = scale * (u[i] - length * pull[i]);
            }
        }
    }
    Contact { pressure: p, press }
}

fn mean_in_contact(p: &[f64], f: impl Fn(usize) -> f64) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for (i, &p) in p.iter().enumerate() {
        if p > 0.0 {
            sum += f(i);
            count += 1;
        }
    }
    sum / count as f64
}
