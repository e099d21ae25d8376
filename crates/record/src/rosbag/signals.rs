//! What the topics of a bag say over time.

use super::cdr::{Cdr, joint_state};
use super::container::{Container, Message, Place, Topic};
use super::error::RosbagError;
use super::mapping::{BagClock, RosbagFile};
use gripgen_twin::PerJaw;
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Types of messages that are read.
pub(super) const WRENCH: &str = "geometry_msgs/msg/WrenchStamped";
const FLOAT: &str = "std_msgs/msg/Float64";
const POSE: &str = "geometry_msgs/msg/PoseStamped";
const JOINTS: &str = "sensor_msgs/msg/JointState";
pub(super) const IMAGE: &str = "sensor_msgs/msg/Image";
pub(super) const COMPRESSED: &str = "sensor_msgs/msg/CompressedImage";

/// A value and when it was, in ns of the bag's clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct At<T> {
    pub(super) ns: i64,
    pub(super) value: T,
}

/// An image of a bag.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Frame {
    pub(super) file: PathBuf,
    pub(super) place: Place,
    pub(super) compressed: bool,
}

/// The signals of a bag, each in the order of its times.
#[derive(Debug, Default)]
pub(super) struct Signals {
    /// Forces.
    pub(super) wrench: Vec<At<[f64; 3]>>,
    /// Commanded force along the pull.
    pub(super) command: Vec<At<f64>>,
    /// Places of the tool.
    pub(super) pose: Vec<At<[f64; 3]>>,
    /// Angles of the arm.
    pub(super) joints: Vec<At<[f64; 6]>>,
    /// Images.
    pub(super) frames: PerJaw<Vec<At<Frame>>>,
    /// Of all that was read.
    pub(super) hash: [u8; 32],
}

/// The MCAP files of a bag, in the order of their names.
fn files_of(bag: &Path) -> Result<Vec<PathBuf>, RosbagError> {
    if !bag.is_dir() {
        return Ok(vec![bag.into()]);
    }
    let at = |e: std::io::Error| RosbagError::new(bag, e);
    let mut files = Vec::new();
    let mut others = BTreeSet::new();
    for entry in std::fs::read_dir(bag).map_err(at)? {
        let path = entry.map_err(at)?.path();
        match path.extension().and_then(|e| e.to_str()) {
            Some("mcap") => files.push(path),
            Some(other @ ("db3" | "zstd" | "bag")) => drop(others.insert(other.to_string())),
            _ => {}
        }
    }
    files.sort();
    if files.is_empty() {
        let others: Vec<String> = others.into_iter().collect();
        let there = if others.is_empty() { String::new() } else { format!(", but .{}", others.join(", .")) };
        return Err(RosbagError::new(bag, format!("there is no .mcap in this bag{there}"))
            .hint("`ros2 bag convert` writes a bag as MCAP; `zstd -d` unpacks .mcap.zstd"));
    }
    Ok(files)
}

/// What topics a bag has, by name.
pub(super) fn topics_of(bag: &Path) -> Result<Vec<Topic>, RosbagError> {
    let mut found: Vec<Topic> = Vec::new();
    for file in files_of(bag)? {
        let mut container = Container::open(&file)?;
        let read = container.each(&mut |_| Ok(()));
        found.extend(container.topics().cloned());
        read?;
    }
    found.sort_by(|a, b| a.name.cmp(&b.name));
    found.dedup();
    Ok(found)
}

/// Reads the topics that a mapping names.
pub(super) fn read_signals(bag: &Path, mapping: &RosbagFile) -> Result<Signals, RosbagError> {
    let mut found = Signals::default();
    let mut hash = Sha256::new();
    let mut met = BTreeSet::new();
    let mut joints_named = BTreeSet::new();
    for file in files_of(bag)? {
        let mut container = Container::open(&file)?;
        container.each(&mut |message| {
            let Some(role) = Role::of(message.topic, mapping) else { return Ok(()) };
            if met.insert(message.topic.name.clone()) {
                hash.update(message.topic.name.as_bytes());
            }
            role.check(message)
                .and_then(|()| found.take(role, message, mapping, &file, &mut joints_named))
                .map_err(|problem| {
                let Place { record, within } = message.place;
                let at = format!("{} at byte {record}, {within}: {problem}", message.topic.name);
                RosbagError::new(&file, at).hint(role.hint())
            })?;
            if !matches!(role, Role::Image(_)) {
                hash.update(message.data);
            }
            Ok(())
        })?;
        // A topic without a message is missed as one that is not there.
    }
    found.missing(bag, mapping, &met, &joints_named)?;
    found.in_order();
    found.hash = hash.finalize().into();
    Ok(found)
}

/// What a topic is to a pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Role {
    Wrench,
    Command,
    Pose,
    Joints,
    Image(gripgen_twin::Jaw),
}

impl Role {
    fn of(topic: &Topic, mapping: &RosbagFile) -> Option<Self> {
        let topics = &mapping.topics;
        let is = |name: &Option<String>| name.as_ref() == Some(&topic.name);
        match () {
            () if topics.wrench == topic.name => Some(Self::Wrench),
            () if is(&topics.command) => Some(Self::Command),
            () if is(&topics.pose) => Some(Self::Pose),
            () if is(&topics.joint_states) => Some(Self::Joints),
            () if is(&topics.image_left) => Some(Self::Image(gripgen_twin::Jaw::Left)),
            () if is(&topics.image_right) => Some(Self::Image(gripgen_twin::Jaw::Right)),
            () => None,
        }
    }

    fn kinds(self) -> &'static [&'static str] {
        match self {
            Self::Wrench => &[WRENCH],
            Self::Command => &[FLOAT, WRENCH],
            Self::Pose => &[POSE],
            Self::Joints => &[JOINTS],
            Self::Image(_) => &[IMAGE, COMPRESSED],
        }
    }

    fn check(self, message: &Message<'_>) -> Result<(), String> {
        let Topic { kind, encoding, .. } = message.topic;
        if encoding != "cdr" {
            return Err(format!("its messages are encoded as `{encoding}`, `cdr` is read"));
        }
        if !self.kinds().contains(&kind.as_str()) {
            return Err(format!("it is a `{kind}`, `{}` is read", self.kinds().join("` or `")));
        }
        Ok(())
    }

    fn hint(self) -> &'static str {
        match self {
            Self::Wrench => "topics.wrench names the wrench of the force sensor",
            Self::Command => "topics.command names the commanded force, or is left out",
            Self::Pose => "topics.pose names the pose of the tool, or is left out",
            Self::Joints => {
                "topics.joint_states names the joints of the arm, motion.joints their names from base to tool"
            }
            Self::Image(_) => "topics.image_left and image_right name the cameras of the jaws",
        }
    }
}

fn finite<const N: usize>(values: [f64; N]) -> Result<[f64; N], String> {
    match values.iter().find(|x| !x.is_finite()) {
        Some(x) => Err(format!("a value is {x}, all must be numbers")),
        None => Ok(values),
    }
}

impl Signals {
    fn take(
        &mut self,
        role: Role,
        message: &Message<'_>,
        mapping: &RosbagFile,
        file: &Path,
        joints_named: &mut BTreeSet<String>,
    ) -> Result<(), String> {
        let mut cdr = Cdr::new(message.data)?;
        let kind = message.topic.kind.as_str();
        let header_ns = if kind == FLOAT { message.log_time_ns } else { cdr.stamp_ns()? };
        let ns = if mapping.clock == BagClock::Log { message.log_time_ns } else { header_ns };
        match role {
            Role::Wrench => self.wrench.push(At { ns, value: finite(cdr.vector()?)? }),
            Role::Command => {
                let value = match kind {
                    FLOAT => finite([cdr.f64()?])?[0],
                    _ => along(&mapping.force.along, &finite(cdr.vector()?)?),
                };
                self.command.push(At { ns, value });
            }
            Role::Pose => self.pose.push(At { ns, value: finite(cdr.vector()?)? }),
            Role::Joints => {
                let (names, angles) = joint_state(&mut cdr)?;
                let angle =
                    |name: &String| names.iter().position(|n| n == name).and_then(|i| angles.get(i)).copied();
                let wanted: Vec<f64> = mapping.motion.joints.iter().filter_map(angle).collect();
                joints_named.extend(names);
                // Grippers publish theirs on the same topic.
                if let Ok(value) = <[f64; 6]>::try_from(wanted) {
                    self.joints.push(At { ns, value: finite(value)? });
                }
            }
            Role::Image(jaw) => {
                let frame = Frame { file: file.into(), place: message.place, compressed: kind == COMPRESSED };
                self.frames[jaw].push(At { ns, value: frame });
            }
        }
        Ok(())
    }

    /// Topics that the mapping names and the bag lacks.
    fn missing(
        &self,
        bag: &Path,
        mapping: &RosbagFile,
        met: &BTreeSet<String>,
        joints_named: &BTreeSet<String>,
    ) -> Result<(), RosbagError> {
        let t = &mapping.topics;
        let named = [("wrench", Some(&t.wrench)), ("command", t.command.as_ref()), ("pose", t.pose.as_ref())];
        let named = named.into_iter().chain([
            ("joint_states", t.joint_states.as_ref()),
            ("image_left", t.image_left.as_ref()),
            ("image_right", t.image_right.as_ref()),
        ]);
        for (key, name) in named.filter_map(|(key, name)| name.map(|name| (key, name))) {
            if !met.contains(name) {
                let topics = topics_of(bag).unwrap_or_default();
                let there: Vec<String> = topics.iter().map(|t| format!("{} ({})", t.name, t.kind)).collect();
                let problem = format!("no message on `{name}`; topics: {}", there.join(", "));
                return Err(RosbagError::new(bag, problem)
                    .hint(format!("`topics.{key}` of {} names it", super::mapping::ROSBAG_FILE)));
            }
        }
        if t.joint_states.is_some() && self.joints.is_empty() {
            let there: Vec<&str> = joints_named.iter().map(String::as_str).collect();
            let wanted = mapping.motion.joints.join(", ");
            let problem = format!("no message has the joints {wanted}; there are {}", there.join(", "));
            return Err(RosbagError::new(bag, problem).hint(Role::Joints.hint()));
        }
        Ok(())
    }

    /// Sorts by time; of readings of one time the first counts.
    fn in_order(&mut self) {
        fn sorted<T>(all: &mut Vec<At<T>>) {
            all.sort_by_key(|at| at.ns);
            all.dedup_by_key(|at| at.ns);
        }
        sorted(&mut self.wrench);
        // Of commands of one time the last counts: it was sent after the others.
        self.command.reverse();
        sorted(&mut self.command);
        sorted(&mut self.pose);
        sorted(&mut self.joints);
        sorted(&mut self.frames.left);
        sorted(&mut self.frames.right);
    }
}

/// Component of a vector.
pub(super) fn along(direction: &[f64; 3], vector: &[f64; 3]) -> f64 {
    direction.iter().zip(vector).map(|(a, b)| a * b).sum()
}

/// The last value at or before a time.
pub(super) fn held<T>(all: &[At<T>], ns: i64) -> Option<&At<T>> {
    all.partition_point(|at| at.ns <= ns).checked_sub(1).map(|i| &all[i])
}

/// The value at a time, on the line between its neighbours; that of the nearest beyond the ends.
pub(super) fn between<const N: usize>(all: &[At<[f64; N]>], ns: i64) -> Option<[f64; N]> {
    let after = all.partition_point(|at| at.ns < ns);
    let (low, high) = (&all.get(after.saturating_sub(1))?, all.get(after).or(all.last())?);
    let span = high.ns - low.ns;
    if span <= 0 || high.ns == ns {
        return Some(high.value);
    }
    let share = ((ns - low.ns) as f64 / span as f64).clamp(0.0, 1.0);
    Some(std::array::from_fn(|i| low.value[i] + share * (high.value[i] - low.value[i])))
}
