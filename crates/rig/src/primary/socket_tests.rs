//! The client against a small controller on loopback, which runs a program, finds it wrong, or goes away.

use super::*;
use crate::link::Stamped;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

const TIMEOUT: Duration = Duration::from_secs(5);
const HEADER: MessageHeader = MessageHeader { device_ticks: 9, source: -2 };

fn controller(with: impl FnOnce(TcpStream) + Send + 'static) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || with(listener.accept().unwrap().0));
    address
}

/// The text up to and with `end`.
fn script(stream: &mut TcpStream, end: &str) -> String {
    let mut text = Vec::new();
    let mut byte = [0];
    while !text.ends_with(end.as_bytes()) && stream.read(&mut byte).unwrap() == 1 {
        text.push(byte[0]);
    }
    String::from_utf8(text).unwrap()
}

fn next(client: &PrimaryClient) -> Stamped<PrimaryEvent> {
    client.events().recv_timeout(TIMEOUT).unwrap()
}

fn message(client: &PrimaryClient) -> RobotMessage {
    match next(client).event {
        PrimaryEvent::Message { header: HEADER, message } => message,
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_program_that_is_wrong_comes_back_with_its_line() {
    let exception =
        RuntimeException { line: 2, column: 3, text: "compile_error_name_not_found:forward:".into() };
    let sent = exception.clone();
    let (tell, heard) = std::sync::mpsc::channel();
    let address = controller(move |mut stream| {
        let version = VersionMessage { project: "URControl".into(), major: 5, ..VersionMessage::default() };
        stream.write_all(&encode_version_message(HEADER, &version)).unwrap();
        tell.send(script(&mut stream, "end\n")).unwrap();
        let packet = encode_runtime_exception_message(HEADER, &sent);
        let (half, rest) = packet.split_at(11);
        stream.write_all(half).unwrap();
        std::thread::sleep(Duration::from_millis(20));
        stream.write_all(rest).unwrap();
        tell.send(script(&mut stream, "end\n")).unwrap();
        let started =
            KeyMessage { title: PROGRAM_STARTED.into(), text: "pull".into(), ..KeyMessage::default() };
        stream.write_all(&encode_key_message(HEADER, &started)).unwrap();
    });
    let mut client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    assert!(matches!(message(&client), RobotMessage::Version(v) if v.major == 5));
    let before = Instant::now();
    client.send_script("def pull():\n  forward()\nend").unwrap();
    assert_eq!(heard.recv_timeout(TIMEOUT).unwrap(), "def pull():\n  forward()\nend\n");
    let wrong = next(&client);
    assert!(wrong.at >= before + Duration::from_millis(20), "stamped when it was whole");
    let message_of = |message| PrimaryEvent::Message { header: HEADER, message };
    assert_eq!(wrong.event, message_of(RobotMessage::RuntimeException(exception)));
    client.send_script("def pull():\nend\n").unwrap();
    assert_eq!(
        heard.recv_timeout(TIMEOUT).unwrap(),
        "def pull():\nend\n",
        "one end of the last line is enough"
    );
    assert!(
        matches!(message(&client), RobotMessage::Key(key) if key.title == PROGRAM_STARTED && key.text == "pull")
    );
    // The controller has gone.
    assert!(client.events().recv_timeout(TIMEOUT).is_err());
    assert!(matches!(client.ended(), Some(PrimaryLinkError::Closed { .. })));
    let e = client.send_script("def pull():\nend\n").unwrap_err();
    assert!(matches!(e, ScriptError::Link(PrimaryLinkError::Closed { .. })), "{e}");
}

#[test]
fn what_is_no_program_is_not_sent() {
    let (tell, heard) = std::sync::mpsc::channel();
    let address = controller(move |mut stream| {
        let mut all = String::new();
        stream.read_to_string(&mut all).unwrap();
        tell.send(all).unwrap();
    });
    let mut client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    assert!(matches!(client.send_script(" \n\n"), Err(ScriptError::Empty)));
    let e = client.send_script("stopl(1)\n\0\n").unwrap_err();
    assert_eq!(e.to_string(), "the program has a zero byte at byte 9 of 11");
    let started = Instant::now();
    drop(client);
    assert!(started.elapsed() < Duration::from_secs(1), "{:?}", started.elapsed());
    assert_eq!(heard.recv_timeout(TIMEOUT).unwrap(), "");
}

#[test]
fn the_mode_is_an_event_where_it_changes() {
    let mode =
        |device_ticks, mode_number| RobotModeData { device_ticks, mode_number, ..RobotModeData::default() };
    let modes = [mode(1, 5), mode(2, 5), mode(3, 7), mode(4, 7), mode(5, 7)];
    let address = controller(move |mut stream| {
        for mode in &modes {
            stream.write_all(&encode_robot_mode_data(mode)).unwrap();
            // A program's variables.
            stream.write_all(&[0, 0, 0, 6, 25, 1]).unwrap();
        }
        stream.write_all(&[0, 0, 0, 1, 20]).unwrap();
    });
    let client = PrimaryClient::connect(address, TIMEOUT).unwrap();
    let events: Vec<PrimaryEvent> = client.events().iter().map(|e| e.event).collect();
    assert_eq!(events, [PrimaryEvent::RobotMode(modes[0]), PrimaryEvent::RobotMode(modes[2])]);
    assert_eq!(client.newest_mode().map(|m| m.event), Some(modes[4]));
    let e = client.ended().unwrap();
    assert!(matches!(e, PrimaryLinkError::Session { .. }) && e.to_string().contains("has 1 bytes"), "{e}");
    assert_eq!((client.skipped(), client.events_lost()), (5, 0));
}
