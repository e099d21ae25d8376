//! The client against a small gripper on loopback, which speaks in pieces, refuses, falls silent, or goes away.

use super::*;
use crate::link::testing::{TIMEOUT, device, rest};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

const SHORT: Duration = Duration::from_millis(60);

struct Gripper {
    lines: BufReader<TcpStream>,
}

impl Gripper {
    /// Waits for a line, and answers in pieces.
    fn expect(&mut self, line: &str, answer: &[&str]) {
        let mut got = String::new();
        self.lines.read_line(&mut got).unwrap();
        assert_eq!(got.trim_end(), line);
        answer.iter().for_each(|piece| self.say(piece));
    }

    fn say(&mut self, piece: &str) {
        self.lines.get_mut().write_all(piece.as_bytes()).unwrap();
        std::thread::sleep(Duration::from_millis(5));
    }

    /// All that comes until the client goes.
    fn rest(&mut self) -> String {
        rest(&mut self.lines)
    }
}

/// A gripper that does `with`; what it finds wrong comes out of the handle.
fn gripper<T: Send + 'static>(
    with: impl FnOnce(&mut Gripper) -> T + Send + 'static,
) -> (GclClient, JoinHandle<T>) {
    let (address, device) = device(|stream| with(&mut Gripper { lines: BufReader::new(stream) }));
    (GclClient::connect(address, SHIPPED_LIMITS, TIMEOUT).unwrap(), device)
}

const GRIP: GclCommand = GclCommand::Grip { force_per_jaw_n: 20.0, part_width_mm: None, speed_mm_s: None };

#[test]
fn a_motion_ends_with_fin_and_all_lines_are_in_the_log() {
    let (mut client, device) = gripper(|gripper| {
        gripper.expect("FSACK()", &["ACK FSACK\n"]);
        gripper.expect("GRIP(40)", &["ACK GR", "IP\n@FORCE=3.5\n"]);
        let before_fin = Instant::now();
        gripper.say("@FORCE=39.5\nFIN GRIP\n");
        gripper.expect("FORCE?", &["@FORCE=1\nFOR", "CE=39.25\n"]);
        before_fin
    });
    let started = Instant::now();
    client.run(&GclCommand::AcknowledgeFastStop, TIMEOUT).unwrap();
    client.run(&GRIP, TIMEOUT).unwrap();
    assert_eq!(client.ask(Query::Force, TIMEOUT).unwrap(), 39.25);
    let before_fin = device.join().unwrap();
    let log = client.take_log();
    let lines: Vec<(bool, &str)> = log.iter().map(|l| (l.sent, l.line.as_str())).collect();
    let wanted = [
        (true, "FSACK()"),
        (false, "ACK FSACK"),
        (true, "GRIP(40)"),
        (false, "ACK GRIP"),
        (false, "@FORCE=3.5"),
        (false, "@FORCE=39.5"),
        (false, "FIN GRIP"),
        (true, "FORCE?"),
        (false, "@FORCE=1"),
        (false, "FORCE=39.25"),
    ];
    assert_eq!(lines, wanted);
    assert!(log.is_sorted_by_key(|l| l.at) && log[0].at >= started);
    assert!(log[2].at <= before_fin && before_fin <= log[6].at, "the stamps are those of the lines");
    assert!(client.take_log().is_empty());
    // The same through the channel, up to the end of the connection.
    let events: Vec<_> = client.events().iter().collect();
    assert_eq!(events.len(), 7);
    assert_eq!((events[4].event.clone(), events[4].at), (GclEvent::Finished("GRIP".into()), log[6].at));
}

#[test]
fn an_error_carries_its_status_and_its_meaning() {
    let (mut client, device) = gripper(|gripper| {
        gripper.expect("GRIP(40)", &["ACK GRIP\n", "ERR GRIP 18 \"no part\"\n"]);
        gripper.expect("POS?", &["ERR POS? 14\n"]);
        gripper.expect("HOME()", &["ERR 16\n"]);
        gripper.expect("FSACK()", &["ERR GRIP 19\n", "ACK FSACK\n"]);
        gripper.rest()
    });
    let GclRunError::Failed { command, status, meaning, line } = client.run(&GRIP, TIMEOUT).unwrap_err()
    else {
        panic!()
    };
    assert_eq!((command, status, line.as_str()), ("GRIP", Some(18), "ERR GRIP 18 \"no part\""));
    assert!(meaning.contains("no part"));
    let e = client.ask(Query::Position, TIMEOUT).unwrap_err();
    assert_eq!(e.to_string(), "the gripper answers `ERR POS? 14` to POS: unknown command");
    let e = client.run(&GclCommand::Home, TIMEOUT).unwrap_err();
    assert!(matches!(e, GclRunError::Failed { status: Some(16), .. }), "{e}");
    // The failure of another command is none of this one.
    client.run(&GclCommand::AcknowledgeFastStop, TIMEOUT).unwrap();
    // What is refused here is not sent.
    let too_much = GclCommand::Grip { force_per_jaw_n: 45.0, part_width_mm: None, speed_mm_s: None };
    let e = client.run(&too_much, TIMEOUT).unwrap_err();
    assert!(e.to_string().contains("90 N for the gripper"), "{e}");
    drop(client);
    assert_eq!(device.join().unwrap(), "");
}

#[test]
fn a_setting_is_repeated_by_the_gripper() {
    let (mut client, device) = gripper(|gripper| {
        gripper.expect("VERBOSE=1", &["VERBOSE=1\n"]);
        gripper.expect("PWT=2.5", &["PWT=2.50\n"]);
        gripper.expect("PWT=50", &["PWT=10\n"]);
    });
    let tolerance = |tolerance_mm| GclCommand::PartWidthTolerance { tolerance_mm };
    client.run(&GclCommand::Verbose(true), TIMEOUT).unwrap();
    client.run(&tolerance(2.5), TIMEOUT).unwrap();
    let e = client.run(&tolerance(50.0), TIMEOUT).unwrap_err();
    assert_eq!(e.to_string(), "PWT was set to 50, the gripper takes 10");
    device.join().unwrap();
}

#[test]
fn an_answer_in_time_or_both_numbers() {
    let (mut client, device) = gripper(|gripper| {
        gripper.expect("HOME()", &["ACK HOME\n"]);
        // Late: the client has given up on it, and asks something else.
        gripper.expect("POS?", &["FIN HOME\n", "POS=110\n"]);
        gripper.expect("SPEED?", &[]);
        gripper.expect("SPEED?", &["SPEED=5\n", "SPEED=0\n"]);
        gripper.rest()
    });
    let e = client.run(&GclCommand::Home, SHORT).unwrap_err();
    let GclRunError::Timeout { awaited, waited_s, limit_s } = &e else { panic!("{e}") };
    assert_eq!((awaited.as_str(), *limit_s), ("FIN HOME", 0.06));
    assert!((0.06..60.0).contains(waited_s) && e.to_string().contains("0.060 s are allowed"), "{e}");
    assert_eq!(client.ask(Query::Position, TIMEOUT).unwrap(), 110.0);
    client.wait_for(&GclCommand::Home, TIMEOUT).unwrap();
    // Nothing is numbered: the late answer comes first.
    assert!(client.ask(Query::Speed, SHORT).is_err());
    assert_eq!(client.ask(Query::Speed, TIMEOUT).unwrap(), 5.0);
    // Silence is no end.
    std::thread::sleep(Duration::from_millis(200));
    assert!(client.ended().is_none());
    drop(client);
    assert_eq!(device.join().unwrap(), "");
}

#[test]
fn a_gripper_that_goes_away_ends_what_waits() {
    let (mut client, device) = gripper(|gripper| gripper.expect("GRIP(40)", &["ACK GRIP\n"]));
    let e = client.run(&GRIP, TIMEOUT).unwrap_err();
    assert!(matches!(e, GclRunError::Link(GclLinkError::Closed { .. })), "{e}");
    device.join().unwrap();
    assert!(matches!(client.ended(), Some(GclLinkError::Closed { .. })));
    assert!(matches!(
        client.send(&GclCommand::FastStop),
        Err(GclSendError::Link(GclLinkError::Closed { .. }))
    ));
    assert_eq!(client.events().iter().count(), 1);
    // One that is no gripper.
    let (client, device) = gripper(|gripper| gripper.say(&"x".repeat(5000)));
    assert_eq!(client.events().iter().count(), 0);
    assert!(matches!(client.ended(), Some(GclLinkError::Session { .. })), "{:?}", client.ended());
    device.join().unwrap();
}

#[test]
fn close_says_goodbye_and_drop_does_not() {
    let (client, device) = gripper(|gripper| {
        gripper.expect("BYE()", &["ACK BYE\n"]);
        gripper.rest()
    });
    client.close().unwrap();
    assert_eq!(device.join().unwrap(), "");
    let (client, device) = gripper(Gripper::rest);
    drop(client);
    assert_eq!(device.join().unwrap(), "", "a gripper takes the cut for a fast stop");
    // Without an answer the connection is closed all the same, and soon.
    let (client, device) = gripper(Gripper::rest);
    let started = Instant::now();
    let e = client.close().unwrap_err();
    assert!(matches!(e, GclRunError::Timeout { .. }) && started.elapsed() < TIMEOUT, "{e}");
    assert_eq!(device.join().unwrap(), "BYE()\n");
}

/// What cannot be read is shown as it came.
#[test]
fn an_answer_that_cannot_be_read_is_shown() {
    let (mut client, device) = gripper(|gripper| {
        gripper.expect("POS?", &["@FORCE=1\n", "POS=110,0\n"]);
        gripper.expect("GRIPSTATE?", &["gripstate=0\n"]);
        gripper.expect("BYE()", &["ACK BYE\n"]);
        gripper.rest()
    });
    for (query, words) in [
        (Query::Position, "the gripper answers `POS=110,0` to POS?, which cannot be read"),
        (Query::GripState, "the gripper answers `gripstate=0` to GRIPSTATE?, which cannot be read"),
    ] {
        assert_eq!(client.ask(query, TIMEOUT).unwrap_err().to_string(), words);
    }
    client.close().unwrap();
    assert_eq!(device.join().unwrap(), "");
}
