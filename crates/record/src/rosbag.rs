//! Recordings of ROS 2 as measured pulls: `rosbag2` bags in MCAP, and a mapping file that says what their topics are.

mod bags;
mod cdr;
mod container;
mod error;
mod images;
mod mapping;
mod pull;
mod signals;
#[cfg(test)]
mod tests;

pub use error::RosbagError;
pub use images::BagImages;
pub use mapping::{BagCell, BagClock, BagForce, BagMotion, BagPull, BagTopics, ROSBAG_FILE, RosbagFile};
pub use pull::TipOfJoints;

use crate::campaign::LabelEvidenceKind;
use crate::pulls::{JudgedPulls, feed, hex, judge_labels, read_table};
use crate::table::TableError;
use bags::Bags;
use mapping::{MarkedPull, mapping_path};
use pull::{BagLabel, ReadPull};
use sha2::{Digest, Sha256};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

/// Whether a path is a bag, a folder of bags with a mapping, or a mapping.
pub fn is_rosbag(path: &Path) -> bool {
    mapping_path(path).is_some()
}

/// Reads bags as measured pulls, and judges them. `tip` is the arm of bags that have joints and no pose.
///
/// # Errors
///
/// A mapping or a bag that cannot be read, or that do not fit together.
pub fn read_judged_bags(path: &Path, tip: Option<TipOfJoints<'_>>) -> Result<JudgedPulls, RosbagError> {
    let bags = Bags::open(path)?;
    let signals = bags.signals()?;
    let mut read = Vec::with_capacity(bags.pulls.len());
    for (i, pull) in bags.pulls.iter().enumerate() {
        let at = |problem: String| {
            RosbagError::new(
                &bags.path,
                format!("pulls[{i}] (`{}`, {}): {problem}", pull.id, pull.bag.display()),
            )
        };
        let direction = direction(pull).map_err(|e| at(e).hint("1 is up, -1 is down"))?;
        let of_bag = &signals[&pull.bag];
        let found = pull::read_pull(of_bag, &pull.marks, &bags.file, direction, tip);
        read.push(found.map_err(|e| at(e.problem).hint(e.hint))?);
    }
    let mut hash = Sha256::new();
    feed(&mut hash, ROSBAG_FILE, bags.text.as_bytes());
    for of_bag in signals.values() {
        hash.update(of_bag.hash);
    }
    judged(&bags, read, hex(&hash.finalize()))
}

fn direction(pull: &MarkedPull) -> Result<f64, String> {
    match pull.marks.columns.get("pull_direction").map(|cell| cell.text()).as_deref() {
        None | Some("" | "1") => Ok(1.0),
        Some("-1") => Ok(-1.0),
        Some(other) => Err(format!("`pull_direction` is `{other}`, it must be 1 or -1")),
    }
}

/// The pulls as a table, which the reader of `pulls.csv` reads: one meaning of each column.
fn judged(bags: &Bags, read: Vec<ReadPull>, sha256: String) -> Result<JudgedPulls, RosbagError> {
    let names: BTreeSet<&String> = bags.pulls.iter().flat_map(|p| p.marks.columns.keys()).collect();
    let stated = ["status", "status_reason"];
    let names: Vec<&str> = names.into_iter().map(String::as_str).filter(|n| !stated.contains(n)).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header =
        ["pull_id"].into_iter().chain(names.iter().copied()).chain(stated).chain(["max_pull_force_n"]);
    let mut write =
        |cells: Vec<String>| writer.write_record(&cells).map_err(|e| RosbagError::new(&bags.path, e));
    write(header.map(String::from).collect())?;
    for (pull, read) in bags.pulls.iter().zip(&read) {
        let cell = |name: &str| pull.marks.columns.get(name).map(BagCell::text).unwrap_or_default();
        let (label, status, reason) = match &read.label {
            BagLabel::Slipped(force_n) => (force_n.to_string(), "slipped", String::new()),
            BagLabel::Censored(force_n) => (force_n.to_string(), "censored", String::new()),
            BagLabel::None(reason) => (String::new(), "failed", reason.clone()),
        };
        // What somebody wrote down of the pull is known better than what its readings say of it.
        let (status, reason) = match cell("status") {
            written if written.is_empty() => (status.to_string(), reason),
            written => (written, cell("status_reason")),
        };
        let cells = [pull.id.clone()].into_iter().chain(names.iter().map(|name| cell(name)));
        write(cells.chain([status, reason, label]).collect())?;
    }
    let table = writer.into_inner().map_err(|e| RosbagError::new(&bags.path, e))?;
    let (mut pulls, mut standing) =
        read_table(&bags.path, &table, &bags.file.campaign).map_err(|e| in_mapping(bags, e))?;
    let mut after_n = Vec::with_capacity(read.len());
    for (pull, read) in pulls.pulls.iter_mut().zip(read) {
        pull.trace = Some(read.trace).filter(|_| read.moved);
        after_n.push(read.after_n);
    }
    pulls.sha256 = sha256;
    if bags.file.campaign.label_evidence == LabelEvidenceKind::Trace {
        judge_labels(&pulls, &after_n, &mut standing);
    }
    Ok(JudgedPulls { pulls, standing, warnings: Vec::new() })
}

/// A fault of the table, where it stands in the mapping.
fn in_mapping(bags: &Bags, e: TableError) -> RosbagError {
    let keys = "keys of `[[pulls]]` or `[defaults]` are the columns of pulls.csv (docs/format.md)";
    let problem = match e {
        TableError::Column { column, .. } => format!("no pull has the key `{column}`"),
        TableError::Cell { line, column, value, wanted, .. } => {
            let i = (line as usize).saturating_sub(2);
            let id = bags.pulls.get(i).map_or("", |pull| &pull.id);
            format!("pulls[{i}] (`{id}`): `{column}` is `{value}`, it must be {wanted}")
        }
        other => return RosbagError { path: PathBuf::new(), problem: other.to_string(), hint: keys.into() },
    };
    RosbagError::new(&bags.path, problem).hint(keys)
}
