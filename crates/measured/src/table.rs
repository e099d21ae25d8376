//! Tables that people hand in: CSV with a header, read row by row, with one kind of error.

mod faults;
mod lines;

use faults::{encoding, of_cell, one_cell};
use gripgen_twin::Values;
use lines::Lines;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Why a table could not be read.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TableError {
    /// A file or folder cannot be read.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// An image that lost colours when it was stored.
    #[error("{}: the image is a JPEG, presses are read from PNG", .path.display())]
    Jpeg {
        /// The image.
        path: PathBuf,
    },
    /// The table lacks a column.
    #[error("{}: there is no column `{column}`; found: {found}{}", .path.display(), one_cell(.found))]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Columns found.
        found: String,
    },
    /// Two columns have the same name.
    #[error("{}: there are two columns `{column}`", .path.display())]
    TwoColumns {
        /// The table.
        path: PathBuf,
        /// Their name.
        column: String,
    },
    /// A cell is not what its column holds.
    #[error(
        "{}: line {line}, `{column}` is `{value}`, it must be {wanted}{}",
        .path.display(),
        of_cell(.value)
    )]
    Cell {
        /// The table.
        path: PathBuf,
        /// Line of the file, the header is line 1.
        line: u64,
        /// The column.
        column: String,
        /// What stands there.
        value: String,
        /// What should.
        wanted: Cow<'static, str>,
    },
    /// Rows that do not fit together.
    #[error("{}: {problem}", .path.display())]
    Rows {
        /// The table.
        path: PathBuf,
        /// Which, and why.
        problem: String,
    },
    /// A table without rows.
    #[error("{}: the table holds no rows", .path.display())]
    Empty {
        /// The table.
        path: PathBuf,
    },
    /// What CSV forbids.
    #[error("{}: {problem}{}", .path.display(), .hint)]
    Format {
        /// The table.
        path: PathBuf,
        /// What the parser says.
        problem: String,
        /// What may be the matter, in brackets; empty where nobody knows.
        hint: &'static str,
    },
}

/// The content of a file.
///
/// # Errors
/// [`TableError::Io`].
pub(crate) fn read_bytes(path: &Path) -> Result<Vec<u8>, TableError> {
    std::fs::read(path).map_err(|e| TableError::Io { path: path.into(), problem: e.to_string() })
}

/// A table that is read row by row.
pub(crate) struct TableReader<'a> {
    path: &'a Path,
    names: Vec<String>,
    reader: csv::Reader<&'a [u8]>,
    record: csv::StringRecord,
    lines: Lines<'a>,
}

/// A row of a table.
pub(crate) struct Row<'r> {
    path: &'r Path,
    names: &'r [String],
    record: &'r csv::StringRecord,
    /// Line of the file, the header is line 1.
    pub(crate) line: u64,
}

impl<'a> TableReader<'a> {
    /// Reads the header; `path` is for errors.
    ///
    /// # Errors
    /// [`TableError::Format`].
    pub(crate) fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, TableError> {
        if let Some((problem, hint)) = encoding(bytes) {
            return Err(TableError::Format { path: path.into(), problem, hint });
        }
        let mut lines = Lines::new(bytes);
        let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(bytes);
        let header = reader.headers().map_err(|e| format_error(path, &mut lines, &e))?;
        // The parser takes a byte order mark off the file; a header pasted behind another has one inside.
        let names = header.iter().map(|name| name.trim_start_matches('\u{feff}').trim().into()).collect();
        Ok(Self { path, names, reader, record: csv::StringRecord::new(), lines })
    }

    /// Names of the columns, empty where a column has none.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// The place of a column; the first of them where there are two.
    pub(crate) fn place(&self, column: &str) -> Option<usize> {
        self.names.iter().position(|name| name == column)
    }

    /// The place of a column that has to be there.
    ///
    /// # Errors
    /// [`TableError::Column`] with the columns found.
    pub(crate) fn required(&self, column: &'static str) -> Result<usize, TableError> {
        self.place(column).ok_or_else(|| TableError::Column {
            path: self.path.into(),
            column,
            found: self.names.join(", "),
        })
    }

    /// Checks that no two columns have the same name.
    ///
    /// # Errors
    /// [`TableError::TwoColumns`].
    pub(crate) fn check_single(&self) -> Result<(), TableError> {
        let twice = |(i, name): &(usize, &String)| !name.is_empty() && self.names[..*i].contains(name);
        match self.names.iter().enumerate().find(twice) {
            Some((_, name)) => Err(TableError::TwoColumns { path: self.path.into(), column: name.clone() }),
            None => Ok(()),
        }
    }

    /// The next row; `None` after the last.
    ///
    /// # Errors
    /// [`TableError::Format`].
    pub(crate) fn row(&mut self) -> Result<Option<Row<'_>>, TableError> {
        let more = self.reader.read_record(&mut self.record);
        let more = more.map_err(|e| format_error(self.path, &mut self.lines, &e))?;
        let line = self.lines.of(self.record.position());
        Ok(more.then_some(Row { path: self.path, names: &self.names, record: &self.record, line }))
    }
}

fn format_error(path: &Path, lines: &mut Lines<'_>, e: &csv::Error) -> TableError {
    let (problem, hint) = match e.kind() {
        csv::ErrorKind::UnequalLengths { pos, expected_len, len } => {
            let hint =
                if len > expected_len { " (a number with a decimal comma counts as two cells)" } else { "" };
            let line = lines.of(pos.as_ref());
            (format!("cells of line {line}: {len}, of the header: {expected_len}"), hint)
        }
        _ => (e.to_string(), ""),
    };
    TableError::Format { path: path.into(), problem, hint }
}

impl Row<'_> {
    /// The cell of a column; empty where there is none.
    pub(crate) fn cell(&self, place: usize) -> &str {
        self.record.get(place).unwrap_or_default()
    }

    /// A number.
    ///
    /// # Errors
    /// [`TableError::Cell`] if it is none, or not finite: it must be what is `wanted`.
    pub(crate) fn number(&self, place: usize, wanted: &'static str) -> Result<f64, TableError> {
        number(self.cell(place)).ok_or_else(|| self.bad(place, wanted))
    }

    /// What is wrong with a cell that must be what is `wanted`.
    pub(crate) fn bad(&self, place: usize, wanted: impl Into<Cow<'static, str>>) -> TableError {
        let column = self.names.get(place).cloned().unwrap_or_default();
        let (path, value) = (self.path.into(), self.cell(place).into());
        TableError::Cell { path, line: self.line, column, value, wanted: wanted.into() }
    }
}

/// A finite number.
pub(crate) fn number(cell: &str) -> Option<f64> {
    cell.parse().ok().filter(|x: &f64| x.is_finite())
}

/// The cells of a column whose kind is not known yet, one behind the other: a table may have a million of them.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub(crate) struct TextCells {
    text: String,
    ends: Vec<usize>,
}

impl TextCells {
    /// Adds a cell.
    pub(crate) fn push(&mut self, cell: &str) {
        self.text.push_str(cell);
        self.ends.push(self.text.len());
    }

    /// What they hold; `None` if all of them are empty.
    pub(crate) fn values(&self) -> Option<Values> {
        Values::of_cells((0..self.ends.len()).map(|i| {
            let begins = i.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.text[begins..self.ends[i]]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fault(text: &str) -> String {
        let read = |text: &str| {
            let mut table = TableReader::new(Path::new("a.csv"), text.as_bytes())?;
            table.check_single()?;
            let place = table.required("force_n")?;
            while let Some(row) = table.row()? {
                row.number(place, "a number")?;
            }
            Ok::<(), TableError>(())
        };
        read(text).unwrap_err().to_string()
    }

    #[test]
    fn faults_name_path_row_column_value_and_what_is_wanted() {
        for (text, wanted) in [
            ("time_s,force\n", "a.csv: there is no column `force_n`; found: time_s, force"),
            ("", "a.csv: there is no column `force_n`; found: "),
            ("force_n,force_n\n", "a.csv: there are two columns `force_n`"),
            ("force_n,a\n1,2\nx,2\n", "a.csv: line 3, `force_n` is `x`, it must be a number"),
            ("force_n,a\ninf,2\n", "a.csv: line 2, `force_n` is `inf`, it must be a number"),
            ("force_n,a\n,2\n", "a.csv: line 2, `force_n` is ``, it must be a number"),
        ] {
            assert_eq!(fault(text), wanted, "{text:?}");
        }
        let short = fault("force_n,a\n1\n");
        assert!(
            short.contains("cells of line 2: 1, of the header: 2") && !short.contains("comma"),
            "{short}"
        );
    }

    #[test]
    fn semicolons_and_decimal_commas_are_named() {
        let semicolons = fault("time_s;force_n\n0;12,5\n");
        assert!(semicolons.contains("no column `force_n`; found: time_s;force_n"), "{semicolons}");
        assert!(
            semicolons.ends_with("(the header is one cell with `;` in it: save it with commas)"),
            "{semicolons}"
        );
        let quoted = fault("force_n,a\n\"12,5\",2\n");
        assert!(quoted.ends_with("it must be a number (`12,5` has a decimal comma, write 12.5)"), "{quoted}");
        let bare = fault("force_n,a\n12,5,2\n");
        assert!(
            bare.contains("cells of line 2: 3, of")
                && bare.ends_with("(a number with a decimal comma counts as two cells)"),
            "{bare}"
        );
        assert!(!fault("force_n,a\n\"1,2,3\",2\n").contains("decimal comma"));
    }

    /// Files of Windows, of old Macs, with empty lines, with a line inside a cell, behind a byte order mark.
    #[test]
    fn lines_are_those_of_an_editor() {
        for (text, line) in [
            ("force_n,a\r\n1,2\r\n3,4\r\nx,2\r\n", 4),
            ("\u{feff}force_n,a\r\n1,2\r\nx,2", 3),
            ("\u{feff}force_n,a\n1,2\nx,2\n", 3),
            ("force_n,a\r1,2\rx,2\r", 3),
            ("force_n,a\n\n\n1,2\n\nx,2\n", 6),
            ("force_n,a\r\n\r\nx,2\r\n", 3),
            ("force_n,a\r\n1,\"b\r\nc\"\r\nx,2\r\n", 4),
        ] {
            let said = fault(text);
            assert!(said.contains(&format!("line {line}, `force_n` is `x`")), "{text:?}: {said}");
        }
        let short = fault("force_n,a\r\n1,2\r\n1\r\n");
        assert!(short.contains("cells of line 3: 1, of the header: 2"), "{short}");
    }

    #[test]
    fn other_encodings_tabs_and_clocks_are_named() {
        let read = |bytes: &[u8]| TableReader::new(Path::new("a.csv"), bytes).err().unwrap().to_string();
        let latin = read(b"force_n,op\r\n1,J\xf6rg\r\n");
        assert!(latin.contains("line 2 holds the byte 0xf6") && latin.contains("as UTF-8"), "{latin}");
        let wide: Vec<u8> = "\u{feff}force_n\n1\n".encode_utf16().flat_map(u16::to_le_bytes).collect();
        for bytes in [&wide[..], &wide[2..]] {
            let said = read(bytes);
            assert!(said.contains("the file is UTF-16") && said.contains("as UTF-8"), "{said}");
        }
        let tabs = fault("time_s\tforce_n\n0\t1\n");
        assert!(tabs.ends_with("(the header is one cell with tabs in it: save it with commas)"), "{tabs}");
        for clock in ["09:15:00", "9:15 AM", "2026-05-01T09:15:00Z", "2026-05-01", "1/5/2026 9:15"] {
            let said = fault(&format!("force_n,a\n{clock},2\n"));
            assert!(said.contains("is a clock time, write seconds from the start"), "{said}");
        }
        for word in ["x", "-5-", "a:b", "12-3", ":"] {
            assert!(!fault(&format!("force_n,a\n{word},2\n")).contains("clock"), "{word}");
        }
    }

    #[test]
    fn a_byte_order_mark_and_blanks_are_no_part_of_a_name() {
        let text = "\u{feff}\"force_n\" , a\n 1 ,2\n";
        let mut table = TableReader::new(Path::new("a.csv"), text.as_bytes()).unwrap();
        assert_eq!(table.names(), ["force_n", "a"]);
        assert_eq!((table.place("a"), table.place("b")), (Some(1), None));
        let row = table.row().unwrap().unwrap();
        assert_eq!((row.cell(0), row.cell(7), row.line), ("1", "", 2));
        assert!(table.row().unwrap().is_none());
    }

    #[test]
    fn cells_become_values() {
        let mut cells = TextCells::default();
        assert_eq!(cells.values(), None);
        cells.push("");
        assert_eq!(cells.values(), None, "nobody wrote anything down");
        cells.push("7.0");
        assert!(matches!(cells.values(), Some(Values::Numbers(x)) if x[0].is_nan() && x[1] == 7.0));
        cells.push("ann");
        assert_eq!(cells.values(), Some(Values::Words(vec!["".into(), "7.0".into(), "ann".into()])));
    }
}
