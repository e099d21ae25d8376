//! What can go wrong, on demand: on the wire, with the robot, with the part.

use gripgen_twin::Jaw;

/// A device of the rig, by its connections.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Device {
    /// RTDE.
    Rtde,
    /// The dashboard.
    Dashboard,
    /// Primary, secondary and real-time port.
    Script,
    /// The gripper.
    Gripper,
    /// The camera behind the left gel.
    CameraLeft,
    /// The camera behind the right gel.
    CameraRight,
}

impl Device {
    /// All of them, with their words.
    pub const ALL: [(Device, &'static str); 6] = [
        (Device::Rtde, "rtde"),
        (Device::Dashboard, "dashboard"),
        (Device::Script, "script"),
        (Device::Gripper, "gripper"),
        (Device::CameraLeft, "camera-left"),
        (Device::CameraRight, "camera-right"),
    ];

    /// Its word.
    pub fn name(self) -> &'static str {
        Self::ALL.iter().find(|(device, _)| *device == self).map_or("", |(_, name)| *name)
    }
}

/// A fault.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Fault {
    /// Its connections are closed.
    Drop(Device),
    /// For so long it sends nothing; then everything.
    Delay(Device, f64),
    /// Half of what it sends next goes out, then its connections are closed.
    Truncate(Device),
    /// What it sends next has damaged bytes.
    Garble(Device),
    /// Its connections are closed and new ones are refused, until `accept`.
    Refuse(Device),
    /// It takes connections again.
    Accept(Device),
    /// The red button.
    EmergencyStop,
    /// The red button is released, the safety system restarted.
    ReleaseEmergencyStop,
    /// The controller stops by itself.
    ProtectiveStop,
    /// A camera sends the same frame with the same stamp for ever.
    Freeze(Jaw),
    /// A camera sends the same frame for ever, each with a new stamp.
    Repeat(Jaw),
    /// It sees again.
    Thaw(Jaw),
    /// The part slips out of the jaws.
    PartLost,
    /// A mass hangs on the tool, in kg; 0 takes it off.
    Hang(f64),
    /// Something pulls aside at the tool, in N; 0 ends it.
    Aside(f64),
    /// Force mode follows with this time constant, in s; 0 ends it.
    ForceLag(f64),
    /// Force mode begins to follow after so many seconds; 0 ends it.
    ForceDelay(f64),
    /// The sensor follows its load with this time constant, in s; 0 ends it.
    SensorLag(f64),
    /// The sensor's zero wanders, in N per minute; 0 ends it where it is.
    Drift(f64),
    /// Jaws that close press so much across the pull, in N; 0 ends it.
    Clamp(f64),
    /// Somebody moves the speed slider, 1 is 100 %.
    Slider(f64),
    /// The gripper reports this force, in N over both jaws, whatever it was asked.
    Reports(f64),
}

/// Words that are no fault.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error(
    "`{line}` is none of: drop|truncate|garble|refuse|accept DEVICE, delay DEVICE S, estop, release-estop, protective-stop, \
     freeze|repeat|thaw left|right, part-lost, hang KG, aside N, force-lag S, force-delay S, sensor-lag S, drift N_PER_MIN, clamp N, slider SHARE, reports N; devices: rtde, dashboard, script, gripper, camera-left, camera-right"
)]
pub struct FaultError {
    /// The words.
    pub line: String,
}

impl std::str::FromStr for Fault {
    type Err = FaultError;

    fn from_str(line: &str) -> Result<Self, FaultError> {
        let words: Vec<&str> = line.split_whitespace().collect();
        let device = |word: &str| Device::ALL.iter().find(|(_, name)| *name == word).map(|(d, _)| *d);
        let jaw = |word: &str| match word {
            "left" => Some(Jaw::Left),
            "right" => Some(Jaw::Right),
            _ => None,
        };
        let number = |word: &str, most: f64| word.parse().ok().filter(|x: &f64| (0.0..=most).contains(x));
        let fault = match words[..] {
            ["drop", d] => device(d).map(Fault::Drop),
            ["truncate", d] => device(d).map(Fault::Truncate),
            ["garble", d] => device(d).map(Fault::Garble),
            ["refuse", d] => device(d).map(Fault::Refuse),
            ["accept", d] => device(d).map(Fault::Accept),
            ["delay", d, s] => device(d).zip(number(s, 3600.0)).map(|(d, s)| Fault::Delay(d, s)),
            ["estop"] => Some(Fault::EmergencyStop),
            ["release-estop"] => Some(Fault::ReleaseEmergencyStop),
            ["protective-stop"] => Some(Fault::ProtectiveStop),
            ["freeze", j] => jaw(j).map(Fault::Freeze),
            ["repeat", j] => jaw(j).map(Fault::Repeat),
            ["thaw", j] => jaw(j).map(Fault::Thaw),
            ["part-lost"] => Some(Fault::PartLost),
            ["hang", kg] => number(kg, 5.0).map(Fault::Hang),
            ["aside", n] => number(n, 100.0).map(Fault::Aside),
            ["force-lag", s] => number(s, 5.0).map(Fault::ForceLag),
            ["force-delay", s] => number(s, 5.0).map(Fault::ForceDelay),
            ["sensor-lag", s] => number(s, 5.0).map(Fault::SensorLag),
            ["drift", n] => number(n, 100.0).map(Fault::Drift),
            ["clamp", n] => number(n, 100.0).map(Fault::Clamp),
            ["slider", share] => number(share, 1.0).map(Fault::Slider),
            ["reports", n] => number(n, 200.0).map(Fault::Reports),
            _ => None,
        };
        fault.ok_or_else(|| FaultError { line: line.trim().chars().take(80).collect() })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_from_words() {
        for (line, fault) in [
            ("drop rtde", Fault::Drop(Device::Rtde)),
            (" delay  gripper 0.5 ", Fault::Delay(Device::Gripper, 0.5)),
            ("truncate camera-left", Fault::Truncate(Device::CameraLeft)),
            ("freeze right", Fault::Freeze(Jaw::Right)),
            ("estop", Fault::EmergencyStop),
            ("hang 1.0", Fault::Hang(1.0)),
            ("repeat left", Fault::Repeat(Jaw::Left)),
            ("aside 45", Fault::Aside(45.0)),
            ("slider 0.3", Fault::Slider(0.3)),
            ("reports 8.0", Fault::Reports(8.0)),
            ("force-lag 0.35", Fault::ForceLag(0.35)),
            ("drift 5", Fault::Drift(5.0)),
        ] {
            assert_eq!(line.parse(), Ok(fault));
        }
        for bad in [
            "",
            "drop",
            "drop nothing",
            "delay rtde",
            "delay rtde -1",
            "hang nan",
            "estop now",
            "slider 1.5",
            "aside -1",
        ] {
            assert!(bad.parse::<Fault>().is_err(), "{bad}");
        }
    }
}
