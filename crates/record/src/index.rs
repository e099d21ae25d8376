//! The index of a run: one row a sample, so that tables can be filtered without opening a shard.

use crate::proto::gripgen_v1::{Sample, Status};

/// The fixed columns. Those of a measured pull table have the same names and units.
pub const INDEX_COLUMNS: &[&str] = &[
    "index",
    "shard",
    "in_shard",
    "status",
    "part",
    "grip_pose",
    "gel_id",
    "session",
    "grip_force_n",
    "force_increment_n",
    "step_time_s",
    "dwell_s",
    "pull_index",
    "time_s",
    "temperature_c",
    "grip_offset_mm",
    "grip_angle_deg",
    "pull_direction",
    "max_pull_force_n",
    "slip_time_s",
    "mu",
    "group",
    "repetition",
    "failure",
];

/// The name of a status in the index and on screens.
pub fn status_name(status: Status) -> &'static str {
    match status {
        Status::Unspecified => "unspecified",
        Status::Slipped => "slipped",
        Status::Censored => "censored",
        Status::NoContact => "no_contact",
        Status::Failed => "failed",
        Status::Suspect => "suspect",
    }
}

/// The cells of a sample's row; `shard` and `in_shard` are left empty for the writer of the shard.
pub fn index_row(sample: &Sample, extra_columns: &[String]) -> Vec<String> {
    let optional = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
    let mut row: Vec<String> = INDEX_COLUMNS
        .iter()
        .map(|&column| match column {
            "index" => sample.index.to_string(),
            "status" => status_name(sample.status()).into(),
            "part" => sample.part.clone(),
            "grip_pose" => sample.grip_pose.to_string(),
            "gel_id" => sample.gel_id.clone(),
            "session" => sample.session.clone(),
            "grip_force_n" => sample.grip_force_n.to_string(),
            "force_increment_n" => sample.force_increment_n.to_string(),
            "step_time_s" => sample.step_time_s.to_string(),
            "dwell_s" => sample.dwell_s.to_string(),
            "pull_index" => sample.pull_index.to_string(),
            "time_s" => sample.time_s.to_string(),
            "temperature_c" => sample.temperature_c.to_string(),
            "grip_offset_mm" => sample.grip_offset_mm.to_string(),
            "grip_angle_deg" => sample.grip_angle_deg.to_string(),
            "pull_direction" => sample.pull_direction.to_string(),
            "max_pull_force_n" => optional(sample.max_pull_force_n),
            "slip_time_s" => optional(sample.slip_time_s),
            "mu" => optional(sample.mu),
            "group" => sample.group.to_string(),
            "repetition" => sample.repetition.to_string(),
            // One column for both: why there is no label, or none to be relied on.
            "failure" if sample.status() == Status::Suspect => sample.status_reason.clone(),
            "failure" => sample.failure.clone(),
            _ => String::new(),
        })
        .collect();
    for key in extra_columns {
        let number = sample.drawn_number.get(key).map(f64::to_string);
        row.push(number.or_else(|| sample.drawn_text.get(key).cloned()).unwrap_or_default());
    }
    row
}

/// Which drawn keys get a column of their own: those that no fixed column shows.
pub fn extra_columns<'a>(varied: impl IntoIterator<Item = &'a str>) -> Vec<String> {
    let shown = ["pull.increment_n", "pull.step_s"];
    varied
        .into_iter()
        .filter(|key| !INDEX_COLUMNS.contains(key) && !shown.contains(key))
        .map(String::from)
        .collect()
}

/// The header of `index.csv`.
pub fn index_header(extra_columns: &[String]) -> Vec<String> {
    INDEX_COLUMNS.iter().map(|c| c.to_string()).chain(extra_columns.iter().cloned()).collect()
}

/// Rows as lines of CSV.
pub fn csv_lines<'a>(rows: impl IntoIterator<Item = &'a Vec<String>>) -> Vec<u8> {
    let mut writer = csv::WriterBuilder::new().flexible(true).from_writer(Vec::new());
    for row in rows {
        writer.write_record(row).expect("writing to memory cannot fail");
    }
    writer.into_inner().expect("writing to memory cannot fail")
}
