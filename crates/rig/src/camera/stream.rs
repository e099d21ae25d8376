//! `multipart/x-mixed-replace` (RFC 2046, 5.1) as mjpg-streamer writes it: a boundary line, a few headers, the frame.

/// Largest frame that is taken: a JPEG of 640 x 480 at the best quality is a tenth of it.
pub const MAX_FRAME: usize = 4 << 20;
/// Longest headers.
const MAX_HEADERS: usize = 8 << 10;
/// What may come without their end: its last byte may still be on the way.
const MAX_WITHOUT_END: usize = MAX_HEADERS + b"\r\n\r\n".len() - 1;

/// The request for a stream of the camera at `host`.
pub fn stream_request(host: &str) -> Vec<u8> {
    format!("GET /?action=stream HTTP/1.0\r\nHost: {host}\r\n\r\n").into_bytes()
}

/// A frame.
#[derive(Debug, Clone, PartialEq)]
pub struct CameraFrame {
    /// JPEG, undecoded.
    pub jpeg: Vec<u8>,
    /// Clock of the camera when it took the frame, where it says so; it is nobody else's clock.
    pub device_time_s: Option<f64>,
}

/// What is no stream of frames. The connection has to be made anew.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraStreamError {
    /// The camera refuses.
    #[error("the camera answers `{line}`")]
    Status {
        /// Its first line.
        line: String,
    },
    /// Not a multipart stream.
    #[error("the camera sends `{content_type}`, a stream of frames is multipart/x-mixed-replace")]
    ContentType {
        /// What it says it sends.
        content_type: String,
    },
    /// Headers without an end.
    #[error("headers of {bytes} bytes without an end, at most {MAX_HEADERS} are read")]
    Headers {
        /// Bytes so far.
        bytes: usize,
    },
    /// A frame that is too large.
    #[error("a frame of {bytes} bytes, at most {MAX_FRAME} are read")]
    Frame {
        /// Its size, or what came of it so far.
        bytes: usize,
    },
}

/// A stream under way.
#[derive(Debug, Clone, Default)]
pub struct CameraStream {
    bytes: Vec<u8>,
    /// The line before each part, with its dashes; `None` before the headers of the answer.
    boundary: Option<Vec<u8>>,
    part: Option<Part>,
}

/// A frame whose headers are read.
#[derive(Debug, Clone, Copy)]
struct Part {
    length: Option<usize>,
    device_time_s: Option<f64>,
}

impl CameraStream {
    /// Takes in what came from the wire and gives the frames that are whole.
    ///
    /// # Errors
    ///
    /// An answer that is no stream of frames, or headers or a frame beyond their limits.
    pub fn receive(&mut self, bytes: &[u8]) -> Result<Vec<CameraFrame>, CameraStreamError> {
        self.bytes.extend_from_slice(bytes);
        let mut frames = Vec::new();
        loop {
            if self.boundary.is_none() {
                let Some(headers) = self.headers()? else { return Ok(frames) };
                self.boundary = Some(boundary_of(&headers)?);
            }
            let Some(part) = self.part else {
                if !self.skip_boundary()? {
                    return Ok(frames);
                }
                let Some(headers) = self.headers()? else { return Ok(frames) };
                self.part = Some(part_of(&headers)?);
                continue;
            };
            let Some(jpeg) = self.body(part)? else { return Ok(frames) };
            self.part = None;
            frames.push(CameraFrame { jpeg, device_time_s: part.device_time_s });
        }
    }

    /// Headers up to an empty line, taken off the stream; a boundary that was found before stays in front of them.
    fn headers(&mut self) -> Result<Option<Vec<String>>, CameraStreamError> {
        let ends =
            [&b"\r\n\r\n"[..], b"\n\n"].map(|end| find(&self.bytes, end).map(|at| (at, at + end.len())));
        let Some((end, after)) = ends.into_iter().flatten().min() else {
            let bytes = self.bytes.len();
            return if bytes > MAX_WITHOUT_END {
                Err(CameraStreamError::Headers { bytes })
            } else {
                Ok(None)
            };
        };
        if end > MAX_HEADERS {
            return Err(CameraStreamError::Headers { bytes: end });
        }
        let text = String::from_utf8_lossy(&self.bytes[..end]).into_owned();
        self.bytes.drain(..after);
        Ok(Some(text.lines().map(|line| line.trim().to_string()).collect()))
    }

    /// Whether the stream stands behind a boundary line whose part's headers are whole; what is before it is dropped.
    fn skip_boundary(&mut self) -> Result<bool, CameraStreamError> {
        let boundary = self.boundary.as_deref().unwrap_or_default();
        let Some(at) = find(&self.bytes, boundary) else {
            // The end of the boundary may still come.
            let keep = boundary.len().saturating_sub(1).min(self.bytes.len());
            self.bytes.drain(..self.bytes.len() - keep);
            return Ok(false);
        };
        let after = &self.bytes[at + boundary.len()..];
        if find(after, b"\r\n\r\n").or_else(|| find(after, b"\n\n")).is_none() {
            let bytes = after.len();
            return if bytes > MAX_WITHOUT_END {
                Err(CameraStreamError::Headers { bytes })
            } else {
                Ok(false)
            };
        }
        self.bytes.drain(..at + boundary.len());
        Ok(true)
    }

    fn body(&mut self, part: Part) -> Result<Option<Vec<u8>>, CameraStreamError> {
        let length = match part.length {
            Some(length) => length,
            None => {
                // Without a length the frame ends before the line break that belongs to the next boundary.
                let boundary = self.boundary.as_deref().unwrap_or_default();
                match find(&self.bytes, boundary) {
                    Some(at) => {
                        let body = &self.bytes[..at];
                        body.strip_suffix(b"\r\n").or(body.strip_suffix(b"\n")).unwrap_or(body).len()
                    }
                    None if self.bytes.len() > MAX_FRAME => {
                        return Err(CameraStreamError::Frame { bytes: self.bytes.len() });
                    }
                    None => return Ok(None),
                }
            }
        };
        if self.bytes.len() < length {
            return Ok(None);
        }
        Ok(Some(self.bytes.drain(..length).collect()))
    }
}

fn find(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    if wanted.is_empty() {
        return None;
    }
    bytes.windows(wanted.len()).position(|w| w == wanted)
}

fn header<'a>(headers: &'a [String], name: &str) -> Option<&'a str> {
    headers.iter().find_map(|line| {
        let (found, value) = line.split_once(':')?;
        found.trim().eq_ignore_ascii_case(name).then(|| value.trim())
    })
}

fn boundary_of(headers: &[String]) -> Result<Vec<u8>, CameraStreamError> {
    let line = headers.first().cloned().unwrap_or_default();
    if line.split_whitespace().nth(1) != Some("200") {
        return Err(CameraStreamError::Status { line });
    }
    let content_type = header(headers, "Content-Type").unwrap_or_default();
    let other = || CameraStreamError::ContentType { content_type: content_type.into() };
    if !content_type.to_ascii_lowercase().starts_with("multipart/x-mixed-replace") {
        return Err(other());
    }
    let named = content_type.split(';').find_map(|p| p.trim().strip_prefix("boundary="));
    let name = named.map(|n| n.trim_matches('"').trim_start_matches("--")).filter(|n| !n.is_empty());
    Ok(format!("--{}", name.ok_or_else(other)?).into_bytes())
}

fn part_of(headers: &[String]) -> Result<Part, CameraStreamError> {
    let length: Option<usize> = header(headers, "Content-Length").and_then(|v| v.parse().ok());
    if let Some(bytes) = length.filter(|&bytes| bytes > MAX_FRAME) {
        return Err(CameraStreamError::Frame { bytes });
    }
    let device_time_s =
        header(headers, "X-Timestamp").and_then(|v| v.parse().ok()).filter(|t: &f64| t.is_finite());
    Ok(Part { length, device_time_s })
}
