//! Writing a folder of measured pulls: the inverse of reading one.

use super::{PULLS_FILE, TRACES_FOLDER};
use crate::campaign::{CAMPAIGN_FILE, header_toml};
use crate::table::TableError;
use gripgen_twin::columns::{COLUMNS, Column, InTable, Scale, recorded_covariates};
use gripgen_twin::{MeasuredPulls, PullTrace};
use std::fs::File;
use std::io::Write;
use std::path::Path;

/// Writes measured pulls into a folder, which is made where it is missing and must not hold a table yet.
///
/// Columns that were not recorded are left out. A number is written so that it is read back as it was, in the unit of its
/// column; millimetres and degrees without the last bits that the way to SI and back costs.
///
/// # Errors
///
/// A file that cannot be written.
pub fn write_pull_folder(folder: &Path, measured: &MeasuredPulls) -> Result<(), TableError> {
    let at = |path: &Path| {
        let path = path.to_path_buf();
        move |e: std::io::Error| TableError::Io { path, problem: e.to_string() }
    };
    let table = folder.join(PULLS_FILE);
    std::fs::create_dir_all(folder).map_err(at(folder))?;
    // Made first and only if it is not there, so that nobody's measurements are lost.
    let mut file = File::create_new(&table).map_err(at(&table))?;
    file.write_all(
        &table_csv(measured).map_err(|problem| TableError::Rows { path: table.clone(), problem })?,
    )
    .map_err(at(&table))?;
    let campaign = folder.join(CAMPAIGN_FILE);
    let header = header_toml(measured.label_tolerance_n, measured.stop_m, measured.feedback);
    std::fs::write(&campaign, header).map_err(at(&campaign))?;
    let traces = folder.join(TRACES_FOLDER);
    for pull in &measured.pulls {
        let Some(trace) = &pull.trace else { continue };
        std::fs::create_dir_all(&traces).map_err(at(&traces))?;
        let path = traces.join(format!("{}.csv", pull.id));
        std::fs::write(&path, trace_csv(trace)).map_err(at(&path))?;
    }
    Ok(())
}

fn table_csv(measured: &MeasuredPulls) -> Result<Vec<u8>, String> {
    let used = |column: &&Column| {
        column.in_table == InTable::Setting && measured.pulls.iter().any(|p| column.value(p.view()).is_some())
    };
    let known: Vec<&Column> =
        recorded_covariates(&measured.recorded).chain(COLUMNS.iter().filter(used)).collect();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut write = |cells: Vec<String>| writer.write_record(&cells).map_err(|e| e.to_string());
    let extra = measured.extra.iter().map(|e| e.name.as_str());
    let header =
        ["pull_id"].into_iter().chain(known.iter().map(|c| c.name)).chain(extra).chain(["max_pull_force_n"]);
    write(header.map(String::from).collect())?;
    for (row, pull) in measured.pulls.iter().enumerate() {
        let mut cells = vec![pull.id.clone()];
        cells.extend(known.iter().map(|column| column.cell(pull.view()).into_owned()));
        cells.extend(measured.extra.iter().map(|extra| extra.values.cell(row).into_owned()));
        cells.push(pull.max_pull_force_n.to_string());
        write(cells)?;
    }
    writer.into_inner().map_err(|e| e.to_string())
}

fn trace_csv(trace: &PullTrace) -> String {
    let mut text = String::from("time_s,desired_force_n,measured_force_n,displacement_mm\n");
    for row in trace.rows() {
        let millimetres = Scale::Thousandth.as_written(row.displacement_m);
        text += &format!("{},{},{},{millimetres}\n", row.time_s, row.desired_force_n, row.measured_force_n);
    }
    text
}
