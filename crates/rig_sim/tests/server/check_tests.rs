//! `rig check` through a link that disturbs one thing: it says so, and leaves the devices as they were.

use super::serve;
use gripgen_rig::experiment::RigConfig;
use gripgen_rig::experiment::check::{CheckLine, check};
use gripgen_rig::rtde::{Kind, RtdeClient, SessionPlan, encode_frame};
use gripgen_rig_sim::server::{RigAddresses, ServedRig};
use gripgen_twin::config::Document;
use std::io::{BufRead, BufReader, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};

/// What a link passes on instead of a piece.
enum Passed {
    Bytes(Vec<u8>),
    Nothing,
    Closed,
}

/// Relays every connection to `device`; what comes from there is cut into pieces by `next` and changed by `change`, which knows the
/// number of the piece.
fn link(
    device: SocketAddr,
    next: fn(&mut BufReader<TcpStream>) -> Option<Vec<u8>>,
    change: impl Fn(usize, Vec<u8>) -> Passed + Clone + Send + 'static,
) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        for client in listener.incoming().map_while(Result::ok) {
            let Ok(device) = TcpStream::connect(device) else { return };
            let (mut up, mut from_client) = (device.try_clone().unwrap(), client.try_clone().unwrap());
            std::thread::spawn(move || {
                let _ = std::io::copy(&mut from_client, &mut up);
                let _ = up.shutdown(std::net::Shutdown::Write);
            });
            let change = change.clone();
            std::thread::spawn(move || {
                let (mut down, mut device) = (client, BufReader::new(device));
                for number in 0.. {
                    let Some(piece) = next(&mut device) else { break };
                    let sent = match change(number, piece) {
                        Passed::Bytes(bytes) => down.write_all(&bytes).is_ok(),
                        Passed::Nothing => true,
                        Passed::Closed => false,
                    };
                    if !sent {
                        break;
                    }
                }
                let _ = down.shutdown(std::net::Shutdown::Both);
                let _ = device.get_ref().shutdown(std::net::Shutdown::Both);
            });
        }
    });
    address
}

/// A frame of RTDE with its header.
fn frame(device: &mut BufReader<TcpStream>) -> Option<Vec<u8>> {
    let mut bytes = vec![0; 3];
    device.read_exact(&mut bytes).ok()?;
    bytes.resize(usize::from(u16::from_be_bytes([bytes[0], bytes[1]])), 0);
    device.read_exact(&mut bytes[3..]).ok()?;
    Some(bytes)
}

/// A line with its end.
fn text(device: &mut BufReader<TcpStream>) -> Option<Vec<u8>> {
    let mut bytes = Vec::new();
    (device.read_until(b'\n', &mut bytes).ok()? > 0).then_some(bytes)
}

fn byte(device: &mut BufReader<TcpStream>) -> Option<Vec<u8>> {
    let mut byte = [0];
    device.read_exact(&mut byte).ok()?;
    Some(byte.to_vec())
}

/// The rig's file; `patience` 1 watches for a silence of a quarter of a second.
fn config(at: RigAddresses, patience: f64) -> RigConfig {
    let shipped = include_str!("../../../../assets/configs/rig.toml");
    let mut document = Document::parse("rig.toml", shipped).unwrap();
    for (key, port) in [
        ("robot.rtde_port", at.rtde.port()),
        ("robot.dashboard_port", at.dashboard.port()),
        ("robot.primary_port", at.primary.port()),
        ("gripper.port", at.gripper.port()),
        ("cameras.left.port", at.camera_left.port()),
        ("cameras.right.port", at.camera_right.port()),
    ] {
        document.set(key, &port.to_string()).unwrap();
    }
    document.set("limits.patience", &format!("{patience:?}")).unwrap();
    for key in ["cameras.left.size_px", "cameras.right.size_px"] {
        document.set(key, "[16, 8]").unwrap();
    }
    RigConfig::read(&document).unwrap()
}

fn lines(at: RigAddresses, patience: f64) -> Vec<CheckLine> {
    let mut lines = Vec::new();
    check(&config(at, patience), |line| lines.push(line));
    lines
}

/// A rig of which nothing answers.
fn nowhere() -> RigAddresses {
    RigAddresses::any_ports()
}

fn of<'a>(lines: &'a [CheckLine], what: &str) -> &'a CheckLine {
    lines.iter().find(|line| line.what == what).unwrap_or_else(|| panic!("{what}: {lines:?}"))
}

/// The line of RTDE, through a link that changes data frames, counted from 0.
fn watched(
    rig: &ServedRig,
    patience: f64,
    change: impl Fn(usize, Vec<u8>) -> Passed + Clone + Send + 'static,
) -> CheckLine {
    // Answers of the set-up come before: four of them, and the first data may overtake the last one.
    let rtde = link(rig.addresses().rtde, frame, move |number, bytes| match bytes[2] {
        b'U' => change(number, bytes),
        _ => Passed::Bytes(bytes),
    });
    let lines = lines(RigAddresses { rtde, ..nowhere() }, patience);
    of(&lines, "RTDE").clone()
}

fn with_time(mut bytes: Vec<u8>, time_s: f64) -> Passed {
    // Length, kind, number of the recipe; the clock is the first field.
    bytes[4..12].copy_from_slice(&time_s.to_be_bytes());
    Passed::Bytes(bytes)
}

/// What is wrong with the bytes ends the connection, whatever this machine does in addition; the reason is said.
#[test]
fn a_stream_that_ends_while_it_is_watched_is_bad_with_its_reason() {
    let rig = serve(1.0);
    let at_50 = |instead: fn(Vec<u8>) -> Passed| {
        watched(
            &rig,
            20.0,
            move |number, bytes| if number == 50 { instead(bytes) } else { Passed::Bytes(bytes) },
        )
    };
    for (name, line, reason) in [
        ("closed", at_50(|_| Passed::Closed), "the controller closed the connection"),
        (
            "paused",
            at_50(|_| Passed::Bytes(encode_frame(Kind::Pause, &[1]).unwrap())),
            "Pause came while Data was",
        ),
        ("unknown kind", at_50(|_| Passed::Bytes(vec![0, 6, 99, 1, 2, 3])), "the unknown kind 99"),
        (
            "other recipe",
            at_50(|mut bytes| {
                bytes[3] = 7;
                Passed::Bytes(bytes)
            }),
            "a data frame of recipe 7 with 280 bytes does not fit the output recipe 1 of 280",
        ),
        (
            "shorter",
            at_50(|bytes| Passed::Bytes(encode_frame(Kind::Data, &bytes[3..40]).unwrap())),
            "with 36 bytes does not fit the output recipe 1 of 280",
        ),
        ("clock back", at_50(|bytes| with_time(bytes, 1.0)), "back to 1.000 s: it has restarted"),
        ("no time", at_50(|bytes| with_time(bytes, f64::NAN)), "back to NaN s"),
    ] {
        assert!(!line.ok && line.found.starts_with("the connection ended after "), "{name}: {line:?}");
        assert!(line.found.contains(reason) && line.found.contains(" readings"), "{name}: {line:?}");
    }
}

/// What only a clock tells: nothing came, nothing new came, much is missing.
#[test]
fn a_stream_that_stands_still_while_it_is_watched_is_bad() {
    let rig = serve(1.0);
    let one =
        watched(&rig, 1.0, |number, bytes| if number < 6 { Passed::Bytes(bytes) } else { Passed::Nothing });
    assert!(!one.ok, "{one:?}");
    assert!(one.found.contains("no reading came for") || one.found.contains("nothing came for"), "{one:?}");
    let frozen = watched(&rig, 1.0, |_, bytes| with_time(bytes, 77.0));
    assert!(!frozen.ok && frozen.found.starts_with("its clock stood at 77.000 s for "), "{frozen:?}");
    let jumped = watched(&rig, 20.0, |number, bytes| {
        let time_s = f64::from_be_bytes(bytes[4..12].try_into().unwrap());
        with_time(bytes, if number > 60 { time_s + 1000.0 } else { time_s })
    });
    assert!(!jumped.ok && jumped.found.contains("between two readings, 0.02 s are allowed"), "{jumped:?}");
    let few = watched(
        &rig,
        20.0,
        |number, bytes| {
            if number % 50 == 0 { Passed::Bytes(bytes) } else { Passed::Nothing }
        },
    );
    assert!(!few.ok && few.found.contains("between two readings"), "{few:?}");
}

/// Inputs that another client has are named, and those of a check are free again.
#[test]
fn inputs_of_somebody_else_are_named() {
    let rig = serve(1.0);
    let all = lines(rig.addresses(), 20.0);
    assert!(all.iter().all(|line| line.ok), "{all:#?}");
    let rtde = RigAddresses { rtde: rig.addresses().rtde, ..nowhere() };
    for lines in [all, lines(rtde, 20.0)] {
        let registers = &of(&lines, "registers").found;
        assert_eq!(registers, "input_int_register_24 and input_int_register_25 are free");
    }
    let plan = SessionPlan {
        outputs: vec!["timestamp".into()],
        frequency_hz: 500.0,
        inputs: vec![vec!["input_int_register_25".into()]],
    };
    let other = RtdeClient::connect(rig.addresses().rtde, &plan, super::TIMEOUT).unwrap();
    let taken = lines(rtde, 20.0);
    let registers = of(&taken, "registers");
    assert!(!registers.ok && registers.found.contains("input_int_register_25"), "{registers:?}");
    assert!(of(&taken, "RTDE").ok, "{taken:?}");
    drop(other);
}

/// What cannot be read is shown, nothing is set, and the gripper is no emergency afterwards.
#[test]
fn a_gripper_is_left_as_it_was_found() {
    let rig = serve(1.0);
    let through = |change: fn(String) -> String| {
        let gripper = link(rig.addresses().gripper, text, move |_, bytes| {
            Passed::Bytes(change(String::from_utf8(bytes).unwrap()).into_bytes())
        });
        of(&lines(RigAddresses { gripper, ..nowhere() }, 1.0), "gripper").clone()
    };
    type Change = fn(String) -> String;
    let cases: [(Change, &str); 4] = [
        (
            |line| if line.starts_with("POS") { line.replace('.', ",") } else { line },
            "the gripper answers `POS=",
        ),
        (|line| line.to_lowercase(), "the gripper answers `gripstate=0` to GRIPSTATE?, which cannot be read"),
        (|_| "?\n".into(), "the gripper answers `?` to GRIPSTATE?, which cannot be read"),
        (|line| line.replace("GRIPSTATE=0", "GRIPSTATE=12"), "unknown state 12, jaws at "),
    ];
    for (change, words) in cases {
        let line = through(change);
        assert!(!line.ok && line.found.contains(words), "{words}: {line:?}");
        let after = lines(RigAddresses { gripper: rig.addresses().gripper, ..nowhere() }, 20.0);
        assert!(of(&after, "gripper").found.starts_with("idle, jaws at "), "{words}: {after:?}");
    }
}

/// Answers of the dashboard and the primary interface that are none.
#[test]
fn answers_that_are_none_are_shown() {
    let rig = serve(1.0);
    let dashboard = link(rig.addresses().dashboard, text, |number, bytes| match number {
        0 => Passed::Bytes(bytes),
        _ => Passed::Bytes(b"could not understand: 'is in remote control'\n".to_vec()),
    });
    let primary = link(rig.addresses().primary, byte, |_, _| Passed::Closed);
    let found = lines(RigAddresses { dashboard, primary, ..nowhere() }, 1.0);
    for what in ["dashboard", "controller", "control"] {
        let line = of(&found, what);
        assert!(
            !line.ok && line.found.contains("`could not understand: 'is in remote control'`"),
            "{line:?}"
        );
    }
    let line = of(&found, "primary interface");
    assert!(!line.ok && line.found.contains("the connection ended before its version came: "), "{line:?}");
}

/// The answer to the start is missing, and data flow: the check ends within its two seconds.
#[test]
fn a_start_without_an_answer_is_said_and_ends() {
    let rig = serve(1.0);
    let rtde = link(rig.addresses().rtde, frame, |_, bytes| match bytes[2] {
        b'S' => Passed::Nothing,
        _ => Passed::Bytes(bytes),
    });
    let found = lines(RigAddresses { rtde, ..nowhere() }, 1.0);
    let line = of(&found, "RTDE");
    assert!(!line.ok && line.found.contains("no answer to `start` came for 2.0"), "{line:?}");
}
