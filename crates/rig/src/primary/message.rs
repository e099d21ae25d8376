//! What a controller says on the primary interface.

use crate::robot_state::RobotMode;

/// Title of the key message of a program that has started; its text is the name of the program.
pub const PROGRAM_STARTED: &str = "PROGRAM_XXX_STARTED";
/// Title of the key message of a program that has ended, in whatever way.
pub const PROGRAM_STOPPED: &str = "PROGRAM_XXX_STOPPED";

/// What every robot message begins with.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct MessageHeader {
    /// The controller's clock; the documents give no unit.
    pub device_ticks: u64,
    /// Which part of the controller speaks: -2 says the version, -3 safety modes and runtime exceptions.
    pub source: i8,
}

/// The first message of a connection.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct VersionMessage {
    /// Name of the software, `URControl`; at most 127 bytes.
    pub project: String,
    /// 5 for e-Series, 3 for CB3.
    pub major: u8,
    /// The second number.
    pub minor: u8,
    /// The third.
    pub bugfix: i32,
    /// The fourth.
    pub build: i32,
    /// When it was built.
    pub date: String,
}

/// The safety system has changed its mode.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SafetyModeMessage {
    /// Code of the message, the number behind the C.
    pub code: i32,
    /// Its argument, the number behind the A.
    pub argument: i32,
    /// The mode: [`SafetyStatus::from_number`](crate::robot_state::SafetyStatus::from_number), which names 1 to 13 of them.
    pub mode: u8,
    /// How `data` is meant: 0 and 1 unsigned, 2 signed, 3 a float's bits, 4 hexadecimal.
    pub data_type: u32,
    /// What is reported with it.
    pub data: u32,
}

/// An entry of the controller's log, shown as `C153A3`.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct ErrorCodeMessage {
    /// The number behind the C.
    pub code: i32,
    /// The number behind the A.
    pub argument: i32,
    /// 0 debug, 1 information, 2 warning, 3 violation, 4 fault, 5 critical fault; from 128 on the same for developers.
    pub level: i32,
    /// How `data` is meant, as in [`SafetyModeMessage`].
    pub data_type: u32,
    /// What is reported with it.
    pub data: u32,
    /// In words.
    pub text: String,
}

/// Something that has a title, such as the start of a program: [`PROGRAM_STARTED`].
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct KeyMessage {
    /// The number behind the C.
    pub code: i32,
    /// The number behind the A.
    pub argument: i32,
    /// What happened; at most 255 bytes.
    pub title: String,
    /// With what.
    pub text: String,
}

/// The program is wrong, before it starts or where it runs.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct RuntimeException {
    /// Line of the program, from 1.
    pub line: u32,
    /// Column in that line.
    pub column: u32,
    /// What is wrong, such as `compile_error_name_not_found:txtmsg:`.
    pub text: String,
}

/// A robot message.
#[derive(Debug, Clone, PartialEq, Eq)]
#[non_exhaustive]
pub enum RobotMessage {
    /// Words, such as those of `textmsg`.
    Text(String),
    /// The first message of a connection.
    Version(VersionMessage),
    /// The safety system has changed its mode.
    SafetyMode(SafetyModeMessage),
    /// An entry of the controller's log.
    ErrorCode(ErrorCodeMessage),
    /// Something that has a title.
    Key(KeyMessage),
    /// The program is wrong.
    RuntimeException(RuntimeException),
}

/// State of the robot as a whole.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct RobotModeData {
    /// The controller's clock; the documents give no unit.
    pub device_ticks: u64,
    /// The controller has a real arm.
    pub real_robot_connected: bool,
    /// And may use it.
    pub real_robot_enabled: bool,
    /// The arm has power.
    pub power_on: bool,
    /// An emergency stop is pressed.
    pub emergency_stopped: bool,
    /// A protective stop holds the arm.
    pub protective_stopped: bool,
    /// A program runs.
    pub program_running: bool,
    /// A program stands and can go on.
    pub program_paused: bool,
    /// Number of the mode: [`mode`](Self::mode).
    pub mode_number: i8,
    /// 0 position, 1 teach, 2 force, 3 torque.
    pub control_mode: u8,
    /// Speed slider, 0 to 1.
    pub target_speed_fraction: f64,
    /// Speed over the speed that was programmed, 0 to 1.
    pub speed_scaling: f64,
    /// Largest speed slider that is allowed, 0 to 1.
    pub target_speed_fraction_limit: f64,
}

impl RobotModeData {
    /// The mode, if its number is known.
    pub fn mode(&self) -> Option<RobotMode> {
        RobotMode::from_number(i32::from(self.mode_number))
    }
}

/// What a packet brings.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub enum PrimaryEvent {
    /// A robot message.
    Message {
        /// When, and by whom.
        header: MessageHeader,
        /// What it says.
        message: RobotMessage,
    },
    /// State of the robot as a whole, ten times per second.
    RobotMode(RobotModeData),
}
