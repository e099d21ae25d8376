//! Pulls that slide, in lanes as those that bend ([`super::bend`]), and to the last bit the steps of [`super`].

use super::bend::between;
use super::{QuasiStatic, SlipPull, SlipRun, Slipping, Steps};
use crate::force_loop::{most_excess_n, share_of_error};
use gripgen_twin::config::Feedback;
use gripgen_twin::effects::SensorChain;
use std::array::from_fn;

/// Most ticks that lanes go on together before somebody looks after them: most slides are shorter.
const CHUNK: usize = 64;

/// Pulls side by side. Nobody looks at a lane without one.
struct Lanes<const N: usize> {
    force_n: [f64; N],
    displacement_m: [f64; N],
    /// Displacement, and command above the reading, beyond which a pull ends.
    most: [(f64, f64); N],
    /// Ticks of those that have ended.
    ended: [Option<usize>; N],
}

/// What a pull that slides says of the ticks to come: nothing of it depends on the loop.
struct Signals<const N: usize> {
    desired_n: [[f64; CHUNK]; N],
    contact_n: [[f64; CHUNK]; N],
    readings_n: [[f64; CHUNK]; N],
    /// What the loop is told.
    commanded_n: [[f64; CHUNK]; N],
}

impl<const N: usize> Lanes<N> {
    fn of(
        rig: &QuasiStatic,
        run: &SlipRun<'_>,
        slipping: &[Option<Slipping<'_>>; N],
        pulls: &[SlipPull; N],
    ) -> Self {
        let mut lanes = Self {
            force_n: [0.0; N],
            displacement_m: [0.0; N],
            most: [(f64::INFINITY, f64::INFINITY); N],
            ended: [None; N],
        };
        for (k, (slot, pull)) in slipping.iter().zip(pulls).enumerate() {
            let Some(slipping) = slot else { continue };
            (lanes.force_n[k], lanes.displacement_m[k]) = (slipping.control.force_n(), pull.displacement_m);
            lanes.most[k] = (rig.stop_m, run.decided_n);
        }
        lanes
    }

    /// Goes on for `count` ticks, or until all pulls have ended; how many ticks that were.
    fn go_on<const MEASURED: bool>(
        &mut self,
        rig: &QuasiStatic,
        steps: &Steps,
        signals: &Signals<N>,
        count: usize,
    ) -> usize {
        let gain = share_of_error(&rig.robot, steps.step_s);
        let excess_n = most_excess_n(&rig.robot);
        // In registers, not in memory.
        let (mut force_n, mut displacement_m, mut most) = (self.force_n, self.displacement_m, self.most);
        let mut ticks = 0;
        while ticks < count.min(CHUNK) {
            let at = |signal: &[[f64; CHUNK]; N]| -> [f64; N] { from_fn(|k| signal[k][ticks]) };
            let (desired_n, contact_n) = (at(&signals.desired_n), at(&signals.contact_n));
            let (reading_n, commanded_n) = (at(&signals.readings_n), at(&signals.commanded_n));
            ticks += 1;
            let ends = |k: usize| (displacement_m[k] > most[k].0) | (desired_n[k] - reading_n[k] > most[k].1);
            let ending: [bool; N] = from_fn(ends);
            if ending != [false; N] {
                for k in (0..N).filter(|&k| ending[k]) {
                    (self.ended[k], self.displacement_m[k]) = (Some(ticks), displacement_m[k]);
                    most[k] = (f64::INFINITY, f64::INFINITY);
                }
                if most.iter().all(|(_, above_n)| above_n.is_infinite()) {
                    break;
                }
            }
            for k in 0..N {
                let closed_n = if MEASURED { reading_n[k] } else { force_n[k] };
                let asked_n = force_n[k] + gain * (commanded_n[k] - closed_n);
                force_n[k] = between(asked_n, contact_n[k] - excess_n, contact_n[k] + excess_n);
                let step_m = (force_n[k] - contact_n[k]) * steps.metres_per_n;
                displacement_m[k] += if step_m > 0.0 { step_m } else { 0.0 };
            }
        }
        for k in (0..N).filter(|&k| self.ended[k].is_none()) {
            self.displacement_m[k] = displacement_m[k];
        }
        self.force_n = force_n;
        ticks
    }
}

impl QuasiStatic {
    /// Advances pulls that slide until each has ended: with what the sensor reads at a time, and what the loop is told of a command that arrives
    /// with a reading.
    #[inline(always)]
    pub(super) fn slide<const N: usize>(
        &self,
        run: &SlipRun<'_>,
        steps: &Steps,
        slipping: &mut [Option<Slipping<'_>>; N],
        pulls: &mut [SlipPull; N],
        read: &impl Fn(&mut SensorChain, f64, f64) -> f64,
        command: &impl Fn(f64, f64) -> f64,
    ) {
        let nothing = [[0.0; CHUNK]; N];
        let mut signals =
            Signals { desired_n: nothing, contact_n: nothing, readings_n: nothing, commanded_n: nothing };
        let time_s = |tick: usize| tick as f64 / self.rate_hz;
        let waited_s = |tick: usize| (time_s(tick) - steps.dead_s).max(0.0);
        loop {
            let left = slipping.iter().flatten().map(|s| steps.last + 1 - s.tick);
            let Some(count) = left.min().map(|left| left.min(CHUNK)) else { return };
            for (k, slot) in slipping.iter_mut().enumerate() {
                let Some(slipping) = slot else { continue };
                let from = slipping.tick;
                // The pull may end before: its own go on later.
                slipping.stairs.clone().fill(&mut signals.desired_n[k][..count], from, self.rate_hz, time_s);
                slipping.due.clone().fill(&mut signals.commanded_n[k][..count], from, self.rate_hz, waited_s);
                for i in 0..count {
                    let contact_n = slipping.kinetic_n + slipping.above_n;
                    slipping.above_n *= steps.kept;
                    signals.contact_n[k][i] = contact_n;
                    let reading_n = read(&mut slipping.sensor, contact_n, time_s(from + i));
                    signals.readings_n[k][i] = reading_n;
                    signals.commanded_n[k][i] = command(signals.commanded_n[k][i], reading_n);
                }
            }
            let mut lanes = Lanes::of(self, run, slipping, pulls);
            let ticks = match self.robot.feedback {
                Feedback::Measured => lanes.go_on::<true>(self, steps, &signals, count),
                Feedback::Independent => lanes.go_on::<false>(self, steps, &signals, count),
            };
            for (k, (slot, pull)) in slipping.iter_mut().zip(pulls.iter_mut()).enumerate() {
                let Some(slipping) = slot else { continue };
                let (ended, ticks) = (lanes.ended[k].is_some(), lanes.ended[k].unwrap_or(ticks));
                pull.reading_n.extend_from_slice(&signals.readings_n[k][..ticks]);
                pull.desired_n.extend_from_slice(&signals.desired_n[k][..ticks]);
                pull.displacement_m = lanes.displacement_m[k];
                slipping.tick += ticks;
                slipping.control.take_over(lanes.force_n[k]);
                slipping.stairs.desired_n(time_s(slipping.tick));
                slipping.due.desired_n(waited_s(slipping.tick));
                if ended || slipping.tick > steps.last {
                    *slot = None;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::rig;
    use super::super::{RimTable, StuckPull};
    use super::*;
    use gripgen_twin::effects::{CommandChain, Creep, find};
    use gripgen_twin::{Backbone, Staircase};

    /// Pulls in lanes are to the last bit what they are tick by tick: with both kinds of feedback, with and without effects on readings and
    /// commands, tools that creep and that do not, a stop that some reach while they bend, others while they slide, and pulls that end at the
    /// last tick.
    #[test]
    fn lanes_are_the_steps_of_one_pull() {
        let rings: Vec<(f64, f64)> = (0..40).map(|i| (1.0, 40.0 - f64::from(i))).collect();
        let backbone = Backbone::new(&rings, 1.0);
        let staircase = Staircase::constant(1.0, 0.104, 9.0);
        let lowpass = [(find("sensor_lowpass").unwrap(), [0.03].as_slice())];
        let gain = [(find("controller_gain").unwrap(), [1.1].as_slice())];
        let chains = [
            (SensorChain::default(), CommandChain::default()),
            (
                SensorChain::of(lowpass.into_iter(), gripgen_twin::effects::SensorPoint::default()),
                CommandChain::of(gain.into_iter()),
            ),
        ];
        let mut ends = [0; 3];
        for (feedback, (sensor, command)) in [
            (Feedback::Measured, &chains[0]),
            (Feedback::Independent, &chains[0]),
            (Feedback::Measured, &chains[1]),
            (Feedback::Independent, &chains[1]),
        ] {
            for rate_m_per_n_s in [0.0, 6e-5] {
                for (stop_m, max_time_s) in [(2.5e-3, 9.0), (50e-3, 9.0), (50e-3, 2.5)] {
                    let rig = QuasiStatic { stop_m, max_time_s, ..rig(feedback) };
                    let creep = Creep { rate_m_per_n_s, rim_exponent: 2.0 };
                    let mut stuck = StuckPull::default();
                    rig.stuck(&staircase, sensor, command, rate_m_per_n_s, 60.0, &mut stuck);
                    let run = SlipRun {
                        stuck: &stuck,
                        staircase: &staircase,
                        kinetic_ratio: 0.9,
                        backbone: &backbone,
                        creep,
                        rim: &RimTable::new(creep),
                        decided_n: 4.0,
                        sensor,
                        command,
                    };
                    let steps = rig.steps();
                    for limits_n in [[5.0, 17.0, 33.0, 21.0], [0.3, 48.0, 70.0, 41.0]] {
                        let (mut lanes, mut alone): ([SlipPull; 4], [SlipPull; 4]) = Default::default();
                        rig.slips(&run, limits_n, &mut lanes);
                        for (limit_n, pull) in limits_n.into_iter().zip(&mut alone) {
                            let mut slot = rig.leaves(&run, &steps, limit_n, pull);
                            while let Some(slipping) = &mut slot {
                                let read = |s: &mut SensorChain, n: f64, t: f64| s.read(n, t, steps.step_s);
                                let command = |due: f64, reading: f64| command.apply(due, reading);
                                let bent = slipping.bent.is_some();
                                if !rig.advance(&run, &steps, slipping, pull, &read, &command) {
                                    let last = slipping.tick > steps.last;
                                    ends[if last { 2 } else { usize::from(!bent) }] += 1;
                                    slot = None;
                                }
                            }
                        }
                        assert!(
                            lanes == alone,
                            "{feedback:?}, {rate_m_per_n_s} m/(N s), {stop_m} m, {limits_n:?} N"
                        );
                    }
                }
            }
        }
        assert!(ends.iter().all(|n| *n >= 3), "bending, sliding and at the last tick: {ends:?}");
    }
}
