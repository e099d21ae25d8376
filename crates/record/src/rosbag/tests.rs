//! Bags that are written here by hand; `tests/python/test_rosbag.py` has bags of another writer.

use super::*;
use crate::proto::gripgen_v1::Status;
use mcap::records::MessageHeader;
use mcap::{WriteOptions, Writer};
use std::collections::BTreeMap;
use std::io::Cursor;

/// A message in CDR, behind a header of the time `ns`.
fn headed(ns: u64, rest: impl FnOnce(&mut Vec<u8>)) -> Vec<u8> {
    let mut body = Vec::new();
    body.extend(((ns / 1_000_000_000) as i32).to_le_bytes());
    body.extend(((ns % 1_000_000_000) as u32).to_le_bytes());
    text(&mut body, "base");
    rest(&mut body);
    [&[0, 1, 0, 0], &body[..]].concat()
}

fn align(body: &mut Vec<u8>, to: usize) {
    body.resize(body.len().next_multiple_of(to), 0);
}

fn text(body: &mut Vec<u8>, text: &str) {
    align(body, 4);
    body.extend((text.len() as u32 + 1).to_le_bytes());
    body.extend(text.as_bytes());
    body.push(0);
}

fn numbers(body: &mut Vec<u8>, all: &[f64]) {
    align(body, 8);
    all.iter().for_each(|x| body.extend(x.to_le_bytes()));
}

fn wrench(ns: u64, fz_n: f64) -> Vec<u8> {
    headed(ns, |body| numbers(body, &[0.0, 0.0, fz_n, 0.0, 0.0, 0.0]))
}

fn pose(ns: u64, z_m: f64) -> Vec<u8> {
    headed(ns, |body| numbers(body, &[0.4, 0.1, z_m, 0.0, 0.0, 0.0, 1.0]))
}

fn joints(ns: u64, angle_rad: f64) -> Vec<u8> {
    let names = BagMotion::default().joints;
    headed(ns, |body| {
        align(body, 4);
        body.extend(7_u32.to_le_bytes());
        text(body, "finger_joint");
        names.iter().rev().for_each(|name| text(body, name));
        align(body, 4);
        body.extend(7_u32.to_le_bytes());
        numbers(body, &[0.01, 6.0, 5.0, 4.0, 3.0, 2.0, angle_rad]);
        (0..2).for_each(|_| body.extend(0_u32.to_le_bytes()));
    })
}

fn image(ns: u64, level: u8) -> Vec<u8> {
    headed(ns, |body| {
        align(body, 4);
        body.extend(2_u32.to_le_bytes());
        body.extend(1_u32.to_le_bytes());
        text(body, "bgr8");
        body.push(0);
        align(body, 4);
        // Rows of four bytes, of which the last is padding.
        body.extend(4_u32.to_le_bytes());
        body.extend(8_u32.to_le_bytes());
        body.extend([level, 2, 3, 0, 4, 5, 6, 0]);
    })
}

fn command(force_n: f64) -> Vec<u8> {
    [&[0, 1, 0, 0], &force_n.to_le_bytes()[..]].concat()
}

const START_NS: u64 = 1_700_000_000_000_000_000;
const STEP_NS: u64 = 20_000_000;

/// A pull that begins after 1 s of readings of 0.5 N, rises by 1 N each 0.1 s and slips at 8 N. Its force follows at once, which no loop
/// does: labels are not judged.
fn bag(path: &Path) {
    let mut bytes = Cursor::new(Vec::new());
    let mut writer = WriteOptions::new()
        .compression(None)
        .chunk_size(Some(4000))
        .profile("ros2")
        .create(&mut bytes)
        .unwrap();
    let channel = |writer: &mut Writer<&mut Cursor<Vec<u8>>>, topic: &str, kind: &str| {
        let schema = writer.add_schema(kind, "ros2msg", b"not looked at").unwrap();
        writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
    };
    let wrenches = channel(&mut writer, "/wrench", signals::WRENCH);
    let poses = channel(&mut writer, "/pose", "geometry_msgs/msg/PoseStamped");
    let commands = channel(&mut writer, "/command", "std_msgs/msg/Float64");
    let all_joints = channel(&mut writer, "/joint_states", "sensor_msgs/msg/JointState");
    let left = channel(&mut writer, "/left", "sensor_msgs/msg/Image");
    let right = channel(&mut writer, "/right", "sensor_msgs/msg/Image");
    let mut write = |channel_id: u16, ns: u64, data: &[u8]| {
        let header = MessageHeader { channel_id, sequence: 0, log_time: ns, publish_time: ns };
        writer.write_to_known_channel(&header, data).unwrap();
    };
    for i in 0..100_u64 {
        let ns = START_NS + i * STEP_NS;
        let pulled = i.saturating_sub(50);
        let desired_n = if i < 50 { 0.0 } else { 1.0 + (pulled / 5) as f64 };
        let moved_m = if desired_n > 8.0 { 1e-3 * (pulled as f64 - 39.5) } else { 0.0 };
        write(wrenches, ns, &wrench(ns, -0.5 - desired_n.min(8.0)));
        write(poses, ns, &pose(ns, 0.3 + moved_m));
        write(all_joints, ns, &joints(ns, 0.3 + moved_m));
        write(commands, ns, &command(desired_n));
        if i % 25 == 10 {
            write(left, ns, &image(ns, i as u8));
            write(right, ns, &image(ns, i as u8 + 100));
        }
    }
    writer.finish().unwrap();
    drop(writer);
    std::fs::write(path, bytes.into_inner()).unwrap();
}

const MAPPING: &str = r#"
[campaign]
label_tolerance_n = 0.75
label_evidence = "none"
[topics]
wrench = "/wrench"
command = "/command"
pose = "/pose"
image_left = "/left"
image_right = "/right"
[force]
tare = true
[defaults]
part = "gear"
grip_force_n = 40
humidity_pct = 41.5
no_load_s = [0.2, 0.9]
rest_s = 0.5
"#;

fn folder(mapping: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    bag(&folder.path().join("one.mcap"));
    std::fs::write(folder.path().join(ROSBAG_FILE), mapping).unwrap();
    folder
}

fn read(mapping: &str) -> Result<JudgedPulls, RosbagError> {
    read_judged_bags(&folder(mapping).path().join("one.mcap"), None)
}

#[test]
fn a_bag_is_a_pull_with_its_trace_label_and_covariates() {
    let JudgedPulls { pulls, standing, .. } = read(MAPPING).unwrap();
    let [pull] = &pulls.pulls[..] else { panic!("one pull") };
    assert_eq!((pull.id.as_str(), pull.part.as_str(), pull.grip_force_n), ("one", "gear", 40.0));
    assert_eq!(pulls.extra[0].name, "humidity_pct");
    assert_eq!(standing[0].status, Status::Slipped, "{}", standing[0].reason);
    assert!((pull.max_pull_force_n - 8.0).abs() < 1e-12, "the load without the part is taken off");
    let trace = pull.trace.as_ref().unwrap();
    let begun = trace.time_s.iter().position(|&t| t == 0.0).unwrap();
    assert_eq!((begun, trace.desired_force_n[begun], trace.time_s[begun + 1]), (36, 1.0, 0.02));
    assert!((trace.time_s[0] + 0.8).abs() < 1e-12 && trace.displacement_m[0] == 0.0);
    assert!((trace.displacement_m.last().unwrap() - 5.5e-3).abs() < 1e-9, "cut at the stop");
}

#[test]
fn marks_take_the_place_of_a_command() {
    let marked = MAPPING.replace("command = \"/command\"\n", "") + "begin_s = 1.0\nstep_time_s = 0.1\n";
    let (by_topic, by_marks) = (read(MAPPING).unwrap(), read(&marked).unwrap());
    assert_eq!(by_marks.pulls.pulls[0].max_pull_force_n, by_topic.pulls.pulls[0].max_pull_force_n);
    let rows = |read: &JudgedPulls| read.pulls.pulls[0].trace.as_ref().unwrap().len();
    assert_eq!(rows(&by_marks), rows(&by_topic));
    let without = read(&marked.replace("begin_s = 1.0\n", "")).unwrap_err();
    assert!(without.problem.contains("none of 0 commands") && without.hint.contains("begin_s"), "{without}");
}

#[test]
fn joints_move_the_tool_where_there_is_no_pose() {
    let mapping = MAPPING.replace("pose = \"/pose\"", "joint_states = \"/joint_states\"");
    let folder = folder(&mapping);
    let tip = |q: &[f64; 6]| {
        assert_eq!(q[1..], [2.0, 3.0, 4.0, 5.0, 6.0], "in the order from base to tool");
        [0.0, 0.0, q[0]]
    };
    let read = read_judged_bags(folder.path(), Some(&tip));
    // The folder is the bag: it has the mapping and an .mcap.
    let pull = &read.unwrap().pulls.pulls[0];
    assert!((pull.trace.as_ref().unwrap().displacement_m.last().unwrap() - 5.5e-3).abs() < 1e-9);
    let still = read_judged_bags(folder.path(), None).unwrap();
    assert!(still.pulls.pulls[0].trace.is_none(), "without an arm nobody knows how the tool moved");
    assert!((still.pulls.pulls[0].max_pull_force_n - 8.0).abs() < 1e-12);
}

#[test]
fn images_are_the_last_before_the_pull_and_before_the_rest_mark() {
    let folder = folder(MAPPING);
    let images = BagImages::open(folder.path()).unwrap();
    let name = folder.path().file_stem().unwrap().to_string_lossy().into_owned();
    assert!(images.has(&name) && !images.has("other"));
    let found = images.read(&name).unwrap();
    assert_eq!((found.grip.left.width_px, found.grip.left.height_px), (1, 2));
    assert_eq!(found.grip.left.rgb, [3, 2, 35, 6, 5, 4]);
    assert_eq!(found.rest.right.unwrap().rgb[2], 110);
}

#[test]
fn faults_name_the_file_the_numbers_and_what_to_do() {
    for (mapping, problem, hint) in [
        (
            MAPPING.replace("/wrench\"", "/ft\""),
            "no message on `/ft`; topics: /command (std_msgs/msg/Float64)",
            "topics.wrench",
        ),
        (
            MAPPING.replace("pose = \"/pose\"", "pose = \"/left\""),
            "it is a `sensor_msgs/msg/Image`, `geometry_msgs/msg/PoseStamped` is read",
            "pose",
        ),
        (
            MAPPING.replace("grip_force_n = 40", "grip_force_n = -7"),
            "pulls[0] (`one`): `grip_force_n` is `-7`, it must be a number above 0",
            "columns of pulls.csv",
        ),
        (MAPPING.replace("part = \"gear\"\n", ""), "no pull has the key `part`", "columns"),
        (
            MAPPING.to_string() + "begin_s = 7.0\n",
            "it is from 7 to 1.98 s, the wrench from 0 to 1.98 s",
            "clock",
        ),
        (
            MAPPING.to_string() + "begin_s = 2\nend_s = 1\n",
            "`end_s` is 1, it must be above `begin_s`, 2",
            "schema",
        ),
        (
            MAPPING.to_string() + "max_pull_force_n = 8\n",
            "`max_pull_force_n` is taken from the readings",
            "schema",
        ),
        (MAPPING.replace("tare = true", "along = [0, 0, 2]"), "of length 2, it must be 1", "schema"),
        (MAPPING.replace("no_load_s = [0.2, 0.9]\n", ""), "no reading to take off", "no_load_s"),
        (MAPPING.replace("[0.2, 0.9]", "[0.2, 1.5]"), "reaches 1.5 s, the pull begins at 1 s", "before"),
        (MAPPING.replace("[topics]", "[topic]"), "unknown field `topic`", "schema"),
    ] {
        let e = read(&mapping).unwrap_err();
        assert!(e.to_string().contains(problem) && e.hint.contains(hint), "{e}\nhint: {}", e.hint);
    }
    let folder = folder(MAPPING);
    std::fs::remove_file(folder.path().join(ROSBAG_FILE)).unwrap();
    let e = read_judged_bags(&folder.path().join("one.mcap"), None).unwrap_err();
    assert!(e.to_string().contains("rosbag.toml: a bag needs this file"), "{e}");
    assert!(
        e.problem.contains("/pose (geometry_msgs/msg/PoseStamped)")
            && e.hint.contains("wrench = \"/wrench\""),
        "{e}"
    );
    assert!(is_rosbag(&folder.path().join("one.mcap")) && !is_rosbag(folder.path()));
}

/// The next number of a sequence, Knuth's.
fn next(state: &mut u64) -> u64 {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    *state >> 33
}

#[test]
fn flipped_and_cut_bags_are_errors_or_read_and_never_panic() {
    let folder = folder(MAPPING);
    let path = folder.path().join("one.mcap");
    let whole = std::fs::read(&path).unwrap();
    let good = read_judged_bags(&path, None).unwrap();
    let (mut state, mut refused, mut same, mut cut_refused) = (7, 0, 0, 0);
    let (flips, cuts) = (3000, 1000);
    for round in 0..flips + cuts {
        let mut bytes = whole.clone();
        if round < flips {
            let at = next(&mut state) as usize % bytes.len();
            bytes[at] ^= 1 << (next(&mut state) % 8);
        } else {
            bytes.truncate(next(&mut state) as usize % bytes.len());
        }
        std::fs::write(&path, &bytes).unwrap();
        match read_judged_bags(&path, None) {
            Err(e) => {
                assert!(e.to_string().contains("one.mcap"), "{e}");
                refused += 1;
                cut_refused += usize::from(round >= flips);
            }
            Ok(read) => same += usize::from(read.pulls.pulls[0].trace == good.pulls.pulls[0].trace),
        }
        let _ = BagImages::open(&path).and_then(|images| images.read("one"));
    }
    println!("{refused} of {} damaged bags refused, {same} read as before", flips + cuts);
    assert_eq!(cut_refused, cuts, "every bag that was cut off is found");
    assert_eq!(refused + same, flips + cuts, "chunks have checksums: what is read is what was recorded");
}

/// Damage that a checksum does not catch, because some writers write none.
#[test]
fn messages_without_a_checksum_never_panic() {
    let (mut state, mut errors) = (3, 0);
    let rounds = 20_000;
    for round in 0..rounds {
        let ns = START_NS + round;
        let mut message = match round % 4 {
            0 => wrench(ns, 1.0),
            1 => joints(ns, 1.0),
            2 => image(ns, 1),
            _ => pose(ns, 1.0),
        };
        for _ in 0..1 + next(&mut state) % 4 {
            let at = next(&mut state) as usize % message.len();
            message[at] = next(&mut state) as u8;
        }
        message.truncate(1 + next(&mut state) as usize % (2 * message.len()));
        let read = cdr::Cdr::new(&message).and_then(|mut cdr| {
            cdr.stamp_ns()?;
            match round % 4 {
                1 => cdr::joint_state(&mut cdr).map(drop),
                _ => cdr.vector().map(drop),
            }
        });
        errors += u64::from(read.is_err());
        let _ = images::raw(&message);
    }
    assert!(errors > rounds / 4, "{errors} of {rounds}");
}

#[test]
fn the_example_of_the_page_is_a_mapping() {
    let page =
        std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/interop.md")).unwrap();
    let (_, rest) = page.split_once("```toml\n").unwrap();
    let (text, _) = rest.split_once("```").unwrap();
    let path = Path::new("lab/rosbag.toml");
    let (file, pulls) = mapping::read_mapping(path, text, Path::new("lab")).unwrap();
    assert_eq!(file.topics.pose.as_deref(), Some("/tcp_pose_broadcaster/pose"));
    let names: Vec<&str> = pulls.iter().map(|pull| pull.id.as_str()).collect();
    assert_eq!(names, ["pull_01", "pull_02"]);
    assert_eq!(pulls[1].bag, Path::new("lab/monday/pull_02"));
    assert_eq!(pulls[1].marks.no_load_s, Some([0.5, 1.5]));
    assert_eq!(pulls[0].marks.columns["humidity_pct"].text(), "41");
}
