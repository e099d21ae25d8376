//! Shards that say of themselves what cannot be.

use crate::encode::EncodedSample;
use crate::proto::gripgen_v1::Status;
use crate::{ShardInfo, ShardReader, ShardWriter};
use gripgen_twin::config::ImageStorage;
use std::io::Cursor;

/// A shard with one empty sample.
fn shard(first_sample: u64, slot_ns: u64) -> Vec<u8> {
    let info = ShardInfo {
        gripgen_version: "0".into(),
        config_sha256: String::new(),
        source: "sim".into(),
        shard: 0,
        shards: 1,
        first_sample,
        samples: 1,
        slot_ns,
        config_toml: String::new(),
    };
    let mut writer = ShardWriter::new(Cursor::new(Vec::new()), &info, ImageStorage::None).unwrap();
    let sample = EncodedSample {
        start_ns: 0,
        sample: vec![],
        images: None,
        trace: None,
        states: vec![],
        film: vec![],
        rig: None,
        row: vec![],
        status: Status::Unspecified,
    };
    writer.push(&sample).unwrap();
    writer.finish().unwrap().into_inner()
}

/// The last sample that can be counted is read; what would end behind it is refused, with both numbers.
#[test]
fn numbers_beyond_counting_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("shard.mcap");
    let open = |first, slot_ns| {
        std::fs::write(&path, shard(first, slot_ns)).unwrap();
        ShardReader::open(&path)
    };
    assert_eq!(open(u64::MAX - 1, u64::MAX).unwrap().indices(), u64::MAX - 1..u64::MAX);
    let refused = open(u64::MAX, 5).map(|_| ()).unwrap_err().to_string();
    assert!(refused.contains("1 samples from number 18446744073709551615"), "{refused}");
}
