//! The dashboard of the virtual rig: one line in, one line out, without a socket.
//!
//! Source: Universal Robots, "Dashboard Server e-Series, port 29999": commands and answers word for word. Commands that only
//! change what the teach pendant shows or loads are not there; they are answered like unknown ones.

use gripgen_rig::robot_state::{RobotMode, SafetyStatus};

/// Longest piece of an unknown line that is repeated.
const MAX_REPEATED: usize = 200;

/// What the program on the robot does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ProgramState {
    /// Nothing.
    Stopped,
    /// It runs.
    Playing,
    /// It waits.
    Paused,
}

impl ProgramState {
    /// Its word on the dashboard.
    pub fn name(self) -> &'static str {
        match self {
            Self::Stopped => "STOPPED",
            Self::Playing => "PLAYING",
            Self::Paused => "PAUSED",
        }
    }
}

/// What the dashboard can read of a robot and do to it. Where something is refused, the error is the line that is answered.
pub trait DashboardRobot {
    /// What the robot as a whole does.
    fn robot_mode(&self) -> RobotMode;
    /// What its safety system says.
    fn safety_status(&self) -> SafetyStatus;
    /// What its program does.
    fn program_state(&self) -> ProgramState;
    /// The name of the program, with its ending; nothing where none is loaded.
    fn program_name(&self) -> &str;
    /// `UR5` and the like: the e-Series has no name of its own here.
    fn model(&self) -> &str;
    /// Digits.
    fn serial_number(&self) -> &str;
    /// In the style of `URSoftware 5.12.0.1101319 (Mar 22 2022)`.
    fn polyscope_version(&self) -> &str;
    /// Whether clients may command it.
    fn remote_control(&self) -> bool;
    /// Gives the arm power, with its brakes on.
    fn power_on(&mut self) -> Result<(), String>;
    /// Takes it away.
    fn power_off(&mut self) -> Result<(), String>;
    /// Gives it power, if it has none, and releases its brakes.
    fn brake_release(&mut self) -> Result<(), String>;
    /// Leaves a protective stop; a robot refuses until five seconds after it.
    fn unlock_protective_stop(&mut self) -> Result<(), String>;
    /// Closes a popup.
    fn close_popup(&mut self);
    /// Closes a popup of the safety system.
    fn close_safety_popup(&mut self);
    /// Starts the safety system anew after a fault; the arm is without power then.
    fn restart_safety(&mut self) -> Result<(), String>;
    /// Starts the program.
    fn play(&mut self) -> Result<(), String>;
    /// Ends it.
    fn stop_program(&mut self) -> Result<(), String>;
    /// Lets it wait.
    fn pause_program(&mut self) -> Result<(), String>;
}

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
pub fn reply(line: &str, robot: &mut dyn DashboardRobot) -> Reply {
    let command = line.split_whitespace().collect::<Vec<_>>().join(" ").to_ascii_lowercase();
    let text = match command.as_str() {
        "robotmode" => format!("Robotmode: {}", robot.robot_mode().name()),
        "safetystatus" => format!("Safetystatus: {}", robot.safety_status().name()),
        "programstate" => {
            format!("{} {}", robot.program_state().name(), robot.program_name()).trim_end().into()
        }
        "running" => format!("Program running: {}", robot.program_state() == ProgramState::Playing),
        "get loaded program" if robot.program_name().is_empty() => "No program loaded".into(),
        "get loaded program" => format!("Loaded program: {}", robot.program_name()),
        "get robot model" => robot.model().into(),
        "get serial number" => robot.serial_number().into(),
        "polyscopeversion" => robot.polyscope_version().into(),
        "is in remote control" => robot.remote_control().to_string(),
        "power on" => done(robot.power_on(), "Powering on"),
        "power off" => done(robot.power_off(), "Powering off"),
        "brake release" => done(robot.brake_release(), "Brake releasing"),
        "unlock protective stop" => done(robot.unlock_protective_stop(), "Protective stop releasing"),
        "restart safety" => done(robot.restart_safety(), "Restarting safety"),
        "play" => done(robot.play(), "Starting program"),
        "stop" => done(robot.stop_program(), "Stopped"),
        "pause" => done(robot.pause_program(), "Pausing program"),
        "close popup" => {
            robot.close_popup();
            "closing popup".into()
        }
        "close safety popup" => {
            robot.close_safety_popup();
            "closing safety popup".into()
        }
        "quit" => return Reply { text: "Disconnected".into(), close: true },
        _ => {
            let repeated: String =
                line.trim().chars().filter(|c| !c.is_control()).take(MAX_REPEATED).collect();
            format!("could not understand: \"{repeated}\"")
        }
    };
    Reply { text, close: false }
}

/// What is answered to a command: these words, or why not, as one line.
fn done(result: Result<(), String>, words: &str) -> String {
    match result {
        Ok(()) => words.into(),
        Err(reason) => reason.split_whitespace().collect::<Vec<_>>().join(" "),
    }
}
