//! Packets in a stream that comes in pieces of any size.
//!
//! ```text
//! packet        i32 size with these four bytes, u8 type, content
//! robot message u64 time, i8 source, u8 kind, content
//! robot state   sub-packets: u32 size with these four bytes, u8 type, content
//! ```
//!
//! All numbers are big-endian; a text without a length goes to the end of its packet.

use super::message::{
    ErrorCodeMessage, KeyMessage, MessageHeader, PrimaryEvent, RobotMessage, RobotModeData, RuntimeException,
    SafetyModeMessage, VersionMessage,
};

/// Largest packet that is read: the state of an arm has 1.4 kB, a list of global variables some ten.
pub const MAX_PACKET: usize = 64 << 10;
/// Size and type.
pub(super) const HEADER: usize = 5;

/// Types of packets that are read; others are skipped.
pub(super) mod packet_type {
    pub const ROBOT_STATE: u8 = 16;
    pub const ROBOT_MESSAGE: u8 = 20;
}

/// Kinds of robot messages that are read; others are skipped.
pub(super) mod message_kind {
    pub const TEXT: u8 = 0;
    pub const VERSION: u8 = 3;
    pub const SAFETY_MODE: u8 = 5;
    pub const ERROR_CODE: u8 = 6;
    pub const KEY: u8 = 7;
    pub const RUNTIME_EXCEPTION: u8 = 10;
}

/// Type of the one sub-packet that is read.
pub(super) const ROBOT_MODE_DATA: u8 = 0;

/// Bytes that are no packet. The stream cannot be read on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum PrimaryStreamError {
    /// A size that no packet has.
    #[error("a packet says that it has {size} bytes, packets have {HEADER} to {MAX_PACKET}")]
    Size {
        /// What it says.
        size: i32,
    },
    /// A sub-packet beyond its packet.
    #[error(
        "a sub-packet says that it has {size} bytes, it has at least {HEADER} and its packet has {rest} left"
    )]
    SubPacket {
        /// What it says.
        size: u32,
        /// Bytes of the packet from here on.
        rest: usize,
    },
    /// A packet too short for what it should hold.
    #[error("a {what} of {found} bytes is too short, {wanted} are needed")]
    Short {
        /// What it should hold.
        what: &'static str,
        /// Bytes of its content.
        found: usize,
        /// Bytes that are needed at least.
        wanted: usize,
    },
}

/// A stream under way. Holds what was pushed and not yet read.
#[derive(Debug, Clone, Default)]
pub struct PrimaryStream {
    bytes: Vec<u8>,
    taken: usize,
    skipped: u64,
}

impl PrimaryStream {
    /// Takes in what came from the wire; [`next_event`](Self::next_event) reads it.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.taken);
        self.taken = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// The next event, if its packet is whole. After an error nothing else comes.
    ///
    /// # Errors
    ///
    /// A packet of an impossible size, or one that is too short for its kind.
    pub fn next_event(&mut self) -> Result<Option<PrimaryEvent>, PrimaryStreamError> {
        loop {
            let rest = &self.bytes[self.taken..];
            let Some(size) = rest.first_chunk().map(|b| i32::from_be_bytes(*b)) else { return Ok(None) };
            let bytes = usize::try_from(size).ok().filter(|size| (HEADER..=MAX_PACKET).contains(size));
            let bytes = bytes.ok_or(PrimaryStreamError::Size { size })?;
            let Some([_, _, _, _, kind, content @ ..]) = rest.get(..bytes) else { return Ok(None) };
            let event = match *kind {
                packet_type::ROBOT_MESSAGE => read_message(content)?,
                packet_type::ROBOT_STATE => read_state(content)?,
                _ => None,
            };
            self.taken += bytes;
            if event.is_some() {
                return Ok(event);
            }
            self.skipped += 1;
        }
    }

    /// Packets that nothing was read from: of other types, of other kinds of messages, states without a mode.
    pub fn skipped(&self) -> u64 {
        self.skipped
    }
}

/// A content and how much of it is read.
struct Content<'a> {
    what: &'static str,
    whole: &'a [u8],
    rest: &'a [u8],
}

impl<'a> Content<'a> {
    fn new(what: &'static str, whole: &'a [u8]) -> Self {
        Self { what, whole, rest: whole }
    }

    fn short(&self, bytes: usize) -> PrimaryStreamError {
        let (what, found) = (self.what, self.whole.len());
        PrimaryStreamError::Short { what, found, wanted: found - self.rest.len() + bytes }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], PrimaryStreamError> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or_else(|| self.short(N))?;
        self.rest = rest;
        Ok(*taken)
    }

    fn byte(&mut self) -> Result<u8, PrimaryStreamError> {
        self.take().map(u8::from_be_bytes)
    }

    fn signed(&mut self) -> Result<i32, PrimaryStreamError> {
        self.take().map(i32::from_be_bytes)
    }

    fn unsigned(&mut self) -> Result<u32, PrimaryStreamError> {
        self.take().map(u32::from_be_bytes)
    }

    fn double(&mut self) -> Result<f64, PrimaryStreamError> {
        self.take().map(f64::from_be_bytes)
    }

    /// A text behind its length of one byte.
    fn text(&mut self) -> Result<String, PrimaryStreamError> {
        let length = usize::from(self.byte()?);
        let (text, rest) = self.rest.split_at_checked(length).ok_or_else(|| self.short(length))?;
        self.rest = rest;
        Ok(text_of(text))
    }

    /// The text to the end.
    fn text_to_the_end(&mut self) -> String {
        text_of(std::mem::take(&mut self.rest))
    }
}

/// Some controllers end texts with a zero.
fn text_of(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string()
}

fn read_message(content: &[u8]) -> Result<Option<PrimaryEvent>, PrimaryStreamError> {
    let mut head = Content::new("robot message", content);
    let device_ticks = head.take().map(u64::from_be_bytes)?;
    let source = head.take().map(i8::from_be_bytes)?;
    let kind = head.byte()?;
    let header = MessageHeader { device_ticks, source };
    let content = |what| Content::new(what, head.rest);
    let message = match kind {
        message_kind::TEXT => RobotMessage::Text(content("text message").text_to_the_end()),
        message_kind::VERSION => RobotMessage::Version(version(content("version message"))?),
        message_kind::SAFETY_MODE => RobotMessage::SafetyMode(safety_mode(content("safety mode message"))?),
        message_kind::ERROR_CODE => RobotMessage::ErrorCode(error_code(content("error code message"))?),
        message_kind::KEY => RobotMessage::Key(key(content("key message"))?),
        message_kind::RUNTIME_EXCEPTION => {
            RobotMessage::RuntimeException(runtime_exception(content("runtime exception"))?)
        }
        _ => return Ok(None),
    };
    Ok(Some(PrimaryEvent::Message { header, message }))
}

fn version(mut from: Content) -> Result<VersionMessage, PrimaryStreamError> {
    Ok(VersionMessage {
        project: from.text()?,
        major: from.byte()?,
        minor: from.byte()?,
        bugfix: from.signed()?,
        build: from.signed()?,
        date: from.text_to_the_end(),
    })
}

fn safety_mode(mut from: Content) -> Result<SafetyModeMessage, PrimaryStreamError> {
    Ok(SafetyModeMessage {
        code: from.signed()?,
        argument: from.signed()?,
        mode: from.byte()?,
        data_type: from.unsigned()?,
        data: from.unsigned()?,
    })
}

fn error_code(mut from: Content) -> Result<ErrorCodeMessage, PrimaryStreamError> {
    Ok(ErrorCodeMessage {
        code: from.signed()?,
        argument: from.signed()?,
        level: from.signed()?,
        data_type: from.unsigned()?,
        data: from.unsigned()?,
        text: from.text_to_the_end(),
    })
}

fn key(mut from: Content) -> Result<KeyMessage, PrimaryStreamError> {
    Ok(KeyMessage {
        code: from.signed()?,
        argument: from.signed()?,
        title: from.text()?,
        text: from.text_to_the_end(),
    })
}

fn runtime_exception(mut from: Content) -> Result<RuntimeException, PrimaryStreamError> {
    Ok(RuntimeException { line: from.unsigned()?, column: from.unsigned()?, text: from.text_to_the_end() })
}

/// Looks for the mode among the sub-packets.
fn read_state(content: &[u8]) -> Result<Option<PrimaryEvent>, PrimaryStreamError> {
    let mut rest = content;
    let mut mode = None;
    while !rest.is_empty() {
        let size = Content::new("robot state", rest).unsigned()?;
        let wrong = PrimaryStreamError::SubPacket { size, rest: rest.len() };
        let bytes = usize::try_from(size).unwrap_or(usize::MAX);
        let (packet, behind) = rest.split_at_checked(bytes).ok_or(wrong)?;
        let [_, _, _, _, kind, content @ ..] = packet else { return Err(wrong) };
        if *kind == ROBOT_MODE_DATA {
            mode = Some(PrimaryEvent::RobotMode(robot_mode(Content::new("robot mode", content))?));
        }
        rest = behind;
    }
    Ok(mode)
}

fn robot_mode(mut from: Content) -> Result<RobotModeData, PrimaryStreamError> {
    Ok(RobotModeData {
        device_ticks: from.take().map(u64::from_be_bytes)?,
        real_robot_connected: from.byte()? != 0,
        real_robot_enabled: from.byte()? != 0,
        power_on: from.byte()? != 0,
        emergency_stopped: from.byte()? != 0,
        protective_stopped: from.byte()? != 0,
        program_running: from.byte()? != 0,
        program_paused: from.byte()? != 0,
        mode_number: from.take().map(i8::from_be_bytes)?,
        control_mode: from.byte()?,
        target_speed_fraction: from.double()?,
        speed_scaling: from.double()?,
        target_speed_fraction_limit: from.double()?,
    })
}
