//! The cameras: a GelSight R1.5 sends JPEG frames as a multipart stream over HTTP (mjpg-streamer), read here without a socket.

mod stream;
#[cfg(test)]
mod tests;

pub use stream::{CameraFrame, CameraStream, CameraStreamError, MOST_FRAME, stream_request};
