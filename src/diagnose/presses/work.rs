//! Presses, and what any set of effects makes of them, at the pixels that are looked at.

use super::candidates::{fitted, free_parameter};
use crate::parallel::in_parallel;
use gripgen_identify::{FreeParameter, GroupMoments, GroupedModel};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::{Circle, PressScene, PressSet, PressView, ZONES, surface_part};
use gripgen_twin::effects::{EffectSpec, GripPoint};
use gripgen_twin::{Covariates, Jaw, OpticsState};
use std::sync::{Arc, Mutex};

/// What a contact changes at the pixels of a view.
type Contact = Arc<Vec<[f32; 3]>>;

/// Pictures of a contact that are kept.
const KEPT: usize = 8;

/// An effect with the values of all its parameters.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Acting {
    pub(super) spec: &'static EffectSpec,
    pub(super) values: Vec<f64>,
}

impl Acting {
    /// The effect with its values at the start of a fit.
    pub(super) fn start(spec: &'static EffectSpec, scene: &PressScene) -> Self {
        let mut values: Vec<f64> = spec.parameters.iter().map(|p| p.neutral).collect();
        for j in fitted(spec) {
            values[j] = free_parameter(spec, j, scene).start;
        }
        Self { spec, values }
    }
}

/// Presses with everything that is known of them.
pub(super) struct Work {
    pub(super) scene: PressScene,
    pub(super) full: PressScene,
    pub(super) views: Vec<PressView>,
    pub(super) circumstances: Vec<Covariates>,
    /// Where the contact is taken to be, of each press.
    pub(super) circles: Vec<Option<Circle>>,
    /// Mean square that counts as 1, of each zone.
    pub(super) zone_scale: [f64; ZONES.len()],
    kept: Vec<Mutex<Vec<(OpticsState, Contact)>>>,
}

impl Work {
    pub(super) fn new(set: &PressSet, sensor: &Sensor, circumstances: Vec<Covariates>) -> Self {
        let full = PressScene::new(sensor, set.ball_m);
        let scene = PressScene::for_fits(sensor, set.ball_m);
        let views = for_each(set.presses.len(), |i| {
            let press = &set.presses[i];
            PressView::draw(i, &press.image, press.circle, &full, &scene)
        });
        let mut work = Self {
            scene,
            full,
            circles: views.iter().map(|v| v.circle().copied()).collect(),
            kept: views.iter().map(|_| Mutex::new(Vec::new())).collect(),
            views,
            circumstances,
            zone_scale: [1.0; ZONES.len()],
        };
        work.rescale(&[]);
        work
    }

    /// Measures the zones by what a model leaves in them: the median over the presses, so that each counts alike.
    pub(super) fn rescale(&mut self, model: &[Acting]) {
        let squares = self.zone_squares(model);
        let noise: f64 =
            self.scene.sensor().noise_rgb.iter().map(|s| f64::from(*s).powi(2)).sum::<f64>() / 3.0;
        for (z, scale) in self.zone_scale.iter_mut().enumerate() {
            let mut list: Vec<f64> = squares.iter().map(|s| s[z]).filter(|s| s.is_finite()).collect();
            list.sort_by(f64::total_cmp);
            *scale = list.get(list.len() / 2).copied().unwrap_or(1.0).max(noise).max(0.02);
        }
    }

    /// Mean squared residual in each zone of each press; NaN where a zone is empty.
    pub(super) fn zone_squares(&self, model: &[Acting]) -> Vec<[f64; ZONES.len()]> {
        for_each(self.views.len(), |i| {
            let levels = self.levels(i, &self.optics(i, model));
            let (mut sums, mut counts) = ([0.0; ZONES.len()], [0.0; ZONES.len()]);
            for ((zone, level), measured) in
                self.views[i].zones().iter().zip(&levels).zip(self.views[i].measured())
            {
                for c in 0..3 {
                    sums[*zone as usize] += f64::from(level[c] - measured[c]).powi(2);
                    counts[*zone as usize] += 1.0;
                }
            }
            std::array::from_fn(|z| sums[z] / counts[z])
        })
    }

    /// Weight of each pixel of a press: zones count alike.
    pub(super) fn pixel_weights(&self, press: usize) -> Vec<f64> {
        let zones = self.views[press].zones();
        let mut counts = [0.0; ZONES.len()];
        zones.iter().for_each(|z| counts[*z as usize] += 3.0);
        let there = counts.iter().filter(|c| **c > 0.0).count() as f64;
        zones.iter().map(|z| 1.0 / (there * counts[*z as usize] * self.zone_scale[*z as usize])).collect()
    }

    /// What the effects of a model make of the optics at a press.
    pub(super) fn optics(&self, press: usize, model: &[Acting]) -> OpticsState {
        optics_at(&self.circumstances[press], model)
    }

    /// Grey levels at the pixels of a press.
    pub(super) fn levels(&self, press: usize, optics: &OpticsState) -> Vec<[f32; 3]> {
        self.views[press].levels(&self.scene, &self.contact(press, optics), optics)
    }

    /// What the contact changes there.
    pub(super) fn contact(&self, press: usize, optics: &OpticsState) -> Contact {
        let key = surface_part(optics);
        if let Ok(kept) = self.kept[press].lock()
            && let Some((_, found)) = kept.iter().find(|(k, _)| *k == key)
        {
            return found.clone();
        }
        let drawn = Arc::new(self.views[press].contact(&self.scene, optics, self.circles[press].as_ref()));
        if let Ok(mut kept) = self.kept[press].lock() {
            if kept.len() >= KEPT {
                kept.remove(0);
            }
            kept.push((key, drawn.clone()));
        }
        drawn
    }

    /// Forgets all pictures: circles have moved.
    pub(super) fn forget(&self) {
        for kept in &self.kept {
            if let Ok(mut kept) = kept.lock() {
                kept.clear();
            }
        }
    }
}

/// `of` for 0 to `n - 1`, on all cores.
pub(super) fn for_each<T: Send>(n: usize, of: impl Fn(usize) -> T + Sync) -> Vec<T> {
    in_parallel(n, std::thread::available_parallelism().map_or(1, usize::from), of)
}

/// What the effects of a model make of the optics in some circumstances.
pub(super) fn optics_at(covariates: &Covariates, model: &[Acting]) -> OpticsState {
    let at = GripPoint {
        jaw: Jaw::Left,
        grip_force_n: 0.0,
        contact_area_m2: 0.0,
        pull_rate_n_per_s: 0.0,
        covariates,
    };
    let mut state = OpticsState::default();
    for acting in model {
        if let Some(hook) = acting.spec.optics {
            hook(&acting.values, &mut state, &at);
        }
    }
    state
}

/// A set of effects whose parameters are fitted together.
pub(super) struct NamedModel<'a> {
    pub(super) work: &'a Work,
    pub(super) acting: Vec<Acting>,
    /// Effect and parameter of each free value.
    pub(super) free: Vec<(usize, usize)>,
    pub(super) parameters: Vec<FreeParameter>,
}

impl<'a> NamedModel<'a> {
    pub(super) fn new(work: &'a Work, acting: Vec<Acting>) -> Self {
        let mut free = Vec::new();
        let mut parameters = Vec::new();
        for (e, one) in acting.iter().enumerate() {
            for j in fitted(one.spec) {
                free.push((e, j));
                let start = one.values[j];
                parameters.push(FreeParameter { start, ..free_parameter(one.spec, j, &work.scene) });
            }
        }
        Self { work, acting, free, parameters }
    }

    /// The effects at other values of the free parameters.
    pub(super) fn at(&self, values: &[f64]) -> Vec<Acting> {
        let mut acting = self.acting.clone();
        for (&(e, j), v) in self.free.iter().zip(values) {
            acting[e].values[j] = *v;
        }
        acting
    }

    /// Levels at the pixels of a press, and their derivatives by each free parameter.
    pub(super) fn derivatives(&self, press: usize, values: &[f64]) -> (Vec<[f32; 3]>, Vec<Vec<[f32; 3]>>) {
        let work = self.work;
        let base = work.levels(press, &work.optics(press, &self.at(values)));
        let slopes = self.parameters.iter().enumerate().map(|(k, p)| {
            let step = 0.1 * p.scale;
            let step = if values[k] + step > p.bounds.1 { -step } else { step };
            let mut moved = values.to_vec();
            moved[k] += step;
            let optics = work.optics(press, &self.at(&moved));
            let levels = work.levels(press, &optics);
            let slope = |(a, b): (&[f32; 3], &[f32; 3])| [0, 1, 2].map(|c| (a[c] - b[c]) / step as f32);
            levels.iter().zip(&base).map(slope).collect()
        });
        let slopes = slopes.collect();
        (base, slopes)
    }
}

/// Derivatives by the parameters of effects that were accepted, where their fit ended: drawn once, used beside every
/// further candidate.
pub(super) struct Head {
    free: Vec<(usize, usize)>,
    parameters: Vec<FreeParameter>,
    /// By press and parameter.
    slopes: Vec<Vec<Vec<[f32; 3]>>>,
}

impl Head {
    pub(super) fn new(work: &Work, acting: &[Acting]) -> Self {
        let model = NamedModel::new(work, acting.to_vec());
        let values: Vec<f64> = model.parameters.iter().map(|p| p.start).collect();
        let slopes = for_each(work.views.len(), |i| model.derivatives(i, &values).1);
        Self { free: model.free, parameters: model.parameters, slopes }
    }

    /// Where the parameters are.
    pub(super) fn values(&self) -> impl Iterator<Item = f64> {
        self.parameters.iter().map(|p| p.start)
    }
}

impl<'a> NamedModel<'a> {
    /// The last effect of a list alone, those before it where they are.
    pub(super) fn last(work: &'a Work, acting: Vec<Acting>) -> Self {
        let all = Self::new(work, acting);
        let own = |e: usize| e + 1 == all.acting.len();
        let both = all.free.iter().zip(&all.parameters).filter(|((e, _), _)| own(*e));
        let (free, parameters) = both.map(|(f, p)| (*f, p.clone())).unzip();
        Self { work, acting: all.acting, free, parameters }
    }

    /// This model's parameters behind those of a head.
    pub(super) fn behind(&self, head: &Head) -> (Vec<(usize, usize)>, Vec<FreeParameter>) {
        let free = head.free.iter().chain(&self.free).copied().collect();
        let parameters = head.parameters.iter().chain(&self.parameters).cloned().collect();
        (free, parameters)
    }

    /// Moments of a head's parameters and this model's.
    pub(super) fn moments_behind(&self, head: &Head, values: &[f64]) -> Vec<GroupMoments> {
        for_each(self.work.views.len(), |i| {
            let (base, own) = self.derivatives(i, values);
            let slopes: Vec<&Vec<[f32; 3]>> = head.slopes[i].iter().chain(&own).collect();
            moments_of(self.work, i, &base, &slopes)
        })
    }
}

fn moments_of(work: &Work, press: usize, base: &[[f32; 3]], slopes: &[&Vec<[f32; 3]>]) -> GroupMoments {
    let weights = work.pixel_weights(press);
    let mut moments = GroupMoments::zero(slopes.len());
    let mut row = vec![0.0; slopes.len()];
    for (k, measured) in work.views[press].measured().iter().enumerate() {
        for c in 0..3 {
            row.iter_mut().zip(slopes).for_each(|(r, s)| *r = f64::from(s[k][c]));
            moments.add(f64::from(base[k][c] - measured[c]), &row, weights[k]);
        }
    }
    moments.finish();
    moments
}

impl GroupedModel for NamedModel<'_> {
    fn moments(&self, values: &[f64]) -> Vec<GroupMoments> {
        for_each(self.work.views.len(), |i| {
            let (base, slopes) = self.derivatives(i, values);
            moments_of(self.work, i, &base, &slopes.iter().collect::<Vec<_>>())
        })
    }

    fn costs(&self, values: &[f64]) -> Vec<f64> {
        let acting = self.at(values);
        for_each(self.work.views.len(), |i| {
            let levels = self.work.levels(i, &self.work.optics(i, &acting));
            let weights = self.work.pixel_weights(i);
            let square = |((l, m), w): ((&[f32; 3], &[f32; 3]), f64)| {
                w * (0..3).map(|c| f64::from(l[c] - m[c]).powi(2)).sum::<f64>()
            };
            levels.iter().zip(self.work.views[i].measured()).zip(weights).map(square).sum()
        })
    }
}
