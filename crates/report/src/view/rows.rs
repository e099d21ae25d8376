//! The columns that every view needs, from the table of a run or of measured pulls.

use gripgen_record::Table;
use gripgen_twin::Values;

/// Columns that say where a row is, how it ended, or nothing that anybody varied.
const NOT_VARIED: [&str; 11] = [
    "index",
    "shard",
    "in_shard",
    "status",
    "max_pull_force_n",
    "slip_time_s",
    "group",
    "repetition",
    "failure",
    "status_reason",
    "pull_id",
];

/// The rows of a table, as the page sees them.
pub(super) struct Rows<'a> {
    pub(super) table: &'a Table,
    /// `slipped`, `failed`...
    status: Option<&'a [String]>,
    part: Option<&'a [String]>,
    force_n: Option<&'a [f64]>,
    label_n: Option<&'a [f64]>,
    grip: Option<&'a [f64]>,
    reason: Option<&'a [String]>,
}

impl<'a> Rows<'a> {
    pub(super) fn of(table: &'a Table) -> Self {
        Self {
            table,
            status: table.words("status"),
            part: table.words("part"),
            force_n: table.numbers("grip_force_n"),
            label_n: table.numbers("max_pull_force_n"),
            grip: table.numbers("grip_pose"),
            reason: table.words("status_reason"),
        }
    }

    pub(super) fn len(&self) -> usize {
        self.table.rows()
    }

    pub(super) fn status(&self, row: usize) -> &'a str {
        self.status.map_or("", |all| &all[row])
    }

    pub(super) fn part(&self, row: usize) -> &'a str {
        self.part.map_or("", |all| &all[row])
    }

    /// Grip force of a jaw; not a number where there is none.
    pub(super) fn force_n(&self, row: usize) -> f64 {
        self.force_n.map_or(f64::NAN, |all| all[row])
    }

    /// The label; not a number where there is none.
    pub(super) fn label_n(&self, row: usize) -> f64 {
        self.label_n.map_or(f64::NAN, |all| all[row])
    }

    /// Which grip of the part, as a word; empty where it is not known.
    pub(super) fn grip(&self, row: usize) -> String {
        self.grip.map(|all| all[row]).filter(|x| x.is_finite()).map_or_else(String::new, |x| x.to_string())
    }

    /// Why it failed or is suspect.
    pub(super) fn reason(&self, row: usize) -> &'a str {
        self.reason.map_or("", |all| &all[row])
    }

    /// What a pull is called: its index or its id.
    pub(super) fn id(&self, row: usize) -> String {
        if let Some(ids) = self.table.words("pull_id") {
            return ids[row].clone();
        }
        self.table.numbers("index").map_or_else(|| row.to_string(), |index| index[row].to_string())
    }

    /// The columns in which rows differ and that were set, drawn or recorded.
    pub(super) fn varied(&self) -> Vec<(&'a str, &'a Values)> {
        let varies = |values: &Values| match values {
            Values::Numbers(x) => {
                let mut finite = x.iter().filter(|x| x.is_finite());
                finite.next().is_some_and(|first| finite.any(|x| x != first))
            }
            Values::Words(words) => words.iter().any(|word| *word != words[0]),
        };
        let columns = self.table.columns().iter().filter(|(name, _)| !NOT_VARIED.contains(&name.as_str()));
        columns.filter(|(_, values)| varies(values)).map(|(name, values)| (name.as_str(), values)).collect()
    }
}
