//! The client against a small dashboard on loopback, which answers late, refuses, or goes away.

use super::*;
use crate::link::testing::{TIMEOUT, device};
use crate::robot_state::RobotMode;
use std::io::{BufRead, BufReader, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

/// A dashboard that answers each line as `with` says, after so many milliseconds; without an answer it goes away.
fn dashboard(
    greeting: &'static str,
    with: impl Fn(&str) -> Option<(u64, &'static str)> + Send + 'static,
) -> SocketAddr {
    let (address, _) = device(move |stream| {
        say(&stream, greeting);
        for line in BufReader::new(&stream).lines().map_while(Result::ok) {
            let Some((wait_ms, answer)) = with(&line) else { return };
            std::thread::sleep(Duration::from_millis(wait_ms));
            say(&stream, answer);
        }
    });
    address
}

/// In two pieces.
fn say(mut stream: &TcpStream, line: &str) {
    let line = format!("{line}\n");
    let (half, rest) = line.split_at(line.len() / 2);
    let _ = stream.write_all(half.as_bytes());
    std::thread::sleep(Duration::from_millis(2));
    let _ = stream.write_all(rest.as_bytes());
}

#[test]
fn commands_are_answered_one_by_one() {
    let address = dashboard(GREETING, |line| match line {
        "robotmode" => Some((0, "Robotmode: IDLE")),
        "brake release" => Some((0, "Brake releasing")),
        "power on" => Some((0, "Failed to execute: power on")),
        _ => None,
    });
    let mut client = DashboardClient::connect(address, TIMEOUT).unwrap();
    assert_eq!(client.greeting(), GREETING);
    let reply = client.command(DashboardCommand::RobotMode, TIMEOUT).unwrap();
    assert_eq!(reply, DashboardReply::RobotMode(RobotMode::Idle));
    assert_eq!(client.command(DashboardCommand::BrakeRelease, TIMEOUT).unwrap(), DashboardReply::Done);
    let e = client.command(DashboardCommand::PowerOn, TIMEOUT).unwrap_err();
    assert!(matches!(&e, DashboardError::Reply(r) if r.line == "Failed to execute: power on"), "{e}");
    assert_eq!(client.command_line(DashboardCommand::RobotMode, TIMEOUT).unwrap(), "Robotmode: IDLE");
    let e = client.command(DashboardCommand::Stop, TIMEOUT).unwrap_err();
    assert!(matches!(e, DashboardError::Link(DashboardLinkError::Closed { .. })), "{e}");
}

#[test]
fn a_late_answer_is_never_taken_for_the_next() {
    let address = dashboard(GREETING, |line| match line {
        "robotmode" => Some((200, "Robotmode: IDLE")),
        _ => Some((0, "false")),
    });
    let mut client = DashboardClient::connect(address, TIMEOUT).unwrap();
    let e = client.command(DashboardCommand::RobotMode, Duration::from_millis(40)).unwrap_err();
    let DashboardError::Link(DashboardLinkError::Timeout { awaited, waited_s, limit_s, .. }) = e else {
        panic!("{e}")
    };
    assert!(awaited == "robotmode" && limit_s == 0.04 && (0.04..60.0).contains(&waited_s), "{waited_s}");
    let reply = client.command_line(DashboardCommand::IsInRemoteControl, TIMEOUT).unwrap();
    assert_eq!(reply, "false");
}

#[test]
fn what_is_no_dashboard_is_said() {
    let other = dashboard("SSH-2.0-OpenSSH_8.9", |_| None);
    let e = DashboardClient::connect(other, TIMEOUT).err().unwrap();
    assert!(e.to_string().contains("the first line is `SSH-2.0-OpenSSH_8.9`"), "{e}");
    // One that takes the connection and says nothing.
    let mute = TcpListener::bind("127.0.0.1:0").unwrap();
    let started = Instant::now();
    let limit = Duration::from_millis(80);
    let e = DashboardClient::connect(mute.local_addr().unwrap(), limit).err().unwrap();
    assert!(matches!(e, DashboardLinkError::Timeout { limit_s: 0.08, .. }), "{e}");
    assert!(started.elapsed() >= limit && started.elapsed() < TIMEOUT);
}
