//! The primary interface of Universal Robots controllers (TCP port 30001): messages of the controller and of the program, the
//! robot's mode ten times per second, and the way in for programs as text.
//!
//! A controller acknowledges no program on this connection. That one has started is a key message ([`PROGRAM_STARTED`]), that it
//! is wrong a runtime exception with line and column.
//!
//! The layouts are published in Universal Robots' "Client Interface" documents for e-Series. Here they are taken from the packets
//! that the Universal Robots Client Library reads and from the byte sequences in its unit tests; a genuine controller was not
//! read yet.

mod encode;
mod message;
mod packet;
mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
mod tests;

pub use encode::{
    encode_error_code_message, encode_key_message, encode_robot_mode_data, encode_runtime_exception_message,
    encode_safety_mode_message, encode_text_message, encode_version_message,
};
pub use message::{
    ErrorCodeMessage, KeyMessage, MessageHeader, PROGRAM_STARTED, PROGRAM_STOPPED, PrimaryEvent,
    RobotMessage, RobotModeData, RuntimeException, SafetyModeMessage, VersionMessage,
};
pub use packet::{MAX_PACKET, PrimaryStream, PrimaryStreamError};
pub use socket::{PrimaryClient, PrimaryLinkError, ScriptError};
