//! Which effects of the library compete for a campaign, and where their fits start.

use super::data::{Column, PullData};
use super::model::ModelEffect;
use crate::least_squares::FreeParameter;
use gripgen_twin::PULLS_SINCE_REST;
use gripgen_twin::effects::{EffectSpec, LIBRARY};

/// An effect that competes.
#[derive(Debug, Clone)]
pub struct Candidate {
    /// Which.
    pub spec: &'static EffectSpec,
    /// Values from which its fit starts: the best of these fits counts.
    pub starts: Vec<Vec<f64>>,
    /// Which parameters are fitted, with their scales.
    pub free: Vec<(usize, f64)>,
    /// The only part it acts on, by position and name, or all.
    pub part: Option<(usize, String)>,
    /// Parameters that are tried at the starts only, like the pull at which something happened.
    pub searched: usize,
}

impl Candidate {
    /// The effect with some values.
    pub fn with(&self, values: &[f64]) -> ModelEffect {
        ModelEffect { part: self.part.as_ref().map(|p| p.0), ..ModelEffect::new(self.spec, values.to_vec()) }
    }

    /// The same effect once for each part.
    pub fn by_part(&self, parts: &[String]) -> Vec<Self> {
        let own = |(k, name): (usize, &String)| Self { part: Some((k, name.clone())), ..self.clone() };
        parts.iter().enumerate().map(own).collect()
    }

    /// Its free parameters from a start.
    pub fn parameters(&self, start: &[f64]) -> Vec<FreeParameter> {
        self.free
            .iter()
            .map(|&(i, scale)| {
                let p = &self.spec.parameters[i];
                let mut bounds = p.bounds;
                // A gel that settles once to less friction is worn, which is another effect.
                match (self.spec.id, p.name) {
                    ("conditioning", "depth") if start[2] == 0.0 => bounds.0 = 0.0,
                    // A wider one is no transition but a saturation or a power law.
                    ("regime_transition", "width_n") => bounds.1 = 6.0,
                    // What comes late is a part of the response; one that goes back is a lag of another kind.
                    ("sensor_creep", "fraction") => bounds.0 = 0.0,
                    _ => {}
                }
                FreeParameter { name: self.name_of(p.name), start: start[i], bounds, scale }
            })
            .collect()
    }

    /// Name of a parameter in a fit.
    pub fn name_of(&self, parameter: &str) -> String {
        match &self.part {
            Some((_, part)) => format!("{}@{part}.{parameter}", self.spec.id),
            None => format!("{}.{parameter}", self.spec.id),
        }
    }

    /// Parameters that the data have to pay for.
    pub fn cost(&self) -> usize {
        self.free.len() + self.searched
    }

    /// Whether it changes readings or commands.
    pub fn acts_on_signals(&self) -> bool {
        self.spec.sensor.is_some() || self.spec.command.is_some()
    }

    /// Position of the parameter that says how large the effect is.
    pub fn size(&self) -> usize {
        self.free.first().map_or(0, |f| f.0)
    }
}

/// Values of `names`, the others neutral.
fn values(spec: &EffectSpec, named: &[(&str, f64)]) -> Vec<f64> {
    let value =
        |name: &str, neutral: f64| named.iter().find(|(n, _)| *n == name).map_or(neutral, |(_, v)| *v);
    spec.parameters.iter().map(|p| value(p.name, p.neutral)).collect()
}

/// The effects of the library that can show in these pulls: those whose covariates vary. `without` are ids that must not
/// compete.
pub fn candidates(data: &PullData<'_>, most_reading_n: f64, without: &[&str]) -> Vec<Candidate> {
    LIBRARY
        .iter()
        .filter(|s| !without.contains(&s.id))
        .filter_map(|spec| candidate(spec, data, most_reading_n))
        .collect()
}

pub(super) fn candidate(spec: &'static EffectSpec, data: &PullData<'_>, most_n: f64) -> Option<Candidate> {
    let varies = |name: &str| data.varies(name);
    let rate = varies("force_increment_n") || varies("step_time_s");
    // A clock and a count of pulls always run.
    let last_pull = numbers(data, "pull_index").into_iter().fold(0.0, f64::max).max(4.0);
    let plain = |starts: &[&[(&str, f64)]], free: &[(&str, f64)], searched: usize| {
        let starts = starts.iter().map(|s| values(spec, s)).collect();
        let free = free
            .iter()
            .filter_map(|(name, scale)| Some((spec.parameters.iter().position(|p| p.name == *name)?, *scale)))
            .collect();
        Some(Candidate { spec, starts, free, part: None, searched })
    };
    let over = |name: &str, at: &[f64], other: (&str, f64), free: &[(&str, f64)], searched: usize| {
        let starts = at.iter().map(|x| values(spec, &[(name, *x), other])).collect();
        let free = free
            .iter()
            .filter_map(|(name, scale)| Some((spec.parameters.iter().position(|p| p.name == *name)?, *scale)))
            .collect();
        Some(Candidate { spec, starts, free, part: None, searched })
    };
    let force = varies("grip_force_n");
    match spec.id {
        "load_offset" if force => plain(&[&[("b_n", 0.0)]], &[("b_n", 1.0)], 0),
        "load_power_law" if force => plain(&[&[("n", 0.0)]], &[("n", 0.05)], 0),
        "area_saturation" if force => {
            over("sharpness", &[1.0, 2.5], ("saturation_per_n", 0.004), &[("saturation_per_n", 0.002)], 1)
        }
        "regime_transition" if force => {
            let mut starts = Vec::new();
            for f_c in [10.0, 15.0, 20.0, 25.0, 35.0, 50.0] {
                for step in [0.15, -0.15] {
                    starts.push(values(spec, &[("f_c_n", f_c), ("step", step), ("width_n", 2.0)]));
                }
            }
            Some(Candidate {
                spec,
                starts,
                free: vec![(0, 0.1), (1, 3.0), (2, 1.0)],
                part: None,
                searched: 0,
            })
        }
        "rate_dependence" if rate => plain(&[&[("k", 0.0)]], &[("k", 0.02)], 0),
        "dwell_ageing" if varies("dwell_s") => plain(&[&[("beta", 0.01)]], &[("beta", 0.01)], 0),
        "anisotropy" if varies("grip_angle_deg") => over(
            "axis_deg",
            &[-67.5, -22.5, 22.5, 67.5],
            ("amplitude", 0.08),
            &[("amplitude", 0.05), ("axis_deg", 10.0)],
            0,
        ),
        "contamination" if varies("pull_index") => {
            let at = splits(data);
            over("at_pull_index", &at, ("drop", 0.0), &[("drop", 0.05)], 1)
        }
        "wear" if varies("pull_index") => over(
            "n0",
            &[0.1 * last_pull, 0.5 * last_pull, 3.0 * last_pull],
            ("depth", 0.1),
            &[("depth", 0.05), ("n0", 0.3 * last_pull)],
            0,
        ),
        "conditioning" if varies("pull_index") => {
            let rested =
                data.measured.pulls.iter().any(|p| p.covariates.extra.contains_key(PULLS_SINCE_REST));
            let mut starts = Vec::new();
            for n0 in [2.0, 6.0, 20.0] {
                starts.push(values(spec, &[("n0", n0), ("depth", 0.1)]));
                if rested {
                    starts.push(values(spec, &[("n0", n0), ("depth", 0.1), ("rests", 1.0)]));
                    starts.push(values(spec, &[("n0", n0), ("depth", -0.1), ("rests", 1.0)]));
                }
            }
            let free = vec![(0, 0.05), (1, 2.0)];
            Some(Candidate { spec, starts, free, part: None, searched: usize::from(rested) })
        }
        "temperature" if varies("temperature_c") => plain(&[&[("k_per_k", 0.0)]], &[("k_per_k", 0.005)], 0),
        "grip_relaxation" if varies("dwell_s") => {
            over("tau_s", &[1.0, 8.0, 60.0], ("depth", 0.08), &[("depth", 0.05), ("tau_s", 5.0)], 0)
        }
        "jaw_tilt" if varies("pull_direction") => plain(&[&[("tilt_deg", 0.0)]], &[("tilt_deg", 0.3)], 0),
        "off_centre" if varies("grip_offset_mm") => over(
            "inverse_lever_per_mm",
            &[0.04, 0.12],
            ("inverse_lever_per_mm", 0.08),
            &[("inverse_lever_per_mm", 0.02)],
            0,
        ),
        "grip_force_loss" if force => plain(&[&[("loss_n", 0.0)]], &[("loss_n", 0.5)], 0),
        "sensor_gain" => plain(&[&[("gain", 1.0)]], &[("gain", 0.05)], 0),
        "sensor_bias" => plain(&[&[("bias_n", 0.0)]], &[("bias_n", 0.2)], 0),
        "sensor_drift" if varies("time_s") => plain(&[&[("rate_n_per_h", 0.0)]], &[("rate_n_per_h", 0.2)], 0),
        "sensor_gain_drift" if varies("time_s") => {
            plain(&[&[("rate_per_h", 0.0)]], &[("rate_per_h", 0.02)], 0)
        }
        "sensor_hysteresis" => over(
            "force_scale_n",
            &[3.0, 15.0],
            ("amplitude_n", 0.3),
            &[("amplitude_n", 0.3), ("force_scale_n", 3.0)],
            0,
        ),
        "sensor_quadratic" if force => {
            let odd: &[f64] = if varies("pull_direction") { &[0.0, 1.0] } else { &[0.0] };
            over("odd", odd, ("quadratic_per_n", 0.0), &[("quadratic_per_n", 0.001)], 0)
        }
        "sensor_saturation" => over(
            "limit_n",
            &[0.7 * most_n, 0.95 * most_n],
            ("limit_n", 0.8 * most_n),
            &[("limit_n", 0.03 * most_n)],
            0,
        ),
        "sensor_lowpass" => over("tau_s", &[0.03, 0.15], ("tau_s", 0.05), &[("tau_s", 0.02)], 0),
        "sensor_creep" => {
            over("tau_s", &[1.0, 8.0], ("fraction", 0.05), &[("fraction", 0.03), ("tau_s", 1.0)], 0)
        }
        "controller_gain" => plain(&[&[("gain", 1.0)]], &[("gain", 0.05)], 0),
        "deadband" => plain(&[&[("width_n", 1.0)], &[("width_n", 2.0)]], &[("width_n", 0.2)], 0),
        _ => None,
    }
}

fn numbers(data: &PullData<'_>, name: &str) -> Vec<f64> {
    match data.columns.get(name) {
        Some(Column::Number(x)) => x.clone(),
        _ => vec![],
    }
}

/// Pull indices at which something may have happened: between any two of about thirty parts of the campaign.
fn splits(data: &PullData<'_>) -> Vec<f64> {
    let mut at = numbers(data, "pull_index");
    at.sort_by(f64::total_cmp);
    at.dedup();
    let n = at.len();
    let margin = (n / 20).max(3);
    let count = 36.min(n);
    let mut found: Vec<f64> = (0..count)
        .map(|i| margin + i * n.saturating_sub(2 * margin) / count.max(1))
        .filter_map(|i| at.get(i).copied())
        .collect();
    found.dedup();
    found
}
