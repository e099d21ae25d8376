//! A motion to another pose, in a straight line.

use gripgen_twin::frames::Pose;
use nalgebra::{Translation3, UnitQuaternion, Vector3};

use super::{Phase, ProgramLimitError, StopReason, check_limits, head, registers};

const NAME: &str = "gripgen_move";

/// Position and rotation vector of the tool's grip centre in the robot's base.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TcpPose {
    /// Position.
    pub position_m: [f64; 3],
    /// Rotation vector: direction of the axis, length in radians.
    pub rotation_rad: [f64; 3],
}

impl TcpPose {
    /// From the six numbers that the robot writes.
    pub fn from_numbers([x, y, z, rx, ry, rz]: [f64; 6]) -> Self {
        Self { position_m: [x, y, z], rotation_rad: [rx, ry, rz] }
    }

    /// The six numbers that the robot writes.
    pub fn numbers(&self) -> [f64; 6] {
        let ([x, y, z], [rx, ry, rz]) = (self.position_m, self.rotation_rad);
        [x, y, z, rx, ry, rz]
    }

    /// The same as a rigid motion, `base_from_tool`.
    pub fn base_from_tool(&self) -> Pose {
        let turn = UnitQuaternion::from_scaled_axis(Vector3::from(self.rotation_rad));
        Pose::from_parts(Translation3::from(Vector3::from(self.position_m)), turn)
    }

    /// The pose that is this rigid motion.
    pub fn from_base_from_tool(pose: &Pose) -> Self {
        Self { position_m: pose.translation.vector.into(), rotation_rad: pose.rotation.scaled_axis().into() }
    }

    /// The pose this much higher in the base.
    #[must_use]
    pub fn raised(mut self, by_m: f64) -> Self {
        self.position_m[2] += by_m;
        self
    }

    /// Distance between the positions of two poses.
    pub fn distance_m(&self, other: &Self) -> f64 {
        let squares = (0..3).map(|i| (self.position_m[i] - other.position_m[i]).powi(2));
        squares.sum::<f64>().sqrt()
    }
}

/// A motion in a straight line. A force at the tool, or the host, breaks it off.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct MotionProgram {
    /// Number of the run, at least 1.
    pub run: i32,
    /// Where to.
    pub target: TcpPose,
    /// Largest speed.
    pub speed_mm_s: f64,
    /// Measured force at which the motion is broken off.
    pub abort_force_n: f64,
    /// Longest time of the motion.
    pub max_time_s: f64,
    /// Weight at the flange.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange.
    pub centre_of_gravity_mm: [f64; 3],
    /// Grip centre at the flange.
    pub tool_mm: [f64; 3],
}

impl MotionProgram {
    /// Checks every number; those that are none are outside.
    ///
    /// # Errors
    ///
    /// The first number out of its range.
    pub fn check(&self) -> Result<(), ProgramLimitError> {
        let mut limits = vec![
            ("the number of the run", f64::from(self.run), "", 1.0, 1e9),
            ("the speed", self.speed_mm_s, "mm/s", 1.0, 500.0),
            ("the force to break off at", self.abort_force_n, "N", 1.0, 50.0),
            ("the longest time", self.max_time_s, "s", 0.1, 120.0),
            ("the payload", self.payload_kg, "kg", 0.0, 5.0),
        ];
        limits.extend(self.target.position_m.map(|m| ("the target", m, "m", -1.5, 1.5)));
        limits.extend(
            self.target.rotation_rad.map(|rad| ("the rotation of the target", rad, "rad", -6.3, 6.3)),
        );
        limits.extend(self.centre_of_gravity_mm.map(|mm| ("the centre of gravity", mm, "mm", -500.0, 500.0)));
        limits.extend(self.tool_mm.map(|mm| ("the grip centre at the flange", mm, "mm", -500.0, 500.0)));
        check_limits(&limits)
    }

    /// The program. It ends itself on every way out.
    ///
    /// # Errors
    ///
    /// As [`Self::check`].
    pub fn script(&self) -> Result<String, ProgramLimitError> {
        self.check()?;
        let [x, y, z, rx, ry, rz] = self.target.numbers();
        let ([cx, cy, cz], [tool_x, tool_y, tool_z]) = (self.centre_of_gravity_mm, self.tool_mm);
        let numbers = [
            ("target_x_m", x),
            ("target_y_m", y),
            ("target_z_m", z),
            ("target_rx_rad", rx),
            ("target_ry_rad", ry),
            ("target_rz_rad", rz),
            ("speed_mm_s", self.speed_mm_s),
            ("abort_force_n", self.abort_force_n),
            ("max_time_s", self.max_time_s),
            ("payload_kg", self.payload_kg),
            ("centre_x_mm", cx),
            ("centre_y_mm", cy),
            ("centre_z_mm", cz),
            ("tool_x_mm", tool_x),
            ("tool_y_mm", tool_y),
            ("tool_z_mm", tool_z),
        ];
        let head = head::write(NAME, self.run, &numbers);
        Ok(head + &head::heartbeat() + &body() + &head::farewell())
    }
}

/// What follows the head. A pose that the arm cannot reach is refused before it moves (`get_inverse_kin_has_solution`, PolyScope 5.9.4 and later, the
/// oldest that this rig supports). The go may come a beat after the first: the host writes both, but from two hands. The motion is a thread of
/// its own, so that the main one can watch and stop it.
fn body() -> String {
    use registers::{GO, PHASE, STOP};
    format!(
        "  if reason == 0:
    set_payload(payload_kg, [centre_x_mm / 1000, centre_y_mm / 1000, centre_z_mm / 1000])
    set_tcp(p[tool_x_mm / 1000, tool_y_mm / 1000, tool_z_mm / 1000, 0, 0, 0])
  end
  global gripgen_arrived = False
  global gripgen_target = p[target_x_m, target_y_m, target_z_m, target_rx_rad, target_ry_rad, target_rz_rad]
  global gripgen_speed = speed_mm_s / 1000
  thread motion():
    movel(gripgen_target, a=0.5, v=gripgen_speed)
    gripgen_arrived = True
  end
  if reason == 0 and not get_inverse_kin_has_solution(gripgen_target):
    reason = {unreachable}
  end
  waited = 0.0
  while read_input_integer_register({GO}) != run_id and reason == 0:
    sync()
    waited = waited + get_steptime()
    if waited > {wait:.1} or read_input_integer_register({GO}) == {STOP}:
      reason = {host}
    end
  end
  if reason == 0:
    write_output_integer_register({PHASE}, {moving})
    ticks = 0
    handle = run motion()
    while reason == 0:
      wrench = get_tcp_force()
      if norm([wrench[0], wrench[1], wrench[2]]) > abort_force_n:
        reason = {force}
      elif read_input_integer_register({GO}) != run_id:
        reason = {host}
      elif ticks * get_steptime() > max_time_s:
        reason = {time}
      elif gripgen_arrived:
        reason = {arrived}
      end
      ticks = ticks + 1
      sync()
    end
    write_output_integer_register({PHASE}, {braking})
    kill handle
    stopl({stop:.1})
  end
",
        wait = super::GO_WAIT_S,
        moving = Phase::Moving as i32,
        braking = Phase::Braking as i32,
        force = StopReason::Force as i32,
        host = StopReason::Host as i32,
        time = StopReason::Time as i32,
        arrived = StopReason::Arrived as i32,
        unreachable = StopReason::Unreachable as i32,
        stop = super::STOP_DECELERATION_M_S2,
    )
}
