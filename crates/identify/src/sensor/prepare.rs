//! A table as the fits need it: sessions in one piece, spikes out, rows averaged in groups.

use super::SensorData;
use super::moments::Unit;
use gripgen_twin::effects::TableSpan;
use gripgen_twin::values::median;

/// Folds of every session.
pub(crate) const FOLDS: usize = 6;
/// Fewest rows of a session.
const MIN_SESSION_ROWS: usize = 24;
/// Fewest rows of a unit.
const MIN_UNIT_ROWS: usize = 20;
/// Most units of a fold.
const MAX_UNITS: usize = 4;
/// A row is a spike if it leaves its neighbours by this many robust standard deviations.
const SPIKE: f64 = 12.0;

/// Rows of the table, ordered by session, and groups of them.
#[derive(Debug, Clone)]
pub(crate) struct Prepared {
    /// Time since the start of the table.
    pub clock_s: Vec<f64>,
    /// Time since the row before, the median at the start of a session.
    pub step_s: Vec<f64>,
    pub reference_n: Vec<f64>,
    pub measured: Vec<f64>,
    pub session: Vec<usize>,
    /// Rows of the table that these are.
    pub row: Vec<usize>,
    /// Groups of rows that are averaged.
    pub groups: Vec<(usize, usize)>,
    /// Of the groups: time since the one before in medians, infinite at the start of a session.
    pub group_steps: Vec<f64>,
    /// Of the groups.
    pub units: Vec<Unit>,
    /// Names of the sessions that are left.
    pub names: Vec<String>,
    /// Rows of the table that are spikes.
    pub spikes: Vec<usize>,
    pub notes: Vec<String>,
}

impl Prepared {
    /// Means of a column over the groups.
    pub fn grouped(&self, column: &[f64]) -> Vec<f64> {
        self.groups
            .iter()
            .map(|&(from, to)| column[from..to].iter().sum::<f64>() / (to - from) as f64)
            .collect()
    }

    /// Session of each group.
    pub fn group_session(&self) -> Vec<usize> {
        self.groups.iter().map(|&(from, _)| self.session[from]).collect()
    }

    /// Time between the first and the last row of the longest session.
    pub fn longest_s(&self) -> f64 {
        let mut ends = vec![(f64::INFINITY, f64::NEG_INFINITY); self.names.len()];
        for (t, &s) in self.clock_s.iter().zip(&self.session) {
            ends[s] = (ends[s].0.min(*t), ends[s].1.max(*t));
        }
        ends.iter().map(|(a, b)| b - a).fold(0.0, f64::max)
    }

    /// Time between the first and the last row.
    pub fn whole_s(&self) -> f64 {
        self.clock_s.iter().fold(0.0, |m, t| t.max(m))
    }

    /// What the fits of effects need to know of it.
    pub fn span(&self) -> TableSpan {
        let (lowest_n, highest_n) = range(self.reference_n.iter().copied());
        let step_s = median(self.step_s.clone()).unwrap_or_default();
        TableSpan { lowest_n, highest_n, step_s, longest_s: self.longest_s(), whole_s: self.whole_s() }
    }
}

/// Why a table cannot be diagnosed, in a sentence.
pub(crate) fn prepare(data: &SensorData, max_rows: usize) -> Result<Prepared, String> {
    let n = data.time_s.len();
    let lengths = [data.reference_force_n.len(), data.measured_force_n.len(), data.session.len()];
    if lengths.iter().any(|&l| l != n) {
        return Err(format!("{n} times, but {lengths:?} references, readings and sessions"));
    }
    if n < 2 {
        return Err(format!("{n} rows: a diagnosis needs {MIN_SESSION_ROWS} of a session at least"));
    }
    let mut notes = Vec::new();
    let mut rows: Vec<usize> = Vec::with_capacity(n);
    let mut session = Vec::with_capacity(n);
    let mut names = Vec::new();
    for (s, name) in data.sessions.iter().enumerate() {
        let of: Vec<usize> = (0..n).filter(|&i| data.session[i] == s && finite(data, i)).collect();
        let (low, high) = range(of.iter().map(|&i| data.reference_force_n[i]));
        if of.len() < MIN_SESSION_ROWS {
            notes.push(format!("session {name}: {} rows, {MIN_SESSION_ROWS} are needed; left out", of.len()));
        } else if high - low <= 1e-6 * high.abs().max(low.abs()) {
            notes.push(format!("session {name}: the reference force is {low} N all the time; left out"));
        } else {
            session.extend(std::iter::repeat_n(names.len(), of.len()));
            rows.extend(of);
            names.push(name.clone());
        }
    }
    if names.is_empty() {
        notes.insert(0, "no session can be used: the reference force has to change".into());
        return Err(notes.join("; "));
    }
    let pick = |values: &[f64]| rows.iter().map(|&i| values[i]).collect::<Vec<f64>>();
    let (time, reference_n, mut measured) =
        (pick(&data.time_s), pick(&data.reference_force_n), pick(&data.measured_force_n));
    let (low, high) = range(measured.iter().copied());
    if high - low <= 1e-9 * high.abs().max(low.abs()) {
        return Err(format!("the measured force is {low} all the time"));
    }
    let start = time.iter().copied().fold(f64::INFINITY, f64::min);
    let clock_s: Vec<f64> = time.iter().map(|t| t - start).collect();
    let starts: Vec<usize> =
        (0..rows.len()).filter(|&i| i == 0 || session[i] != session[i - 1]).chain([rows.len()]).collect();
    let is_start = |i: usize| starts.binary_search(&i).is_ok();
    let steps: Vec<f64> = (1..rows.len()).filter(|&i| !is_start(i)).map(|i| time[i] - time[i - 1]).collect();
    if let Some(bad) = steps.iter().find(|s| s.is_nan() || **s <= 0.0) {
        return Err(format!("the time moves by {bad} s from one row of a session to the next"));
    }
    let median_s = median(steps).unwrap_or_default();
    let step_s =
        (0..rows.len()).map(|i| if is_start(i) { median_s } else { time[i] - time[i - 1] }).collect();
    let spikes = remove_spikes(&reference_n, &mut measured, &starts);
    if !spikes.is_empty() {
        let (count, all) = (spikes.len(), rows.len());
        notes.push(format!("{count} of {all} readings leave their neighbours alone and were not used"));
    }
    let size = rows.len().div_ceil(max_rows.max(100));
    let mut groups = Vec::new();
    for pair in starts.windows(2) {
        let count = ((pair[1] - pair[0]) / size).max(1);
        let length = pair[1] - pair[0];
        groups.extend((0..count).map(|k| (pair[0] + k * length / count, pair[0] + (k + 1) * length / count)));
    }
    let centre = |&(from, to): &(usize, usize)| 0.5 * (time[from] + time[to - 1]);
    let group_steps = (0..groups.len())
        .map(|k| {
            if is_start(groups[k].0) {
                f64::INFINITY
            } else {
                (centre(&groups[k]) - centre(&groups[k - 1])) / (median_s * size as f64)
            }
        })
        .collect();
    let units = units(&groups, &session);
    let spikes = spikes.into_iter().map(|i| rows[i]).collect();
    Ok(Prepared {
        clock_s,
        step_s,
        reference_n,
        measured,
        session,
        row: rows,
        groups,
        group_steps,
        units,
        names,
        spikes,
        notes,
    })
}

fn finite(data: &SensorData, i: usize) -> bool {
    [data.time_s[i], data.reference_force_n[i], data.measured_force_n[i]].iter().all(|x| x.is_finite())
}

/// Smallest and largest of finite values.
pub(crate) fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)))
}

/// Every session in [`FOLDS`] contiguous folds, every fold in a few units.
fn units(groups: &[(usize, usize)], session: &[usize]) -> Vec<Unit> {
    let mut units = Vec::new();
    let mut from = 0;
    while from < groups.len() {
        let s = session[groups[from].0];
        let to = (from..groups.len()).find(|&k| session[groups[k].0] != s).unwrap_or(groups.len());
        let n = to - from;
        let parts = (n / (FOLDS * MIN_UNIT_ROWS)).clamp(1, MAX_UNITS);
        let all = FOLDS * parts;
        units.extend((0..all).map(|k| Unit {
            session: s,
            fold: k / parts,
            from: from + k * n / all,
            to: from + (k + 1) * n / all,
        }));
        from = to;
    }
    units
}

/// Readings far from both neighbours, beyond what the change of the reference explains, are put between them. Returns
/// their places. Where more than one in fifty is a spike, none is: then that is what the sensor does.
fn remove_spikes(reference_n: &[f64], measured: &mut [f64], starts: &[usize]) -> Vec<usize> {
    let mut bends = Vec::with_capacity(measured.len());
    for pair in starts.windows(2) {
        for i in pair[0] + 2..pair[1] - 2 {
            let mut near = [i - 2, i - 1, i + 1, i + 2].map(|k| measured[k]);
            near.sort_by(f64::total_cmp);
            let slope = (near[3] - near[0]).abs();
            let middle = 0.5 * (near[1] + near[2]);
            bends.push((i, measured[i] - middle, slope));
        }
    }
    let Some(middle) = median(bends.iter().map(|b: &(usize, f64, f64)| b.1.abs()).collect()) else {
        return Vec::new();
    };
    let robust = 1.4826 * middle;
    let (low, high) = range(reference_n.iter().copied());
    let (bottom, top) = range(measured.iter().copied());
    let scale = if high > low { (top - bottom) / (high - low) } else { 0.0 };
    let moved = |i: usize| {
        (i - 1..=i + 1).map(|k| (reference_n[k] - reference_n[i]).abs()).fold(0.0, f64::max) * scale
    };
    let spikes: Vec<usize> = bends
        .iter()
        .filter(|&&(i, bend, slope)| {
            robust > 0.0 && bend.abs() > SPIKE * robust && bend.abs() > 3.0 * (slope + moved(i))
        })
        .map(|b| b.0)
        .collect();
    if spikes.len() * 50 > measured.len() {
        return Vec::new();
    }
    for &i in &spikes {
        measured[i] = 0.5 * (measured[i - 1] + measured[i + 1]);
    }
    spikes
}
