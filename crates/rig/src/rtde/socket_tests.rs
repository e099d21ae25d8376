//! The client against a small controller on loopback, which speaks in pieces, dies, falls silent, or has its inputs taken.

use super::*;
use crate::link::testing::TIMEOUT;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, Instant};

fn plan() -> SessionPlan {
    SessionPlan {
        outputs: vec!["timestamp".into(), "actual_TCP_force".into()],
        frequency_hz: 500.0,
        inputs: vec![vec!["input_double_register_24".into()]],
    }
}

/// Reads one frame off a socket.
fn next(stream: &mut TcpStream) -> Option<(u8, Vec<u8>)> {
    let mut header = [0; 3];
    stream.read_exact(&mut header).ok()?;
    let mut payload = vec![0; usize::from(u16::from_be_bytes([header[0], header[1]])) - 3];
    stream.read_exact(&mut payload).ok()?;
    Some((header[2], payload))
}

fn answer(stream: &mut TcpStream, kind: Kind, payload: &[u8]) {
    stream.write_all(&encode_frame(kind, payload).unwrap()).unwrap();
}

/// Answers the set-up; `inputs` is the answer to the input recipe.
fn set_up(stream: &mut TcpStream, inputs: &[u8]) -> bool {
    loop {
        let Some((kind, _)) = next(stream) else { return false };
        match kind {
            b'V' => answer(stream, Kind::ProtocolVersion, &[1]),
            b'v' => {
                answer(stream, Kind::ControllerVersion, &[0, 0, 0, 5, 0, 0, 0, 22, 0, 0, 0, 0, 0, 0, 0, 1]);
            }
            b'O' => answer(stream, Kind::SetUpOutputs, b"\x01DOUBLE,VECTOR6D"),
            b'I' => answer(stream, Kind::SetUpInputs, inputs),
            b'S' => {
                answer(stream, Kind::Start, &[1]);
                return true;
            }
            _ => return false,
        }
    }
}

fn data(tick: u32) -> Vec<u8> {
    let mut payload = vec![1];
    payload.extend((40.0 + f64::from(tick) * 0.002).to_be_bytes());
    for axis in 0..6_u32 {
        payload.extend(f64::from(tick + axis).to_be_bytes());
    }
    encode_frame(Kind::Data, &payload).unwrap()
}

/// A controller that does `with` to each connection.
fn controller(with: impl Fn(usize, TcpStream) + Send + 'static) -> SocketAddr {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || listener.incoming().enumerate().for_each(|(i, s)| with(i, s.unwrap())));
    address
}

#[test]
fn every_packet_arrives_in_order_and_the_end_is_known() {
    const PACKETS: u32 = 10_000;
    let address = controller(|_, mut stream| {
        assert!(set_up(&mut stream, b"\x01DOUBLE"));
        let wire: Vec<u8> = (0..PACKETS).flat_map(data).collect();
        // Pieces that respect no frame.
        wire.chunks(1013).for_each(|piece| stream.write_all(piece).unwrap());
    });
    let client = RtdeClient::connect(address, &plan(), TIMEOUT).unwrap();
    assert_eq!(client.recipe().place("actual_TCP_force"), Some(1));
    let mut tick = 0;
    for event in client.events() {
        if let Event::Data(values) = event.event {
            assert_eq!(values[0], Value::Double(40.0 + f64::from(tick) * 0.002));
            tick += 1;
        }
    }
    assert_eq!(tick, PACKETS);
    assert_eq!(client.newest().unwrap()[0], Value::Double(40.0 + f64::from(PACKETS - 1) * 0.002));
    assert!(matches!(client.ended(), Some(LinkError::Closed { .. })));
}

#[test]
fn inputs_reach_the_controller_while_it_sends() {
    let (tell, heard) = std::sync::mpsc::channel();
    let address = controller(move |_, mut stream| {
        assert!(set_up(&mut stream, b"\x07DOUBLE"));
        stream.write_all(&data(0)).unwrap();
        let _ = tell.send(next(&mut stream));
    });
    let client = RtdeClient::connect(address, &plan(), TIMEOUT).unwrap();
    client.write_input(0, &[Value::Double(12.5)]).unwrap();
    let (kind, payload) = heard.recv_timeout(TIMEOUT).unwrap().unwrap();
    assert_eq!((kind, payload), (b'U', [&[7][..], &12.5_f64.to_be_bytes()].concat()));
    let e = client.write_input(0, &[Value::Int32(1)]).unwrap_err();
    assert!(e.to_string().contains("Int32") && e.to_string().contains("Double"), "{e}");
}

#[test]
fn a_controller_that_falls_silent_is_noticed() {
    let address = controller(|_, mut stream| {
        set_up(&mut stream, b"\x01DOUBLE");
        stream.write_all(&data(0)).unwrap();
        std::thread::sleep(2 * TIMEOUT);
    });
    let client = RtdeClient::connect(address, &plan(), TIMEOUT).unwrap();
    let started = Instant::now();
    client.events().iter().for_each(drop);
    assert!(started.elapsed() < TIMEOUT, "{:?}", started.elapsed());
    assert!(matches!(client.ended(), Some(LinkError::Silent { .. })));
    // And one that never answers: the set-up gives up.
    let mute = controller(|_, stream| {
        std::thread::sleep(2 * TIMEOUT);
        drop(stream);
    });
    let e = RtdeClient::connect(mute, &plan(), Duration::from_millis(300)).err().unwrap();
    assert!(matches!(e, LinkError::Silent { .. }), "{e}");
}

/// The way in may be dead while the way out is not: a stop still gets through.
#[test]
fn a_controller_that_is_not_heard_any_more_still_hears() {
    let (tell, heard) = std::sync::mpsc::channel();
    let address = controller(move |_, mut stream| {
        set_up(&mut stream, b"\x07DOUBLE");
        let _ = tell.send(next(&mut stream));
    });
    let client = RtdeClient::connect(address, &plan(), TIMEOUT).unwrap();
    client.events().iter().for_each(drop);
    let end = client.ended().unwrap();
    assert!(matches!(end, LinkError::Silent { limit_s: 1.0, .. }), "{end}");
    assert!(end.to_string().ends_with("s, 1.000 s are allowed"), "{end}");
    assert!(client.ended().is_some(), "the end stays known");
    client.write_input(0, &[Value::Double(1.0)]).unwrap();
    assert_eq!(heard.recv_timeout(TIMEOUT).unwrap().unwrap().0, b'U');
}

#[test]
fn inputs_of_a_connection_that_lingers_are_asked_for_again() {
    let address = controller(|connection, mut stream| {
        let inputs: &[u8] = if connection < 2 { b"\0IN_USE" } else { b"\x01DOUBLE" };
        set_up(&mut stream, inputs);
        let _ = stream.write_all(&data(0));
        std::thread::sleep(Duration::from_millis(100));
    });
    assert!(RtdeClient::connect(address, &plan(), TIMEOUT).is_ok());
    let taken = controller(|_, mut stream| {
        set_up(&mut stream, b"\0IN_USE");
    });
    let e = RtdeClient::connect(taken, &plan(), TIMEOUT).err().unwrap();
    assert!(e.to_string().contains("input_double_register_24"), "{e}");
}

#[test]
fn dropping_the_client_closes_the_connection_at_once() {
    let (tell, closed) = std::sync::mpsc::channel();
    let address = controller(move |_, mut stream| {
        set_up(&mut stream, b"\x01DOUBLE");
        for tick in 0.. {
            if stream.write_all(&data(tick)).is_err() {
                break;
            }
            std::thread::sleep(Duration::from_millis(2));
        }
        let _ = tell.send(());
    });
    let client = RtdeClient::connect(address, &plan(), TIMEOUT).unwrap();
    while client.newest().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
    drop(client);
    closed.recv_timeout(TIMEOUT).unwrap();
}

/// Data that flow are no answer: the set-up ends by the clock, and says what it waited for.
#[test]
fn a_start_without_an_answer_ends_by_the_clock() {
    let address = controller(|_, mut stream| {
        let set_up = |stream: &mut TcpStream| {
            while let Some((kind, _)) = next(stream) {
                match kind {
                    b'V' => answer(stream, Kind::ProtocolVersion, &[1]),
                    b'v' => answer(stream, Kind::ControllerVersion, &[0; 16]),
                    b'O' => answer(stream, Kind::SetUpOutputs, b"\x01DOUBLE,VECTOR6D"),
                    b'I' => answer(stream, Kind::SetUpInputs, b"\x01DOUBLE"),
                    _ => return,
                }
            }
        };
        set_up(&mut stream);
        (0..).take_while(|tick| stream.write_all(&data(*tick)).is_ok()).for_each(|_| {
            std::thread::sleep(Duration::from_millis(2));
        });
    });
    let limit = Duration::from_millis(300);
    let e = RtdeClient::connect(address, &plan(), limit).err().unwrap();
    let LinkError::Timeout { awaited, limit_s, .. } = e else { panic!("{e}") };
    assert_eq!((awaited, limit_s), ("start", 0.3));
}
