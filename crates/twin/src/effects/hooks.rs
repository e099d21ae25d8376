//! Where an effect acts, and what it may look at there.

use crate::draw::Drawn;
use crate::{Covariates, Jaw, OpticsState, SINCE_ZERO};

/// Smallest grip force a law is evaluated at, so that `1 / F` and `ln F` stay finite without contact.
const SMALLEST_FORCE_N: f64 = 1e-6;

/// One jaw of one grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripPoint<'a> {
    /// Which jaw.
    pub jaw: Jaw,
    /// Grip force, per jaw: the commanded one where the twin is asked, the real normal force inside a friction
    /// hook.
    pub grip_force_n: f64,
    /// Area in contact; 0 where it is not known.
    pub contact_area_m2: f64,
    /// Mean rate of the pull: increment over step time.
    pub pull_rate_n_per_s: f64,
    /// Circumstances of the pull.
    pub covariates: &'a Covariates,
    /// Seed of the sweep and number of the grip in it: what an effect draws for each grip is a function of them. 0 where nothing
    /// is drawn.
    pub grip: (u64, u64),
}

impl GripPoint<'_> {
    /// The grip force, never 0.
    pub(super) fn positive_force_n(&self) -> f64 {
        positive(self.grip_force_n)
    }

    /// Force over area, where the area is known: the mean pressure of the jaw, that of a cell inside a law of the
    /// pressure.
    pub(super) fn pressure_pa(&self) -> Option<f64> {
        (self.contact_area_m2 > 0.0).then(|| self.grip_force_n / self.contact_area_m2)
    }
}

pub(super) fn positive(force_n: f64) -> f64 {
    force_n.max(SMALLEST_FORCE_N)
}

/// When a sensor is read.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorPoint {
    /// Time of the campaign: that of the pull's start plus the time since then.
    pub clock_s: f64,
    /// Time since the zero of the sensor was set.
    pub since_zero_s: f64,
    /// Time since the reading before.
    pub step_s: f64,
}

impl SensorPoint {
    /// The start of a pull. Without a count from the last zeroing, the zero was set at the start of the campaign.
    pub fn start_of(pull: &Covariates) -> Self {
        let counted = match pull.extra.get(SINCE_ZERO) {
            Some(Drawn::Number(seconds)) => Some(*seconds),
            _ => None,
        };
        Self { clock_s: pull.time_s, since_zero_s: counted.unwrap_or(pull.time_s), step_s: 0.0 }
    }
}

/// What one sensor effect remembers between two readings. Starts as its default.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct SensorMemory {
    /// A reading was made.
    pub started: bool,
    /// Input of the reading before.
    pub previous_n: f64,
    /// Inner state; each effect says what it is.
    pub state: f64,
}

/// Changes a friction coefficient: (parameters in the order of the spec, coefficient so far, where) -> new one.
/// It may be negative; the caller decides what that means.
pub type FrictionHook = fn(&[f64], f64, &GripPoint<'_>) -> f64;

/// Changes the normal force of a jaw: (parameters, force so far in N, where) -> new one in N.
pub type NormalForceHook = fn(&[f64], f64, &GripPoint<'_>) -> f64;

/// Changes the imprint volume: (parameters, volume so far in m3, normal force of the jaw in N) -> new one in m3.
pub type ImprintHook = fn(&[f64], f64, f64) -> f64;

/// Force that the imprints of one grasp show, from the readings of a load cell beside them: (parameters, times in s that rise,
/// forces so far in N) -> new ones in N. Only measured grasps have such readings: a simulated grip holds its force.
pub type GraspForceHook = fn(&[f64], &[f64], &[f64]) -> Vec<f64>;

/// How a tool creeps under a pull F that jaws hold which let go at L, beside all other motion:
///
/// ```text
/// dx/dt = rate F (1 - F / L)^-q
/// ```
///
/// It shears nothing. The damping of the arm acts on the creep of what sticks, `rate F`: a force loop has to make up for it. That of the rim
/// is left out of the forces, as contacts that slow down the nearer they are to their limit would never get there.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Creep {
    /// Speed per newton in m/(N s) of a contact of which all sticks; 0 does not creep.
    pub rate_m_per_n_s: f64,
    /// q: how much faster the rest creeps while the rim of the contact slips.
    pub rim_exponent: f64,
}

/// Share of the limit that is left at least: what happens nearer to it is slip.
const LEFT: f64 = 0.01;

impl Creep {
    /// The speed in m/s under a force, of jaws that let go at `limit_n`.
    #[inline]
    pub fn speed_m_per_s(&self, force_n: f64, limit_n: f64) -> f64 {
        if self.rate_m_per_n_s == 0.0 || self.rim_exponent == 0.0 || limit_n <= 0.0 {
            return self.rate_m_per_n_s * force_n;
        }
        let left = (1.0 - force_n / limit_n).clamp(LEFT, 1.0);
        self.rate_m_per_n_s * force_n * libm::pow(left, -self.rim_exponent)
    }

    /// The rate with which a tool would creep as far whose contact sticks as a whole, of a pull that rises evenly from nothing to `share` of
    /// the limit:
    ///
    /// ```text
    /// 2 / u^2 int_0^u s (1 - s)^-q ds,   q < 1
    /// ```
    pub fn mean_rate_m_per_n_s(&self, share: f64) -> f64 {
        let (q, u) = (self.rim_exponent.clamp(0.0, 0.99), share.clamp(0.0, 1.0 - LEFT));
        if q == 0.0 || u < 1e-3 {
            return self.rate_m_per_n_s;
        }
        let to = |power: f64| (1.0 - libm::pow(1.0 - u, power)) / power;
        self.rate_m_per_n_s * 2.0 / (u * u) * (to(1.0 - q) - to(2.0 - q))
    }
}

/// Creep of a tool: (parameters, one jaw, its force the mean normal force of both) -> how it creeps.
pub type CreepHook = fn(&[f64], &GripPoint<'_>) -> Creep;

/// Turns a gel about its +x axis: (parameters, where) -> angle in rad. Positive angles bring its lower edge
/// nearer to the part.
pub type TiltHook = fn(&[f64], &GripPoint<'_>) -> f64;

/// Changes a reading of the wrist sensor: (parameters, force so far in N, memory, when) -> new one in N.
pub type SensorHook = fn(&[f64], f64, &mut SensorMemory, &SensorPoint) -> f64;

/// Changes the command of the force loop: (parameters, desired force in N, measured force in N) -> force in N
/// that the loop closes on.
pub type CommandHook = fn(&[f64], f64, f64) -> f64;

/// Changes the optics of a jaw: (parameters, optics so far, where). Pixels follow from them in `tactile`.
pub type OpticsHook = fn(&[f64], &mut OpticsState, &GripPoint<'_>);

/// The parameters of a spec by position.
pub(super) fn values<const N: usize>(parameters: &[f64]) -> [f64; N] {
    match parameters.try_into() {
        Ok(values) => values,
        Err(_) => panic!("the spec has {N} parameters, {} were given", parameters.len()),
    }
}
