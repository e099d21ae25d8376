//! The few ROS 2 messages that a pull needs, out of their CDR bytes.
//!
//! CDR (the encoding of DDS, OMG formal/02-06-51) has a header of four bytes, then numbers at multiples of their size counted from
//! its end. Texts and lists begin with their length, texts end with a zero byte.

/// A list of numbers cannot be longer than this many times the bytes that are left, whatever it says of itself.
const NUMBER: usize = 8;

/// Bytes that are read one value after the other.
pub(super) struct Cdr<'a> {
    bytes: &'a [u8],
    at: usize,
    big_endian: bool,
}

impl<'a> Cdr<'a> {
    /// Looks at the header of a message.
    pub(super) fn new(message: &'a [u8]) -> Result<Self, String> {
        match message {
            [0, order @ (0 | 1), _, _, bytes @ ..] => Ok(Self { bytes, at: 0, big_endian: *order == 0 }),
            [a, b, _, _, ..] => Err(format!("the encapsulation is {a} {b}, plain CDR has 0 0 or 0 1")),
            short => Err(format!("it has {} bytes, the header of CDR alone has 4", short.len())),
        }
    }

    fn take(&mut self, length: usize, align: usize) -> Result<&'a [u8], String> {
        let from = self.at.next_multiple_of(align);
        let end = from.checked_add(length).filter(|&end| end <= self.bytes.len());
        let end = end.ok_or_else(|| {
            format!("it needs {length} bytes from byte {from} on, and ends at byte {}", self.bytes.len())
        })?;
        self.at = end;
        Ok(&self.bytes[from..end])
    }

    fn number<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut found: [u8; N] = self.take(N, N)?.try_into().map_err(|_| "no number".to_string())?;
        if self.big_endian {
            found.reverse();
        }
        Ok(found)
    }

    pub(super) fn u8(&mut self) -> Result<u8, String> {
        self.number::<1>().map(|b| b[0])
    }

    pub(super) fn u32(&mut self) -> Result<u32, String> {
        self.number().map(u32::from_le_bytes)
    }

    fn i32(&mut self) -> Result<i32, String> {
        self.number().map(i32::from_le_bytes)
    }

    pub(super) fn f64(&mut self) -> Result<f64, String> {
        self.number().map(f64::from_le_bytes)
    }

    pub(super) fn vector(&mut self) -> Result<[f64; 3], String> {
        Ok([self.f64()?, self.f64()?, self.f64()?])
    }

    pub(super) fn text(&mut self) -> Result<String, String> {
        let length = self.u32()? as usize;
        let bytes = self.take(length, 1)?;
        let bytes = bytes.strip_suffix(&[0]).unwrap_or(bytes);
        String::from_utf8(bytes.to_vec()).map_err(|e| format!("a text is not UTF-8: {e}"))
    }

    pub(super) fn bytes(&mut self) -> Result<&'a [u8], String> {
        let length = self.u32()? as usize;
        self.take(length, 1)
    }

    /// The time of a `std_msgs/msg/Header` in ns; its frame is passed over.
    pub(super) fn stamp_ns(&mut self) -> Result<i64, String> {
        let (seconds, nanoseconds) = (self.i32()?, self.u32()?);
        if nanoseconds >= 1_000_000_000 {
            return Err(format!("its stamp has {nanoseconds} ns, a second has 1000000000"));
        }
        self.text()?;
        Ok(i64::from(seconds) * 1_000_000_000 + i64::from(nanoseconds))
    }

    fn texts(&mut self) -> Result<Vec<String>, String> {
        let count = self.u32()?;
        let mut found = Vec::new();
        for _ in 0..count {
            found.push(self.text()?);
        }
        Ok(found)
    }

    fn numbers(&mut self) -> Result<Vec<f64>, String> {
        let count = self.u32()? as usize;
        let left = self.bytes.len() - self.at;
        if count > left / NUMBER {
            return Err(format!("a list says that it has {count} numbers, {left} bytes are left"));
        }
        (0..count).map(|_| self.f64()).collect()
    }
}

/// Names and angles of a `sensor_msgs/msg/JointState` behind its header.
pub(super) fn joint_state(cdr: &mut Cdr<'_>) -> Result<(Vec<String>, Vec<f64>), String> {
    let (names, positions) = (cdr.texts()?, cdr.numbers()?);
    if !positions.is_empty() && positions.len() != names.len() {
        return Err(format!("it names {} joints and has {} positions", names.len(), positions.len()));
    }
    Ok((names, positions))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Bytes as `rosbags` 0.11.9 writes them for a `WrenchStamped` of frame `tool0`.
    #[test]
    fn numbers_are_aligned_behind_texts() {
        let mut bytes = vec![0, 1, 0, 0];
        bytes.extend(7_i32.to_le_bytes());
        bytes.extend(5_u32.to_le_bytes());
        bytes.extend(6_u32.to_le_bytes());
        bytes.extend(b"tool0\0");
        bytes.extend([0; 6]);
        [1.0_f64, -2.0, 3.5].iter().for_each(|x| bytes.extend(x.to_le_bytes()));
        let mut cdr = Cdr::new(&bytes).unwrap();
        assert_eq!(cdr.stamp_ns().unwrap(), 7_000_000_005);
        assert_eq!(cdr.vector().unwrap(), [1.0, -2.0, 3.5]);
        let mut short = Cdr::new(&bytes[..40]).unwrap();
        short.stamp_ns().unwrap();
        let e = short.vector().unwrap_err();
        assert!(e.contains("8 bytes from byte 32") && e.contains("ends at byte 36"), "{e}");
    }

    #[test]
    fn big_endian_and_foreign_headers() {
        let mut bytes = vec![0, 0, 0, 0];
        bytes.extend(1.5_f64.to_be_bytes());
        assert_eq!(Cdr::new(&bytes).unwrap().f64().unwrap(), 1.5);
        assert!(Cdr::new(&[0, 7, 0, 0]).err().unwrap().contains("0 7"));
        assert!(Cdr::new(&[0, 1]).err().unwrap().contains("2 bytes"));
    }

    #[test]
    fn lists_longer_than_the_message_are_refused_before_they_are_made() {
        let mut bytes = vec![0, 1, 0, 0, 0, 0, 0, 0];
        bytes.extend(u32::MAX.to_le_bytes());
        let e = joint_state(&mut Cdr::new(&bytes).unwrap()).unwrap_err();
        assert!(e.contains("4294967295 numbers, 0 bytes"), "{e}");
    }
}
