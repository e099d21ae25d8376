//! Streams without an end: what a parser holds has a limit that does not grow with them.

use super::held::peak_held;
use super::robot::Served;
use gripgen_rig::camera::{CameraStream, MAX_FRAME};
use gripgen_rig::dashboard::DashboardLink;
use gripgen_rig::gcl::{GclLink, SHIPPED_LIMITS};
use gripgen_rig::primary::{MAX_PACKET, PrimaryStream};
use gripgen_rig::rtde::{Kind, Link, SessionPlan, encode_frame};
use gripgen_rig_sim::mjpeg::HttpRequest;
use gripgen_rig_sim::script::ScriptReader;

/// Bytes of a stream, and of its pieces.
const STREAM: usize = 12 << 20;
const PIECE: usize = 1 << 10;
const LARGE_PIECE: usize = 64 << 10;
/// A vector that grows is there twice: as it was, and twice as long.
const GROWS: usize = 3;

/// What a parser does with a piece; no more is read after `false`.
type Take = Box<dyn FnMut(&[u8]) -> bool>;

/// What it is, who hears it, how it begins and goes on, and the most bytes that may be held for it.
type Stream<'a> = (&'a str, Take, &'a [u8], &'a [u8], usize);

/// Feeds `first`, then `again` for ever; the most that was held. What may become large is fed in larger pieces.
fn feed(mut take: Take, first: &[u8], again: &[u8], allowed: usize) -> usize {
    let size = if allowed > 2 << 20 { LARGE_PIECE } else { PIECE };
    let piece: Vec<u8> =
        again.iter().copied().cycle().take(size.div_ceil(again.len()) * again.len()).collect();
    let feed = || {
        let mut goes_on = take(first);
        for _ in 0..STREAM / piece.len() {
            goes_on = goes_on && take(&piece);
        }
        // Freed inside, as it was taken inside.
        drop(take);
    };
    peak_held(feed).1
}

fn link() -> Take {
    let plan = SessionPlan { outputs: vec!["timestamp".into()], frequency_hz: 500.0, inputs: vec![] };
    let mut link = Link::new(plan).unwrap();
    Box::new(move |bytes| link.receive(bytes).is_ok())
}

fn camera() -> Take {
    let mut camera = CameraStream::default();
    Box::new(move |bytes| camera.receive(bytes).is_ok())
}

fn primary() -> Take {
    let mut stream = PrimaryStream::default();
    Box::new(move |bytes| {
        stream.push(bytes);
        loop {
            match stream.next_message() {
                Ok(Some(_)) => {}
                Ok(None) => return true,
                Err(_) => return false,
            }
        }
    })
}

fn dashboard() -> Take {
    let mut link = DashboardLink::default();
    Box::new(move |bytes| {
        link.push(bytes);
        loop {
            match link.next_event() {
                Ok(Some(_)) => {}
                Ok(None) => return true,
                Err(_) => return false,
            }
        }
    })
}

fn gcl() -> Take {
    let mut link = GclLink::new(SHIPPED_LIMITS);
    Box::new(move |bytes| link.receive(bytes).is_ok())
}

fn server() -> Take {
    let mut served = Served::new();
    Box::new(move |bytes| served.receive(bytes).is_ok())
}

fn script() -> Take {
    let mut reader = ScriptReader::default();
    Box::new(move |bytes| reader.receive(bytes).is_ok())
}

fn request() -> Take {
    let mut request = HttpRequest::default();
    Box::new(move |bytes| request.receive(bytes).is_none())
}

#[test]
fn nothing_grows_with_a_stream_without_end() {
    let short_text = encode_frame(Kind::Text, b"\0\0\0").unwrap();
    let long_text = encode_frame(Kind::Text, &[b'x'; 65_532]).unwrap();
    let stream = b"HTTP/1.0 200 OK\r\nContent-Type: multipart/x-mixed-replace;boundary=b\r\n\r\n--b\r\n";
    let part = b"Content-Length: 5\r\n\r\nABCDE\r\n--b\r\n";
    let packet = [&(MAX_PACKET as i32).to_be_bytes()[..], &[20; MAX_PACKET - 4]].concat();
    let greeting = b"Connected: Universal Robots Dashboard Server\n";
    // What a piece becomes is there beside what is kept: events and answers of 1 KiB.
    let given = 160 * PIECE;
    let (frame, headers) = (GROWS * (65_536 + 65_536 + PIECE), GROWS * (8 * 1024 + PIECE));
    let streams: [Stream; 16] = [
        ("texts to the client of RTDE", link(), &[], &short_text, frame + given),
        ("long texts", link(), &[], &long_text, frame + given + 4 * 65_536),
        ("texts to the server of RTDE", server(), &[], &short_text, frame + given),
        ("questions", server(), &[], &[0, 3, b'v'], frame + given),
        ("recipes", server(), &[], b"\0\x18Iinput_int_register_24", frame + given),
        ("a line of GCL", gcl(), &[], b"x", GROWS * (1024 + PIECE)),
        ("lines of GCL", gcl(), &[], b"x\n", GROWS * (1024 + PIECE) + given),
        ("headers of a camera", camera(), b"HTTP/1.0 200 OK\r\n", b"X: y\r\n", headers),
        ("frames", camera(), stream, part, headers + given),
        ("no boundary", camera(), stream, b"x", headers),
        (
            "a frame without a length",
            camera(),
            &[&stream[..], b"\r\n"].concat(),
            b"x",
            GROWS * (MAX_FRAME + LARGE_PIECE),
        ),
        ("headers of a request", request(), &[], b"X: y\r\n", headers),
        ("a line of the dashboard", dashboard(), greeting, b"x", GROWS * (4096 + PIECE)),
        ("lines of the dashboard", dashboard(), greeting, b"x\n", GROWS * (4096 + PIECE) + given),
        ("packets", primary(), &[], &packet, GROWS * (MAX_PACKET + PIECE) + 4 * MAX_PACKET),
        ("a program", script(), b"def a():\n", b"  x = 1\n", GROWS * ((1 << 20) + LARGE_PIECE)),
    ];
    for (what, take, first, again, allowed) in streams {
        let held = feed(take, first, again, allowed);
        println!("{what}: {held} bytes of {allowed}");
        assert!(held <= allowed, "{what}: {held} bytes are held, {allowed} are allowed");
    }
}
