//! Made-up force sensors. The formulas are other ones than the library's on purpose: a stretched creep, a play operator,
//! a smooth limit, two poles, a gain that warms up.

use super::{Covariate, SensorData};
use crate::draws::Draws;
use crate::sensor::moments::{Model, Moments};
use crate::sensor::noise::{Noise, Whitener, draw};
use crate::sensor::prepare::prepare;
use gripgen_twin::effects::EffectSpec;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Effect {
    None,
    Drift,
    GainDrift,
    Quadratic,
    Saturation,
    Lowpass,
    Creep,
    Hysteresis,
    Temperature,
    TemperatureGain,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum NoiseKind {
    White,
    /// First-order autoregression.
    Slow,
    /// Both.
    Mixed,
    /// A smooth signal, which the noise model does not fit.
    Smooth,
}

#[derive(Debug, Clone)]
pub(super) struct Case {
    pub effects: Vec<Effect>,
    /// In units of what a test with the true formula sees with 80 % power at the 1 % level.
    pub size: f64,
    pub noise: NoiseKind,
    pub seed: u64,
    pub sessions: usize,
    pub rows: usize,
}

pub(super) struct Made {
    pub data: SensorData,
    /// The same sensor and session with new noise.
    pub again: SensorData,
    /// Size of each effect beside the others, each by its true formula, in the unit of [`Case::size`].
    pub visible: Vec<f64>,
}

impl Made {
    /// Error on new noise of what a diagnosis found; gain and offset come from the first data.
    pub fn error_of(&self, effects: &[(&'static EffectSpec, Vec<f64>)]) -> f64 {
        let list: Vec<(&EffectSpec, &[f64])> = effects.iter().map(|(s, v)| (*s, v.as_slice())).collect();
        let prepared = prepare(&self.data, usize::MAX).unwrap();
        let force = crate::sensor::candidates::chain(&prepared, &list);
        let columns = [vec![1.0; force.len()], force.clone(), prepared.measured.clone()];
        let fit = Moments::new(&prepared.units, &columns).solve(&Model::baseline(), |_| true);
        let again = prepare(&self.again, usize::MAX).unwrap();
        let sum: f64 = (0..force.len())
            .map(|i| {
                let [offset, gain] = fit.sessions[prepared.session[i]];
                let e = again.measured[i] - offset - gain * force[i];
                e * e
            })
            .sum();
        libm::sqrt(sum / force.len() as f64)
    }
}

/// Grips: ramps of random speed to random forces, with holds.
fn forces(n: usize, step_s: f64, draws: &mut Draws) -> Vec<f64> {
    let mut force = Vec::with_capacity(n);
    let (mut now, mut target, mut rate, mut hold) = (0.0_f64, 0.0_f64, 10.0, 0.3);
    while force.len() < n {
        if hold > 0.0 {
            hold -= step_s;
        } else if (now - target).abs() < rate * step_s {
            now = target;
            hold = 1.5 * draws.uniform();
            target = if target > 5.0 && draws.uniform() < 0.6 { 0.0 } else { 5.0 + 40.0 * draws.uniform() };
            rate = 10.0 * libm::exp(1.8 * draws.uniform());
        } else {
            now += rate * step_s * (target - now).signum();
        }
        force.push(now);
    }
    force
}

/// What an effect adds to the force of a session, in N.
fn added(
    effect: Effect,
    x: &[f64],
    clock: &[f64],
    whole_s: f64,
    step_s: f64,
    temperature: &[f64],
) -> Vec<f64> {
    let slow = |tau: f64| {
        let mut state = x[0];
        x.iter()
            .map(|v| {
                state += (1.0 - libm::exp(-step_s / tau)) * (v - state);
                state
            })
            .collect::<Vec<f64>>()
    };
    let n = x.len();
    match effect {
        Effect::None => vec![0.0; n],
        Effect::Drift => clock.iter().map(|t| 2.0 * libm::pow(t / whole_s, 1.15)).collect(),
        Effect::GainDrift => {
            (0..n).map(|i| 0.1 * x[i] * (1.0 - libm::exp(-1.2 * clock[i] / whole_s))).collect()
        }
        Effect::Quadratic => x.iter().map(|v| 0.002 * v * v * (1.0 - 0.003 * v)).collect(),
        Effect::Saturation => {
            let top = x.iter().fold(0.0_f64, |m, v| m.max(*v)) * 0.75;
            x.iter().map(|v| v / libm::pow(1.0 + libm::pow(v.abs() / top, 24.0), 1.0 / 24.0) - v).collect()
        }
        Effect::Lowpass => {
            let tau = 1.6 * step_s;
            let (mut a, mut b) = (x[0], x[0]);
            let k = 1.0 - libm::exp(-step_s / tau);
            x.iter()
                .map(|v| {
                    a += k * (v - a);
                    b += k * (a - b);
                    b - v
                })
                .collect()
        }
        Effect::Creep => {
            let parts = [(0.3, 0.6), (0.4, 2.0), (0.3, 7.0)].map(|(w, tau)| (w, slow(tau)));
            (0..n).map(|i| 0.06 * parts.iter().map(|(w, s)| w * s[i]).sum::<f64>()).collect()
        }
        Effect::Hysteresis => {
            let mut inner = x[0];
            x.iter()
                .map(|v| {
                    inner = inner.clamp(v - 1.5, v + 1.5);
                    inner - v
                })
                .collect()
        }
        Effect::Temperature => {
            temperature.iter().map(|t| 0.3 * (t - 22.0) + 0.05 * (t - 22.0) * (t - 22.0)).collect()
        }
        Effect::TemperatureGain => (0..n).map(|i| 0.01 * x[i] * (temperature[i] - 22.0)).collect(),
    }
}

pub(super) fn make(case: &Case) -> Made {
    let mut draws = Draws::new(case.seed, 77);
    let step_s = 0.01 * libm::exp(1.5 * draws.uniform());
    let n = case.rows / case.sessions;
    let mut data = SensorData::default();
    let mut clean: Vec<f64> = Vec::new();
    let mut effect = Vec::new();
    let mut each = vec![Vec::new(); case.effects.len()];
    let mut start = 0.0;
    let whole_s = case.sessions as f64 * (n as f64 * step_s + 5.0);
    let mut temperature = Vec::new();
    for s in 0..case.sessions {
        let x = forces(n, step_s, &mut draws);
        let clock: Vec<f64> = (0..n).map(|i| start + i as f64 * step_s).collect();
        let (phase, period) = (6.0 * draws.uniform(), n as f64 * step_s / (1.5 + 2.0 * draws.uniform()));
        let warm: Vec<f64> = clock
            .iter()
            .map(|t| 22.0 + 2.0 * libm::sin(std::f64::consts::TAU * t / period + phase))
            .collect();
        let gain = (0.9 + 0.2 * draws.uniform()) * if case.seed % 4 == 3 { -0.03 } else { 1.0 };
        let offset = gain * 2.0 * draws.normal();
        let mut sum = vec![0.0; n];
        for (e, own) in case.effects.iter().zip(&mut each) {
            let added = added(*e, &x, &clock, whole_s, step_s, &warm);
            for (total, v) in sum.iter_mut().zip(&added) {
                *total += v;
            }
            own.extend(added.iter().map(|v| gain * v));
        }
        effect.extend(sum.iter().map(|v| gain * v));
        clean.extend(x.iter().zip(&sum).map(|(v, e)| offset + gain * (v + e)));
        data.time_s.extend(&clock);
        data.reference_force_n.extend(&x);
        data.session.extend(std::iter::repeat_n(s, n));
        data.sessions.push(format!("S{}", s + 1));
        temperature.extend(warm);
        start += n as f64 * step_s + 5.0;
    }
    data.extra.push(("temperature_c".into(), Covariate::Number(temperature)));
    data.measured_force_n.clone_from(&clean);
    let prepared = prepare(&data, usize::MAX).unwrap();
    let shape = match case.noise {
        NoiseKind::White => Noise::WHITE,
        NoiseKind::Slow => Noise { correlation: 0.97, white: 0.0 },
        NoiseKind::Mixed | NoiseKind::Smooth => Noise { correlation: 0.95, white: 0.5 },
    };
    let mut columns = vec![vec![1.0; clean.len()], data.reference_force_n.clone(), effect];
    let whitener = Whitener::new(shape, &prepared.group_steps);
    columns.iter_mut().for_each(|c| whitener.apply(c));
    let together = Moments::new(&prepared.units, &columns).solve(&Model::baseline(), |_| true).left;
    let mut beside = vec![vec![1.0; clean.len()], data.reference_force_n.clone()];
    beside.extend(each);
    beside.iter_mut().for_each(|c| whitener.apply(c));
    let scale = data.reference_force_n.iter().zip(&clean).map(|(_, c)| c.abs()).fold(0.0, f64::max);
    let size =
        if case.effects == [Effect::None] { 0.01 * scale } else { libm::sqrt(together) / (case.size * 3.42) };
    let visible = (2..beside.len())
        .map(|i| {
            let mut columns = beside.clone();
            let own = columns.remove(i);
            let others: Vec<usize> = (2..columns.len()).collect();
            columns.push(own);
            let left = Moments::new(&prepared.units, &columns);
            let model = others.iter().fold(Model::baseline(), |m, &c| m.with(&[c]));
            libm::sqrt(left.solve(&model, |_| true).left) / (size * 3.42)
        })
        .collect();
    let noisy = |lane: u64| {
        let mut draws = Draws::new(case.seed, lane);
        let mut noise = draw(shape, &prepared.group_steps, &mut draws);
        if case.noise == NoiseKind::Smooth {
            let mut state = 0.0;
            for v in &mut noise {
                state += 0.2 * (*v - state);
                *v = 1.5 * state;
            }
        }
        let mut new = data.clone();
        new.measured_force_n = clean.iter().zip(&noise).map(|(c, e)| c + size * e).collect();
        new
    };
    Made { data: noisy(1), again: noisy(2), visible }
}
