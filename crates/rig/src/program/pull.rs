//! The pull.

use super::{Phase, ProgramLimitError, StopReason, check_limits, head, registers};

const NAME: &str = "gripgen_pull";

/// A pull along +z or -z of the base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PullProgram {
    /// Number of the run, at least 1.
    pub run: i32,
    /// Height of a step.
    pub increment_n: f64,
    /// Command of the first step.
    pub start_n: f64,
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
    /// How long the program waits for the go: the host grips and takes images in the meantime.
    pub wait_s: f64,
    /// Weight at the flange.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange.
    pub centre_of_gravity_mm: [f64; 3],
    /// Grip centre at the flange.
    pub tool_mm: [f64; 3],
}

impl Default for PullProgram {
    /// The paper's staircase inside what a UR5e's sensor can measure (50 N, 10 Nm); 20 mm/s keep the overshoot after a slip below
    /// half a millimetre. The wrist of a UR5e carries 1.6 kg of gripper and sensors.
    fn default() -> Self {
        Self {
            run: 1,
            increment_n: 1.0,
            start_n: 1.0,
            step_s: 0.104,
            direction: 1.0,
            stop_mm: 5.0,
            max_force_n: 45.0,
            abort_force_n: 50.0,
            abort_torque_nm: 8.0,
            speed_mm_s: 20.0,
            lateral_mm: 5.0,
            max_time_s: 30.0,
            wait_s: 120.0,
            payload_kg: 1.6,
            centre_of_gravity_mm: [0.0, 0.0, 80.0],
            tool_mm: [0.0, 0.0, 200.0],
        }
    }
}

impl PullProgram {
    /// Checks every number; those that are none are outside.
    ///
    /// # Errors
    ///
    /// The first number out of its range.
    pub fn check(&self) -> Result<(), ProgramLimitError> {
        let mut limits = vec![
            ("the number of the run", f64::from(self.run), "", 1.0, 1e9),
            ("the increment", self.increment_n, "N", 0.1, 5.0),
            ("the start force", self.start_n, "N", 0.0, self.max_force_n),
            ("the step", self.step_s, "s", 0.01, 5.0),
            ("the direction", self.direction.abs(), "", 1.0, 1.0),
            ("the displacement stop", self.stop_mm, "mm", 0.5, 20.0),
            ("the largest command", self.max_force_n, "N", self.increment_n, 45.0),
            ("the force to break off at", self.abort_force_n, "N", self.max_force_n, 50.0),
            ("the torque to break off at", self.abort_torque_nm, "Nm", 0.5, 10.0),
            ("the speed", self.speed_mm_s, "mm/s", 1.0, 50.0),
            ("the lateral deviation", self.lateral_mm, "mm", 0.5, 10.0),
            ("the longest time", self.max_time_s, "s", self.step_s, 300.0),
            ("the wait for the go", self.wait_s, "s", 1.0, 7200.0),
            ("the payload", self.payload_kg, "kg", 0.0, 5.0),
        ];
        limits.extend(self.centre_of_gravity_mm.map(|mm| ("the centre of gravity", mm, "mm", -500.0, 500.0)));
        limits.extend(self.tool_mm.map(|mm| ("the grip centre at the flange", mm, "mm", -500.0, 500.0)));
        check_limits(&limits)
    }

    fn numbers(&self) -> [(&'static str, f64); 19] {
        let ([x, y, z], [tool_x, tool_y, tool_z]) = (self.centre_of_gravity_mm, self.tool_mm);
        [
            ("increment_n", self.increment_n),
            ("start_n", self.start_n),
            ("step_s", self.step_s),
            ("direction", self.direction),
            ("stop_mm", self.stop_mm),
            ("max_force_n", self.max_force_n),
            ("abort_force_n", self.abort_force_n),
            ("abort_torque_nm", self.abort_torque_nm),
            ("speed_mm_s", self.speed_mm_s),
            ("lateral_mm", self.lateral_mm),
            ("max_time_s", self.max_time_s),
            ("wait_s", self.wait_s),
            ("payload_kg", self.payload_kg),
            ("centre_x_mm", x),
            ("centre_y_mm", y),
            ("centre_z_mm", z),
            ("tool_x_mm", tool_x),
            ("tool_y_mm", tool_y),
            ("tool_z_mm", tool_z),
        ]
    }

    /// The program. One function that is called once; it ends itself on every way out.
    ///
    /// # Errors
    ///
    /// As [`Self::check`].
    pub fn script(&self) -> Result<String, ProgramLimitError> {
        self.check()?;
        let head = head::write(NAME, self.run, &self.numbers());
        Ok(head + &head::heartbeat() + &body() + &head::farewell())
    }
}

/// What follows the head.
fn body() -> String {
    use registers::{DESIRED_FORCE, DISPLACEMENT, GO, LATERAL, PHASE, PRELOAD, STEP, STOP};
    let exits = [
        ("norm(wrench[2]) > abort_force_n".to_string(), StopReason::Force),
        ("torque > abort_torque_nm".into(), StopReason::Torque),
        ("aside > lateral_mm / 1000".into(), StopReason::Lateral),
        ("norm(moved) > stop_mm / 1000".into(), StopReason::Displacement),
        (format!("read_input_integer_register({GO}) != run_id"), StopReason::Host),
        ("elapsed > max_time_s".into(), StopReason::Time),
    ];
    let exits: String = exits
        .iter()
        .enumerate()
        .map(|(i, (condition, why))| {
            let word = if i == 0 { "if" } else { "elif" };
            format!("      {word} {condition}:\n        reason = {}\n", *why as i32)
        })
        .collect();
    // The preload is stored and not zeroed away: clamping may press the part along the pull.
    format!(
        "  step = 0
  desired = 0.0
  waited = 0.0
  if reason == 0:
    set_payload(payload_kg, [centre_x_mm / 1000, centre_y_mm / 1000, centre_z_mm / 1000])
    set_tcp(p[tool_x_mm / 1000, tool_y_mm / 1000, tool_z_mm / 1000, 0, 0, 0])
    sleep({rest})
    zero_ftsensor()
    write_output_integer_register({PHASE}, {zeroed})
    while read_input_integer_register({GO}) != run_id and reason == 0:
      sync()
      waited = waited + get_steptime()
      if waited > wait_s or read_input_integer_register({GO}) == {STOP}:
        reason = {host}
      end
    end
  end
  if reason == 0:
    ticks = 0
    sum = 0.0
    while ticks * get_steptime() < {preload}:
      wrench = get_tcp_force()
      sum = sum + wrench[2]
      ticks = ticks + 1
      sync()
    end
    write_output_float_register({PRELOAD}, direction * sum / ticks)
    sleep({settle})
    force_mode_set_damping(0.025)
    force_mode_set_gain_scaling(0.5)
    start = get_actual_tcp_pose()
    frame = p[start[0], start[1], start[2], 0, 0, 0]
    aside_m = lateral_mm / 1000
    ticks = 0
    write_output_integer_register({PHASE}, {pulling})
    while reason == 0:
      elapsed = ticks * get_steptime()
      now = floor(elapsed / step_s + 0.000001) + 1
      if now != step:
        step = now
        desired = start_n + (step - 1) * increment_n
        if desired > max_force_n:
          reason = {largest}
        else:
          force_mode(frame, [0, 0, 1, 0, 0, 0], [0, 0, direction * desired, 0, 0, 0], 2, [aside_m, aside_m, speed_mm_s / 1000, 0.03, 0.03, 0.03])
        end
      end
      pose = get_actual_tcp_pose()
      wrench = get_tcp_force()
      moved = direction * (pose[2] - start[2])
      aside = sqrt((pose[0] - start[0]) * (pose[0] - start[0]) + (pose[1] - start[1]) * (pose[1] - start[1]))
      torque = sqrt(wrench[3] * wrench[3] + wrench[4] * wrench[4] + wrench[5] * wrench[5])
      write_output_integer_register({STEP}, step)
      write_output_float_register({DESIRED_FORCE}, desired)
      write_output_float_register({DISPLACEMENT}, moved)
      write_output_float_register({LATERAL}, aside)
{exits}      end
      ticks = ticks + 1
      sync()
    end
    write_output_integer_register({PHASE}, {braking})
    end_force_mode()
    stopl({stop:.1})
  end
",
        rest = super::ZERO_REST_S,
        zeroed = Phase::Zeroed as i32,
        host = StopReason::Host as i32,
        preload = super::PRELOAD_S,
        settle = super::SETTLE_S,
        pulling = Phase::Pulling as i32,
        braking = Phase::Braking as i32,
        largest = StopReason::LargestCommand as i32,
        stop = super::STOP_DECELERATION_M_S2,
    )
}
