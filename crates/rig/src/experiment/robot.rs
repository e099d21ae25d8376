//! The robot's readings, and the heartbeat that keeps its program alive.

use super::fault::Fault;
use crate::link::lock;
use crate::program::{Phase, TcpPose, registers};
use crate::robot_state::{RobotMode, SafetyStatus};
use crate::rtde::{Recipe, RtdeClient, SessionPlan, Value};
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Rate that readings are asked for.
pub(super) const RATE_HZ: f64 = 500.0;
/// Time between two beats: the program wants ten per second at least.
const BEAT: Duration = Duration::from_millis(10);
/// An experiment that has not looked at its robot for so long is taken for dead.
const ALIVE: Duration = Duration::from_millis(500);

/// A reading of the robot.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotRow {
    /// When it arrived.
    pub at: Instant,
    /// The controller's clock.
    pub timestamp_s: f64,
    /// Where the tool is.
    pub tcp: TcpPose,
    /// How fast it moves: m/s and rad/s.
    pub speed: [f64; 6],
    /// Force and torque at the tool as the robot says them, zeroed: N and Nm.
    pub force: [f64; 6],
    /// The same before zeroing.
    pub raw_force: [f64; 6],
    /// Power and brakes, as a number.
    pub mode: i32,
    /// Safety, as a number.
    pub safety: i32,
    /// Its bits.
    pub safety_bits: u32,
    /// The program: 2 while it runs.
    pub runtime: u32,
    /// What the trajectory limiter leaves of the speed, 1 for all of it.
    pub speed_scaling: f64,
    /// The speed slider, 1 for 100 %.
    pub speed_slider: f64,
    /// What the program says it does, as a number.
    pub phase: i32,
    /// Which step of the staircase.
    pub step: i32,
    /// Which run.
    pub run: i32,
    /// Why it stopped.
    pub reason: i32,
    /// The commanded force, N.
    pub desired_n: f64,
    /// Displacement along the pull.
    pub displacement_m: f64,
    /// Displacement aside.
    pub lateral_m: f64,
    /// Force along the pull before it, N, as the robot says it.
    pub preload_n: f64,
}

const OUTPUTS: [&str; 19] = [
    "timestamp",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "ft_raw_wrench",
    "robot_mode",
    "safety_mode",
    "safety_status_bits",
    "runtime_state",
    "speed_scaling",
    "output_int_register_24",
    "output_int_register_25",
    "output_int_register_26",
    "output_int_register_27",
    "output_double_register_24",
    "output_double_register_25",
    "output_double_register_26",
    "output_double_register_27",
    // The slider: `speed_scaling` is the limiter's alone (RTDE guide).
    "target_speed_fraction",
];

/// What is asked of RTDE.
pub(super) fn session_plan() -> SessionPlan {
    let input = |register: u8| format!("input_int_register_{register}");
    SessionPlan {
        outputs: OUTPUTS.map(String::from).to_vec(),
        frequency_hz: RATE_HZ,
        inputs: vec![vec![input(registers::HEARTBEAT), input(registers::GO)]],
    }
}

impl RobotRow {
    /// Reads a data frame of [`session_plan`]; `None` if its types are others.
    pub(super) fn from_values(at: Instant, values: &[Value]) -> Option<Self> {
        let double = |i: usize| if let Some(Value::Double(x)) = values.get(i) { Some(*x) } else { None };
        let vector = |i: usize| if let Some(Value::Vector6d(v)) = values.get(i) { Some(*v) } else { None };
        let int = |i: usize| if let Some(Value::Int32(x)) = values.get(i) { Some(*x) } else { None };
        let bits = |i: usize| if let Some(Value::Uint32(x)) = values.get(i) { Some(*x) } else { None };
        Some(Self {
            at,
            timestamp_s: double(0)?,
            tcp: TcpPose::from_numbers(vector(1)?),
            speed: vector(2)?,
            force: vector(3)?,
            raw_force: vector(4)?,
            mode: int(5)?,
            safety: int(6)?,
            safety_bits: bits(7)?,
            runtime: bits(8)?,
            speed_scaling: double(9)?,
            phase: int(10)?,
            step: int(11)?,
            run: int(12)?,
            reason: int(13)?,
            desired_n: double(14)?,
            displacement_m: double(15)?,
            lateral_m: double(16)?,
            preload_n: double(17)?,
            speed_slider: double(18)?,
        })
    }

    /// Whether a program runs.
    pub fn program_runs(&self) -> bool {
        self.runtime == 2
    }

    /// What the program of run `run` says it does.
    pub fn phase_of(&self, run: i32) -> Option<Phase> {
        if self.run == run { Phase::from_number(self.phase) } else { None }
    }

    /// Speed of the tool.
    pub fn speed_m_s(&self) -> f64 {
        self.speed[..3].iter().map(|v| v * v).sum::<f64>().sqrt()
    }

    /// Whether neither the slider nor the limiter slows it down.
    pub fn is_at_full_speed(&self) -> bool {
        [self.speed_scaling, self.speed_slider].into_iter().all(|share| (share - 1.0).abs() <= 0.01)
    }

    /// Whether the robot may move.
    pub(super) fn check(&self) -> Result<(), Fault> {
        let status = SafetyStatus::from_number(self.safety)
            .ok_or(Fault::Unknown { what: "safety_mode", number: self.safety })?;
        if !status.allows_motion() {
            return Err(Fault::Safety { status });
        }
        let mode = RobotMode::from_number(self.mode)
            .ok_or(Fault::Unknown { what: "robot_mode", number: self.mode })?;
        if mode != RobotMode::Running {
            return Err(Fault::Mode { mode });
        }
        if !self.is_at_full_speed() {
            let (slider_percent, limiter_percent) = (100.0 * self.speed_slider, 100.0 * self.speed_scaling);
            return Err(Fault::Speed { slider_percent, limiter_percent });
        }
        Ok(())
    }
}

/// Which types the controller answered with, where they are not those that are read here.
pub(super) fn unfit(recipe: &Recipe) -> Option<String> {
    use crate::rtde::FieldType::{Double, Int32, Uint32, Vector6d};
    let wanted = [
        Double, Vector6d, Vector6d, Vector6d, Vector6d, Int32, Int32, Uint32, Uint32, Double, Int32, Int32,
        Int32, Int32, Double, Double, Double, Double, Double,
    ];
    let pairs = recipe.fields.iter().zip(wanted);
    let wrong = pairs.filter(|((_, found), wanted)| found != wanted);
    wrong.map(|((name, found), wanted)| format!("{name} is {found:?} instead of {wanted:?}")).next()
}

/// The hand that beats, in a thread of its own, as long as the experiment is alive.
pub(super) struct Heart {
    hand: Arc<Hand>,
    thread: Option<JoinHandle<()>>,
}

struct Hand {
    go: AtomicI32,
    alive: Mutex<Instant>,
    /// Signs of life so far.
    signs: AtomicU64,
    wanted: AtomicBool,
}

impl Heart {
    /// Begins to beat. `in_step` is for a virtual rig whose clock waits for beats: then there is none without a new sign of life,
    /// so that the rig goes no faster than the experiment looks at it.
    pub(super) fn start(client: &RtdeClient, in_step: bool) -> Self {
        let writer = client.writer();
        let hand = Arc::new(Hand {
            go: AtomicI32::new(0),
            alive: Mutex::new(Instant::now()),
            signs: AtomicU64::new(0),
            wanted: AtomicBool::new(true),
        });
        let own = hand.clone();
        let thread = std::thread::spawn(move || {
            let (mut beat, mut seen) = (0_i32, 0);
            while own.wanted.load(Ordering::SeqCst) {
                let signs = own.signs.load(Ordering::SeqCst);
                // Before the first sign everything is being connected.
                let is_new = !in_step || signs == 0 || signs != seen;
                if is_new && lock(&own.alive).elapsed() < ALIVE {
                    seen = signs;
                    beat = beat.wrapping_add(1);
                    let go = own.go.load(Ordering::SeqCst);
                    if writer.write_input(0, &[Value::Int32(beat), Value::Int32(go)]).is_err() {
                        return;
                    }
                }
                std::thread::sleep(BEAT);
            }
        });
        Self { hand, thread: Some(thread) }
    }

    /// The experiment is alive.
    pub(super) fn alive(&self) {
        *lock(&self.hand.alive) = Instant::now();
        self.hand.signs.fetch_add(1, Ordering::SeqCst);
    }

    /// What the program is told from the next beat on.
    pub(super) fn set_go(&self, go: i32) {
        self.hand.go.store(go, Ordering::SeqCst);
    }

    /// No beat after this: the controller stops the program by itself.
    pub(super) fn stop(&mut self) {
        self.hand.wanted.store(false, Ordering::SeqCst);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

impl Drop for Heart {
    fn drop(&mut self) {
        self.stop();
    }
}

/// Of readings that no label depends on, one in so many is recorded, and all from so long before the pull.
const ONE_IN: usize = 10;
const BEFORE_S: f64 = 0.5;

/// Readings that are recorded: all of the pull, of the moment before it and of the sensor without a load; of the way there and back,
/// and of the dwell, one in so many.
pub(super) fn thinned(
    rows: Vec<RobotRow>,
    run: Option<i32>,
    without_s: [Option<(f64, f64)>; 2],
) -> Vec<RobotRow> {
    let begins_s = rows.iter().find(|row| run.is_some_and(|run| row.phase_of(run) == Some(Phase::Pulling)));
    let begins_s = begins_s.map_or(f64::INFINITY, |row| row.timestamp_s);
    let matters = |row: &RobotRow| {
        let phase = run.and_then(|run| row.phase_of(run));
        let before = row.timestamp_s > begins_s - BEFORE_S && row.timestamp_s < begins_s;
        let within = |(from_s, to_s): &(f64, f64)| row.timestamp_s >= *from_s && row.timestamp_s < *to_s;
        let without = without_s.iter().flatten().any(within);
        before || without || matches!(phase, Some(Phase::Pulling | Phase::Braking))
    };
    rows.into_iter()
        .enumerate()
        .filter(|(i, row)| i % ONE_IN == 0 || matters(row))
        .map(|(_, row)| row)
        .collect()
}
