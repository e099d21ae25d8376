//! What the virtual robot is at a moment, and what of it can be read and written by name.

use crate::program::TcpPose;
use crate::robot_state::{RobotMode, SafetyStatus};
use crate::rtde::{FieldType, Value};

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
    /// Load on the tool in the base frame, zeroed: force in N, torque in Nm.
    pub wrench: [f64; 6],
    /// The same before zeroing.
    pub raw_wrench: [f64; 6],
    /// Weight that the controller takes off, in kg.
    pub payload_kg: f64,
    /// Its centre of gravity at the flange, in m.
    pub centre_of_gravity_m: [f64; 3],
    /// What clients wrote.
    pub inputs: Registers,
    /// What programs wrote.
    pub outputs: Registers,
}

/// Joints of a UR5e with the tool down in front of it. They do not follow the tool: no client of this rig asks where they are.
const JOINTS_RAD: [f64; 6] = [0.0, -1.57, 1.57, -1.57, -1.57, 0.0];
/// What joints and boards of a robot at rest show, where a client wants to see something.
const JOINT_TEMPERATURE_C: f64 = 30.0;
const MAIN_VOLTAGE_V: f64 = 48.0;

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

    /// Value of an output field; `None` if there is no such field. The types are those of the RTDE guide.
    pub fn output(&self, name: &str) -> Option<Value> {
        use Value::{Double, Int32, Uint32, Uint64, Vector3d, Vector6d, Vector6int32};
        let [vx, vy, vz] = self.velocity_m_s;
        let speed = Vector6d([vx, vy, vz, 0.0, 0.0, 0.0]);
        let zero = Vector6d([0.0; 6]);
        Some(match name {
            "timestamp" => Double(self.timestamp_s),
            "actual_q" | "target_q" => Vector6d(JOINTS_RAD),
            "actual_qd"
            | "target_qd"
            | "target_qdd"
            | "actual_current"
            | "target_current"
            | "target_moment"
            | "actual_qdd"
            | "actual_moment"
            | "actual_current_as_torque"
            | "joint_control_output" => zero,
            "joint_temperatures" => Vector6d([JOINT_TEMPERATURE_C; 6]),
            "actual_joint_voltage" => Vector6d([MAIN_VOLTAGE_V; 6]),
            // 253: running.
            "joint_mode" => Vector6int32([253; 6]),
            "actual_TCP_pose" | "target_TCP_pose" => Vector6d(self.tcp.numbers()),
            "actual_TCP_speed" | "target_TCP_speed" => speed,
            "actual_TCP_force" => Vector6d(self.wrench),
            "ft_raw_wrench" => Vector6d(self.raw_wrench),
            "tcp_force_scalar" => Double(self.wrench[..3].iter().map(|f| f * f).sum::<f64>().sqrt()),
            "actual_tool_accelerometer" => Vector3d([0.0, 0.0, -9.81]),
            "actual_digital_input_bits" | "actual_digital_output_bits" => Uint64(0),
            "robot_mode" => Int32(self.mode.number()),
            "safety_mode" | "safety_status" => Int32(self.safety.number()),
            "robot_status_bits" => Uint32(self.status_bits()),
            "safety_status_bits" => Uint32(self.safety_bits()),
            "runtime_state" => Uint32(self.runtime as u32),
            "speed_scaling" | "target_speed_fraction" => Double(1.0),
            "actual_momentum" | "actual_execution_time" | "actual_robot_current" => Double(0.0),
            "actual_main_voltage" | "actual_robot_voltage" => Double(MAIN_VOLTAGE_V),
            "standard_analog_input0"
            | "standard_analog_input1"
            | "standard_analog_output0"
            | "standard_analog_output1" => Double(0.0),
            "payload" => Double(self.payload_kg),
            "payload_cog" => Vector3d(self.centre_of_gravity_m),
            "payload_inertia" => zero,
            // A controller lets clients read what others wrote, too.
            _ => {
                let written = name.strip_prefix("input_").and_then(|name| register(&self.inputs, name));
                let answered = || register(&self.outputs, name.strip_prefix("output_")?);
                return written.or_else(answered).or_else(|| idle_output(name));
            }
        })
    }

    /// Writes an input field that [`input_type`] knows. Inputs that do nothing here are taken and forgotten, as a controller
    /// takes them.
    pub fn write_input(&mut self, name: &str, value: Value) {
        let registers = &mut self.inputs;
        match (name.strip_prefix("input_").and_then(place), value) {
            (Some(Place::Int(i)), Value::Int32(x)) => registers.int[i] = x,
            (Some(Place::Double(i)), Value::Double(x)) => registers.double[i] = x,
            (Some(Place::Bit(i)), Value::Bool(x)) => {
                registers.bits = registers.bits & !(1 << i) | u128::from(x) << i;
            }
            (Some(Place::Word(shift)), Value::Uint32(x)) => {
                registers.bits = registers.bits & !(0xffff_ffff << shift) | u128::from(x) << shift;
            }
            _ => {}
        }
    }
}

/// Fields of parts that this robot has and nothing here uses. UR's client library asks for them all in one recipe, and one
/// that is missing spoils it.
fn idle_output(name: &str) -> Option<Value> {
    Some(match name {
        "tcp_offset" => Value::Vector6d([0.0; 6]),
        "elbow_position" | "elbow_velocity" => Value::Vector3d([0.0; 3]),
        "io_current"
        | "target_execution_time"
        | "tool_analog_input0"
        | "tool_analog_input1"
        | "tool_output_current"
        | "euromap67_24V_voltage"
        | "euromap67_24V_current" => Value::Double(0.0),
        "tool_temperature" => Value::Double(JOINT_TEMPERATURE_C),
        // 253: running.
        "tool_mode" => Value::Uint32(253),
        "analog_io_types"
        | "tool_analog_input_types"
        | "script_control_line"
        | "euromap67_input_bits"
        | "euromap67_output_bits" => Value::Uint32(0),
        "actual_configurable_digital_input_bits" | "actual_configurable_digital_output_bits" => {
            Value::Uint64(0)
        }
        "tool_output_voltage" => Value::Int32(0),
        "tool_output_mode" | "tool_digital_output0_mode" | "tool_digital_output1_mode" => Value::Uint8(0),
        _ => return None,
    })
}

/// Type of an input field; `None` if there is no such field.
pub fn input_type(name: &str) -> Option<FieldType> {
    Some(match name {
        "speed_slider_mask" => FieldType::Uint32,
        "speed_slider_fraction" | "standard_analog_output_0" | "standard_analog_output_1" => {
            FieldType::Double
        }
        "standard_digital_output_mask"
        | "standard_digital_output"
        | "configurable_digital_output_mask"
        | "configurable_digital_output"
        | "tool_digital_output_mask"
        | "tool_digital_output"
        | "standard_analog_output_mask"
        | "standard_analog_output_type" => FieldType::Uint8,
        "external_force_torque" => FieldType::Vector6d,
        _ => match place(name.strip_prefix("input_")?)? {
            Place::Int(_) => FieldType::Int32,
            Place::Double(_) => FieldType::Double,
            Place::Bit(_) => FieldType::Bool,
            Place::Word(_) => FieldType::Uint32,
        },
    })
}

/// Where a register is.
enum Place {
    Int(usize),
    Double(usize),
    Bit(usize),
    /// 32 bits from this one on.
    Word(usize),
}

fn place(name: &str) -> Option<Place> {
    let index = |prefix: &str, range: std::ops::Range<usize>| {
        let digits = name.strip_prefix(prefix)?;
        digits.parse::<usize>().ok().filter(|i| range.contains(i))
    };
    match name {
        "bit_registers0_to_31" => Some(Place::Word(0)),
        "bit_registers32_to_63" => Some(Place::Word(32)),
        _ => index("int_register_", 0..48)
            .map(Place::Int)
            .or_else(|| index("double_register_", 0..48).map(Place::Double))
            .or_else(|| index("bit_register_", 64..128).map(Place::Bit)),
    }
}

fn register(registers: &Registers, name: &str) -> Option<Value> {
    Some(match place(name)? {
        Place::Int(i) => Value::Int32(registers.int[i]),
        Place::Double(i) => Value::Double(registers.double[i]),
        Place::Bit(i) => Value::Bool(registers.bits >> i & 1 == 1),
        Place::Word(shift) => Value::Uint32((registers.bits >> shift) as u32),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::TcpPose;

    /// UR's client library lists the input registers among the outputs of a controller.
    #[test]
    fn what_was_written_can_be_read() {
        let tcp = TcpPose { position_m: [0.0; 3], rotation_rad: [0.0; 3] };
        let mut robot = Robot {
            timestamp_s: 0.0,
            mode: RobotMode::Running,
            safety: SafetyStatus::Normal,
            runtime: RuntimeState::Stopped,
            tcp,
            velocity_m_s: [0.0; 3],
            wrench: [0.0; 6],
            raw_wrench: [0.0; 6],
            payload_kg: 0.0,
            centre_of_gravity_m: [0.0; 3],
            inputs: Registers::default(),
            outputs: Registers::default(),
        };
        for (name, value) in [
            ("input_int_register_24", Value::Int32(-7)),
            ("input_double_register_47", Value::Double(2.5)),
            ("input_bit_register_64", Value::Bool(true)),
            ("input_bit_registers32_to_63", Value::Uint32(0x8000_0001)),
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

    /// Types as in the table of UR's client library.
    #[test]
    fn parts_that_nothing_here_uses_are_there_with_their_types() {
        for (name, kind) in [
            ("tcp_offset", FieldType::Vector6d),
            ("elbow_position", FieldType::Vector3d),
            ("tool_mode", FieldType::Uint32),
            ("tool_output_voltage", FieldType::Int32),
            ("tool_output_mode", FieldType::Uint8),
            ("tool_temperature", FieldType::Double),
            ("analog_io_types", FieldType::Uint32),
            ("actual_configurable_digital_input_bits", FieldType::Uint64),
        ] {
            assert_eq!(idle_output(name).map(|value| value.field_type()), Some(kind), "{name}");
        }
    }
}
