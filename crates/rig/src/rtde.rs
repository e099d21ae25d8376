//! RTDE, the Real-Time Data Exchange of Universal Robots (TCP port 30004): framing, recipes, the session of a client,
//! and the client on a socket.
//!
//! Source of the wire format: Universal Robots, "Real-Time Data Exchange (RTDE) Guide"; checked against the byte sequences
//! in the unit tests of the Universal Robots Client Library.

mod frame;
mod recipe;
mod session;
mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
mod tests;
mod value;

pub use frame::{Frame, FrameError, FrameTooLongError, Framer, Kind, encode_frame};
pub use recipe::{Recipe, RecipeError};
pub use session::{Event, Link, SessionError, SessionPlan, WriteInputError};
pub use socket::{LinkError, RtdeClient, RtdeWriter, WriteError};
pub use value::{FieldType, Value, ValueError};
