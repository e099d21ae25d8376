//! The messages of a sample: which chunks they are in, and what is in those.

use super::file::{check_chunk, record};
use super::{ReadError, ShardReader};
use mcap::records::ChunkIndex;

impl ShardReader {
    /// Calls `visit` with topic and bytes of every core message of a sample.
    pub(super) fn each_message(
        &self,
        index: u64,
        visit: impl FnMut(&str, &[u8]) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        // The core chunk of a slot comes first in it.
        match self.chunks_of(index)?.next() {
            Some(chunk) => self.each_message_in(chunk, index, visit),
            None => Err(self.damaged(index, "/sample", "its chunk is missing")),
        }
    }

    /// The same for every message of these topics, in whichever chunks they are.
    pub(super) fn each_message_of(
        &self,
        index: u64,
        topics: &[&str],
        mut visit: impl FnMut(&str, &[u8]) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        let channels = &self.summary.channels;
        let wanted = |id: &u16| channels.get(id).is_some_and(|c| topics.contains(&c.topic.as_str()));
        for chunk in self.chunks_of(index)?.filter(|c| c.message_index_offsets.keys().any(wanted)) {
            self.each_message_in(chunk, index, |topic, data| {
                if topics.contains(&topic) { visit(topic, data) } else { Ok(()) }
            })?;
        }
        Ok(())
    }

    /// The same for every message of its film, with the time of each. The film has a chunk of its own.
    pub(crate) fn each_film_message(
        &self,
        index: u64,
        mut visit: impl FnMut(&str, u64, &[u8]),
    ) -> Result<(), ReadError> {
        let channels = &self.summary.channels;
        let filmed = |id: &u16| channels.get(id).is_some_and(|c| c.topic.ends_with("/film"));
        for chunk in self.slot_of(index)?.filter(|c| c.message_index_offsets.keys().any(filmed)) {
            self.each_timed_in(chunk, index, |topic, time_ns, data| {
                visit(topic, time_ns, data);
                Ok(())
            })?;
        }
        Ok(())
    }

    /// Chunks of a sample whose messages are all from the start of its slot.
    fn chunks_of(&self, index: u64) -> Result<impl Iterator<Item = &ChunkIndex>, ReadError> {
        let slot = self.slot_of(index)?;
        let start = (index - self.first_sample) * self.slot_ns;
        Ok(slot.filter(move |c| c.message_end_time == start))
    }

    /// All chunks of a sample.
    fn slot_of(&self, index: u64) -> Result<impl Iterator<Item = &ChunkIndex>, ReadError> {
        if !self.indices().contains(&index) {
            let held = self.indices();
            let problem = format!("sample {index} is not in this shard, it holds {held:?}");
            return Err(ReadError::Content { path: self.path.clone(), problem });
        }
        let start = (index - self.first_sample) * self.slot_ns;
        // Chunks are written in the order of their samples.
        let chunks = &self.summary.chunk_indexes;
        let first = chunks.partition_point(|c| c.message_start_time < start);
        Ok(chunks[first..].iter().take_while(move |c| c.message_start_time < start + self.slot_ns))
    }

    fn each_message_in(
        &self,
        chunk: &ChunkIndex,
        index: u64,
        mut visit: impl FnMut(&str, &[u8]) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        self.each_timed_in(chunk, index, |topic, _, data| visit(topic, data))
    }

    fn each_timed_in(
        &self,
        chunk: &ChunkIndex,
        index: u64,
        mut visit: impl FnMut(&str, u64, &[u8]) -> Result<(), String>,
    ) -> Result<(), ReadError> {
        let bad = |source| ReadError::Mcap { path: self.path.clone(), source };
        let record =
            record(&self.file, self.bytes, chunk.chunk_start_offset, chunk.chunk_length).map_err(bad)?;
        check_chunk(&record).map_err(bad)?;
        let at_start = ChunkIndex { chunk_start_offset: 0, ..chunk.clone() };
        for message in self.summary.stream_chunk(&record, &at_start).map_err(bad)? {
            let message = message.map_err(bad)?;
            visit(&message.channel.topic, message.log_time, &message.data)
                .map_err(|problem| self.damaged(index, &message.channel.topic, &problem))?;
        }
        Ok(())
    }
}
