use super::*;

const HEAD: &str = "HTTP/1.0 200 OK\r\nConnection: close\r\nServer: MJPG-Streamer/0.2\r\n\
                    Content-Type: multipart/x-mixed-replace;boundary=boundarydonotcross\r\n\r\n--boundarydonotcross\r\n";

/// Frames as mjpg-streamer sends them; one holds the boundary itself, which only a length can tell from the real one.
fn frames() -> Vec<CameraFrame> {
    let jpegs: [&[u8]; 3] =
        [b"\xff\xd8one\r\n\r\n\xff\xd9", b"\xff\xd8--boundarydonotcross\r\n\xff\xd9", b"\xff\xd8\xff\xd9"];
    let times = [12.25, 12.267, 12.283];
    jpegs.iter().zip(times).map(|(j, t)| CameraFrame { jpeg: j.to_vec(), device_time_s: Some(t) }).collect()
}

fn stream(with_length: bool, frames: &[CameraFrame]) -> Vec<u8> {
    let mut wire = HEAD.as_bytes().to_vec();
    for frame in frames {
        wire.extend(b"Content-Type: image/jpeg\r\n");
        if with_length {
            wire.extend(format!("Content-Length: {}\r\n", frame.jpeg.len()).bytes());
        }
        wire.extend(format!("X-Timestamp: {:.3}\r\n\r\n", frame.device_time_s.unwrap()).bytes());
        wire.extend(&frame.jpeg);
        wire.extend(b"\r\n--boundarydonotcross\r\n");
    }
    wire
}

fn read(wire: &[u8], size: usize) -> Vec<CameraFrame> {
    let mut camera = CameraStream::default();
    wire.chunks(size).flat_map(|piece| camera.receive(piece).unwrap()).collect()
}

#[test]
fn frames_come_whole_out_of_pieces_of_any_size() {
    let wire = stream(true, &frames());
    for size in [1, 2, 3, 5, 17, 64, wire.len()] {
        assert_eq!(read(&wire, size), frames(), "pieces of {size}");
    }
}

#[test]
fn frames_without_a_length_end_at_the_boundary() {
    let plain: Vec<CameraFrame> =
        frames().into_iter().filter(|f| !f.jpeg.windows(4).any(|w| w == b"--bo")).collect();
    let wire = stream(false, &plain);
    for size in [1, 4, 33, wire.len()] {
        assert_eq!(read(&wire, size), plain, "pieces of {size}");
    }
}

#[test]
fn what_is_no_stream_is_said() {
    let error = |wire: &str| CameraStream::default().receive(wire.as_bytes()).unwrap_err().to_string();
    assert_eq!(error("HTTP/1.0 404 Not Found\r\n\r\n"), "the camera answers `HTTP/1.0 404 Not Found`");
    assert!(error("HTTP/1.0 200 OK\r\nContent-Type: image/jpeg\r\n\r\n").contains("`image/jpeg`"));
    assert!(error(&"x".repeat(9000)).contains("9000 bytes without an end"));
    let huge = format!("{HEAD}Content-Length: 99999999\r\n\r\n");
    assert!(error(&huge).contains("99999999 bytes, at most 4194304"));
    assert!(String::from_utf8(stream_request("gsr15001.local")).unwrap().ends_with("\r\n\r\n"));
}

/// A camera that is silent after its headers, and one that never ends a frame, use no more memory than allowed.
#[test]
fn a_frame_without_end_is_given_up() {
    let mut camera = CameraStream::default();
    camera.receive(format!("{HEAD}Content-Type: image/jpeg\r\n\r\n").as_bytes()).unwrap();
    let piece = vec![7_u8; 1 << 20];
    let given_up = (0..8).find_map(|_| camera.receive(&piece).err());
    assert!(matches!(given_up, Some(CameraStreamError::Frame { bytes }) if bytes <= MAX_FRAME + piece.len()));
}
