//! Imprint constants c of `V = c F` from the tactile images of measured pulls: the press that the twin makes is compared
//! with what the cameras saw.

mod images;
mod press;

use crate::analysis::twin_edits::{EditedValue, calibration_entry};
use gripgen::Location;
use gripgen::SampleError;
use gripgen::{LoadError, Project};
use gripgen_identify::{FittedPress, ImprintEstimate, imprint_constant};
use gripgen_twin::config::GelModel;
use gripgen_twin::{Jaw, MeasuredPull, MeasuredPulls};
pub(crate) use images::ImageSource;
pub use images::ImprintImagesError;
use press::fit_press;
pub(crate) use press::{Seen, grips_tried};
use std::collections::BTreeMap;
use std::path::Path;

/// Pulls of a part that are looked at, spread evenly over their grip forces.
const MAX_PULLS: usize = 24;
/// Share of the change in the images that the twin has to explain for a press to count.
const MIN_EXPLAINED: f64 = 0.3;

/// The imprint constant of a part.
#[derive(Debug, Clone, PartialEq)]
pub struct ImprintCalibration {
    /// The part.
    pub part: String,
    /// Its constant and exponent.
    pub estimate: ImprintEstimate,
    /// Pulls with images that were used.
    pub pulls: usize,
    /// Mean share of the change in the images (its variance over pixels) that the press explains.
    pub explained: f64,
}

/// Imprint constants, and remarks for people.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct ImprintCalibrations {
    /// One for each part with enough images.
    pub parts: Vec<ImprintCalibration>,
    /// What was left out and why.
    pub notes: Vec<String>,
}

/// Why imprint constants could not be fitted.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrateImprintsError {
    /// The images.
    #[error(transparent)]
    Images(#[from] ImprintImagesError),
    /// The twin, or a file that it names.
    #[error(transparent)]
    Load(#[from] LoadError),
    /// The grip of the twin.
    #[error("pull `{pull}`: {source}")]
    Grip {
        /// The pull.
        pull: String,
        /// What is wrong.
        source: Box<SampleError>,
    },
    /// Images of another size than the sensor's.
    #[error("pull `{pull}`: its images are {}x{} pixels, the sensor of the twin has {}x{}", .found.0, .found.1, .wanted.0, .wanted.1)]
    Size {
        /// The pull.
        pull: String,
        /// Width and height of the image.
        found: (u32, u32),
        /// Those of the sensor.
        wanted: (u32, u32),
    },
}

impl ImprintCalibrations {
    /// What changes in the twin.
    pub fn values(&self, measured: &MeasuredPulls) -> Vec<EditedValue> {
        let value = |found: &ImprintCalibration| {
            let c = &found.estimate.imprint_mm3_per_n;
            let evidence = format!("gripgen calibrate pulls, images of {} pulls", found.pulls);
            EditedValue {
                key: format!("parts.{}.imprint_mm3_per_n", found.part),
                value: c.value,
                calibration: Some(calibration_entry(c, &evidence, &measured.sha256)),
            }
        };
        self.parts.iter().map(value).collect()
    }
}

/// Fits the imprint constant of every part with images in `folder`, the folder that `measured` was read from. Effects of the
/// twin are left aside: c is that of `V = c F` with the commanded force. Parts without images are left as they are.
///
/// # Errors
///
/// Images or a twin that cannot be loaded, a grip that fails, or images of another size than those of the sensor.
pub fn calibrate_imprints(
    folder: &Path,
    measured: &MeasuredPulls,
    twin: &Location,
    sets: &[(String, String)],
) -> Result<ImprintCalibrations, CalibrateImprintsError> {
    let mut found = ImprintCalibrations::default();
    let source = ImageSource::open(folder)?;
    let mut of_part: BTreeMap<&str, Vec<&MeasuredPull>> = BTreeMap::new();
    for pull in measured.pulls.iter().filter(|p| source.has(&p.id)) {
        of_part.entry(&pull.part).or_default().push(pull);
    }
    if of_part.is_empty() {
        return Ok(found);
    }
    let parts: Vec<&str> = of_part.keys().copied().collect();
    let Project { twin, library, .. } = Project::of_twin(twin, &parts, true, sets)?;
    if Jaw::BOTH.iter().any(|&jaw| twin.gel[jaw].model != GelModel::Pyramid) {
        found.notes.push("the elastic gel has no imprint constant: images were not looked at".into());
        return Ok(found);
    }
    let mut plain = twin;
    plain.effects.clear();
    plain.tables.clear();
    plain.surfaces.clear();
    for (part, mut pulls) in of_part {
        pulls.sort_by(|a, b| a.grip_force_n.total_cmp(&b.grip_force_n).then_with(|| a.id.cmp(&b.id)));
        let step = pulls.len().div_ceil(MAX_PULLS).max(1);
        let (mut presses, mut explained, mut strange) = (Vec::new(), 0.0, Vec::new());
        for pull in pulls.into_iter().step_by(step) {
            let images = source.read(&pull.id)?;
            let best = fit_press(&plain, &library, pull, &images)?;
            match best.filter(|b| b.explained >= MIN_EXPLAINED) {
                Some(best) => {
                    explained += best.explained;
                    let imprint_mm3_per_n = best.imprint_mm3_per_n;
                    presses.push(FittedPress { force_n: pull.grip_force_n, imprint_mm3_per_n });
                }
                None => strange.push(pull.id.as_str()),
            }
        }
        if !strange.is_empty() {
            let shown = strange[..strange.len().min(5)].join(", ");
            found.notes.push(format!(
                "images of {} pulls of {part} do not look like its grips in the twin and were left out: {shown}",
                strange.len()
            ));
        }
        match imprint_constant(&presses) {
            Some(estimate) => {
                let (pulls, part) = (presses.len(), part.to_string());
                found.parts.push(ImprintCalibration {
                    part,
                    estimate,
                    pulls,
                    explained: explained / pulls as f64,
                });
            }
            None => found.notes.push(format!(
                "the imprint constant of {part} was not fitted: {} pulls with images, 2 are needed",
                presses.len()
            )),
        }
    }
    Ok(found)
}
