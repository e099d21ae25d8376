//! The dashboard server of e-Series controllers (TCP port 29999): commands for people and hosts, one line each, and one line
//! of answer to each. PolyScope X has no such server.
//!
//! The commands are those of Universal Robots' "Dashboard Server e-Series, port 29999"; the answers are those that the Universal
//! Robots Client Library expects.

mod command;
mod session;
mod socket;
#[cfg(test)]
mod socket_tests;
#[cfg(test)]
mod tests;

pub use command::{DashboardCommand, DashboardReply, DashboardReplyError, PolyscopeVersion};
pub use session::{DashboardEvent, DashboardLink, DashboardSendError, DashboardSessionError, GREETING};
pub use socket::{DashboardClient, DashboardError, DashboardLinkError};
