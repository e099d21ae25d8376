//! How far the images that a twin expects are from those of measured pulls.

use crate::analysis::expect::scenario_of;
use crate::analysis::imprint::{ImageSource, ImprintImagesError, Seen, grips_tried};
use gripgen::Gripped;
use gripgen::Library;
use gripgen::in_parallel;
use gripgen::{SampleError, SimulateOptions};
use gripgen_measured::{LoadPullsError, LoadedPulls, Suspects, load_pulls_with};
use gripgen_tactile::SimdLevel;
use gripgen_tactile::metrics::{MetricError, Score, mean_score, score};
use gripgen_twin::config::{Backend, ImageNoise, Mechanics};
use gripgen_twin::{Jaw, MeasuredPull, Part, PerJaw, Scenario, TactileImage, Twin};
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// One image of a pull.
#[derive(Debug, Clone, PartialEq)]
pub struct ImageScore {
    /// The pull; of several folders with the name of its folder before it.
    pub pull: String,
    /// What was gripped.
    pub part: String,
    /// Whose camera took it.
    pub jaw: Jaw,
    /// How the twin's image differs from it.
    pub score: Score,
}

/// The images of measured pulls beside those of a twin.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImageComparison {
    /// Both images of each pull that has them, left jaw first.
    pub each: Vec<ImageScore>,
    /// What was left out and why.
    pub notes: Vec<String>,
}

impl ImageComparison {
    /// The mean over all images; `None` without any.
    pub fn mean(&self) -> Option<Score> {
        let all: Vec<Score> = self.each.iter().map(|image| image.score).collect();
        (!all.is_empty()).then(|| mean_score(&all))
    }

    /// How many images there are of each part, and the mean over them.
    pub fn by_part(&self) -> BTreeMap<String, (usize, Score)> {
        let names: BTreeSet<&str> = self.each.iter().map(|image| image.part.as_str()).collect();
        let of_part = |name: &str| {
            let own: Vec<Score> =
                self.each.iter().filter(|image| image.part == name).map(|image| image.score).collect();
            (name.to_string(), (own.len(), mean_score(&own)))
        };
        names.into_iter().map(of_part).collect()
    }
}

/// Why images of measured pulls could not be compared.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CompareImagesError {
    /// The images.
    #[error(transparent)]
    Images(#[from] ImprintImagesError),
    /// One of several folders.
    #[error(transparent)]
    Pulls(#[from] LoadPullsError),
}

/// Draws the images that a twin expects of the pulls in `folders`, and compares them with those that were taken. `loaded` is what
/// [`load_pulls_with`] read from these folders with `suspects`, `library` holds the files of the twin.
///
/// An expected image has no sensor noise, and no gain that differs from grip to grip. A pull whose grip nobody wrote down is drawn
/// in each grip of its part, and the one that is most alike counts. Pulls that the twin cannot draw, and those with images of another
/// size than its sensor's, are left out with a note.
///
/// # Errors
///
/// Images that cannot be read.
pub fn compare_images(
    folders: &[&Path],
    loaded: &LoadedPulls,
    suspects: Suspects,
    twin: &Twin,
    library: &Library,
    jobs: usize,
) -> Result<ImageComparison, CompareImagesError> {
    let mut still = twin.clone();
    for jaw in Jaw::BOTH {
        still.optics[jaw].image_noise = ImageNoise::Off;
    }
    for effect in &mut still.effects {
        effect.values = effect.spec.without_scatter(&effect.values);
    }
    let mut found = ImageComparison::default();
    for &folder in folders {
        let source = ImageSource::open(folder)?;
        if folders.len() == 1 {
            compare_folder(&source, loaded, "", &still, library, jobs, &mut found)?;
        } else {
            // Pulls of several folders are renamed where their ids are the same: each folder is read by itself.
            let own = load_pulls_with(&[folder], suspects)?;
            let name = folder.file_name().map_or_else(String::new, |n| format!("{}/", n.to_string_lossy()));
            compare_folder(&source, &own, &name, &still, library, jobs, &mut found)?;
        }
    }
    Ok(found)
}

/// What became of the images of a pull.
enum Compared {
    Scored(PerJaw<Score>),
    /// The twin cannot draw it.
    Undrawn(SampleError),
    /// Its images cannot be compared.
    Unlike(MetricError),
    /// There are none.
    Nothing,
}

fn compare_folder(
    source: &ImageSource,
    loaded: &LoadedPulls,
    name: &str,
    twin: &Twin,
    library: &Library,
    jobs: usize,
    found: &mut ImageComparison,
) -> Result<(), ImprintImagesError> {
    let pulls: Vec<&MeasuredPull> = loaded
        .pulls
        .pulls
        .iter()
        .filter(|p| source.has(&p.id) && twin.parts.get(&p.part).is_some_and(Part::has_geometry))
        .collect();
    let compared = in_parallel(pulls.len(), jobs, |i| match source.read(&pulls[i].id) {
        Ok(seen) => Ok(compare_pull(pulls[i], &seen, twin, library)),
        Err(ImprintImagesError::None { .. }) => Ok(Compared::Nothing),
        Err(e) => Err(e),
    });
    let mut left_out: BTreeMap<&str, (usize, String)> = BTreeMap::new();
    for (pull, compared) in pulls.iter().zip(compared) {
        let id = format!("{name}{}", pull.id);
        let (why, what) = match compared? {
            Compared::Nothing => continue,
            Compared::Scored(scores) => {
                let each = Jaw::BOTH.map(|jaw| ImageScore {
                    pull: id.clone(),
                    part: pull.part.clone(),
                    jaw,
                    score: scores[jaw],
                });
                found.each.extend(each);
                continue;
            }
            Compared::Undrawn(e) => ("the twin cannot draw their grips", e.to_string()),
            Compared::Unlike(e) => ("they are not those of the twin's sensor", e.to_string()),
        };
        left_out.entry(why).or_insert_with(|| (0, format!("pull {id}: {what}"))).0 += 1;
    }
    let note = |(why, (n, first)): (&str, (usize, String))| {
        format!("images of {n} pulls were left out: {why}; {first}")
    };
    found.notes.extend(left_out.into_iter().map(note));
    Ok(())
}

fn compare_pull(pull: &MeasuredPull, seen: &Seen, twin: &Twin, library: &Library) -> Compared {
    let mut best: Option<PerJaw<Score>> = None;
    for grip_pose in grips_tried(pull, seen.grip_pose, twin.parts[&pull.part].grips.len()) {
        // Neither the rule of the label nor the stop changes an image.
        let scenario = Scenario { grip_pose, ..scenario_of(pull, 5e-3, 3.0) };
        let drawn = match expected_images(twin, library, scenario) {
            Ok(drawn) => drawn,
            Err(e) => return Compared::Undrawn(e),
        };
        let scores = match PerJaw::try_from_fn(|jaw| score(&drawn[jaw], &seen.grip[jaw])) {
            Ok(scores) => scores,
            Err(e) => return Compared::Unlike(e),
        };
        let both = |scores: &PerJaw<Score>| scores.left.mse + scores.right.mse;
        if best.as_ref().is_none_or(|best| both(&scores) < both(best)) {
            best = Some(scores);
        }
    }
    best.map_or(Compared::Nothing, Compared::Scored)
}

/// What the cameras of a twin without noise see of a grip. Jaws that miss the part in the twin hold it as in its middle: what was
/// measured had contact.
fn expected_images(
    twin: &Twin,
    library: &Library,
    mut scenario: Scenario,
) -> Result<PerJaw<TactileImage>, SampleError> {
    let options = SimulateOptions {
        mechanics: Mechanics::Reduced,
        images: true,
        noise: true,
        trace: false,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    };
    let mut gripped = Gripped::new(twin, library, &scenario, options)?;
    if gripped.contact.is_none() {
        (scenario.covariates.grip_offset_m, scenario.covariates.grip_angle_rad) = (0.0, 0.0);
        gripped = Gripped::new(twin, library, &scenario, options)?;
    }
    gripped.contact.as_ref().ok_or(SampleError::Missed)?;
    gripped.images(twin, &scenario, true, None)
}
