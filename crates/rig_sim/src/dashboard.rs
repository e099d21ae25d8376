//! The dashboard of the virtual rig: one line in, one line out, without a socket.
//!
//! Source: Universal Robots, "Dashboard Server e-Series, port 29999": commands and answers word for word. Commands that only
//! change what the teach pendant shows or loads are not there; they are answered like unknown ones.

use super::controller::Controller;
use super::robot::RuntimeState;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};

/// Longest piece of an unknown line that is repeated.
const MAX_REPEATED: usize = 200;

/// An answer.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Reply {
    /// The line, without its end (`\n`).
    pub text: String,
    /// Whether the connection is closed after it.
    pub close: bool,
}

/// The line a client is greeted with, without its end.
pub fn greeting() -> &'static str {
    "Connected: Universal Robots Dashboard Server"
}

/// The answer to a line, with or without its end. Capitals and blanks do not matter.
pub fn reply(line: &str, controller: &mut Controller) -> Reply {
    let command = line.split_whitespace().collect::<Vec<_>>().join(" ").to_ascii_lowercase();
    let (mode, safety) = (controller.robot().mode, controller.robot().safety);
    let runtime = controller.robot().runtime;
    let text = match command.as_str() {
        "robotmode" => format!("Robotmode: {}", mode.name()),
        "safetystatus" => format!("Safetystatus: {}", safety.name()),
        "programstate" => {
            let state = match runtime {
                RuntimeState::Playing | RuntimeState::Stopping => "PLAYING",
                RuntimeState::Paused => "PAUSED",
                RuntimeState::Stopped => "STOPPED",
            };
            format!("{state} {}", controller.program_title().unwrap_or_default()).trim_end().into()
        }
        "running" => {
            let runs = matches!(runtime, RuntimeState::Playing | RuntimeState::Stopping);
            format!("Program running: {runs}")
        }
        "get loaded program" => match controller.program_title() {
            None => "No program loaded".into(),
            Some(title) => format!("Loaded program: {title}"),
        },
        // The e-Series has no name of its own here.
        "get robot model" => "UR5".into(),
        "get serial number" => "20265000001".into(),
        "polyscopeversion" => "URSoftware 5.12.0.1101319 (Mar 22 2022)".into(),
        "is in remote control" => "true".into(),
        "power on" | "brake release" if !matches!(safety, SafetyStatus::Normal | SafetyStatus::Reduced) => {
            format!("Failed: the robot is in {}", safety.name())
        }
        "power on" => {
            if mode != RobotMode::Running {
                controller.set_mode(RobotMode::Idle);
            }
            "Powering on".into()
        }
        "brake release" => {
            controller.set_mode(RobotMode::Running);
            "Brake releasing".into()
        }
        "power off" => {
            controller.set_mode(RobotMode::PowerOff);
            "Powering off".into()
        }
        "unlock protective stop" => match controller.unlock() {
            Ok(()) => "Protective stop releasing".into(),
            Err(e) => format!("Cannot unlock protective stop: {e}"),
        },
        "restart safety" => {
            controller.restart_safety();
            controller.set_mode(RobotMode::PowerOff);
            "Restarting safety".into()
        }
        "play" if controller.program_title().is_none() || safety != SafetyStatus::Normal => {
            "Failed to execute: play".into()
        }
        "play" => {
            controller.play();
            "Starting program".into()
        }
        "stop" => {
            controller.stop_program("the dashboard said stop");
            "Stopped".into()
        }
        "pause" => {
            controller.pause();
            "Pausing program".into()
        }
        "close popup" => "closing popup".into(),
        "close safety popup" => "closing safety popup".into(),
        "quit" => return Reply { text: "Disconnected".into(), close: true },
        _ => {
            let repeated: String =
                line.trim().chars().filter(|c| !c.is_control()).take(MAX_REPEATED).collect();
            format!("could not understand: \"{repeated}\"")
        }
    };
    Reply { text, close: false }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::spring::Spring;
    use gripgen_rig::program::TcpPose;
    use std::sync::Arc;

    fn robot() -> Controller {
        let tcp = TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] };
        Controller::new(Arc::new(Spring::default()), tcp, 1.0)
    }

    #[test]
    fn answers_are_those_of_the_table() {
        assert_eq!(greeting(), "Connected: Universal Robots Dashboard Server");
        let mut robot = robot();
        robot.set_mode(RobotMode::PowerOff);
        let talk = |robot: &mut Controller, lines: &[(&str, &str)]| {
            for (line, wanted) in lines {
                assert_eq!(reply(line, robot), Reply { text: (*wanted).into(), close: false }, "{line}");
            }
        };
        talk(
            &mut robot,
            &[
                ("robotmode\n", "Robotmode: POWER_OFF"),
                ("power on", "Powering on"),
                ("robotmode", "Robotmode: IDLE"),
                ("brake release", "Brake releasing"),
                ("robotmode\r\n", "Robotmode: RUNNING"),
                ("safetystatus", "Safetystatus: NORMAL"),
                ("programState", "STOPPED"),
                ("running", "Program running: false"),
                ("play", "Failed to execute: play"),
                ("get loaded program", "No program loaded"),
            ],
        );
        robot.run_script("def pull():\n  while True:\n    sync()\n  end\nend\n");
        talk(
            &mut robot,
            &[
                ("programState", "PLAYING pull"),
                ("running", "Program running: true"),
                ("pause", "Pausing program"),
                ("programState", "PAUSED pull"),
                ("running", "Program running: false"),
                ("get loaded program", "Loaded program: pull"),
                ("play", "Starting program"),
                ("running", "Program running: true"),
                ("stop", "Stopped"),
                ("unlock protective stop", "Protective stop releasing"),
                ("close safety popup", "closing safety popup"),
                ("close popup", "closing popup"),
                ("restart safety", "Restarting safety"),
                ("power off", "Powering off"),
                ("is in remote control", "true"),
                ("PolyscopeVersion", "URSoftware 5.12.0.1101319 (Mar 22 2022)"),
                ("get serial number", "20265000001"),
                ("get robot model", "UR5"),
                ("  Get  Robot MODEL ", "UR5"),
            ],
        );
        assert_eq!(reply("quit", &mut robot), Reply { text: "Disconnected".into(), close: true });
    }

    #[test]
    fn a_robot_that_is_stopped_refuses_in_one_line() {
        let mut robot = robot();
        robot.protective_stop();
        for (line, wanted) in [
            ("safetystatus", "Safetystatus: PROTECTIVE_STOP"),
            ("power on", "Failed: the robot is in PROTECTIVE_STOP"),
            ("brake release", "Failed: the robot is in PROTECTIVE_STOP"),
            (
                "unlock protective stop",
                "Cannot unlock protective stop: 0.0 s have passed since the stop, 5 s are needed",
            ),
        ] {
            assert_eq!(reply(line, &mut robot).text, wanted, "{line}");
        }
    }

    #[test]
    fn what_is_not_understood_is_repeated() {
        let mut robot = robot();
        assert_eq!(reply("dance\r\n", &mut robot).text, "could not understand: \"dance\"");
        assert_eq!(reply("", &mut robot).text, "could not understand: \"\"");
        assert_eq!(reply("power\u{0}on", &mut robot).text, "could not understand: \"poweron\"");
        assert!(reply(&"\u{e4}".repeat(100_000), &mut robot).text.chars().count() < 300);
        assert_eq!(robot.robot().mode, RobotMode::Running);
    }
}
