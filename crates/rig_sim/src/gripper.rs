//! The gripper of the virtual rig: the device's side of GCL, without a socket. Lines in, lines out; what the jaws meet is asked
//! of the world.
//!
//! Source: Weiss Robotics, "GCL Reference Manual", version 4.0, and what public clients of it demand. Where the manual leaves a
//! number to the device's web page (force, speed and pull-back without a parameter, tolerance after connecting), those here are
//! of our own choice. Forces on the wire are sums of both jaws.

mod line;
mod motion;

pub use motion::{Closed, Jaws};

use gripgen_rig::gcl::{GclLimits, GripState, status_meaning};
use line::{Asked, Readable, status};
use motion::{End, Kind, Motion, Stop, stop_of};

/// Shortest motion: a client that compares one reading of its socket with one line must never find `ACK` and `FIN` in one.
const SHORTEST_MOTION_S: f64 = 0.02;
/// Grip force without a parameter, sum of both jaws.
const DEFAULT_FORCE_SUM_N: f64 = 40.0;
/// Speed without a parameter.
const DEFAULT_SPEED_MM_S: f64 = 100.0;
/// How far the jaws open when a release does not say.
const DEFAULT_PULL_BACK_MM: f64 = 10.0;
/// Tolerance of a part's width after connecting.
const DEFAULT_TOLERANCE_MM: f64 = 2.0;
/// Clamping travel after connecting; it is kept and told, nothing here is so soft that it is used up.
const DEFAULT_CLAMPING_TRAVEL_MM: f64 = 5.0;

/// The device.
#[derive(Debug, Clone)]
pub struct VirtualGripper {
    limits: GclLimits,
    homed: bool,
    width_mm: f64,
    speed_mm_s: f64,
    force_sum_n: f64,
    state: GripState,
    fast_stop: bool,
    /// A motion met something: no `MOVE` until the jaws are stopped, released or homed.
    blocked: bool,
    /// A grip has begun and no release after it.
    gripped: bool,
    /// The world has to be told that the jaws are open.
    let_go: bool,
    motion: Option<Motion>,
    session: Session,
    /// What it reports as its force, where that is not what it exerts.
    reports_n: Option<f64>,
}

/// What belongs to one connection.
#[derive(Debug, Clone)]
struct Session {
    verbose: bool,
    tolerance_mm: f64,
    clamping_travel_mm: f64,
    streamed: [Option<Streamed>; Readable::STREAMED],
    goodbye: bool,
}

/// A value that is sent by itself.
#[derive(Debug, Clone, Copy)]
struct Streamed {
    period_s: f64,
    next_s: f64,
}

impl Default for Session {
    fn default() -> Self {
        Self {
            verbose: false,
            tolerance_mm: DEFAULT_TOLERANCE_MM,
            clamping_travel_mm: DEFAULT_CLAMPING_TRAVEL_MM,
            streamed: [None; Readable::STREAMED],
            goodbye: false,
        }
    }
}

impl VirtualGripper {
    /// A gripper after power-up: open, and not homed yet, so that `HOME()` comes before any other motion.
    pub fn new(limits: GclLimits) -> Self {
        Self {
            limits,
            homed: false,
            width_mm: limits.width_mm.1,
            speed_mm_s: 0.0,
            force_sum_n: 0.0,
            state: GripState::Idle,
            fast_stop: false,
            blocked: false,
            gripped: false,
            let_go: false,
            motion: None,
            session: Session::default(),
            reports_n: None,
        }
    }

    /// From now on it reports this force over both jaws, whatever it exerts.
    pub fn report(&mut self, force_sum_n: f64) {
        self.reports_n = Some(force_sum_n);
    }

    /// The same gripper, homed or not.
    pub fn homed(mut self, homed: bool) -> Self {
        self.homed = homed;
        self
    }

    /// Opening width when it was last looked at, mm.
    pub fn width_mm(&self) -> f64 {
        self.width_mm
    }

    /// What the gripper is doing.
    pub fn state(&self) -> GripState {
        self.state
    }

    /// Sum of the forces of both jaws, N; 0 without a grip.
    pub fn force_sum_n(&self) -> f64 {
        self.force_sum_n
    }

    /// Whether a fast stop waits for its acknowledgement.
    pub fn fast_stop(&self) -> bool {
        self.fast_stop
    }

    /// Whether the client said goodbye: its connection is to be closed, and that raises no fast stop.
    pub fn said_goodbye(&self) -> bool {
        self.session.goodbye
    }

    /// The force of each jaw, N, with which the next [`advance`](Self::advance) closes the jaws: a world that needs long for its
    /// answer works it out before it lets time pass. Nothing while the jaws do not close, or have to open first.
    pub fn pending_force_per_jaw_n(&self) -> Option<f64> {
        let motion = self.motion.filter(|m| m.end.is_none() && !self.let_go)?;
        motion.closing_force_per_jaw_n(&self.limits)
    }

    /// A client connects: the settings of a connection are those of the start.
    pub fn connected(&mut self) {
        self.session = Session::default();
    }

    /// The connection is gone. Without a goodbye before, this is a fast stop.
    pub fn disconnected(&mut self) {
        if !self.session.goodbye {
            self.stop_fast();
        }
        self.session = Session::default();
    }

    /// The world says that the part slipped out of the jaws.
    pub fn part_lost(&mut self) {
        if self.state == GripState::Holding {
            self.state = GripState::PartLost;
            self.force_sum_n = 0.0;
        }
    }

    /// Takes a line of the client, without its end, and gives what is answered at once.
    pub fn line(&mut self, now_s: f64, line: &str) -> Vec<String> {
        if self.session.goodbye {
            return Vec::new();
        }
        self.follow(now_s);
        match line::read(line, &self.limits) {
            Ok(None) => Vec::new(),
            Ok(Some((name, asked))) => {
                self.obey(now_s, asked).unwrap_or_else(|status| vec![self.error(&name, status)])
            }
            Err(refused) => vec![self.error(&refused.name, refused.status)],
        }
    }

    /// Lets time pass: the ends of motions, and the values that are sent by themselves.
    pub fn advance(&mut self, now_s: f64, jaws: &mut dyn Jaws) -> Vec<String> {
        if std::mem::take(&mut self.let_go) {
            // What the jaws meet next is asked in the next step: the world may have to work it out anew.
            jaws.open();
        } else if let Some(mut motion) = self.motion.filter(|m| m.end.is_none()) {
            let at = stop_of(&motion, &self.limits, self.session.tolerance_mm, jaws);
            let travel_s = (at.width_mm - motion.from_mm).abs() / motion.speed_mm_s;
            motion.end = Some(End { until_s: motion.since_s + travel_s.max(SHORTEST_MOTION_S), at });
            self.motion = Some(motion);
        }
        self.follow(now_s);
        let mut lines = Vec::new();
        if let Some((motion, end)) = self.motion.and_then(|m| Some((m, m.end?)))
            && now_s >= end.until_s
        {
            lines.push(self.finish(motion.kind, end.at));
        }
        for (index, readable) in Readable::ALL.into_iter().take(Readable::STREAMED).enumerate() {
            let Some(Some(streamed)) = self.session.streamed.get_mut(index) else { continue };
            if now_s >= streamed.next_s {
                // What was missed is not made up for.
                let missed = ((now_s - streamed.next_s) / streamed.period_s).floor();
                streamed.next_s += (missed + 1.0) * streamed.period_s;
                lines.push(format!("@{}={}", readable.name(), self.value(readable)));
            }
        }
        lines
    }

    /// Width at this moment of the motion under way.
    fn follow(&mut self, now_s: f64) {
        if let Some((motion, end)) = self.motion.and_then(|m| Some((m, m.end?))) {
            let done = ((now_s - motion.since_s) / (end.until_s - motion.since_s)).clamp(0.0, 1.0);
            self.width_mm = motion.from_mm + done * (end.at.width_mm - motion.from_mm);
        }
    }

    fn obey(&mut self, now_s: f64, asked: Asked) -> Result<Vec<String>, u32> {
        let allowed = matches!(asked, Asked::Read(_) | Asked::AcknowledgeFastStop | Asked::Bye);
        if self.fast_stop && !allowed {
            return Err(status::ACCESS_DENIED);
        }
        match asked {
            Asked::Read(readable) => return Ok(self.told(readable)),
            Asked::PartWidthTolerance { tolerance_mm } => {
                self.session.tolerance_mm = tolerance_mm;
                return Ok(self.told(Readable::PartWidthTolerance));
            }
            Asked::ClampingTravel { travel_mm } => {
                self.session.clamping_travel_mm = travel_mm;
                return Ok(self.told(Readable::ClampingTravel));
            }
            Asked::Verbose(on) => {
                self.session.verbose = on;
                return Ok(self.told(Readable::Verbose));
            }
            Asked::Autosend { index, period_s } => {
                if let Some(streamed) = self.session.streamed.get_mut(index) {
                    *streamed = period_s.map(|period_s| Streamed { period_s, next_s: now_s + period_s });
                }
                return Ok(vec!["ACK AUTOSEND".into()]);
            }
            Asked::Stop => return Ok(acknowledged("STOP", self.stop())),
            Asked::FastStop => return Ok(acknowledged("FASTSTOP", self.stop_fast())),
            Asked::AcknowledgeFastStop => {
                self.fast_stop = false;
                self.recover();
                return Ok(vec!["ACK FSACK".into()]);
            }
            Asked::Bye => {
                self.session.goodbye = true;
                return Ok(vec!["ACK BYE".into()]);
            }
            Asked::Home { .. } | Asked::Move { .. } | Asked::Grip { .. } | Asked::Release { .. } => {}
        }
        self.begin(now_s, asked)
    }

    /// Begins a motion, if it is allowed now.
    fn begin(&mut self, now_s: f64, asked: Asked) -> Result<Vec<String>, u32> {
        if self.motion.is_some() {
            return Err(status::ALREADY_RUNNING);
        }
        if !self.homed && !matches!(asked, Asked::Home { .. }) {
            return Err(status::NOT_INITIALISED);
        }
        let (min_mm, max_mm) = self.limits.width_mm;
        let holding = self.state == GripState::Holding;
        let (kind, speed_mm_s) = match asked {
            Asked::Home { outwards } => (Kind::Home { to_mm: if outwards { max_mm } else { min_mm } }, None),
            Asked::Move { to_mm, speed_mm_s } => {
                if self.blocked || (holding && to_mm < self.width_mm) {
                    return Err(status::AXIS_BLOCKED);
                }
                (Kind::Move { to_mm }, speed_mm_s)
            }
            Asked::Grip { force_sum_n, part_width_mm, speed_mm_s } => {
                // RELEASE comes before the next GRIP; the manual gives no number for it.
                if holding {
                    return Err(status::NOT_AVAILABLE);
                }
                let (min_n, max_n) = self.limits.force_sum_n;
                let force_sum_n = force_sum_n.unwrap_or(DEFAULT_FORCE_SUM_N.min(max_n).max(min_n));
                (Kind::Grip { force_sum_n, part_width_mm }, speed_mm_s)
            }
            Asked::Release { pull_back_mm, speed_mm_s } => {
                if !self.gripped {
                    return Err(status::NOT_AVAILABLE);
                }
                let to_mm = self.width_mm + pull_back_mm.unwrap_or(DEFAULT_PULL_BACK_MM);
                // The drive ends at its stop.
                (Kind::Release { to_mm: to_mm.min(max_mm) }, speed_mm_s)
            }
            _ => return Err(status::UNKNOWN_COMMAND),
        };
        let (min_mm_s, max_mm_s) = self.limits.speed_mm_s;
        let speed_mm_s = speed_mm_s.unwrap_or(DEFAULT_SPEED_MM_S.min(max_mm_s).max(min_mm_s));
        self.gripped = matches!(kind, Kind::Grip { .. });
        self.let_go |= !self.gripped;
        self.blocked = false;
        self.force_sum_n = 0.0;
        self.speed_mm_s = speed_mm_s;
        self.state = match kind {
            Kind::Grip { .. } => GripState::Gripping,
            Kind::Release { .. } => GripState::Releasing,
            Kind::Home { .. } | Kind::Move { .. } => GripState::Positioning,
        };
        self.motion = Some(Motion { kind, since_s: now_s, from_mm: self.width_mm, speed_mm_s, end: None });
        Ok(vec![format!("ACK {}", kind.name())])
    }

    fn finish(&mut self, kind: Kind, at: Stop) -> String {
        self.motion = None;
        self.width_mm = at.width_mm;
        self.speed_mm_s = 0.0;
        self.force_sum_n = at.force_sum_n;
        self.state = at.state;
        self.blocked = at.result == Err(status::AXIS_BLOCKED);
        match at.result {
            Ok(()) => {
                self.homed |= matches!(kind, Kind::Home { .. });
                format!("FIN {}", kind.name())
            }
            Err(status) => self.error(kind.name(), status),
        }
    }

    /// Ends the motion under way. A grip that is held stays held.
    fn stop(&mut self) -> Option<String> {
        self.speed_mm_s = 0.0;
        self.recover();
        let motion = self.motion.take()?;
        self.state = GripState::Idle;
        // The world took the jaws as closed when the grip began.
        self.let_go |= matches!(motion.kind, Kind::Grip { .. });
        Some(self.error(motion.kind.name(), status::ABORTED))
    }

    fn stop_fast(&mut self) -> Option<String> {
        let aborted = self.stop();
        self.fast_stop = true;
        if self.state != GripState::Holding {
            self.state = GripState::Error;
        }
        aborted
    }

    fn recover(&mut self) {
        self.blocked = false;
        if self.state == GripState::Error {
            self.state = GripState::Idle;
        }
    }

    fn told(&self, readable: Readable) -> Vec<String> {
        vec![format!("{}={}", readable.name(), self.value(readable))]
    }

    /// A value as it stands on the wire.
    fn value(&self, readable: Readable) -> String {
        // `20.0`, not `20`: numbers that are measured have a point.
        let decimal = |x: f64| format!("{:?}", (x * 1000.0).round() / 1000.0);
        match readable {
            Readable::Position => decimal(self.width_mm),
            Readable::Speed => decimal(self.speed_mm_s),
            Readable::Force => decimal(self.reports_n.unwrap_or(self.force_sum_n)),
            Readable::GripState => (self.state as u8).to_string(),
            Readable::PartWidthTolerance => decimal(self.session.tolerance_mm),
            Readable::ClampingTravel => decimal(self.session.clamping_travel_mm),
            Readable::Verbose => u8::from(self.session.verbose).to_string(),
        }
    }

    /// An error line; with `VERBOSE=1` it says what its number means.
    fn error(&self, name: &str, status: u32) -> String {
        let name = if name.is_empty() { String::new() } else { format!("{name} ") };
        let words =
            if self.session.verbose { format!(" \"{}\"", status_meaning(status)) } else { String::new() };
        format!("ERR {name}{status}{words}")
    }
}

/// The acknowledgement of a stop, then the end of what it stopped.
fn acknowledged(name: &str, aborted: Option<String>) -> Vec<String> {
    std::iter::once(format!("ACK {name}")).chain(aborted).collect()
}
