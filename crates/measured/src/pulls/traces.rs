//! The traces of a table: each is read, and what was odd in them is said once for all of them.

use super::trace::{ReadTrace, read_trace};
use super::zero::Plan;
use super::{TRACES_FOLDER, plan, strays};
use crate::table::{TableError, read_bytes};
use gripgen_twin::{MeasuredPulls, rounded};
use std::collections::HashSet;
use std::io::ErrorKind;
use std::path::Path;

/// Reads the traces of pulls; `feed` is given the name and the content of each file. Returns the readings without a load after each
/// pull, and remarks.
pub(super) fn read_traces(
    folder: &Path,
    measured: &mut MeasuredPulls,
    feed: &mut dyn FnMut(&str, &[u8]),
) -> Result<(Vec<Vec<f64>>, Vec<String>), TableError> {
    let traces = folder.join(TRACES_FOLDER);
    let stored = trace_files(&traces)?;
    let of_no_pull = strays::traces_of_nobody(folder, &stored, &measured.pulls);
    let of_other_kinds = strays::traces_of_other_kinds(folder, &stored, &measured.pulls);
    let mut said: Vec<String> = of_no_pull.into_iter().chain(of_other_kinds).collect();
    let mut after_n = vec![Vec::new(); measured.pulls.len()];
    let mut read: Vec<(String, ReadTrace)> = Vec::new();
    for (pull, after_n) in measured.pulls.iter_mut().zip(&mut after_n) {
        let name = format!("{}.csv", pull.id);
        if !stored.contains(name.as_str()) {
            continue;
        }
        let path = traces.join(&name);
        let bytes = read_bytes(&path)?;
        feed(&name, &bytes);
        let mut found = read_trace(&path, &bytes, Plan::of(pull))?;
        pull.trace = found.trace.take();
        *after_n = std::mem::take(&mut found.after_n);
        read.push((name, found));
    }
    let place = traces.display();
    said.extend(remarks(&read).into_iter().map(|said| format!("{place}: {said}")));
    said.extend(plan::hold_against_traces(measured).map(|said| format!("{}: {said}", folder.display())));
    Ok((after_n, said))
}

/// What was odd in traces, a sentence for each kind.
fn remarks(read: &[(String, ReadTrace)]) -> Vec<String> {
    let mut said = Vec::new();
    let all = read.len();
    let moved: Vec<&(String, ReadTrace)> = read.iter().filter(|(_, t)| t.moved_s != 0.0).collect();
    if let Some((name, first)) = moved.first() {
        said.push(format!(
            "time 0 of {} of {all} traces is not where their command begins ({name}: it begins at {} s), and was moved there",
            moved.len(),
            rounded(first.moved_s, &[])
        ));
    }
    let refused: Vec<String> =
        read.iter().filter_map(|(name, t)| Some(format!("{name}: {}", t.refused.as_ref()?))).collect();
    if let Some(first) = refused.first() {
        said.push(format!(
            "{} of {all} traces are not used, time 0 is not known in them ({first})",
            refused.len()
        ));
    }
    let mut counted = |what: &str, of: fn(&ReadTrace) -> usize| {
        let own: Vec<(&String, usize)> =
            read.iter().map(|(name, t)| (name, of(t))).filter(|(_, n)| *n > 0).collect();
        let rows: usize = own.iter().map(|(_, n)| n).sum();
        if let Some((name, _)) = own.first() {
            said.push(format!(
                "{rows} rows of {} of {all} traces {what} and are left out ({name})",
                own.len()
            ));
        }
    };
    counted("lack one of the four values", |t| t.without);
    counted("have the time of the row before", |t| t.again);
    let gaps: Vec<(&String, (f64, f64))> =
        read.iter().filter_map(|(name, t)| Some((name, t.gap_s?))).collect();
    if let Some((name, (from_s, length_s))) = gaps.first() {
        said.push(format!(
            "{} of {all} traces have a gap ({name}: no reading for {length_s:.3} s from {from_s:.3} s on)",
            gaps.len()
        ));
    }
    said
}

/// Names of the files in the folder of the traces; none where there is no such folder.
fn trace_files(folder: &Path) -> Result<HashSet<String>, TableError> {
    let at = |e: std::io::Error| TableError::Io { path: folder.into(), problem: e.to_string() };
    match std::fs::read_dir(folder) {
        Ok(entries) => entries
            .map(|entry| entry.map(|e| e.file_name().to_string_lossy().into_owned()).map_err(at))
            .collect(),
        Err(e) if e.kind() == ErrorKind::NotFound => Ok(HashSet::new()),
        Err(e) => Err(at(e)),
    }
}
