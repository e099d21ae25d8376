//! The client against a small camera on loopback, which sends in pieces, falls silent, refuses, or goes away.

use super::*;
use crate::link::testing::{TIMEOUT, device};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::time::{Duration, Instant};

const HEAD: &str =
    "HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=edge\r\n\r\n--edge\r\n";

fn part(number: u8) -> Vec<u8> {
    let mut wire = format!("Content-Length: 3\r\nX-Timestamp: {number}.5\r\n\r\n").into_bytes();
    wire.extend([0xff, 0xd8, number]);
    wire.extend(b"\r\n--edge\r\n");
    wire
}

/// A camera that has read its request and then does `with`.
fn camera(with: impl FnOnce(TcpStream, String) + Send + 'static) -> SocketAddr {
    let (address, _) = device(|mut stream| {
        let mut request = Vec::new();
        let mut byte = [0];
        while !request.ends_with(b"\r\n\r\n") && stream.read(&mut byte).unwrap() == 1 {
            request.push(byte[0]);
        }
        with(stream, String::from_utf8(request).unwrap());
    });
    address
}

/// A camera that sends the bytes it is given, piece by piece.
fn led() -> (SocketAddr, Sender<Vec<u8>>) {
    let (lead, follow): (_, Receiver<Vec<u8>>) = channel();
    let address = camera(move |mut stream, _| {
        stream.set_nodelay(true).unwrap();
        follow.iter().for_each(|piece| stream.write_all(&piece).unwrap());
    });
    (address, lead)
}

fn number(frame: &crate::link::Stamped<std::sync::Arc<CameraFrame>>) -> u8 {
    frame.event.jpeg[2]
}

#[test]
fn the_newest_frame_is_the_last_of_all_that_came() {
    let (tell, heard) = channel();
    let address = camera(move |mut stream, request| {
        tell.send(request).unwrap();
        let wire: Vec<u8> = HEAD.bytes().chain((0..200).flat_map(part)).collect();
        wire.chunks(333).for_each(|piece| stream.write_all(piece).unwrap());
    });
    let client = CameraClient::connect(address, "gsr15001.local:8080", TIMEOUT).unwrap();
    let request = heard.recv_timeout(TIMEOUT).unwrap();
    assert!(
        request.starts_with("GET /?action=stream HTTP/1.0\r\nHost: gsr15001.local:8080\r\n"),
        "{request}"
    );
    // The end of the connection ends the wait for a frame that cannot come.
    let ahead = Instant::now() + Duration::from_secs(3600);
    let e = client.frame_after(ahead, TIMEOUT).unwrap_err();
    assert!(matches!(e, CameraWaitError::Link(CameraLinkError::Closed { .. })), "{e}");
    let newest = client.newest().unwrap();
    assert_eq!((number(&newest), newest.event.device_time_s, client.frames_seen()), (199, Some(199.5), 200));
    assert!(matches!(client.ended(), Some(CameraLinkError::Closed { .. })));
}

#[test]
fn a_frame_after_a_moment_is_never_an_older_one() {
    let (address, lead) = led();
    lead.send([HEAD.as_bytes(), &part(1)].concat()).unwrap();
    let client = CameraClient::connect(address, "camera", TIMEOUT).unwrap();
    let connected = Instant::now() - TIMEOUT;
    let first = client.frame_after(connected, TIMEOUT).unwrap();
    assert_eq!(number(&first), 1);
    // Again, because it is still the newest that came after that moment.
    assert_eq!(client.frame_after(connected, TIMEOUT).unwrap(), first);
    let pause = Duration::from_millis(80);
    let asked = Instant::now();
    let sender = std::thread::spawn(move || {
        std::thread::sleep(pause);
        let (half, rest) = (part(2)[..9].to_vec(), part(2)[9..].to_vec());
        lead.send(half).unwrap();
        lead.send(rest).unwrap();
        lead
    });
    let second = client.frame_after(asked, TIMEOUT).unwrap();
    assert_eq!(number(&second), 2);
    assert!(second.at >= asked + pause, "stamped when it came");
    let lead = sender.join().unwrap();
    lead.send(part(3)).unwrap();
    assert_eq!(number(&client.frame_after(second.at, TIMEOUT).unwrap()), 3);
    assert_eq!(client.frames_seen(), 3);
}

#[test]
fn a_camera_that_falls_silent_is_old_but_not_gone() {
    let (address, lead) = led();
    lead.send(HEAD.into()).unwrap();
    let client = CameraClient::connect(address, "camera", TIMEOUT).unwrap();
    let limit = Duration::from_millis(50);
    let e = client.frame_after(Instant::now(), limit).unwrap_err();
    assert!(matches!(e, CameraWaitError::None { connected_s, limit_s: 0.05 } if connected_s >= 0.05), "{e}");
    lead.send(part(1)).unwrap();
    let first = client.frame_after(Instant::now() - TIMEOUT, TIMEOUT).unwrap();
    // Longer than any link of this rig may be silent.
    std::thread::sleep(Duration::from_millis(1100));
    let e = client.frame_after(first.at, limit).unwrap_err();
    let CameraWaitError::Old { age_s, limit_s } = e else { panic!("{e}") };
    assert!((1.15..60.0).contains(&age_s) && limit_s == 0.05, "{age_s} {limit_s}");
    assert!(client.ended().is_none());
    lead.send(part(2)).unwrap();
    assert_eq!(number(&client.frame_after(first.at, TIMEOUT).unwrap()), 2);
}

#[test]
fn what_is_no_camera_is_said() {
    let address = camera(|mut stream, _| stream.write_all(b"HTTP/1.0 404 Not Found\r\n\r\n").unwrap());
    let client = CameraClient::connect(address, "camera", TIMEOUT).unwrap();
    let e = client.frame_after(Instant::now(), TIMEOUT).unwrap_err();
    assert_eq!(e.to_string(), format!("{address}: the camera answers `HTTP/1.0 404 Not Found`"));
    assert!(matches!(client.ended(), Some(CameraLinkError::Session { .. })));
    let nobody = TcpListener::bind("127.0.0.1:0").unwrap().local_addr().unwrap();
    let e = CameraClient::connect(nobody, "camera", TIMEOUT).err().unwrap();
    assert!(matches!(e, CameraLinkError::Io { .. }), "{e}");
}

#[test]
fn dropping_the_client_closes_the_connection_at_once() {
    let (tell, closed) = channel();
    let address = camera(move |mut stream, _| {
        stream.write_all(HEAD.as_bytes()).unwrap();
        tell.send(stream.read(&mut [0; 9]).unwrap_or(0)).unwrap();
    });
    let client = CameraClient::connect(address, "camera", TIMEOUT).unwrap();
    drop(client);
    assert_eq!(closed.recv_timeout(TIMEOUT).unwrap(), 0);
}
