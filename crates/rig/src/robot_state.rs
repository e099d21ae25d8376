//! What state the robot says it is in: the same in RTDE (`robot_mode`, `safety_mode`, `safety_status`), on the primary
//! interface and, as words, on the dashboard.
//!
//! The numbers are those of Universal Robots' "Real-Time Data Exchange (RTDE) Guide", as the Universal Robots Client Library has
//! them; so are the words, which the dashboard writes.

#[cfg(test)]
mod tests;

/// What the robot as a whole does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotMode {
    /// The interface runs, the controller does not.
    NoController = -1,
    /// The controller has no robot.
    Disconnected = 0,
    /// Somebody has to confirm the safety settings.
    ConfirmSafety = 1,
    /// The controller starts.
    Booting = 2,
    /// The arm has no power.
    PowerOff = 3,
    /// The arm has power and starts.
    PowerOn = 4,
    /// The arm has power, its brakes are on.
    Idle = 5,
    /// The arm is moved by hand, with brakes released one by one.
    Backdrive = 6,
    /// The brakes are off: the arm can move.
    Running = 7,
    /// The joints get new software.
    UpdatingFirmware = 8,
}

impl RobotMode {
    /// All of them, with their words.
    const ALL: [(Self, &'static str); 10] = [
        (Self::NoController, "NO_CONTROLLER"),
        (Self::Disconnected, "DISCONNECTED"),
        (Self::ConfirmSafety, "CONFIRM_SAFETY"),
        (Self::Booting, "BOOTING"),
        (Self::PowerOff, "POWER_OFF"),
        (Self::PowerOn, "POWER_ON"),
        (Self::Idle, "IDLE"),
        (Self::Backdrive, "BACKDRIVE"),
        (Self::Running, "RUNNING"),
        (Self::UpdatingFirmware, "UPDATING_FIRMWARE"),
    ];

    /// The mode of this word, as the dashboard writes it.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, name)| *name == word).map(|(mode, _)| *mode)
    }

    /// The mode of this number: -1 to 8.
    pub fn from_number(number: i32) -> Option<Self> {
        Self::ALL.iter().find(|(mode, _)| mode.number() == number).map(|(mode, _)| *mode)
    }

    /// Its number in RTDE.
    pub fn number(self) -> i32 {
        self as i32
    }

    /// Its word on the dashboard.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(mode, _)| *mode == self).map_or("", |(_, name)| *name)
    }
}

/// What the safety system does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum SafetyStatus {
    /// Nothing is in its way.
    Normal = 1,
    /// The arm may move, within the reduced limits.
    Reduced = 2,
    /// The controller has stopped the arm by itself.
    ProtectiveStop = 3,
    /// A limit was passed: the arm is moved back by hand.
    Recovery = 4,
    /// A safeguard input has stopped the arm.
    SafeguardStop = 5,
    /// An emergency stop of the cell.
    SystemEmergencyStop = 6,
    /// The emergency stop of the robot.
    RobotEmergencyStop = 7,
    /// A safety limit was passed.
    Violation = 8,
    /// The safety system is broken.
    Fault = 9,
    /// A joint has to be identified.
    ValidateJointId = 10,
    /// Not known.
    Undefined = 11,
    /// The safeguard of automatic mode has stopped the arm.
    AutomaticModeSafeguardStop = 12,
    /// The three-position switch is not held.
    ThreePositionEnablingStop = 13,
}

impl SafetyStatus {
    /// All of them, with their words.
    const ALL: [(Self, &'static str); 13] = [
        (Self::Normal, "NORMAL"),
        (Self::Reduced, "REDUCED"),
        (Self::ProtectiveStop, "PROTECTIVE_STOP"),
        (Self::Recovery, "RECOVERY"),
        (Self::SafeguardStop, "SAFEGUARD_STOP"),
        (Self::SystemEmergencyStop, "SYSTEM_EMERGENCY_STOP"),
        (Self::RobotEmergencyStop, "ROBOT_EMERGENCY_STOP"),
        (Self::Violation, "VIOLATION"),
        (Self::Fault, "FAULT"),
        (Self::ValidateJointId, "VALIDATE_JOINT_ID"),
        (Self::Undefined, "UNDEFINED_SAFETY_MODE"),
        (Self::AutomaticModeSafeguardStop, "AUTOMATIC_MODE_SAFEGUARD_STOP"),
        (Self::ThreePositionEnablingStop, "SYSTEM_THREE_POSITION_ENABLING_STOP"),
    ];

    /// The status of this word, as the dashboard writes it.
    pub fn from_word(word: &str) -> Option<Self> {
        Self::ALL.iter().find(|(_, name)| *name == word).map(|(status, _)| *status)
    }

    /// The status of this number: 1 to 13. RTDE's `safety_mode` knows the first eleven.
    pub fn from_number(number: i32) -> Option<Self> {
        Self::ALL.iter().find(|(status, _)| status.number() == number).map(|(status, _)| *status)
    }

    /// Its number in RTDE.
    pub fn number(self) -> i32 {
        self as i32
    }

    /// Its word on the dashboard.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(status, _)| *status == self).map_or("", |(_, name)| *name)
    }

    /// Whether a program may move the arm.
    pub fn allows_motion(self) -> bool {
        matches!(self, Self::Normal | Self::Reduced)
    }
}
