//! The columns of a press table that say in which circumstances each press was made.

use crate::diagnose::PressCovariate;
use gripgen_record::{TableError, press_table, read_press_columns, sha256_hex};
use gripgen_tactile::presses::PressSet;
use gripgen_twin::Values;
use std::path::Path;

/// Columns that are marks of the contact, not circumstances.
const MARKS: [&str; 9] =
    ["image", "x_px", "y_px", "radius_px", "depth_mm", "pull_index", "mesh", "shape", "rotation_deg"];

/// What a table says beside images and marks.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct PressColumns {
    /// Name of the image of each row.
    pub names: Vec<String>,
    /// Seconds since the first press.
    pub time_s: Option<Vec<f64>>,
    /// All other columns.
    pub covariates: Vec<PressCovariate>,
}

impl PressColumns {
    /// Takes the rows of some images out.
    pub fn leave_out(&mut self, names: &[String]) {
        let keep: Vec<bool> = self.names.iter().map(|n| !names.contains(n)).collect();
        retain(&mut self.names, &keep);
        if let Some(times) = &mut self.time_s {
            retain(times, &keep);
        }
        for covariate in &mut self.covariates {
            covariate.values = covariate.values.kept(|row| keep.get(row).copied().unwrap_or(true));
        }
    }
}

fn retain<T>(list: &mut Vec<T>, keep: &[bool]) {
    let mut at = 0;
    list.retain(|_| {
        at += 1;
        keep.get(at - 1).copied().unwrap_or(true)
    });
}

/// Reads them from the table of a folder; a `dataPack.npz` has none. A clock with gaps is a covariate only.
///
/// # Errors
/// What is wrong with the table.
pub fn load_press_columns(path: &Path) -> Result<PressColumns, TableError> {
    if press_table(path).is_none() {
        return Ok(PressColumns::default());
    }
    let table = read_press_columns(path)?;
    let mut columns = PressColumns { names: table.names, ..Default::default() };
    for (name, values) in table.columns.into_iter().filter(|(name, _)| !MARKS.contains(&name.as_str())) {
        match values {
            Values::Numbers(times) if name == "time_s" && times.iter().all(|t| t.is_finite()) => {
                let first = times.iter().fold(f64::INFINITY, |m, t| m.min(*t));
                columns.time_s = Some(times.iter().map(|t| t - first).collect());
            }
            values => columns.covariates.push(PressCovariate { name, values }),
        }
    }
    Ok(columns)
}

/// Hash of the images and marks of a set.
pub fn presses_sha256(set: &PressSet) -> String {
    let mut text = String::new();
    for press in &set.presses {
        let mark = press.circle.map_or(String::new(), |c| format!("{} {} {}", c.x_px, c.y_px, c.radius_px));
        text += &format!("{} {} {mark}\n", press.name, sha256_hex(&press.image.rgb));
    }
    sha256_hex(text.as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;
    use gripgen_record::PRESSES_FILE;

    #[test]
    fn a_gap_leaves_a_column_of_numbers_and_takes_the_clock() {
        let folder = tempfile::tempdir().unwrap();
        let load = |text: &str| {
            std::fs::write(folder.path().join(PRESSES_FILE), text).unwrap();
            load_press_columns(folder.path()).unwrap()
        };
        let whole = load("image,time_s,lamp_v,x_px\na.png,100,1.5,3\nb.png,103,,4\n");
        assert_eq!((whole.time_s, whole.covariates.len()), (Some(vec![0.0, 3.0]), 1));
        let Values::Numbers(lamp_v) = &whole.covariates[0].values else { panic!("{:?}", whole.covariates) };
        assert!(lamp_v[0] == 1.5 && lamp_v[1].is_nan(), "{lamp_v:?}");
        let mut gap = load("image,time_s,lamp\na.png,100,on\nb.png,,off\n");
        assert_eq!((gap.time_s.clone(), gap.covariates.len()), (None, 2));
        gap.leave_out(&["a.png".into()]);
        assert_eq!(gap.covariates[1].values, Values::Words(vec!["off".into()]));
    }
}
