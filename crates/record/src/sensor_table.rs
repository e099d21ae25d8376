//! A folder with `sensor.csv`: a force sensor read beside a reference.

use crate::folder::sha256_hex;
use gripgen_twin::Values;
use std::path::{Path, PathBuf};

/// The table of a force-sensor folder.
pub const SENSOR_FILE: &str = "sensor.csv";

/// Columns that must be there.
const REQUIRED: [&str; 3] = ["time_s", "reference_force_n", "measured_force_n"];
const SESSION: &str = "session";

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
    /// Hash of the file.
    pub sha256: String,
}

/// Why a table could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SensorTableError {
    /// The file.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// A column is missing.
    #[error("{}: there is no column `{column}`; found: {found}", .path.display())]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Columns found.
        found: String,
    },
    /// A column stands there twice.
    #[error("{}: there are two columns `{column}`", .path.display())]
    Twice {
        /// The table.
        path: PathBuf,
        /// The column.
        column: String,
    },
    /// A cell is not what its column holds.
    #[error("{}: line {line}, `{column}` is `{value}`, it must be a finite number", .path.display())]
    Cell {
        /// The table.
        path: PathBuf,
        /// Line of the file, the header is line 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// What stands there.
        value: String,
    },
    /// Time stands still or runs backwards within a session.
    #[error(
        "{}: line {line}, `time_s` is {found} after {before} in session `{session}`, it must rise",
        .path.display()
    )]
    Order {
        /// The table.
        path: PathBuf,
        /// Line of the file.
        line: u64,
        /// Time of the row.
        found: f64,
        /// Time of the row before.
        before: f64,
        /// The session.
        session: String,
    },
    /// Rows that the table's format forbids.
    #[error("{}: {problem}", .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
}

/// Reads the table of a folder. Rows of a session stand in the order of their time; sessions may take turns. A table
/// without `session` is one session. Further columns are kept: numbers where every cell is one or empty, words
/// otherwise.
pub fn read_sensor_table(folder: &Path) -> Result<SensorTable, SensorTableError> {
    let path = folder.join(SENSOR_FILE);
    let bytes = std::fs::read(&path)
        .map_err(|e| SensorTableError::Io { path: path.clone(), problem: e.to_string() })?;
    parse(&path, &bytes)
}

fn parse(path: &Path, bytes: &[u8]) -> Result<SensorTable, SensorTableError> {
    let bad = |e: csv::Error| SensorTableError::Table { path: path.to_path_buf(), problem: e.to_string() };
    let text = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(text);
    let headers = reader.headers().map_err(bad)?.clone();
    let names: Vec<&str> = headers.iter().collect();
    for (i, name) in names.iter().enumerate() {
        if !name.is_empty() && names[..i].contains(name) {
            return Err(SensorTableError::Twice { path: path.into(), column: (*name).into() });
        }
    }
    let mut places = [0; 3];
    for (place, column) in places.iter_mut().zip(REQUIRED) {
        *place = names.iter().position(|n| *n == column).ok_or_else(|| SensorTableError::Column {
            path: path.into(),
            column,
            found: names.join(", "),
        })?;
    }
    let session_at = names.iter().position(|n| *n == SESSION);
    let extra_at: Vec<usize> = (0..names.len())
        .filter(|i| !places.contains(i) && Some(*i) != session_at && !names[*i].is_empty())
        .collect();
    let mut table = SensorTable {
        time_s: Vec::new(),
        reference_force_n: Vec::new(),
        measured_force_n: Vec::new(),
        session: Vec::new(),
        sessions: Vec::new(),
        extra: Vec::new(),
        sha256: sha256_hex(bytes),
    };
    let mut extra: Vec<Extra> = extra_at.iter().map(|_| Extra::default()).collect();
    let mut last_s: Vec<f64> = Vec::new();
    let mut row = csv::StringRecord::new();
    while reader.read_record(&mut row).map_err(bad)? {
        let line = row.position().map_or(0, csv::Position::line);
        let mut numbers = [0.0; 3];
        for ((number, &place), column) in numbers.iter_mut().zip(&places).zip(REQUIRED) {
            let cell = row.get(place).unwrap_or_default();
            *number = cell.parse().ok().filter(|x: &f64| x.is_finite()).ok_or_else(|| {
                SensorTableError::Cell { path: path.into(), line, column, value: cell.into() }
            })?;
        }
        let name = session_at.and_then(|i| row.get(i)).unwrap_or(ONLY_SESSION);
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
            return Err(SensorTableError::Order {
                path: path.into(),
                line,
                found: time_s,
                before: last_s[session],
                session: name.into(),
            });
        }
        last_s[session] = time_s;
        table.time_s.push(time_s);
        table.reference_force_n.push(reference);
        table.measured_force_n.push(measured);
        table.session.push(session);
        for (column, &i) in extra.iter_mut().zip(&extra_at) {
            column.push(row.get(i).unwrap_or_default());
        }
    }
    table.extra =
        extra_at.iter().zip(extra).map(|(&i, column)| (names[i].to_string(), column.values())).collect();
    Ok(table)
}

/// A column whose kind is not known yet. Cells are kept as text only from the first word on.
#[derive(Default)]
struct Extra {
    numbers: Vec<f64>,
    words: Option<Vec<String>>,
}

impl Extra {
    fn push(&mut self, cell: &str) {
        if let Some(words) = &mut self.words {
            words.push(cell.into());
            return;
        }
        match cell.parse::<f64>() {
            Ok(x) => self.numbers.push(x),
            Err(_) if cell.is_empty() => self.numbers.push(f64::NAN),
            Err(_) => {
                let text = |x: &f64| if x.is_finite() { format!("{x}") } else { String::new() };
                let mut words: Vec<String> = self.numbers.iter().map(text).collect();
                words.push(cell.into());
                self.words = Some(words);
            }
        }
    }

    fn values(self) -> Values {
        match self.words {
            Some(words) => Values::Words(words),
            None => Values::Numbers(self.numbers),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(table: &str) -> Result<SensorTable, SensorTableError> {
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
    fn faults_name_file_line_column_and_value() {
        for (table, parts) in [
            (
                "time_s,measured_force_n\n0,1\n",
                "no column `reference_force_n`; found: time_s, measured_force_n",
            ),
            (
                "time_s,reference_force_n,measured_force_n\n0,1,2\n1,,2\n",
                "line 3, `reference_force_n` is ``, it must be a finite number",
            ),
            ("time_s,reference_force_n,measured_force_n\n0,1,NaN\n", "line 2, `measured_force_n` is `NaN`"),
            ("time_s,reference_force_n,measured_force_n\n0,1,inf\n", "`measured_force_n` is `inf`"),
            (
                "time_s,reference_force_n,measured_force_n,session\n0,1,2,x\n1,1,2,y\n0,1,2,x\n",
                "line 4, `time_s` is 0 after 0 in session `x`",
            ),
            ("time_s,reference_force_n,measured_force_n\n0,1\n", "line: 2"),
            ("time_s,time_s,reference_force_n,measured_force_n\n", "two columns `time_s`"),
        ] {
            let error = read(table).unwrap_err().to_string();
            assert!(error.contains(parts) && error.contains("sensor.csv"), "{table:?}: {error}");
        }
        assert!(matches!(
            read_sensor_table(Path::new("/nowhere/at/all")).unwrap_err(),
            SensorTableError::Io { .. }
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
