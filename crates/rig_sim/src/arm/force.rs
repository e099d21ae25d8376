//! Force mode of the virtual arm.

use super::super::urscript::ForceMode;
use super::{Arm, ArmError, GRAVITY_M_S2, STEP_S, share};
use gripgen_rig::program::TcpPose;
use gripgen_twin::plant::{PullReading, PullRequest};
use nalgebra::{UnitQuaternion, Vector3};

/// A load that an axis which is to apply nothing does not follow.
const FELT_N: f64 = 0.5;
/// Length of the first step of a staircase, until the second says it.
const FIRST_STEP_S: f64 = 0.104;
/// Control steps after which there is no second step to wait for.
const FIRST_STEPS: usize = 2500;
/// A part that moved so far has slipped.
const STUCK_M: f64 = 1e-3;

/// A pull under way, or ended with the jaws still closed.
pub(super) struct Pulling {
    from: TcpPose,
    pub(super) request: PullRequest,
    pub(super) reading: PullReading,
    first: Option<FirstStep>,
}

/// The first step of a staircase. Only the second says how fast the pull rises: then it is begun again with that.
struct FirstStep {
    asked_n: f64,
    applied_n: Vec<f64>,
}

/// A command of force mode in the axes of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Applied {
    /// Along the base's z.
    z_n: f64,
    /// Whether it gives way along z at all.
    gives_way: bool,
    /// Velocity of the tool where nothing holds it.
    free_m_s: [f64; 3],
    /// Rate of its rotation vector.
    turn_rad_s: [f64; 3],
}

impl Arm {
    /// What a command of force mode means in the axes of the base: the force, and how the tool moves where nothing holds it. An
    /// axis that is to apply nothing follows what loads it.
    fn applied(&self, mode: &ForceMode) -> Applied {
        let [_, _, _, rx, ry, rz] = mode.frame;
        let turn = UnitQuaternion::from_scaled_axis(Vector3::new(rx, ry, rz));
        let load_n = Vector3::new(self.across_n(), 0.0, -self.hung_mass_kg * GRAVITY_M_S2);
        let (mut force, mut free, mut turning) = (Vector3::zeros(), Vector3::zeros(), Vector3::zeros());
        let mut gives_way = false;
        let sign = |asked: f64, load: f64, least: f64| {
            let net = asked + load;
            if net.abs() > if asked == 0.0 { least } else { 0.0 } { net.signum() } else { 0.0 }
        };
        for i in (0..3).filter(|i| mode.compliant[*i]) {
            let axis = turn * Vector3::ith(i, 1.0);
            force += axis * mode.wrench[i];
            free += axis * mode.limits[i] * sign(mode.wrench[i], load_n.dot(&axis), FELT_N);
            gives_way |= axis.z.abs() > 1e-6;
        }
        for i in (0..3).filter(|i| mode.compliant[3 + *i]) {
            let axis = turn * Vector3::ith(i, 1.0);
            turning += axis * mode.limits[3 + i] * sign(mode.wrench[3 + i], 0.0, 0.0);
        }
        Applied { z_n: force.z, gives_way, free_m_s: free.into(), turn_rad_s: turning.into() }
    }

    pub(super) fn apply(&mut self, mode: &ForceMode, time_s: f64) -> Result<(), ArmError> {
        let applied = self.applied(mode);
        let before = self.tcp;
        let moves = |tcp: &mut TcpPose, axes: std::ops::Range<usize>| {
            for i in axes {
                tcp.position_m[i] += applied.free_m_s[i] * STEP_S;
            }
        };
        moves(&mut self.tcp, 0..2);
        for i in 0..3 {
            self.tcp.rotation_rad[i] += applied.turn_rad_s[i] * STEP_S;
        }
        let held = self.grip.as_ref().is_some_and(|grip| grip.holds());
        if !held {
            moves(&mut self.tcp, 2..3);
        } else if applied.gives_way {
            let asked_n = self.after_dead_time(applied.z_n);
            self.applied_n += (asked_n - self.applied_n) * share(self.faults.force_lag_s);
            self.pull(applied.z_n, self.applied_n, time_s)?;
        }
        self.velocity_m_s = [0, 1, 2].map(|i| (self.tcp.position_m[i] - before.position_m[i]) / STEP_S);
        Ok(())
    }

    /// What was asked a dead time ago.
    fn after_dead_time(&mut self, asked_n: f64) -> f64 {
        self.asked_n.push_back(asked_n);
        let steps = (self.faults.force_dead_s / STEP_S).round() as usize;
        let mut oldest = 0.0;
        while self.asked_n.len() > steps {
            oldest = self.asked_n.pop_front().unwrap_or_default();
        }
        oldest
    }

    /// Pulls at what is held: what was asked says what the pull is, what is applied moves it.
    fn pull(&mut self, asked_n: f64, applied_n: f64, time_s: f64) -> Result<(), ArmError> {
        let dwell_s = self.dwell_s(time_s);
        let Some(grip) = self.grip.as_mut() else { return Ok(()) };
        let pulling = match &mut self.pulling {
            Some(pulling) => pulling,
            none => {
                let request = PullRequest {
                    direction: 1.0_f64.copysign(asked_n),
                    increment_n: asked_n.abs(),
                    step_s: FIRST_STEP_S,
                    dwell_s,
                    time_s,
                };
                let reading = grip.begin_pull(&request)?;
                let first = FirstStep { asked_n, applied_n: Vec::new() };
                none.insert(Pulling { from: self.tcp, request, reading, first: Some(first) })
            }
        };
        let direction = pulling.request.direction;
        if let Some(first) = &mut pulling.first {
            let stuck = pulling.reading.displacement_m < STUCK_M && first.applied_n.len() < FIRST_STEPS;
            if stuck && asked_n != first.asked_n {
                pulling.request.increment_n = (asked_n - first.asked_n).abs();
                pulling.request.step_s = (first.applied_n.len() as f64 * STEP_S * 1e6).round() * 1e-6;
                pulling.reading = grip.begin_pull(&pulling.request)?;
                for before_n in &first.applied_n {
                    pulling.reading = grip.pull(direction * before_n, STEP_S)?;
                }
            }
            if stuck && asked_n == first.asked_n {
                first.applied_n.push(applied_n);
            } else {
                pulling.first = None;
            }
        }
        pulling.reading = grip.pull(direction * applied_n, STEP_S)?;
        self.tcp.position_m[2] = pulling.from.position_m[2] + direction * pulling.reading.displacement_m;
        Ok(())
    }
}
