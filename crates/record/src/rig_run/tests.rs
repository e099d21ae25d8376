use super::*;
use crate::rig_log::{RigLog, RigLogEvent, RigStream};
use crate::{Dataset, ShardReader, export_sample, verify};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{
    Covariates, PerJaw, PullSettings, PullTrace, Scenario, SlipLabel, TactileImage, TraceRow,
};
use mcap::MessageStream;
use std::collections::BTreeMap;

fn info(pulls: u64) -> RigRunInfo {
    let config_toml = "[rig]\nrobot = \"127.0.0.1\"\n[campaign]\nfeedback = \"independent\"\n\
                       recorded = [\"part\", \"grip_force_n\", \"humidity_pct\"]\nlabel_tolerance_n = 3.0\n";
    RigRunInfo { name: "lab".into(), gripgen_version: "0".into(), config_toml: config_toml.into(), pulls }
}

fn image(level: u8) -> PerJaw<TactileImage> {
    PerJaw::from_fn(|jaw| {
        let level = level + u8::from(jaw == gripgen_twin::Jaw::Right);
        TactileImage { width_px: 4, height_px: 2, rgb: vec![level; 24] }
    })
}

/// Rows at uneven times, the first ones before the pull.
fn trace() -> PullTrace {
    let row = |time_s: f64, force: f64| TraceRow {
        time_s,
        desired_force_n: force.max(0.0),
        measured_force_n: force - 0.25,
        displacement_m: 1e-3 * time_s.max(0.0),
    };
    [row(-0.5, 0.0), row(-0.1, 0.0), row(0.0, 1.0), row(0.021, 2.0), row(1.5, 3.0)].into_iter().collect()
}

fn log() -> RigLog {
    RigLog {
        streams: vec![
            RigStream {
                name: "robot".into(),
                host_time_s: vec![100.0, 100.002, 100.004],
                device_time_s: vec![7.0, 7.002, 7.004],
                columns: vec![("force_n".into(), vec![0.5, 0.25, -0.125])],
            },
            RigStream { name: "camera_left".into(), host_time_s: vec![99.9], ..Default::default() },
        ],
        events: vec![RigLogEvent {
            host_time_s: 99.0,
            device_time_s: Some(6.0),
            source: "gripper".into(),
            text: "gripped".into(),
        }],
    }
}

fn label() -> SlipLabel {
    SlipLabel { slip_time_s: 0.021, max_pull_force_n: 1.75, censored: false }
}

fn pull(index: u64, result: RigResult) -> RigPull {
    let covariates = Covariates { pull_index: index, time_s: 60.0 * index as f64, ..Covariates::default() };
    let settings = PullSettings { max_time_s: 120.0, ..Default::default() };
    let scenario = Scenario {
        index,
        group: index,
        part: "gear".into(),
        grip_force_n: 20.0,
        covariates,
        pull: settings,
        drawn: BTreeMap::from([("humidity_pct".to_string(), Drawn::Number(41.5))]),
        ..Scenario::default()
    };
    let (images, rest) = (Some(image(90)), Some(image(60)));
    RigPull { scenario, result, images, rest, trace: Some(trace()), film: None, log: log() }
}

fn slipped(index: u64) -> RigPull {
    pull(index, RigResult::Slipped { label: label() })
}

fn failed(index: u64) -> RigPull {
    pull(index, RigResult::Failed { reason: "the gripper did not close".into() })
}

/// A film of two frames, one before the pull, of cameras that stand upright: 2 columns, 3 rows, the upper left pixel red.
fn film() -> RigFilm {
    let rgb: Vec<u8> = (0..6).flat_map(|i| if i == 0 { [250, 10, 10] } else { [10, 10, 10] }).collect();
    let jpeg: std::sync::Arc<[u8]> =
        crate::picture::encode_jpeg(&TactileImage { width_px: 2, height_px: 3, rgb }, 100).unwrap().into();
    let frame = |received_s, device_time_s| RigFrame { received_s, device_time_s, jpeg: jpeg.clone() };
    let both = |at: f64| PerJaw { left: frame(at, Some(40.0 + at)), right: frame(at - 0.005, None) };
    let left = FrameView { quarters: 1, mirror: false, crop_px: None };
    let right = FrameView { quarters: 0, mirror: true, crop_px: Some([0, 0, 2, 2]) };
    RigFilm { views: PerJaw { left, right }, frames: vec![both(-0.4), both(0.5)] }
}

/// JPEG for JPEG as they came, turned and cut out when they are read, with the force of their moment and both clocks.
#[test]
fn a_film_is_stored_as_it_came_and_read_as_it_is_looked_at() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(2)).unwrap();
    write_rig_pull(&folder, &RigPull { film: Some(film()), ..slipped(0) }).unwrap();
    write_rig_pull(&folder, &RigPull { film: Some(RigFilm::default()), ..failed(1) }).unwrap();
    let reader = ShardReader::open(&folder.shard_path(0)).unwrap();
    assert!(reader.has_film());
    let stored = reader.raw_film(0).unwrap();
    let jpeg = &film().frames[0].left.jpeg;
    assert!(stored[0].image.left.windows(jpeg.len()).any(|bytes| bytes == &jpeg[..]), "not as it came");
    // 0.5 s without a load come first: the trace begins there.
    assert_eq!([stored[0].time_ns, stored[1].time_ns], [100_000_000, 1_000_000_000]);
    let read = reader.film(0).unwrap().unwrap();
    assert_eq!((read.frames.len(), read.whole_slip_s), (2, None));
    let [before, during] = &read.frames[..] else { panic!() };
    // A quarter clockwise: the upper left corner goes to the upper right.
    assert_eq!([before.left.image.width_px, before.left.image.height_px], [3, 2]);
    assert_eq!([before.right.image.width_px, before.right.image.height_px], [2, 2]);
    for (image, x, y) in [(&before.left.image, 2, 0), (&before.right.image, 1, 0)] {
        let red = |x, y| image.pixel(x, y)[0];
        assert!(red(x, y) > 150 && red(0, 0) < 100 && red(0, 1) < 100, "{image:?}");
    }
    assert_eq!((before.left.contact_force_n, before.left.displacement_m), (-0.25, 0.0));
    // The row before: 2 N at 0.021 s.
    assert_eq!((during.left.contact_force_n, during.left.displacement_m), (1.75, 1e-3 * 0.021));
    let stamp = |f: &gripgen_twin::FilmFrame| f.camera.map(|c| (c.received_s, c.device_time_s));
    assert_eq!(stamp(&during.left), Some((0.5, Some(40.5))));
    assert_eq!(stamp(&during.right), Some((0.495, None)));
    assert_eq!(during.left.state(), None, "nobody knows what slips");
    let dataset = Dataset::open(at.path()).unwrap();
    assert!(dataset.has_films().unwrap());
    assert!(dataset.film(0).unwrap().is_some() && reader.film(0).unwrap().is_some());
    assert_eq!(ShardReader::open(&folder.shard_path(1)).unwrap().film(1).unwrap(), None);
    let elsewhere = tempfile::tempdir().unwrap();
    let alone = elsewhere.path().join("alone.mcap");
    std::fs::write(&alone, export_sample(&reader, 0).unwrap()).unwrap();
    assert_eq!(ShardReader::open(&alone).unwrap().film(0).unwrap(), Some(read));
    folder.write_index().unwrap();
    assert_eq!(verify(at.path(), |_| {}).unwrap().faults, [""; 0]);
}

#[test]
fn what_was_measured_is_read_back() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(2)).unwrap();
    let sidecar = write_rig_pull(&folder, &slipped(1)).unwrap();
    assert_eq!((sidecar.first_sample, sidecar.samples, sidecar.failed), (1, 1, 0));
    let reader = ShardReader::open(&folder.shard_path(1)).unwrap();
    let record = reader.record(1).unwrap();
    let s = &record.sample;
    assert_eq!((s.index, s.status(), s.max_pull_force_n), (1, Status::Slipped, Some(1.75)));
    assert_eq!(
        (s.mu_effective, &s.left, &s.right),
        (None, &None, &None),
        "a rig knows neither friction nor cells"
    );
    assert_eq!(s.drawn_number["humidity_pct"], 41.5);
    assert_eq!((record.images, reader.rest(1).unwrap()), (Some(image(90)), Some(image(60))));
    let (found, wanted) = (record.trace.unwrap(), trace());
    assert_eq!((found.time_s, found.measured_force_n), (wanted.time_s, wanted.measured_force_n));
    assert_eq!(reader.rig_log(1).unwrap(), log());
    let e = reader.rig_log(0).unwrap_err().to_string();
    assert!(e.ends_with("sample 0 is not in this shard, it holds 1..2"), "{e}");

    // A row of the table for every column, with that of the campaign's own covariate.
    let rows = Dataset::open(at.path()).unwrap();
    assert_eq!((rows.table().rows(), rows.sample_index(0).unwrap()), (1, 1));
    assert_eq!(rows.table().numbers("humidity_pct").unwrap(), [41.5]);
    assert!(rows.table().numbers("mu_effective").unwrap()[0].is_nan());
    assert_eq!(rows.rest(0).unwrap(), Some(image(60)));
    let png = rows.rest_png(0).unwrap().unwrap();
    assert_eq!(crate::decode_picture(&png[1]).unwrap(), image(60).right);
}

/// By the MCAP library alone: topics, counts and times of the whole file, and the same of an exported pull.
#[test]
fn every_topic_is_in_the_file_and_in_its_export() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(1)).unwrap();
    write_rig_pull(&folder, &slipped(0)).unwrap();
    let topics = |bytes: &[u8]| {
        let mut found: BTreeMap<String, Vec<u64>> = BTreeMap::new();
        for message in MessageStream::new(bytes).unwrap() {
            let message = message.unwrap();
            found.entry(message.channel.topic.clone()).or_default().push(message.log_time);
        }
        found
    };
    let shard = topics(&std::fs::read(folder.shard_path(0)).unwrap());
    let names = [
        "/pull/state",
        "/pull/trace",
        "/rig/events",
        "/rig/log",
        "/sample",
        "/tactile/left",
        "/tactile/left_rest",
        "/tactile/right",
        "/tactile/right_rest",
    ];
    assert_eq!(shard.keys().collect::<Vec<_>>(), names);
    assert_eq!((&shard["/rig/log"], &shard["/rig/events"]), (&vec![0, 0], &vec![0]));
    // The slot begins where the trace does, half a second before the pull.
    assert_eq!(shard["/pull/state"].last(), Some(&2_000_000_000));
    let reader = ShardReader::open(&folder.shard_path(0)).unwrap();
    assert_eq!(reader.metadata()["source"], RIG_SOURCE);
    assert_eq!(reader.metadata()["slot_ns"], "3000000000");
    let one = at.path().join("one.mcap");
    let bytes = export_sample(&reader, 0).unwrap();
    assert_eq!(topics(&bytes).keys().collect::<Vec<_>>(), names);
    std::fs::write(&one, bytes).unwrap();
    let one = ShardReader::open(&one).unwrap();
    assert_eq!((one.rest(0).unwrap(), one.rig_log(0).unwrap()), (Some(image(60)), log()));
}

#[test]
fn a_pull_without_anything_is_stored_too() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(3)).unwrap();
    let bare = |index, result| RigPull {
        images: None,
        rest: None,
        trace: None,
        log: RigLog::default(),
        ..pull(index, result)
    };
    write_rig_pull(&folder, &bare(0, RigResult::Failed { reason: "no answer, 5 s".into() })).unwrap();
    write_rig_pull(&folder, &bare(1, RigResult::NoContact)).unwrap();
    let held = RigResult::Censored { label: label() };
    write_rig_pull(&folder, &RigPull { images: Some(image(9)), ..bare(2, held) }).unwrap();
    let of = |index| ShardReader::open(&folder.shard_path(index)).unwrap().record(index).unwrap();
    let (failed, touched_nothing, held) = (of(0), of(1), of(2));
    assert_eq!((failed.sample.status(), failed.sample.max_pull_force_n), (Status::Failed, None));
    assert_eq!(failed.sample.failure, "no answer, 5 s");
    assert_eq!((failed.images, failed.trace), (None, None));
    assert_eq!(touched_nothing.sample.max_pull_force_n, Some(0.0));
    assert!(held.sample.censored && held.sample.status() == Status::Censored);
    let reader = ShardReader::open(&folder.shard_path(0)).unwrap();
    assert_eq!((reader.rest(0).unwrap(), reader.rig_log(0).unwrap()), (None, RigLog::default()));
    assert_eq!(Dataset::open(at.path()).unwrap().image_size_px(), Some((4, 2)), "that of the third");
    assert!(folder.write_index().unwrap());
    let checked = verify(at.path(), |_| {}).unwrap();
    assert_eq!((checked.good_shards, checked.faults), (3, vec![]));
}

#[test]
fn a_campaign_goes_on_and_failed_pulls_are_made_again() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(3)).unwrap();
    assert!(!discard_failed(&folder, 0).unwrap(), "there is nothing yet");
    for measured in [failed(0), slipped(1), pull(2, RigResult::NoContact)] {
        write_rig_pull(&folder, &measured).unwrap();
    }
    assert!(missing_pulls(&folder).unwrap().is_empty() && folder.write_index().unwrap());
    let again = write_rig_pull(&folder, &slipped(1)).unwrap_err().to_string();
    assert!(again.starts_with("pull 1 is done: "), "{again}");

    let folder = create_rig_run(at.path(), &RigRunInfo { name: "other name".into(), ..info(3) }).unwrap();
    assert_eq!(failed_pulls(&folder).unwrap(), [0]);
    for kept in [1, 2] {
        let e = discard_failed(&folder, kept).unwrap_err().to_string();
        assert!(e.contains("did not fail, it stays: "), "{e}");
    }
    assert!(discard_failed(&folder, 0).unwrap());
    assert_eq!(missing_pulls(&folder).unwrap(), [0]);
    let checked = verify(at.path(), |_| {}).unwrap();
    assert_eq!((checked.missing_shards, checked.faults), (1, vec![]), "a whole folder with one pull less");
    let left: Vec<_> = std::fs::read_dir(at.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(left.len(), 6, "the folder of what failed beside them: {left:?}");
    // What failed is kept, each time under a name of its own.
    for times in [2, 3] {
        write_rig_pull(&folder, &failed(0)).unwrap();
        assert!(discard_failed(&folder, 0).unwrap());
        let kept = at.path().join(format!("{FAILED_FOLDER}/shard-00000-{times}.mcap"));
        let sample = ShardReader::open(&kept).unwrap().sample(0).unwrap();
        assert!(!sample.failure.is_empty() && kept.with_extension("json").exists());
    }
    write_rig_pull(&folder, &slipped(0)).unwrap();
    assert!(folder.write_index().unwrap() && verify(at.path(), |_| {}).unwrap().faults.is_empty());
}

#[test]
fn what_a_killed_writer_leaves_is_no_pull() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(2)).unwrap();
    write_rig_pull(&folder, &slipped(0)).unwrap();
    let whole = std::fs::read(folder.shard_path(0)).unwrap();
    // Killed while writing, and between the rename and the sidecar.
    std::fs::write(at.path().join("shard-00001.mcap.partial"), &whole[..whole.len() / 2]).unwrap();
    std::fs::remove_file(folder.sidecar_path(0)).unwrap();
    assert_eq!(missing_pulls(&folder).unwrap(), [0, 1]);
    assert!(Dataset::open(at.path()).is_err(), "nothing is done");
    let checked = verify(at.path(), |_| {}).unwrap();
    assert!(checked.faults[0].contains("running the campaign again"), "{:?}", checked.faults);
    // Both are made anew; the shard that was there counts for nothing.
    write_rig_pull(&folder, &failed(0)).unwrap();
    write_rig_pull(&folder, &slipped(1)).unwrap();
    assert_eq!((missing_pulls(&folder).unwrap(), failed_pulls(&folder).unwrap()), (vec![], vec![0]));
    assert!(folder.write_index().unwrap() && verify(at.path(), |_| {}).unwrap().faults.is_empty());
    let ShardStart::Done(_) = folder.start_shard(1).unwrap() else { panic!("it is done") };
}

#[test]
fn another_campaign_is_refused() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(2)).unwrap();
    let hash = folder.info().config_sha256.clone();
    assert_eq!(hash, sha256_hex(info(2).config_toml.as_bytes()));
    let mut other = info(2);
    other.config_toml = other.config_toml.replace("127.0.0.1", "127.0.0.2");
    for (what, other) in [("config_sha256", &other), ("number of pulls", &info(3))] {
        let e = create_rig_run(at.path(), other).unwrap_err();
        assert!(matches!(&e, FolderError::AnotherRun { what: w, .. } if *w == what), "{e}");
    }
    let odd = RigRunInfo { config_toml: "[campaign]\nfeedback = \"none\"\n".into(), ..info(1) };
    let e = create_rig_run(&at.path().join("odd"), &odd).unwrap_err().to_string();
    assert!(e.contains("the configuration of the run") && e.contains("none"), "{e}");
    let campaign = rig_campaign(&folder).unwrap();
    assert_eq!(campaign.feedback, Some(Feedback::Independent));
    assert_eq!(campaign.recorded.unwrap().len(), 3);
}

#[test]
fn pulls_that_do_not_fit_are_refused_before_anything_is_written() {
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(1)).unwrap();
    let nan = SlipLabel { max_pull_force_n: f64::NAN, ..label() };
    let mut odd_image = image(1);
    odd_image.right.rgb.pop();
    let mut ragged = trace();
    ragged.displacement_m.pop();
    let mut back = trace();
    back.time_s[3] = -0.2;
    let mut twice = log();
    twice.streams[1].name = "robot".into();
    let whole = slipped(0);
    let cases = [
        (slipped(1), "there is no pull 1, the campaign has 1"),
        (pull(0, RigResult::Slipped { label: nan }), "its label is NaN N at 0.021 s"),
        (
            RigPull { rest: Some(odd_image), ..whole.clone() },
            "at rest of the right jaw is 4x2 pixels and has 23",
        ),
        (RigPull { trace: Some(ragged), ..whole.clone() }, "columns of [5, 5, 5, 4] rows"),
        (
            RigPull { trace: Some(back), ..whole.clone() },
            "row 3 of its trace is at -0.2 s, the row before at 0 s",
        ),
        (RigPull { log: twice, ..whole }, "stream `robot` is there twice"),
    ];
    for (pull, part) in cases {
        let e = write_rig_pull(&folder, &pull).unwrap_err().to_string();
        assert!(e.contains(part), "`{part}` is missing in `{e}`");
    }
    let files: Vec<_> = std::fs::read_dir(at.path()).unwrap().map(|e| e.unwrap().file_name()).collect();
    assert_eq!(files, ["run.json"]);
    let mut of_a_sweep = folder.info().clone();
    of_a_sweep.source = "sim".into();
    let sweep = RunFolder::create(&at.path().join("sweep"), of_a_sweep, &[]).unwrap();
    let e = write_rig_pull(&sweep, &slipped(0)).unwrap_err().to_string();
    assert!(e.contains("its source is `sim`"), "{e}");
}

/// Read by the parquet crate: what a rig does not know is null, what only a rig has are columns.
#[test]
fn a_parquet_file_has_the_images_at_rest_and_nulls() {
    use parquet::file::reader::{FileReader, SerializedFileReader};
    use parquet::record::Field;
    let at = tempfile::tempdir().unwrap();
    let folder = create_rig_run(at.path(), &info(3)).unwrap();
    write_rig_pull(&folder, &slipped(0)).unwrap();
    write_rig_pull(&folder, &RigPull { rest: None, trace: None, ..failed(2) }).unwrap();
    let rows = Dataset::open(at.path()).unwrap();
    let path = at.path().join("all.parquet");
    let options = crate::ExportOptions { images: true, traces: true };
    crate::export_parquet(&rows, options, std::fs::File::create(&path).unwrap(), |_| {}).unwrap();
    let reader = SerializedFileReader::new(std::fs::File::open(&path).unwrap()).unwrap();
    let found: Vec<BTreeMap<String, Field>> = reader
        .get_row_iter(None)
        .unwrap()
        .map(|row| row.unwrap().into_columns().into_iter().collect())
        .collect();
    assert_eq!(found.len(), 2);
    let (slipped, failed) = (&found[0], &found[1]);
    assert_eq!((&slipped["answer.mu_effective"], &failed["max_pull_force_n"]), (&Field::Null, &Field::Null));
    assert_eq!(slipped["humidity_pct"], Field::Double(41.5));
    let Field::Group(image) = &slipped["left_rest_png"] else { panic!("{:?}", slipped["left_rest_png"]) };
    let parts: BTreeMap<&String, &Field> = image.get_column_iter().collect();
    let Field::Bytes(png) = parts[&"bytes".to_string()] else { panic!("{parts:?}") };
    assert_eq!(slipped["index"], Field::Long(0), "a count is an integer");
    assert_eq!(crate::decode_picture(png.data()).unwrap(), self::image(60).left);
    assert_eq!((&failed["right_rest_png"], &failed["trace_time_s"]), (&Field::Null, &Field::Null));
    assert_eq!(failed["failure"], Field::Str("the gripper did not close".into()));
}
