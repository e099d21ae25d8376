//! The pull as a program for the robot: the staircase runs on the controller, at its own rate.
//!
//! The commanded force then arrives in the same packet as the measured one, and nothing depends on the host being in time. The
//! host only says go and keeps a heartbeat; when it stops, the controller stops the program by itself. Functions of URScript
//! are those of Universal Robots, "The URScript Programming Language" for e-Series (5.x).
//!
//! **Not run on a robot yet.** What is tested is the text: every limit, every way out, no line after the end.

#[cfg(test)]
mod tests;

use std::fmt::Write;

/// What the program says of itself, in output register 24.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Phase {
    /// It waits for the heartbeat.
    Started = 1,
    /// The sensor is zeroed with the hand open: now grip, then say go.
    Zeroed = 2,
    /// It pulls.
    Pulling = 3,
    /// It has stopped; the reason stands in register 27.
    Stopped = 4,
}

/// Why the program stopped, in output register 27.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum StopReason {
    /// The tool has moved as far as it should: the normal end.
    Displacement = 1,
    /// The command has reached its largest force.
    LargestCommand = 2,
    /// More force than is allowed was measured.
    Force = 3,
    /// The tool has moved aside.
    Lateral = 4,
    /// More torque than is allowed was measured.
    Torque = 5,
    /// The time is up.
    Time = 6,
    /// The host said stop, or never said go.
    Host = 7,
    /// The heartbeat never came.
    NoHeartbeat = 8,
}

impl StopReason {
    /// The reason with this number.
    pub fn from_number(number: i32) -> Option<Self> {
        use StopReason::{Displacement, Force, Host, LargestCommand, Lateral, NoHeartbeat, Time, Torque};
        let all = [Displacement, LargestCommand, Force, Lateral, Torque, Time, Host, NoHeartbeat];
        all.into_iter().find(|reason| *reason as i32 == number)
    }
}

/// Registers that the program and the host meet in; 24 and up are for outside clients, below are fieldbuses.
pub mod registers {
    /// Input, integer: changes with every packet of the host.
    pub const HEARTBEAT: u8 = 24;
    /// Input, integer: the number of the run to go, 0 to stop.
    pub const GO: u8 = 25;
    /// Output, integer: [`Phase`](super::Phase).
    pub const PHASE: u8 = 24;
    /// Output, integer: which step of the staircase.
    pub const STEP: u8 = 25;
    /// Output, integer: the number of the run.
    pub const RUN: u8 = 26;
    /// Output, integer: [`StopReason`](super::StopReason).
    pub const REASON: u8 = 27;
    /// Output, double: the commanded force, N.
    pub const DESIRED_FORCE: u8 = 24;
    /// Output, double: how far the tool has moved along the pull, m.
    pub const DISPLACEMENT: u8 = 25;
    /// Output, double: how far it has moved aside, m.
    pub const LATERAL: u8 = 26;
    /// Output, double: force along the pull before it began, N.
    pub const PRELOAD: u8 = 27;
}

/// A pull along +z or -z of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullProgram {
    /// Number of the run, at least 1.
    pub run: i32,
    /// Height of a step.
    pub increment_n: f64,
    /// Length of a step; the controller rounds it to its own steps.
    pub step_s: f64,
    /// +1 up, -1 down.
    pub direction: f64,
    /// Displacement at which the pull ends.
    pub stop_mm: f64,
    /// Largest command.
    pub max_force_n: f64,
    /// Measured force at which the pull is broken off.
    pub abort_force_n: f64,
    /// Measured torque at which it is broken off.
    pub abort_torque_nm: f64,
    /// Largest speed along the pull.
    pub speed_mm_s: f64,
    /// How far the tool may move aside.
    pub lateral_mm: f64,
    /// Longest time of a pull.
    pub max_time_s: f64,
    /// Weight at the flange.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange.
    pub centre_of_gravity_mm: [f64; 3],
}

impl Default for PullProgram {
    /// The paper's staircase inside what a UR5e's sensor can measure (50 N, 10 Nm); 20 mm/s keep the overshoot after a slip below
    /// half a millimetre.
    fn default() -> Self {
        Self {
            run: 1,
            increment_n: 1.0,
            step_s: 0.104,
            direction: 1.0,
            stop_mm: 5.0,
            max_force_n: 45.0,
            abort_force_n: 50.0,
            abort_torque_nm: 8.0,
            speed_mm_s: 20.0,
            lateral_mm: 5.0,
            max_time_s: 30.0,
            payload_kg: 1.6,
            centre_of_gravity_mm: [0.0, 0.0, 80.0],
        }
    }
}

/// A number that no pull of this rig may have: nothing was sent.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[error("{what} is {value} {unit}, it must be from {least} to {most} {unit}")]
pub struct PullLimitError {
    /// Which number.
    pub what: &'static str,
    /// Its value.
    pub value: f64,
    /// Its unit.
    pub unit: &'static str,
    /// Smallest.
    pub least: f64,
    /// Largest.
    pub most: f64,
}

impl PullProgram {
    /// Checks every number; those that are none are outside.
    pub fn check(&self) -> Result<(), PullLimitError> {
        let limits = [
            ("the number of the run", f64::from(self.run), "", 1.0, 1e9),
            ("the increment", self.increment_n, "N", 0.1, 5.0),
            ("the step", self.step_s, "s", 0.01, 5.0),
            ("the direction", self.direction.abs(), "", 1.0, 1.0),
            ("the displacement stop", self.stop_mm, "mm", 0.5, 20.0),
            ("the largest command", self.max_force_n, "N", self.increment_n, 45.0),
            ("the force to break off at", self.abort_force_n, "N", self.max_force_n, 50.0),
            ("the torque to break off at", self.abort_torque_nm, "Nm", 0.5, 10.0),
            ("the speed", self.speed_mm_s, "mm/s", 1.0, 50.0),
            ("the lateral deviation", self.lateral_mm, "mm", 0.5, 10.0),
            ("the longest time", self.max_time_s, "s", self.step_s, 120.0),
            ("the payload", self.payload_kg, "kg", 0.0, 5.0),
        ];
        let outside =
            |&&(_, value, _, least, most): &&(&str, f64, &str, f64, f64)| !(value >= least && value <= most);
        match limits.iter().find(outside) {
            Some(&(what, value, unit, least, most)) => Err(PullLimitError { what, value, unit, least, most }),
            None if self.centre_of_gravity_mm.iter().all(|x| x.abs() <= 500.0) => Ok(()),
            None => {
                let value = self.centre_of_gravity_mm.into_iter().find(|x| x.abs() > 500.0 || x.is_nan());
                let (what, unit) = ("the centre of gravity", "mm");
                let value = value.unwrap_or(f64::NAN);
                Err(PullLimitError { what, value, unit, least: -500.0, most: 500.0 })
            }
        }
    }

    /// The program. One function that is called once; it ends itself on every way out.
    pub fn script(&self) -> Result<String, PullLimitError> {
        use registers as r;
        self.check()?;
        let [x, y, z] = self.centre_of_gravity_mm.map(|mm| mm * 1e-3);
        let (run, sign) = (self.run, self.direction);
        let (stop_m, lateral_m, speed_m_s) =
            (self.stop_mm * 1e-3, self.lateral_mm * 1e-3, self.speed_mm_s * 1e-3);
        let reason = |reason: StopReason| reason as i32;
        let phase =
            |phase: Phase| format!("  write_output_integer_register({}, {})\n", r::PHASE, phase as i32);
        let mut s = String::from("def gripgen_pull():\n");
        let _ = write!(
            s,
            "  set_payload({:.3}, [{x:.4}, {y:.4}, {z:.4}])\n  reason = 0\n  step = 0\n  desired = 0.0\n\
             \x20 write_output_integer_register({run_register}, {run})\n  write_output_integer_register({}, 0)\n\
             \x20 write_output_integer_register({}, 0)\n  write_output_float_register({}, 0.0)\n",
            self.payload_kg,
            r::REASON,
            r::STEP,
            r::DESIRED_FORCE,
            run_register = r::RUN,
        );
        s += &phase(Phase::Started);
        // A heartbeat that changes, or no pull: the watchdog is set only when somebody kicks it.
        let _ = write!(
            s,
            "  first = read_input_integer_register({hb})\n  waited = 0.0\n\
             \x20 while reason == 0 and read_input_integer_register({hb}) == first:\n    sync()\n\
             \x20   waited = waited + get_steptime()\n    if waited > 10.0:\n      reason = {no_heartbeat}\n    end\n  end\n\
             \x20 if reason == 0:\n    rtde_set_watchdog(\"input_int_register_{hb}\", 10.0, \"stop\")\n\
             \x20   sleep(0.5)\n    zero_ftsensor()\n  {}\
             \x20   while read_input_integer_register({go}) != {run} and reason == 0:\n      sync()\n\
             \x20     waited = waited + get_steptime()\n      if waited > 120.0:\n        reason = {host}\n      end\n    end\n  end\n",
            phase(Phase::Zeroed),
            hb = r::HEARTBEAT,
            go = r::GO,
            no_heartbeat = reason(StopReason::NoHeartbeat),
            host = reason(StopReason::Host),
        );
        // The preload is stored and not zeroed away: clamping may press the part along the pull.
        let _ = write!(
            s,
            "  if reason == 0:\n    ticks = 0\n    sum = 0.0\n    while ticks * get_steptime() < 0.25:\n\
             \x20     wrench = get_tcp_force()\n      sum = sum + wrench[2]\n      ticks = ticks + 1\n      sync()\n    end\n\
             \x20   write_output_float_register({}, {sign:.0} * sum / ticks)\n    sleep(0.05)\n\
             \x20   force_mode_set_damping(0.025)\n    force_mode_set_gain_scaling(0.5)\n    start = get_actual_tcp_pose()\n\
             \x20   frame = p[start[0], start[1], start[2], 0, 0, 0]\n    ticks = 0\n  {}",
            r::PRELOAD,
            phase(Phase::Pulling),
        );
        let _ = write!(
            s,
            "    while reason == 0:\n      time = ticks * get_steptime()\n      now = floor(time / {step_s:.6}) + 1\n\
             \x20     if now != step:\n        step = now\n        desired = step * {increment_n:.6}\n\
             \x20       if desired > {max_force_n:.6}:\n          reason = {largest}\n        else:\n\
             \x20         force_mode(frame, [0, 0, 1, 0, 0, 0], [0, 0, {sign:.0} * desired, 0, 0, 0], 2, [{lateral_m:.6}, \
             {lateral_m:.6}, {speed_m_s:.6}, 0.03, 0.03, 0.03])\n        end\n      end\n",
            step_s = self.step_s,
            increment_n = self.increment_n,
            max_force_n = self.max_force_n,
            largest = reason(StopReason::LargestCommand),
        );
        let _ = write!(
            s,
            "      pose = get_actual_tcp_pose()\n      wrench = get_tcp_force()\n\
             \x20     moved = {sign:.0} * (pose[2] - start[2])\n\
             \x20     aside = sqrt((pose[0] - start[0]) * (pose[0] - start[0]) + (pose[1] - start[1]) * (pose[1] - start[1]))\n\
             \x20     torque = sqrt(wrench[3] * wrench[3] + wrench[4] * wrench[4] + wrench[5] * wrench[5])\n\
             \x20     write_output_integer_register({step}, step)\n      write_output_float_register({desired}, desired)\n\
             \x20     write_output_float_register({moved}, moved)\n      write_output_float_register({aside}, aside)\n",
            step = r::STEP,
            desired = r::DESIRED_FORCE,
            moved = r::DISPLACEMENT,
            aside = r::LATERAL,
        );
        let exits = [
            (format!("norm(wrench[2]) > {:.6}", self.abort_force_n), StopReason::Force),
            (format!("torque > {:.6}", self.abort_torque_nm), StopReason::Torque),
            (format!("aside > {lateral_m:.6}"), StopReason::Lateral),
            (format!("norm(moved) > {stop_m:.6}"), StopReason::Displacement),
            (format!("read_input_integer_register({}) != {run}", r::GO), StopReason::Host),
            (format!("time > {:.6}", self.max_time_s), StopReason::Time),
        ];
        for (i, (condition, why)) in exits.iter().enumerate() {
            let word = if i == 0 { "if" } else { "elif" };
            let _ = write!(s, "      {word} {condition}:\n        reason = {}\n", reason(*why));
        }
        let _ = write!(
            s,
            "      end\n      ticks = ticks + 1\n      sync()\n    end\n    end_force_mode()\n    stopl(2.0)\n  end\n\
             \x20 write_output_integer_register({}, reason)\n{}",
            r::REASON,
            phase(Phase::Stopped),
        );
        // The host reads the reason and takes its go back; the watchdog ends with the program.
        let _ = write!(
            s,
            "  waited = 0.0\n  while read_input_integer_register({}) == {run} and waited < 2.0:\n    sync()\n\
             \x20   waited = waited + get_steptime()\n  end\nend\ngripgen_pull()\n",
            r::GO,
        );
        Ok(s)
    }
}
