//! Lines of a file as an editor counts them.

/// Counts the lines of a file; one ends at `\n`, `\r\n` or a `\r` alone.
pub(super) struct Lines<'a> {
    bytes: &'a [u8],
    /// Where the parser begins.
    begins: usize,
    counted: usize,
    line: u64,
}

impl<'a> Lines<'a> {
    pub(super) fn new(bytes: &'a [u8], begins: usize) -> Self {
        Self { bytes, begins, counted: 0, line: 1 }
    }

    /// The line of the row that begins at a byte. For the parser a row begins with what is left of the end of the line before it (the
    /// `\n` of `\r\n`), and with empty lines. Bytes are asked for in order.
    pub(super) fn at(&mut self, byte: usize) -> u64 {
        let mut to = byte.min(self.bytes.len());
        while matches!(self.bytes.get(to), Some(b'\r' | b'\n')) {
            to += 1;
        }
        while self.counted < to {
            let next = self.bytes.get(self.counted + 1);
            let ends = match self.bytes[self.counted] {
                b'\n' => true,
                b'\r' => next != Some(&b'\n'),
                _ => false,
            };
            self.line += u64::from(ends);
            self.counted += 1;
        }
        self.line
    }

    /// The same of a place of the parser.
    pub(super) fn of(&mut self, position: Option<&csv::Position>) -> u64 {
        let at = |p: &csv::Position| usize::try_from(p.byte()).unwrap_or(usize::MAX);
        position.map_or(0, |p| self.at(self.begins.saturating_add(at(p))))
    }
}
