//! Frames of RTDE: a length of two bytes (itself included), a kind of one byte, a payload; everything big-endian.

/// Bytes of the header.
const HEADER: usize = 3;

/// What a frame is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// `V`: ask for a protocol version, and whether it was accepted.
    ProtocolVersion,
    /// `v`: version of the controller.
    ControllerVersion,
    /// `M`: a message for people, at any moment.
    Text,
    /// `U`: values of a recipe.
    Data,
    /// `O`: set up what the controller sends.
    SetUpOutputs,
    /// `I`: set up what the controller is sent.
    SetUpInputs,
    /// `S`: begin to send.
    Start,
    /// `P`: stop sending.
    Pause,
}

impl Kind {
    const ALL: [(Kind, u8); 8] = [
        (Kind::ProtocolVersion, b'V'),
        (Kind::ControllerVersion, b'v'),
        (Kind::Text, b'M'),
        (Kind::Data, b'U'),
        (Kind::SetUpOutputs, b'O'),
        (Kind::SetUpInputs, b'I'),
        (Kind::Start, b'S'),
        (Kind::Pause, b'P'),
    ];

    /// The byte on the wire.
    pub fn byte(self) -> u8 {
        Self::ALL.iter().find(|(kind, _)| *kind == self).map_or(0, |(_, byte)| *byte)
    }

    fn from_byte(byte: u8) -> Option<Self> {
        Self::ALL.iter().find(|(_, b)| *b == byte).map(|(kind, _)| *kind)
    }
}

/// A whole frame.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Frame {
    /// What it is.
    pub kind: Kind,
    /// Without the header; at most 65 532 bytes.
    pub payload: Vec<u8>,
}

/// Bytes that are no frame. The stream cannot be read on: nobody knows where the next frame begins.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// A length below that of a header.
    #[error("a frame says that it is {length} bytes long, its header alone is {HEADER}")]
    Length {
        /// What it says.
        length: usize,
    },
    /// An unknown kind.
    #[error("a frame of {length} bytes is of the unknown kind {kind}")]
    Kind {
        /// Its byte.
        kind: u8,
        /// Its length.
        length: usize,
    },
}

/// A payload beyond what a length of two bytes can say.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("a payload of {bytes} bytes does not fit into a frame, which holds at most {most}")]
pub struct FrameTooLongError {
    /// Its size.
    pub bytes: usize,
    /// What fits.
    pub most: usize,
}

/// A frame as bytes.
///
/// # Errors
///
/// A payload that is longer than a frame holds.
pub fn encode_frame(kind: Kind, payload: &[u8]) -> Result<Vec<u8>, FrameTooLongError> {
    let most = usize::from(u16::MAX) - HEADER;
    let length = u16::try_from(payload.len() + HEADER)
        .map_err(|_| FrameTooLongError { bytes: payload.len(), most })?;
    let mut bytes = Vec::with_capacity(payload.len() + HEADER);
    bytes.extend(length.to_be_bytes());
    bytes.push(kind.byte());
    bytes.extend(payload);
    Ok(bytes)
}

/// Finds frames in a stream that comes in pieces of any size. Holds what was pushed and not yet taken.
#[derive(Debug, Clone, Default)]
pub struct Framer {
    bytes: Vec<u8>,
    taken: usize,
}

impl Framer {
    /// Takes in what came from the wire.
    pub fn push(&mut self, bytes: &[u8]) {
        // What was taken is dropped once in a while, not frame by frame.
        if self.taken > 0 && (self.taken == self.bytes.len() || self.taken >= usize::from(u16::MAX)) {
            self.bytes.drain(..self.taken);
            self.taken = 0;
        }
        self.bytes.extend_from_slice(bytes);
    }

    /// The next whole frame, if it is there.
    ///
    /// # Errors
    ///
    /// A length below that of a header, or an unknown kind.
    pub fn next_frame(&mut self) -> Result<Option<Frame>, FrameError> {
        let rest = &self.bytes[self.taken..];
        let [high, low, kind, ..] = rest else { return Ok(None) };
        let length = usize::from(u16::from_be_bytes([*high, *low]));
        if length < HEADER {
            return Err(FrameError::Length { length });
        }
        let kind = Kind::from_byte(*kind).ok_or(FrameError::Kind { kind: *kind, length })?;
        let Some(payload) = rest.get(HEADER..length) else { return Ok(None) };
        let payload = payload.to_vec();
        self.taken += length;
        Ok(Some(Frame { kind, payload }))
    }
}
