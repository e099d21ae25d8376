//! What the primary and the secondary port send: messages of the controller, and the robot's mode.
//!
//! The layouts are those of [`gripgen_rig::primary`], and of the robot's state in the same document. A text that is longer than its
//! place is cut at the end of a character.

use crate::controller::{Announcement, Controller};
use crate::robot::RuntimeState;
use crate::rtde::CONTROLLER_VERSION;
use gripgen_rig::primary::{MAX_PACKET, PROGRAM_STARTED, PROGRAM_STOPPED};
use gripgen_rig::robot_state::SafetyStatus;

/// Longest text at the end of a packet: what is before it always fits into the rest.
const MAX_TEXT: usize = MAX_PACKET - 512;

/// The first message of a connection.
pub(super) fn version_message() -> Vec<u8> {
    let [major, minor, bugfix, build] = CONTROLLER_VERSION;
    let mut content = short_text("URControl", 127);
    content.extend([major as u8, minor as u8]);
    content.extend([bugfix, build].into_iter().flat_map(u32::to_be_bytes));
    content.extend(b"22-03-2022, 00:00:00");
    message(u64::MAX, 3, &content)
}

/// An announcement as a message.
pub(super) fn announcement_message(announcement: &Announcement, time_s: f64) -> Vec<u8> {
    let ticks = device_ticks(time_s);
    let key = |title: &str, text: &str| {
        // No code and no argument.
        let content = [&[0; 8][..], &short_text(title, 255), cut(text, MAX_TEXT).as_bytes()].concat();
        message(ticks, 7, &content)
    };
    match announcement {
        Announcement::Started { title } => key(PROGRAM_STARTED, title),
        Announcement::Stopped { title, why } if why.is_empty() => key(PROGRAM_STOPPED, title),
        Announcement::Stopped { title, why } => key(PROGRAM_STOPPED, &format!("{title}: {why}")),
        Announcement::Said { text } => key("", text),
        Announcement::CannotRun { problem } => {
            // C207A0 of level 3, without data: a problem with a client, as the controller reports a fieldbus that is gone.
            let numbers = [207, 0, 3, 0, 0].into_iter().flat_map(i32::to_be_bytes);
            let content: Vec<u8> = numbers.chain(cut(problem, MAX_TEXT).bytes()).collect();
            message(ticks, 6, &content)
        }
        Announcement::Safety(safety) => {
            // Code and argument before the mode, a number and its type behind it.
            let content = [&[0; 8][..], &[safety.number() as u8], &[0; 8]].concat();
            message(ticks, 5, &content)
        }
    }
}

/// A robot state that has the mode and nothing else; the byte at its end is reserved.
pub(super) fn robot_mode_packet(controller: &Controller) -> Vec<u8> {
    use SafetyStatus::{ProtectiveStop, RobotEmergencyStop, SystemEmergencyStop};
    let robot = controller.robot();
    let flags = [
        // The controller believes that its arm is real, and that it may use it, as on a rig.
        true,
        true,
        robot.status_bits() & 1 == 1,
        matches!(robot.safety, RobotEmergencyStop | SystemEmergencyStop),
        robot.safety == ProtectiveStop,
        robot.runtime == RuntimeState::Playing,
        robot.runtime == RuntimeState::Paused,
    ];
    let mut content = device_ticks(robot.timestamp_s).to_be_bytes().to_vec();
    content.extend(flags.map(u8::from));
    // 2 is force, 0 position.
    content.extend([robot.mode.number() as u8, if controller.arm().applies_force() { 2 } else { 0 }]);
    // Slider, limiter, and the largest slider that is allowed.
    content.extend([1.0_f64; 3].into_iter().flat_map(f64::to_be_bytes));
    content.push(0);
    packet(16, &packet(0, &content))
}

/// The controller's clock, as the primary interface has it here.
fn device_ticks(time_s: f64) -> u64 {
    (time_s * 1e6) as u64
}

fn message(ticks: u64, kind: u8, content: &[u8]) -> Vec<u8> {
    // Source -2.
    packet(20, &[&ticks.to_be_bytes()[..], &[254, kind], content].concat())
}

/// Packets and sub-packets begin alike: with their size and a type. No content is longer than [`MAX_PACKET`].
fn packet(kind: u8, content: &[u8]) -> Vec<u8> {
    let size = (5 + content.len()) as u32;
    [&size.to_be_bytes()[..], &[kind], content].concat()
}

/// A text behind its length of one byte.
fn short_text(text: &str, most: usize) -> Vec<u8> {
    let text = cut(text, most);
    [&[text.len() as u8], text.as_bytes()].concat()
}

fn cut(text: &str, most: usize) -> &str {
    &text[..text.floor_char_boundary(most)]
}
