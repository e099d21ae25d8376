//! A part at a glance: grips that were tried, what the gels see of each, how much it is expected to hold, and what would fail.

mod holding;

use crate::analysis::{LoadSensorError, load_sensor};
use crate::part::init::{
    ANGLES_DEG, HIGHEST_N, InitError, MU, PART, PartOptions, Searched, Trial, TrialCell, baseline, search,
};
use gripgen::Gripped;
use gripgen::Location;
use gripgen::{SampleError, SimulateOptions};
use gripgen::{pull_gripped, start_pull};
use gripgen_report::{FrictionRange, GripTried, TriedPart, WorksAt};
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::{Backend, ImageNoise, Mechanics};
use gripgen_twin::{Covariates, Jaw, LARGEST_MU, PullSettings, Scenario, Twin};
use holding::{friction_measured, friction_of_any_part, holding};
use std::collections::BTreeMap;
use std::path::Path;

/// Force of a jaw at which images are made where nobody says one.
const IMAGE_FORCE_N: f64 = 20.0;

/// What is asked of a part beside its mesh.
#[derive(Debug, Clone, PartialEq)]
pub struct TryOptions {
    /// How the mesh is read.
    pub part: PartOptions,
    /// One of the grips found, counted from 0; all of them where it is left out.
    pub grip: Option<usize>,
    /// Force of a jaw at which images are made.
    pub force_n: Option<f64>,
    /// A sensor file that stands in for the shipped one, in both jaws.
    pub sensor: Option<String>,
}

/// Why a part could not be tried.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TryPartError {
    /// The mesh, or no grip on it.
    #[error(transparent)]
    Init(#[from] InitError),
    /// The sensor file.
    #[error(transparent)]
    Sensor(#[from] LoadSensorError),
    /// A grip that was not found.
    #[error("there is no grip {asked}: {found} were found, counted from 0")]
    NoSuchGrip {
        /// The one asked for.
        asked: usize,
        /// How many there are.
        found: usize,
    },
    /// A grip fails at the force that was asked for.
    #[error("grip {grip_pose} fails at {force_n} N: {source}")]
    Fails {
        /// The grip.
        grip_pose: usize,
        /// Force of a jaw.
        force_n: f64,
        /// Why.
        source: SampleError,
    },
    /// More friction than a part of a twin may have.
    #[error("mu = {asked} is asked for, a part of a twin has at most {most}")]
    Friction {
        /// The friction coefficient asked for.
        asked: f64,
        /// The largest of a twin.
        most: f64,
    },
    /// More than the gripper has.
    #[error("{asked_n} N are asked for, a jaw of the gripper has at most {most_n} N")]
    Force {
        /// The force asked for.
        asked_n: f64,
        /// The gripper's largest.
        most_n: f64,
    },
}

/// Tries the mesh file at `path`. The result depends on the mesh and the options alone, not on the number of threads.
///
/// # Errors
///
/// A file that is no mesh, a part without a grip, a grip or a force that is asked for and is not there, a sensor file.
pub fn try_part(path: &Path, options: &TryOptions) -> Result<TriedPart, TryPartError> {
    let rig = rig(options.sensor.as_deref())?;
    if let Some(asked_n) = options.force_n.filter(|&n| n > rig.gripper.max_force_n) {
        return Err(TryPartError::Force { asked_n, most_n: rig.gripper.max_force_n });
    }
    if let Some(asked) = options.part.mu.filter(|&mu| mu > LARGEST_MU) {
        return Err(TryPartError::Friction { asked, most: LARGEST_MU });
    }
    let searched = search(path, options.part, rig)?;
    let found = searched.proposed.grips.len();
    let chosen = match options.grip {
        Some(asked) if asked >= found => return Err(TryPartError::NoSuchGrip { asked, found }),
        Some(one) => vec![one],
        None => (0..found).collect(),
    };
    let mu = options.part.mu.map_or_else(friction_of_any_part, friction_measured);
    let grips: Result<Vec<GripTried>, TryPartError> =
        chosen.into_iter().map(|grip| try_grip(&searched, grip, options, mu)).collect();
    let varied = &searched.proposed.varied;
    let angles: Vec<String> = varied.grip_angle_deg.iter().map(f64::to_string).collect();
    Ok(TriedPart {
        mu,
        friction: friction_words(mu),
        varies: format!(
            "{} to {} N of a jaw, offsets with a deviation of {} mm, angles of {} degrees",
            varied.grip_force_n.0,
            varied.grip_force_n.1,
            varied.grip_offset_sd_mm,
            angles.join(", ")
        ),
        grips: grips?,
        tried: searched.proposed.tried,
        found,
        name: searched.name,
        size_mm: searched.size_mm,
        mesh_words: searched.mesh_words,
        mesh: searched.mesh,
    })
}

/// The baseline rig without noise, with the sensor that was named.
fn rig(sensor: Option<&str>) -> Result<Twin, TryPartError> {
    let mut twin = baseline();
    for jaw in Jaw::BOTH {
        twin.optics[jaw].image_noise = ImageNoise::Off;
    }
    twin.wrist.noise_n = 0.0;
    if let Some(path) = sensor {
        load_sensor(&Location::parse(path))?;
        for jaw in Jaw::BOTH {
            twin.optics[jaw].sensor = path.into();
        }
    }
    Ok(twin)
}

fn try_grip(
    searched: &Searched,
    grip_pose: usize,
    options: &TryOptions,
    mu: FrictionRange,
) -> Result<GripTried, TryPartError> {
    let trial = &searched.proposed.trials[grip_pose];
    let in_the_middle = trial.cells.iter().find(|c| c.angle_deg == 0.0 && c.offset_mm == 0.0);
    let works_n = in_the_middle.map_or(IMAGE_FORCE_N, |cell| cell.largest_n);
    let force_n = options.force_n.unwrap_or(IMAGE_FORCE_N.min(works_n.max(5.0)));
    let (twin, library) = (&searched.twin, &searched.library);
    let images = start_pull(twin, library, &scenario(grip_pose, force_n), simulate_options(true))
        .map_err(|source| TryPartError::Fails { grip_pose, force_n, source })?
        .images
        .ok_or(TryPartError::Fails { grip_pose, force_n, source: SampleError::Missed })?;
    let pulls = |force_n: f64, mu: [f64; 3]| {
        let (scenario, options) = (scenario(grip_pose, force_n), simulate_options(false));
        // Friction changes nothing of the grip.
        let gripped = Gripped::new(twin, library, &scenario, options)?;
        let pull = |mu: f64| {
            let mut twin = twin.clone();
            twin.parts.values_mut().for_each(|part| part.mu = mu);
            pull_gripped(&twin, &scenario, &gripped, options)
        };
        Ok([pull(mu[0])?, pull(mu[1])?, pull(mu[2])?])
    };
    Ok(GripTried {
        grip_pose,
        proposal: searched.proposed.grips[grip_pose].clone(),
        force_n,
        images,
        holding: holding(mu, twin.gripper.max_force_n, options.force_n, &pulls),
        fails: fails(trial),
        doubts: searched.proposed.doubts[grip_pose].clone(),
        works: trial
            .cells
            .iter()
            .map(|cell| WorksAt {
                grip_angle_deg: cell.angle_deg,
                grip_offset_mm: cell.offset_mm,
                largest_n: cell.largest_n,
            })
            .collect(),
    })
}

fn simulate_options(images: bool) -> SimulateOptions {
    SimulateOptions {
        mechanics: Mechanics::Reduced,
        images,
        noise: true,
        trace: false,
        backend: Backend::Cpu,
        level: SimdLevel::best(),
    }
}

/// A grip in its middle, pulled as a sweep pulls that says nothing of it.
fn scenario(grip_pose: usize, grip_force_n: f64) -> Scenario {
    Scenario {
        seed: 1,
        index: 0,
        group: 0,
        repetition: 0,
        part: PART.into(),
        grip_pose,
        grip_force_n,
        covariates: Covariates::default(),
        pull: PullSettings::default(),
        drawn: BTreeMap::new(),
    }
}

/// Where a grip fails, a sentence for each force and, where that differs, each angle.
fn fails(trial: &Trial) -> Vec<String> {
    let cells = |angle: Option<f64>, largest_n: Option<f64>| {
        let there = move |c: &&TrialCell| {
            angle.is_none_or(|a| a == c.angle_deg) && largest_n.is_none_or(|n| n == c.largest_n)
        };
        trial.cells.iter().filter(there)
    };
    let mut limits: Vec<f64> =
        trial.cells.iter().map(|c| c.largest_n).filter(|&n| n < HIGHEST_N[0]).collect();
    limits.sort_by(f64::total_cmp);
    limits.dedup();
    let mut sentences = Vec::new();
    for largest_n in limits {
        let force = if largest_n > 0.0 { format!("above {largest_n} N") } else { "at any force".into() };
        let sentence = |place: &str, angle: Option<f64>| {
            let why = cells(angle, Some(largest_n)).find_map(|c| c.failure.as_ref());
            let why = why.map_or_else(String::new, |why| format!(": {why}"));
            format!("{place} {force}{why}")
        };
        if cells(None, Some(largest_n)).count() == trial.cells.len() {
            sentences.push(sentence("anywhere", None));
            continue;
        }
        for angle in ANGLES_DEG {
            let mut offsets: Vec<f64> = cells(Some(angle), Some(largest_n)).map(|c| c.offset_mm).collect();
            if offsets.is_empty() {
                continue;
            }
            offsets.sort_by(f64::total_cmp);
            let whole = offsets.len() == cells(Some(angle), None).count();
            let named: Vec<String> = offsets.iter().map(f64::to_string).collect();
            let offsets = if whole { String::new() } else { format!(", {} mm off,", named.join(", ")) };
            sentences.push(sentence(&format!("turned by {angle} degrees{offsets}"), Some(angle)));
        }
    }
    sentences
}

/// What friction is taken to be, in words.
fn friction_words(mu: FrictionRange) -> String {
    if mu.is_measured {
        return format!("mu = {}, as given; repetitions of such pulls scatter by about 5 %", mu.value);
    }
    format!(
        "no shape tells friction, and nobody measured this part's: the line is mu = {MU} (four steel parts had 0.14 to 0.17), the \
         band goes from {} (oily) to {} (dry silicone rubber). --mu takes a measured one",
        mu.low, mu.high
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    /// "would fail: ..." is what a sentence follows: it says where a force is too large, not where it works.
    #[test]
    fn a_sentence_says_what_fails() {
        let cell = |angle_deg: f64, offset_mm: f64, largest_n: f64| {
            let failure = (largest_n < 40.0).then(|| "too deep".to_string());
            TrialCell { angle_deg, offset_mm, largest_n, failure }
        };
        let of = |cells: Vec<TrialCell>| fails(&Trial { cells });
        assert_eq!(of(vec![cell(0.0, 0.0, 20.0), cell(30.0, 3.0, 20.0)]), ["anywhere above 20 N: too deep"]);
        assert_eq!(of(vec![cell(0.0, 0.0, 0.0)]), ["anywhere at any force: too deep"]);
        let cells =
            vec![cell(0.0, 0.0, 40.0), cell(30.0, 0.0, 40.0), cell(30.0, 3.0, 10.0), cell(60.0, 0.0, 20.0)];
        let wanted = [
            "turned by 30 degrees, 3 mm off, above 10 N: too deep",
            "turned by 60 degrees above 20 N: too deep",
        ];
        assert_eq!(of(cells), wanted);
    }
}
