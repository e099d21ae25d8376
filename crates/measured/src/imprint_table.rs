//! A folder with `imprints.csv`: imprints of grasps beside the normal force of the jaw, without a pull.

use crate::press_table::picture;
use crate::table::{Row, TableError, TableReader, TextCells, read_bytes};
use gripgen_record::sha256_hex;
use gripgen_twin::{TactileImage, Values};
use std::path::Path;

/// The table of a folder of imprints.
pub const IMPRINTS_FILE: &str = "imprints.csv";

/// What a row says of its imprint.
#[derive(Debug, Clone, PartialEq)]
pub enum MeasuredImprint {
    /// Its volume in mm^3, as somebody measured it.
    VolumeMm3(f64),
    /// A picture and the frame without contact that belongs to it, where the table names one: paths as written in the table.
    Image {
        /// The picture.
        image: String,
        /// The frame without contact.
        rest: Option<String>,
    },
}

/// A table of imprints, column by column.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintTable {
    /// Ids of the rows.
    pub ids: Vec<String>,
    /// Normal force of the jaw, in N.
    pub grip_force_n: Vec<f64>,
    /// Volume or picture of each row.
    pub imprints: Vec<MeasuredImprint>,
    /// Time in s, rising within a grasp; NaN where nobody wrote it down.
    pub time_s: Vec<f64>,
    /// Grasp of each row: an index into `grasps`. A row that names none is a grasp of its own, called as the row.
    pub grasp: Vec<usize>,
    /// Names of the grasps in order of appearance.
    pub grasps: Vec<String>,
    /// Part of each row, empty where nobody wrote it down.
    pub part: Vec<String>,
    /// Session of each row, empty where nobody wrote it down.
    pub session: Vec<String>,
    /// Further columns with their names, `width_mm` among them.
    pub extra: Vec<(String, Values)>,
    /// Hash of the file.
    pub sha256: String,
}

/// Reads the table of a folder. Columns: `imprint_id`, `grip_force_n`, and `volume_mm3` or `image` (with `rest`); where a row
/// has both the volume counts. `grasp`, `part`, `time_s`, `session` may stand beside, rows of a grasp in the order of time. Further
/// columns are kept: numbers where every cell is one or empty, words otherwise.
///
/// # Errors
/// [`TableError`], with line, column and value.
pub fn read_imprint_table(folder: &Path) -> Result<ImprintTable, TableError> {
    let path = folder.join(IMPRINTS_FILE);
    parse(&path, &read_bytes(&path)?)
}

/// Reads a picture that a table of imprints names. It is PNG: a JPEG moves colours by as much as a light contact does.
///
/// # Errors
/// [`TableError`] with the path.
pub fn read_imprint_picture(folder: &Path, name: &str) -> Result<TactileImage, TableError> {
    picture(&folder.join(name))
}

/// Where the columns stand.
struct Places {
    id: usize,
    force: usize,
    volume: Option<usize>,
    image: Option<usize>,
    rest: Option<usize>,
    time: Option<usize>,
    grasp: Option<usize>,
    part: Option<usize>,
    session: Option<usize>,
}

impl Places {
    fn of(reader: &TableReader<'_>) -> Result<Self, TableError> {
        let (volume, image) = (reader.place("volume_mm3"), reader.place("image"));
        let places = Self {
            id: reader.required("imprint_id")?,
            force: reader.required("grip_force_n")?,
            volume,
            image,
            rest: reader.place("rest"),
            time: reader.place("time_s"),
            grasp: reader.place("grasp"),
            part: reader.place("part"),
            session: reader.place("session"),
        };
        if volume.is_none() && image.is_none() {
            reader.required("volume_mm3")?;
        }
        Ok(places)
    }

    fn all(&self) -> [Option<usize>; 9] {
        let Self { id, force, volume, image, rest, time, grasp, part, session } = *self;
        [Some(id), Some(force), volume, image, rest, time, grasp, part, session]
    }

    fn imprint(&self, row: &Row<'_>) -> Result<MeasuredImprint, TableError> {
        let word = |place: Option<usize>| place.map(|p| row.cell(p)).filter(|w| !w.is_empty());
        if let (Some(place), Some(_)) = (self.volume, word(self.volume)) {
            return row.number(place, "a volume in mm^3, a finite number").map(MeasuredImprint::VolumeMm3);
        }
        match word(self.image) {
            Some(image) => {
                Ok(MeasuredImprint::Image { image: image.into(), rest: word(self.rest).map(Into::into) })
            }
            None => {
                let place = self.volume.or(self.image).unwrap_or(self.id);
                Err(row.bad(place, "given: a row needs `volume_mm3` or `image`"))
            }
        }
    }
}

fn parse(path: &Path, bytes: &[u8]) -> Result<ImprintTable, TableError> {
    let mut reader = TableReader::new(path, bytes)?;
    reader.check_single()?;
    let places = Places::of(&reader)?;
    let known = places.all();
    let mut extra: Vec<(usize, String, TextCells)> = Vec::new();
    for (i, name) in reader.names().iter().enumerate() {
        if !known.contains(&Some(i)) && !name.is_empty() {
            extra.push((i, name.clone(), TextCells::default()));
        }
    }
    let mut table = ImprintTable {
        ids: Vec::new(),
        grip_force_n: Vec::new(),
        imprints: Vec::new(),
        time_s: Vec::new(),
        grasp: Vec::new(),
        grasps: Vec::new(),
        part: Vec::new(),
        session: Vec::new(),
        extra: Vec::new(),
        sha256: sha256_hex(bytes),
    };
    let mut of_name = std::collections::BTreeMap::new();
    let mut ids = std::collections::BTreeSet::new();
    let mut last_s: Vec<f64> = Vec::new();
    while let Some(row) = reader.row()? {
        let id = row.cell(places.id);
        if id.is_empty() {
            return Err(row.bad(places.id, "a name"));
        }
        if !ids.insert(id.to_string()) {
            let problem =
                format!("line {}, `imprint_id` is `{id}`, as in a row before; each needs its own", row.line);
            return Err(TableError::Rows { path: path.into(), problem });
        }
        let force_n = row.number(places.force, "the normal force of the jaw in N, a finite number")?;
        let time_s = match places.time.filter(|&p| !row.cell(p).is_empty()) {
            Some(place) => row.number(place, "a time in s, a finite number")?,
            None => f64::NAN,
        };
        let word = |place: Option<usize>| place.map_or("", |p| row.cell(p));
        // A row without a grasp is one of its own, even where a grasp has its id for a name.
        let (named, name) = match word(places.grasp) {
            "" => (false, id),
            name => (true, name),
        };
        let grasp = *of_name.entry((named, name.to_string())).or_insert_with(|| {
            table.grasps.push(name.into());
            last_s.push(f64::NAN);
            table.grasps.len() - 1
        });
        if time_s <= last_s[grasp] {
            let (line, before) = (row.line, last_s[grasp]);
            let problem = format!(
                "line {line}, `time_s` is {time_s} after {before} in grasp `{name}`, it must rise: rows of a grasp stand in \
                 the order of time"
            );
            return Err(TableError::Rows { path: path.into(), problem });
        }
        last_s[grasp] = time_s;
        table.imprints.push(places.imprint(&row)?);
        table.ids.push(id.into());
        table.grip_force_n.push(force_n);
        table.time_s.push(time_s);
        table.grasp.push(grasp);
        table.part.push(word(places.part).into());
        table.session.push(word(places.session).into());
        for (place, _, cells) in &mut extra {
            cells.push(&row.plain(*place)?);
        }
    }
    if table.ids.is_empty() {
        return Err(TableError::Empty { path: path.into() });
    }
    table.extra = extra.into_iter().filter_map(|(_, name, cells)| Some((name, cells.values()?))).collect();
    Ok(table)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(table: &str) -> Result<ImprintTable, TableError> {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join(IMPRINTS_FILE), table).unwrap();
        read_imprint_table(folder.path())
    }

    #[test]
    fn grasps_volumes_pictures_and_further_columns_are_kept() {
        let table = read(
            "grip_force_n,imprint_id,volume_mm3,image,rest,grasp,time_s,part,width_mm,session\n\
             2,a,10.5,,,g,0,ball,50,x\n4,b,,b.png,r.png,g,0.1,ball,,x\n6,c,,c.png,,,,,49,\n8,g,30,,,,5,,,y\n",
        )
        .unwrap();
        assert_eq!(table.grasps, ["g", "c", "g"], "a row without a grasp is a grasp of its own");
        assert_eq!(table.grasp, [0, 0, 1, 2]);
        assert_eq!(table.imprints[0], MeasuredImprint::VolumeMm3(10.5));
        let picture = MeasuredImprint::Image { image: "b.png".into(), rest: Some("r.png".into()) };
        assert_eq!(table.imprints[1], picture);
        assert_eq!(table.imprints[2], MeasuredImprint::Image { image: "c.png".into(), rest: None });
        assert!(table.time_s[2].is_nan() && table.time_s[1] == 0.1);
        assert_eq!((table.part[0].as_str(), table.session[3].as_str()), ("ball", "y"));
        assert_eq!(table.extra[0].0, "width_mm");
        assert_eq!(table.sha256.len(), 64);
    }

    #[test]
    fn faults_name_file_line_column_and_value() {
        for (table, part) in [
            ("imprint_id,volume_mm3\na,1\n", "no column `grip_force_n`; found: imprint_id, volume_mm3"),
            ("imprint_id,grip_force_n\na,1\n", "no column `volume_mm3`"),
            ("imprint_id,grip_force_n,volume_mm3\na,x,1\n", "line 2, `grip_force_n` is `x`"),
            ("imprint_id,grip_force_n,volume_mm3\na,1,\n", "a row needs `volume_mm3` or `image`"),
            ("imprint_id,grip_force_n,volume_mm3\na,1,NaN\n", "`volume_mm3` is `NaN`"),
            (
                "imprint_id,grip_force_n,volume_mm3\na,1,1\na,2,2\n",
                "line 3, `imprint_id` is `a`, as in a row before",
            ),
            (
                "imprint_id,grip_force_n,volume_mm3,grasp,time_s\na,1,1,g,1\nb,2,2,h,0\nc,2,2,g,1\n",
                "line 4, `time_s` is 1 after 1 in grasp `g`",
            ),
            ("imprint_id,grip_force_n,volume_mm3\n", "the table holds no rows"),
        ] {
            let error = read(table).unwrap_err().to_string();
            assert!(error.contains(part) && error.contains(IMPRINTS_FILE), "{table:?}: {error}");
        }
    }
}
