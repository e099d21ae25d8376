//! A folder of ball presses: `presses.csv`, the images that it names, and `rest.png`.

use crate::picture::decode;
use gripgen_twin::TactileImage;
use std::path::{Path, PathBuf};

/// The table of a press folder.
pub const PRESSES_FILE: &str = "presses.csv";

/// Names under which a frame without contact is looked for.
const REST_FILES: [&str; 3] = ["rest.png", "rest.jpg", "rest.jpeg"];

/// One row of the table with its image.
#[derive(Debug, Clone, PartialEq)]
pub struct PressRecord {
    /// The image's path, as written in the table.
    pub name: String,
    /// The image.
    pub image: TactileImage,
    /// Centre of the contact, (x, y) from the centre of the first pixel.
    pub centre_px: Option<(f64, f64)>,
    /// Radius of the contact.
    pub radius_px: Option<f64>,
    /// How deep the ball sank in.
    pub depth_m: Option<f64>,
}

/// What a press folder holds, in the order of its table.
#[derive(Debug, Clone, PartialEq)]
pub struct PressFolder {
    /// The frame without contact.
    pub rest: Option<TactileImage>,
    /// The presses.
    pub presses: Vec<PressRecord>,
}

/// Why a press folder could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum PressFolderError {
    /// A file cannot be read.
    #[error("{}: {problem}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system says.
        problem: String,
    },
    /// The table lacks a column.
    #[error("{}: there is no column `{column}`; found: {found}", .path.display())]
    Column {
        /// The table.
        path: PathBuf,
        /// The column.
        column: &'static str,
        /// Columns found.
        found: String,
    },
    /// A cell is not what its column holds.
    #[error("{}: line {line}, `{column}` is `{value}`, it must be {wanted}", .path.display())]
    Cell {
        /// The table.
        path: PathBuf,
        /// Line of the file, the header is line 1.
        line: u64,
        /// The column.
        column: &'static str,
        /// What stands there.
        value: String,
        /// What should.
        wanted: &'static str,
    },
    /// Rows that the table's format forbids.
    #[error("{}: {problem}", .path.display())]
    Table {
        /// The table.
        path: PathBuf,
        /// What the parser says.
        problem: String,
    },
}

/// Reads a press folder. Columns: `image`, and where somebody measured them `x_px`, `y_px`, `radius_px` or
/// `depth_mm`; an empty cell is a number that nobody measured. Further columns are left alone.
pub fn read_press_folder(folder: &Path) -> Result<PressFolder, PressFolderError> {
    let path = folder.join(PRESSES_FILE);
    let table = |e: csv::Error| PressFolderError::Table { path: path.clone(), problem: e.to_string() };
    let bytes = read(&path)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let header = reader.headers().map_err(table)?.clone();
    let column = |name: &str| header.iter().position(|h| h.trim_start_matches('\u{feff}') == name);
    let image_column = column("image").ok_or_else(|| PressFolderError::Column {
        path: path.clone(),
        column: "image",
        found: header.iter().collect::<Vec<_>>().join(", "),
    })?;
    let numbers = ["x_px", "y_px", "radius_px", "depth_mm"].map(|name| (name, column(name)));
    let mut presses = Vec::new();
    for row in reader.records() {
        let row = row.map_err(table)?;
        let line = row.position().map_or(0, csv::Position::line);
        let name = row.get(image_column).unwrap_or_default().to_string();
        let mut found = [None; 4];
        for (slot, (column, at)) in found.iter_mut().zip(numbers) {
            *slot = number(at.and_then(|i| row.get(i)).unwrap_or_default(), column).map_err(|wanted| {
                let value = at.and_then(|i| row.get(i)).unwrap_or_default().to_string();
                PressFolderError::Cell { path: path.clone(), line, column, value, wanted }
            })?;
        }
        let [x, y, radius_px, depth_mm] = found;
        presses.push(PressRecord {
            image: picture(&folder.join(&name))?,
            name,
            centre_px: x.zip(y),
            radius_px,
            depth_m: depth_mm.map(|mm| mm * 1e-3),
        });
    }
    let rest = REST_FILES.iter().map(|name| folder.join(name)).find(|p| p.is_file());
    Ok(PressFolder { rest: rest.map(|p| picture(&p)).transpose()?, presses })
}

/// All columns of a press table as they stand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PressColumnTable {
    /// The image of each row.
    pub names: Vec<String>,
    /// Name and cells of each column.
    pub columns: Vec<(String, Vec<String>)>,
}

/// Reads the columns of a press table, and no image.
pub fn read_press_columns(folder: &Path) -> Result<PressColumnTable, PressFolderError> {
    let path = folder.join(PRESSES_FILE);
    let table = |e: csv::Error| PressFolderError::Table { path: path.clone(), problem: e.to_string() };
    let bytes = read(&path)?;
    let mut reader = csv::ReaderBuilder::new().trim(csv::Trim::All).from_reader(&bytes[..]);
    let header = reader.headers().map_err(table)?.clone();
    let mut columns: Vec<(String, Vec<String>)> =
        header.iter().map(|h| (h.trim_start_matches('\u{feff}').to_string(), Vec::new())).collect();
    for row in reader.records() {
        let row = row.map_err(table)?;
        for ((_, cells), cell) in columns.iter_mut().zip(row.iter()) {
            cells.push(cell.to_string());
        }
    }
    let names = columns.iter().find(|(name, _)| name == "image").map(|(_, cells)| cells.clone());
    Ok(PressColumnTable { names: names.unwrap_or_default(), columns })
}

/// A number of a cell, none where it is empty; otherwise what it must be.
fn number(cell: &str, column: &str) -> Result<Option<f64>, &'static str> {
    if cell.is_empty() {
        return Ok(None);
    }
    let length = matches!(column, "radius_px" | "depth_mm");
    match cell.parse::<f64>() {
        Ok(x) if x.is_finite() && !length => Ok(Some(x)),
        Ok(x) if x.is_finite() && x > 0.0 => Ok(Some(x)),
        _ if length => Err("a number above 0"),
        _ => Err("a number"),
    }
}

fn picture(path: &Path) -> Result<TactileImage, PressFolderError> {
    let bytes = read(path)?;
    decode(&bytes).map_err(|e| PressFolderError::Io { path: path.into(), problem: e.to_string() })
}

fn read(path: &Path) -> Result<Vec<u8>, PressFolderError> {
    std::fs::read(path).map_err(|e| PressFolderError::Io { path: path.into(), problem: e.to_string() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::encode_png;

    fn folder(table: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let image = TactileImage { width_px: 20, height_px: 16, rgb: vec![90; 20 * 16 * 3] };
        std::fs::write(folder.path().join("a.png"), encode_png(&image).unwrap()).unwrap();
        std::fs::write(folder.path().join("rest.png"), encode_png(&image).unwrap()).unwrap();
        std::fs::write(folder.path().join(PRESSES_FILE), table).unwrap();
        folder
    }

    #[test]
    fn what_was_not_measured_stays_open() {
        let folder =
            folder("image, x_px, y_px, radius_px, depth_mm, who\na.png, 9.5, 8, , 0.7, me\na.png,,,3,,\n");
        let read = read_press_folder(folder.path()).unwrap();
        assert!(read.rest.is_some());
        let first = &read.presses[0];
        assert_eq!((first.centre_px, first.radius_px, first.depth_m), (Some((9.5, 8.0)), None, Some(0.7e-3)));
        assert_eq!((read.presses[1].centre_px, read.presses[1].radius_px), (None, Some(3.0)));
    }

    #[test]
    fn columns_are_read_as_they_stand() {
        let folder = folder("image, lamp, time_s\na.png, on, 3.5\na.png,off,\n");
        let read = read_press_columns(folder.path()).unwrap();
        assert_eq!(read.names, ["a.png", "a.png"]);
        assert_eq!(read.columns[1], ("lamp".to_string(), vec!["on".to_string(), "off".to_string()]));
        assert_eq!(read.columns[2].1, ["3.5", ""]);
    }

    #[test]
    fn faults_name_line_and_column() {
        for (table, part) in [
            ("picture,x_px\na.png,1\n", "no column `image`; found: picture, x_px"),
            ("image,x_px\na.png,left\n", "line 2, `x_px` is `left`, it must be a number"),
            (
                "image,radius_px\na.png,5\na.png,-3\n",
                "line 3, `radius_px` is `-3`, it must be a number above 0",
            ),
            ("image,depth_mm\na.png,nan\n", "`depth_mm` is `nan`"),
            ("image\nb.png\n", "b.png"),
            ("image,x_px\na.png,1,2\n", "line: 2"),
        ] {
            let error = read_press_folder(folder(table).path()).unwrap_err().to_string();
            assert!(error.contains(part), "{table:?}: {error}");
        }
    }
}
