use super::mjpeg::*;
use gripgen_rig::camera::{CameraFrame, CameraStream, SHIPPED_FRAME_LIMITS, decode_jpeg, stream_request};
use gripgen_twin::TactileImage;

fn request(text: &str) -> Option<CameraRequest> {
    HttpRequest::default().receive(text.as_bytes())
}

#[test]
fn requests_are_those_of_the_sensor() {
    let get = |target: &str| request(&format!("GET {target} HTTP/1.1\r\nHost: gsr15001.local\r\n\r\n"));
    assert_eq!(get("/?action=stream"), Some(CameraRequest::Stream));
    assert_eq!(get("/?action=stream&ignored=1"), Some(CameraRequest::Stream));
    assert_eq!(get("/?action=snapshot"), Some(CameraRequest::Snapshot));
    for other in ["/", "/?action=", "/?action=streams", "/stream", "/?action=command&id=1", "/..%2f", "*"] {
        assert_eq!(get(other), Some(CameraRequest::NotFound), "{other}");
    }
    assert_eq!(request("POST /?action=stream HTTP/1.1\r\n\r\n"), Some(CameraRequest::NotFound));
    for bad in
        ["\r\n\r\n", "hello\r\n\r\n", "GET /\r\n\r\n", "GET / FTP/1\r\n\r\n", "GET / x HTTP/1.0\r\n\r\n"]
    {
        assert_eq!(request(bad), Some(CameraRequest::Bad), "{bad:?}");
    }
    // The crate's own client, and one that ends its lines with a line feed only.
    let own = stream_request("gsr15001.local");
    assert_eq!(HttpRequest::default().receive(&own), Some(CameraRequest::Stream));
    assert_eq!(request("GET /?action=snapshot HTTP/1.0\n\n"), Some(CameraRequest::Snapshot));
}

#[test]
fn a_request_comes_in_pieces_and_has_an_end() {
    let own = stream_request("gsr15001.local");
    let mut slow = HttpRequest::default();
    let answers: Vec<_> = own.chunks(1).map(|piece| slow.receive(piece)).collect();
    assert!(answers[..own.len() - 1].iter().all(Option::is_none));
    assert_eq!(answers.last(), Some(&Some(CameraRequest::Stream)));
    let mut endless = HttpRequest::default();
    let given_up = (1..=100).find(|_| endless.receive(&[b'x'; 1000]).is_some());
    assert_eq!(given_up, Some(9), "8192 bytes are read");
    let long = format!("GET /?action=stream HTTP/1.0\r\nCookie: {}\r\n\r\n", "x".repeat(9000));
    assert_eq!(request(&long), Some(CameraRequest::Bad), "an end behind them is not seen");
}

/// What mjpg-streamer puts on the wire for a stream of two frames.
#[test]
fn the_stream_is_that_of_mjpg_streamer() {
    let wire =
        [stream_header(), stream_part(b"\xff\xd8A\xff\xd9", 12.25), stream_part(b"BC", 1.0e9 + 0.000_001)]
            .concat();
    let golden: &[u8] = b"HTTP/1.0 200 OK\r\n\
        Connection: close\r\n\
        Server: MJPG-Streamer/0.2\r\n\
        Cache-Control: no-store, no-cache, must-revalidate, pre-check=0, post-check=0, max-age=0\r\n\
        Pragma: no-cache\r\n\
        Expires: Mon, 3 Jan 2000 12:34:56 GMT\r\n\
        Content-Type: multipart/x-mixed-replace;boundary=boundarydonotcross\r\n\
        \r\n\
        --boundarydonotcross\r\n\
        Content-Type: image/jpeg\r\n\
        Content-Length: 5\r\n\
        X-Timestamp: 12.250000\r\n\
        \r\n\
        \xff\xd8A\xff\xd9\r\n\
        --boundarydonotcross\r\n\
        Content-Type: image/jpeg\r\n\
        Content-Length: 2\r\n\
        X-Timestamp: 1000000000.000001\r\n\
        \r\n\
        BC\r\n\
        --boundarydonotcross\r\n";
    assert_eq!(String::from_utf8_lossy(&wire), String::from_utf8_lossy(golden));
    assert_eq!(wire, golden);
}

#[test]
fn a_snapshot_and_refusals_have_their_form() {
    let text = String::from_utf8(snapshot(b"JPEG", f64::NAN)).unwrap();
    assert!(text.starts_with("HTTP/1.0 200 OK\r\nConnection: close\r\nServer: MJPG-Streamer/0.2\r\n"));
    assert!(text.ends_with("\r\nContent-type: image/jpeg\r\nX-Timestamp: 0.000000\r\n\r\nJPEG"));
    for (answer, line) in
        [(not_found(), "HTTP/1.0 404 Not Found"), (bad_request(), "HTTP/1.0 400 Bad Request")]
    {
        let refused = CameraStream::default().receive(&answer).unwrap_err();
        assert_eq!(refused.to_string(), format!("the camera answers `{line}`"));
    }
}

/// Frames through the crate's own client, cut anywhere, with the boundary inside a frame.
#[test]
fn the_client_of_this_crate_reads_the_stream() {
    let frames: Vec<CameraFrame> =
        [&b"\xff\xd8--boundarydonotcross\r\n\xff\xd9"[..], b"", b"\xff\xd8\r\n\r\n\xff\xd9"]
            .iter()
            .zip([0.5, 1.016_667, 1_700_000_000.25])
            .map(|(jpeg, time)| CameraFrame { jpeg: jpeg.to_vec(), device_time_s: Some(time) })
            .collect();
    let mut wire = stream_header();
    for frame in &frames {
        wire.extend(stream_part(&frame.jpeg, frame.device_time_s.unwrap()));
    }
    for size in [1, 7, 100, wire.len()] {
        let mut camera = CameraStream::default();
        let read: Vec<CameraFrame> =
            wire.chunks(size).flat_map(|piece| camera.receive(piece).unwrap()).collect();
        assert_eq!(read, frames, "pieces of {size}");
    }
}

#[test]
fn an_image_comes_back_from_its_jpeg() {
    // Smooth, as gel images are.
    let rgb = (0..240_u32 * 320)
        .flat_map(|i| [(i % 240) as u8 / 2 + 40, (i / 240 / 2) as u8, 100 + (i % 240) as u8 / 4])
        .collect();
    let image = TactileImage { width_px: 240, height_px: 320, rgb };
    let jpeg = encode_jpeg(&image, 100).unwrap();
    let back = decode_jpeg(&jpeg, &SHIPPED_FRAME_LIMITS).unwrap();
    assert_eq!((back.width_px, back.height_px), (240, 320));
    let worst = back.rgb.iter().zip(&image.rgb).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(worst <= 4, "{worst}");
    assert!(encode_jpeg(&image, 50).unwrap().len() < jpeg.len());
}

#[test]
fn images_that_cannot_be_sent_are_refused_with_their_numbers() {
    let image = TactileImage { width_px: 4, height_px: 2, rgb: vec![9; 24] };
    let error = |image: &TactileImage, quality| encode_jpeg(image, quality).unwrap_err().to_string();
    assert!(error(&image, 0).contains("quality 0") && error(&image, 101).contains("from 1 to 100"));
    let short = TactileImage { width_px: 4, height_px: 2, rgb: vec![9; 23] };
    assert_eq!(error(&short, 90), "23 bytes for an image that needs 24");
    let empty = TactileImage { width_px: 0, height_px: 2, rgb: Vec::new() };
    assert!(error(&empty, 90).contains("0 x 2 px"));
    let long = TactileImage { width_px: 70_000, height_px: 1, rgb: vec![0; 210_000] };
    assert!(error(&long, 90).contains("70000 x 1 px"));
}
