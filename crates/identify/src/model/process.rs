//! What columns do to friction without a name, for prediction alone: a law of the load, and a smooth process over all columns
//! together. They are offered once, after the search; where they explain the labels better without terms, they replace them.

use super::features::standard;
use super::gaussian::{Block, SdPrior};
use super::search::{Fit, Search};
use super::tables::LearntTable;
use super::terms::{EXPECTED, Kind, usable_columns};
use crate::pulls::candidates::Candidate;
use crate::pulls::curves::CLOCKS;
use crate::pulls::data::{Column, PullData};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{Surface, SurfaceAxis, Values};
use nalgebra::{DMatrix, DVector};

const LOAD: &str = "grip_force_n";
/// Coefficient of the law of the load, and how far a part deviates from it.
const SHARE: SdPrior = SdPrior { median: 0.5, spread: 0.7 };
const OF_PART: SdPrior = SdPrior { median: 0.1, spread: 1.0 };
/// Constant parts of the friction force that are tried, over mu and the geometric middle of the loads.
const OF_CONSTANT: [f64; 9] = [0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2, 6.4, 12.8];
/// Number of processes over several columns that act in a campaign, expected before it is looked at.
const TOGETHER: f64 = 0.02;
/// How far the process moves labels; that of an effect.
const SIZE: SdPrior = super::terms::SIZE;
/// Lengths that a column may have, in its standard deviations; the last means that it does not count. Between words 1 is the distance.
const LENGTHS: [f64; 6] = [0.35, 0.7, 1.4, 2.8, 5.6, f64::INFINITY];
const NOT_COUNTING: f64 = 11.2;
/// The length from which each search starts, by position.
const STARTS: [usize; 2] = [2, 3];
/// Rounds over the columns.
const ROUNDS: usize = 3;
/// Points of the process while its lengths are sought, and afterwards.
const POINTS: [usize; 2] = [50, 100];
/// Variance that keeps the points apart.
const JITTER: f64 = 1e-6;
/// A table of a power law reaches this far beyond the loads that were measured, in this many places.
const BEYOND: f64 = 4.0;
const PLACES: usize = 25;

/// What is added to the friction of each pull, and how it is written into a twin.
#[derive(Debug, Clone, Default)]
pub(super) struct Process {
    load: Option<Load>,
    joint: Option<Joint>,
}

/// A law of the load: the logarithm of friction is a coefficient times log(1 + b / F), with the coefficient between 0 and 1. With 1 the
/// friction force has a constant part, mu (F + b); with a large b it is a power law.
#[derive(Debug, Clone)]
struct Load {
    b_n: f64,
    /// log(1 + b / F) of each pull.
    x: Vec<f64>,
}

fn law(b_n: f64, force_n: f64) -> f64 {
    libm::log(1.0 + b_n / force_n)
}

/// A column as the process sees it: standardised numbers, or positions of words.
struct Axis {
    name: String,
    x: Vec<f64>,
    words: bool,
    /// Pulls that have no value.
    missing: Vec<usize>,
}

#[derive(Debug, Clone)]
struct Joint {
    axes: Vec<SurfaceAxis>,
    /// Length of each axis, of those too that do not count, and the logarithm of their prior.
    lengths: Vec<f64>,
    log_prior: f64,
    /// The pulls that are its points, and the values of each in the axes.
    points: Vec<Vec<Drawn>>,
    /// Takes coefficients of the features to weights of the points.
    to_weights: DMatrix<f64>,
    /// Mean of each feature in each part.
    means: DMatrix<f64>,
}

/// What the process does to a model.
pub(super) struct Added {
    pub(super) process: Process,
    pub(super) fit: Fit,
    /// Whether the smooth process replaces terms that were there, or all that there could be.
    pub(super) instead: bool,
    /// Probability of the parts alone where the process is compared with them.
    pub(super) nothing: f64,
}

impl Process {
    /// Adds to a fit what its evidence gains from. Terms leave it where the process explains the labels better without them, though
    /// it is less expected than they are: first the curves, then all. `alone`: there were no terms to be found.
    pub(super) fn added(
        data: &PullData<'_>,
        candidates: &[Candidate],
        search: &Search,
        fit: &Fit,
        alone: bool,
    ) -> Added {
        // A process in the place of terms has the prior of as many columns as count in it, and of their acting together.
        let of_column = libm::log(EXPECTED.columns / usable_columns(data).len().max(1) as f64);
        let whole = |fit: Fit, of_column: f64| {
            let (process, fit) = Self::with(data, candidates, search, &fit, of_column);
            let joint = process.joint.as_ref().map_or(0.0, |joint| joint.log_prior + libm::log(TOGETHER));
            (fit.score + joint, process, fit)
        };
        if alone {
            let plain = fit.gaussian.log_evidence;
            let (score, process, fit) = whole(fit.clone(), 0.0);
            let gain = score + of_column * process.columns().len() as f64 - plain;
            let instead = !fit.process.is_empty() && gain > 0.0;
            return Added { instead, process, fit, nothing: 1.0 / (1.0 + libm::exp(gain)) };
        }
        let named: Vec<bool> = fit.chosen.iter().map(|c| search.terms[c.term].is_effect()).collect();
        let plain_score = fit.score;
        let (score, process, with) = whole(fit.clone(), 0.0);
        let unchanged = Added { process, fit: with, instead: false, nothing: 1.0 };
        let mut best = (score.max(plain_score), unchanged);
        let none = vec![false; named.len()];
        for stay in [named, none] {
            let smaller = stay.iter().filter(|stay| **stay).count() < best.1.fit.chosen.len();
            let Some(fewer) = search.only(fit, &stay).filter(|_| smaller) else { continue };
            let (score, process, with) = whole(fewer, of_column);
            if score > best.0 && process.joint.is_some() {
                let nothing = 1.0 / (1.0 + libm::exp(score - plain_score));
                best = (score, Added { process, fit: with, instead: true, nothing });
            }
        }
        best.1
    }

    fn with(
        data: &PullData<'_>,
        candidates: &[Candidate],
        search: &Search,
        fit: &Fit,
        of_column: f64,
    ) -> (Self, Fit) {
        let mut process = Self::default();
        let mut best = fit.clone();
        // An effect of the load is a law of it.
        let of_load = fit.chosen.iter().any(|c| match search.terms[c.term].kind {
            Kind::Effect(e) | Kind::EffectOfParts(e) => candidates[e].spec.covariates.contains(&LOAD),
            _ => false,
        });
        for (blocks, load) in load_blocks(data).into_iter().filter(|_| !of_load) {
            if let Some(next) = search.with_process(fit, blocks)
                && next.gaussian.log_evidence > best.gaussian.log_evidence
            {
                (best, process.load) = (next, Some(load));
            }
        }
        if let Some((joint, next)) = joint(data, search, &best, of_column) {
            (best, process.joint) = (next, Some(joint));
        }
        (process, best)
    }

    /// The same kind of process fitted to other weights of the pulls: its constants are sought again, near those that it has in `fit`.
    pub(super) fn again(&self, data: &PullData<'_>, search: &Search, fit: &Fit) -> Option<Fit> {
        let evidence = |fit: &Fit| fit.gaussian.log_evidence;
        let laws = load_blocks(data).into_iter().filter(|_| self.load.is_some());
        let laws = laws.filter_map(|(blocks, _)| search.with_process(fit, blocks));
        let law = laws.reduce(|a, b| if evidence(&b) > evidence(&a) { b } else { a });
        let Some(joint) = &self.joint else { return law };
        // Its deviations start from those of the whole fit, the joint one among them.
        let process = law.map_or(vec![], |law| law.process);
        let fit = Fit { process, ..fit.clone() };
        let lengths = Lengths { data, search, fit: &fit, axes: axes(data), of_column: 0.0 };
        let (_, own, now) = lengths.climbed(joint.lengths.clone(), 1);
        Some(lengths.fitted(&own, POINTS[1], &now)?.0)
    }

    /// The columns on which it depends.
    pub(super) fn columns(&self) -> Vec<&str> {
        match &self.joint {
            Some(joint) => joint.axes.iter().map(|axis| axis.column.as_str()).collect(),
            None => self.load.iter().map(|_| LOAD).collect(),
        }
    }

    /// The process as tables and a surface; what the surface adds in each part stays to be taken off its friction.
    pub(super) fn written(
        &self,
        data: &PullData<'_>,
        search: &Search,
        fit: &Fit,
    ) -> (Vec<LearntTable>, Option<Surface>, Vec<f64>) {
        let mut block = search.block_of(fit.chosen.len());
        let coefficients = |block: usize| {
            let (at, end) = (fit.gaussian.begins[block], fit.gaussian.begins[block + 1]);
            fit.gaussian.mean.rows(at, end - at).into_owned()
        };
        let mut tables = vec![];
        if let Some(load) = &self.load {
            let shared = coefficients(block)[0];
            block += 1;
            let mut own = DVector::zeros(data.parts.len());
            if data.parts.len() > 1 {
                own = coefficients(block);
                block += 1;
            }
            let of = |(p, part): (usize, &String)| law_of_part(data, load, p, part, own[p] + shared);
            tables.extend(data.parts.iter().enumerate().filter_map(of));
        }
        let mut added = vec![0.0; data.parts.len()];
        let surface = self.joint.as_ref().map(|joint| {
            let own = coefficients(block);
            added = (&joint.means * &own).iter().copied().collect();
            let weights = (&joint.to_weights * own).iter().copied().collect();
            Surface { axes: joint.axes.clone(), points: joint.points.clone(), weights }
        });
        (tables, surface, added)
    }
}

/// Laws of the load about their mean in each part: what all parts share, and what each deviates from it.
fn load_blocks(data: &PullData<'_>) -> Vec<(Vec<Block>, Load)> {
    let Some(Column::Number(force_n)) = data.columns.get(LOAD) else { return vec![] };
    let (low, high) = force_n.iter().fold((f64::INFINITY, 0.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
    if low <= 0.0 || high < low * 1.001 {
        return vec![];
    }
    let middle = (low * high).sqrt();
    let parts = data.parts.len();
    let each = OF_CONSTANT.map(|share| {
        let b_n = share * middle;
        let x: Vec<f64> = force_n.iter().map(|f| law(b_n, *f)).collect();
        let mean = means(data, &DMatrix::from_column_slice(x.len(), 1, &x));
        let about = |i: usize| x[i] - mean[(data.part_of[i], 0)];
        let shared = DMatrix::from_fn(x.len(), 1, |i, _| about(i));
        let mut blocks = vec![Block { features: shared, sd: SHARE, range: Some((0.0, 1.0)) }];
        if parts > 1 {
            let own =
                DMatrix::from_fn(x.len(), parts, |i, k| if k == data.part_of[i] { about(i) } else { 0.0 });
            blocks.push(Block { features: own, sd: OF_PART, range: None });
        }
        (blocks, Load { b_n, x })
    });
    each.into_iter().collect()
}

/// Mean of each feature in each part.
fn means(data: &PullData<'_>, features: &DMatrix<f64>) -> DMatrix<f64> {
    let mut sums = DMatrix::zeros(data.parts.len(), features.ncols());
    let mut counts = vec![0.0_f64; data.parts.len()];
    for (i, &part) in data.part_of.iter().enumerate() {
        counts[part] += 1.0;
        let mut row = sums.row_mut(part);
        row += features.row(i);
    }
    for (part, count) in counts.iter().enumerate() {
        let mut row = sums.row_mut(part);
        row /= count.max(1.0);
    }
    sums
}

/// The law of a part as a table that reaches beyond the loads that were measured.
fn law_of_part(data: &PullData<'_>, load: &Load, p: usize, part: &str, factor: f64) -> Option<LearntTable> {
    let Some(Column::Number(force_n)) = data.columns.get(LOAD) else { return None };
    let own: Vec<usize> = (0..force_n.len()).filter(|&i| data.part_of[i] == p).collect();
    let mean = own.iter().map(|&i| load.x[i]).sum::<f64>() / own.len() as f64;
    let forces = || own.iter().map(|&i| force_n[i]);
    let low = libm::log(forces().fold(f64::INFINITY, f64::min) / BEYOND);
    let high = libm::log(forces().fold(0.0, f64::max) * BEYOND);
    let at = |k: usize| libm::exp(low + (high - low) * k as f64 / (PLACES - 1) as f64);
    let value = |k: usize| libm::exp((factor * (law(load.b_n, at(k)) - mean)).clamp(-6.0, 6.0));
    low.is_finite().then(|| LearntTable {
        covariate: LOAD.into(),
        centre: None,
        part: (data.parts.len() > 1).then(|| part.into()),
        only: None,
        places: Values::Numbers((0..PLACES).map(at).collect()),
        factor: (0..PLACES).map(value).collect(),
    })
}

fn axes(data: &PullData<'_>) -> Vec<Axis> {
    let own = usable_columns(data).into_iter().filter(|name| !CLOCKS.contains(name));
    let positions = |of: &[usize]| of.iter().map(|k| *k as f64).collect();
    let mut axes: Vec<Axis> = own
        .filter_map(|name| {
            let (x, words) = match &data.columns[name] {
                Column::Number(x) => (standard(x)?, false),
                Column::Word(at, _) => (positions(at), true),
            };
            let missing = data.missing.get(name).cloned().unwrap_or_default();
            Some(Axis { name: name.into(), x, words, missing })
        })
        .collect();
    if data.parts.len() > 1 {
        axes.push(Axis { name: "part".into(), x: positions(&data.part_of), words: true, missing: vec![] });
    }
    axes
}

/// Squared distance of two pulls, each column over its length.
fn distance(axes: &[Axis], lengths: &[f64], i: usize, k: usize) -> f64 {
    let own = axes.iter().zip(lengths).map(|(axis, length)| {
        let apart =
            if axis.words { f64::from(u8::from(axis.x[i] != axis.x[k])) } else { axis.x[i] - axis.x[k] };
        (apart / length) * (apart / length)
    });
    own.sum()
}

/// Pulls that have values in the columns that count and differ there, `most` of them at most, evenly over the order of the table.
fn points(axes: &[Axis], lengths: &[f64], n: usize, most: usize) -> Vec<usize> {
    let mut own: Vec<usize> = Vec::new();
    let lacks = |i: usize| {
        axes.iter().zip(lengths).any(|(axis, length)| length.is_finite() && axis.missing.contains(&i))
    };
    for i in (0..n).filter(|&i| !lacks(i)) {
        if own.iter().all(|&k| distance(axes, lengths, i, k) > 1e-9) {
            own.push(i);
        }
    }
    let count = own.len().min(most);
    (0..count).map(|k| own[k * own.len() / count]).collect()
}

/// The features of the process with these lengths: Nystroem's, about their mean in each part.
fn features(
    data: &PullData<'_>,
    axes: &[Axis],
    lengths: &[f64],
    points: &[usize],
) -> Option<(DMatrix<f64>, DMatrix<f64>, DMatrix<f64>)> {
    let kernel = |i: usize, k: usize| libm::exp(-0.5 * distance(axes, lengths, i, k));
    let m = points.len();
    let within =
        DMatrix::from_fn(m, m, |i, k| kernel(points[i], points[k]) + if i == k { JITTER } else { 0.0 });
    let across = DMatrix::from_fn(m, data.len(), |k, i| kernel(points[k], i));
    let lower = within.cholesky()?.l();
    let raw = lower.solve_lower_triangular(&across)?.transpose();
    let means = means(data, &raw);
    let centred = DMatrix::from_fn(raw.nrows(), m, |i, k| raw[(i, k)] - means[(data.part_of[i], k)]);
    let to_weights = lower.transpose().solve_upper_triangular(&DMatrix::identity(m, m))?;
    Some((centred, means, to_weights))
}

/// What is believed of lengths: their logarithms are normal about that of 2 deviations, with a deviation of 1. A column that does not
/// count has the next length of the list.
fn log_prior(lengths: &[f64], of_column: f64) -> f64 {
    let one = |length: &f64| libm::log(length.min(NOT_COUNTING) / 2.0);
    let counting = lengths.iter().filter(|length| length.is_finite()).count() as f64;
    of_column * counting - 0.5 * lengths.iter().map(|length| one(length) * one(length)).sum::<f64>()
}

/// Lengths that are tried in the place of one: its neighbours, and not to count; a short and a long one where the column does not count.
fn near(length: f64) -> Vec<f64> {
    match LENGTHS.iter().position(|own| *own == length) {
        Some(k) if length.is_finite() => {
            let neighbours = [k.checked_sub(1), Some(k + 1), Some(LENGTHS.len() - 1)];
            let mut near: Vec<f64> = neighbours.into_iter().flatten().map(|k| LENGTHS[k]).collect();
            near.dedup();
            near
        }
        _ => vec![LENGTHS[1], LENGTHS[3]],
    }
}

/// A search over the lengths of a process that is added to a fit.
struct Lengths<'a> {
    data: &'a PullData<'a>,
    search: &'a Search,
    fit: &'a Fit,
    axes: Vec<Axis>,
    /// Logarithm of the prior of each column that counts.
    of_column: f64,
}

impl Lengths<'_> {
    /// The fit with these lengths and `most` points, its deviations started from those of `from`.
    fn fitted(&self, lengths: &[f64], most: usize, from: &Fit) -> Option<(Fit, Vec<usize>)> {
        let points = points(&self.axes, lengths, self.data.len(), most);
        if points.len() < 2 {
            return None;
        }
        let (features, ..) = features(self.data, &self.axes, lengths, &points)?;
        let mut process = self.fit.process.clone();
        process.push(Block { features, sd: SIZE, range: None });
        Some((self.search.with_process(from, process)?, points))
    }

    /// The lengths to which the evidence rises from a start, one column after the other, with the evidence.
    fn climbed(&self, mut lengths: Vec<f64>, rounds: usize) -> (f64, Vec<f64>, Fit) {
        let score =
            |fit: &Fit, lengths: &[f64]| fit.gaussian.log_evidence + log_prior(lengths, self.of_column);
        let mut now = self.fitted(&lengths, POINTS[0], self.fit).map_or_else(|| self.fit.clone(), |f| f.0);
        for _ in 0..rounds {
            let before = score(&now, &lengths);
            for d in 0..self.axes.len() {
                for length in near(lengths[d]) {
                    let mut tried = lengths.clone();
                    tried[d] = length;
                    if let Some((next, _)) = self.fitted(&tried, POINTS[0], &now)
                        && score(&next, &tried) > score(&now, &lengths)
                    {
                        (now, lengths) = (next, tried);
                    }
                }
            }
            if score(&now, &lengths) < before + 1e-3 {
                break;
            }
        }
        (score(&now, &lengths), lengths, now)
    }
}

/// The process over all columns, with the lengths of the highest evidence; nothing where the evidence does not exceed the prior cost of
/// their choice.
fn joint(data: &PullData<'_>, search: &Search, fit: &Fit, of_column: f64) -> Option<(Joint, Fit)> {
    let lengths = Lengths { data, search, fit, axes: axes(data), of_column };
    if lengths.axes.is_empty() {
        return None;
    }
    // Where columns are dear, the search starts from one of them, else from all.
    let starts = match of_column < 0.0 {
        true => vec![f64::INFINITY],
        false => STARTS.map(|start| LENGTHS[start]).to_vec(),
    };
    let climbed = starts.into_iter().map(|start| lengths.climbed(vec![start; lengths.axes.len()], ROUNDS));
    let best = climbed.reduce(|a, b| if b.0 > a.0 { b } else { a });
    let (_, own, now) = best?;
    let (next, points) = lengths.fitted(&own, POINTS[1], &now)?;
    let Lengths { axes, .. } = lengths;
    let lengths = own;
    let log_prior = log_prior(&lengths, of_column);
    if next.gaussian.log_evidence + log_prior <= fit.gaussian.log_evidence {
        return None;
    }
    let (_, means, to_weights) = features(data, &axes, &lengths, &points)?;
    let counting: Vec<usize> = (0..axes.len()).filter(|&d| lengths[d].is_finite()).collect();
    let written = counting.iter().map(|&d| axis_of(data, &axes[d], lengths[d])).collect();
    let value = |i: usize, d: usize| match axes[d].name.as_str() {
        "part" => Drawn::Text(data.parts[data.part_of[i]].clone()),
        name => match &data.columns[name] {
            Column::Number(x) => Drawn::Number(x[i]),
            Column::Word(at, words) => Drawn::Text(words[at[i]].clone()),
        },
    };
    let points = points.iter().map(|&i| counting.iter().map(|&d| value(i, d)).collect()).collect();
    Some((Joint { axes: written, lengths, log_prior, points, to_weights, means }, next))
}

/// An axis in the units of its column.
fn axis_of(data: &PullData<'_>, axis: &Axis, length: f64) -> SurfaceAxis {
    let plain = |logarithm, length| SurfaceAxis { column: axis.name.clone(), length, logarithm };
    let Some(Column::Number(x)) = data.columns.get(&axis.name).filter(|_| !axis.words) else {
        return plain(false, length);
    };
    let logarithm = super::features::by_logarithm(x);
    let of = |i: usize| if logarithm { libm::log(x[i]) } else { x[i] };
    // Standardised numbers are linear in the others: the ends say the deviation.
    let ends = DVector::from_vec(axis.x.clone());
    let (low, high) = (ends.imin(), ends.imax());
    let deviation = (of(high) - of(low)) / (axis.x[high] - axis.x[low]);
    plain(logarithm, length * deviation)
}
