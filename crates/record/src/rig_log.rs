//! Everything that was received during a measured pull.

use crate::proto::gripgen_v1 as proto;
use prost::Message;
use prost_types::Timestamp;
use std::collections::BTreeSet;

/// Everything that was received, each source at its own rate and with both clocks: that of the machine which recorded it
/// and, where it has one, that of the device. The zeros of all clocks are arbitrary.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RigLog {
    /// Readings, a stream a source.
    pub streams: Vec<RigStream>,
    /// What happened once, in the order in which it was noticed.
    pub events: Vec<RigLogEvent>,
}

/// The readings of one source.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct RigStream {
    /// The source: `robot`, `gripper`, `camera_left`.
    pub name: String,
    /// When each row was received.
    pub host_time_s: Vec<f64>,
    /// When the device took each row by its own clock; empty if it has none.
    pub device_time_s: Vec<f64>,
    /// Columns by their names, each with a value per row: NaN where the device gave none.
    pub columns: Vec<(String, Vec<f64>)>,
}

/// A command, a change of state, a message of a device.
#[derive(Debug, Clone, PartialEq)]
pub struct RigLogEvent {
    /// When it was noticed.
    pub host_time_s: f64,
    /// When it was by the clock of the device, where that is known.
    pub device_time_s: Option<f64>,
    /// Who says it.
    pub source: String,
    /// What.
    pub text: String,
}

impl RigLog {
    /// The stream of a source.
    pub fn stream(&self, name: &str) -> Option<&RigStream> {
        self.streams.iter().find(|s| s.name == name)
    }

    /// Refuses columns of unequal length and names that occur twice: what belongs to which could not be told.
    pub(crate) fn check(&self) -> Result<(), String> {
        let mut names = BTreeSet::new();
        for stream in &self.streams {
            if !names.insert(&stream.name) {
                return Err(format!("stream `{}` is there twice", stream.name));
            }
            stream.check()?;
        }
        Ok(())
    }

    /// The messages of `/rig/log` and of `/rig/events`.
    pub(crate) fn encode(&self, timestamp: Option<Timestamp>) -> (Vec<Vec<u8>>, Vec<Vec<u8>>) {
        let stream = |s: &RigStream| {
            let column = |(name, value): &(String, Vec<f64>)| proto::RigColumn {
                name: name.clone(),
                value: value.clone(),
            };
            proto::RigStream {
                timestamp,
                name: s.name.clone(),
                host_time_s: s.host_time_s.clone(),
                device_time_s: s.device_time_s.clone(),
                columns: s.columns.iter().map(column).collect(),
            }
            .encode_to_vec()
        };
        let event = |e: &RigLogEvent| {
            proto::RigEvent {
                timestamp,
                host_time_s: e.host_time_s,
                device_time_s: e.device_time_s,
                source: e.source.clone(),
                text: e.text.clone(),
            }
            .encode_to_vec()
        };
        (self.streams.iter().map(stream).collect(), self.events.iter().map(event).collect())
    }
}

impl RigStream {
    /// The values of a column.
    pub fn column(&self, name: &str) -> Option<&[f64]> {
        self.columns.iter().find(|(n, _)| n == name).map(|(_, values)| values.as_slice())
    }

    fn check(&self) -> Result<(), String> {
        let wanted = self.host_time_s.len();
        let device =
            Some(("device_time_s", self.device_time_s.len())).filter(|_| !self.device_time_s.is_empty());
        let columns = self.columns.iter().map(|(name, values)| (name.as_str(), values.len()));
        for (column, rows) in device.into_iter().chain(columns) {
            if rows != wanted {
                return Err(format!(
                    "stream `{}`: its column `{column}` has {rows} rows, {wanted} were received",
                    self.name
                ));
            }
        }
        let mut names = BTreeSet::new();
        match self.columns.iter().find(|(name, _)| !names.insert(name)) {
            Some((name, _)) => Err(format!("column of stream `{}` `{name}` is there twice", self.name)),
            None => Ok(()),
        }
    }

    /// From a message of `/rig/log`.
    pub(crate) fn decode(data: &[u8]) -> Result<Self, String> {
        let message = proto::RigStream::decode(data).map_err(|e| e.to_string())?;
        let stream = Self {
            name: message.name,
            host_time_s: message.host_time_s,
            device_time_s: message.device_time_s,
            columns: message.columns.into_iter().map(|c| (c.name, c.value)).collect(),
        };
        stream.check()?;
        Ok(stream)
    }
}

impl RigLogEvent {
    /// From a message of `/rig/events`.
    pub(crate) fn decode(data: &[u8]) -> Result<Self, String> {
        let message = proto::RigEvent::decode(data).map_err(|e| e.to_string())?;
        Ok(Self {
            host_time_s: message.host_time_s,
            device_time_s: message.device_time_s,
            source: message.source,
            text: message.text,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stream() -> RigStream {
        RigStream {
            name: "robot".into(),
            host_time_s: vec![10.0, 10.002],
            device_time_s: vec![3.0, 3.002],
            columns: vec![("force_n".into(), vec![1.0, f64::NAN]), ("mode".into(), vec![7.0, 7.0])],
        }
    }

    /// Field by field against the wire format of protobuf: what another program reads.
    #[test]
    fn a_stream_is_packed_columns() {
        let event = RigLogEvent {
            host_time_s: 0.5,
            device_time_s: None,
            source: "gripper".into(),
            text: "ACK GRIP".into(),
        };
        let short = RigStream {
            name: "a".into(),
            host_time_s: vec![1.0],
            columns: vec![("b".into(), vec![2.0])],
            ..Default::default()
        };
        let log = RigLog { streams: vec![short], events: vec![event.clone()] };
        let (streams, events) = log.encode(None);
        let mut wire = vec![0x12, 1, b'a', 0x1a, 8];
        wire.extend(1.0_f64.to_le_bytes());
        wire.extend([0x2a, 13, 0x0a, 1, b'b', 0x12, 8]);
        wire.extend(2.0_f64.to_le_bytes());
        assert_eq!(streams, [wire]);
        assert_eq!(RigLogEvent::decode(&events[0]).unwrap(), event, "a time that is not there stays away");
        assert!(RigStream::decode(&[0x12, 9, b'a']).is_err(), "cut off");
    }

    #[test]
    fn ragged_and_ambiguous_logs_are_refused() {
        let good = RigLog { streams: vec![stream()], events: vec![] };
        assert_eq!(good.check(), Ok(()));
        assert_eq!(good.stream("robot").unwrap().column("mode"), Some(&[7.0, 7.0][..]));
        let fault = |change: &dyn Fn(&mut RigLog)| {
            let mut log = good.clone();
            change(&mut log);
            log.check().unwrap_err()
        };
        let short = fault(&|l| l.streams[0].columns[0].1.truncate(1));
        assert_eq!(short, "stream `robot`: its column `force_n` has 1 rows, 2 were received");
        assert!(fault(&|l| l.streams[0].device_time_s.push(4.0)).contains("`device_time_s` has 3 rows, 2"));
        assert_eq!(fault(&|l| l.streams.push(stream())), "stream `robot` is there twice");
        let twice = fault(&|l| l.streams[0].columns[1].0 = "force_n".into());
        assert_eq!(twice, "column of stream `robot` `force_n` is there twice");
        // A damaged file is no log either.
        let mut ragged = good.clone();
        ragged.streams[0].columns[0].1.truncate(1);
        assert!(RigStream::decode(&ragged.encode(None).0[0]).unwrap_err().contains("1 rows, 2"));
    }
}
