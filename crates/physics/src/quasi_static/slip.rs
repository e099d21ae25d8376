//! What follows a slip.

mod bend;
mod slide;

use super::{QuasiStatic, SNAPSHOT_TICKS, StuckPull};
use crate::force_loop::ForceLoop;
use gripgen_twin::effects::{CommandChain, Creep, SensorChain};
use gripgen_twin::{Backbone, Staircase, StaircaseCursor};

/// Share of the limit up to which contacts that bend are taken for springs: what they trail more below is forgotten, within
/// the time in which gels and damping relax, before they slip.
const BENDS_FROM: f64 = 0.3;

/// What follows after a slip.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct SlipPull {
    /// The first tick at which the jaws slide, or bend, or one past the last tick of a pull that ends before.
    pub slip_tick: usize,
    /// Command at each tick from there on.
    pub desired_n: Vec<f64>,
    /// Noise-free reading at each of them.
    pub reading_n: Vec<f64>,
    /// Displacement at the last tick.
    pub displacement_m: f64,
}

/// What pulls of one profile share that differ in what the jaws hold.
#[derive(Debug, Clone, Copy)]
pub struct SlipRun<'a> {
    /// The pull of a tool that holds.
    pub stuck: &'a StuckPull,
    /// Its commands.
    pub staircase: &'a Staircase,
    /// Kinetic over static friction.
    pub kinetic_ratio: f64,
    /// The contact.
    pub backbone: &'a Backbone,
    /// How the tool creeps.
    pub creep: Creep,
    /// The same over the share of the limit.
    pub rim: &'a RimTable,
    /// How far a command is above the reading of a pull whose label cannot change any more: there it ends.
    pub decided_n: f64,
    /// The sensor of `stuck`.
    pub sensor: &'a SensorChain,
    /// The commands of `stuck`.
    pub command: &'a CommandChain,
}

/// By how much a tool creeps faster while the rim of its contact slips, over the share of the limit: evenly spaced from 0 to 1.
#[derive(Debug, Clone, PartialEq)]
pub struct RimTable(Vec<f64>);

impl RimTable {
    /// Of a tool that creeps so: the same at all rates but none.
    pub fn new(creep: Creep) -> Self {
        const STEPS: usize = 256;
        if creep.rate_m_per_n_s == 0.0 {
            return Self(Vec::new());
        }
        let unit = Creep { rate_m_per_n_s: 1.0, ..creep };
        let at = |i: usize| i.max(1) as f64 / STEPS as f64;
        Self((0..=STEPS).map(|i| unit.speed_m_per_s(at(i), 1.0) / at(i)).collect())
    }

    /// The factor at a share of the limit.
    #[inline]
    fn at(&self, share: f64) -> f64 {
        let last = self.0.len() - 2;
        let x = share.clamp(0.0, 1.0) * (last + 1) as f64;
        let i = (x as usize).min(last);
        self.0[i] + (x - i as f64) * (self.0[i + 1] - self.0[i])
    }
}

/// A pull from where it leaves the one of a tool that holds.
struct Slipping<'a> {
    limit_n: f64,
    kinetic_n: f64,
    /// Force above the kinetic one.
    above_n: f64,
    /// Shear of a contact that bends, with its share of the limit and its slope, until all of it has slipped.
    bent: Option<(f64, (f64, f64))>,
    /// Shear per displacement.
    shear_of_m: f64,
    /// Way that the tool has crept.
    crept_m: f64,
    sensor: SensorChain,
    control: ForceLoop,
    stairs: StaircaseCursor<'a>,
    /// Commands that have waited their dead time.
    due: StaircaseCursor<'a>,
    tick: usize,
}

/// What all steps of a pull share.
struct Steps {
    step_s: f64,
    dead_s: f64,
    /// Share of the force above the kinetic one that is left after a step.
    kept: f64,
    /// What a force that nobody holds moves in a step.
    metres_per_n: f64,
    /// How much of that a spring of the gels' stiffness takes away.
    held_back: f64,
    last: usize,
}

impl QuasiStatic {
    /// What follows when the jaws hold `limits_n` only, each for itself. A pull ends at the displacement stop, or when the label is
    /// decided. Pulls advance in lanes: each waits for its own last step alone, and together they take little longer than one.
    pub fn slips<const N: usize>(&self, run: &SlipRun<'_>, limits_n: [f64; N], pulls: &mut [SlipPull; N]) {
        let steps = self.steps();
        let mut slipping: [Option<Slipping<'_>>; N] =
            std::array::from_fn(|i| self.leaves(run, &steps, limits_n[i], &mut pulls[i]));
        // Without effects on readings and commands, as most are, there is nothing to ask them.
        if run.sensor.is_identity() && run.command.is_identity() {
            self.bend(run, &steps, &mut slipping, pulls);
            self.slide(run, &steps, &mut slipping, pulls, &|_, contact_n, _| contact_n, &|due_n, _| due_n);
        } else {
            let read = |sensor: &mut SensorChain, contact_n: f64, time_s: f64| {
                sensor.read(contact_n, time_s, steps.step_s)
            };
            let command = |due_n: f64, reading_n: f64| run.command.apply(due_n, reading_n);
            for (slot, pull) in slipping.iter_mut().zip(pulls.iter_mut()) {
                while let Some(slipping) = slot.as_mut().filter(|s| s.bent.is_some()) {
                    if !self.advance(run, &steps, slipping, pull, &read, &command) {
                        *slot = None;
                    }
                }
            }
            self.slide(run, &steps, &mut slipping, pulls, &read, &command);
        }
    }

    /// What all steps of these pulls share.
    fn steps(&self) -> Steps {
        let step_s = 1.0 / self.rate_hz;
        let metres_per_n = step_s / self.robot.damping_n_s_per_m;
        Steps {
            step_s,
            dead_s: (self.robot.dead_time_s * self.rate_hz - 1e-9).ceil().max(0.0) * step_s,
            kept: if self.fall_s > 0.0 { libm::exp(-step_s / self.fall_s) } else { 0.0 },
            metres_per_n,
            held_back: self.stiffness_n_per_m * metres_per_n,
            last: self.ticks(),
        }
    }

    /// The pull at the tick at which it is no longer that of a tool that holds; `None` if it ends before.
    fn leaves<'a>(
        &self,
        run: &SlipRun<'a>,
        steps: &Steps,
        limit_n: f64,
        pull: &mut SlipPull,
    ) -> Option<Slipping<'a>> {
        let SlipRun { stuck, backbone, .. } = run;
        pull.desired_n.clear();
        pull.reading_n.clear();
        let from_n = if backbone.bends() { BENDS_FROM * limit_n } else { limit_n };
        let held = stuck.largest_n.partition_point(|&f| f < from_n);
        let crept_m = match self.crept(run, limit_n, held, steps.step_s) {
            Ok(crept_m) => crept_m,
            // A tool that creeps as far as the stop ends its pull while the jaws hold.
            Err(stop_tick) => {
                (pull.slip_tick, pull.displacement_m) = (stop_tick + 1, self.stop_m);
                return None;
            }
        };
        pull.displacement_m = limit_n / self.stiffness_n_per_m + crept_m;
        pull.slip_tick = held;
        if held >= stuck.desired_n.len() {
            return None;
        }
        let mut sensor = match stuck.sensors.get(held / SNAPSHOT_TICKS) {
            Some(remembered) => remembered.clone(),
            None => run.sensor.clone(),
        };
        if !sensor.is_identity() {
            for tick in held / SNAPSHOT_TICKS * SNAPSHOT_TICKS..held {
                let before_s = if tick == 0 { 0.0 } else { steps.step_s };
                sensor.read(stuck.contact_n[tick], tick as f64 / self.rate_hz, before_s);
            }
        }
        let mut control = ForceLoop::new(self.robot);
        control.take_over(stuck.applied_n[held]);
        let kinetic_n = limit_n * run.kinetic_ratio;
        let held_s = held as f64 / self.rate_hz;
        Some(Slipping {
            limit_n,
            kinetic_n,
            above_n: (limit_n - kinetic_n) * steps.kept,
            bent: backbone.bends().then(|| {
                let shear = backbone.shear_of(stuck.contact_n[held] / limit_n);
                (shear, backbone.at(shear))
            }),
            shear_of_m: self.stiffness_n_per_m / limit_n,
            crept_m,
            sensor,
            control,
            stairs: run.staircase.from(held_s),
            due: run.staircase.from((held_s - steps.dead_s).max(0.0)),
            tick: held,
        })
    }

    /// How far the tool has crept while the jaws hold, or the tick at which that is as far as the stop.
    fn crept(&self, run: &SlipRun<'_>, limit_n: f64, held: usize, step_s: f64) -> Result<f64, usize> {
        let mut crept_m = 0.0;
        if run.creep.rate_m_per_n_s == 0.0 {
            return Ok(crept_m);
        }
        for (tick, &contact_n) in run.stuck.contact_n.iter().take(held).enumerate() {
            let speed = run.creep.rate_m_per_n_s * contact_n * run.rim.at(contact_n / limit_n);
            crept_m += speed * step_s;
            // Only near the stop is it worth a division.
            let near = contact_n > (0.999 * self.stop_m - crept_m) * self.stiffness_n_per_m;
            if near && contact_n / self.stiffness_n_per_m + crept_m > self.stop_m {
                return Err(tick);
            }
        }
        Ok(crept_m)
    }

    /// One tick, and whether there is another.
    #[inline(always)]
    fn advance(
        &self,
        run: &SlipRun<'_>,
        steps: &Steps,
        slipping: &mut Slipping<'_>,
        pull: &mut SlipPull,
        read: &impl Fn(&mut SensorChain, f64, f64) -> f64,
        command: &impl Fn(f64, f64) -> f64,
    ) -> bool {
        let time_s = slipping.tick as f64 / self.rate_hz;
        let contact_n = match slipping.bent {
            Some((_, (share, _))) => slipping.limit_n * share,
            None => slipping.kinetic_n + slipping.above_n,
        };
        if slipping.bent.is_none() {
            slipping.above_n *= steps.kept;
        }
        let reading_n = read(&mut slipping.sensor, contact_n, time_s);
        let desired_n = slipping.stairs.desired_n(time_s);
        pull.desired_n.push(desired_n);
        pull.reading_n.push(reading_n);
        if let Some((shear, _)) = slipping.bent {
            pull.displacement_m = shear / slipping.shear_of_m + slipping.crept_m;
        }
        let creep_m = run.creep.rate_m_per_n_s * contact_n * steps.step_s;
        if creep_m > 0.0 && slipping.bent.is_some() {
            slipping.crept_m += creep_m * run.rim.at(contact_n / slipping.limit_n);
        }
        let decided = slipping.bent.is_none() && desired_n - reading_n > run.decided_n;
        if pull.displacement_m > self.stop_m || decided {
            return false;
        }
        // Commands under way at the slip go on arriving: the loop is given the one that is due.
        let due_n = slipping.due.desired_n((time_s - steps.dead_s).max(0.0));
        let commanded_n = command(due_n, reading_n);
        let applied_n = slipping.control.advance_due(steps.step_s, commanded_n, reading_n, contact_n);
        let step_m = (applied_n - contact_n) * steps.metres_per_n;
        slipping.bent = match slipping.bent {
            Some((shear, (_, slope))) => {
                // Implicit in x while it holds. What creeps shears nothing.
                let sheared_m = step_m - creep_m;
                let next = shear + sheared_m * slipping.shear_of_m / (1.0 + steps.held_back * slope);
                (next < run.backbone.slips_at()).then(|| (next, run.backbone.at(next)))
            }
            None => {
                pull.displacement_m += step_m.max(0.0);
                None
            }
        };
        slipping.tick += 1;
        slipping.tick <= steps.last
    }
}

impl SlipPull {
    /// Command and noise-free reading at all ticks of this pull, in order; `stuck` is that of a tool that holds.
    pub fn ticks<'a>(&'a self, stuck: &'a StuckPull) -> impl DoubleEndedIterator<Item = (&'a f64, &'a f64)> {
        let held = self.slip_tick.min(stuck.desired_n.len());
        let before = stuck.desired_n[..held].iter().zip(&stuck.reading_n[..held]);
        before.chain(self.desired_n.iter().zip(&self.reading_n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_twin::Robot;
    use gripgen_twin::config::Feedback;
    use gripgen_twin::effects::find;

    /// A light arm on soft gels.
    pub(super) fn rig(feedback: Feedback) -> QuasiStatic {
        let robot = Robot {
            dead_time_s: 0.0131,
            damping_n_s_per_m: 400.0,
            speed_limit_m_per_s: 0.1,
            ..crate::tests::robot(feedback)
        };
        QuasiStatic {
            robot,
            stiffness_n_per_m: 2e4,
            rate_hz: 500.0,
            fall_s: 0.01,
            stop_m: 5e-3,
            max_time_s: 6.0,
        }
    }

    /// Four pulls in turns are each what they are alone: contacts that let go at once and that bend, with and without an effect on readings, one
    /// that never slips among them.
    #[test]
    fn pulls_in_turns_are_what_they_are_alone() {
        let rig = rig(Feedback::Independent);
        let staircase = Staircase::constant(1.0, 0.104, 6.0);
        let ring = |i: i32| (1.0, 40.0 - f64::from(i));
        let rings: Vec<(f64, f64)> = (0..40).map(ring).collect();
        let lowpass = [(find("sensor_lowpass").unwrap(), [0.03].as_slice())];
        for backbone in [Backbone::straight(), Backbone::new(&rings, 1.0)] {
            for sensor in [
                SensorChain::default(),
                SensorChain::of(lowpass.into_iter(), gripgen_twin::effects::SensorPoint::default()),
            ] {
                let (command, mut stuck) = (CommandChain::default(), StuckPull::default());
                rig.stuck(&staircase, &sensor, &command, 0.0, 50.0, &mut stuck);
                let run = SlipRun {
                    stuck: &stuck,
                    staircase: &staircase,
                    kinetic_ratio: 0.9,
                    backbone: &backbone,
                    creep: Creep::default(),
                    rim: &RimTable::new(Creep::default()),
                    decided_n: 4.0,
                    sensor: &sensor,
                    command: &command,
                };
                let limits_n = [5.0, 17.0, 33.0, 500.0];
                let mut together: [SlipPull; 4] = Default::default();
                rig.slips(&run, limits_n, &mut together);
                for (limit_n, pull) in limits_n.into_iter().zip(&together) {
                    let mut alone: [SlipPull; 1] = Default::default();
                    rig.slips(&run, [limit_n], &mut alone);
                    assert_eq!(alone[0], *pull, "{limit_n} N, {}", backbone.bends());
                    assert_eq!(pull.reading_n.is_empty(), limit_n > 100.0, "{limit_n} N");
                }
                // What holds more is pulled further.
                assert!(
                    together[0].slip_tick < together[1].slip_tick
                        && together[1].slip_tick < together[2].slip_tick
                );
            }
        }
    }
}
