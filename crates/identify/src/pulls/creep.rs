//! Tools that creep under a force that the jaws hold, as displacements show it.
//!
//! ```text
//! x = x_0 + F / k + rate int F dt
//! ```
//!
//! up to four fifths of the largest force. Of one staircase the integral is a parabola in the force, as what a contact bends by before it
//! slips is; creep is what is far more than gels shear by, and is not more where the staircase is steeper.

mod trace;

use super::observe::median;
use gripgen_twin::effects::LIBRARY;
use gripgen_twin::predict::ModelEffect;
use gripgen_twin::{MeasuredPull, PullTrace};
use trace::{Crept, LEAST_M, LookedAt, impulses_n_s, least_squares, pulled};

pub(super) use trace::without_slips_that_rise;

/// Fewest traces that creep, and their share of those that would show it.
const MIN_TRACES: usize = 3;
const MIN_SHARE: f64 = 0.5;

/// Ratio of the largest to the smallest grip force of a part that says how its rate goes with the grip: of one force, or one for each part,
/// nothing does, and rates of grips that were not seen to creep would be anything.
const GRIPS_APART: f64 = 1.5;

/// Ratio of the steepest to the flattest staircase that tells creep from bends, whose rate would grow with it to the power of 1, and what it
/// may at most.
const RATES_APART: f64 = 1.5;
const MOST_BY_RATE: f64 = 0.4;

/// How far rates of traces may lie about what part and grip force make of them, in the logarithm.
const SCATTER: f64 = 0.3;

/// How tools creep.
#[derive(Debug, Clone, Default)]
pub(super) struct Creep {
    /// Of each pull whose trace shows it.
    of_pull: Vec<Option<Crept>>,
    /// Logarithm of the rate at 1 N of each part that was seen to creep, and the power of the grip force with which all go.
    of_part: Vec<(String, f64)>,
    by_grip: f64,
}

impl Creep {
    /// What the traces of a campaign show, if they do.
    pub fn of(pulls: &[MeasuredPull]) -> Option<Self> {
        let looked_at: Vec<Option<LookedAt>> =
            pulls.iter().map(|p| LookedAt::of(p.trace.as_ref()?)).collect();
        let of_pull: Vec<Option<Crept>> = looked_at.iter().map(|l| l.as_ref()?.crept).collect();
        let seen: Vec<(&MeasuredPull, f64)> =
            pulls.iter().zip(&of_pull).filter_map(|(p, rate)| Some((p, rate.as_ref()?.rate))).collect();
        let show =
            would_show(&looked_at, median(&mut seen.iter().map(|(_, rate)| *rate).collect::<Vec<f64>>()));
        if seen.len() < MIN_TRACES || (seen.len() as f64) < MIN_SHARE * show as f64 {
            return None;
        }
        let mut parts: Vec<&str> = seen.iter().map(|(p, _)| p.part.as_str()).collect();
        parts.sort_unstable();
        parts.dedup();
        let steep = |p: &MeasuredPull| libm::log(p.increment_n / p.step_s);
        // How far apart it is in one part, or in all.
        let span = |of: Option<&str>, x: &dyn Fn(&MeasuredPull) -> f64| {
            let all = seen.iter().filter(|(p, _)| of.is_none_or(|part| p.part == part)).map(|(p, _)| x(p));
            all.clone().fold(f64::NEG_INFINITY, f64::max) - all.fold(f64::INFINITY, f64::min)
        };
        let grip = |p: &MeasuredPull| libm::log(p.grip_force_n);
        let grips_vary = parts.iter().any(|part| span(Some(part), &grip) > libm::log(GRIPS_APART));
        let rates_vary = span(None, &steep) > libm::log(RATES_APART);
        // A level for each part, whose contacts differ.
        let row = |p: &MeasuredPull, rate: bool| -> Vec<f64> {
            let own = |name: &&str| if p.part == **name { 1.0 } else { 0.0 };
            let slopes =
                [(grips_vary, grip(p)), (rate, steep(p))].map(|(varies, x)| if varies { x } else { 0.0 });
            parts.iter().map(own).chain(slopes).collect()
        };
        let fit = |rate: bool| {
            let rows: Vec<(Vec<f64>, f64)> =
                seen.iter().map(|(p, found)| (row(p, rate), libm::log(*found))).collect();
            let found = least_squares(&rows)?;
            let off = |(x, y): &(Vec<f64>, f64)| y - x.iter().zip(&found).map(|(a, b)| a * b).sum::<f64>();
            let apart = (rows.iter().map(|r| off(r).powi(2)).sum::<f64>() / rows.len() as f64).sqrt();
            Some((found, apart))
        };
        if let Some((found, _)) = rates_vary.then(|| fit(true)).flatten()
            && found.last().is_some_and(|power| power.abs() > MOST_BY_RATE)
        {
            return None;
        }
        let (found, apart) = fit(false)?;
        if apart > SCATTER {
            return None;
        }
        // Contacts differ, by part and load: no rate says more than they do.
        let widened = |c: Crept| Crept { sd: libm::hypot(c.sd, apart * c.rate), ..c };
        Some(Self {
            of_pull: of_pull.into_iter().map(|p| p.map(widened)).collect(),
            of_part: parts.iter().zip(&found).map(|(name, level)| (name.to_string(), *level)).collect(),
            by_grip: found[parts.len()],
        })
    }

    /// Each pull whose trace shows its rate.
    pub fn seen(&self) -> impl Iterator<Item = (usize, Crept)> {
        self.of_pull.iter().enumerate().filter_map(|(row, rate)| Some((row, (*rate)?)))
    }

    /// The same as effects, one of each of `parts`; those that were not seen to creep have the rate in their middle.
    pub fn effects(&self, parts: &[String]) -> Vec<ModelEffect> {
        let Some(spec) = LIBRARY.iter().find(|spec| spec.creep.is_some()) else { return vec![] };
        let of = |(part, name): (usize, &String)| {
            let values = spec.values(&[
                ("rate_mm_per_n_s", 1e3 * libm::exp(self.level_of(name))),
                ("load_exponent", -self.by_grip),
                ("reference_force_n", 1.0),
            ]);
            ModelEffect { part: Some(part), ..ModelEffect::new(spec, values) }
        };
        parts.iter().enumerate().map(of).collect()
    }

    /// Logarithm of the rate of a part at 1 N.
    fn level_of(&self, part: &str) -> f64 {
        let mean = || self.of_part.iter().map(|(_, level)| level).sum::<f64>() / self.of_part.len() as f64;
        self.of_part.iter().find(|(name, _)| *name == part).map_or_else(mean, |(_, level)| *level)
    }

    /// The rate in the middle of the campaign.
    pub fn median_m_per_n_s(&self) -> f64 {
        median(&mut self.of_pull.iter().flatten().map(|c| c.rate).collect::<Vec<f64>>())
    }

    /// The trace of pull `row` with the way that its tool has crept taken off.
    pub fn taken_off(&self, row: usize, pull: &MeasuredPull, trace: &PullTrace) -> PullTrace {
        let own = self.level_of(&pull.part);
        let by_grip = || libm::exp(own + self.by_grip * libm::log(pull.grip_force_n));
        let rate = self.of_pull[row].map_or_else(by_grip, |c| c.rate);
        let pulled = pulled(trace);
        let mut trace = trace.clone();
        let before = trace.len() - pulled.len();
        for (x, crept) in trace.displacement_m[before..].iter_mut().zip(impulses_n_s(&pulled)) {
            *x -= rate * crept;
        }
        trace
    }
}

/// How many traces creep, or would be seen to at this rate: a weak grip slips before it has crept far, which is no evidence.
fn would_show(looked_at: &[Option<LookedAt>], rate_m_per_n_s: f64) -> usize {
    let shows = |l: &&LookedAt| l.crept.is_some() || rate_m_per_n_s * l.impulse_n_s >= LEAST_M;
    looked_at.iter().flatten().filter(shows).count()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draws::Draws;
    use crate::pulls::observe::TraceObservation;
    use gripgen_twin::{PlannedPull, TraceRow};

    /// A pull that rises by `increment_n / 0.1 s` to `limit_n`, with noise of 0.1 N and 5 um, its way by `way_m(force, impulse)`.
    fn pull(
        grip_force_n: f64,
        increment_n: f64,
        limit_n: f64,
        way_m: &dyn Fn(f64, f64) -> f64,
        draws: &mut Draws,
    ) -> MeasuredPull {
        let mut impulse_n_s = 0.0;
        let rows = (-50..(100.0 * limit_n / (10.0 * increment_n)) as i32).map(|i| {
            let time_s = 0.01 * f64::from(i);
            let force_n = 10.0 * increment_n * time_s.max(0.0);
            impulse_n_s += 0.01 * force_n;
            TraceRow {
                time_s,
                desired_force_n: force_n,
                measured_force_n: force_n + 0.1 * draws.normal(),
                displacement_m: way_m(force_n, impulse_n_s) + 5e-6 * draws.normal(),
            }
        });
        MeasuredPull {
            id: String::new(),
            part: "rod".into(),
            grip_pose: 0,
            grip_force_n,
            increment_n,
            start_n: None,
            step_s: 0.1,
            covariates: PlannedPull::default().covariates(),
            max_pull_force_n: limit_n,
            zero_shift_n: 0.0,
            trace: Some(rows.collect()),
        }
    }

    const GRIPS: [(f64, f64); 6] =
        [(10.0, 0.5), (20.0, 1.0), (40.0, 2.0), (15.0, 2.0), (30.0, 0.5), (60.0, 1.0)];

    #[test]
    fn the_rate_of_a_tool_that_creeps_comes_back() {
        let mut draws = Draws::new(3, 0);
        let rate = |grip: f64| 3e-4 * libm::pow(grip / 20.0, -0.3);
        let pulls: Vec<MeasuredPull> = GRIPS
            .iter()
            .map(|&(grip, step)| {
                let way = |force: f64, impulse: f64| force / 4e4 + rate(grip) * impulse;
                pull(grip, step, 0.8 * grip, &way, &mut draws)
            })
            .collect();
        // Another part, whose contact creeps four times as fast.
        let more: Vec<MeasuredPull> = GRIPS
            .iter()
            .map(|&(grip, step)| {
                let way = |force: f64, impulse: f64| force / 4e4 + 4.0 * rate(grip) * impulse;
                MeasuredPull { part: "plate".into(), ..pull(grip, step, 0.5 * grip, &way, &mut draws) }
            })
            .collect();
        assert!(Creep::of(&[&pulls[..], &more[..]].concat()).is_some());
        let creep = Creep::of(&pulls).unwrap();
        for (row, crept) in creep.seen() {
            let truth = rate(pulls[row].grip_force_n);
            assert!((crept.rate / truth - 1.0).abs() < 0.1, "{row}: {crept:?}, {truth}");
            // What is left is the shear of the gels.
            let trace = pulls[row].trace.as_ref().unwrap();
            let left = creep.taken_off(row, &pulls[row], trace);
            let last = left.row(left.len() - 1);
            let sheared_m = last.measured_force_n / 4e4;
            assert!((last.displacement_m - sheared_m).abs() < 0.1 * trace.row(left.len() - 1).displacement_m);
        }
        assert!(creep.seen().count() >= 4);
    }

    /// Contacts that bend go further and further too, but no further where the pull is slower: the sphere of Mindlin 1949, on gels as soft as to
    /// move by millimetres.
    #[test]
    fn contacts_that_bend_do_not_creep() {
        let mut draws = Draws::new(4, 0);
        let pulls: Vec<MeasuredPull> = GRIPS
            .iter()
            .map(|&(grip, step)| {
                let limit = 0.8 * grip;
                let way = move |force: f64, _: f64| {
                    1.5 * limit / 5e3 * (1.0 - libm::pow(1.0 - (force / limit).min(1.0), 2.0 / 3.0))
                };
                pull(grip, step, limit, &way, &mut draws)
            })
            .collect();
        assert!(Creep::of(&pulls).is_none());
        // Nor what goes with the square of the force, which one staircase cannot tell from creep.
        let pulls: Vec<MeasuredPull> = GRIPS
            .iter()
            .map(|&(grip, step)| pull(grip, step, 0.8 * grip, &|force, _| 4e-6 * force * force, &mut draws))
            .collect();
        assert!(Creep::of(&pulls).is_none());
    }

    /// Of nine grips three are strong enough to creep far before they slip. The weak ones say nothing; strong ones that stay do.
    #[test]
    fn weak_grips_are_no_evidence_against_creep() {
        let mut draws = Draws::new(5, 0);
        let mut nine = |others_n: f64, creep: f64| {
            let strong = [(40.0, 0.5), (60.0, 1.0), (80.0, 2.0)].map(|(grip, step)| (grip, step, 5.6e-5));
            let others = [0.5, 1.0, 0.5, 1.0, 0.5, 1.0].map(|step| (others_n, step, creep));
            let pulls: Vec<MeasuredPull> = strong
                .into_iter()
                .chain(others)
                .map(|(grip, step, rate)| {
                    let way = move |force: f64, impulse: f64| force / 1e6 + rate * impulse;
                    pull(grip, step, 0.4 * grip, &way, &mut draws)
                })
                .collect();
            Creep::of(&pulls)
        };
        let found = nine(6.0, 5.6e-5).expect("six weak grips").median_m_per_n_s();
        assert!((found / 5.6e-5 - 1.0).abs() < 0.1, "{found}");
        assert!(nine(50.0, 0.0).is_none());
    }

    /// Of one grip force for each part nothing says how the rate goes with the grip. A weak grip that slid by millimetres has not crept them.
    #[test]
    fn grips_that_nobody_saw_creep_have_no_rate_of_their_own() {
        let mut draws = Draws::new(6, 0);
        let way = |force: f64, impulse: f64| force / 1e6 + 5e-5 * impulse;
        let mut seen = |grip: f64, step: f64| pull(grip, step, 0.4 * grip, &way, &mut draws);
        let ball = |p: MeasuredPull| MeasuredPull { part: "ball".into(), ..p };
        let mut pulls = vec![seen(80.0, 0.5), seen(80.0, 2.0), ball(seen(30.0, 1.0))];
        // 2.5 N, held for a second while it slides by 4 mm.
        let mut weak = seen(5.0, 0.5);
        let slides = (0..100).map(|i| TraceRow {
            time_s: 0.5 + 0.01 * f64::from(i),
            desired_force_n: 3.0,
            measured_force_n: 2.5,
            displacement_m: 4e-7 * f64::from(i * i),
        });
        weak.trace = Some(weak.trace.unwrap().rows().filter(|r| r.time_s < 0.5).chain(slides).collect());
        pulls.push(weak);
        let creep = Creep::of(&pulls).unwrap();
        let left = creep.taken_off(3, &pulls[3], pulls[3].trace.as_ref().unwrap());
        let last_m = left.row(left.len() - 1).displacement_m;
        assert!(last_m > 3.5e-3, "{last_m}");
    }

    #[test]
    fn readings_that_rise_to_the_end_are_no_slip() {
        let seen = |slope: f64| TraceObservation {
            row: 0,
            no_load_n: None,
            held_s: (0..40).map(|i| 0.05 * f64::from(i)).collect(),
            held_n: (0..40).map(|i| 0.25 * f64::from(i)).collect(),
            held_m: vec![0.0; 40],
            slip_s: Some(2.0),
            before_slip_n: vec![9.5; 6],
            slid_n: Some((10.0, 20)),
            slid_rows: (0..20)
                .map(|i| (2.0 + 0.05 * f64::from(i), 10.0 + slope * 0.05 * f64::from(i), 0.0))
                .collect(),
        };
        assert_eq!(without_slips_that_rise(seen(4.5)).slip_s, None);
        assert_eq!(without_slips_that_rise(seen(0.0)).slip_s, Some(2.0));
    }
}
