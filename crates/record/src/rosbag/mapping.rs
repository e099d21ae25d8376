//! `rosbag.toml`: what the topics of a bag are to a pull, and when the pulls were made.

use super::error::RosbagError;
use crate::campaign::{CampaignHeader, check_header, parse};
use schemars::JsonSchema;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// The name of the mapping file.
pub const ROSBAG_FILE: &str = "rosbag.toml";

/// The mapping file of recordings of ROS 2: which topics are what, and one entry for each pull. Times are in seconds after the
/// first reading of the wrench in the same bag.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RosbagFile {
    /// Which time of a message counts: `header`, its stamp, or `log`, when it was recorded.
    #[serde(default)]
    pub clock: BagClock,
    /// What holds for all pulls, as in `campaign.toml`.
    #[serde(default)]
    pub campaign: CampaignHeader,
    /// The topics.
    pub topics: BagTopics,
    /// How the wrench becomes a force along the pull.
    #[serde(default)]
    pub force: BagForce,
    /// How pose or joints become a displacement along the pull.
    #[serde(default)]
    pub motion: BagMotion,
    /// What holds for every pull that does not say otherwise: columns of `pulls.csv`, marks.
    #[serde(default)]
    pub defaults: BagPull,
    /// The pulls, in the order in which they were made. Without any the bag beside this file is one pull.
    #[serde(default)]
    pub pulls: Vec<BagPull>,
}

/// Which time of a message counts.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum BagClock {
    /// The stamp in its header.
    #[default]
    Header,
    /// When it was recorded.
    Log,
}

/// Names of topics.
#[derive(Debug, Clone, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct BagTopics {
    /// The force sensor: `geometry_msgs/msg/WrenchStamped`.
    pub wrench: String,
    /// The commanded pull force, `std_msgs/msg/Float64` in N along the pull or a `WrenchStamped` in the frame of the wrench. Without
    /// it the staircase of the pull is taken, which begins at `begin_s`.
    pub command: Option<String>,
    /// Pose of the tool: `geometry_msgs/msg/PoseStamped`.
    pub pose: Option<String>,
    /// Joints of the arm, a UR5e: `sensor_msgs/msg/JointState`. Taken where there is no pose.
    pub joint_states: Option<String>,
    /// Camera of the left jaw: `sensor_msgs/msg/Image` or `CompressedImage`.
    pub image_left: Option<String>,
    /// Camera of the right jaw.
    pub image_right: Option<String>,
}

/// How the wrench becomes a force along the pull.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BagForce {
    /// The force that the part resists with is the wrench's force times this, summed over x, y and z. A sensor whose z points along
    /// an upward pull reads the part's pull as negative: [0, 0, -1].
    pub along: [f64; 3],
    /// Take the mean of the readings without a load (`no_load_s`) off all readings.
    pub tare: bool,
}

impl Default for BagForce {
    fn default() -> Self {
        Self { along: [0.0, 0.0, -1.0], tare: false }
    }
}

/// How pose or joints become a displacement along the pull.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(default, deny_unknown_fields)]
pub struct BagMotion {
    /// The pull's direction in the frame of the pose; of joints in the base of the arm.
    pub along: [f64; 3],
    /// Names of the six joints from base to tool.
    pub joints: [String; 6],
}

impl Default for BagMotion {
    /// Upward, and the names of the UR driver.
    fn default() -> Self {
        let names = ["shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3"];
        Self { along: [0.0, 0.0, 1.0], joints: names.map(|name| format!("{name}_joint")) }
    }
}

/// A pull: where and when it is in a bag. All other keys are columns of `pulls.csv`.
#[derive(Debug, Clone, PartialEq, Default, Deserialize, JsonSchema)]
pub struct BagPull {
    /// The bag, a folder or an `.mcap`, relative to this file; the bag beside this file where it is left out.
    pub bag: Option<String>,
    /// Its name; where it is left out that of the bag, and its number if the bag has several.
    pub pull_id: Option<String>,
    /// Start of the staircase, s; where it is left out, the first command above 0.
    pub begin_s: Option<f64>,
    /// End of the pull, s; where it is left out, the last command above 0, or the end of the bag.
    pub end_s: Option<f64>,
    /// A command that begins before this time is not this pull's, s.
    pub from_s: Option<f64>,
    /// Readings without a load before the pull, from and to, s.
    pub no_load_s: Option<[f64; 2]>,
    /// The same after the pull, s.
    pub no_load_after_s: Option<[f64; 2]>,
    /// The images while gripped are the last ones up to here, s; the start of the staircase where it is left out.
    pub image_s: Option<f64>,
    /// The images at rest are the last ones up to here, s; none where it is left out.
    pub rest_s: Option<f64>,
    /// Columns of `pulls.csv`: numbers and words.
    #[serde(flatten)]
    pub columns: BTreeMap<String, BagCell>,
}

/// A cell of `pulls.csv`.
#[derive(Debug, Clone, PartialEq, Deserialize, JsonSchema)]
#[serde(untagged)]
pub enum BagCell {
    /// A whole number.
    Whole(i64),
    /// A number.
    Number(f64),
    /// Yes or no.
    Flag(bool),
    /// A word.
    Word(String),
}

impl BagCell {
    /// As it stands in a table.
    pub(super) fn text(&self) -> String {
        match self {
            Self::Whole(x) => x.to_string(),
            Self::Number(x) => x.to_string(),
            Self::Flag(x) => x.to_string(),
            Self::Word(x) => x.clone(),
        }
    }
}

impl BagPull {
    /// The same, with what it leaves open from the defaults.
    fn or(&self, other: &Self) -> Self {
        let mut columns = other.columns.clone();
        columns.extend(self.columns.clone());
        Self {
            bag: self.bag.clone().or_else(|| other.bag.clone()),
            pull_id: self.pull_id.clone(),
            begin_s: self.begin_s.or(other.begin_s),
            end_s: self.end_s.or(other.end_s),
            from_s: self.from_s.or(other.from_s),
            no_load_s: self.no_load_s.or(other.no_load_s),
            no_load_after_s: self.no_load_after_s.or(other.no_load_after_s),
            image_s: self.image_s.or(other.image_s),
            rest_s: self.rest_s.or(other.rest_s),
            columns,
        }
    }

    fn check(&self) -> Result<(), String> {
        let pairs = [("no_load_s", self.no_load_s), ("no_load_after_s", self.no_load_after_s)];
        for (key, pair) in pairs.into_iter().filter_map(|(key, pair)| pair.map(|pair| (key, pair))) {
            if pair[0] >= pair[1] {
                return Err(format!("`{key}` is from {} to {} s, it must rise", pair[0], pair[1]));
            }
        }
        if let (Some(begin_s), Some(end_s)) = (self.begin_s, self.end_s)
            && begin_s >= end_s
        {
            return Err(format!("`end_s` is {end_s}, it must be above `begin_s`, {begin_s}"));
        }
        let marks = [self.begin_s, self.end_s, self.from_s, self.image_s, self.rest_s];
        let marks =
            marks.into_iter().chain(pairs.iter().flat_map(|(_, p)| p.map_or([None; 2], |p| p.map(Some))));
        match marks.flatten().find(|x| x.is_nan() || x.abs() >= 1e9) {
            Some(x) => Err(format!("a time is {x} s, it must be seconds from the start of the bag")),
            None => Ok(()),
        }
    }
}

/// Where the mapping of a bag, or of a folder of bags, is or ought to be; `None` for what is no bag. A bag is a folder with `rosbag.toml`, one
/// with `metadata.yaml` and `.mcap` files, an `.mcap`, or the mapping itself.
pub(super) fn mapping_path(path: &Path) -> Option<PathBuf> {
    if path.is_dir() {
        let mapping = path.join(ROSBAG_FILE);
        let bag = path.join("metadata.yaml").is_file();
        return (mapping.is_file() || bag).then_some(mapping);
    }
    if path.file_name().is_some_and(|name| name == ROSBAG_FILE) {
        return Some(path.into());
    }
    let of_run = path.with_file_name("run.json").is_file();
    (path.extension().is_some_and(|e| e == "mcap") && !of_run).then(|| path.with_file_name(ROSBAG_FILE))
}

/// A pull of the mapping.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct MarkedPull {
    pub(super) id: String,
    pub(super) bag: PathBuf,
    pub(super) marks: BagPull,
}

/// Reads the mapping from its text. `bag` is the one beside it.
pub(super) fn read_mapping(
    path: &Path,
    text: &str,
    bag: &Path,
) -> Result<(RosbagFile, Vec<MarkedPull>), RosbagError> {
    let bad = |e: &dyn std::fmt::Display| RosbagError {
        path: PathBuf::new(),
        problem: e.to_string(),
        hint: String::new(),
    };
    let schema = "`gripgen schema rosbag` has every key, docs/interop.md an example";
    let file: RosbagFile = parse(path, text).map_err(|e| bad(&e).hint(schema))?;
    check_header(path, &file.campaign).map_err(|e| bad(&e).hint(schema))?;
    for (key, along) in [("force.along", file.force.along), ("motion.along", file.motion.along)] {
        let length = along.iter().map(|x| x * x).sum::<f64>().sqrt();
        if (length - 1.0).abs() > 1e-3 || length.is_nan() {
            let problem = format!("`{key}` is {along:?} of length {length}, it must be 1");
            return Err(RosbagError::new(path, problem).hint(schema));
        }
    }
    let folder = path.parent().unwrap_or(Path::new(""));
    let one = [BagPull::default()];
    let pulls = if file.pulls.is_empty() { &one[..] } else { &file.pulls[..] };
    let mut marked = Vec::with_capacity(pulls.len());
    for (i, pull) in pulls.iter().enumerate() {
        let pull = pull.or(&file.defaults);
        let at = |problem: String| RosbagError::new(path, format!("pulls[{i}]: {problem}")).hint(schema);
        pull.check().map_err(at)?;
        if let Some(label) = ["max_pull_force_n"].iter().find(|key| pull.columns.contains_key(**key)) {
            return Err(at(format!("`{label}` is taken from the readings")));
        }
        let bag = pull.bag.as_ref().map_or_else(|| bag.to_path_buf(), |name| folder.join(name));
        marked.push(MarkedPull { id: pull.pull_id.clone().unwrap_or_default(), bag, marks: pull });
    }
    name(&mut marked);
    Ok((file, marked))
}

/// Names pulls after their bags.
fn name(marked: &mut [MarkedPull]) {
    let mut of_bag: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for pull in marked.iter() {
        *of_bag.entry(pull.bag.clone()).or_default() += 1;
    }
    let mut met: BTreeMap<PathBuf, usize> = BTreeMap::new();
    for pull in marked.iter_mut() {
        let number = met.entry(pull.bag.clone()).or_default();
        *number += 1;
        if pull.id.is_empty() {
            let stem =
                pull.bag.file_stem().map_or_else(|| "bag".into(), |s| s.to_string_lossy().into_owned());
            pull.id = if of_bag[&pull.bag] > 1 { format!("{stem}-{number}") } else { stem };
        }
    }
}
