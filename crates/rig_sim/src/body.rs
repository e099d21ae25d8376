//! The virtual robot as its programs see it.

use super::arm::Arm;
use super::robot::Robot;
use super::urscript::{ForceMode, Hands, Watchdog};
use gripgen_rig::program::TcpPose;
use nalgebra::Vector3;

/// Heaviest payload of a UR5e.
const MAX_PAYLOAD_KG: f64 = 5.0;
/// Messages of a program that are kept for one control step.
const MAX_SAID: usize = 16;

/// Robot and arm in the hands of a program, for one control step.
pub(super) struct Body<'a> {
    robot: &'a mut Robot,
    arm: &'a mut Arm,
    watchdog: Option<Watchdog>,
    said: Vec<String>,
}

impl<'a> Body<'a> {
    pub(super) fn new(robot: &'a mut Robot, arm: &'a mut Arm) -> Self {
        Self { robot, arm, watchdog: None, said: Vec::new() }
    }

    /// The watchdog that was set, and what was said.
    pub(super) fn into_parts(self) -> (Option<Watchdog>, Vec<String>) {
        (self.watchdog, self.said)
    }
}

impl Hands for Body<'_> {
    fn tcp_pose(&self) -> [f64; 6] {
        self.robot.tcp.numbers()
    }

    fn tcp_speed(&self) -> [f64; 6] {
        let [x, y, z] = self.robot.velocity_m_s;
        [x, y, z, 0.0, 0.0, 0.0]
    }

    /// Forces as RTDE has them; torques about the flange, where the sensor is: there the tool is their lever.
    fn tcp_force(&self) -> [f64; 6] {
        let [fx, fy, fz, mx, my, mz] = self.robot.wrench;
        let lever_m = self.robot.tcp.base_from_tool().rotation * Vector3::from(self.robot.tool_m);
        let torque_nm = lever_m.cross(&Vector3::new(fx, fy, fz)) + Vector3::new(mx, my, mz);
        [fx, fy, fz, torque_nm.x, torque_nm.y, torque_nm.z]
    }

    fn joints(&self) -> [f64; 6] {
        self.robot.joints_rad
    }

    fn joint_speeds(&self) -> [f64; 6] {
        self.robot.joint_speeds_rad_s
    }

    fn tool(&self) -> [f64; 6] {
        let [x, y, z] = self.robot.tool_m;
        [x, y, z, 0.0, 0.0, 0.0]
    }

    fn payload_kg(&self) -> f64 {
        self.robot.payload_kg
    }

    fn input_int(&self, register: usize) -> Option<i32> {
        self.robot.inputs.int.get(register).copied()
    }

    fn input_float(&self, register: usize) -> Option<f64> {
        self.robot.inputs.double.get(register).copied()
    }

    fn input_bool(&self, register: usize) -> Option<bool> {
        (register < 128).then(|| self.robot.inputs.bits >> register & 1 == 1)
    }

    fn output_int(&mut self, register: usize) -> Option<&mut i32> {
        self.robot.outputs.int.get_mut(register)
    }

    fn output_float(&mut self, register: usize) -> Option<&mut f64> {
        self.robot.outputs.double.get_mut(register)
    }

    fn write_output_bool(&mut self, register: usize, value: bool) -> bool {
        if register >= 128 {
            return false;
        }
        let bits = &mut self.robot.outputs.bits;
        *bits = *bits & !(1 << register) | u128::from(value) << register;
        true
    }

    fn set_payload(&mut self, mass_kg: f64, centre_m: Option<[f64; 3]>) -> Result<(), String> {
        if !(0.0..=MAX_PAYLOAD_KG).contains(&mass_kg) {
            return Err(format!("a payload of {mass_kg} kg, from 0 to {MAX_PAYLOAD_KG} kg are taken"));
        }
        self.robot.payload_kg = mass_kg;
        self.robot.centre_of_gravity_m = centre_m.unwrap_or(self.robot.centre_of_gravity_m);
        Ok(())
    }

    fn set_tool(&mut self, [x, y, z, rx, ry, rz]: [f64; 6]) -> Result<(), String> {
        if [rx, ry, rz] != [0.0; 3] {
            return Err("a tool that is turned at the flange is not simulated".into());
        }
        self.robot.tool_m = [x, y, z];
        self.arm.set_tool([x, y, z]);
        self.robot.tcp = self.arm.tcp();
        Ok(())
    }

    fn zero_sensor(&mut self) {
        self.arm.zero();
    }

    fn force_mode(&mut self, mode: ForceMode) -> Result<(), String> {
        self.arm.force_mode(mode)
    }

    fn end_force_mode(&mut self) {
        self.arm.end_force_mode();
    }

    fn set_damping(&mut self, damping: f64) {
        self.arm.set_force_settings(Some(damping), None);
    }

    fn set_gain(&mut self, gain: f64) {
        self.arm.set_force_settings(None, Some(gain));
    }

    fn move_line(&mut self, target: [f64; 6], acceleration_m_s2: f64, speed_m_s: f64) -> Result<(), String> {
        self.arm.move_line(TcpPose::from_numbers(target), acceleration_m_s2, speed_m_s)
    }

    fn move_joints(
        &mut self,
        target_rad: [f64; 6],
        acceleration_rad_s2: f64,
        speed_rad_s: f64,
    ) -> Result<(), String> {
        self.arm.move_joints(target_rad, acceleration_rad_s2, speed_rad_s)
    }

    fn brake(&mut self, deceleration_m_s2: f64) {
        self.arm.brake(deceleration_m_s2);
    }

    fn brake_joints(&mut self, deceleration_rad_s2: f64) {
        self.arm.brake_joints(deceleration_rad_s2);
    }

    fn is_moving(&self) -> bool {
        self.arm.is_driven()
    }

    fn set_watchdog(&mut self, watchdog: Watchdog) {
        self.watchdog = Some(watchdog);
    }

    fn message(&mut self, text: String) {
        if self.said.len() < MAX_SAID {
            self.said.push(text);
        }
    }
}
