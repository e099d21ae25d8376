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
            _ => return register(&self.outputs, name.strip_prefix("output_")?),
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
