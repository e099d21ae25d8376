//! Messages in a stream of packets that comes in pieces of any size.
//!
//! ```text
//! packet        i32 size with these four bytes, u8 type, content
//! robot message u64 time, i8 source, u8 kind, content
//! ```
//!
//! All numbers are big-endian; a text without a length goes to the end of its packet.

use std::fmt::{Display, Formatter};

/// Title of the key message of a program that has started; its text is the name of the program.
pub const PROGRAM_STARTED: &str = "PROGRAM_XXX_STARTED";
/// Title of the key message of a program that has ended, in whatever way.
pub const PROGRAM_STOPPED: &str = "PROGRAM_XXX_STOPPED";
/// Largest packet that is read: the state of an arm has 1.4 kB, a list of global variables some ten.
pub const MAX_PACKET: usize = 64 << 10;
/// Size and type.
const HEADER: usize = 5;
/// Type of the packets that are read; others are skipped.
const ROBOT_MESSAGE: u8 = 20;
/// Time and source of a robot message, which are not used here.
const TIME_AND_SOURCE: usize = 9;

/// A robot message. Kinds that are not here are skipped.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum PrimaryMessage {
    /// The first message of a connection.
    Version {
        /// Name of the software, `URControl`.
        project: String,
        /// The first number (5 for e-Series, 3 for CB3), the second and the third.
        version: (u8, u8, i32),
    },
    /// An entry of the controller's log, shown as `C153A3`.
    ErrorCode {
        /// The number behind the C.
        code: i32,
        /// The number behind the A.
        argument: i32,
        /// In words.
        text: String,
    },
    /// Something that has a title, such as the start of a program: [`PROGRAM_STARTED`].
    Key {
        /// What happened.
        title: String,
        /// With what.
        text: String,
    },
    /// The program is wrong, before it starts or where it runs.
    RuntimeException {
        /// Line of the program, from 1.
        line: u32,
        /// Column in that line.
        column: u32,
        /// What is wrong, such as `compile_error_name_not_found:txtmsg:`.
        text: String,
    },
}

impl Display for PrimaryMessage {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Version { project, version: (major, minor, bugfix) } => {
                write!(f, "{project} {major}.{minor}.{bugfix}")
            }
            Self::ErrorCode { code, argument, text } => write!(f, "C{code}A{argument} {text}"),
            Self::Key { title, text } => write!(f, "{title} {text}"),
            Self::RuntimeException { line, column, text } => {
                write!(f, "line {line}, column {column}: {text}")
            }
        }
    }
}

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
}

impl PrimaryStream {
    /// Takes in what came from the wire; [`next_message`](Self::next_message) reads it.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.taken);
        self.taken = 0;
        self.bytes.extend_from_slice(bytes);
    }

    /// The next message, if its packet is whole. After an error nothing else comes.
    ///
    /// # Errors
    ///
    /// A packet of an impossible size, or one that is too short for its kind.
    pub fn next_message(&mut self) -> Result<Option<PrimaryMessage>, PrimaryStreamError> {
        loop {
            let rest = &self.bytes[self.taken..];
            let Some(size) = rest.first_chunk().map(|b| i32::from_be_bytes(*b)) else { return Ok(None) };
            let bytes = usize::try_from(size).ok().filter(|size| (HEADER..=MAX_PACKET).contains(size));
            let bytes = bytes.ok_or(PrimaryStreamError::Size { size })?;
            let Some([_, _, _, _, kind, content @ ..]) = rest.get(..bytes) else { return Ok(None) };
            let message = if *kind == ROBOT_MESSAGE { read_message(content)? } else { None };
            self.taken += bytes;
            if message.is_some() {
                return Ok(message);
            }
        }
    }
}

fn read_message(content: &[u8]) -> Result<Option<PrimaryMessage>, PrimaryStreamError> {
    let mut head = Content::new("robot message", content);
    head.take::<TIME_AND_SOURCE>()?;
    let [kind] = head.take()?;
    let of = |what| Content::new(what, head.rest);
    Ok(match kind {
        3 => {
            let mut from = of("version message");
            let project = from.short_text()?;
            let ([major], [minor], bugfix) = (from.take()?, from.take()?, i32::from_be_bytes(from.take()?));
            Some(PrimaryMessage::Version { project, version: (major, minor, bugfix) })
        }
        6 => {
            let mut from = of("error code message");
            let (code, argument) = (i32::from_be_bytes(from.take()?), i32::from_be_bytes(from.take()?));
            // The level, and a number with its type.
            from.take::<12>()?;
            Some(PrimaryMessage::ErrorCode { code, argument, text: text_of(from.rest) })
        }
        7 => {
            let mut from = of("key message");
            // A code and its argument.
            from.take::<8>()?;
            Some(PrimaryMessage::Key { title: from.short_text()?, text: text_of(from.rest) })
        }
        10 => {
            let mut from = of("runtime exception");
            let (line, column) = (u32::from_be_bytes(from.take()?), u32::from_be_bytes(from.take()?));
            Some(PrimaryMessage::RuntimeException { line, column, text: text_of(from.rest) })
        }
        _ => None,
    })
}

/// A content and how much of it is left to read.
struct Content<'a> {
    what: &'static str,
    bytes: usize,
    rest: &'a [u8],
}

impl<'a> Content<'a> {
    fn new(what: &'static str, rest: &'a [u8]) -> Self {
        Self { what, bytes: rest.len(), rest }
    }

    fn short(&self, more: usize) -> PrimaryStreamError {
        let wanted = self.bytes - self.rest.len() + more;
        PrimaryStreamError::Short { what: self.what, found: self.bytes, wanted }
    }

    fn take<const N: usize>(&mut self) -> Result<[u8; N], PrimaryStreamError> {
        let (taken, rest) = self.rest.split_first_chunk().ok_or_else(|| self.short(N))?;
        self.rest = rest;
        Ok(*taken)
    }

    /// A text behind its length of one byte.
    fn short_text(&mut self) -> Result<String, PrimaryStreamError> {
        let [length] = self.take()?;
        let length = usize::from(length);
        let (text, rest) = self.rest.split_at_checked(length).ok_or_else(|| self.short(length))?;
        self.rest = rest;
        Ok(text_of(text))
    }
}

/// Some controllers end texts with a zero.
fn text_of(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).trim_end_matches('\0').to_string()
}
