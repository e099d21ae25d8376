//! Packets as bytes, for a server. A text that is longer than its place is cut at the end of a character.

use super::message::{
    ErrorCodeMessage, KeyMessage, MessageHeader, RobotModeData, RuntimeException, SafetyModeMessage,
    VersionMessage,
};
use super::packet::{HEADER, MAX_PACKET, ROBOT_MODE_DATA, message_kind, packet_type};

/// Longest text at the end of a packet: what is before it always fits into the rest.
const MAX_TEXT: usize = MAX_PACKET - 512;

/// Words.
pub fn encode_text_message(header: MessageHeader, text: &str) -> Vec<u8> {
    message(header, message_kind::TEXT, cut(text, MAX_TEXT).as_bytes())
}

/// The first message of a connection.
pub fn encode_version_message(header: MessageHeader, version: &VersionMessage) -> Vec<u8> {
    let mut content = short_text(&version.project, 127);
    content.extend([version.major, version.minor]);
    content.extend(version.bugfix.to_be_bytes());
    content.extend(version.build.to_be_bytes());
    content.extend(cut(&version.date, MAX_TEXT).bytes());
    message(header, message_kind::VERSION, &content)
}

/// The safety system has changed its mode.
pub fn encode_safety_mode_message(header: MessageHeader, safety: &SafetyModeMessage) -> Vec<u8> {
    let mut content = numbers(&[safety.code, safety.argument]);
    content.push(safety.mode);
    content.extend(safety.data_type.to_be_bytes());
    content.extend(safety.data.to_be_bytes());
    message(header, message_kind::SAFETY_MODE, &content)
}

/// An entry of the controller's log.
pub fn encode_error_code_message(header: MessageHeader, error: &ErrorCodeMessage) -> Vec<u8> {
    let mut content = numbers(&[error.code, error.argument, error.level]);
    content.extend(error.data_type.to_be_bytes());
    content.extend(error.data.to_be_bytes());
    content.extend(cut(&error.text, MAX_TEXT).bytes());
    message(header, message_kind::ERROR_CODE, &content)
}

/// Something that has a title.
pub fn encode_key_message(header: MessageHeader, key: &KeyMessage) -> Vec<u8> {
    let mut content = numbers(&[key.code, key.argument]);
    content.extend(short_text(&key.title, 255));
    content.extend(cut(&key.text, MAX_TEXT).bytes());
    message(header, message_kind::KEY, &content)
}

/// The program is wrong.
pub fn encode_runtime_exception_message(header: MessageHeader, exception: &RuntimeException) -> Vec<u8> {
    let mut content = Vec::new();
    content.extend(exception.line.to_be_bytes());
    content.extend(exception.column.to_be_bytes());
    content.extend(cut(&exception.text, MAX_TEXT).bytes());
    message(header, message_kind::RUNTIME_EXCEPTION, &content)
}

/// A robot state that has the mode and nothing else; the byte at its end is reserved.
pub fn encode_robot_mode_data(mode: &RobotModeData) -> Vec<u8> {
    let mut content = mode.device_ticks.to_be_bytes().to_vec();
    let flags = [
        mode.real_robot_connected,
        mode.real_robot_enabled,
        mode.power_on,
        mode.emergency_stopped,
        mode.protective_stopped,
        mode.program_running,
        mode.program_paused,
    ];
    content.extend(flags.map(u8::from));
    content.extend(mode.mode_number.to_be_bytes());
    content.push(mode.control_mode);
    for fraction in [mode.target_speed_fraction, mode.speed_scaling, mode.target_speed_fraction_limit] {
        content.extend(fraction.to_be_bytes());
    }
    content.push(0);
    packet(packet_type::ROBOT_STATE, &packet(ROBOT_MODE_DATA, &content))
}

fn message(header: MessageHeader, kind: u8, content: &[u8]) -> Vec<u8> {
    let mut bytes = header.device_ticks.to_be_bytes().to_vec();
    bytes.extend(header.source.to_be_bytes());
    bytes.push(kind);
    bytes.extend(content);
    packet(packet_type::ROBOT_MESSAGE, &bytes)
}

/// Packets and sub-packets begin alike. No content is longer than [`MAX_PACKET`].
fn packet(kind: u8, content: &[u8]) -> Vec<u8> {
    let size = (HEADER + content.len()) as u32;
    let mut bytes = size.to_be_bytes().to_vec();
    bytes.push(kind);
    bytes.extend(content);
    bytes
}

fn numbers(numbers: &[i32]) -> Vec<u8> {
    numbers.iter().flat_map(|n| n.to_be_bytes()).collect()
}

/// A text behind its length of one byte.
fn short_text(text: &str, most: usize) -> Vec<u8> {
    let text = cut(text, most);
    let mut bytes = vec![text.len() as u8];
    bytes.extend(text.bytes());
    bytes
}

fn cut(text: &str, most: usize) -> &str {
    &text[..text.floor_char_boundary(most)]
}
