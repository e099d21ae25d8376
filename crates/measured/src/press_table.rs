//! A folder of presses, of a ball or of other bodies: `presses.csv`, the images that it names, and `rest.png`.

use crate::table::{TableError, TableReader, TextCells, number, read_bytes};
use gripgen_record::{decode_picture as decode, is_jpeg};
use gripgen_twin::{TactileImage, Values};
use std::path::{Path, PathBuf};

/// The table of a press folder.
pub const PRESSES_FILE: &str = "presses.csv";

/// Another name under which the table of presses of bodies that are no balls is found.
const SHAPES_FILE: &str = "shapes.csv";

/// Files that a folder of presses is known by.
const TABLES: [&str; 2] = [PRESSES_FILE, SHAPES_FILE];

/// The table of a folder of presses; `None` where there is none.
pub fn press_table(folder: &Path) -> Option<PathBuf> {
    TABLES.iter().map(|name| folder.join(name)).find(|path| path.is_file())
}

/// The table that is read: the one that is there, or the one that ought to be.
fn table_path(folder: &Path) -> PathBuf {
    press_table(folder).unwrap_or_else(|| folder.join(PRESSES_FILE))
}

/// The column that names the image of a row.
const IMAGE: &str = "image";

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
    /// How far it travelled after first contact.
    pub depth_m: Option<f64>,
    /// The body, where it is no ball.
    pub body: Option<PressedBody>,
}

/// A body that is no ball, as a row of the table says.
#[derive(Debug, Clone, PartialEq)]
pub struct PressedBody {
    /// Its mesh (STL, OBJ or PLY in millimetres, GLB in metres): the path as written in the table.
    pub mesh: String,
    /// What its shape is called: the column `shape`, or the name of the mesh.
    pub shape: String,
    /// Turn about its own z, counter-clockwise as seen in the image.
    pub rotation_rad: f64,
    /// Radius of its convex edges, where the table says one.
    pub edge_radius_m: Option<f64>,
}

/// What a press folder holds, in the order of its table.
#[derive(Debug, Clone, PartialEq)]
pub struct PressFolder {
    /// The frame without contact.
    pub rest: Option<TactileImage>,
    /// The presses.
    pub presses: Vec<PressRecord>,
}

/// Reads a press folder. Columns: `image`, and where somebody measured them `x_px`, `y_px`, `radius_px` or
/// `depth_mm`; an empty cell is a number that nobody measured. A row with a `mesh` is of that body and no ball: `depth_mm`,
/// `x_px` and `y_px` of the mesh's origin are needed then, `rotation_deg`, `edge_radius_mm` and `shape` are optional. Further columns are
/// left alone. The table may be called `shapes.csv` too. Images are PNG or JPEG; [`jpeg_presses`] names those that are JPEGs.
///
/// # Errors
/// [`TableError`], with line, column and value, or with the image.
pub fn read_press_folder(folder: &Path) -> Result<PressFolder, TableError> {
    let path = table_path(folder);
    let bytes = read_bytes(&path)?;
    let mut table = TableReader::new(&path, &bytes)?;
    let image_column = table.required(IMAGE)?;
    let numbers = ["x_px", "y_px", "radius_px", "depth_mm", "rotation_deg", EDGE_RADIUS]
        .map(|name| (name, table.place(name)));
    let words = ["mesh", "shape"].map(|name| table.place(name));
    let mut presses = Vec::new();
    while let Some(row) = table.row()? {
        let name = row.cell(image_column).to_string();
        let mut found = [None; 6];
        for (slot, (column, place)) in found.iter_mut().zip(numbers) {
            let Some(place) = place else { continue };
            *slot = measured(row.cell(place), column).map_err(|wanted| row.bad(place, wanted))?;
        }
        let [x, y, radius_px, depth_mm, rotation_deg, edge_radius_mm] = found;
        let word = |place: Option<usize>| place.map(|p| row.cell(p).trim()).filter(|w| !w.is_empty());
        let body = match word(words[0]) {
            None => None,
            Some(mesh) => {
                for (slot, (name, place)) in found.iter().zip(numbers) {
                    let needed = matches!(name, "x_px" | "y_px" | "depth_mm");
                    if needed && slot.is_none() {
                        let wanted = "given: a mesh needs x_px, y_px and depth_mm";
                        return Err(row.bad(place.or(words[0]).unwrap_or(image_column), wanted));
                    }
                }
                let stem = Path::new(mesh).file_stem().map_or(mesh, |stem| stem.to_str().unwrap_or(mesh));
                Some(PressedBody {
                    mesh: mesh.into(),
                    shape: word(words[1]).unwrap_or(stem).into(),
                    rotation_rad: rotation_deg.unwrap_or(0.0).to_radians(),
                    edge_radius_m: edge_radius_mm.map(|mm| mm * 1e-3),
                })
            }
        };
        presses.push(PressRecord {
            image: read_picture(&folder.join(&name))?.0,
            name,
            centre_px: x.zip(y),
            radius_px,
            depth_m: depth_mm.map(|mm| mm * 1e-3),
            body,
        });
    }
    let rest = REST_FILES.iter().map(|name| folder.join(name)).find(|p| p.is_file());
    let rest = rest.map(|p| read_picture(&p)).transpose()?.map(|(image, _)| image);
    Ok(PressFolder { rest, presses })
}

/// The images of a press folder that are JPEGs, the frame without contact among them: each is named, and how many images there are.
///
/// # Errors
/// [`TableError`], with line and column, or with the image.
pub fn jpeg_presses(folder: &Path) -> Result<(Vec<String>, usize), TableError> {
    let path = table_path(folder);
    let bytes = read_bytes(&path)?;
    let mut table = TableReader::new(&path, &bytes)?;
    let image_column = table.required(IMAGE)?;
    let mut names = Vec::new();
    while let Some(row) = table.row()? {
        names.push(row.cell(image_column).to_string());
    }
    names.extend(REST_FILES.iter().find(|name| folder.join(name).is_file()).map(|name| name.to_string()));
    let count = names.len();
    let mut jpegs = Vec::new();
    for name in names {
        if is_jpeg(&read_bytes(&folder.join(&name))?) {
            jpegs.push(name);
        }
    }
    Ok((jpegs, count))
}

/// All columns of a press table, as numbers or words.
#[derive(Debug, Clone, PartialEq)]
pub struct PressColumnTable {
    /// The image of each row.
    pub names: Vec<String>,
    /// Name and values of each column that was recorded, that of the images among them.
    pub columns: Vec<(String, Values)>,
}

/// Reads the columns of a press table, and no image. An empty cell is a value that nobody wrote down, a column of nothing but
/// empty cells is not recorded, and one without a name is left out.
///
/// # Errors
/// [`TableError`].
pub fn read_press_columns(folder: &Path) -> Result<PressColumnTable, TableError> {
    let path = table_path(folder);
    let bytes = read_bytes(&path)?;
    let mut table = TableReader::new(&path, &bytes)?;
    let mut columns: Vec<(String, TextCells)> =
        table.names().iter().map(|name| (name.clone(), TextCells::default())).collect();
    let image_column = table.place(IMAGE);
    let mut names = Vec::new();
    while let Some(row) = table.row()? {
        for (place, (_, cells)) in columns.iter_mut().enumerate() {
            cells.push(&row.plain(place)?);
        }
        names.extend(image_column.map(|place| row.cell(place).to_string()));
    }
    let columns = columns.into_iter().filter(|(name, _)| !name.is_empty());
    let columns = columns.filter_map(|(name, cells)| Some((name, cells.values()?)));
    Ok(PressColumnTable { names, columns: columns.collect() })
}

/// A number of a cell, none where it is empty; otherwise what it must be.
/// Column of the radius of a body's convex edges, and the largest there can be.
const EDGE_RADIUS: &str = "edge_radius_mm";
const MAX_EDGE_RADIUS_MM: f64 = 1.0;

fn measured(cell: &str, column: &str) -> Result<Option<f64>, &'static str> {
    let length = matches!(column, "radius_px" | "depth_mm");
    match number(cell) {
        _ if cell.is_empty() => Ok(None),
        Some(x) if column == EDGE_RADIUS && !(0.0..=MAX_EDGE_RADIUS_MM).contains(&x) => Err("from 0 to 1 mm"),
        Some(x) if !length || x > 0.0 => Ok(Some(x)),
        _ if length => Err("a number above 0"),
        _ => Err("a number"),
    }
}

/// An image, which must not be a JPEG.
pub(crate) fn picture(path: &Path) -> Result<TactileImage, TableError> {
    match read_picture(path)? {
        (_, true) => Err(TableError::Jpeg { path: path.into() }),
        (image, false) => Ok(image),
    }
}

/// An image, and whether it is a JPEG.
fn read_picture(path: &Path) -> Result<(TactileImage, bool), TableError> {
    let io = |problem: String| TableError::Io { path: path.into(), problem };
    let bytes = std::fs::read(path).map_err(|e| io(e.to_string()))?;
    let image = decode(&bytes).map_err(|e| io(e.to_string()))?;
    Ok((image, is_jpeg(&bytes)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_record::encode_png;

    fn folder(table: &str) -> tempfile::TempDir {
        let folder = tempfile::tempdir().unwrap();
        let image = TactileImage { width_px: 20, height_px: 16, rgb: vec![90; 20 * 16 * 3] };
        std::fs::write(folder.path().join("a.png"), encode_png(&image).unwrap()).unwrap();
        std::fs::write(folder.path().join("rest.png"), encode_png(&image).unwrap()).unwrap();
        std::fs::write(folder.path().join("lossy.png"), [0xff, 0xd8, 0xff, 0xe0]).unwrap();
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
    fn columns_are_numbers_or_words_and_an_empty_cell_is_neither() {
        let folder = folder("image, lamp, time_s, blank\na.png, on, 3.5,\na.png,off,,\n");
        let read = read_press_columns(folder.path()).unwrap();
        assert_eq!(read.names, ["a.png", "a.png"]);
        assert_eq!(read.columns[1], ("lamp".to_string(), Values::Words(vec!["on".into(), "off".into()])));
        let Values::Numbers(time_s) = &read.columns[2].1 else { panic!("{:?}", read.columns[2]) };
        assert!(time_s[0] == 3.5 && time_s[1].is_nan(), "{time_s:?}");
        assert_eq!(read.columns.len(), 3, "a column of nothing but empty cells is not recorded");
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
            ("image,depth_mm\na.png,deep\n", "`depth_mm` is `deep`"),
            ("image\nb.png\n", "b.png"),
            ("image,x_px\na.png,1,2\n", "cells of line 2: "),
        ] {
            let error = read_press_folder(folder(table).path()).unwrap_err().to_string();
            assert!(error.contains(part), "{table:?}: {error}");
        }
    }
}
