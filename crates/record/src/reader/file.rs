//! Pieces of an MCAP file.

use super::ReadError;
use crate::frame::{FRAME, framed};
use mcap::records::{AttachmentIndex, MetadataIndex, Record, op};
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{McapError, Summary};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::{Read, Seek};
use std::path::Path;

/// An MCAP file, whole as far as its two ends say, and its size.
pub(super) fn open_mcap(path: &Path) -> Result<(File, u64), ReadError> {
    let at = |source| ReadError::Open { path: path.into(), source };
    let bad = |source| ReadError::Mcap { path: path.into(), source };
    let file = File::open(path).map_err(at)?;
    let bytes = file.metadata().map_err(at)?.len();
    let magic = mcap::MAGIC.len() as u64;
    for start in [0, bytes.saturating_sub(magic)] {
        if piece(&file, bytes, start, magic).map_err(bad)? != mcap::MAGIC {
            return Err(bad(McapError::BadMagic));
        }
    }
    Ok((file, bytes))
}

/// The first metadata record of a name.
pub(super) fn metadata_record(
    file: &File,
    bytes: u64,
    summary: &Summary,
    name: &str,
) -> Result<Option<BTreeMap<String, String>>, McapError> {
    let Some(index) = summary.metadata_indexes.iter().find(|m| m.name == name) else { return Ok(None) };
    let record = record(file, bytes, index.offset, index.length)?;
    let at_start = MetadataIndex { offset: 0, ..index.clone() };
    Ok(Some(mcap::read::metadata(&record, &at_start)?.metadata))
}

/// The first attachment of a name.
pub(super) fn attachment(
    file: &File,
    bytes: u64,
    summary: &Summary,
    name: &str,
) -> Result<Option<Vec<u8>>, McapError> {
    let Some(index) = summary.attachment_indexes.iter().find(|a| a.name == name) else { return Ok(None) };
    let record = record(file, bytes, index.offset, index.length)?;
    let at_start = AttachmentIndex { offset: 0, ..index.clone() };
    Ok(Some(mcap::read::attachment(&record, &at_start)?.data.into_owned()))
}

/// Checks that the records inside an uncompressed chunk fit into it: `mcap` adds lengths before it knows that (version 0.26), and
/// panics on those near the largest number.
pub(super) fn check_chunk(record: &[u8]) -> Result<(), McapError> {
    let frame = FRAME as usize;
    let body = record.get(frame..).ok_or(McapError::BadIndex)?;
    let Record::Chunk { data, .. } = mcap::parse_record(op::CHUNK, body)? else {
        return Err(McapError::BadIndex);
    };
    let mut rest: &[u8] = &data;
    while !rest.is_empty() {
        let (_, length) = rest.get(..frame).map(framed).ok_or(McapError::UnexpectedEoc)?;
        let end = usize::try_from(length).ok().and_then(|n| n.checked_add(frame));
        rest = end.and_then(|end| rest.get(end..)).ok_or(McapError::UnexpectedEoc)?;
    }
    Ok(())
}

/// A record of a file that is `bytes` long, with its kind and length.
pub(super) fn record(file: &File, bytes: u64, start: u64, length: u64) -> Result<Vec<u8>, McapError> {
    if length < FRAME { Err(McapError::BadIndex) } else { piece(file, bytes, start, length) }
}

/// Some bytes of a file that is `bytes` long.
pub(super) fn piece(file: &File, bytes: u64, start: u64, length: u64) -> Result<Vec<u8>, McapError> {
    if start.checked_add(length).is_none_or(|end| end > bytes) {
        return Err(McapError::BadIndex);
    }
    let mut found = vec![0; length as usize];
    read_exact_at(file, &mut found, start)?;
    Ok(found)
}

#[cfg(unix)]
fn read_exact_at(file: &File, out: &mut [u8], start: u64) -> std::io::Result<()> {
    std::os::unix::fs::FileExt::read_exact_at(file, out, start)
}

#[cfg(windows)]
fn read_exact_at(file: &File, mut out: &mut [u8], mut start: u64) -> std::io::Result<()> {
    while !out.is_empty() {
        let n = std::os::windows::fs::FileExt::seek_read(file, out, start)?;
        if n == 0 {
            return Err(std::io::ErrorKind::UnexpectedEof.into());
        }
        (out, start) = (&mut out[n..], start + n as u64);
    }
    Ok(())
}

pub(super) fn read_summary(file: &File, bytes: u64) -> Result<Option<Summary>, McapError> {
    let options =
        SummaryReaderOptions::default().with_file_size(bytes).with_record_length_limit(bytes as usize);
    let mut reader = SummaryReader::new_with_options(options);
    let mut file = file;
    while let Some(event) = reader.next_event() {
        match event? {
            SummaryReadEvent::ReadRequest(n) => {
                let read = file.read(reader.insert(n))?;
                reader.notify_read(read);
            }
            SummaryReadEvent::SeekRequest(to) => reader.notify_seeked(file.seek(to)?),
        }
    }
    Ok(reader.finish())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A chunk with one record that says that it is so long.
    fn chunk(length: u64) -> Vec<u8> {
        let mut inner = vec![op::MESSAGE];
        inner.extend(length.to_le_bytes());
        inner.extend([0; 24]);
        // Start, end, size and checksum of what is packed, no name of a compression, how much there is.
        let mut body =
            [0_u64.to_le_bytes(), 0_u64.to_le_bytes(), (inner.len() as u64).to_le_bytes()].concat();
        body.extend([0; 8]);
        body.extend((inner.len() as u64).to_le_bytes());
        body.extend(inner);
        let mut record = vec![op::CHUNK];
        record.extend((body.len() as u64).to_le_bytes());
        record.extend(body);
        record
    }

    #[test]
    fn records_of_a_chunk_fit_into_it() {
        assert!(check_chunk(&chunk(24)).is_ok());
        for length in [25, 1 << 40, u64::MAX - 9, u64::MAX - 8, u64::MAX] {
            assert!(matches!(check_chunk(&chunk(length)), Err(McapError::UnexpectedEoc)), "{length}");
        }
        assert!(check_chunk(&chunk(23)).is_err(), "a byte is left");
        for end in 0..chunk(24).len() {
            assert!(check_chunk(&chunk(24)[..end]).is_err(), "{end} bytes");
        }
    }
}
