//! The structs that mirror `sweep.toml`.

use super::ImagesFile;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A sweep: which twin, how many samples, and what varies.
///
/// Paths are relative to this file; `asset:...` names a file inside gripgen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// Path of the twin.
    pub twin: String,
    /// Number of samples. May be left out with `design = "grid"`, whose size follows from the lists.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub samples: Option<u64>,
    /// How values are drawn.
    #[serde(default)]
    pub design: DesignFile,
    /// Samples of each drawn configuration; they differ in scatter and noise only.
    #[serde(default = "one")]
    pub repetitions: u64,
    /// Seed of all randomness.
    #[serde(default)]
    pub seed: u64,
    /// Which mechanics.
    #[serde(default)]
    pub mechanics: Mechanics,
    /// Where images are made.
    #[serde(default)]
    pub backend: Backend,
    /// Part of the name of the graphics adapter for `backend = "gpu"`; where it is left out, the first graphics
    /// processor. A software adapter (`llvmpipe`) is taken by name only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gpu_adapter: Option<String>,
    /// How images are stored, and whether the pull is filmed.
    #[serde(default)]
    pub images: ImagesFile,
    /// Whether the force trace is stored.
    #[serde(default)]
    pub trace: TraceStorage,
    /// Samples in one file.
    #[serde(default = "shard_samples")]
    pub shard_samples: u64,
    /// Files of priors: what they draw is added to `[vary]`, and their effects to the twin, where these lack them. Shipped:
    /// `asset:priors/friction.toml`, `asset:priors/gel.toml`, `asset:priors/rig.toml`, `asset:priors/images.toml`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub priors: Vec<String>,
    /// Values that vary: any key of the scenario, of `[pull]` (`pull.increment_n`) or of the twin
    /// (`parts.gear.mu`, `effects.wear.depth`), or a column of one's own that a table of the twin depends on.
    /// `parts.*.KEY` is the key of the part that is drawn: `parts.*.mu`.
    /// A value is a list, a plain value, `{ uniform = [low, high] }`, `{ log_uniform = [low, high] }`, `{ normal = [mean, deviation] }`,
    /// `{ log_normal = [median, deviation of the natural logarithm] }` or `{ from = "interval" }`.
    /// `per = "rig" | "gel" | "session" | "part" | "grip" | "sample"` with it says what shares a draw (`grip`: the repetitions of a
    /// configuration; `["rig", "part"]`: each part on each rig has its own), `spread = { gel = 0.12 }` what further levels add (multiply, in natural logarithms, where the distribution is
    /// logarithmic), `limits = [low, high]` where values end; `{ one_of = [...], per = "gel" }` is a list.
    /// `twin = { from = "posterior" }` draws cause and parameters together from the posterior beside the twin.
    #[serde(default)]
    #[schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")]
    pub vary: toml::Table,
    /// How many rigs, gels and sessions the samples come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub groups: Option<GroupsFile>,
    /// The pull.
    #[serde(default)]
    pub pull: PullFile,
}

/// `[groups]`: each sample comes from one session of one gel of one rig, all of them equally likely. Their names are the columns
/// `session`, `gel_id` and `rig_id`; `per` in `[vary]` says which values they share.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GroupsFile {
    /// Number of rigs.
    pub rigs: u64,
    /// Gels that each rig wears out.
    #[serde(default = "one")]
    pub gels_per_rig: u64,
    /// Sessions with each gel.
    #[serde(default = "one")]
    pub sessions_per_gel: u64,
}

fn one() -> u64 {
    1
}

fn shard_samples() -> u64 {
    64
}

/// How values are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum DesignFile {
    /// Independent random draws.
    #[default]
    Random,
    /// Every combination of the listed values; distributions are drawn at random beside them.
    Grid,
    /// A Sobol sequence over all varied keys, shifted by the seed: fills the space evenly.
    Sobol,
}

/// Which mechanics simulate the pull.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Mechanics {
    /// Rigid bodies in Rapier.
    #[default]
    Rapier,
    /// gripgen's own reduced model.
    Reduced,
}

/// Where tactile images are computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Backend {
    /// The processor; bitwise reproducible.
    #[default]
    Cpu,
    /// A graphics processor (Vulkan, Metal or DX12); equal to `cpu` within a tolerance.
    Gpu,
}

/// Whether the force trace is stored.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TraceStorage {
    /// Every reading of the wrist sensor.
    #[default]
    Full,
    /// The label alone.
    None,
}

/// `[pull]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PullFile {
    /// Height of a step of the force staircase.
    pub increment_n: f64,
    /// Force of the first step; one increment where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub start_n: Option<f64>,
    /// Length of a step.
    pub step_s: StepFile,
    /// Displacement at which the pull ends.
    pub stop_mm: f64,
    /// Direction of the pull in the world; +z is up, y is the jaw axis.
    pub direction: [f64; 3],
    /// Commanded force at which the pull ends without slip; none where it is left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub max_force_n: Option<f64>,
    /// Longest time of a pull.
    pub max_time_s: f64,
    /// Tolerance of the label rule: the label is the last force within it of the command.
    pub label_tolerance_n: f64,
}

impl Default for PullFile {
    /// Increment, stop and tolerance of the campaigns; 0.104 s is the mean step time and 3 N the tolerance of
    /// Wucherer et al. 2023, who print neither increment nor stop.
    fn default() -> Self {
        Self {
            increment_n: 1.0,
            start_n: None,
            step_s: StepFile::Constant(0.104),
            stop_mm: 5.0,
            direction: [0.0, 0.0, 1.0],
            max_force_n: None,
            max_time_s: 60.0,
            label_tolerance_n: 3.0,
        }
    }
}

/// Length of a step: a number, or a mean with jitter.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "expected seconds, or { value = seconds, jitter = fraction }")]
pub enum StepFile {
    /// Equal steps.
    Constant(f64),
    /// Uneven steps.
    Jittered(JitteredStep),
}

/// A step length that varies.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct JitteredStep {
    /// Mean length in seconds.
    pub value: f64,
    /// Half width of the uniform variation, as a fraction of the mean.
    #[serde(default)]
    pub jitter: f64,
}
