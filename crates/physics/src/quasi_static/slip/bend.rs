//! Contacts that bend before they slip, where no effect acts on readings and commands: most of what fits simulate.
//!
//! The steps are those of [`super::slip`], to the last bit. What a pull does next waits for what it did before: several in lanes keep the
//! processor busy meanwhile.

use super::{QuasiStatic, SlipPull, SlipRun, Slipping, Steps};
use crate::force_loop::{most_excess_n, share_of_error};
use gripgen_twin::config::Feedback;
use std::array::from_fn;

/// Most ticks that lanes go on together before somebody looks after them.
pub(super) const CHUNK: usize = 256;

/// Share of the way to the displacement stop from where on a pull goes on alone: the lanes do not divide, and round otherwise.
const ALONE_FROM: f64 = 1.0 - 1e-9;

/// Pulls side by side. A lane without one stays at zero.
struct Lanes<const N: usize> {
    limit_n: [f64; N],
    shear_of_m: [f64; N],
    /// Way after which a pull goes on alone.
    alone_from_m: [f64; N],
    shear: [f64; N],
    share: [f64; N],
    slope: [f64; N],
    force_n: [f64; N],
    crept_m: [f64; N],
    /// Shear and way crept at the last tick.
    before: ([f64; N], [f64; N]),
}

impl<const N: usize> Lanes<N> {
    fn of(rig: &QuasiStatic, slipping: &[Option<Slipping<'_>>; N]) -> Self {
        let mut lanes = Self {
            limit_n: [1.0; N],
            shear_of_m: [1.0; N],
            alone_from_m: [f64::INFINITY; N],
            shear: [0.0; N],
            share: [0.0; N],
            slope: [0.0; N],
            force_n: [0.0; N],
            crept_m: [0.0; N],
            before: ([0.0; N], [0.0; N]),
        };
        for (k, slot) in slipping.iter().enumerate() {
            let Some(slipping) = slot else { continue };
            let Some((shear, (share, slope))) = slipping.bent else { continue };
            (lanes.limit_n[k], lanes.shear_of_m[k]) = (slipping.limit_n, slipping.shear_of_m);
            (lanes.shear[k], lanes.share[k], lanes.slope[k]) = (shear, share, slope);
            (lanes.force_n[k], lanes.crept_m[k]) = (slipping.control.force_n(), slipping.crept_m);
            lanes.alone_from_m[k] = ALONE_FROM * rig.stop_m;
        }
        lanes
    }

    /// Goes on for `count` ticks, or until a pull slips or comes near the stop; how many ticks that were. `due_n` are the commands that
    /// arrive, and `readings_n` what is read.
    fn go_on<const MEASURED: bool, const CREEPS: bool>(
        &mut self,
        rig: &QuasiStatic,
        run: &SlipRun<'_>,
        steps: &Steps,
        due_n: &[[f64; CHUNK]; N],
        readings_n: &mut [[f64; CHUNK]; N],
        count: usize,
    ) -> usize {
        let gain = share_of_error(&rig.robot, steps.step_s);
        let excess_n = most_excess_n(&rig.robot);
        let (backbone, slips_at) = (run.backbone, run.backbone.slips_at());
        let creep_m_per_n = [run.creep.rate_m_per_n_s, steps.step_s];
        // In registers, not in memory.
        let (limit_n, shear_of_m, alone_from_m) = (self.limit_n, self.shear_of_m, self.alone_from_m);
        let (mut shear, mut share, mut slope) = (self.shear, self.share, self.slope);
        let (mut force_n, mut crept_m) = (self.force_n, self.crept_m);
        let mut ticks = 0;
        while ticks < count.min(CHUNK) {
            self.before = (shear, crept_m);
            let contact_n: [f64; N] = from_fn(|k| limit_n[k] * share[k]);
            let due_n: [f64; N] = from_fn(|k| due_n[k][ticks]);
            for k in 0..N {
                readings_n[k][ticks] = contact_n[k];
            }
            for k in 0..N {
                let closed_n = if MEASURED { contact_n[k] } else { force_n[k] };
                let asked_n = force_n[k] + gain * (due_n[k] - closed_n);
                force_n[k] = between(asked_n, contact_n[k] - excess_n, contact_n[k] + excess_n);
            }
            let mut sheared_m: [f64; N] = from_fn(|k| (force_n[k] - contact_n[k]) * steps.metres_per_n);
            if CREEPS {
                for k in 0..N {
                    let creep_m = creep_m_per_n[0] * contact_n[k] * creep_m_per_n[1];
                    crept_m[k] += creep_m * run.rim.at(contact_n[k] / limit_n[k]);
                    sheared_m[k] -= creep_m;
                }
            }
            for k in 0..N {
                shear[k] += sheared_m[k] * shear_of_m[k] / (1.0 + steps.held_back * slope[k]);
            }
            for k in 0..N {
                (share[k], slope[k]) = backbone.at(shear[k]);
            }
            ticks += 1;
            let ended = |k: usize| {
                let alone_from = (alone_from_m[k] - crept_m[k]) * shear_of_m[k];
                (shear[k] >= alone_from) | (shear[k] >= slips_at)
            };
            if (0..N).fold(false, |any, k| any | ended(k)) {
                break;
            }
        }
        (self.shear, self.share, self.slope) = (shear, share, slope);
        (self.force_n, self.crept_m) = (force_n, crept_m);
        ticks
    }
}

/// `x` clamped, without a look at whether these are numbers.
#[inline]
pub(super) fn between(x: f64, low: f64, high: f64) -> f64 {
    let x = if x < low { low } else { x };
    if x > high { high } else { x }
}

impl QuasiStatic {
    /// Advances pulls whose contacts bend until each has slipped or ended.
    pub(super) fn bend<'a, const N: usize>(
        &self,
        run: &SlipRun<'a>,
        steps: &Steps,
        slipping: &mut [Option<Slipping<'a>>; N],
        pulls: &mut [SlipPull; N],
    ) {
        let (mut due_n, mut readings_n) = ([[0.0; CHUNK]; N], [[0.0; CHUNK]; N]);
        let time_s = |tick: usize| tick as f64 / self.rate_hz;
        let waited_s = |tick: usize| (time_s(tick) - steps.dead_s).max(0.0);
        loop {
            for (slot, pull) in slipping.iter_mut().zip(pulls.iter_mut()) {
                self.bend_alone(run, steps, slot, pull);
            }
            let left =
                slipping.iter().flatten().filter(|s| s.bent.is_some()).map(|s| steps.last + 1 - s.tick);
            let Some(count) = left.min().map(|left| left.min(CHUNK)) else { return };
            for (slipping, due_n) in slipping.iter().zip(&mut due_n) {
                let Some(slipping) = slipping.as_ref().filter(|s| s.bent.is_some()) else {
                    *due_n = [0.0; CHUNK];
                    continue;
                };
                // The pull may end before they arrive: its own goes on later.
                let mut due = slipping.due.clone();
                due.fill(&mut due_n[..count], slipping.tick, self.rate_hz, waited_s);
            }
            let mut lanes = Lanes::of(self, slipping);
            let go_on = match (self.robot.feedback, run.creep.rate_m_per_n_s > 0.0) {
                (Feedback::Measured, false) => Lanes::go_on::<true, false>,
                (Feedback::Measured, true) => Lanes::go_on::<true, true>,
                (Feedback::Independent, false) => Lanes::go_on::<false, false>,
                (Feedback::Independent, true) => Lanes::go_on::<false, true>,
            };
            let ticks = go_on(&mut lanes, self, run, steps, &due_n, &mut readings_n, count);
            for (k, (slot, pull)) in slipping.iter_mut().zip(pulls.iter_mut()).enumerate() {
                let Some(slipping) = slot.as_mut().filter(|s| s.bent.is_some()) else { continue };
                pull.reading_n.extend_from_slice(&readings_n[k][..ticks]);
                let begun = pull.desired_n.len();
                pull.desired_n.resize(begun + ticks, 0.0);
                slipping.stairs.fill(&mut pull.desired_n[begun..], slipping.tick, self.rate_hz, time_s);
                pull.displacement_m = lanes.before.0[k] / slipping.shear_of_m + lanes.before.1[k];
                slipping.tick += ticks;
                slipping.crept_m = lanes.crept_m[k];
                slipping.control.take_over(lanes.force_n[k]);
                slipping.due.desired_n(waited_s(slipping.tick));
                let shear = lanes.shear[k];
                let holds = shear < run.backbone.slips_at();
                slipping.bent = holds.then_some((shear, (lanes.share[k], lanes.slope[k])));
                if slipping.tick > steps.last {
                    *slot = None;
                }
            }
        }
    }

    /// Advances a pull that bends near the displacement stop.
    fn bend_alone(
        &self,
        run: &SlipRun<'_>,
        steps: &Steps,
        slot: &mut Option<Slipping<'_>>,
        pull: &mut SlipPull,
    ) {
        while let Some(slipping) = slot {
            let Some((shear, _)) = slipping.bent else { return };
            if shear < (ALONE_FROM * self.stop_m - slipping.crept_m) * slipping.shear_of_m {
                return;
            }
            if !self.advance(run, steps, slipping, pull, &|_, contact_n, _| contact_n, &|due_n, _| due_n) {
                *slot = None;
            }
        }
    }
}
