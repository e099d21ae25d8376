//! The cameras of the virtual rig: requests in, the answers of mjpg-streamer out, without a socket.
//!
//! Source: the bytes that mjpg-streamer sends (`output_http`, 2021), the program that runs on the sensor. The stream begins with
//! a boundary, and a boundary follows each frame; a snapshot has no length and ends with the connection.

use gripgen_twin::TactileImage;
use image::ExtendedColorType;
use image::codecs::jpeg::JpegEncoder;

/// Longest headers of a request.
const MAX_HEADERS: usize = 8 << 10;
/// Longest side of a JPEG.
const MAX_JPEG_SIDE_PX: u32 = u16::MAX as u32;
/// The line between frames, without its dashes.
const BOUNDARY: &str = "boundarydonotcross";
/// What mjpg-streamer says with every answer: nobody is to keep a frame.
const EVERY_ANSWER: &str = "Connection: close\r\n\
    Server: MJPG-Streamer/0.2\r\n\
    Cache-Control: no-store, no-cache, must-revalidate, pre-check=0, post-check=0, max-age=0\r\n\
    Pragma: no-cache\r\n\
    Expires: Mon, 3 Jan 2000 12:34:56 GMT\r\n";

/// What a client wants of a camera.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum CameraRequest {
    /// Frames without an end: [`stream_header`], then a [`stream_part`] for each.
    Stream,
    /// One frame: [`snapshot`].
    Snapshot,
    /// Something that a camera does not have: [`not_found`].
    NotFound,
    /// No request of HTTP: [`bad_request`].
    Bad,
}

/// The request of a connection under way. At most 8 KiB are kept.
#[derive(Debug, Clone, Default)]
pub struct HttpRequest {
    bytes: Vec<u8>,
}

impl HttpRequest {
    /// Takes in what came from the wire; what is wanted, once the headers are whole. Headers without an end are a bad request.
    pub fn receive(&mut self, bytes: &[u8]) -> Option<CameraRequest> {
        let room = MAX_HEADERS.saturating_sub(self.bytes.len());
        self.bytes.extend(bytes.iter().take(room));
        let whole =
            [&b"\r\n\r\n"[..], b"\n\n"].iter().any(|end| self.bytes.windows(end.len()).any(|w| w == *end));
        if whole {
            return Some(request_of(&self.bytes));
        }
        (self.bytes.len() >= MAX_HEADERS).then_some(CameraRequest::Bad)
    }
}

fn request_of(bytes: &[u8]) -> CameraRequest {
    let line = bytes.split(|&b| b == b'\n').next().unwrap_or_default();
    let Ok(line) = std::str::from_utf8(line) else { return CameraRequest::Bad };
    let words: Vec<&str> = line.split_whitespace().collect();
    let &[method, target, version] = words.as_slice() else { return CameraRequest::Bad };
    if !version.starts_with("HTTP/") {
        return CameraRequest::Bad;
    }
    let query = target.strip_prefix("/?").filter(|_| method == "GET").unwrap_or_default();
    match query.split('&').next() {
        Some("action=stream") => CameraRequest::Stream,
        Some("action=snapshot") => CameraRequest::Snapshot,
        _ => CameraRequest::NotFound,
    }
}

/// The beginning of a stream: the headers and the first boundary.
pub fn stream_header() -> Vec<u8> {
    format!(
        "HTTP/1.0 200 OK\r\n{EVERY_ANSWER}Content-Type: multipart/x-mixed-replace;boundary={BOUNDARY}\r\n\r\n\
         --{BOUNDARY}\r\n"
    )
    .into_bytes()
}

/// A frame of a stream and the boundary after it. `device_time_s` is the clock of the camera when it took the frame.
pub fn stream_part(jpeg: &[u8], device_time_s: f64) -> Vec<u8> {
    let (length, time) = (jpeg.len(), timestamp(device_time_s));
    let mut part =
        format!("Content-Type: image/jpeg\r\nContent-Length: {length}\r\nX-Timestamp: {time}\r\n\r\n")
            .into_bytes();
    part.extend_from_slice(jpeg);
    part.extend_from_slice(format!("\r\n--{BOUNDARY}\r\n").as_bytes());
    part
}

/// A JPEG with words that no decoder shows (a COM segment, ITU T.81 B.2.4.5). No two frames of a real camera have the same bytes, by their
/// noise; to draw that for every frame would cost more than all else that a virtual rig does.
pub fn with_comment(jpeg: &[u8], words: &str) -> Vec<u8> {
    let (Some(start), Some(rest)) = (jpeg.get(..2), jpeg.get(2..)) else { return jpeg.to_vec() };
    let length = (words.len() as u16 + 2).to_be_bytes();
    [start, &[0xff, 0xfe], &length, words.as_bytes(), rest].concat()
}

/// The whole answer to a snapshot; the connection is closed after it.
pub fn snapshot(jpeg: &[u8], device_time_s: f64) -> Vec<u8> {
    let time = timestamp(device_time_s);
    let mut answer =
        format!("HTTP/1.0 200 OK\r\n{EVERY_ANSWER}Content-type: image/jpeg\r\nX-Timestamp: {time}\r\n\r\n")
            .into_bytes();
    answer.extend_from_slice(jpeg);
    answer
}

/// The answer to [`CameraRequest::NotFound`].
pub fn not_found() -> Vec<u8> {
    refusal("404 Not Found", "404: Not Found!\r\na camera has /?action=stream and /?action=snapshot")
}

/// The answer to [`CameraRequest::Bad`].
pub fn bad_request() -> Vec<u8> {
    refusal("400 Bad Request", "400: Bad Request!\r\nthis is no request of HTTP")
}

fn refusal(status: &str, body: &str) -> Vec<u8> {
    format!("HTTP/1.0 {status}\r\nContent-type: text/plain\r\n{EVERY_ANSWER}\r\n{body}").into_bytes()
}

/// Seconds and six digits of microseconds. What is no time after 1970 is 0.
fn timestamp(device_time_s: f64) -> String {
    let microseconds = (device_time_s.max(0.0) * 1e6).round() as u64;
    format!("{}.{:06}", microseconds / 1_000_000, microseconds % 1_000_000)
}

/// An image that cannot be sent.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum EncodeFrameError {
    /// A quality that JPEG does not have.
    #[error("a JPEG of quality {quality}, it must be from 1 to 100")]
    Quality {
        /// What was asked.
        quality: u8,
    },
    /// No image, or one that is too large for a JPEG.
    #[error(
        "an image of {width_px} x {height_px} px as a JPEG, each side must be from 1 to {MAX_JPEG_SIDE_PX} px"
    )]
    Size {
        /// Columns.
        width_px: u32,
        /// Rows.
        height_px: u32,
    },
    /// Bytes that are not those of the size.
    #[error("{bytes} bytes for an image that needs {wanted}")]
    Bytes {
        /// How many there are.
        bytes: u64,
        /// Three for each pixel.
        wanted: u64,
    },
    /// The encoder gave up.
    #[error("the frame could not be coded: {reason}")]
    Jpeg {
        /// Its words.
        reason: String,
    },
}

/// A JPEG of an image. `quality` is 1 to 100; the sensor sends 100.
///
/// # Errors
///
/// A quality or a size that JPEG does not have, or bytes that do not fit the size.
pub fn encode_jpeg(image: &TactileImage, quality: u8) -> Result<Vec<u8>, EncodeFrameError> {
    let (width_px, height_px) = (image.width_px, image.height_px);
    if !(1..=100).contains(&quality) {
        return Err(EncodeFrameError::Quality { quality });
    }
    let sides = 1..=MAX_JPEG_SIDE_PX;
    if !sides.contains(&width_px) || !sides.contains(&height_px) {
        return Err(EncodeFrameError::Size { width_px, height_px });
    }
    let (bytes, wanted) = (image.rgb.len() as u64, 3 * u64::from(width_px) * u64::from(height_px));
    if bytes != wanted {
        return Err(EncodeFrameError::Bytes { bytes, wanted });
    }
    let mut jpeg = Vec::with_capacity(image.rgb.len() / 4);
    JpegEncoder::new_with_quality(&mut jpeg, quality)
        .encode(&image.rgb, width_px, height_px, ExtendedColorType::Rgb8)
        .map_err(|e| EncodeFrameError::Jpeg { reason: e.to_string() })?;
    Ok(jpeg)
}
