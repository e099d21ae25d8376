//! Labels as a function of what the jaws hold, over scatter and noise.

use crate::{QuasiStatic, RimTable, SlipPull, SlipRun, StuckPull};
use gripgen_twin::effects::{CommandChain, Creep, SensorChain};
use gripgen_twin::label::moments::LabelRule;
use gripgen_twin::predict::{PullModel, PullPrediction};
use gripgen_twin::{Backbone, Staircase};
use std::sync::{Arc, OnceLock};

/// Distance of two small forces in a table.
const STEP_N: f64 = 0.2;

/// Nodes and weights of the Gauss-Hermite rule of 9 points for a standard normal variable (Abramowitz and Stegun 1964,
/// table 25.10, scaled).
const NODES: [(f64, f64); 9] = [
    (-4.512_745_863_399_783, 2.234_584_400_774_66e-5),
    (-3.205_429_002_856_47, 2.789_141_321_231_77e-3),
    (-2.076_847_978_677_83, 4.991_640_676_521_79e-2),
    (-1.023_255_663_789_13, 2.440_975_028_949_39e-1),
    (0.0, 4.063_492_063_492_06e-1),
    (1.023_255_663_789_13, 2.440_975_028_949_39e-1),
    (2.076_847_978_677_83, 4.991_640_676_521_79e-2),
    (3.205_429_002_856_47, 2.789_141_321_231_77e-3),
    (4.512_745_863_399_783, 2.234_584_400_774_66e-5),
];

/// A pull whose jaws hold a force that scatters.
pub(super) struct Scattered<'a> {
    pub rig: QuasiStatic,
    pub stuck: &'a StuckPull,
    pub staircase: &'a Staircase,
    pub kinetic_ratio: f64,
    pub backbone: &'a Backbone,
    pub scatter: f64,
    pub rule: Arc<LabelRule>,
    pub sensor: SensorChain,
    pub command: CommandChain,
    /// How the tool creeps.
    pub creep: Creep,
    pub rim: Arc<RimTable>,
}

impl Scattered<'_> {
    /// Means and mean squares of the labels of jaws that hold exactly `limits_n`.
    fn labels(&self, limits_n: [f64; TOGETHER], slips: &mut [SlipPull; TOGETHER]) -> [(f64, f64); TOGETHER] {
        let run = SlipRun {
            stuck: self.stuck,
            staircase: self.staircase,
            kinetic_ratio: self.kinetic_ratio,
            backbone: self.backbone,
            creep: self.creep,
            rim: &self.rim,
            decided_n: self.rule.decided_n(),
            sensor: &self.sensor,
            command: &self.command,
        };
        self.rig.slips(&run, limits_n, slips);
        std::array::from_fn(|k| match self.rule.moments(slips[k].ticks(self.stuck)) {
            Some((mean, var)) => (mean, mean * mean + var),
            // A reading that was never near the command: the rule would fail, the reading at the slip stands in.
            None => {
                let reading = reading_n(self.stuck, limits_n[k]);
                (reading, reading * reading)
            }
        })
    }
}

/// The reading when the contact force of a tool that holds reaches `limit_n`.
pub(super) fn reading_n(stuck: &StuckPull, limit_n: f64) -> f64 {
    let contact = &stuck.contact_n;
    let after = contact.partition_point(|&f| f < limit_n).clamp(1, contact.len() - 1);
    let (low, high) = (contact[after - 1], contact[after]);
    let w = if high > low { ((limit_n - low) / (high - low)).clamp(0.0, 1.0) } else { 1.0 };
    stuck.reading_n[after - 1] * (1.0 - w) + stuck.reading_n[after] * w
}

fn finished(limit_n: f64, limit_reading_n: f64, mean_n: f64, square: f64) -> PullPrediction {
    let label_sd_n = (square - mean_n * mean_n).max(0.0).sqrt();
    PullPrediction { limit_n, limit_reading_n, label_n: mean_n, label_sd_n }
}

/// A prediction with what labels of a contact that bends lie above those of one that does not.
pub(super) fn bent_by(
    own: &PullPrediction,
    bent: &PullPrediction,
    straight: &PullPrediction,
) -> PullPrediction {
    PullPrediction {
        label_n: own.label_n + bent.label_n - straight.label_n,
        label_sd_n: (own.label_sd_n + bent.label_sd_n - straight.label_sd_n).max(0.5 * own.label_sd_n),
        ..*own
    }
}

/// Force beyond which distances grow.
const EVEN_N: f64 = 8.0;

/// Place of a force in a table: evenly spaced at first, then by equal ratios.
fn place(limit_n: f64) -> f64 {
    if limit_n <= EVEN_N { limit_n / STEP_N } else { EVEN_N / STEP_N * (1.0 + libm::log(limit_n / EVEN_N)) }
}

/// The force at a place.
fn force_n(place: f64) -> f64 {
    let even = EVEN_N / STEP_N;
    if place <= even { place * STEP_N } else { EVEN_N * libm::exp(place / even - 1.0) }
}

/// Means and mean squares of labels of jaws that hold exactly the forces of a table: what is left where nothing scatters. Tables of all
/// scatters, which differ from fold to fold, share them. Each is worked out when it is first asked for, with its neighbours: the pulls of a
/// campaign need half of them, one pull a tenth.
pub(super) struct ExactLabels {
    values: Vec<OnceLock<[(f64, f64); TOGETHER]>>,
}

/// Neighbours that are worked out together.
const TOGETHER: usize = 4;

/// Scatters for which the same forces are looked at.
const SCATTER_STEP: f64 = 0.1;

/// How many forces a table over `scatter` needs: beyond the largest by what scatter adds.
fn count(max_n: f64, scatter: f64) -> usize {
    place(max_n * (1.0 + 3.3 * scatter)).ceil() as usize + 2
}

/// The scatter whose forces are enough for `scatter`.
pub(super) fn enough_for(scatter: f64) -> f64 {
    SCATTER_STEP * (scatter / SCATTER_STEP).ceil().max(1.0)
}

impl ExactLabels {
    /// For forces up to `max_n` and any scatter up to `scatter`.
    pub fn new(max_n: f64, scatter: f64) -> Self {
        Self { values: (0..count(max_n, scatter).div_ceil(TOGETHER)).map(|_| OnceLock::new()).collect() }
    }

    fn at(&self, i: usize, pull: &Scattered<'_>, slips: &mut [SlipPull; TOGETHER]) -> (f64, f64) {
        let (block, place) = (i / TOGETHER, i % TOGETHER);
        let limit_n = |k: usize| force_n((block * TOGETHER + k) as f64);
        self.values[block].get_or_init(|| pull.labels(std::array::from_fn(limit_n), slips))[place]
    }
}

/// Tables of two kinetic ratios and the weight of the second.
pub(super) type Tables = (Arc<LabelTable>, Arc<LabelTable>, f64);

/// Predictions for forces whose distances grow with them, each worked out when it is first asked for.
pub(super) struct LabelTable {
    rows: Vec<OnceLock<PullPrediction>>,
    exact: Arc<ExactLabels>,
    max_n: f64,
    /// What it is of: a model, without the factors of its pulls, and one of them.
    pub model: PullModel,
    pub row: usize,
    /// Tables of a contact that bends and of one that does not, whose difference is added.
    pub bend: Option<[Tables; 2]>,
}

impl LabelTable {
    /// Of pull `row` of a model; `exact` are its labels without scatter.
    pub fn new(model: &PullModel, row: usize, exact: Arc<ExactLabels>, max_n: f64) -> Self {
        let rows = (0..place(max_n).ceil() as usize + 2).map(|_| OnceLock::new()).collect();
        let model = PullModel { factor: vec![], ..model.clone() };
        Self { rows, exact, max_n, model, row, bend: None }
    }

    /// The prediction for jaws that hold the force of row `i` on average: of `pull`, which is that of the table.
    pub fn of_row(&self, i: usize, pull: &Scattered<'_>) -> PullPrediction {
        let (mut slips, count) = (Default::default(), count(self.max_n, pull.scatter));
        let mut between = |limit_n: f64| {
            let x = place(limit_n).clamp(0.0, (count - 2) as f64);
            let (i, w) = (x as usize, x.fract());
            let [a, b] = [i, i + 1].map(|i| self.exact.at(i, pull, &mut slips));
            (a.0 * (1.0 - w) + b.0 * w, a.1 * (1.0 - w) + b.1 * w)
        };
        let limit_n = force_n(i as f64);
        let (mean, square) = NODES.iter().fold((0.0, 0.0), |(m, s), &(z, w)| {
            let (mean, square) = between((limit_n * (1.0 + pull.scatter * z)).max(0.0));
            (m + w * mean, s + w * square)
        });
        finished(limit_n, reading_n(pull.stuck, limit_n), mean, square)
    }

    /// Row `i`, which `make` works out if nobody has asked for it.
    pub fn row(&self, i: usize, make: impl FnOnce() -> PullPrediction) -> PullPrediction {
        *self.rows[i].get_or_init(make)
    }

    /// The prediction for jaws that hold `limit_n`, between its rows.
    pub fn at(&self, limit_n: f64, row: impl Fn(usize) -> PullPrediction) -> PullPrediction {
        let last = self.rows.len() - 1;
        let x = place(limit_n).clamp(0.0, last as f64 - 1e-9);
        let (i, w) = (x as usize, x.fract());
        let (a, b) = (row(i), row(i + 1));
        let mix = |a: f64, b: f64| a * (1.0 - w) + b * w;
        // Beyond the table everything grows with the force, but for labels that a stop ends.
        let beyond = (limit_n / force_n(last as f64)).max(1.0);
        let stopped = self.model.creep.is_some_and(|creep| creep.rate_m_per_n_s > 0.0);
        PullPrediction {
            limit_n,
            limit_reading_n: beyond * mix(a.limit_reading_n, b.limit_reading_n),
            label_n: if stopped { 1.0 } else { beyond } * mix(a.label_n, b.label_n),
            label_sd_n: mix(a.label_sd_n, b.label_sd_n),
        }
    }
}
