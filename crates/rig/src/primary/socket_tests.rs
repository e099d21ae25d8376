//! The client against a small controller on loopback, which finds a program wrong, or goes away.

use super::*;
use crate::link::testing::{TIMEOUT, device, rest};
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::{Duration, Instant};

/// The text up to and with `end`.
fn script(stream: &mut TcpStream, end: &str) -> String {
    let mut text = Vec::new();
    let mut byte = [0];
    while !text.ends_with(end.as_bytes()) && stream.read(&mut byte).unwrap() == 1 {
        text.push(byte[0]);
    }
    String::from_utf8(text).unwrap()
}

#[test]
fn a_program_that_is_wrong_comes_back_with_its_line() {
    let (address, controller) = device(|mut stream| {
        let sent = script(&mut stream, "end\n");
        let packet = [&[0, 0, 0, 28, 20][..], &[0; 8], &[254, 10, 0, 0, 0, 2, 0, 0, 0, 3], b"wrong"].concat();
        let (half, rest) = packet.split_at(11);
        stream.write_all(half).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        stream.write_all(rest).unwrap();
        [sent, script(&mut stream, "end\n")]
    });
    let mut client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    let before = Instant::now();
    client.send_script("def pull():\n  forward()\nend").unwrap();
    let wrong = client.messages().recv_timeout(TIMEOUT).unwrap();
    assert!(wrong.at >= before + Duration::from_millis(20), "stamped when it was whole");
    assert_eq!(wrong.event.to_string(), "line 2, column 3: wrong");
    client.send_script("def pull():\nend\n").unwrap();
    let sent = controller.join().unwrap();
    assert_eq!(sent, ["def pull():\n  forward()\nend\n", "def pull():\nend\n"], "one end of the last line");
    // The controller has gone.
    assert!(client.messages().recv_timeout(TIMEOUT).is_err());
    assert!(matches!(client.ended(), Some(PrimaryLinkError::Closed { .. })));
    let e = client.send_script("def pull():\nend\n").unwrap_err();
    assert!(matches!(e, ScriptError::Link(PrimaryLinkError::Closed { .. })), "{e}");
}

#[test]
fn what_is_no_program_is_not_sent() {
    let (address, controller) = device(rest);
    let mut client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    assert!(matches!(client.send_script(" \n\n"), Err(ScriptError::Empty)));
    let e = client.send_script("stopl(1)\n\0\n").unwrap_err();
    assert_eq!(e.to_string(), "the program has a zero byte at byte 9 of 11");
    drop(client);
    assert_eq!(controller.join().unwrap(), "");
}

#[test]
fn what_is_no_packet_ends_the_connection() {
    let (address, _) = device(|mut stream| stream.write_all(&[0, 0, 0, 1, 20]).unwrap());
    let client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    assert!(client.messages().recv_timeout(TIMEOUT).is_err());
    let e = client.ended().unwrap();
    assert!(matches!(e, PrimaryLinkError::Session { .. }) && e.to_string().contains("has 1 bytes"), "{e}");
}
