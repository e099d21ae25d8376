//! Presses, and what any set of effects makes of them, at the pixels that are looked at.

use gripgen::in_parallel;
use gripgen_identify::{ActingEffect, PRESS_ZONES, PredictPresses, PressPixels};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::{
    Circle, PressContact, PressScene, PressSet, PressView, ZONES, frame_mse, surface_part,
};
use gripgen_twin::effects::{EffectSpec, GripPoint};
use gripgen_twin::{Covariates, Jaw, OpticsState};
use std::sync::{Arc, Mutex};

/// What a contact changes at the pixels of a view.
type Contact = Arc<Vec<[f32; 3]>>;

const _: () = assert!(ZONES.len() == PRESS_ZONES);

/// Pictures of a contact that are kept.
const KEPT: usize = 8;

/// Presses with everything that is known of them.
pub(super) struct Work<'a> {
    set: &'a PressSet,
    pub(super) scene: PressScene,
    pub(super) full: PressScene,
    pub(super) views: Vec<PressView>,
    pub(super) circumstances: Vec<Covariates>,
    /// Where the contact of a ball is taken to be, of each press.
    pub(super) circles: Vec<Option<Circle>>,
    kept: Vec<Mutex<Vec<(OpticsState, Contact)>>>,
}

impl<'a> Work<'a> {
    pub(super) fn new(set: &'a PressSet, sensor: &Sensor, circumstances: Vec<Covariates>) -> Self {
        let full = PressScene::new(sensor, set.ball_m);
        let scene = PressScene::for_fits(sensor, set.ball_m);
        let views = for_each(set.presses.len(), |i| {
            let press = &set.presses[i];
            PressView::draw(i, &press.image, PressContact::of(press), &full, &scene)
        });
        Self {
            set,
            scene,
            full,
            circles: views.iter().map(|v| v.press().filter(|p| p.is_ball()).map(|p| *p.circle())).collect(),
            kept: views.iter().map(|_| Mutex::new(Vec::new())).collect(),
            views,
            circumstances,
        }
    }

    /// What effects make of the optics at a press.
    fn optics(&self, press: usize, acting: &[ActingEffect]) -> OpticsState {
        optics_at(&self.circumstances[press], acting)
    }

    /// What the contact changes at the pixels of a press.
    fn contact(&self, press: usize, optics: &OpticsState) -> Contact {
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

/// How many of the last parameters of an effect say how it differs from press to press by chance: each press says how.
fn scatters(spec: &EffectSpec) -> usize {
    spec.presses.map_or(0, |fit| fit.scatters)
}

/// What effects make of the optics in some circumstances.
pub(super) fn optics_at(covariates: &Covariates, acting: &[ActingEffect]) -> OpticsState {
    let at = GripPoint {
        jaw: Jaw::Left,
        grip_force_n: 0.0,
        contact_area_m2: 0.0,
        pull_rate_n_per_s: 0.0,
        covariates,
        grip: (0, 0),
    };
    let mut state = OpticsState::default();
    for effect in acting {
        if let Some(hook) = effect.spec.optics {
            hook(&effect.spec.without_scatter(&effect.values), &mut state, &at);
        }
    }
    state
}

/// Mean square of the noise of a sensor's camera, over the channels.
pub(super) fn noise_mse(sensor: &Sensor) -> f64 {
    sensor.noise_rgb.iter().map(|s| f64::from(*s).powi(2)).sum::<f64>() / 3.0
}

impl PredictPresses for Work<'_> {
    fn circumstances(&self) -> &[Covariates] {
        &self.circumstances
    }

    fn px_mm(&self) -> f64 {
        self.scene.sensor().grid.metres_per_px * 1e3
    }

    fn noise_mse(&self) -> f64 {
        noise_mse(self.scene.sensor())
    }

    fn pixels(&self, press: usize) -> PressPixels {
        let view = &self.views[press];
        PressPixels {
            measured: view.measured().to_vec(),
            zones: view.zones().iter().map(|zone| *zone as u8).collect(),
            places: view.places(&self.scene),
        }
    }

    fn levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]> {
        let optics = self.optics(press, acting);
        self.views[press].levels(&self.scene, &self.contact(press, &optics), &optics)
    }

    fn contact_levels(&self, press: usize, acting: &[ActingEffect]) -> Vec<[f32; 3]> {
        self.contact(press, &self.optics(press, acting)).to_vec()
    }

    fn frame_mse(&self, press: usize, acting: &[ActingEffect]) -> f64 {
        let named = acting.iter().find_map(|effect| {
            let own = effect.values.len() - scatters(effect.spec);
            let sd: [f64; 3] = effect.values[own..].try_into().ok()?;
            (sd != [0.0; 3]).then_some(sd)
        });
        let known = self.full.sensor().press_gain_sd.map(|sd| sd.map(f64::from));
        frame_mse(self.set, press, &self.full, &self.optics(press, acting), named.or(known))
    }

    fn for_each(&self, n: usize, task: &(dyn Fn(usize) + Sync)) {
        for_each(n, task);
    }
}
