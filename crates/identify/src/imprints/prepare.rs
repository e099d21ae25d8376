//! Rows in the groups that share a constant, and what is held out of them.

use super::ImprintData;
use gripgen_twin::effects::GraspSpan;
use gripgen_twin::values::median;
use std::collections::BTreeMap;

/// Stretches of a group that are held out one after the other.
pub(super) const FOLDS: usize = 5;
/// Groups from which on whole ones are held out of a fit of effects.
const MIN_GROUPS: usize = 4;
/// What is held out of a fit of effects at most; more groups are put together.
const MAX_UNITS: usize = 10;
/// Share of the largest force of a group from which on a row is in contact.
const CONTACT: f64 = 0.05;
/// Rows beside one for each constant that a diagnosis needs.
const MIN_ROWS: usize = 12;
/// Smallest ratio of forces in contact within a group that says something of a law.
const MIN_RATIO: f64 = 1.5;

/// Rows that share one imprint constant: a grasp, or the grasps of one row of a part.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Group {
    pub(super) name: String,
    pub(super) part: String,
    /// Places in the table, in its order.
    pub(super) rows: Vec<usize>,
    /// Largest measured volume.
    pub(super) peak_mm3: f64,
    /// It is one grasp.
    pub(super) is_grasp: bool,
}

/// A table that can be worked with.
#[derive(Debug, Clone)]
pub(super) struct Prepared {
    /// Forces, 0 where a reading is below.
    pub(super) force_n: Vec<f64>,
    pub(super) volume_mm3: Vec<f64>,
    pub(super) groups: Vec<Group>,
    /// Group of each row; rows of none are left out.
    pub(super) group: Vec<Option<usize>>,
    /// Stretch of its group.
    pub(super) fold: Vec<usize>,
    /// What is held out of a fit of effects together.
    pub(super) unit: Vec<usize>,
    pub(super) units: usize,
    /// Whether units are whole grasps.
    pub(super) whole_grasps: bool,
    /// Rows of grasps whose times are known, with seconds since their first row.
    pub(super) series: Vec<(Vec<usize>, Vec<f64>)>,
    pub(super) span: GraspSpan,
    pub(super) notes: Vec<String>,
}

impl Prepared {
    /// Rows that are worked with.
    pub(super) fn rows(&self) -> impl Iterator<Item = usize> {
        (0..self.group.len()).filter(|&i| self.group[i].is_some())
    }

    /// Largest volume of the group of a row, by which residuals are measured.
    pub(super) fn peak(&self, row: usize) -> f64 {
        self.group[row].map_or(1.0, |g| self.groups[g].peak_mm3)
    }
}

/// Puts the rows into groups.
pub(super) fn prepare(data: &ImprintData) -> Prepared {
    let n = data.ids.len();
    let mut of_grasp: Vec<Vec<usize>> = vec![Vec::new(); data.grasps.len()];
    (0..n).for_each(|i| of_grasp[data.grasp[i]].push(i));
    let mut notes = Vec::new();
    let mut candidates: Vec<Group> = Vec::new();
    let mut singles: BTreeMap<&str, Vec<usize>> = BTreeMap::new();
    for (name, rows) in data.grasps.iter().zip(&of_grasp) {
        match rows.as_slice() {
            [] => {}
            [one] => singles.entry(&data.part[*one]).or_default().push(*one),
            _ => candidates.push(group(data, name.clone(), rows.clone(), true)),
        }
    }
    for (part, rows) in singles {
        let of = if part.is_empty() { "all parts".into() } else { part.to_string() };
        if rows.len() > 1 {
            notes.push(format!(
                "{} grasps of one row of {of} share one constant: one of its own would take each whole",
                rows.len()
            ));
        }
        candidates.push(group(data, format!("single grasps of {of}"), rows, false));
    }
    candidates.sort_by_key(|g| g.rows[0]);
    let (groups, left_out): (Vec<Group>, Vec<Group>) = candidates.into_iter().partition(|g| {
        let pressed = g.rows.iter().filter(|&&i| data.grip_force_n[i] > 0.0).count();
        pressed >= 2 && g.peak_mm3 > 0.0
    });
    if !left_out.is_empty() {
        let names: Vec<&str> = left_out.iter().take(5).map(|g| g.name.as_str()).collect();
        notes.push(format!(
            "{} grasps without two forces above 0 or without a volume were left out: {}",
            left_out.len(),
            names.join(", ")
        ));
    }
    let mut prepared = Prepared {
        force_n: data.grip_force_n.iter().map(|f| f.max(0.0)).collect(),
        volume_mm3: data.volume_mm3.clone(),
        group: vec![None; n],
        fold: vec![0; n],
        unit: vec![0; n],
        units: FOLDS,
        whole_grasps: groups.len() >= MIN_GROUPS,
        series: series(data, &groups),
        span: GraspSpan { middle_n: 1.0, step_s: f64::INFINITY, longest_s: 0.0 },
        groups,
        notes,
    };
    put_aside(&mut prepared);
    prepared.span = span(&prepared);
    prepared
}

fn group(data: &ImprintData, name: String, rows: Vec<usize>, is_grasp: bool) -> Group {
    let peak_mm3 = rows.iter().map(|&i| data.volume_mm3[i]).fold(0.0, f64::max);
    Group { name, part: data.part[rows[0]].clone(), rows, peak_mm3, is_grasp }
}

/// Stretches and units. A grasp is cut where as many rows in contact lie on each side; grasps of one row take turns.
fn put_aside(prepared: &mut Prepared) {
    let units = prepared.groups.len().min(MAX_UNITS);
    for (g, group) in prepared.groups.iter().enumerate() {
        let most = group.rows.iter().map(|&i| prepared.force_n[i]).fold(0.0, f64::max);
        let in_contact = |i: usize| prepared.force_n[i] > CONTACT * most;
        let all = group.rows.iter().filter(|&&i| in_contact(i)).count().max(1);
        let folds = FOLDS.min(all);
        let mut seen = 0;
        for &i in &group.rows {
            prepared.group[i] = Some(g);
            let at = seen.min(all - 1);
            prepared.fold[i] = if group.is_grasp { at * folds / all } else { at % folds };
            prepared.unit[i] = if prepared.whole_grasps { g % units } else { prepared.fold[i] };
            seen += usize::from(in_contact(i));
        }
    }
    if prepared.whole_grasps {
        prepared.units = units;
    }
}

fn series(data: &ImprintData, groups: &[Group]) -> Vec<(Vec<usize>, Vec<f64>)> {
    let timed = |g: &&Group| g.is_grasp && g.rows.iter().all(|&i| data.time_s[i].is_finite());
    let since = |g: &Group| g.rows.iter().map(|&i| data.time_s[i] - data.time_s[g.rows[0]]).collect();
    groups.iter().filter(timed).map(|g| (g.rows.clone(), since(g))).collect()
}

fn span(prepared: &Prepared) -> GraspSpan {
    let mut forces: Vec<f64> = Vec::new();
    for group in &prepared.groups {
        let most = group.rows.iter().map(|&i| prepared.force_n[i]).fold(0.0, f64::max);
        forces.extend(group.rows.iter().map(|&i| prepared.force_n[i]).filter(|f| *f > CONTACT * most));
    }
    let steps = prepared.series.iter().flat_map(|(_, t)| t.windows(2).map(|w| w[1] - w[0])).collect();
    let longest_s = prepared.series.iter().filter_map(|(_, t)| t.last()).fold(0.0, |m: f64, t| m.max(*t));
    GraspSpan {
        middle_n: median(forces).unwrap_or(1.0),
        step_s: median(steps).unwrap_or(f64::INFINITY),
        longest_s,
    }
}

/// What the table lacks for a diagnosis.
pub(super) fn lack(prepared: &Prepared) -> Option<String> {
    let rows = prepared.rows().count();
    let groups = prepared.groups.len();
    if rows < groups + MIN_ROWS {
        return Some(format!(
            "{rows} rows in {groups} grasps of two rows or more: {} are needed, {MIN_ROWS} beside one for the constant of each",
            groups + MIN_ROWS
        ));
    }
    let ratio = prepared.groups.iter().map(|group| {
        let pressed = group.rows.iter().map(|&i| prepared.force_n[i]).filter(|f| *f > 0.0);
        let (low, high) = pressed.fold((f64::INFINITY, 0.0_f64), |(l, h), f| (l.min(f), h.max(f)));
        high / low
    });
    let widest = ratio.fold(0.0, f64::max);
    (widest < MIN_RATIO).then(|| {
        format!(
            "the forces of no grasp are further apart than a factor of {widest:.2}, {MIN_RATIO} is needed"
        )
    })
}
