//! Tables that people hand in: CSV with a header, read row by row, with one kind of error.

mod cell;
mod faults;
mod lines;
mod text;

pub(crate) use cell::{is_missing, number};
pub(crate) use text::read_bytes;

use cell::Marks;
use faults::{encoding, near, of_cell};
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
    #[error("{}: the image is a JPEG, grips are read from PNG", .path.display())]
    Jpeg {
        /// The image.
        path: PathBuf,
    },
    /// The table lacks a column.
    #[error("{}: there is no column `{column}`; found: {found}{}", .path.display(), near(.column, .found))]
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

impl TableError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            Self::Io { .. } => "docs/format.md says which files stand where",
            Self::Jpeg { .. } => "store the images as PNG, which loses nothing",
            Self::Column { .. } => "name the columns of the first line as docs/format.md does, in any order",
            Self::TwoColumns { .. } => "rename one of them, or take it out",
            Self::Cell { .. } => "correct the cell, or leave it empty where nobody measured the value",
            Self::Rows { .. } => "correct these rows, or take one of them out",
            Self::Empty { .. } => "a table has a line with names and one line per row below it",
            Self::Format { .. } => "save the table as CSV in UTF-8; cells with commas stand in quotes",
        }
    }
}

/// A table that is read row by row.
pub(crate) struct TableReader<'a> {
    path: &'a Path,
    names: Vec<String>,
    reader: csv::Reader<&'a [u8]>,
    record: csv::StringRecord,
    lines: Lines<'a>,
    marks: Marks,
}

/// A row of a table.
pub(crate) struct Row<'r> {
    path: &'r Path,
    names: &'r [String],
    record: &'r csv::StringRecord,
    marks: Marks,
    /// Line of the file, the header is line 1.
    pub(crate) line: u64,
}

fn reader_of(bytes: &[u8], delimiter: u8) -> csv::Reader<&[u8]> {
    csv::ReaderBuilder::new().trim(csv::Trim::All).flexible(true).delimiter(delimiter).from_reader(bytes)
}

impl<'a> TableReader<'a> {
    /// Reads the header; `path` is for errors. Cells end at commas, or at the semicolons or tabs of a header without commas.
    ///
    /// # Errors
    /// [`TableError::Format`].
    pub(crate) fn new(path: &'a Path, bytes: &'a [u8]) -> Result<Self, TableError> {
        if let Some((problem, hint)) = encoding(bytes) {
            return Err(TableError::Format { path: path.into(), problem, hint });
        }
        let layout = text::layout(bytes);
        let mut lines = Lines::new(bytes, layout.begins);
        let mut reader = reader_of(&bytes[layout.begins..], layout.delimiter);
        let header = reader.headers().map_err(|e| format_error(path, &mut lines, &e))?;
        // The parser takes a byte order mark off the file; a header pasted behind another has one inside.
        let names = header.iter().map(|name| name.trim_start_matches('\u{feff}').trim().into()).collect();
        let marks = text::marks(&bytes[layout.begins..], layout.delimiter);
        Ok(Self { path, names, reader, record: csv::StringRecord::new(), lines, marks })
    }

    /// Names of the columns, empty where a column has none.
    pub(crate) fn names(&self) -> &[String] {
        &self.names
    }

    /// Takes a column of another spelling for one that is known: `Grip Force [N]` for `grip_force_n`. Its unit has to stand
    /// there, and nothing else may have the name.
    pub(crate) fn spell(&mut self, known: &[&str]) {
        let plain: Vec<String> = self.names.iter().map(|name| text::plain_name(name)).collect();
        for name in known {
            if self.names.iter().any(|typed| typed == name) {
                continue;
            }
            let mut places = (0..plain.len()).filter(|&i| plain[i] == **name);
            if let (Some(place), None) = (places.next(), places.next()) {
                self.names[place] = (*name).into();
            }
        }
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

    /// The next row; `None` after the last. A row of empty cells is none.
    ///
    /// # Errors
    /// [`TableError::Format`].
    pub(crate) fn row(&mut self) -> Result<Option<Row<'_>>, TableError> {
        loop {
            let more = self.reader.read_record(&mut self.record);
            if !more.map_err(|e| format_error(self.path, &mut self.lines, &e))? {
                return Ok(None);
            }
            if self.record.iter().any(|cell| !cell.is_empty()) {
                break;
            }
        }
        let line = self.lines.of(self.record.position());
        // Spreadsheets write commas behind the last cell where another row is longer.
        let (cells, wanted) = (self.record.len(), self.names.len());
        if cells < wanted || self.record.iter().skip(wanted).any(|cell| !cell.is_empty()) {
            let hint =
                if cells > wanted { " (a number with a decimal comma counts as two cells)" } else { "" };
            let problem = format!("cells of line {line}: {cells}, of the header: {wanted}");
            return Err(TableError::Format { path: self.path.into(), problem, hint });
        }
        Ok(Some(Row { path: self.path, names: &self.names, record: &self.record, marks: self.marks, line }))
    }
}

fn format_error(path: &Path, lines: &mut Lines<'_>, e: &csv::Error) -> TableError {
    let at = e.position().map_or(String::new(), |p| format!("line {}: ", lines.of(Some(p))));
    TableError::Format { path: path.into(), problem: format!("{at}{e}"), hint: "" }
}

impl Row<'_> {
    /// The cell of a column; empty where there is none, or it says that a value is missing.
    pub(crate) fn cell(&self, place: usize) -> &str {
        self.record.get(place).filter(|cell| !is_missing(cell)).unwrap_or_default()
    }

    /// The cell of a column that may hold numbers, as programs write them.
    ///
    /// # Errors
    /// [`TableError::Cell`] of one that may be two numbers.
    pub(crate) fn plain(&self, place: usize) -> Result<Cow<'_, str>, TableError> {
        self.marks.canonical(self.cell(place)).ok_or_else(|| self.bad(place, "one number and not two"))
    }

    /// A number.
    ///
    /// # Errors
    /// [`TableError::Cell`] if it is none, or not finite: it must be what is `wanted`.
    pub(crate) fn number(&self, place: usize, wanted: &'static str) -> Result<f64, TableError> {
        number(&self.plain(place)?).ok_or_else(|| self.bad(place, wanted))
    }

    /// What is wrong with a cell that must be what is `wanted`.
    pub(crate) fn bad(&self, place: usize, wanted: impl Into<Cow<'static, str>>) -> TableError {
        let column = self.names.get(place).cloned().unwrap_or_default();
        let value = self.record.get(place).unwrap_or_default().into();
        let path = self.path.into();
        TableError::Cell { path, line: self.line, column, value, wanted: wanted.into() }
    }
}

/// Of five cells of a column of numbers one may be a word, which is a remark and no value then; codes of a column of names that look
/// like numbers are about as many as those that do not. Of less than eight cells nothing is known.
const FEW_WORDS: usize = 5;
const LEAST_CELLS: usize = 8;

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

    /// The cells in order.
    fn iter(&self) -> impl Iterator<Item = &str> + Clone {
        (0..self.ends.len()).map(|i| {
            let begins = i.checked_sub(1).map_or(0, |before| self.ends[before]);
            &self.text[begins..self.ends[i]]
        })
    }

    /// What they hold; `None` if all of them are empty.
    pub(crate) fn values(&self) -> Option<Values> {
        Values::of_cells(self.iter())
    }

    /// The same, and the few words of a column of numbers with their rows: they are taken as missing.
    pub(crate) fn values_but_words(&self) -> Option<(Values, Vec<(usize, String)>)> {
        let is_word = |cell: &str| !cell.is_empty() && cell.parse::<f64>().is_err();
        let words: Vec<(usize, String)> =
            self.iter().enumerate().filter(|(_, c)| is_word(c)).map(|(i, c)| (i, c.into())).collect();
        let filled = self.iter().filter(|cell| !cell.is_empty()).count();
        if words.is_empty() || filled < LEAST_CELLS || words.len() * FEW_WORDS > filled {
            return Some((self.values()?, Vec::new()));
        }
        let numbers = self.iter().map(|cell| if is_word(cell) { "" } else { cell });
        Some((Values::of_cells(numbers)?, words))
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
            ("time_s,mass_kg\n", "a.csv: there is no column `force_n`; found: time_s, mass_kg"),
            ("", "a.csv: there is no column `force_n`; found: "),
            ("force_n,force_n\n", "a.csv: there are two columns `force_n`"),
            ("force_n,a\n1,2\nx,2\n", "a.csv: line 3, `force_n` is `x`, it must be a number"),
            ("force_n,a\ninf,2\n", "a.csv: line 2, `force_n` is `inf`, it must be a number"),
            ("force_n,a\n,2\n", "a.csv: line 2, `force_n` is ``, it must be a number"),
            ("force_n,a\nNaN,2\n", "a.csv: line 2, `force_n` is `NaN`, it must be a number"),
        ] {
            assert_eq!(fault(text), wanted, "{text:?}");
        }
        let short = fault("force_n,a\n1\n");
        assert!(
            short.contains("cells of line 2: 1, of the header: 2") && !short.contains("comma"),
            "{short}"
        );
    }

    /// Numbers of the first column.
    fn numbers(text: &str) -> Vec<f64> {
        let mut table = TableReader::new(Path::new("a.csv"), text.as_bytes()).unwrap();
        table.spell(&["force_n"]);
        let place = table.required("force_n").unwrap();
        let mut found = Vec::new();
        while let Some(row) = table.row().unwrap() {
            found.push(row.number(place, "a number").unwrap());
        }
        found
    }

    #[test]
    fn tables_of_spreadsheets_are_read() {
        for text in [
            "force_n,a\n12.5,1\n1000,1\n",
            "force_n;a\n12,5;1\n1000;1\n",
            "force_n;a\n12,5;1\n\"1.000,0\";1\n",
            "sep=;\r\nforce_n;a\r\n12,5;1\r\n1000;1\r\n",
            "force_n\ta\n12.5\t1\n1000\t1\n",
            "Force [N],a\n12.5,1\n\"1,000.0\",1\n",
            "force_n,a\n12.5,1,,\n1 000,1,,\n,,,\n,\n\n",
        ] {
            assert_eq!(numbers(text), [12.5, 1000.0], "{text:?}");
        }
        let after = fault("sep=;\r\nforce_n;a\r\n12,5;1\r\nx;1\r\n");
        assert!(after.contains("line 4, `force_n` is `x`"), "{after}");
    }

    #[test]
    fn what_may_be_two_numbers_is_named_with_both() {
        let quoted = fault("force_n,a\n\"1,234\",2\n");
        assert!(quoted.ends_with("(`1,234` may be 1234 or 1.234: write one of them)"), "{quoted}");
        let mixed = fault("force_n;a\n12,5;2\n1.234;2\n");
        assert!(mixed.contains("line 3") && mixed.contains("`1.234` may be 1234 or 1.234"), "{mixed}");
        let bare = fault("force_n,a\n12,5,2\n");
        assert!(
            bare.contains("cells of line 2: 3, of")
                && bare.ends_with("(a number with a decimal comma counts as two cells)"),
            "{bare}"
        );
    }

    #[test]
    fn a_column_of_nearly_the_right_name_is_named() {
        let of = |header: &str| fault(&format!("{header}\n"));
        for typed in ["force", "Force", "force_kgf", "froce_n"] {
            let said = of(&format!("time_s,{typed}"));
            assert!(
                said.contains(&format!("did you mean `{typed}`? name it `force_n`, in newtons")),
                "{said}"
            );
        }
        assert!(!of("time_s,mass_kg").contains("did you mean"));
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
    fn other_encodings_and_clocks_are_named() {
        let read = |bytes: &[u8]| TableReader::new(Path::new("a.csv"), bytes).err().unwrap().to_string();
        let latin = read(b"force_n,op\r\n1,J\xf6rg\r\n");
        assert!(latin.contains("line 2 holds the byte 0xf6") && latin.contains("as UTF-8"), "{latin}");
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

    /// Two remarks among twenty readings are no readings; a column of batches with a letter among them is one of names.
    #[test]
    fn a_few_words_in_a_column_of_numbers_are_missing() {
        let of = |texts: &[&str]| {
            let mut cells = TextCells::default();
            texts.iter().for_each(|text| cells.push(text));
            cells.values_but_words().unwrap()
        };
        let mut column = vec!["45.5"; 20];
        (column[3], column[7], column[9]) = ("", "wet", "broken");
        let (Values::Numbers(x), words) = of(&column) else { panic!("numbers") };
        assert!(x[3].is_nan() && x[7].is_nan() && x[9].is_nan() && x[0] == 45.5);
        assert_eq!(words, [(7, "wet".into()), (9, "broken".into())]);
        for names in [&["1", "2", "3", "4", "5", "A"][..], &["1", "2", "A", "1", "2", "A", "B", "1", "2"]] {
            let (values, words) = of(names);
            assert!(matches!(values, Values::Words(_)) && words.is_empty());
        }
    }
}
