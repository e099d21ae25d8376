//! Fields that are known by name, and their types. A controller says the types itself; these are for those who have to say
//! them.
//!
//! Source: Universal Robots, "Real-Time Data Exchange (RTDE) Guide", and the type table of the Universal Robots Client Library.

use gripgen_rig::rtde::{FieldType, Value};

/// Type of an output field; `None` if it is not known. A controller lets clients read the input registers, too.
pub fn output_type(name: &str) -> Option<FieldType> {
    if let Some((_, register)) = output_register(name) {
        return Some(register.field_type());
    }
    Some(match name {
        "timestamp"
        | "actual_execution_time"
        | "target_execution_time"
        | "speed_scaling"
        | "target_speed_fraction"
        | "tcp_force_scalar"
        | "payload"
        | "actual_momentum"
        | "actual_main_voltage"
        | "actual_robot_voltage"
        | "actual_robot_current"
        | "actual_robot_energy_consumed"
        | "actual_robot_braking_energy_dissipated"
        | "standard_analog_input0"
        | "standard_analog_input1"
        | "standard_analog_output0"
        | "standard_analog_output1"
        | "io_current"
        | "euromap67_24V_voltage"
        | "euromap67_24V_current"
        | "tool_analog_input0"
        | "tool_analog_input1"
        | "tool_output_current"
        | "tool_temperature" => FieldType::Double,
        "target_q"
        | "target_qd"
        | "target_qdd"
        | "target_current"
        | "target_moment"
        | "actual_q"
        | "actual_qd"
        | "actual_qdd"
        | "actual_current"
        | "actual_current_window"
        | "actual_current_as_torque"
        | "actual_moment"
        | "actual_joint_voltage"
        | "joint_control_output"
        | "joint_temperatures"
        | "actual_TCP_pose"
        | "actual_TCP_speed"
        | "actual_TCP_acceleration"
        | "actual_TCP_force"
        | "target_TCP_pose"
        | "target_TCP_speed"
        | "target_TCP_acceleration"
        | "tcp_offset"
        | "ft_raw_wrench"
        | "payload_inertia" => FieldType::Vector6d,
        "actual_tool_accelerometer" | "elbow_position" | "elbow_velocity" | "payload_cog" => {
            FieldType::Vector3d
        }
        "joint_mode" => FieldType::Vector6int32,
        "robot_mode"
        | "safety_mode"
        | "safety_status"
        | "encoder0_raw"
        | "encoder1_raw"
        | "tool_output_voltage" => FieldType::Int32,
        "runtime_state"
        | "robot_status_bits"
        | "safety_status_bits"
        | "analog_io_types"
        | "euromap67_input_bits"
        | "euromap67_output_bits"
        | "tool_mode"
        | "tool_analog_input_types"
        | "script_control_line" => FieldType::Uint32,
        "actual_digital_input_bits"
        | "actual_digital_output_bits"
        | "actual_configurable_digital_input_bits"
        | "actual_configurable_digital_output_bits" => FieldType::Uint64,
        "tool_output_mode" | "tool_digital_output0_mode" | "tool_digital_output1_mode" => FieldType::Uint8,
        _ => return None,
    })
}

/// Type of an input field; `None` if it is not known.
pub fn input_type(name: &str) -> Option<FieldType> {
    if let Some(register) = input_register(name) {
        return Some(register.field_type());
    }
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
        _ => return None,
    })
}

/// Where a register is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Register {
    /// An integer, 0 to 47.
    Int(usize),
    /// A number, 0 to 47.
    Double(usize),
    /// A bit, 64 to 127.
    Bit(usize),
    /// 32 bits from this one on.
    Word(usize),
}

/// Who writes a register.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Writer {
    /// Clients.
    Client,
    /// Programs on the robot.
    Program,
}

/// A register among the outputs: those of both directions are.
pub fn output_register(name: &str) -> Option<(Writer, Register)> {
    match name.strip_prefix("output_") {
        Some(rest) => Some((Writer::Program, Register::of(rest)?)),
        None => Some((Writer::Client, input_register(name)?)),
    }
}

/// A register among the inputs.
pub fn input_register(name: &str) -> Option<Register> {
    name.strip_prefix("input_").and_then(Register::of)
}

impl Register {
    fn of(name: &str) -> Option<Self> {
        let index = |prefix: &str, range: std::ops::Range<usize>| {
            let digits = name.strip_prefix(prefix)?;
            digits.parse::<usize>().ok().filter(|i| range.contains(i))
        };
        match name {
            "bit_registers0_to_31" => Some(Self::Word(0)),
            "bit_registers32_to_63" => Some(Self::Word(32)),
            _ => index("int_register_", 0..48)
                .map(Self::Int)
                .or_else(|| index("double_register_", 0..48).map(Self::Double))
                .or_else(|| index("bit_register_", 64..128).map(Self::Bit)),
        }
    }

    fn field_type(self) -> FieldType {
        match self {
            Self::Int(_) => FieldType::Int32,
            Self::Double(_) => FieldType::Double,
            Self::Bit(_) => FieldType::Bool,
            Self::Word(_) => FieldType::Uint32,
        }
    }
}

/// These numbers as a value of this type. Places without a number are 0; a number that an integer cannot be is the nearest
/// that it can.
pub fn value_of(kind: FieldType, numbers: &[f64]) -> Value {
    let at = |i: usize| numbers.get(i).copied().unwrap_or(0.0);
    match kind {
        FieldType::Bool => Value::Bool(at(0) != 0.0),
        FieldType::Uint8 => Value::Uint8(at(0) as u8),
        FieldType::Uint32 => Value::Uint32(at(0) as u32),
        FieldType::Uint64 => Value::Uint64(at(0) as u64),
        FieldType::Int32 => Value::Int32(at(0) as i32),
        FieldType::Double => Value::Double(at(0)),
        FieldType::Vector3d => Value::Vector3d(std::array::from_fn(at)),
        FieldType::Vector6d => Value::Vector6d(std::array::from_fn(at)),
        FieldType::Vector6int32 => Value::Vector6int32(std::array::from_fn(|i| at(i) as i32)),
        FieldType::Vector6uint32 => Value::Vector6uint32(std::array::from_fn(|i| at(i) as u32)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_fields_have_their_types() {
        for (name, kind) in [
            ("timestamp", FieldType::Double),
            ("actual_TCP_force", FieldType::Vector6d),
            ("tcp_offset", FieldType::Vector6d),
            ("elbow_position", FieldType::Vector3d),
            ("joint_mode", FieldType::Vector6int32),
            ("safety_status", FieldType::Int32),
            ("tool_mode", FieldType::Uint32),
            ("tool_output_voltage", FieldType::Int32),
            ("tool_output_mode", FieldType::Uint8),
            ("tool_temperature", FieldType::Double),
            ("analog_io_types", FieldType::Uint32),
            ("actual_configurable_digital_input_bits", FieldType::Uint64),
            ("output_int_register_47", FieldType::Int32),
            ("output_bit_register_64", FieldType::Bool),
            ("output_bit_registers0_to_31", FieldType::Uint32),
            ("input_double_register_0", FieldType::Double),
        ] {
            assert_eq!(output_type(name), Some(kind), "{name}");
        }
        for (name, kind) in [
            ("speed_slider_mask", FieldType::Uint32),
            ("standard_digital_output", FieldType::Uint8),
            ("external_force_torque", FieldType::Vector6d),
            ("input_int_register_24", FieldType::Int32),
        ] {
            assert_eq!(input_type(name), Some(kind), "{name}");
        }
        for unknown in ["", "output_", "output_int_register_48", "output_bit_register_63", "Timestamp"] {
            assert_eq!((output_type(unknown), input_type(unknown)), (None, None), "{unknown}");
        }
        assert_eq!(input_type("output_int_register_24"), None);
    }
}
