//! The arm's force loop: how the commanded force becomes a force on the tool.

use gripgen_twin::Robot;
use gripgen_twin::config::Feedback;
use std::collections::VecDeque;

/// The plant of either mechanics after a time step.
pub(crate) struct Motion {
    pub(crate) contact_force_n: f64,
    pub(crate) displacement_m: f64,
    pub(crate) speed_m_per_s: f64,
    pub(crate) sliding: bool,
}

/// State of the force loop, along the pull.
///
/// ```text
/// tau dF/dt = F_des(t - T) - F_closed
/// ```
///
/// with lag `tau`, dead time `T`, and `F_closed` the measured force (`feedback = "measured"`) or F itself
/// (`"independent"`). The two agree while nothing moves; once the jaws slide, a loop that closes on its sensor
/// winds up. The speed limit bounds that: F may exceed the contact force by no more than what the damping takes at
/// the limit.
#[derive(Debug, Clone)]
pub(crate) struct ForceLoop {
    robot: Robot,
    force_n: f64,
    /// Commands under way, with the time at which each becomes effective.
    pending: VecDeque<(f64, f64)>,
    effective_n: f64,
    /// A length of step, and the share of the error that the loop makes up in it.
    share: (f64, f64),
}

impl ForceLoop {
    pub(crate) fn new(robot: Robot) -> Self {
        Self { robot, force_n: 0.0, pending: VecDeque::new(), effective_n: 0.0, share: (0.0, 0.0) }
    }

    /// Starts from a force that already acts, as after a velocity command. Commands still under way are void.
    pub(crate) fn take_over(&mut self, force_n: f64) {
        self.force_n = force_n;
        self.effective_n = force_n;
        self.pending.clear();
    }

    /// Advances by `step_s` and returns the force before damping. `measured_n` and `contact_n` are those of the
    /// previous step.
    pub(crate) fn advance(
        &mut self,
        time_s: f64,
        step_s: f64,
        desired_n: f64,
        measured_n: f64,
        contact_n: f64,
    ) -> f64 {
        self.pending.push_back((time_s + self.robot.dead_time_s, desired_n));
        while self.pending.front().is_some_and(|&(due, _)| due <= time_s + 1e-9) {
            self.effective_n = self.pending.pop_front().map_or(self.effective_n, |(_, force)| force);
        }
        self.close(step_s, measured_n, contact_n)
    }

    /// The force that acts.
    pub(crate) fn force_n(&self) -> f64 {
        self.force_n
    }

    /// The same for a command that has waited its dead time already.
    #[inline]
    pub(crate) fn advance_due(
        &mut self,
        step_s: f64,
        desired_n: f64,
        measured_n: f64,
        contact_n: f64,
    ) -> f64 {
        self.effective_n = desired_n;
        self.close(step_s, measured_n, contact_n)
    }

    #[inline]
    fn close(&mut self, step_s: f64, measured_n: f64, contact_n: f64) -> f64 {
        let closed = match self.robot.feedback {
            Feedback::Measured => measured_n,
            Feedback::Independent => self.force_n,
        };
        if self.share.0 != step_s {
            self.share = (step_s, share_of_error(&self.robot, step_s));
        }
        self.force_n += self.share.1 * (self.effective_n - closed);
        let excess = most_excess_n(&self.robot);
        self.force_n = self.force_n.clamp(contact_n - excess, contact_n + excess);
        self.force_n
    }
}

/// The share of its error that the loop makes up in a step: exact for a command that is constant over it.
pub(crate) fn share_of_error(robot: &Robot, step_s: f64) -> f64 {
    if robot.lag_s > 0.0 { -libm::expm1(-step_s / robot.lag_s) } else { 1.0 }
}

/// By how much the force may exceed that of the contact.
#[inline]
pub(crate) fn most_excess_n(robot: &Robot) -> f64 {
    robot.damping_n_s_per_m * robot.speed_limit_m_per_s
}

#[cfg(test)]
mod tests {
    use super::*;

    fn robot(feedback: Feedback) -> Robot {
        Robot { dead_time_s: 0.02, ..crate::tests::robot(feedback) }
    }

    /// A stuck tool: the measured force is the applied one, and both kinds of feedback give the step response
    /// `1 - exp(-(t - T) / tau)`.
    #[test]
    fn a_stuck_tool_shows_the_first_order_response_after_the_dead_time() {
        for feedback in [Feedback::Measured, Feedback::Independent] {
            let mut control = ForceLoop::new(robot(feedback));
            let (step, mut force) = (0.002, 0.0);
            for i in 0..200 {
                let time = f64::from(i) * step;
                force = control.advance(time, step, 10.0, force, force);
                let since = time + step - 0.02;
                let exact = if since <= 0.0 { 0.0 } else { 10.0 * (1.0 - (-since / 0.05_f64).exp()) };
                assert!((force - exact).abs() < 1e-9, "{feedback:?} at {time} s: {force} against {exact}");
            }
        }
    }

    #[test]
    fn winding_up_is_bounded_by_the_speed_limit() {
        let mut control = ForceLoop::new(robot(Feedback::Measured));
        let mut force = 0.0;
        for i in 0..5000 {
            force = control.advance(f64::from(i) * 0.002, 0.002, 100.0, 12.0, 12.0);
        }
        assert_eq!(force, 12.0 + 2000.0 * 0.02);
    }
}
