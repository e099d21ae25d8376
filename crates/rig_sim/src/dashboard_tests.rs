use super::dashboard::*;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};

/// A robot that does as it is told, and remembers it.
struct Told {
    mode: RobotMode,
    safety: SafetyStatus,
    program: ProgramState,
    name: &'static str,
    refuses: Option<&'static str>,
    told: Vec<&'static str>,
}

fn robot() -> Told {
    let (mode, safety, program) = (RobotMode::PowerOff, SafetyStatus::Normal, ProgramState::Stopped);
    Told { mode, safety, program, name: "pull.urp", refuses: None, told: Vec::new() }
}

impl Told {
    fn tell(&mut self, what: &'static str) -> Result<(), String> {
        self.told.push(what);
        self.refuses.map_or(Ok(()), |reason| Err(reason.into()))
    }
}

impl DashboardRobot for Told {
    fn robot_mode(&self) -> RobotMode {
        self.mode
    }
    fn safety_status(&self) -> SafetyStatus {
        self.safety
    }
    fn program_state(&self) -> ProgramState {
        self.program
    }
    fn program_name(&self) -> &str {
        self.name
    }
    fn model(&self) -> &str {
        "UR5"
    }
    fn serial_number(&self) -> &str {
        "20195501234"
    }
    fn polyscope_version(&self) -> &str {
        "URSoftware 5.12.0.1101319 (Mar 22 2022)"
    }
    fn remote_control(&self) -> bool {
        true
    }
    fn power_on(&mut self) -> Result<(), String> {
        self.mode = RobotMode::Idle;
        self.tell("power on")
    }
    fn power_off(&mut self) -> Result<(), String> {
        self.tell("power off")
    }
    fn brake_release(&mut self) -> Result<(), String> {
        self.mode = RobotMode::Running;
        self.tell("brake release")
    }
    fn unlock_protective_stop(&mut self) -> Result<(), String> {
        self.tell("unlock")
    }
    fn close_popup(&mut self) {
        self.told.push("close popup");
    }
    fn close_safety_popup(&mut self) {
        self.told.push("close safety popup");
    }
    fn restart_safety(&mut self) -> Result<(), String> {
        self.tell("restart safety")
    }
    fn play(&mut self) -> Result<(), String> {
        self.program = ProgramState::Playing;
        self.tell("play")
    }
    fn stop_program(&mut self) -> Result<(), String> {
        self.program = ProgramState::Stopped;
        self.tell("stop")
    }
    fn pause_program(&mut self) -> Result<(), String> {
        self.program = ProgramState::Paused;
        self.tell("pause")
    }
}

#[test]
fn answers_are_those_of_the_table() {
    assert_eq!(greeting(), "Connected: Universal Robots Dashboard Server");
    let mut robot = robot();
    for (line, wanted) in [
        ("robotmode\n", "Robotmode: POWER_OFF"),
        ("power on", "Powering on"),
        ("robotmode", "Robotmode: IDLE"),
        ("brake release", "Brake releasing"),
        ("robotmode\r\n", "Robotmode: RUNNING"),
        ("safetystatus", "Safetystatus: NORMAL"),
        ("programState", "STOPPED pull.urp"),
        ("running", "Program running: false"),
        ("play", "Starting program"),
        ("running", "Program running: true"),
        ("programState", "PLAYING pull.urp"),
        ("pause", "Pausing program"),
        ("programState", "PAUSED pull.urp"),
        ("running", "Program running: false"),
        ("stop", "Stopped"),
        ("get loaded program", "Loaded program: pull.urp"),
        ("unlock protective stop", "Protective stop releasing"),
        ("close safety popup", "closing safety popup"),
        ("close popup", "closing popup"),
        ("restart safety", "Restarting safety"),
        ("power off", "Powering off"),
        ("is in remote control", "true"),
        ("PolyscopeVersion", "URSoftware 5.12.0.1101319 (Mar 22 2022)"),
        ("get serial number", "20195501234"),
        ("get robot model", "UR5"),
        ("  Get  Robot MODEL ", "UR5"),
    ] {
        assert_eq!(reply(line, &mut robot), Reply { text: wanted.into(), close: false }, "{line}");
    }
    let done = [
        "power on",
        "brake release",
        "play",
        "pause",
        "stop",
        "unlock",
        "close safety popup",
        "close popup",
        "restart safety",
        "power off",
    ];
    assert_eq!(robot.told, done);
    assert_eq!(reply("quit", &mut robot), Reply { text: "Disconnected".into(), close: true });
}

#[test]
fn states_are_told_in_the_words_of_the_dashboard() {
    let mut robot = robot();
    robot.safety = SafetyStatus::ProtectiveStop;
    robot.name = "";
    assert_eq!(reply("safetystatus", &mut robot).text, "Safetystatus: PROTECTIVE_STOP");
    assert_eq!(reply("programState", &mut robot).text, "STOPPED");
    assert_eq!(reply("get loaded program", &mut robot).text, "No program loaded");
}

#[test]
fn a_refusal_is_one_line() {
    let mut robot = robot();
    robot.refuses = Some("Cannot unlock protective stop until 5s after occurrence.\nAlways inspect cause");
    let wanted = "Cannot unlock protective stop until 5s after occurrence. Always inspect cause";
    for line in [
        "unlock protective stop",
        "power on",
        "power off",
        "brake release",
        "restart safety",
        "play",
        "stop",
        "pause",
    ] {
        assert_eq!(reply(line, &mut robot), Reply { text: wanted.into(), close: false }, "{line}");
    }
}

#[test]
fn what_is_not_understood_is_repeated() {
    let mut robot = robot();
    assert_eq!(reply("dance\r\n", &mut robot).text, "could not understand: \"dance\"");
    assert_eq!(reply("", &mut robot).text, "could not understand: \"\"");
    assert_eq!(reply("power\u{0}on", &mut robot).text, "could not understand: \"poweron\"");
    assert!(reply(&"\u{e4}".repeat(100_000), &mut robot).text.chars().count() < 300);
    assert!(robot.told.is_empty());
}
