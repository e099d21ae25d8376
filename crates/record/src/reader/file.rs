//! Pieces of an MCAP file.

use mcap::records::AttachmentIndex;
use mcap::sans_io::summary_reader::{SummaryReadEvent, SummaryReader, SummaryReaderOptions};
use mcap::{McapError, Summary};
use std::fs::File;
use std::io::{Read, Seek};

/// The first attachment of a name.
pub(super) fn attachment(
    file: &File,
    bytes: u64,
    summary: &Summary,
    name: &str,
) -> Result<Option<Vec<u8>>, McapError> {
    let Some(index) = summary.attachment_indexes.iter().find(|a| a.name == name) else { return Ok(None) };
    let record = piece(file, bytes, index.offset, index.length)?;
    let at_start = AttachmentIndex { offset: 0, ..index.clone() };
    Ok(Some(mcap::read::attachment(&record, &at_start)?.data.into_owned()))
}

/// Smallest record: its kind and its length.
const MIN_RECORD: u64 = 8;

/// Some bytes of a file that is `bytes` long.
pub(super) fn piece(file: &File, bytes: u64, start: u64, length: u64) -> Result<Vec<u8>, McapError> {
    let fits = start.checked_add(length).is_some_and(|end| end <= bytes) && length >= MIN_RECORD;
    if !fits {
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
