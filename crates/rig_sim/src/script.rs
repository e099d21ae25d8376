//! Programs as they come over a script port: lines, a program from `def` or `sec` to an `end` of its own, everything else a
//! program of one line.

/// Longest program that is taken in; the one that ur_rtde uploads is 42 kB.
const MAX_SCRIPT: usize = 1 << 20;

/// Finds programs in a stream.
#[derive(Debug, Clone, Default)]
pub struct ScriptReader {
    bytes: Vec<u8>,
}

/// More text than a program has.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("{bytes} bytes without the end of a program, at most {MAX_SCRIPT} are read")]
pub struct ScriptTooLongError {
    /// Bytes so far.
    pub bytes: usize,
}

impl ScriptReader {
    /// Takes in what came and gives the programs that are whole, each ending with a line end.
    ///
    /// # Errors
    ///
    /// A program that is too long.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<String>, ScriptTooLongError> {
        self.bytes.extend_from_slice(bytes);
        let mut programs = Vec::new();
        let mut start = 0;
        while let Some(length) = program_length(&self.bytes[start..]) {
            let text = String::from_utf8_lossy(&self.bytes[start..start + length]).into_owned();
            start += length;
            if !text.trim().is_empty() {
                programs.push(text);
            }
        }
        self.bytes.drain(..start);
        if self.bytes.len() > MAX_SCRIPT {
            return Err(ScriptTooLongError { bytes: self.bytes.len() });
        }
        Ok(programs)
    }
}

/// Length of the program at the beginning, if all of it is there.
fn program_length(bytes: &[u8]) -> Option<usize> {
    let mut lines = bytes.split_inclusive(|b| *b == b'\n');
    let first = lines.next().filter(|line| line.ends_with(b"\n"))?;
    if !first.starts_with(b"def ") && !first.starts_with(b"sec ") {
        return Some(first.len());
    }
    let mut length = first.len();
    for line in lines {
        if !line.ends_with(b"\n") {
            return None;
        }
        length += line.len();
        if line.starts_with(b"end") && line[3..].iter().all(u8::is_ascii_whitespace) {
            return Some(length);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn programs_come_in_any_pieces() {
        let wire = b"stopl(2.0)\ndef a():\n  if x:\n    y\n  end\nend\n\nsec b():\nend\r\n";
        let wanted = ["stopl(2.0)\n", "def a():\n  if x:\n    y\n  end\nend\n", "sec b():\nend\r\n"];
        for size in 1..wire.len() {
            let mut reader = ScriptReader::default();
            let found: Vec<String> = wire.chunks(size).flat_map(|p| reader.receive(p).unwrap()).collect();
            assert_eq!(found, wanted, "pieces of {size}");
        }
    }

    #[test]
    fn a_program_without_an_end_is_not_kept_for_ever() {
        let mut reader = ScriptReader::default();
        reader.receive(b"def a():\n").unwrap();
        let mut taken = (0..100).map(|_| reader.receive(&[b' '; 65_536]));
        assert!(taken.any(|r| r.is_err()));
    }
}
