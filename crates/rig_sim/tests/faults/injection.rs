//! What goes wrong, and when.

use gripgen_rig_sim::faults::{Device, Fault};
use gripgen_twin::Jaw;
use std::fmt::{Display, Formatter, Result};

/// A silence that matters to everybody, and one that matters to nobody.
const LONG_S: f64 = 30.0;
const SHORT_S: f64 = 0.02;
/// Hung on the tool it weighs more than any motion may meet.
pub const HEAVY_KG: f64 = 3.0;
/// Largest delay after the beginning of a moment: 0.6 s of the rig's time.
const MAX_DELAY_MS: u64 = 30;

/// What goes wrong.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// Something that the virtual rig does.
    Rig(Fault),
    /// A second client of RTDE never reads.
    SlowReader,
    /// Ctrl-C.
    Interrupt,
    /// The thread of the experiment dies: everything of it is dropped.
    Death,
    /// It hangs, and comes back.
    Stuck,
    /// Somebody leans on the tool for a moment.
    Touch,
}

/// Six faults of each device, and what else there is.
pub const ALL: [Kind; 47] = all();

const fn all() -> [Kind; 47] {
    let mut all = [Kind::Stuck; 47];
    let mut i = 0;
    while i < Device::ALL.len() {
        let device = Device::ALL[i].0;
        let faults = [
            Fault::Drop(device),
            Fault::Delay(device, LONG_S),
            Fault::Delay(device, SHORT_S),
            Fault::Truncate(device),
            Fault::Garble(device),
            Fault::Refuse(device),
        ];
        let mut k = 0;
        while k < faults.len() {
            all[faults.len() * i + k] = Kind::Rig(faults[k]);
            k += 1;
        }
        i += 1;
    }
    let more = [
        Kind::Rig(Fault::EmergencyStop),
        Kind::Rig(Fault::ProtectiveStop),
        Kind::Rig(Fault::Freeze(Jaw::Left)),
        Kind::Rig(Fault::Freeze(Jaw::Right)),
        Kind::Rig(Fault::PartLost),
        Kind::Rig(Fault::Hang(HEAVY_KG)),
        Kind::SlowReader,
        Kind::Interrupt,
        Kind::Death,
        Kind::Touch,
    ];
    let mut k = 0;
    while k < more.len() {
        all[36 + k] = more[k];
        k += 1;
    }
    all
}

impl Kind {
    /// Whether it is a silence that nobody minds.
    pub fn is_short(self) -> bool {
        matches!(self, Kind::Rig(Fault::Delay(_, seconds)) if seconds == SHORT_S)
    }

    /// The device that it concerns.
    pub fn device(self) -> Option<Device> {
        match self {
            Kind::Rig(
                Fault::Drop(d)
                | Fault::Delay(d, _)
                | Fault::Truncate(d)
                | Fault::Garble(d)
                | Fault::Refuse(d),
            ) => Some(d),
            Kind::Rig(Fault::Freeze(Jaw::Left)) => Some(Device::CameraLeft),
            Kind::Rig(Fault::Freeze(Jaw::Right)) => Some(Device::CameraRight),
            _ => None,
        }
    }
}

impl Display for Kind {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let words = match self {
            Kind::Rig(fault) => match (fault, self.device()) {
                (Fault::Drop(d), _) => format!("drop {}", d.name()),
                (Fault::Delay(d, s), _) => format!("delay {} {s}", d.name()),
                (Fault::Truncate(d), _) => format!("truncate {}", d.name()),
                (Fault::Garble(d), _) => format!("garble {}", d.name()),
                (Fault::Refuse(d), _) => format!("refuse {}", d.name()),
                (Fault::Freeze(jaw), _) => format!("freeze {jaw}"),
                (other, _) => format!("{other:?}").to_lowercase(),
            },
            other => format!("{other:?}").to_lowercase(),
        };
        f.pad(&words)
    }
}

/// Moments of a pull, in their order.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Moment {
    Approach,
    RestImages,
    WayDown,
    Zeroing,
    Gripping,
    Settling,
    GripImages,
    Dwell,
    EarlyPull,
    MidPull,
    NearSlip,
    Sliding,
    Release,
    Retract,
}

/// All of them.
pub const MOMENTS: [Moment; 14] = [
    Moment::Approach,
    Moment::RestImages,
    Moment::WayDown,
    Moment::Zeroing,
    Moment::Gripping,
    Moment::Settling,
    Moment::GripImages,
    Moment::Dwell,
    Moment::EarlyPull,
    Moment::MidPull,
    Moment::NearSlip,
    Moment::Sliding,
    Moment::Release,
    Moment::Retract,
];

/// A fault at a moment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Injection {
    /// Its place in the list.
    pub number: usize,
    /// What.
    pub kind: Kind,
    /// When.
    pub moment: Moment,
    /// How long after the moment has begun.
    pub delay_ms: u64,
}

impl Display for Injection {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let moment = format!("{:?}", self.moment);
        write!(f, "{:>3} {:<22} {moment:<10} + {:>2} ms", self.number, self.kind, self.delay_ms)
    }
}

/// The first injections: every kind comes once before one comes again, each time at another moment.
pub fn injections(most: usize) -> Vec<Injection> {
    let one = |number: usize| {
        let (kind, round) = (number % ALL.len(), number / ALL.len());
        // 5 and 14 have nothing in common: all moments come before one comes again.
        let moment = MOMENTS[(kind * 3 + round * 5) % MOMENTS.len()];
        Injection { number, kind: ALL[kind], moment, delay_ms: scattered(number as u64) % (MAX_DELAY_MS + 1) }
    };
    (0..most).map(one).collect()
}

/// A number that looks random and is always the same (SplitMix64).
fn scattered(seed: u64) -> u64 {
    let mut x = seed.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    x = (x ^ (x >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ (x >> 31)
}
