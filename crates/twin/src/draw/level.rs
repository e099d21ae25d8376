//! Levels of randomness: what shares a draw.

use super::{Distribution, Drawn, VariedKey, fnv1a, random_coordinate};
use crate::random::normal_quantile;
use std::fmt;

/// What shares a draw of a key. Laboratories differ in their rigs, a rig changes its gels, a gel is used in sessions: numbers that
/// differ between them and not within them are drawn once for each.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Default)]
pub enum Level {
    /// All samples with one `rig_id`.
    Rig,
    /// All samples with one `gel_id`.
    Gel,
    /// All samples with one `session`.
    Session,
    /// All samples with one `part`.
    Part,
    /// The repetitions of one configuration; one sample without `repetitions`.
    #[default]
    Grip,
    /// One sample, also among the repetitions of a configuration.
    Sample,
}

impl Level {
    /// All levels, in the order in which they contain each other.
    pub const ALL: [Level; 6] =
        [Level::Rig, Level::Gel, Level::Session, Level::Part, Level::Grip, Level::Sample];

    /// Its name in a sweep file.
    pub fn name(self) -> &'static str {
        match self {
            Level::Rig => "rig",
            Level::Gel => "gel",
            Level::Session => "session",
            Level::Part => "part",
            Level::Grip => "grip",
            Level::Sample => "sample",
        }
    }

    /// The column whose words tell its groups apart; `None` of those that a sample has by its index.
    pub fn column(self) -> Option<&'static str> {
        match self {
            Level::Rig => Some("rig_id"),
            Level::Gel => Some("gel_id"),
            Level::Session => Some("session"),
            Level::Part => Some("part"),
            Level::Grip | Level::Sample => None,
        }
    }
}

impl fmt::Display for Level {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl VariedKey {
    /// A key whose values are drawn for each configuration.
    pub fn new(key: impl Into<String>, distribution: Distribution) -> Self {
        Self { key: key.into(), distribution, per: vec![Level::default()], spread: vec![], limits: None }
    }

    /// Values that show whether the key can be drawn: those of its distribution within the limits, and the limits.
    pub(crate) fn extremes(&self) -> Vec<Drawn> {
        let ends = self.limits.into_iter().flatten().map(Drawn::Number);
        self.distribution.extremes().into_iter().map(|value| self.limited(value)).chain(ends).collect()
    }

    /// The ends of what is drawn: those of the distribution, `deviations` standard deviations away where it has none.
    pub fn reach(&self, deviations: f64) -> Vec<Drawn> {
        let own = match self.distribution {
            Distribution::Normal { deviation, .. } | Distribution::LogNormal { deviation, .. } => deviation,
            _ => 0.0,
        };
        let squares = self.spread.iter().map(|(_, x)| x * x).sum::<f64>() + own * own;
        let away = deviations * libm::sqrt(squares);
        let moved = |value: &Drawn, by: f64| match value {
            Drawn::Number(x) if self.multiplies() => Drawn::Number(x * libm::exp(by)),
            Drawn::Number(x) => Drawn::Number(x + by),
            word => word.clone(),
        };
        let middles = self.distribution.extremes();
        let both = middles.iter().flat_map(|value| [moved(value, -away), moved(value, away)]);
        both.map(|value| self.limited(value)).collect()
    }

    fn limited(&self, value: Drawn) -> Drawn {
        match (value, self.limits) {
            (Drawn::Number(x), Some([low, high])) => Drawn::Number(x.clamp(low, high)),
            (value, _) => value,
        }
    }

    /// Every level at which something is drawn for this key.
    pub fn levels(&self) -> impl Iterator<Item = Level> + '_ {
        self.per.iter().copied().chain(self.spread.iter().map(|(level, _)| *level))
    }

    /// Whether each configuration has its own draw, as where a sweep says nothing of levels.
    pub fn is_per_grip(&self) -> bool {
        self.per == [Level::Grip]
    }

    /// Whether the further levels multiply the value: those of a logarithmic distribution do, the others add.
    fn multiplies(&self) -> bool {
        matches!(self.distribution, Distribution::LogUniform { .. } | Distribution::LogNormal { .. })
    }

    /// The value of a sample. `at` gives a number in (0, 1) for some levels: the same for all samples of one group of each.
    pub(crate) fn value(&self, at: impl Fn(&[Level]) -> f64) -> Drawn {
        let mut value = match self.distribution.at(at(&self.per)) {
            Drawn::Number(x) => x,
            word => return word,
        };
        for (level, deviation) in &self.spread {
            let step = deviation * normal_quantile(at(std::slice::from_ref(level)));
            value = if self.multiplies() { value * libm::exp(step) } else { value + step };
        }
        self.limited(Drawn::Number(value))
    }
}

impl VariedKey {
    /// As it stands in `[vary]`.
    pub fn to_toml(&self) -> toml::Value {
        let plain = self.distribution.to_toml();
        if self.is_per_grip() && self.spread.is_empty() && self.limits.is_none() {
            return plain;
        }
        let mut table = match plain {
            toml::Value::Table(table) => table,
            list => toml::Table::from_iter([("one_of".to_string(), list)]),
        };
        if !self.is_per_grip() {
            let mut names: Vec<toml::Value> = self.per.iter().map(|level| level.name().into()).collect();
            let several = names.len() > 1;
            let per = if several { names.into() } else { names.remove(0) };
            table.insert("per".into(), per);
        }
        if !self.spread.is_empty() {
            let levels = self.spread.iter().map(|(level, x)| (level.name().into(), toml::Value::Float(*x)));
            table.insert("spread".into(), toml::Value::Table(levels.collect()));
        }
        if let Some(ends) = self.limits {
            table.insert("limits".into(), toml::Value::Array(ends.map(toml::Value::Float).to_vec()));
        }
        toml::Value::Table(table)
    }
}

/// A uniform number for a key in a group of each of some levels, independent of all other keys, levels and groups.
pub(crate) fn level_coordinate(seed: u64, levels: &[Level], groups: &str, key: &str) -> f64 {
    let names: Vec<&str> = levels.iter().map(|level| level.name()).collect();
    random_coordinate(seed, fnv1a(groups), &format!("{key} per {}", names.join(", ")))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(d: Drawn) -> f64 {
        match d {
            Drawn::Number(x) => x,
            Drawn::Text(t) => panic!("{t} is no number"),
        }
    }

    /// Deviations of independent levels add in squares, on the scale of the distribution.
    #[test]
    fn variances_of_levels_add() {
        let of = |distribution, spread: &[(Level, f64)]| VariedKey {
            spread: spread.to_vec(),
            per: vec![Level::Part],
            ..VariedKey::new("key", distribution)
        };
        let log = of(
            Distribution::LogNormal { median: 0.2, deviation: 0.3 },
            &[(Level::Gel, 0.12), (Level::Sample, 0.05)],
        );
        let plain = of(Distribution::Normal { mean: 1.0, deviation: 0.4 }, &[(Level::Session, 0.3)]);
        let draws = |key: &VariedKey| -> Vec<f64> {
            (0..20_000)
                .map(|i| number(key.value(|levels| level_coordinate(7, levels, &format!("{i}"), "key"))))
                .collect()
        };
        let moments = |x: &[f64]| {
            let n = x.len() as f64;
            let mean = x.iter().sum::<f64>() / n;
            (mean, (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / n).sqrt())
        };
        let (mean, deviation) = moments(&draws(&log).iter().map(|x| x.ln()).collect::<Vec<_>>());
        let wanted = (0.3_f64.powi(2) + 0.12_f64.powi(2) + 0.05_f64.powi(2)).sqrt();
        assert!((mean - 0.2_f64.ln()).abs() < 0.01 && (deviation / wanted - 1.0).abs() < 0.02, "{deviation}");
        let (mean, deviation) = moments(&draws(&plain));
        assert!((mean - 1.0).abs() < 0.015 && (deviation / 0.5 - 1.0).abs() < 0.02, "{mean} {deviation}");
    }

    #[test]
    fn values_beyond_limits_are_set_to_them() {
        let mut key = VariedKey::new("key", Distribution::Normal { mean: 0.0, deviation: 1.0 });
        key.limits = Some([-0.5, 2.0]);
        assert_eq!(number(key.value(|_| 0.001)), -0.5);
        assert_eq!(number(key.value(|_| 0.5)), 0.0);
    }
}
