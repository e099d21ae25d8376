//! A link of lines against a peer on loopback that falls silent, breaks off, or speaks nonsense.

use super::testing::{TIMEOUT, device, rest};
use super::*;
use std::io::Write;
use std::net::{SocketAddr, TcpListener};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

const CLOSED: &str = "the peer is gone";
const OPEN: Reading = Reading { thread: "lines", silence: None, cut_at_end: true };

#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("the line `{0}` is no number")]
struct NoNumber(String);

type Numbers = Connection<Vec<u32>, NoNumber>;

/// A client that reads numbers, one per line: they are known, and come out of the channel.
fn numbers(address: SocketAddr, reading: Reading) -> (Numbers, Receiver<Stamped<u32>>) {
    let (tell, events) = channel();
    let mut line = String::new();
    let socket = Socket::connect(address, TIMEOUT, CLOSED).unwrap();
    let connection = Connection::start(socket, reading, Vec::new(), move |shared, bytes, at| {
        line.push_str(&String::from_utf8_lossy(bytes));
        while let Some((whole, rest)) = line.split_once('\n') {
            let event: u32 = whole.parse().map_err(|_| NoNumber(whole.into()))?;
            line = rest.into();
            shared.known().state.push(event);
            shared.notify();
            let _ = tell.send(Stamped { at, event });
        }
        Ok(())
    });
    (connection.unwrap(), events)
}

fn ended(connection: &Numbers) -> Option<LinkError<NoNumber>> {
    connection.shared.known().ended.clone()
}

#[test]
fn half_a_message_and_then_the_end_is_an_end_without_that_message() {
    let (address, _) = device(|mut stream| stream.write_all(b"7\n1").unwrap());
    let (connection, events) = numbers(address, OPEN);
    // The channel ends when the reason is known, not before.
    assert_eq!(events.iter().map(|e| e.event).collect::<Vec<u32>>(), [7]);
    let end = ended(&connection).unwrap();
    assert_eq!(end.to_string(), format!("{address}: the peer is gone"));
    assert!(matches!(end, LinkError::Closed { .. }));
    // Who waits for the rest is told at once.
    let started = Instant::now();
    let e: Result<(), LinkError<NoNumber>> =
        connection.shared.wait(TIMEOUT, |_| None, |_, _| panic!("the end is known"));
    assert!(matches!(e, Err(LinkError::Closed { .. })) && started.elapsed() < TIMEOUT);
}

#[test]
fn a_wait_ends_with_what_came_or_with_both_numbers() {
    let (lead, follow) = channel::<&[u8]>();
    let (address, _) =
        device(move |mut stream| follow.iter().for_each(|piece| stream.write_all(piece).unwrap()));
    let (connection, _events) = numbers(address, OPEN);
    let wait = |number: u32, limit: Duration| {
        let began = Instant::now();
        let look = |known: &mut Vec<u32>| known.contains(&number).then_some(Ok(number));
        let late = |_: &Vec<u32>, waited: Duration| {
            assert!(waited >= limit, "{waited:?}");
            connection.shared.socket.no_answer("a number", began, limit)
        };
        connection.shared.wait(limit, look, late)
    };
    let LinkError::Timeout { waited_s, limit_s, .. } = wait(3, Duration::from_millis(80)).unwrap_err() else {
        panic!()
    };
    assert!(limit_s == 0.08 && (0.08..60.0).contains(&waited_s), "{waited_s}");
    let e = wait(3, Duration::from_millis(40)).unwrap_err().to_string();
    assert!(e.starts_with(&format!("{address}: no answer to `a number` came for ")), "{e}");
    assert!(e.ends_with("s, 0.040 s are allowed"), "{e}");
    // Silence is no end where nothing is promised.
    assert!(ended(&connection).is_none());
    lead.send(b"3").unwrap();
    assert!(wait(3, Duration::from_millis(40)).is_err(), "a number ends with its line");
    lead.send(b"\n").unwrap();
    assert_eq!(wait(3, TIMEOUT).unwrap(), 3);
}

#[test]
fn a_device_that_promised_to_speak_ends_by_silence_and_still_hears() {
    let (address, peer) = device(|mut stream| {
        stream.write_all(b"1\n").unwrap();
        rest(stream)
    });
    let limit = Duration::from_millis(600);
    let watched = Reading { silence: Some(limit), cut_at_end: false, ..OPEN };
    let (connection, events) = numbers(address, watched);
    let began = Instant::now();
    assert_eq!(events.iter().count(), 1);
    assert!(began.elapsed() >= limit && began.elapsed() < TIMEOUT, "{:?}", began.elapsed());
    let end = ended(&connection).unwrap();
    let LinkError::Silent { silent_s, limit_s, .. } = end else { panic!("{end}") };
    assert!(limit_s == 0.6 && (0.6..60.0).contains(&silent_s), "{silent_s}");
    let told = end.to_string();
    assert!(told.contains(&format!("nothing came for {silent_s:.3} s, 0.600 s are allowed")), "{told}");
    // The way out is open until the client is dropped.
    connection.shared.socket.write(b"stop").unwrap();
    drop(connection);
    assert_eq!(peer.join().unwrap(), "stop");
}

#[test]
fn what_is_not_understood_ends_the_link_both_ways() {
    let (address, peer) = device(|mut stream| {
        stream.write_all(b"1\ntwo\n3\n").unwrap();
        rest(stream)
    });
    let (connection, events) = numbers(address, OPEN);
    assert_eq!(events.iter().count(), 1);
    let end = ended(&connection).unwrap();
    assert_eq!(end.to_string(), format!("{address}: the line `two` is no number"));
    assert!(matches!(end, LinkError::Session { source: NoNumber(_), .. }));
    // The peer sees the end while the client still lives.
    assert_eq!(peer.join().unwrap(), "");
    assert!(matches!(connection.shared.socket.write(b"4"), Err(LinkError::Io { .. })));
}

#[test]
fn dropping_a_link_closes_it_though_others_could_write() {
    let (address, peer) = device(rest);
    let (connection, _events) = numbers(address, OPEN);
    let other = connection.shared.clone();
    other.socket.write(b"before").unwrap();
    drop(connection);
    assert_eq!(peer.join().unwrap(), "before");
    assert!(matches!(other.known().ended, Some(LinkError::Closed { .. })), "who waits is told");
    assert!(other.socket.write(b"after").is_err());
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let e = Socket::<NoNumber>::connect(nobody, TIMEOUT, CLOSED).err().unwrap();
    assert!(matches!(e, LinkError::Io { .. }) && e.to_string().starts_with(&format!("{nobody}: ")), "{e}");
}
