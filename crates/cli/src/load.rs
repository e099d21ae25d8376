//! What verbs read before they begin: twins, their files, measurements.

use crate::analysis::before_data;
use crate::args::TalkArgs;
use crate::commands::rig::load_rig;
use crate::failure::Failure;
use crate::shell;
use crate::{
    FoundCircles, LoadPressesError, LoadSensorError, OwnParts, PressGeometry, jaws_of_grip_force,
    load_presses, load_sensor, load_twin_sensor, own_parts,
};
use gripgen::tactile::Sensor;
use gripgen::tactile::presses::{PressSet, RestDoubt, rest_doubt};
use gripgen::twin::Twin;
use gripgen::{Library, Location, load_twin_document};
use gripgen_measured::{LoadPullsError, LoadedPulls, Suspects, is_pulls, jpeg_presses, load_pulls_with};
use std::collections::HashSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The twin that a verb starts from.
pub fn load_twin(path: &str, sets: &[(String, String)]) -> Result<Twin, Failure> {
    let document = load_twin_document(&Location::parse(path), sets)?;
    let file = document.read_twin().map_err(|e| Failure::from(document.located(e)))?;
    Twin::new(&file).map_err(|e| Failure::from(document.located(e)))
}

/// The files that the grips of a twin need. `path` is the twin's own.
pub fn load_library(twin: &Twin, path: &str) -> Result<Library, Failure> {
    let unread = |e| Failure::usage(e).hint("paths in a twin are relative to its file");
    Library::of_twin(twin, &Location::parse(path)).map_err(unread)
}

/// The twin that pulls are held against.
pub struct TwinOfPulls<'a> {
    /// Its file.
    pub path: &'a str,
    /// Overrides.
    pub sets: &'a [(String, String)],
    /// The rig whose gripper limits it.
    pub rig: Option<&'a str>,
}

impl TwinOfPulls<'_> {
    /// The twin with the parts of the pulls, those that it lacks made from their labels, and its files. What people have to know of the
    /// parts and of the grip forces is returned with them.
    pub fn for_pulls(&self, loaded: &mut LoadedPulls) -> Result<(Twin, Library, OwnParts), Failure> {
        self.with(self.sets, loaded)
    }

    /// The same for a fit: what was fitted to these pulls before has the value that stood there first, so that they count once.
    pub fn for_fit(&self, loaded: &mut LoadedPulls) -> Result<(Twin, Library, OwnParts), Failure> {
        let document = load_twin_document(&Location::parse(self.path), self.sets)?;
        let first = before_data(&document, &loaded.pulls.sha256);
        self.with(&[&first[..], self.sets].concat(), loaded)
    }

    fn with(
        &self,
        sets: &[(String, String)],
        loaded: &mut LoadedPulls,
    ) -> Result<(Twin, Library, OwnParts), Failure> {
        let twin = load_twin(self.path, sets)?;
        let mut own = own_parts(&mut loaded.pulls, &twin);
        let twin = match own.sets.is_empty() {
            true => twin,
            false => load_twin(self.path, &[sets, &own.sets].concat())?,
        };
        own.notes.extend(jaws_of_grip_force(&loaded.pulls, &twin, &own));
        let mut twin = within_rig(twin, self.rig)?;
        if self.rig.is_none() {
            // No plan asks for more than what the gripper of the lab has shown.
            let strongest_n = loaded.pulls.pulls.iter().map(|pull| pull.grip_force_n).fold(0.0, f64::max);
            twin.gripper.max_force_n = twin.gripper.max_force_n.min(strongest_n);
        }
        let library = load_library(&twin, self.path)?;
        Ok((twin, library, own))
    }
}

/// The twin with no more grip force than the gripper of a rig has.
pub fn within_rig(mut twin: Twin, rig: Option<&str>) -> Result<Twin, Failure> {
    if let Some(rig) = rig {
        let [_, max_n] = load_rig(rig, &[])?.gripper.force_per_jaw_n;
        twin.gripper.max_force_n = twin.gripper.max_force_n.min(max_n);
    }
    Ok(twin)
}

/// Refuses measurements that are not there.
pub fn there_is(measured: &Path) -> Result<(), Failure> {
    if measured.exists() {
        return Ok(());
    }
    Err(Failure::usage(format!("{}: there is no such file or folder", measured.display())))
}

/// Worker threads.
pub fn jobs() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// What becomes of suspect labels: what an effect of sensor or robot does to many pulls is no reason to leave them out.
pub fn suspects(include: bool) -> Suspects {
    if include { Suspects::Include } else { Suspects::Screen }
}

/// What measurements are.
const MEASUREMENTS: &str = "measurements are a folder with pulls.csv, sensor.csv, presses.csv or imprints.csv, a run folder, or a dataPack.npz";

/// What cannot be read as pulls.
pub fn no_pulls(paths: &[&Path], e: &LoadPullsError) -> Failure {
    if let (LoadPullsError::Bag { .. }, Some(hint)) = (e, e.hint()) {
        return Failure::usage(e).hint(hint);
    }
    let table = |path: &&&Path| {
        path.is_file() && path.extension().is_some_and(|end| OF_TABLES.iter().any(|e| end == *e))
    };
    if let Some(file) = paths.iter().find(table) {
        return a_file(file);
    }
    let known = paths.iter().all(|path| is_pulls(path));
    Failure::usage(e).hint_if(if known { e.hint() } else { Some(MEASUREMENTS) })
}

/// Ends of their names.
const OF_TABLES: [&str; 3] = ["csv", "toml", "json"];

/// Files of a folder of measurements that people name in its place.
const OF_A_FOLDER: [&str; 6] =
    ["pulls.csv", "sensor.csv", "presses.csv", "imprints.csv", "campaign.toml", "run.json"];

/// A file where a folder of measurements is wanted.
fn a_file(path: &Path) -> Failure {
    let folder = path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."));
    let name = path.file_name().map_or_else(String::new, |name| name.to_string_lossy().into_owned());
    let hint = match (OF_A_FOLDER.contains(&name.as_str()), name.ends_with(".csv")) {
        (true, _) => format!("name its folder: {}", shell::path(folder)),
        (false, true) => {
            "a table of pulls has the name pulls.csv in a folder of its own; name the folder".into()
        }
        (false, false) => MEASUREMENTS.into(),
    };
    Failure::usage(format!("{}: this is a file, the folder of the measurements is wanted", path.display()))
        .hint(hint)
}

/// The pulls that a twin is to be fitted to. What people have to know of them is said; labels that no gel gives are refused, but
/// those of a wrong unit not by who `answers` for them, as a diagnosis does.
pub fn load_pulls_to_fit(
    paths: &[&Path],
    suspects: Suspects,
    talk: &TalkArgs,
    answers: bool,
) -> Result<LoadedPulls, Failure> {
    each_once(paths)?;
    let mut loaded = load_pulls_with(paths, suspects).map_err(|e| no_pulls(paths, &e))?;
    let refused = loaded.implausible.take_if(|e| e.unanswerable || !answers);
    say_warnings(&loaded, talk);
    match refused {
        Some(e) => Err(Failure::usage(&e).hint(&e.hint)),
        None => Ok(loaded),
    }
}

/// A folder that is named twice would be evidence twice.
fn each_once(paths: &[&Path]) -> Result<(), Failure> {
    let mut seen = HashSet::new();
    // What is not there is said by who reads it.
    let again = paths.iter().find(|path| path.canonicalize().is_ok_and(|path| !seen.insert(path)));
    again.map_or(Ok(()), |path| {
        let said = format!("{} is named twice: the same pulls are no further evidence", path.display());
        Err(Failure::usage(said).hint("name each folder once; --also adds others"))
    })
}

/// Says what people have to know of pulls that were loaded: the one way of it to the terminal.
pub fn say_warnings(loaded: &LoadedPulls, talk: &TalkArgs) {
    if talk.quiet {
        return;
    }
    loaded.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    if let Some(implausible) = &loaded.implausible {
        eprintln!("warning: {implausible} ({})", implausible.hint);
    }
}

/// Folders that are read as one campaign.
pub fn folders<'a>(measured: &'a Path, also: &'a [PathBuf]) -> Vec<&'a Path> {
    std::iter::once(measured).chain(also.iter().map(PathBuf::as_path)).collect()
}

/// Takes a frame without contact that contradicts the presses away, and says so.
pub fn drop_doubtful_rest(path: &Path, set: &mut PressSet, talk: &TalkArgs) -> Option<RestDoubt> {
    let doubt = rest_doubt(set)?;
    set.rest = None;
    if !talk.quiet {
        eprintln!(
            "warning: {}: the frame without contact is {:.0} grey levels from the presses where nothing touches, they are {:.0} from each \
             other: it is not used; take a new one with the same sensor, light and camera settings, or leave it out",
            path.display(),
            doubt.differs,
            doubt.presses_differ
        );
    }
    Some(doubt)
}

/// The images of a press folder that are JPEGs; says what that means.
pub fn note_jpegs(path: &Path, talk: &TalkArgs) -> Vec<String> {
    // What cannot be read was refused before; a `dataPack.npz` holds pixels.
    let (jpegs, count) = jpeg_presses(path).unwrap_or_default();
    if !jpegs.is_empty() && !talk.quiet {
        eprintln!(
            "warning: {}: {} of {count} images are JPEGs: errors against them look smaller than they are (by some 5 %), and noise that is \
             read from them is too low; take frames as PNG",
            path.display(),
            jpegs.len()
        );
    }
    jpegs
}

/// Says which contacts were not marked.
pub fn say_circles(circles: &FoundCircles, talk: &TalkArgs) {
    if talk.quiet {
        return;
    }
    if !circles.found.is_empty() {
        eprintln!("note: nobody marked the contact of {} presses, it was looked for", circles.found.len());
    }
    if !circles.without_contact.is_empty() {
        eprintln!("warning: no contact is visible in {}; left out", circles.without_contact.join(", "));
    }
}

/// What cannot be read as presses; `geometry`: what to do where sizes are missing.
pub fn no_presses(e: &LoadPressesError, geometry: &str) -> Failure {
    let hint = match e {
        LoadPressesError::Geometry { .. } => Some(geometry),
        other => other.hint(),
    };
    Failure::usage(e).hint_if(hint)
}

/// The sensor file of `--sensor`, or the twin's, and presses that have its size.
pub fn load_sensor_and_presses(
    measured: &Path,
    sensor: Option<&str>,
    twin: &str,
) -> Result<(Arc<Sensor>, PressSet), Failure> {
    let sensor = match sensor {
        Some(path) => load_sensor(&Location::parse(path)),
        None => load_twin_sensor(&Location::parse(twin)),
    };
    let sensor = sensor.map_err(|e| match e {
        LoadSensorError::Twin(e) => Failure::from(e),
        other => Failure::usage(other).hint("`gripgen calibrate presses` writes a sensor file for --sensor"),
    })?;
    let geometry = PressGeometry { ball_m: sensor.ball_m, metres_per_px: Some(sensor.grid.metres_per_px) };
    let set = load_presses(measured, geometry).map_err(|e| {
        no_presses(&e, "a sensor file of `gripgen calibrate presses` holds both; name it with --sensor")
    })?;
    if let Some(press) = set.presses.first() {
        let (found, wanted) =
            ((press.image.width_px, press.image.height_px), (sensor.grid.width_px, sensor.grid.height_px));
        if (found.0 as usize, found.1 as usize) != wanted {
            let sizes = format!("{}x{} pixels, the sensor has {}x{}", found.0, found.1, wanted.0, wanted.1);
            return Err(Failure::usage(format!("{}: the images are {sizes}", measured.display()))
                .hint("name the sensor file that belongs to these presses with --sensor"));
        }
    }
    Ok((sensor, set))
}
