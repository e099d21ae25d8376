//! What the virtual robot is at a moment, and what of it can be read and written by name.

use super::kinematics::Joints;
use crate::fields::{Register, Writer, input_register, output_register, output_type, value_of};
use gripgen_rig::program::TcpPose;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};
use gripgen_rig::rtde::Value;

/// Registers of one direction.
#[derive(Debug, Clone, PartialEq)]
pub struct Registers {
    /// `int_register_0` to `_47`.
    pub int: [i32; 48],
    /// `double_register_0` to `_47`.
    pub double: [f64; 48],
    /// Bits 0 to 127.
    pub bits: u128,
}

impl Default for Registers {
    fn default() -> Self {
        Self { int: [0; 48], double: [0.0; 48], bits: 0 }
    }
}

impl Registers {
    /// What is in a register; all of them are exact as a number.
    fn number(&self, register: Register) -> f64 {
        match register {
            Register::Int(i) => self.int[i].into(),
            Register::Double(i) => self.double[i],
            Register::Bit(i) => f64::from(self.bits >> i & 1 == 1),
            Register::Word(shift) => f64::from((self.bits >> shift) as u32),
        }
    }
}

/// What a program is doing, as `runtime_state`.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RuntimeState {
    /// It is being stopped.
    Stopping = 0,
    /// There is none.
    Stopped = 1,
    /// It runs.
    Playing = 2,
    /// It is halted and could go on.
    Paused = 4,
}

/// The robot at a moment.
#[derive(Debug, Clone, PartialEq)]
pub struct Robot {
    /// Time since the controller started.
    pub timestamp_s: f64,
    /// Power and brakes.
    pub mode: RobotMode,
    /// Safety.
    pub safety: SafetyStatus,
    /// The program.
    pub runtime: RuntimeState,
    /// Where the tool is.
    pub tcp: TcpPose,
    /// How fast it moves.
    pub velocity_m_s: [f64; 3],
    /// Its joints, from the base to the flange.
    pub joints_rad: Joints,
    /// How fast they turn.
    pub joint_speeds_rad_s: Joints,
    /// Load on the tool in the base frame, zeroed: force in N, torque in Nm.
    pub wrench: [f64; 6],
    /// The same before zeroing.
    pub raw_wrench: [f64; 6],
    /// The speed slider, 1 for 100 %.
    pub speed_slider: f64,
    /// Weight that the controller takes off, in kg.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange, in m.
    pub centre_of_gravity_m: [f64; 3],
    /// Grip centre at the flange that the controller counts with, in m.
    pub tool_m: [f64; 3],
    /// What clients wrote.
    pub inputs: Registers,
    /// What programs wrote.
    pub outputs: Registers,
}

/// What joints, tool and boards of a robot at rest show, where a client wants to see something.
const PART_TEMPERATURE_C: f64 = 30.0;
const MAIN_VOLTAGE_V: f64 = 48.0;
const PART_RUNNING: f64 = 253.0;

impl Robot {
    /// `robot_status_bits`: power on, program running.
    pub fn status_bits(&self) -> u32 {
        let on = matches!(self.mode, RobotMode::Idle | RobotMode::Running);
        u32::from(on) | u32::from(self.runtime == RuntimeState::Playing) << 1
    }

    /// `safety_status_bits`.
    pub fn safety_bits(&self) -> u32 {
        match self.safety {
            SafetyStatus::Normal => 1,
            SafetyStatus::Reduced => 1 << 1,
            SafetyStatus::ProtectiveStop => 1 << 2 | 1 << 10,
            SafetyStatus::RobotEmergencyStop => 1 << 6 | 1 << 7 | 1 << 10,
            _ => 1 << 10,
        }
    }

    /// Value of an output field; `None` if there is no such field. A part that this robot has and nothing here uses is at rest:
    /// UR's client library asks for them all in one recipe, and one that is missing spoils it.
    pub fn output(&self, name: &str) -> Option<Value> {
        let kind = output_type(name)?;
        let value = |numbers: &[f64]| value_of(kind, numbers);
        let [vx, vy, vz] = self.velocity_m_s;
        if let Some((writer, register)) = output_register(name) {
            let registers = match writer {
                Writer::Client => &self.inputs,
                Writer::Program => &self.outputs,
            };
            return Some(value(&[registers.number(register)]));
        }
        Some(match name {
            "timestamp" => value(&[self.timestamp_s]),
            "actual_q" | "target_q" => value(&self.joints_rad),
            "actual_qd" | "target_qd" => value(&self.joint_speeds_rad_s),
            "joint_temperatures" => value(&[PART_TEMPERATURE_C; 6]),
            "tool_temperature" => value(&[PART_TEMPERATURE_C]),
            "actual_joint_voltage" => value(&[MAIN_VOLTAGE_V; 6]),
            "actual_main_voltage" | "actual_robot_voltage" => value(&[MAIN_VOLTAGE_V]),
            "joint_mode" => value(&[PART_RUNNING; 6]),
            "tool_mode" => value(&[PART_RUNNING]),
            "actual_TCP_pose" | "target_TCP_pose" => value(&self.tcp.numbers()),
            "tcp_offset" => value(&self.tool_m),
            "actual_TCP_speed" | "target_TCP_speed" => value(&[vx, vy, vz]),
            "actual_TCP_force" => value(&self.wrench),
            "ft_raw_wrench" => value(&self.raw_wrench),
            "tcp_force_scalar" => value(&[self.wrench[..3].iter().map(|f| f * f).sum::<f64>().sqrt()]),
            "actual_tool_accelerometer" => value(&[0.0, 0.0, -9.81]),
            "robot_mode" => value(&[self.mode.number().into()]),
            "safety_mode" | "safety_status" => value(&[self.safety.number().into()]),
            "robot_status_bits" => value(&[self.status_bits().into()]),
            "safety_status_bits" => value(&[self.safety_bits().into()]),
            "runtime_state" => value(&[f64::from(self.runtime as u8)]),
            "speed_scaling" => value(&[1.0]),
            "target_speed_fraction" => value(&[self.speed_slider]),
            "payload" => value(&[self.payload_kg]),
            "payload_cog" => value(&self.centre_of_gravity_m),
            _ => value(&[]),
        })
    }

    /// Writes an input field that [`input_type`](crate::fields::input_type) knows. Inputs that do nothing here are taken and forgotten, as a controller
    /// takes them.
    pub fn write_input(&mut self, name: &str, value: Value) {
        let registers = &mut self.inputs;
        match (input_register(name), value) {
            (Some(Register::Int(i)), Value::Int32(x)) => registers.int[i] = x,
            (Some(Register::Double(i)), Value::Double(x)) => registers.double[i] = x,
            (Some(Register::Bit(i)), Value::Bool(x)) => {
                registers.bits = registers.bits & !(1 << i) | u128::from(x) << i;
            }
            (Some(Register::Word(shift)), Value::Uint32(x)) => {
                registers.bits = registers.bits & !(0xffff_ffff << shift) | u128::from(x) << shift;
            }
            _ => {}
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fields::input_type;
    use gripgen_rig::program::TcpPose;

    /// UR's client library lists the input registers among the outputs of a controller.
    #[test]
    fn what_was_written_can_be_read() {
        let tcp = TcpPose { position_m: [0.0; 3], rotation_rad: [0.0; 3] };
        let mut robot = Robot {
            timestamp_s: 61.5,
            mode: RobotMode::Running,
            safety: SafetyStatus::Normal,
            runtime: RuntimeState::Stopped,
            tcp,
            velocity_m_s: [0.0; 3],
            joints_rad: [0.0, -1.5, 1.5, 0.0, 0.0, 0.1],
            joint_speeds_rad_s: [0.0; 6],
            wrench: [0.0; 6],
            raw_wrench: [0.0; 6],
            speed_slider: 1.0,
            payload_kg: 0.0,
            centre_of_gravity_m: [0.0, 0.0, 0.04],
            tool_m: [0.0; 3],
            inputs: Registers::default(),
            outputs: Registers::default(),
        };
        for (name, value) in [
            ("timestamp", Value::Double(61.5)),
            ("robot_mode", Value::Int32(7)),
            ("runtime_state", Value::Uint32(1)),
            ("actual_q", Value::Vector6d([0.0, -1.5, 1.5, 0.0, 0.0, 0.1])),
            ("payload_cog", Value::Vector3d([0.0, 0.0, 0.04])),
            ("tool_mode", Value::Uint32(253)),
            // Of a part that nothing here uses.
            ("actual_digital_input_bits", Value::Uint64(0)),
        ] {
            assert_eq!(robot.output(name), Some(value), "{name}");
        }
        for (name, value) in [
            ("input_int_register_24", Value::Int32(i32::MIN)),
            ("input_double_register_47", Value::Double(2.5)),
            ("input_bit_register_64", Value::Bool(true)),
            ("input_bit_registers32_to_63", Value::Uint32(0xffff_ffff)),
        ] {
            assert_eq!(input_type(name), Some(value.field_type()));
            robot.write_input(name, value);
            assert_eq!(robot.output(name), Some(value));
            let answers = name.replace("input", "output");
            assert_ne!(robot.output(&answers), robot.output(name), "a register of its own");
        }
        for unknown in ["input_int_register_48", "input_", "int_register_0", "input_bit_register_63"] {
            assert_eq!(robot.output(unknown), None, "{unknown}");
        }
    }
}
