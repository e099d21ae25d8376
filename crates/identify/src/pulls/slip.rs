//! Where the jaws let go, by force: limits and kinetic ratio of all traces together.
//!
//! ```text
//! F = F_stuck                                   while everything holds
//! dF = kappa (dF_stuck + (F_stuck - F) dt / t_r), kappa = (1 - F / L)^(q / (q + 1))   while the rim slips
//! F = r L + (1 - r) L exp(-(t - T) / t_f)       from T on, where F = L
//! ```
//!
//! A loop of lag tau that closes on its sensor winds up by dA = (F_stuck - F) dt / tau over what the rim no longer holds, and
//! `F_stuck + A` drives the second line in its place.
//!
//! `F_stuck` is the force on a tool that holds, `t_r` the damping of the arm over the stiffness of the gels, L the limit, r
//! the kinetic ratio. q = 0 is a contact that gives way all at once; q = 1/2 is F = L (1 - (1 - x / s)^(3/2)), the sphere of
//! Cattaneo 1938 and Mindlin 1949. The second line is the first-order arm d dx/dt = F_a - F with that backbone: a contact
//! that softens moves further, but its force goes on following the command, so displacement says nothing about the limit.
//! q is common to all traces, and r is; each trace has its limit and a small offset between arm and model. Both are
//! integrated out (flat, and normal), which leaves a likelihood of r and, for each r, mean and variance of every limit.

/// Softenings that are tried.
const SOFTNESS: [f64; 3] = [0.0, 0.5, 1.0];

/// Time before the slip whose readings say how far arm and model differ.
const BEFORE_S: f64 = 0.4;

/// How far they may differ: a force and a part of it.
const OFFSET_N: (f64, f64) = (0.03, 0.02);

/// Limits that are tried in a trace, twice.
const LIMITS: usize = 100;

/// Squares, in those of the noise, above the least that leave a limit in.
const LEFT: f64 = 25.0;

/// Steps of the softening contact between two rows.
const SUBSTEPS: usize = 2;

/// Entries of a table of kappa.
const KAPPAS: usize = 128;

/// The rows of a trace, from the start of the pull; readings less that without load.
#[derive(Debug, Clone, Default)]
pub struct SlipTrace {
    /// Times.
    pub time_s: Vec<f64>,
    /// Readings.
    pub reading_n: Vec<f64>,
    /// Readings of a tool that holds.
    pub stuck_n: Vec<f64>,
    /// Where the force stops to follow, roughly.
    pub slip_s: f64,
}

/// What all traces share.
#[derive(Debug, Clone, Copy)]
pub struct SlipRig {
    /// Noise of a reading.
    pub noise_n: f64,
    /// Damping over stiffness.
    pub relaxation_s: f64,
    /// Time constant of the fall after a slip.
    pub fall_s: f64,
    /// Rate at which a loop that closes on its sensor winds up over a force that is missing; 0 of one that does not.
    pub winds_per_s: f64,
}

/// The limit of a trace, given the kinetic ratio.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SlipLimit {
    /// Mean.
    pub value_n: f64,
    /// Standard deviation.
    pub sd_n: f64,
    /// What the mean changes by with the kinetic ratio.
    pub slope_n: f64,
}

/// What the traces say about slipping.
#[derive(Debug, Clone, PartialEq)]
pub struct Slips {
    /// Kinetic ratios that were tried, in order, and minus twice the logarithm of their likelihood, above the least.
    pub profile: Vec<(f64, f64)>,
    /// Most likely ratio.
    pub ratio: f64,
    /// Its standard deviation, from what likelihoods of ratios differ by.
    pub ratio_sd: f64,
    /// How far contacts of this kind are from their model.
    pub model_sd: f64,
    /// Limit of each trace, less its reading without load.
    pub limits: Vec<SlipLimit>,
}

/// Sums over the rows of a trace for one limit.
#[derive(Debug, Clone, Copy, Default)]
struct Sums {
    limit: f64,
    before: [f64; 3],
    /// Count, e, e^2, y, y e, y^2 of the rows after the slip, with e the share of the fall that is left.
    after: [f64; 6],
}

/// Evidence of a trace for one ratio: minus twice its logarithm, mean and variance of the limit.
type Evidence = (f64, f64, f64);

/// Reads the slips of all traces, or `None` without any.
pub fn read_slips(traces: &[SlipTrace], rig: SlipRig) -> Option<Slips> {
    if traces.is_empty() {
        return None;
    }
    // A contact that softens is seen only where the arm is slow against its gels.
    let softness = if rig.relaxation_s < 0.004 { &SOFTNESS[..1] } else { &SOFTNESS[..] };
    let sums: Vec<Vec<Vec<Sums>>> =
        softness.iter().map(|&q| traces.iter().map(|t| sums(t, rig, q)).collect()).collect();
    let cost =
        |q: usize, ratio: f64| -> f64 { sums[q].iter().map(|s| evidence(s, ratio, rig.noise_n).0).sum() };
    let best_of = |ratios: &[f64]| {
        let mut best = (f64::INFINITY, 0, 1.0);
        for q in 0..softness.len() {
            for &ratio in ratios {
                let c = cost(q, ratio);
                if c < best.0 {
                    best = (c, q, ratio);
                }
            }
        }
        best
    };
    let coarse: Vec<f64> =
        (0..=28).map(|i| 1.0 - 0.0125 * f64::from(i)).chain([0.6, 0.5, 0.4, 0.3]).collect();
    let (_, q, near) = best_of(&coarse);
    let step = if near < 0.65 { 0.01 } else { 0.001 };
    let fine: Vec<f64> =
        (-20..=20).map(|i| near + step * f64::from(i)).filter(|r| *r <= 1.0 + 1e-12 && *r > 0.2).collect();
    let costs: Vec<f64> = fine.iter().map(|&r| cost(q, r)).collect();
    let least = (0..fine.len()).min_by(|&a, &b| costs[a].total_cmp(&costs[b]))?;
    // Each trace votes: where they disagree by more than their noise, all of them say less (sandwich: Huber 1967).
    let at = least.clamp(1, fine.len() - 2);
    let (mut votes, mut curvature) = (vec![], 0.0);
    for s in &sums[q] {
        let c = [-1, 0, 1].map(|k| evidence(s, fine[at.saturating_add_signed(k)], rig.noise_n).0);
        votes.push(0.25 * (c[2] - c[0]) / step);
        curvature += 0.5 * (c[0] - 2.0 * c[1] + c[2]) / (step * step);
    }
    let mean = votes.iter().sum::<f64>() / votes.len() as f64;
    let spread: f64 = votes.iter().map(|v| (v - mean) * (v - mean)).sum();
    let wide = if curvature > 0.0 { (spread / curvature).clamp(1.0, 400.0) } else { 1.0 };
    let profile: Vec<(f64, f64)> =
        fine.iter().zip(&costs).map(|(r, c)| (*r, (c - costs[least]) / wide)).collect();
    let ratio = vertex(&profile, least);
    let ratio_sd = deviation(&profile, least);
    let limits = sums[q]
        .iter()
        .map(|s| {
            let (low, high) = ((ratio - ratio_sd).max(0.25), (ratio + ratio_sd).min(1.0));
            let [here, a, b] = [ratio, low, high].map(|r| evidence(s, r, rig.noise_n));
            SlipLimit { value_n: here.1, sd_n: here.2.sqrt(), slope_n: (b.1 - a.1) / (high - low).max(1e-6) }
        })
        .collect();
    let model_sd = if softness[q] > 0.0 { RATIO_SD.1 } else { RATIO_SD.0 };
    Some(Slips { profile, ratio, ratio_sd, model_sd, limits })
}

/// How far from the ratio of a model the ratio of a contact is, beside noise: of one that gives way all at once, and of one that
/// softens, whose shape is known less well.
const RATIO_SD: (f64, f64) = (0.0005, 0.003);

impl Slips {
    /// 90 % interval of the ratio: the likelihood ratio inverted, with its own shape (it is steep where a drop would have been
    /// seen, and flat towards 1, where a small drop hides in the noise).
    pub fn ratio90(&self) -> (f64, f64) {
        let fine: Vec<(f64, f64)> = self
            .profile
            .windows(2)
            .flat_map(|w| {
                (0..8)
                    .map(move |k| f64::from(k) / 8.0)
                    .map(move |s| (w[0].0 * (1.0 - s) + w[1].0 * s, w[0].1 * (1.0 - s) + w[1].1 * s))
            })
            .chain(self.profile.last().copied())
            .collect();
        let inside = |ratio: f64| {
            let cost = |(r, c): &(f64, f64)| c + ((ratio - r) / self.model_sd).powi(2);
            fine.iter().map(cost).fold(f64::INFINITY, f64::min) <= 2.705_543
        };
        let step = 0.000_1;
        let held: Vec<f64> = (0..8000).map(|i| 1.0 - step * f64::from(i)).filter(|r| inside(*r)).collect();
        (held.last().copied().unwrap_or(self.ratio), held.first().copied().unwrap_or(self.ratio))
    }
}

/// Lowest point of the parabola through the least cost and its neighbours.
fn vertex(profile: &[(f64, f64)], least: usize) -> f64 {
    if least == 0 || least + 1 >= profile.len() {
        return profile[least].0;
    }
    let [a, b, c] = [profile[least - 1], profile[least], profile[least + 1]];
    let bend = a.1 - 2.0 * b.1 + c.1;
    let step = b.0 - a.0;
    if bend > 0.0 { (b.0 + 0.5 * step * (a.1 - c.1) / bend).min(1.0) } else { b.0 }
}

/// Distance at which the cost is 1 above the least, to the side of smaller ratios.
fn deviation(profile: &[(f64, f64)], least: usize) -> f64 {
    for i in (0..least).rev() {
        if profile[i].1 >= 1.0 {
            let (far, near) = (profile[i], profile[i + 1]);
            let share = (1.0 - near.1) / (far.1 - near.1);
            return (profile[least].0 - near.0 - share * (far.0 - near.0)).max(1e-4);
        }
    }
    (profile[least].0 - profile[0].0).max(1e-3)
}

/// The rows of a trace against every limit that may be.
fn sums(trace: &SlipTrace, rig: SlipRig, softness: f64) -> Vec<Sums> {
    let n = trace.time_s.len();
    let first = trace.time_s.partition_point(|t| *t < trace.slip_s - BEFORE_S);
    let slid = trace.time_s.partition_point(|t| *t < trace.slip_s).clamp(1, n - 1);
    let level = mean(&trace.reading_n[slid.min(n - 2)..]);
    let highest = trace.reading_n[first..(slid + 8).min(n)].windows(3).map(mean).fold(level, f64::max);
    let (low, high) = ((level - 4.0 * rig.noise_n).max(0.02), highest + 2.0 * rig.noise_n + 0.02 * highest);
    let exponent = softness / (softness + 1.0);
    let kappa: Vec<f64> = (0..=KAPPAS).map(|i| libm::pow(1.0 - i as f64 / KAPPAS as f64, exponent)).collect();
    let mut force = vec![0.0; n];
    let mut tried = |low: f64, high: f64| -> Vec<Sums> {
        (0..LIMITS)
            .map(|i| low + (high - low) * i as f64 / (LIMITS - 1) as f64)
            .map(|limit| {
                let slip_s = follow(trace, rig, softness, &kappa, limit, &mut force);
                Sums::of(limit, trace, rig, first..n, slip_s, &force)
            })
            .collect()
    };
    // Where the force drops by much, one row on the wrong side rules a limit out: the limits that are left are tried more finely.
    let coarse = tried(low, high);
    let costs: Vec<f64> = coarse.iter().map(|s| s.free_cost(rig.noise_n)).collect();
    let least = costs.iter().copied().fold(f64::INFINITY, f64::min);
    let left = |c: &f64| *c < least + LEFT;
    let from = costs.iter().position(left).unwrap_or(0).saturating_sub(2);
    let to = (costs.iter().rposition(left).unwrap_or(LIMITS - 1) + 2).min(LIMITS - 1);
    tried(coarse[from].limit, coarse[to].limit)
}

impl Sums {
    fn of(
        limit: f64,
        trace: &SlipTrace,
        rig: SlipRig,
        rows: std::ops::Range<usize>,
        slip_s: f64,
        force: &[f64],
    ) -> Self {
        let mut s = Self { limit, ..Self::default() };
        for j in rows {
            let (t, y) = (trace.time_s[j], trace.reading_n[j]);
            if t < slip_s {
                let d = y - force[j];
                s.before[0] += 1.0;
                s.before[1] += d;
                s.before[2] += d * d;
            } else {
                let e = if rig.fall_s > 0.0 { libm::exp((slip_s - t) / rig.fall_s) } else { 0.0 };
                let row = [1.0, e, e * e, y, y * e, y * y];
                s.after.iter_mut().zip(row).for_each(|(a, b)| *a += b);
            }
        }
        s
    }

    /// Squares about the mean before and about the mean after, in those of the noise: whatever the kinetic ratio is.
    fn free_cost(&self, noise_n: f64) -> f64 {
        let about = |n: f64, sum: f64, squares: f64| squares - sum * sum / n.max(1.0);
        let [n, _, _, y, _, yy] = self.after;
        (about(self.before[0], self.before[1], self.before[2]) + about(n, y, yy)) / (noise_n * noise_n)
    }
}

/// The force of a contact with this limit at every row, until it slips; when that is.
fn follow(
    trace: &SlipTrace,
    rig: SlipRig,
    softness: f64,
    kappa: &[f64],
    limit: f64,
    force: &mut [f64],
) -> f64 {
    let (time, stuck) = (&trace.time_s, &trace.stuck_n);
    let mut f = stuck[0].min(limit);
    let mut wound = 0.0;
    force[0] = f;
    for j in 1..time.len() {
        let (dt, ds) = (time[j] - time[j - 1], stuck[j] - stuck[j - 1]);
        if softness == 0.0 {
            force[j] = stuck[j];
            if stuck[j] >= limit {
                let share = if ds > 0.0 { ((limit - stuck[j - 1]) / ds).clamp(0.0, 1.0) } else { 1.0 };
                return time[j - 1] + share * dt;
            }
            continue;
        }
        let (h, step) = (dt / SUBSTEPS as f64, ds / SUBSTEPS as f64);
        for k in 0..SUBSTEPS {
            let held = stuck[j - 1] + (k as f64 + 0.5) * step;
            let u = (f / limit).clamp(0.0, 1.0) * KAPPAS as f64;
            let (i, w) = ((u as usize).min(KAPPAS - 1), u.fract());
            let soft = (kappa[i] * (1.0 - w) + kappa[i + 1] * w).max(0.05);
            // Implicit in F, which stays below what holds.
            let pull = soft * h / rig.relaxation_s;
            let next = (f + soft * step + pull * (held + wound)) / (1.0 + pull);
            if next >= limit {
                let share = if next > f { (limit - f) / (next - f) } else { 1.0 };
                return time[j - 1] + (k as f64 + share) * h;
            }
            wound += (held - next) * h * rig.winds_per_s;
            f = next;
        }
        force[j] = f;
    }
    f64::INFINITY
}

/// The offset integrated out in closed form, limits by a sum.
fn evidence(all: &[Sums], ratio: f64, noise_n: f64) -> Evidence {
    let square = noise_n * noise_n;
    let each: Vec<(f64, f64, f64)> = all
        .iter()
        .map(|s| {
            let offset_n = OFFSET_N.0 + OFFSET_N.1 * s.limit;
            let [n, e, ee, y, ye, yy] = s.after;
            let fall = 1.0 - ratio;
            // Of c = r + (1 - r) e: sums of c^2 and of c y.
            let cc = ratio * ratio * n + 2.0 * ratio * fall * e + fall * fall * ee;
            let cy = ratio * y + fall * ye;
            let a = (s.before[0] + cc) / square + 1.0 / (offset_n * offset_n);
            let b = (s.before[1] + cy - cc * s.limit) / square;
            let c = (s.before[2] + yy - 2.0 * s.limit * cy + s.limit * s.limit * cc) / square;
            (c - b * b / a + libm::log(a), s.limit + b / a, 1.0 / a)
        })
        .collect();
    let least = each.iter().map(|x| x.0).fold(f64::INFINITY, f64::min);
    let (mut weight, mut value, mut spread) = (0.0, 0.0, 0.0);
    for (cost, mean, variance) in &each {
        let w = libm::exp(-0.5 * (cost - least));
        weight += w;
        value += w * mean;
        spread += w * (variance + mean * mean);
    }
    let step = if all.len() > 1 { all[1].limit - all[0].limit } else { 1.0 };
    let value = value / weight;
    (least - 2.0 * libm::log(weight * step), value, (spread / weight - value * value).max(1e-8))
}

fn mean(x: &[f64]) -> f64 {
    x.iter().sum::<f64>() / x.len().max(1) as f64
}

#[cfg(test)]
mod tests;
