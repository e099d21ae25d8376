//! Starting, the clock, and what stops it.

use super::messages::{announcement_message, robot_mode_packet};
use super::ports::socket::Shared;
use super::{RigAddresses, ServeError};
use crate::arm::{ArmFaults, STEP_S};
use crate::faults::{Device, Fault};
use crate::world::World;
use gripgen_rig::camera::CameraView;
use gripgen_rig::gcl::GripState;
use gripgen_rig::link::lock;
use gripgen_rig::program::TcpPose;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};
use gripgen_twin::plant::{GripRequest, Plant};
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

/// Longest sleep of the clock.
const NAP: Duration = Duration::from_millis(1);
/// A clock that is further behind than this, in real time, gives up what it lost: the rig then runs slower than asked.
const MAX_BEHIND_S: f64 = 0.25;
/// Control steps between two packets with the robot's mode: ten per second.
const STEPS_PER_MODE: u64 = 50;
/// How far, in real time, a rig that waits for its client may go beyond a beat: two of them.
const AHEAD_S: f64 = 0.02;
/// Time between two control steps while it waits.
const SLOWLY: Duration = Duration::from_millis(40);
/// A client that is waited for longer is dead.
const DEAD: Duration = Duration::from_secs(1);
/// Control steps without a look at the clients.
const STEPS_AT_ONCE: u64 = 64;

/// How the rig is served.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ServeOptions {
    /// Where; a port 0 is chosen by the system. Only loopback.
    pub addresses: RigAddresses,
    /// How many times faster than real time.
    pub clock_rate: f64,
    /// Whether the clock waits for a client that writes inputs: a machine that is busy then slows the rig down, and no deadline
    /// that is counted by the rig's clock depends on it.
    pub in_step: bool,
    /// Where the tool is at first.
    pub tcp: TcpPose,
    /// How a client turns the cameras' frames; the cameras send what this makes upright.
    pub view: CameraView,
}

/// Largest clock rate.
const MAX_RATE: f64 = 200.0;

/// The rig as somebody sees it who stands beside it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigStatus {
    /// The controller's clock.
    pub timestamp_s: f64,
    /// Where the tool is.
    pub tcp: TcpPose,
    /// How fast it moves.
    pub speed_m_s: f64,
    /// Whether a program runs.
    pub program_runs: bool,
    /// Power and brakes.
    pub mode: RobotMode,
    /// Safety.
    pub safety: SafetyStatus,
    /// The gripper.
    pub grip: GripState,
    /// Whether the jaws are closed on a part.
    pub holds: bool,
}

/// A rig that is being served. Dropping it closes all connections.
pub struct ServedRig {
    addresses: RigAddresses,
    shared: Arc<Shared>,
    clock: Option<JoinHandle<()>>,
    worker: Option<JoinHandle<()>>,
}

impl ServedRig {
    /// Opens the ports and starts the clock.
    ///
    /// # Errors
    ///
    /// An address beyond loopback, a rate out of range, or a port that is taken.
    pub fn start(plant: Arc<dyn Plant>, options: &ServeOptions) -> Result<Self, ServeError> {
        for (what, address) in options.addresses.all() {
            if !address.ip().is_loopback() {
                return Err(ServeError::NotLoopback { what, address });
            }
        }
        let rate = options.clock_rate;
        if !(0.01..=MAX_RATE).contains(&rate) {
            return Err(ServeError::Rate { rate, most: MAX_RATE });
        }
        let world = World::new(plant.clone(), options.tcp, rate);
        let shared = Arc::new(Shared::new(world, rate, options.view));
        let pace = options.in_step.then(|| Pace::new(rate));
        let addresses = shared.open_ports(options.addresses).inspect_err(|_| shared.close())?;
        let (ask, asked) = channel();
        let (ticking, working) = (shared.clone(), shared.clone());
        let clock = std::thread::spawn(move || run_clock(&ticking, &ask, pace));
        let worker = std::thread::spawn(move || work(&working, plant.as_ref(), &asked));
        Ok(Self { addresses, shared, clock: Some(clock), worker: Some(worker) })
    }

    /// Where it is.
    pub fn addresses(&self) -> RigAddresses {
        self.addresses
    }

    /// Lets something go wrong.
    pub fn inject(&self, fault: Fault) {
        match fault {
            Fault::Drop(device) => self.shared.faults(device).drop_connections(),
            Fault::Delay(device, seconds) => self.shared.faults(device).delay(seconds),
            Fault::Truncate(device) => self.shared.faults(device).truncate(),
            Fault::Garble(device) => self.shared.faults(device).garble(),
            Fault::Refuse(device) => self.shared.faults(device).refuse(true),
            Fault::Accept(device) => self.shared.faults(device).refuse(false),
            Fault::Freeze(jaw) => self.shared.freeze(jaw, true),
            Fault::Repeat(jaw) => self.shared.repeat(jaw),
            Fault::Thaw(jaw) => self.shared.freeze(jaw, false),
            Fault::EmergencyStop => lock(&self.shared.world).controller.emergency_stop(),
            Fault::ReleaseEmergencyStop => lock(&self.shared.world).controller.restart_safety(),
            Fault::ProtectiveStop => lock(&self.shared.world).controller.protective_stop(),
            Fault::PartLost => lock(&self.shared.world).lose_part(),
            Fault::Hang(mass_kg) => lock(&self.shared.world).controller.arm_mut().hang(mass_kg),
            Fault::Aside(force_n) => lock(&self.shared.world).controller.arm_mut().pull_aside(force_n),
            Fault::ForceLag(s) => self.arm_faults(|faults| faults.force_lag_s = s),
            Fault::ForceDelay(s) => self.arm_faults(|faults| faults.force_dead_s = s),
            Fault::SensorLag(s) => self.arm_faults(|faults| faults.sensor_lag_s = s),
            Fault::Drift(n_per_min) => self.arm_faults(|faults| faults.drift_n_s = n_per_min / 60.0),
            Fault::Clamp(n) => self.arm_faults(|faults| faults.clamp_n = n),
            Fault::Slider(share) => lock(&self.shared.world).controller.set_speed_slider(share),
            Fault::Reports(force_sum_n) => lock(&self.shared.world).gripper.report(force_sum_n),
        }
    }

    fn arm_faults(&self, change: impl FnOnce(&mut ArmFaults)) {
        let mut world = lock(&self.shared.world);
        let mut faults = world.controller.arm().faults();
        change(&mut faults);
        world.controller.arm_mut().set_faults(faults);
    }

    /// The rig now.
    pub fn status(&self) -> RigStatus {
        let world = lock(&self.shared.world);
        let (robot, arm) = (world.controller.robot(), world.controller.arm());
        RigStatus {
            timestamp_s: robot.timestamp_s,
            tcp: robot.tcp,
            speed_m_s: arm.speed_m_s(),
            program_runs: world.controller.program_title().is_some(),
            mode: robot.mode,
            safety: robot.safety,
            grip: world.gripper.state(),
            holds: arm.grip().is_some_and(|grip| grip.holds()),
        }
    }

    /// Names of the devices that can be disturbed.
    pub fn devices() -> impl Iterator<Item = Device> {
        Device::ALL.into_iter().map(|(device, _)| device)
    }
}

impl Drop for ServedRig {
    fn drop(&mut self) {
        self.shared.close();
        // The clock hangs up on the worker.
        for thread in [self.clock.take(), self.worker.take()].into_iter().flatten() {
            let _ = thread.join();
        }
    }
}

/// Steps of a rig that waits for its client.
struct Pace {
    /// How far the rig may go beyond the last beat.
    ahead_s: f64,
    /// Since when it waits, and when it went on last.
    waits: Option<(Instant, Instant)>,
}

impl Pace {
    fn new(rate: f64) -> Self {
        Self { ahead_s: AHEAD_S * rate, waits: None }
    }

    /// Control steps that may be made now. A client that is late gets one now and then, so that it hears something; one that is too
    /// late is taken for dead, and not waited for until it beats again.
    fn steps(&mut self, world: &World, now: Instant) -> u64 {
        let left_s = self.ahead_s - world.controller.unheard_s();
        if world.owners.is_empty() || left_s >= STEP_S {
            self.waits = None;
            return if world.owners.is_empty() { u64::MAX } else { (left_s / STEP_S) as u64 };
        }
        let (since, last) = self.waits.get_or_insert((now, now));
        if now.duration_since(*since) > DEAD {
            return u64::MAX;
        }
        let due = now.duration_since(*last) >= SLOWLY;
        if due {
            *last = now;
        }
        u64::from(due)
    }
}

/// The clock: control steps when they are due.
fn run_clock(shared: &Shared, ask: &Sender<GripRequest>, mut pace: Option<Pace>) {
    let mut origin = Instant::now();
    let mut steps_at_origin = 0;
    while !shared.stop.load(Ordering::SeqCst) {
        let due = steps_at_origin + (origin.elapsed().as_secs_f64() * shared.rate / STEP_S) as u64;
        let mut world = lock(&shared.world);
        let behind = due.saturating_sub(world.step_number());
        if behind as f64 * STEP_S > MAX_BEHIND_S * shared.rate {
            (origin, steps_at_origin) = (Instant::now(), world.step_number());
        }
        let mut batches = shared.batches();
        let allowed = pace.as_mut().map_or(u64::MAX, |pace| pace.steps(&world, Instant::now()));
        for _ in 0..behind.min(STEPS_AT_ONCE).min(allowed) {
            world.begin_step();
            for batch in &mut batches {
                batch.add(&world);
            }
            let told = world.end_step();
            shared.send_gripper_lines(told.gripper);
            let time_s = world.controller.robot().timestamp_s;
            for announcement in told.robot {
                shared.announce(&announcement_message(&announcement, time_s));
            }
            if world.step_number().is_multiple_of(STEPS_PER_MODE) {
                shared.announce(&robot_mode_packet(&world.controller));
            }
        }
        let request = world.take_grip_request();
        shared.look(&world);
        drop(world);
        batches.into_iter().for_each(super::ports::socket::Batch::send);
        if let Some(request) = request {
            // The worker is there as long as this thread is.
            let _ = ask.send(request);
        }
        if allowed < behind.min(STEPS_AT_ONCE) {
            std::thread::sleep(NAP);
        } else if behind <= STEPS_AT_ONCE {
            let next_s = (due + 1 - steps_at_origin) as f64 * STEP_S / shared.rate;
            let left_s = next_s - origin.elapsed().as_secs_f64();
            if left_s > 0.0 {
                std::thread::sleep(Duration::from_secs_f64(left_s).max(NAP.min(Duration::from_micros(100))));
            }
        }
    }
}

/// Works out what the jaws close on, and lets the robot's clock run meanwhile.
fn work(shared: &Shared, plant: &dyn Plant, asked: &Receiver<GripRequest>) {
    for request in asked {
        let grip = plant.grip(&request);
        lock(&shared.world).answer_grip(grip);
    }
}
