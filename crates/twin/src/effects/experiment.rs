//! Experiments that tell effects apart.

/// What a campaign consists of.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Measured {
    /// Pulls until the jaws slip.
    Pulls,
    /// Readings of a force sensor beside a reference.
    SensorTable,
    /// Presses into the gel.
    Presses,
    /// Grasps beside a load cell.
    Imprints,
}

/// Something a technician can do that shows some effects and not others. In the order in which they are proposed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Experiment {
    /// Half a second without load before every pull.
    NoLoadReading,
    /// The same grip pulled in both directions.
    PullsUpAndDown,
    /// The grip force by another instrument.
    GripForceWithALoadCell,
    /// Staircases of other slopes.
    OtherPullRates,
    /// Lighter and stronger grips.
    WiderGripForces,
    /// Masses on the gripper.
    KnownMasses,
    /// A pause, and the first grip again.
    LongPause,
    /// Short and long waits before the pull.
    DwellTimes,
    /// Zero and one load at several times.
    ZeroAndLoadOverTime,
    /// Some loads over the range.
    KnownLoads,
    /// A load that stays, and none for as long.
    ConstantLoad,
    /// The same loads faster and slower.
    LoadingAtTwoSpeeds,
    /// Frames without contact around the presses.
    FrameWithoutContact,
    /// The first press an hour later.
    FirstPressAgain,
    /// Another shape with edges.
    AnotherShape,
    /// Presses at the rim of the frame.
    PressesNearTheCorners,
    /// One place at several depths.
    PressesAtSeveralDepths,
    /// Forces of one grasp that stand still for a while.
    HeldForces,
    /// Many forces of one grasp, up and down.
    ForceLadder,
    /// One force of one grasp, held long.
    LongHold,
}

impl Experiment {
    /// What it is done with.
    pub fn of(self) -> Measured {
        match self {
            e if e <= Experiment::DwellTimes => Measured::Pulls,
            e if e <= Experiment::LoadingAtTwoSpeeds => Measured::SensorTable,
            e if e <= Experiment::PressesAtSeveralDepths => Measured::Presses,
            _ => Measured::Imprints,
        }
    }

    /// What to do, as a part of a sentence.
    pub fn text(self) -> &'static str {
        match self {
            Experiment::NoLoadReading => "record half a second without load before every pull",
            Experiment::PullsUpAndDown => "pull the same grip down as well as up",
            Experiment::GripForceWithALoadCell => {
                "measure the grip force with a load cell at 5, 20 and 80 N, and pull with the jaws just touching"
            }
            Experiment::OtherPullRates => "pull two grip forces with steps a fifth and three times as fast",
            Experiment::WiderGripForces => "add grip forces below 20 N and above 60 N",
            Experiment::KnownMasses => "hang two known masses on the gripper",
            Experiment::LongPause => "pause 30 min without pulls, then repeat the first grip 5 times",
            Experiment::DwellTimes => "dwell 1, 10 and 100 s, once holding the force and once the width",
            Experiment::ZeroAndLoadOverTime => {
                "read the unloaded sensor and one known load at the start, in the middle and at the end: only a zero that drifts changes the unloaded reading"
            }
            Experiment::KnownLoads => {
                "apply five known loads up to the largest, each twice and in random order: a bent line shows in their second difference, a limit only at the top"
            }
            Experiment::ConstantLoad => {
                "hold a constant load for a minute, then unload and wait a minute: creep dies out"
            }
            Experiment::LoadingAtTwoSpeeds => {
                "load and unload at two speeds a factor of 10 apart: the loop of a filter grows with the speed, that of hysteresis does not"
            }
            Experiment::FrameWithoutContact => {
                "take a frame without contact before and after the presses: light and camera change it, an offset of the colours does not"
            }
            Experiment::FirstPressAgain => {
                "repeat the first press after an hour and write down the time of every press"
            }
            Experiment::AnotherShape => {
                "press another shape with edges: focus is the camera's, blunt edges and outlines are the part's; gel kernels grow with the depth"
            }
            Experiment::PressesNearTheCorners => {
                "press near all four corners, at two depths, and mark the contacts"
            }
            Experiment::PressesAtSeveralDepths => {
                "press at several depths: shadows grow with the height of the contact"
            }
            Experiment::HeldForces => {
                "hold three forces of one grasp for a second each: a delay vanishes where the force stands still"
            }
            Experiment::ForceLadder => {
                "climb six forces of one grasp from at most 10 N to the largest and down again: a curve is the same both ways"
            }
            Experiment::LongHold => {
                "hold one force of one grasp for a minute with pictures all along, then open and take a frame without contact"
            }
        }
    }
}
