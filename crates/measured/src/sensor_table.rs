//! A folder with `sensor.csv`: a force sensor read beside a reference.

use crate::pulls::{MissingCells, SAY_NOTHING};
use crate::table::{TableError, TableReader, TextCells, read_bytes};
use gripgen_record::sha256_hex;
use gripgen_twin::Values;
use std::path::Path;

/// The table of a force-sensor folder.
pub const SENSOR_FILE: &str = "sensor.csv";

/// Columns that must be there.
const REQUIRED: [&str; 3] = ["time_s", "reference_force_n", "measured_force_n"];
const SESSION: &str = "session";

/// What becomes of a row that lacks a number.
const ROWS_LEFT_OUT: &str = "these rows are left out";

/// The session of a table that names none.
const ONLY_SESSION: &str = "1";

/// A table, column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct SensorTable {
    /// Time, rising within each session.
    pub time_s: Vec<f64>,
    /// What acted.
    pub reference_force_n: Vec<f64>,
    /// What the sensor said, in its own unit.
    pub measured_force_n: Vec<f64>,
    /// Session of each row: an index into `sessions`.
    pub session: Vec<usize>,
    /// Names of the sessions in order of appearance.
    pub sessions: Vec<String>,
    /// Further columns with their names.
    pub extra: Vec<(String, Values)>,
    /// Cells that are missing. A row without one of the three numbers is left out.
    pub missing: MissingCells,
    /// Hash of the file.
    pub sha256: String,
}

/// Reads the table of a folder. Rows of a session stand in the order of their time; sessions may take turns. A table
/// without `session` is one session. Rows that lack one of the three numbers are left out and counted. Further columns are kept:
/// numbers where every cell is one or empty, words otherwise; a column of nothing but empty cells is not recorded.
///
/// # Errors
/// [`TableError`], with line, column and value.
pub fn read_sensor_table(folder: &Path) -> Result<SensorTable, TableError> {
    let path = folder.join(SENSOR_FILE);
    parse(&path, &read_bytes(&path)?)
}

fn parse(path: &Path, bytes: &[u8]) -> Result<SensorTable, TableError> {
    let mut reader = TableReader::new(path, bytes)?;
    reader.spell(&[&REQUIRED[..], &[SESSION]].concat());
    reader.check_single()?;
    let mut places = [0; 3];
    for (place, column) in places.iter_mut().zip(REQUIRED) {
        *place = reader.required(column)?;
    }
    let session_at = reader.place(SESSION);
    let mut extra: Vec<(usize, String, TextCells)> = Vec::new();
    for (i, name) in reader.names().iter().enumerate() {
        if !places.contains(&i) && Some(i) != session_at && !name.is_empty() {
            extra.push((i, name.clone(), TextCells::default()));
        }
    }
    let mut table = SensorTable {
        time_s: Vec::new(),
        reference_force_n: Vec::new(),
        measured_force_n: Vec::new(),
        session: Vec::new(),
        sessions: Vec::new(),
        extra: Vec::new(),
        missing: MissingCells::default(),
        sha256: sha256_hex(bytes),
    };
    let mut last_s: Vec<f64> = Vec::new();
    while let Some(row) = reader.row()? {
        let empty = places.iter().zip(REQUIRED).filter(|(place, _)| row.cell(**place).is_empty());
        let mut lacking = empty.map(|(_, column)| column).peekable();
        if lacking.peek().is_some() {
            lacking.for_each(|column| table.missing.add(column, 1, ROWS_LEFT_OUT));
            continue;
        }
        let mut numbers = [0.0; 3];
        for (number, &place) in numbers.iter_mut().zip(&places) {
            *number = row.number(place, "a finite number")?;
        }
        let name = session_at.map_or(ONLY_SESSION, |place| row.cell(place));
        let known = match table.session.last() {
            Some(&s) if table.sessions[s] == name => Some(s),
            _ => table.sessions.iter().position(|s| s == name),
        };
        let session = known.unwrap_or_else(|| {
            table.sessions.push(name.into());
            last_s.push(f64::NEG_INFINITY);
            table.sessions.len() - 1
        });
        let [time_s, reference, measured] = numbers;
        if time_s <= last_s[session] {
            let (line, before) = (row.line, last_s[session]);
            let problem =
                format!("line {line}, `time_s` is {time_s} after {before} in session `{name}`, it must rise");
            return Err(TableError::Rows { path: path.into(), problem });
        }
        last_s[session] = time_s;
        table.time_s.push(time_s);
        table.reference_force_n.push(reference);
        table.measured_force_n.push(measured);
        table.session.push(session);
        for (place, _, cells) in &mut extra {
            cells.push(&row.plain(*place)?);
        }
    }
    table.extra = extra.into_iter().filter_map(|(_, name, cells)| Some((name, cells.values()?))).collect();
    for (name, values) in &table.extra {
        let empty = (0..table.time_s.len()).filter(|&row| values.at(row).is_none()).count();
        table.missing.add(name, empty, SAY_NOTHING);
    }
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(table: &str) -> Result<SensorTable, TableError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(SENSOR_FILE), table).unwrap();
        read_sensor_table(folder.path())
    }

    #[test]
    fn sessions_and_columns_of_unknown_meaning_are_kept() {
        let table = read(
            "time_s, operator, measured_force_n, reference_force_n, session, humidity_pct\n\
             0, ann, -0.1, 1, b, 40\n 0.1, ann, -0.2, 2, b,\n 0, 7, -0.3, 3, a, 41\n 0.2,,-4,4,b,42\n",
        )
        .unwrap();
        assert_eq!(table.sessions, ["b", "a"]);
        assert_eq!(table.session, [0, 0, 1, 0]);
        assert_eq!(table.measured_force_n, [-0.1, -0.2, -0.3, -4.0]);
        assert_eq!(table.reference_force_n, [1.0, 2.0, 3.0, 4.0]);
        let words = ["ann", "ann", "7", ""].map(String::from).to_vec();
        assert_eq!(table.extra[0], ("operator".into(), Values::Words(words)));
        let Values::Numbers(humidity) = &table.extra[1].1 else { panic!("{:?}", table.extra[1]) };
        assert!(humidity[1].is_nan() && humidity[3] == 42.0);
        assert_eq!(table.sha256.len(), 64);
        let one = read("\u{feff}time_s,reference_force_n,measured_force_n\n0,1,2\n").unwrap();
        assert_eq!((one.sessions.as_slice(), one.time_s.len()), (["1".to_string()].as_slice(), 1));
    }

    #[test]
    fn rows_that_lack_a_number_are_left_out_and_counted() {
        let table = read(
            "time_s,reference_force_n,measured_force_n,humidity_pct\n\
             0,1,2,40\n1,,2,41\n2,3,NaN,42\n3,n/a,-,43\n4,5,6,\n5,7,8,44\n",
        )
        .unwrap();
        assert_eq!(table.time_s, [0.0, 4.0, 5.0]);
        let counts: Vec<(String, usize)> = table.missing.counts().into_iter().collect();
        let wanted = [("humidity_pct", 1), ("measured_force_n", 2), ("reference_force_n", 2)];
        assert_eq!(counts, wanted.map(|(name, n)| (name.to_string(), n)));
        assert!(
            table.missing.notes().any(|note| note.ends_with("2 cells are missing, these rows are left out"))
        );
    }

    #[test]
    fn faults_name_file_line_column_and_value() {
        for (table, parts) in [
            (
                "time_s,measured_force_n\n0,1\n",
                "no column `reference_force_n`; found: time_s, measured_force_n",
            ),
            ("time_s,reference_force_n,measured_force_n\n0,1,inf\n", "`measured_force_n` is `inf`"),
            (
                "time_s,reference_force_n,measured_force_n,session\n0,1,2,x\n1,1,2,y\n0,1,2,x\n",
                "line 4, `time_s` is 0 after 0 in session `x`",
            ),
            ("time_s,reference_force_n,measured_force_n\n0,1\n", "cells of line 2: "),
            ("time_s,time_s,reference_force_n,measured_force_n\n", "two columns `time_s`"),
        ] {
            let error = read(table).unwrap_err().to_string();
            assert!(error.contains(parts) && error.contains("sensor.csv"), "{table:?}: {error}");
        }
        assert!(matches!(
            read_sensor_table(Path::new("/nowhere/at/all")).unwrap_err(),
            TableError::Io { .. }
        ));
        let empty = read("time_s,reference_force_n,measured_force_n\n").unwrap();
        assert!(empty.time_s.is_empty() && empty.sessions.is_empty());
    }

    #[test]
    fn a_million_rows_are_read() {
        let mut text = String::from("time_s,reference_force_n,measured_force_n\n");
        for i in 0..1_000_000 {
            text += &format!("{},{},{}\n", f64::from(i) * 0.002, i % 977, i % 977 + 1);
        }
        let table = read(&text).unwrap();
        assert_eq!(table.time_s.len(), 1_000_000);
        assert_eq!(table.reference_force_n[999_999], f64::from(999_999 % 977));
    }
}
