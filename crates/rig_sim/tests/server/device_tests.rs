//! Gripper, cameras and script ports.

use super::{TIMEOUT, serve};
use gripgen_rig::camera::{CameraClient, SHIPPED_FRAME_LIMITS, decode_jpeg};
use gripgen_rig::gcl::{GclClient, GclCommand, GripState, Query, SHIPPED_LIMITS};
use gripgen_rig::primary::{PrimaryMessage, PrimaryStream};
use gripgen_rig::robot_state::RobotMode;
use gripgen_rig_sim::faults::Fault;
use gripgen_rig_sim::server::ServedRig;
use gripgen_twin::Jaw;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

fn gripper(rig: &ServedRig) -> GclClient {
    GclClient::connect(rig.addresses().gripper, SHIPPED_LIMITS, TIMEOUT).unwrap()
}

fn wait_for(what: &str, is: impl Fn() -> bool) {
    let until = Instant::now() + TIMEOUT;
    while !is() {
        assert!(Instant::now() < until, "{what} never came");
        std::thread::sleep(Duration::from_millis(2));
    }
}

#[test]
fn a_gripper_that_is_left_without_a_word_has_stopped() {
    let rig = serve(1.0);
    let mut client = gripper(&rig);
    client.ask(Query::Position, TIMEOUT).unwrap();
    drop(client);
    wait_for("the stop", || rig.status().grip == GripState::Error);
    let mut client = gripper(&rig);
    let refused = client.run(&GclCommand::Home, TIMEOUT).unwrap_err().to_string();
    assert!(refused.contains("ERR HOME 16"), "{refused}");
    client.run(&GclCommand::AcknowledgeFastStop, TIMEOUT).unwrap();
    client.run(&GclCommand::Home, TIMEOUT).unwrap();
    client.close().unwrap();
}

/// However soon the next one comes: the goodbye of one client is no stop for another.
#[test]
fn a_goodbye_is_no_stop() {
    let rig = serve(1.0);
    for round in 0..40 {
        let mut client = gripper(&rig);
        client.ask(Query::Position, TIMEOUT).unwrap();
        client
            .run(&GclCommand::PartWidthTolerance { tolerance_mm: 1.0 }, TIMEOUT)
            .unwrap_or_else(|e| panic!("round {round}: {e}"));
        client.close().unwrap();
    }
    assert_eq!(rig.status().grip, GripState::Idle);
}

#[test]
fn the_gripper_has_one_client() {
    let rig = serve(1.0);
    let mut first = gripper(&rig);
    first.ask(Query::Position, TIMEOUT).unwrap();
    let mut second = TcpStream::connect(rig.addresses().gripper).unwrap();
    second.set_read_timeout(Some(TIMEOUT)).unwrap();
    assert_eq!(second.read(&mut [0; 16]).unwrap(), 0, "closed at once");
    assert_eq!(first.ask(Query::Position, TIMEOUT).unwrap(), 110.0);
}

#[test]
fn a_grip_is_felt_seen_and_lost() {
    let rig = serve(1.0);
    let camera = CameraClient::connect(rig.addresses().camera_right, "gsr15002.local", TIMEOUT).unwrap();
    let red = || {
        let frame = camera.frame_after(Instant::now(), TIMEOUT).unwrap();
        let image = decode_jpeg(&frame.event.jpeg, &SHIPPED_FRAME_LIMITS).unwrap();
        // A view that turns: the camera's frames stand upright, the plant's images lie.
        assert_eq!((image.width_px, image.height_px), (8, 16));
        image.rgb[0]
    };
    assert_eq!(red(), 21);
    let mut client = gripper(&rig);
    let part_width_mm = Some(20.0);
    let grip = GclCommand::Grip { force_per_jaw_n: 20.0, part_width_mm, speed_mm_s: Some(400.0) };
    client.run(&grip, TIMEOUT).unwrap();
    assert!(rig.status().holds);
    assert_eq!(client.ask(Query::Force, TIMEOUT).unwrap(), 40.0);
    wait_for("the part's image", || red() == 121);
    rig.inject(Fault::PartLost);
    assert!(!rig.status().holds);
    assert_eq!(client.ask(Query::GripState, TIMEOUT).unwrap(), 3.0);
    wait_for("the image of nothing", || red() == 21);
    client.close().unwrap();
}

#[test]
fn cameras_stream_and_freeze() {
    let rig = serve(1.0);
    let at = rig.addresses();
    let cameras =
        [at.camera_left, at.camera_right].map(|at| CameraClient::connect(at, "camera", TIMEOUT).unwrap());
    let stamp = |camera: &CameraClient| {
        camera.frame_after(Instant::now(), TIMEOUT).unwrap().event.device_time_s.unwrap()
    };
    assert!(cameras.iter().all(|camera| stamp(camera) >= 0.0));
    let (began, before) = (Instant::now(), cameras.each_ref().map(CameraClient::frames_seen));
    let seen = || [0, 1].map(|i| cameras[i].frames_seen() - before[i]);
    wait_for("a second of frames", || seen().iter().all(|seen| *seen >= 60));
    // No machine makes them come faster than 60 times a second.
    let most = 62.5 * began.elapsed().as_secs_f64() + 2.0;
    assert!(seen().iter().all(|seen| *seen as f64 <= most), "{:?} of {most}", seen());

    rig.inject(Fault::Freeze(Jaw::Left));
    stamp(&cameras[0]);
    let (frozen_s, right_s) = (stamp(&cameras[0]), stamp(&cameras[1]));
    wait_for("the other camera", || stamp(&cameras[1]) > right_s + 0.15);
    assert_eq!(stamp(&cameras[0]), frozen_s, "frames still come, their stamp is the same");
    rig.inject(Fault::Thaw(Jaw::Left));
    wait_for("a camera that sees again", || stamp(&cameras[0]) > frozen_s + 0.15);
}

/// A program with a word that nobody knows, sent to each port that takes programs, is answered on the primary one.
#[test]
fn every_script_port_takes_programs_and_the_primary_one_tells() {
    let rig = serve(1.0);
    let at = rig.addresses();
    let mut primary = TcpStream::connect(at.primary).unwrap();
    primary.set_read_timeout(Some(TIMEOUT)).unwrap();
    let (mut stream, mut buffer) = (PrimaryStream::default(), [0; 4096]);
    let mut next = || loop {
        if let Some(message) = stream.next_message().unwrap() {
            break message;
        }
        let n = primary.read(&mut buffer).unwrap();
        assert!(n > 0, "closed");
        stream.push(&buffer[..n]);
    };
    assert!(matches!(next(), PrimaryMessage::Version { .. }));
    for (name, port) in [("one", at.primary), ("two", at.secondary), ("three", at.real_time)] {
        let script = format!("def program():\n  word_{name}(1)\nend\n");
        TcpStream::connect(port).unwrap().write_all(script.as_bytes()).unwrap();
        let PrimaryMessage::ErrorCode { text, .. } = next() else { panic!("{name}") };
        assert_eq!(text, format!("line 2: `word_{name}` is no function that is known"));
    }
}

/// The next state of the robot: the controller's clock in microseconds, seven flags, and the mode.
fn next_mode(stream: &mut TcpStream) -> (u64, [bool; 7], RobotMode) {
    loop {
        let mut size = [0; 4];
        stream.read_exact(&mut size).unwrap();
        let mut packet = vec![0; u32::from_be_bytes(size) as usize - 4];
        stream.read_exact(&mut packet).unwrap();
        // A robot state is its type and one sub-packet: size, type, content.
        if packet[0] == 16 {
            assert_eq!((packet.len(), packet[5]), (48, 0));
            let flags = std::array::from_fn(|i| packet[14 + i] == 1);
            let ticks = u64::from_be_bytes(packet[6..14].try_into().unwrap());
            return (ticks, flags, RobotMode::from_number(i32::from(packet[21] as i8)).unwrap());
        }
    }
}

#[test]
fn the_mode_of_the_robot_comes_ten_times_a_second() {
    let rig = serve(1.0);
    let at = rig.addresses();
    let mut clients = [at.primary, at.secondary].map(|address| TcpStream::connect(address).unwrap());
    for client in &mut clients {
        client.set_read_timeout(Some(TIMEOUT)).unwrap();
        let (before, flags, mode) = next_mode(client);
        assert_eq!(mode, RobotMode::Running);
        // Real, enabled and powered; neither stopped nor running a program.
        assert_eq!(flags, [true, true, true, false, false, false, false]);
        // Packets are a tenth of a second of the controller's clock apart.
        let passed = next_mode(client).0 - before;
        assert!((passed + 5) % 100_000 < 10, "{passed} us");
    }
    let real_time = TcpStream::connect(at.real_time).unwrap();
    real_time.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    assert!((&real_time).read(&mut [0; 16]).is_err(), "the real-time port is silent");

    rig.inject(Fault::EmergencyStop);
    for client in &mut clients {
        let (_, flags, mode) = loop {
            let next = next_mode(client);
            if next.1[3] {
                break next;
            }
        };
        assert!(mode == RobotMode::PowerOff && !flags[2], "{mode:?}");
    }
}
