//! What only shards of a rig have.

use super::{ReadError, ShardReader, png_image};
use crate::encode::EncodedRig;
use crate::rig_log::{RigLog, RigLogEvent, RigStream};
use gripgen_twin::{Jaw, PerJaw, TactileImage};

const REST: [&str; 2] = ["/tactile/left_rest", "/tactile/right_rest"];
const LOG: [&str; 2] = ["/rig/log", "/rig/events"];

impl ShardReader {
    /// The images without contact of a measured pull, where there are any.
    ///
    /// # Errors
    ///
    /// As [`Self::record`].
    pub fn rest(&self, index: u64) -> Result<Option<PerJaw<TactileImage>>, ReadError> {
        let Some(both) = self.raw_rest(index)? else { return Ok(None) };
        let image = |jaw: Jaw| {
            png_image(&both[jaw]).map_err(|e| self.damaged(index, REST[usize::from(jaw == Jaw::Right)], &e))
        };
        PerJaw::try_from_fn(image).map(Some)
    }

    /// Everything that was received during a measured pull; empty for a simulated one.
    ///
    /// # Errors
    ///
    /// As [`Self::record`].
    pub fn rig_log(&self, index: u64) -> Result<RigLog, ReadError> {
        let mut log = RigLog::default();
        self.each_message_of(index, &LOG, |topic, data| {
            match topic == LOG[0] {
                true => log.streams.push(RigStream::decode(data)?),
                false => log.events.push(RigLogEvent::decode(data)?),
            }
            Ok(())
        })?;
        Ok(log)
    }

    /// The images without contact, as they are stored.
    pub(crate) fn raw_rest(&self, index: u64) -> Result<Option<PerJaw<Vec<u8>>>, ReadError> {
        let (mut left, mut right) = (None, None);
        self.each_message_of(index, &REST, |topic, data| {
            *(if topic == REST[0] { &mut left } else { &mut right }) = Some(data.to_vec());
            Ok(())
        })?;
        match (left, right) {
            (Some(left), Some(right)) => Ok(Some(PerJaw { left, right })),
            (None, None) => Ok(None),
            (left, _) => Err(self.damaged(index, REST[usize::from(left.is_some())], "it is missing")),
        }
    }

    /// All of a measured pull that a simulated one has not, as it is stored; `None` for a simulated one.
    pub(crate) fn raw_rig(&self, index: u64) -> Result<Option<EncodedRig>, ReadError> {
        if !self.is_rig() {
            return Ok(None);
        }
        let mut rig = EncodedRig { rest: self.raw_rest(index)?, ..EncodedRig::default() };
        self.each_message_of(index, &LOG, |topic, data| {
            let messages = if topic == LOG[0] { &mut rig.streams } else { &mut rig.events };
            messages.push(data.to_vec());
            Ok(())
        })?;
        Ok(Some(rig))
    }
}
