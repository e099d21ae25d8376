//! What is before the content of every record of an MCAP file (specification, "Records").

/// One byte for the kind, eight for the length.
pub(crate) const FRAME: u64 = 9;

/// Kind and length of a record, from its first [`FRAME`] bytes.
pub(crate) fn framed(frame: &[u8]) -> (u8, u64) {
    let mut length = [0; 8];
    length.copy_from_slice(&frame[1..9]);
    (frame[0], u64::from_le_bytes(length))
}
