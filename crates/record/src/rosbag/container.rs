//! The MCAP file of a bag, from its first byte to its last: recorders that were ended have no index.

use super::error::RosbagError;
use crate::frame::{FRAME, framed};
use mcap::records::{Record, op};
use std::collections::HashMap;
use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

/// What to do about a file that is not whole.
const RECOVER: &str = "`mcap recover FILE.mcap -o WHOLE.mcap` saves what can be read";

/// Largest chunk that is unpacked, in bytes; `rosbag2` makes some of about a million.
const LARGEST_CHUNK: u64 = 1 << 30;

/// A channel of a bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Topic {
    pub(super) name: String,
    /// `geometry_msgs/msg/WrenchStamped`.
    pub(super) kind: String,
    /// `cdr`.
    pub(super) encoding: String,
}

/// Where a message stands: its record or that of its chunk in the file, and its place in the chunk.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Place {
    pub(super) record: u64,
    pub(super) within: u64,
}

/// A message.
pub(super) struct Message<'a> {
    pub(super) topic: &'a Topic,
    pub(super) log_time_ns: i64,
    pub(super) data: &'a [u8],
    pub(super) place: Place,
}

/// A file that is read once.
pub(super) struct Container {
    path: PathBuf,
    file: BufReader<File>,
    bytes: u64,
    kinds: HashMap<u16, String>,
    channels: HashMap<u16, Topic>,
}

impl Container {
    pub(super) fn open(path: &Path) -> Result<Self, RosbagError> {
        let at = |e: std::io::Error| RosbagError::new(path, e);
        let file = File::open(path).map_err(at)?;
        let bytes = file.metadata().map_err(at)?.len();
        let file = BufReader::with_capacity(1 << 18, file);
        Ok(Self { path: path.into(), file, bytes, kinds: HashMap::new(), channels: HashMap::new() })
    }

    /// The topics that were met so far.
    pub(super) fn topics(&self) -> impl Iterator<Item = &Topic> {
        self.channels.values()
    }

    fn cut(&self, what: impl std::fmt::Display) -> RosbagError {
        RosbagError::new(&self.path, format!("{what}; the file has {} bytes", self.bytes)).hint(RECOVER)
    }

    fn read(&mut self, length: u64, at: u64) -> Result<Vec<u8>, RosbagError> {
        if at.checked_add(length).is_none_or(|end| end > self.bytes) {
            return Err(self.cut(format!("a record at byte {at} needs {length} bytes")));
        }
        let mut found = vec![0; length as usize];
        self.file.read_exact(&mut found).map_err(|e| RosbagError::new(&self.path, e))?;
        Ok(found)
    }

    fn magic(&mut self, at: u64) -> Result<bool, RosbagError> {
        Ok(self.read(mcap::MAGIC.len() as u64, at)? == mcap::MAGIC)
    }

    /// Hands out every message, in the order of the file.
    pub(super) fn each(
        &mut self,
        take: &mut dyn FnMut(&Message<'_>) -> Result<(), RosbagError>,
    ) -> Result<(), RosbagError> {
        if self.bytes < FRAME || !self.magic(0)? {
            return Err(RosbagError::new(&self.path, format!("no MCAP file of {} bytes", self.bytes))
                .hint("bags of another storage: `ros2 bag convert` with storage_id `mcap`"));
        }
        let mut at = mcap::MAGIC.len() as u64;
        loop {
            let frame = self.read(FRAME, at)?;
            let (kind, length) = framed(&frame);
            let start = at;
            at += FRAME;
            let end = at.checked_add(length).filter(|&end| end <= self.bytes);
            let end =
                end.ok_or_else(|| self.cut(format!("a record at byte {start} needs {length} bytes")))?;
            match kind {
                op::FOOTER => {
                    self.read(length, at)?;
                    let whole = self.magic(end)?;
                    return if whole { Ok(()) } else { Err(self.cut(format!("no end mark at byte {end}"))) };
                }
                op::SCHEMA | op::CHANNEL | op::MESSAGE => {
                    let body = self.read(length, at)?;
                    self.record((kind, &body), Place { record: start, within: 0 }, take)?;
                }
                op::CHUNK => {
                    let body = self.read(length, at)?;
                    let chunk = unpacked(&self.path, start, &body)?;
                    self.chunk(start, &chunk, take)?;
                }
                0 => return Err(self.cut(format!("a record of kind 0 at byte {start}"))),
                _ => {
                    let skip = i64::try_from(length).unwrap_or(i64::MAX);
                    self.file.seek_relative(skip).map_err(|e| RosbagError::new(&self.path, e))?;
                }
            }
            at = end;
        }
    }

    fn chunk(
        &mut self,
        start: u64,
        chunk: &[u8],
        take: &mut dyn FnMut(&Message<'_>) -> Result<(), RosbagError>,
    ) -> Result<(), RosbagError> {
        let mut within = 0;
        while within < chunk.len() {
            let (kind, body, next) = inner(&self.path, start, chunk, within)?;
            self.record((kind, body), Place { record: start, within: within as u64 }, take)?;
            within = next;
        }
        Ok(())
    }

    fn record(
        &mut self,
        (kind, body): (u8, &[u8]),
        place: Place,
        take: &mut dyn FnMut(&Message<'_>) -> Result<(), RosbagError>,
    ) -> Result<(), RosbagError> {
        let bad = |e: mcap::McapError| {
            let problem = format!("record at byte {}, {}: {e}", place.record, place.within);
            RosbagError::new(&self.path, problem).hint(RECOVER)
        };
        match kind {
            op::SCHEMA => {
                if let Record::Schema { header, .. } = mcap::parse_record(kind, body).map_err(bad)? {
                    self.kinds.insert(header.id, header.name);
                }
            }
            op::CHANNEL => {
                if let Record::Channel(channel) = mcap::parse_record(kind, body).map_err(bad)? {
                    let kind = self.kinds.get(&channel.schema_id).cloned().unwrap_or_default();
                    let topic = Topic { name: channel.topic, kind, encoding: channel.message_encoding };
                    self.channels.insert(channel.id, topic);
                }
            }
            op::MESSAGE => {
                let Record::Message { header, data } = mcap::parse_record(kind, body).map_err(bad)? else {
                    return Ok(());
                };
                let topic = self.channels.get(&header.channel_id).ok_or_else(|| {
                    let problem = format!(
                        "the message at byte {}, {} is of channel {}, there are {}",
                        place.record,
                        place.within,
                        header.channel_id,
                        self.channels.len()
                    );
                    RosbagError::new(&self.path, problem).hint(RECOVER)
                })?;
                let log_time_ns = i64::try_from(header.log_time).unwrap_or(i64::MAX);
                take(&Message { topic, log_time_ns, data: &data, place })?;
            }
            _ => {}
        }
        Ok(())
    }
}

/// Reads one message again.
pub(super) fn message_at(path: &Path, place: Place) -> Result<Vec<u8>, RosbagError> {
    let mut container = Container::open(path)?;
    container.file.seek(SeekFrom::Start(place.record)).map_err(|e| RosbagError::new(path, e))?;
    let frame = container.read(FRAME, place.record)?;
    let (kind, length) = framed(&frame);
    let body = container.read(length, place.record + FRAME)?;
    let chunk;
    let (kind, body) = if kind == op::CHUNK {
        chunk = unpacked(path, place.record, &body)?;
        let (kind, body, _) = inner(path, place.record, &chunk, place.within as usize)?;
        (kind, body)
    } else {
        (kind, &body[..])
    };
    match mcap::parse_record(kind, body) {
        Ok(Record::Message { data, .. }) => Ok(data.into_owned()),
        _ => Err(RosbagError::new(path, format!("no message at byte {}: the file changed", place.record))),
    }
}

/// The record at a place of a chunk, and the place of the next.
fn inner<'a>(
    path: &Path,
    start: u64,
    chunk: &'a [u8],
    within: usize,
) -> Result<(u8, &'a [u8], usize), RosbagError> {
    let cut = |needs: u64| {
        let problem = format!(
            "chunk at byte {start}: a record at byte {within} of it needs {needs} bytes, it has {}",
            chunk.len()
        );
        RosbagError::new(path, problem).hint(RECOVER)
    };
    let frame = chunk.get(within..within + FRAME as usize).ok_or_else(|| cut(FRAME))?;
    let (kind, length) = framed(frame);
    let from = within + FRAME as usize;
    let end = usize::try_from(length).ok().and_then(|n| from.checked_add(n));
    let end = end.filter(|&end| end <= chunk.len()).ok_or_else(|| cut(length))?;
    Ok((kind, &chunk[from..end], end))
}

/// The records of a chunk.
fn unpacked(path: &Path, start: u64, body: &[u8]) -> Result<Vec<u8>, RosbagError> {
    let bad =
        |problem: String| RosbagError::new(path, format!("chunk at byte {start}: {problem}")).hint(RECOVER);
    let Record::Chunk { header, data } =
        mcap::parse_record(op::CHUNK, body).map_err(|e| bad(e.to_string()))?
    else {
        return Err(bad("it is none".into()));
    };
    let wanted = header.uncompressed_size;
    if wanted > LARGEST_CHUNK {
        return Err(bad(format!("it says that it holds {wanted} bytes, at most {LARGEST_CHUNK} are read")));
    }
    // One byte more than there ought to be, to see that there is not.
    let mut found = Vec::new();
    let read =
        match header.compression.as_str() {
            "" => {
                found.extend_from_slice(&data);
                Ok(())
            }
            "zstd" => ruzstd::decoding::StreamingDecoder::new(&data[..]).map_err(|e| e.to_string()).and_then(
                |from| from.take(wanted + 1).read_to_end(&mut found).map(drop).map_err(|e| e.to_string()),
            ),
            "lz4" => lz4_flex::frame::FrameDecoder::new(&data[..])
                .take(wanted + 1)
                .read_to_end(&mut found)
                .map(drop)
                .map_err(|e| e.to_string()),
            other => Err(format!("compression `{other}`; none, zstd and lz4 are read")),
        };
    read.map_err(bad)?;
    if found.len() as u64 != wanted {
        let problem = format!("it says that it holds {wanted} bytes, and has {}", found.len());
        return Err(bad(problem));
    }
    let crc = crc32fast::hash(&found);
    if header.uncompressed_crc != 0 && header.uncompressed_crc != crc {
        return Err(bad(format!("its checksum is {crc:08x}, it says {:08x}", header.uncompressed_crc)));
    }
    Ok(found)
}
