//! The effects of a twin on one part, hook by hook, in the order of the twin.

use super::{CommandHook, Creep, Effect, EffectSpec, GripPoint, SensorHook, SensorMemory, SensorPoint};
use crate::random::splitmix64;
use crate::{Jaw, OpticsState, Part, Twin};
use std::sync::Arc;

fn acting<'a>(twin: &'a Twin, part_name: &'a str) -> impl Iterator<Item = &'a Effect> {
    twin.effects.iter().filter(move |effect| effect.acts_on(part_name))
}

/// Real normal force of a jaw that is commanded `at.grip_force_n`, never negative.
pub fn normal_force_n(twin: &Twin, part_name: &str, at: &GripPoint<'_>) -> f64 {
    acting(twin, part_name).fold(at.grip_force_n, |force_n, effect| match effect.spec.normal_force {
        Some(hook) => hook(&effect.values, force_n, at).max(0.0),
        None => force_n,
    })
}

/// Imprint volume of a jaw whose real normal force is `force_n`: `V = c F`, softer gels more, then the effects.
pub fn imprint_volume_m3(twin: &Twin, part_name: &str, part: &Part, jaw: Jaw, force_n: f64) -> f64 {
    let imprint_m3_per_n = part.imprint_m3_per_n * twin.gel[jaw].compliance;
    acting(twin, part_name).fold(imprint_m3_per_n * force_n, |volume_m3, effect| {
        effect.spec.imprint_volume.map_or(volume_m3, |hook| hook(&effect.values, volume_m3, force_n))
    })
}

/// How the tool creeps under a pull that the jaws hold, by the last effect that says it. The force of `at` is the mean normal force of both
/// jaws.
pub fn creep(twin: &Twin, part_name: &str, at: &GripPoint<'_>) -> Creep {
    let own = acting(twin, part_name).filter_map(|effect| Some(effect.spec.creep?(&effect.values, at)));
    own.last().unwrap_or_default()
}

/// Angle of a gel about its +x axis, 0 without effects. Positive angles bring its lower edge nearer to the part.
pub fn jaw_tilt_rad(twin: &Twin, part_name: &str, at: &GripPoint<'_>) -> f64 {
    acting(twin, part_name).fold(0.0, |tilt_rad, effect| {
        effect.spec.tilt_rad.map_or(tilt_rad, |hook| tilt_rad + hook(&effect.values, at))
    })
}

/// The optics of a jaw: what the part's edges and surface are, then the effects.
pub fn optics_state(twin: &Twin, part_name: &str, at: &GripPoint<'_>) -> OpticsState {
    let mut state = OpticsState::default();
    if let Some(part) = twin.parts.get(part_name) {
        (state.edge_rounding_m, state.relief_m) = (part.edge_radius_m, part.relief_m);
        if part.relief_m > 0.0 {
            state.relief_key = part_name.bytes().fold(0, |mut key, byte| {
                key ^= u64::from(byte);
                splitmix64(&mut key)
            });
        }
    }
    for effect in acting(twin, part_name) {
        if let Some(hook) = effect.spec.optics {
            hook(&effect.values, &mut state, at);
        }
    }
    state
}

/// The wrist sensor as its effects change it, for one pull. The default reads the true force bit for bit.
#[derive(Debug, Clone)]
pub struct SensorChain {
    /// Values are shared: fits copy chains to remember what they remember.
    stages: Vec<(SensorHook, Arc<[f64]>, SensorMemory)>,
    start: SensorPoint,
    direction: f64,
    offset_n: f64,
}

impl Default for SensorChain {
    fn default() -> Self {
        Self { stages: Vec::new(), start: SensorPoint::default(), direction: 1.0, offset_n: 0.0 }
    }
}

impl SensorChain {
    /// The sensor effects on `part_name`, for a pull that starts at `start`.
    pub fn new(twin: &Twin, part_name: &str, start: SensorPoint) -> Self {
        let stages = acting(twin, part_name)
            .filter_map(|e| Some((e.spec.sensor?, e.values.as_slice().into(), SensorMemory::default())))
            .collect();
        Self { stages, start, direction: 1.0, offset_n: 0.0 }
    }

    /// The sensor effects among `effects` with their values, in their order.
    pub fn of<'a>(
        effects: impl Iterator<Item = (&'static EffectSpec, &'a [f64])>,
        start: SensorPoint,
    ) -> Self {
        let stages = effects
            .filter_map(|(spec, values)| Some((spec.sensor?, values.into(), SensorMemory::default())))
            .collect();
        Self { stages, start, direction: 1.0, offset_n: 0.0 }
    }

    /// For a pull of this sign along the sensor's axis. Forces stay magnitudes along the pull: against the axis
    /// (-1) a bias lowers the reading that it raises along the axis.
    #[must_use]
    pub fn along(mut self, pull_direction: f64) -> Self {
        self.direction = if pull_direction < 0.0 { -1.0 } else { 1.0 };
        self
    }

    /// With so much added to every reading, whatever its direction; what a table of the twin says.
    #[must_use]
    pub fn plus(mut self, offset_n: f64) -> Self {
        self.offset_n = offset_n;
        self
    }

    /// Whether it reads the true force as it is.
    pub fn is_identity(&self) -> bool {
        self.stages.is_empty() && self.offset_n == 0.0
    }

    /// The reading of a true force at `time_s` since the start of the pull, `step_s` after the one before.
    pub fn read(&mut self, true_n: f64, time_s: f64, step_s: f64) -> f64 {
        let SensorPoint { clock_s, since_zero_s, .. } = self.start;
        let at = SensorPoint { clock_s: clock_s + time_s, since_zero_s: since_zero_s + time_s, step_s };
        let read = self.stages.iter_mut().fold(self.direction * true_n, |force_n, (hook, values, memory)| {
            hook(values, force_n, memory, &at)
        });
        let read = self.direction * read;
        // Adding 0 would turn -0 into 0.
        if self.offset_n == 0.0 { read } else { read + self.offset_n }
    }
}

/// The command of the force loop as its effects change it. The default passes the desired force bit for bit.
#[derive(Debug, Clone, Default)]
pub struct CommandChain {
    stages: Vec<(CommandHook, Vec<f64>)>,
}

impl CommandChain {
    /// The command effects on `part_name`.
    pub fn new(twin: &Twin, part_name: &str) -> Self {
        let stages = acting(twin, part_name).filter_map(|e| Some((e.spec.command?, e.values.clone())));
        Self { stages: stages.collect() }
    }

    /// The command effects among `effects` with their values, in their order.
    pub fn of<'a>(effects: impl Iterator<Item = (&'static EffectSpec, &'a [f64])>) -> Self {
        Self { stages: effects.filter_map(|(spec, values)| Some((spec.command?, values.to_vec()))).collect() }
    }

    /// Whether no effect acts on commands.
    pub fn is_identity(&self) -> bool {
        self.stages.is_empty()
    }

    /// What the force loop is told when it measures `measured_n`.
    pub fn apply(&self, desired_n: f64, measured_n: f64) -> f64 {
        self.stages.iter().fold(desired_n, |force_n, (hook, values)| hook(values, force_n, measured_n))
    }
}
