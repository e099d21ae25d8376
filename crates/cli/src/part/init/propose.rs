//! Proposing grips: places are looked for, compared on a coarse grid, and those that look good are tried.

use super::doubts::doubts;
use super::places::{Body, OPPOSITE_RAD, Place, places, spread};
use super::pose::{GripAt, orientation, spread_of};
use super::seen::{Seen, Unseen, Viewer};
use super::trial::{Trial, Trials, Varied, widest_first};
use super::{NoGrip, Proposal};
use gripgen::Library;
use gripgen::in_parallel;
use gripgen_physics::Surface;
use gripgen_tactile::ClusteredMesh;
use gripgen_twin::{Part, Twin};
use nalgebra::{Matrix3, Point3, Vector3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Places that are looked at, and grips that are tried.
const LOOKED_AT: usize = 260;
const TRIED: usize = 24;
/// Grips proposed.
const PROPOSALS: usize = 4;
/// Widest grip, as a share of the opening.
const LARGEST_WIDTH: f64 = 0.95;
/// Difference at which two grips count as two.
const UNLIKE: f64 = 0.12;
/// Share of a proposal's worth that is left where the jaws take another by nearly the same direction: moved along the same faces it shows less that is
/// new. A nut is then proposed across its flats, too.
const SAME_FACES: f64 = 0.5;
const NEARLY_RAD: f64 = 30.0 * PI / 180.0;
/// Share of a grip's worth that is left where the part rises beside a pad, against the finger.
const BLOCKED: f64 = 0.3;
/// Steps of offsets, forces and angles that a second grip is worth.
const SECOND_GRIP: usize = 2;

/// A part that grips are looked for on.
pub(super) struct Search<'a> {
    pub(super) twin: &'a Twin,
    pub(super) library: &'a Library,
    pub(super) part: Part,
    pub(super) surface: Arc<Surface>,
    pub(super) mesh: Arc<ClusteredMesh>,
    pub(super) closed: bool,
    pub(super) threads: usize,
}

/// Grips that work, the best first, and what a sweep over them may vary.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Proposed {
    pub(crate) grips: Vec<Proposal>,
    /// Where each of them works.
    pub(crate) trials: Vec<Trial>,
    pub(crate) varied: Varied,
    /// How many were tried, and what failed first where the sweep had to be narrowed.
    pub(crate) tried: usize,
    pub(crate) failure: Option<String>,
    /// What is doubtful of each grip, a sentence each.
    pub(crate) doubts: Vec<Vec<String>>,
}

/// A grip that looks good.
#[derive(Debug, Clone)]
struct Candidate {
    at: GripAt,
    seen: Seen,
    middle: Point3<f64>,
    lever_m: f64,
    worth: f64,
}

impl Search<'_> {
    /// Looks, compares and tries. The same mesh gives the same grips.
    pub(super) fn run(&self) -> Result<Proposed, NoGrip> {
        let (body, tried) = self.promising()?;
        let at: Vec<GripAt> = tried.iter().map(|c| c.at).collect();
        let trials = Trials::new(self.twin, self.library, self.part.clone(), &at).run(self.threads);
        let (varied, grips) = widest(&tried, &trials, &body).ok_or_else(|| NoGrip::AllFail {
            tried: tried.len(),
            failure: trials.iter().find_map(Trial::failure).cloned().unwrap_or_default(),
        })?;
        let failure = trials.iter().find_map(Trial::failure).cloned();
        let proposals: Vec<Proposal> = grips.iter().map(|&i| tried[i].proposal()).collect();
        let trials = grips.iter().map(|&i| trials[i].clone()).collect();
        let doubts = doubts(&self.viewer(), &proposals, &varied);
        Ok(Proposed { grips: proposals, trials, varied, tried: tried.len(), failure, doubts })
    }

    /// The first `wanted` grips that stand a given variation, the most promising first; fewer if fewer do.
    pub(super) fn run_over(&self, varied: &Varied, wanted: usize) -> Result<Vec<Proposal>, NoGrip> {
        let (_, promising) = self.promising()?;
        let (mut found, mut first) = (Vec::new(), None);
        for (tried, candidate) in promising.iter().enumerate() {
            let trials = Trials::new(self.twin, self.library, self.part.clone(), &[candidate.at]);
            match trials.fails(varied) {
                None => found.push(candidate.proposal()),
                Some(failure) => first = first.or(Some((tried, failure))),
            }
            if found.len() == wanted {
                break;
            }
        }
        match (found.is_empty(), first) {
            (true, Some((_, failure))) => Err(NoGrip::AllFail { tried: promising.len(), failure }),
            _ => Ok(found),
        }
    }

    /// Grips that look good and differ, the best first.
    fn promising(&self) -> Result<(Body, Vec<Candidate>), NoGrip> {
        let body = Body::of(self.surface.mesh(), self.closed);
        let opening_m = self.twin.gripper.opening_m;
        let found = places(&self.surface, &body, LARGEST_WIDTH * opening_m);
        let Some(narrowest_m) = found.narrowest_m else {
            return Err(NoGrip::TooSteep {
                least_deg: found.steepest_rad.to_degrees(),
                allowed_deg: OPPOSITE_RAD.to_degrees(),
            });
        };
        if found.places.is_empty() {
            return Err(NoGrip::TooWide {
                narrowest_mm: narrowest_m * 1e3,
                opening_mm: opening_m * 1e3,
                largest_mm: LARGEST_WIDTH * opening_m * 1e3,
            });
        }
        let looked_at = spread(&found.places, LOOKED_AT, body.size_m);
        let spread = spread_of(self.surface.mesh());
        let views =
            in_parallel(looked_at.len(), self.threads, |i| self.look_around(&body, &spread, &looked_at[i]));
        let (good, bad): (Vec<_>, Vec<_>) = views.into_iter().flatten().partition(Result::is_ok);
        let good: Vec<Candidate> = good.into_iter().filter_map(Result::ok).collect();
        let chosen = pick(&good, &body, TRIED, 1.0, &|_| true);
        if chosen.is_empty() {
            // A few lines across the corners of a part that is too wide are short, and too pointed.
            if let Some(narrowest_m) =
                found.narrowest_too_wide_m.filter(|_| found.too_wide > found.places.len())
            {
                return Err(NoGrip::TooWide {
                    narrowest_mm: narrowest_m * 1e3,
                    opening_mm: opening_m * 1e3,
                    largest_mm: LARGEST_WIDTH * opening_m * 1e3,
                });
            }
            return Err(why_none(bad.into_iter().filter_map(Result::err), opening_m));
        }
        let promising = chosen.into_iter().map(|i| good[i].clone()).collect();
        Ok((body, promising))
    }

    fn viewer(&self) -> Viewer<'_> {
        Viewer {
            twin: self.twin,
            surface: &self.surface,
            mesh: &self.mesh,
            imprint_m3_per_n: self.part.imprint_m3_per_n,
        }
    }

    /// The grip at a place, and the same moved to the middle of what it touches.
    fn look_around(
        &self,
        body: &Body,
        spread: &Matrix3<f64>,
        place: &Place,
    ) -> Vec<Result<Candidate, Unfit>> {
        let viewer = self.viewer();
        let rotation = orientation(spread, place.axis);
        let (mut origin, mut all) = (place.middle, Vec::new());
        for step in 0..4 {
            let at = GripAt::new(&rotation, origin);
            let seen = match viewer.look(&at) {
                Ok(seen) => seen,
                Err(unseen) => {
                    all.push(Err(Unfit::Unseen(unseen)));
                    break;
                }
            };
            let mut shift = seen.to_middle;
            // First the jaws are made to travel equally far, then the pads are put in front of what they touch.
            if step == 0 {
                (shift.x, shift.z) = (0.0, 0.0);
            }
            all.push(self.fit(body, &at, seen));
            if step > 0 && shift.norm() < 0.2e-3 {
                break;
            }
            origin += rotation.inverse() * shift;
        }
        all
    }

    fn fit(&self, body: &Body, at: &GripAt, seen: Seen) -> Result<Candidate, Unfit> {
        let largest_m = LARGEST_WIDTH * self.twin.gripper.opening_m;
        if seen.width_m > largest_m {
            return Err(Unfit::Wide { width_m: seen.width_m });
        }
        if seen.slope > libm::tan(OPPOSITE_RAD) {
            return Err(Unfit::Steep { slope: seen.slope });
        }
        let part = at.part_from_mesh();
        let to_mass = part * body.middle;
        let lever_m = libm::hypot(to_mass.x, to_mass.z);
        let off = 2.0 * lever_m / body.size_m;
        let thickness_m = self.twin.gel.left.thickness_m;
        let free = if seen.clearance_m < -0.5 * thickness_m { BLOCKED } else { 1.0 };
        let worth = seen.area_m2 * free / (1.0 + off * off);
        Ok(Candidate { at: *at, middle: part.inverse() * Point3::origin(), lever_m, worth, seen })
    }
}

impl Candidate {
    /// The direction in which the jaws close, in the mesh.
    fn jaw_axis(&self) -> Vector3<f64> {
        self.at.part_from_mesh().rotation.inverse() * Vector3::y()
    }

    fn proposal(&self) -> Proposal {
        Proposal {
            origin_mm: self.at.origin_mm,
            orientation_deg: self.at.orientation_deg,
            width_mm: self.seen.width_m * 1e3,
            contact_mm2: self.seen.area_m2 * 1e6,
            lever_mm: self.lever_m * 1e3,
            clearance_mm: self.seen.clearance_m * 1e3,
        }
    }
}

/// Why what a grip looks like is not good enough.
#[derive(Debug, Clone, Copy)]
enum Unfit {
    Unseen(Unseen),
    Wide { width_m: f64 },
    Steep { slope: f64 },
}

/// The worthiest candidates that are allowed, each unlike those before it; of one whose jaws close as those of an earlier one, `same_faces` of
/// its worth counts.
fn pick(
    all: &[Candidate],
    body: &Body,
    wanted: usize,
    same_faces: f64,
    allowed: &dyn Fn(usize) -> bool,
) -> Vec<usize> {
    let mut apart = vec![f64::INFINITY; all.len()];
    let mut kept = vec![1.0; all.len()];
    let mut chosen = Vec::new();
    while chosen.len() < wanted {
        let worth = |i: usize| match allowed(i) && apart[i] > UNLIKE {
            true => kept[i] * all[i].worth * -libm::expm1(-(apart[i] / (3.0 * UNLIKE)).powi(2)),
            false => 0.0,
        };
        let best = (0..all.len()).fold(0, |a, b| if worth(b) > worth(a) { b } else { a });
        if all.is_empty() || worth(best) <= 0.0 {
            break;
        }
        chosen.push(best);
        let axis = all[best].jaw_axis();
        for ((near, kept), other) in apart.iter_mut().zip(&mut kept).zip(all) {
            if other.jaw_axis().dot(&axis).abs() > libm::cos(NEARLY_RAD) {
                *kept = same_faces;
            }
            let moved = (other.middle - all[best].middle).norm() / body.size_m;
            *near = near.min(other.seen.unlike(&all[best].seen) + 0.5 * moved);
        }
    }
    chosen
}

/// The widest variation over which a grip works, and the grips that work there. A second grip is worth a little narrowing.
fn widest(tried: &[Candidate], trials: &[Trial], body: &Body) -> Option<(Varied, Vec<usize>)> {
    let mut one: Option<(usize, Varied, Vec<usize>)> = None;
    for (given_up, varied) in widest_first() {
        if one.as_ref().is_some_and(|(first, ..)| given_up > first + SECOND_GRIP) {
            break;
        }
        let works = |i: usize| trials[i].works(&varied);
        if !(0..tried.len()).any(works) {
            continue;
        }
        let grips = pick(tried, body, PROPOSALS, SAME_FACES, &works);
        if grips.len() > 1 {
            return Some((varied, grips));
        }
        if one.is_none() && !grips.is_empty() {
            one = Some((given_up, varied, grips));
        }
    }
    one.map(|(_, varied, grips)| (varied, grips))
}

/// Why nothing that was looked at is a grip: the reason that came nearest to none.
fn why_none(unfit: impl Iterator<Item = Unfit>, opening_m: f64) -> NoGrip {
    let (mut deep, mut wide, mut steep): (Option<(f64, f64)>, Option<f64>, Option<f64>) = (None, None, None);
    let mut beyond = 0;
    for reason in unfit {
        match reason {
            Unfit::Unseen(Unseen::Deep { wanted_m3, available_m3 }) => {
                if deep.is_none_or(|(_, most)| available_m3 > most) {
                    deep = Some((wanted_m3, available_m3));
                }
            }
            Unfit::Unseen(Unseen::Beyond) => beyond += 1,
            Unfit::Unseen(Unseen::Nothing) => {}
            Unfit::Wide { width_m } => wide = Some(wide.map_or(width_m, |w| w.min(width_m))),
            Unfit::Steep { slope } => steep = Some(steep.map_or(slope, |s| s.min(slope))),
        }
    }
    let opening_mm = opening_m * 1e3;
    match (deep, steep, wide) {
        (Some((wanted, most)), ..) => NoGrip::TooDeep {
            force_n: super::LEAST_FORCE_N,
            wanted_mm3: wanted * 1e9,
            available_mm3: most * 1e9,
        },
        (_, Some(slope), _) => NoGrip::TooSteep {
            least_deg: libm::atan(slope).to_degrees(),
            allowed_deg: OPPOSITE_RAD.to_degrees(),
        },
        (.., Some(width_m)) => NoGrip::TooWide {
            narrowest_mm: width_m * 1e3,
            opening_mm,
            largest_mm: LARGEST_WIDTH * opening_mm,
        },
        _ => NoGrip::Beyond { places: beyond, opening_mm },
    }
}
