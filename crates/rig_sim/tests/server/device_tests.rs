//! Gripper, cameras and script ports.

use super::{TIMEOUT, serve};
use gripgen_rig::camera::{CameraClient, SHIPPED_FRAME_LIMITS, decode_jpeg};
use gripgen_rig::gcl::{GclClient, GclCommand, GripState, Query, SHIPPED_LIMITS};
use gripgen_rig::primary::{PrimaryClient, PrimaryEvent, PrimaryStream, RobotMessage};
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
    let before = cameras.each_ref().map(CameraClient::frames_seen);
    std::thread::sleep(Duration::from_secs(2));
    let seen = [0, 1].map(|i| cameras[i].frames_seen() - before[i]);
    println!("{seen:?} frames in 2 s");
    assert!(seen.iter().all(|seen| (60..=125).contains(seen)), "{seen:?}");

    rig.inject(Fault::Freeze(Jaw::Left));
    stamp(&cameras[0]);
    let (frozen_s, right_s) = (stamp(&cameras[0]), stamp(&cameras[1]));
    std::thread::sleep(Duration::from_millis(200));
    assert_eq!(stamp(&cameras[0]), frozen_s, "frames still come, their stamp is the same");
    assert!(stamp(&cameras[1]) > right_s + 0.15, "the other camera goes on");
    rig.inject(Fault::Thaw(Jaw::Left));
    stamp(&cameras[0]);
    assert!(stamp(&cameras[0]) > frozen_s + 0.15);
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
        if let Some(PrimaryEvent::Message { message, .. }) = stream.next_event().unwrap() {
            break message;
        }
        let n = primary.read(&mut buffer).unwrap();
        assert!(n > 0, "closed");
        stream.push(&buffer[..n]);
    };
    assert!(matches!(next(), RobotMessage::Version(_)));
    for (name, port) in [("one", at.primary), ("two", at.secondary), ("three", at.real_time)] {
        let script = format!("def program():\n  word_{name}(1)\nend\n");
        TcpStream::connect(port).unwrap().write_all(script.as_bytes()).unwrap();
        let RobotMessage::ErrorCode(error) = next() else { panic!("{name}") };
        assert_eq!(error.text, format!("line 2: `word_{name}` is no function that is known"));
    }
}

#[test]
fn the_mode_of_the_robot_comes_ten_times_a_second() {
    let rig = serve(1.0);
    let at = rig.addresses();
    let connect = |address| PrimaryClient::connect(address, TIMEOUT).unwrap();
    let clients = [connect(at.primary), connect(at.secondary)];
    let newest = |client: &PrimaryClient| client.newest_mode().map(|mode| mode.event);
    wait_for("the first mode", || clients.iter().all(|client| newest(client).is_some()));
    for client in &clients {
        let mode = newest(client).unwrap();
        assert_eq!(mode.mode(), Some(RobotMode::Running));
        assert!(mode.power_on && !mode.emergency_stopped && !mode.program_running, "{mode:?}");
        // Packets are a tenth of a second of the controller's clock apart.
        let before = mode.device_ticks;
        wait_for("the next mode", || newest(client).unwrap().device_ticks > before);
        let next = newest(client).unwrap().device_ticks - before;
        assert!((next + 5) % 100_000 < 10, "{next} us");
    }
    let real_time = TcpStream::connect(at.real_time).unwrap();
    real_time.set_read_timeout(Some(Duration::from_millis(300))).unwrap();
    assert!((&real_time).read(&mut [0; 16]).is_err(), "the real-time port is silent");

    rig.inject(Fault::EmergencyStop);
    for client in &clients {
        wait_for("the stop", || newest(client).unwrap().emergency_stopped);
        let mode = newest(client).unwrap();
        assert!(mode.mode() == Some(RobotMode::PowerOff) && !mode.power_on, "{mode:?}");
        // The mode is an event where it changes, beside the version and the safety message.
        let modes = client.events().try_iter().filter(|e| matches!(e.event, PrimaryEvent::RobotMode(_)));
        assert_eq!((modes.count(), client.skipped(), client.events_lost()), (2, 0, 0));
    }
}
