//! What is believed before the first pull: the shipped beliefs, and what a twin knows of its rig from other pulls.

use gripgen::assets;
use gripgen_identify::pulls::priors::{Prior, PullPriors};
use gripgen_twin::config::Document;
use gripgen_twin::effects::OFFSET_LAW;
use gripgen_twin::{MeasuredPulls, Twin};

/// Width of a 90 % interval in standard deviations.
const WIDTH90: f64 = 2.0 * 1.644_853_626_951_472_2;

/// Least standard deviation of a kinetic ratio that comes from other parts, and of the logarithm of a scatter.
const OTHER_PARTS: (f64, f64) = (0.01, 0.25);

/// The shipped beliefs. That on the lag lies about the lag of `twin`.
///
/// # Panics
/// If the shipped file is not what it is: a test reads it.
pub fn shipped_priors(twin: &Twin) -> PullPriors {
    let table: toml::Table = assets::text("priors/pulls.toml").parse().expect("a test reads the priors");
    let number = |name: &str, key: &str| table[name].get(key).and_then(toml::Value::as_float);
    let prior = |name: &str| {
        let log = number(name, "log_sd");
        Prior {
            centre: number(name, "median").or(number(name, "mean")).unwrap_or(twin.robot.lag_s),
            spread: log.or(number(name, "sd")).expect("every prior has a width"),
            log: log.is_some(),
            bounds: (
                number(name, "low").expect("every prior ends"),
                number(name, "high").expect("every prior ends"),
            ),
            source: table[name]["source"].as_str().unwrap_or_default().into(),
        }
    };
    PullPriors {
        mu: prior("mu"),
        offset_n: prior("offset_n"),
        kinetic_ratio: prior("kinetic_ratio"),
        lag_s: prior("lag_s"),
        noise_n: prior("noise_n"),
        scatter: prior("scatter"),
    }
}

/// The shipped beliefs, with what the twin in `document` was calibrated to on other parts and other pulls than `measured`: kinetic
/// ratio, lag, noise, scatter, and the offsets of these parts.
pub fn pull_priors(twin: &Twin, document: &Document, measured: &MeasuredPulls) -> PullPriors {
    let mut priors = shipped_priors(twin);
    let known = |section: &str, leaf: &str| known(document, section, leaf, &measured.sha256);
    for (section, leaf, prior) in
        [("robot", "lag_s", &mut priors.lag_s), ("wrist", "noise_n", &mut priors.noise_n)]
    {
        // An interval without a width says that nobody knows.
        if let Some((value, sd)) = known(section, leaf).filter(|(value, sd)| *sd > 0.0 && *value > 0.0) {
            (prior.centre, prior.spread) = (value, if prior.log { sd / value } else { sd });
            prior.source = format!("{section}.{leaf} of the twin");
        }
    }
    let measured_part = |name: &str| measured.pulls.iter().any(|p| p.part == name);
    let others: Vec<&String> = twin.parts.keys().filter(|name| !measured_part(name)).collect();
    let ratios: Vec<(f64, f64)> =
        others.iter().filter_map(|name| known(&format!("parts.{name}"), "kinetic_ratio")).collect();
    if let Some((mean, sd)) = pooled(&ratios) {
        let prior = &mut priors.kinetic_ratio;
        (prior.centre, prior.spread) = (mean, sd.max(OTHER_PARTS.0));
        prior.source = format!("kinetic_ratio of {} calibrated parts of the twin", ratios.len());
    }
    let calibrated =
        || others.iter().filter(|name| known(&format!("parts.{name}"), "kinetic_ratio").is_some());
    let scatters: Vec<f64> =
        calibrated().map(|name| twin.parts[*name].scatter).filter(|s| *s > 0.0).collect();
    if !scatters.is_empty() {
        let prior = &mut priors.scatter;
        let log = scatters.iter().map(|s| libm::log(*s)).sum::<f64>() / scatters.len() as f64;
        (prior.centre, prior.spread) = (libm::exp(log), OTHER_PARTS.1);
        prior.source = format!("scatter of {} calibrated parts of the twin", scatters.len());
    }
    let laws = twin.effects.iter().filter(|e| e.spec == OFFSET_LAW).filter_map(|e| {
        let part = e.part.as_deref().filter(|part| !measured_part(part))?;
        known(&format!("effects.{}.{part}", OFFSET_LAW.id), "b_n")?;
        Some(e.values[1] / e.values[0])
    });
    let offsets: Vec<f64> = laws.collect();
    if !offsets.is_empty() {
        of_other_parts(&mut priors.offset_n, &offsets);
    }
    priors
}

/// The offset of a further part, of those of others: normal with unknown mean and variance, the belief worth one part and two degrees
/// of freedom.
fn of_other_parts(prior: &mut Prior, offsets: &[f64]) {
    let n = offsets.len() as f64;
    let mean = offsets.iter().sum::<f64>() / n;
    let square: f64 = offsets.iter().map(|b| (b - mean) * (b - mean)).sum();
    let about = prior.centre;
    let between =
        (2.0 * prior.spread * prior.spread + square + n / (n + 1.0) * (mean - about) * (mean - about))
            / (2.0 + n);
    prior.centre = (about + n * mean) / (n + 1.0);
    prior.spread = (between * (n + 2.0) / (n + 1.0)).sqrt();
    prior.source = format!("{}, and the laws of {} parts of the twin", prior.source, offsets.len());
}

/// A value of the twin with its standard deviation, where it was fitted to other data.
fn known(document: &Document, section: &str, leaf: &str, sha256: &str) -> Option<(f64, f64)> {
    let number = |key: &str| document.get(key).and_then(toml::Value::as_float);
    let own = format!("{section}.calibration.{leaf}");
    let data = document.get(&format!("{own}.data_sha256")).and_then(toml::Value::as_str);
    if data == Some(sha256) {
        return None;
    }
    let (low, high) = (number(&format!("{own}.low90"))?, number(&format!("{own}.high90"))?);
    Some((number(&format!("{section}.{leaf}"))?, (high - low).max(0.0) / WIDTH90))
}

/// Mean of values, and the standard deviation of a further one.
fn pooled(values: &[(f64, f64)]) -> Option<(f64, f64)> {
    let n = values.len() as f64;
    let mean = values.iter().map(|(x, _)| x).sum::<f64>() / n;
    let variance = values.iter().map(|(x, sd)| sd * sd + (x - mean) * (x - mean)).sum::<f64>() / n;
    (!values.is_empty()).then_some((mean, variance.sqrt()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn offsets_of_other_parts_move_the_belief_and_narrow_it_where_they_agree() {
        let belief = Prior::normal(0.0, 6.8, (-20.0, 20.0), "a table");
        let (mut alike, mut apart) = (belief.clone(), belief);
        of_other_parts(&mut alike, &[-4.0, -4.2, -3.8, -4.0]);
        of_other_parts(&mut apart, &[-12.0, 4.0, -9.0, 1.0]);
        assert!((alike.centre + 3.2).abs() < 1e-9, "{alike:?}");
        assert!(alike.spread < 5.0 && apart.spread > 7.0, "{alike:?} {apart:?}");
    }
}
