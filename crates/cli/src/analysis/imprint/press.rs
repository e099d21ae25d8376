//! One press: the imprint constant with which the twin's images are most like those of a pull.

use super::CalibrateImprintsError;
use crate::analysis::expect::scenario_of;
use gripgen::Library;
use gripgen::{Gripped, placed_parts};
use gripgen::{SampleError, SimulateOptions};
use gripgen_tactile::{Plane, Renderer, SimdLevel};
use gripgen_twin::config::{Backend, Mechanics};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{MeasuredPull, PerJaw, Scenario, TactileImage, Twin};
use std::ops::Range;

/// Constants tried before the best is refined, mm^3/N.
const TRIED_MM3_PER_N: [f64; 11] = [0.1, 0.16, 0.25, 0.4, 0.63, 1.0, 1.6, 2.5, 4.0, 6.3, 10.0];
/// Relative width at which a constant is refined no further.
const REFINED: f64 = 2e-3;

/// Images of a pull: gripped and, where there are, at rest.
pub(crate) struct Seen {
    pub(crate) grip: PerJaw<TactileImage>,
    pub(super) rest: PerJaw<Option<TactileImage>>,
    /// Which of the part's grips, where that is known.
    pub(crate) grip_pose: Option<usize>,
}

/// The constant that explains the images of a pull best.
pub(super) struct BestPress {
    pub(super) imprint_mm3_per_n: f64,
    /// One less the unexplained share of the change.
    pub(super) explained: f64,
}

/// The grips that a pull may have been made with, of so many of its part: the one that is named, or all.
pub(crate) fn grips_tried(pull: &MeasuredPull, known: Option<usize>, grips: usize) -> Range<usize> {
    let named = match pull.covariates.extra.get("grip_pose") {
        Some(Drawn::Number(x)) => Some(*x as usize),
        _ => known,
    };
    named.filter(|&i| i < grips).map_or(0..grips, |i| i..i + 1)
}

/// The part's grips are tried where none is named; `None` if the twin does not touch the part, or nothing changes in the images.
pub(super) fn fit_press(
    twin: &Twin,
    library: &Library,
    pull: &MeasuredPull,
    images: &Seen,
) -> Result<Option<BestPress>, CalibrateImprintsError> {
    let poses = grips_tried(pull, images.grip_pose, twin.parts[&pull.part].grips.len());
    let mut best: Option<BestPress> = None;
    for pose in poses {
        let found = fit_grip(twin, library, pull, pose, images)?;
        if found.as_ref().is_some_and(|f| best.as_ref().is_none_or(|b| f.explained > b.explained)) {
            best = found;
        }
    }
    Ok(best)
}

fn fit_grip(
    twin: &Twin,
    library: &Library,
    pull: &MeasuredPull,
    grip_pose: usize,
    images: &Seen,
) -> Result<Option<BestPress>, CalibrateImprintsError> {
    let at =
        |source: SampleError| CalibrateImprintsError::Grip { pull: pull.id.clone(), source: source.into() };
    // Neither the rule of the label nor the stop is looked at.
    let scenario = Scenario { grip_pose, ..scenario_of(pull, 5e-3, 3.0) };
    // The grip does not depend on the constant; the smallest one presses through no gel.
    let mut soft = twin.clone();
    let part = soft.parts.get_mut(&pull.part).expect("asked for parts of the twin");
    part.imprint_m3_per_n = TRIED_MM3_PER_N[0] * 1e-9;
    let gripped = match Gripped::new(&soft, library, &scenario, options()) {
        Ok(gripped) => gripped,
        // Already too deep: nothing of this pull can be fitted.
        Err(SampleError::Indent { .. }) => return Ok(None),
        Err(e) => return Err(at(e)),
    };
    let Some(contact) = &gripped.contact else { return Ok(None) };
    let placed =
        placed_parts(&soft, library, &scenario, &contact.force_n, &contact.held.grasp).map_err(at)?;
    let mesh = library.clustered_mesh(&twin.parts[&pull.part]).map_err(|e| at(e.into()))?;
    let seen = PerJaw::try_from_fn(|jaw| {
        let grid = &gripped.sensors[jaw].grid;
        let wanted = (grid.width_px as u32, grid.height_px as u32);
        let sizes = [Some(&images.grip[jaw]), images.rest[jaw].as_ref()];
        match sizes.into_iter().flatten().map(|i| (i.width_px, i.height_px)).find(|&size| size != wanted) {
            Some(found) => Err(CalibrateImprintsError::Size { pull: pull.id.clone(), found, wanted }),
            None => Ok(targets(&images.grip[jaw], images.rest[jaw].as_ref(), &gripped.sensors[jaw].rest)),
        }
    })?;
    // Least unexplained variance over the rest frames at hand, as a share of the change, mean of both jaws.
    let unexplained = |c_mm3_per_n: f64| -> f64 {
        let shares = PerJaw::from_fn(|jaw| {
            let renderer =
                Renderer { sensor: &gripped.sensors[jaw], gel: &twin.gel[jaw], level: options().level };
            let pressed =
                renderer.press(&mesh, &placed[jaw].gel_from_mesh, c_mm3_per_n * 1e-9, placed[jaw].force_n);
            let Ok(imprint) = pressed else { return f64::INFINITY };
            let change = renderer.change(&imprint);
            seen[jaw].iter().map(|target| target.unexplained(&change)).fold(f64::INFINITY, f64::min)
        });
        0.5 * (shares.left + shares.right)
    };
    let tried: Vec<f64> = TRIED_MM3_PER_N.iter().map(|&c| unexplained(c)).collect();
    let Some(k) =
        (0..tried.len()).filter(|&k| tried[k].is_finite()).min_by(|&a, &b| tried[a].total_cmp(&tried[b]))
    else {
        return Ok(None);
    };
    let (low, high) = (TRIED_MM3_PER_N[k.saturating_sub(1)], TRIED_MM3_PER_N[(k + 1).min(tried.len() - 1)]);
    let (c, left) = least(libm::log(low), libm::log(high), |ln_c| unexplained(libm::exp(ln_c)));
    Ok(Some(BestPress { imprint_mm3_per_n: libm::exp(c), explained: 1.0 - left }))
}

fn options() -> SimulateOptions {
    SimulateOptions {
        mechanics: Mechanics::Reduced,
        images: false,
        noise: true,
        trace: false,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    }
}

/// What a camera saw, and a rest frame that it may have had.
struct Target {
    grip: [Vec<f32>; 3],
    rest: [Vec<f32>; 3],
}

impl Target {
    /// Share of the variance that a change leaves unexplained; the camera ends at 0 and 255.
    fn unexplained(&self, change: &[Plane; 3]) -> f64 {
        let (mut left, mut all) = (0.0, 0.0);
        for c in 0..3 {
            let pixels = || self.grip[c].iter().zip(&self.rest[c]);
            all += variance(pixels().map(|(grip, rest)| grip - rest));
            let seen = pixels().zip(&change[c].values);
            left += variance(seen.map(|((grip, rest), change)| grip - (rest + change).clamp(0.0, 255.0)));
        }
        left / all.max(1e-9)
    }
}

/// One target for each rest frame at hand: that of the pull and that of the sensor file.
fn targets(grip: &TactileImage, rest: Option<&TactileImage>, of_file: &[Vec<f32>; 3]) -> Vec<Target> {
    let planes = |image: &TactileImage| {
        [0, 1, 2].map(|c| image.rgb.iter().skip(c).step_by(3).map(|&v| f32::from(v)).collect::<Vec<f32>>())
    };
    let rests = rest.map(planes).into_iter().chain([of_file.clone()]);
    rests.map(|rest| Target { grip: planes(grip), rest }).collect()
}

/// Variance over pixels: an offset of the whole frame does not count.
fn variance(values: impl Iterator<Item = f32> + Clone) -> f64 {
    let (mut n, mut sum, mut squares) = (0.0_f64, 0.0_f64, 0.0_f64);
    for v in values {
        let v = f64::from(v);
        n += 1.0;
        sum += v;
        squares += v * v;
    }
    (squares - sum * sum / n.max(1.0)) / n.max(1.0)
}

/// Golden section search (Kiefer 1953) on `low..high`: place and value of the least found.
fn least(mut low: f64, mut high: f64, of: impl Fn(f64) -> f64) -> (f64, f64) {
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    let mut inner = [high - golden * (high - low), low + golden * (high - low)];
    let mut value = inner.map(&of);
    while high - low > REFINED {
        if value[0] <= value[1] {
            high = inner[1];
            inner = [high - golden * (high - low), inner[0]];
            value = [of(inner[0]), value[0]];
        } else {
            low = inner[0];
            inner = [inner[1], low + golden * (high - low)];
            value = [value[1], of(inner[1])];
        }
    }
    if value[0] <= value[1] { (inner[0], value[0]) } else { (inner[1], value[1]) }
}
