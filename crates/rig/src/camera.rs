//! The cameras: a GelSight R1.5 sends JPEG frames as a multipart stream over HTTP (mjpg-streamer): the stream without a
//! socket, and the client on one.

mod decode;
mod socket;
#[cfg(test)]
mod socket_tests;
mod stream;
#[cfg(test)]
mod tests;
mod view;
#[cfg(test)]
mod view_tests;

pub use decode::{DecodeFrameError, FrameLimits, SHIPPED_FRAME_LIMITS, decode_jpeg};
pub use socket::{CameraClient, CameraLinkError, CameraWaitError};
pub use stream::{CameraFrame, CameraStream, CameraStreamError, MAX_FRAME, stream_request};
pub use view::{CameraView, ViewError};
