//! The pull of a held part in Rapier: one time step of the engine.

#[cfg(test)]
use crate::contact::ContactForce;
use crate::force_loop::Motion;
use crate::jaw_friction::JawFriction;
use crate::scene::SceneBodies;
use crate::world::{NotFinite, World};
#[cfg(test)]
use gripgen_twin::Jaw;
use gripgen_twin::PerJaw;
use rapier3d_f64::prelude as rapier;

/// Speed above which jaws at their limit count as sliding, so that kinetic friction acts.
const SLIDING_M_PER_S: f64 = 1e-4;

/// Share of the jaws' static limits that the contact has to carry before they can slide: motion under less is gel
/// shear and the engine's own pre-slip drift, however fast the force rises.
const AT_LIMIT: f64 = 0.99;

/// Share of the jaws' static limits up to which the engine is not asked: jaws that hold a fixed part do not move, so that the contact
/// takes what the arm applies. Below the limit by more than the engine's own error, so that all that can happen near a slip happens there.
const HELD_SHARE: f64 = 0.95;

/// Steps in which the engine takes over the force that the jaws hold, and steps in which it comes to rest under it: pads drift a
/// little as their force rises.
const TAKE_OVER_STEPS: (u32, u32) = (16, 24);

/// Speed below which sliding jaws stick again.
const STICKING_M_PER_S: f64 = 1e-5;

/// What a grip in Rapier hands over to a pull.
#[derive(Clone)]
pub(crate) struct RapierStart {
    pub(crate) world: World,
    pub(crate) rig: SceneBodies,
    pub(crate) jaw_mass_kg: f64,
    pub(crate) grip_force_n: PerJaw<f64>,
    pub(crate) direction: rapier::Vector,
    pub(crate) shear_stiffness_n_per_m: f64,
    pub(crate) normal_force_n: PerJaw<f64>,
    /// The part does not move.
    pub(crate) fixed: bool,
}

/// A pull in Rapier.
#[derive(Clone)]
pub(crate) struct RapierPull {
    world: World,
    rig: SceneBodies,
    jaw_mass_kg: f64,
    grip_force_n: PerJaw<f64>,
    direction: rapier::Vector,
    shear_stiffness_n_per_m: f64,
    /// Static friction coefficient of each pad: its limit over its settled normal force.
    pad_friction: PerJaw<f64>,
    /// What both jaws hold together before they slip.
    limit_n: f64,
    friction: PerJaw<JawFriction>,
    start: rapier::Vector,
    momentum_n_s: f64,
    contact_force_n: f64,
    /// The jaws hold and have held since the grip: the engine has not begun.
    held: bool,
    refresh_contacts: bool,
    sliding: bool,
    /// Time since the jaws began to slide.
    slid_s: f64,
}

impl RapierPull {
    pub(crate) fn new(start: RapierStart, friction: &PerJaw<JawFriction>) -> Self {
        let RapierStart { mut world, rig, direction, .. } = start;
        rig.release_part(&mut world);
        let mut pull = Self {
            momentum_n_s: rig.momentum(&world, direction),
            start: rig.arm.position(&world),
            world,
            rig,
            jaw_mass_kg: start.jaw_mass_kg,
            grip_force_n: start.grip_force_n,
            direction,
            shear_stiffness_n_per_m: start.shear_stiffness_n_per_m,
            pad_friction: friction.map(|jaw, f| f.limit_n() / start.normal_force_n[jaw]),
            limit_n: friction.left.limit_n() + friction.right.limit_n(),
            friction: friction.map(|_, f| JawFriction { cells: vec![], ..*f }),
            contact_force_n: 0.0,
            held: start.fixed,
            refresh_contacts: false,
            sliding: false,
            slid_s: 0.0,
        };
        pull.write_friction();
        pull
    }

    /// Mass that moves along the pull.
    pub(crate) fn mass_kg(&self) -> f64 {
        self.rig.arm_mass_kg(&self.world, self.direction)
    }

    /// The force on the tool with which a mass M moves as one of m does, of an admittance that measures what the contact takes:
    ///
    /// ```text
    /// F = F_contact + M / m (F_free - F_contact)
    /// ```
    ///
    /// Jaws that hold do not move, whatever their mass.
    pub(crate) fn answering_n(&self, free_n: f64, apparent_mass_kg: f64) -> f64 {
        if !self.sliding {
            return free_n;
        }
        self.contact_force_n + self.mass_kg() / apparent_mass_kg * (free_n - self.contact_force_n)
    }

    /// Way of the tool along the pull.
    pub(crate) fn position_m(&self) -> f64 {
        (self.rig.arm.position(&self.world) - self.start).dot(self.direction)
    }

    /// Way of the tool.
    #[cfg(test)]
    pub(crate) fn tool_travel_m(&self) -> rapier::Vector {
        self.rig.arm.position(&self.world) - self.start
    }

    /// Pulls with a force for one time step.
    ///
    /// The contact force is a balance of momentum: what the arm applied and did not become momentum went into the
    /// contact. Gel shear is in series: it adds to the way of the tool.
    ///
    /// As long as jaws hold a fixed part well below their limit, nothing moves but the gels: `F_contact = F`, `x = F / k`. The engine
    /// takes over at [`HELD_SHARE`] of the limit, and goes on whatever comes.
    pub(crate) fn advance(&mut self, applied_n: f64, step_s: f64) -> Result<Motion, NotFinite> {
        if self.held {
            if applied_n.abs() <= HELD_SHARE * self.limit_n {
                self.contact_force_n = applied_n;
                let displacement_m = applied_n / self.shear_stiffness_n_per_m;
                return Ok(Motion {
                    contact_force_n: applied_n,
                    displacement_m,
                    speed_m_per_s: 0.0,
                    sliding: false,
                });
            }
            self.take_over(step_s)?;
        }
        self.advance_engine(applied_n, step_s)
    }

    /// Brings the engine to the force that is held, without time: in even steps and some at rest, the arm told what the contact takes.
    fn take_over(&mut self, step_s: f64) -> Result<(), NotFinite> {
        self.held = false;
        let held_n = self.contact_force_n;
        let (rise, rest) = TAKE_OVER_STEPS;
        for i in 1..=rise + rest {
            let force_n = held_n * (f64::from(i) / f64::from(rise)).min(1.0);
            self.contact_force_n = force_n;
            self.rig.arm.expect(force_n);
            self.advance_engine(force_n, step_s)?;
        }
        Ok(())
    }

    /// The engine from the start of the pull, which is what tests of it look at.
    #[cfg(test)]
    pub(crate) fn begin_engine(&mut self) {
        self.held = false;
    }

    fn advance_engine(&mut self, applied_n: f64, step_s: f64) -> Result<Motion, NotFinite> {
        let jaws_n = self.rig.close_jaws(&mut self.world, &self.grip_force_n, self.jaw_mass_kg);
        let contact_n = self.contact_force_n;
        self.rig.arm.pull(&mut self.world, self.direction, applied_n, contact_n, jaws_n);
        let refresh = std::mem::take(&mut self.refresh_contacts);
        self.world.step(step_s, refresh)?;
        let momentum = self.rig.momentum(&self.world, self.direction);
        let contact_force_n = applied_n - (momentum - self.momentum_n_s) / step_s;
        self.contact_force_n = contact_force_n;
        self.rig.arm.follow(&self.world);
        self.momentum_n_s = self.rig.momentum(&self.world, self.direction);
        let speed_m_per_s = self.rig.arm.velocity(&self.world).dot(self.direction);
        let sliding = if self.sliding {
            speed_m_per_s.abs() > STICKING_M_PER_S
        } else {
            speed_m_per_s.abs() > SLIDING_M_PER_S && contact_force_n.abs() >= AT_LIMIT * self.limit_n
        };
        let changed = sliding != self.sliding;
        self.sliding = sliding;
        self.slid_s = if sliding { self.slid_s + step_s } else { 0.0 };
        let falls = self.friction.iter().any(|(_, f)| f.kinetic_fall_s > 0.0);
        if (changed || (sliding && falls)) && self.friction.iter().any(|(_, f)| f.kinetic_ratio != 1.0) {
            self.write_friction();
        }
        let displacement_m = self.position_m() + contact_force_n / self.shear_stiffness_n_per_m;
        Ok(Motion { contact_force_n, displacement_m, speed_m_per_s, sliding })
    }

    /// What the engine's contact of a jaw carries.
    #[cfg(test)]
    pub(crate) fn contact(&self, jaw: Jaw) -> ContactForce {
        self.rig.contact(&self.world, jaw)
    }

    /// Hands the jaws' friction to the engine. It acts from the next step on, which rebuilds all contacts.
    fn write_friction(&mut self) {
        for (jaw, &pad) in self.rig.pads.iter() {
            let ratio = if self.sliding { self.friction[jaw].sliding_share(self.slid_s) } else { 1.0 };
            self.world.colliders[pad].set_friction(self.pad_friction[jaw] * ratio);
        }
        self.refresh_contacts = true;
    }
}
