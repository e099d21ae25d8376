//! What a program moves and feels: the seam between the language and a robot.

/// Force mode as the program asks for it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ForceMode {
    /// Frame in the base: metres and a rotation vector.
    pub frame: [f64; 6],
    /// Which of its axes give way.
    pub compliant: [bool; 6],
    /// What the robot applies along them, N and Nm.
    pub wrench: [f64; 6],
    /// Largest speed of the axes that give way (m/s, rad/s), largest deviation of the others (m, rad).
    pub limits: [f64; 6],
}

/// What a watchdog does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum WatchdogAction {
    /// Nothing.
    Ignore,
    /// The program waits.
    Pause,
    /// The program ends.
    Stop,
}

/// `rtde_set_watchdog`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Watchdog {
    /// Number of the integer input that is watched.
    pub register: usize,
    /// How often it has to be written at least; 0 takes the watchdog away.
    pub rate_hz: f64,
    /// What happens when it is not.
    pub action: WatchdogAction,
}

/// A robot as its programs see it. Where something cannot be done, the words say why, and the program ends.
pub trait Hands {
    /// Where the tool is: metres and a rotation vector.
    fn tcp_pose(&self) -> [f64; 6];
    /// How fast it moves: m/s and rad/s.
    fn tcp_speed(&self) -> [f64; 6];
    /// What the sensor feels, zeroed: N and Nm in the axes of the base.
    fn tcp_force(&self) -> [f64; 6];
    /// Joint angles, rad.
    fn joints(&self) -> [f64; 6];
    /// How fast they turn, rad/s.
    fn joint_speeds(&self) -> [f64; 6];
    /// Grip centre at the flange.
    fn tool(&self) -> [f64; 6];
    /// Weight at the flange, kg.
    fn payload_kg(&self) -> f64;

    /// An integer input; `None` if there is no such register.
    fn input_int(&self, register: usize) -> Option<i32>;
    /// A floating input.
    fn input_float(&self, register: usize) -> Option<f64>;
    /// An input that is true or false.
    fn input_bool(&self, register: usize) -> Option<bool>;
    /// An integer output; `None` if there is no such register.
    fn output_int(&mut self, register: usize) -> Option<&mut i32>;
    /// A floating output.
    fn output_float(&mut self, register: usize) -> Option<&mut f64>;
    /// Writes an output that is true or false; whether there is such a register.
    fn write_output_bool(&mut self, register: usize, value: bool) -> bool;

    /// Weight at the flange, and its centre where it is given.
    ///
    /// # Errors
    ///
    /// A weight that the robot does not take.
    fn set_payload(&mut self, mass_kg: f64, centre_m: Option<[f64; 3]>) -> Result<(), String>;
    /// Grip centre at the flange.
    ///
    /// # Errors
    ///
    /// A tool that the robot does not take.
    fn set_tool(&mut self, tool: [f64; 6]) -> Result<(), String>;
    /// What the sensor feels now becomes zero.
    fn zero_sensor(&mut self);
    /// Force mode begins, or gets other numbers.
    ///
    /// # Errors
    ///
    /// Where the robot cannot.
    fn force_mode(&mut self, mode: ForceMode) -> Result<(), String>;
    /// Force mode ends.
    fn end_force_mode(&mut self);
    /// Damping of force mode, 0 to 1.
    fn set_damping(&mut self, damping: f64);
    /// Gain of force mode, 0 to 2.
    fn set_gain(&mut self, gain: f64);

    /// Begins to move in a line.
    ///
    /// # Errors
    ///
    /// Where the robot cannot.
    fn move_line(&mut self, target: [f64; 6], acceleration_m_s2: f64, speed_m_s: f64) -> Result<(), String>;
    /// Begins to turn its joints to others.
    ///
    /// # Errors
    ///
    /// Where the robot cannot.
    fn move_joints(
        &mut self,
        target_rad: [f64; 6],
        acceleration_rad_s2: f64,
        speed_rad_s: f64,
    ) -> Result<(), String>;
    /// Begins to brake.
    fn brake(&mut self, deceleration_m_s2: f64);
    /// Begins to brake its joints.
    fn brake_joints(&mut self, deceleration_rad_s2: f64);
    /// Whether a motion or a braking is still under way.
    fn is_moving(&self) -> bool;

    /// Sets a watchdog.
    fn set_watchdog(&mut self, watchdog: Watchdog);
    /// Somebody may read this.
    fn message(&mut self, text: String);
}
