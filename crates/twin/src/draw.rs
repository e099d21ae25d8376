//! What varies from sample to sample, and by how much.

mod level;

pub use level::Level;
pub(crate) use level::level_coordinate;

use crate::random::{Purpose, Stream, normal_quantile};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::fmt;

/// A drawn value.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "a number or a word is needed")]
pub enum Drawn {
    /// A number.
    Number(f64),
    /// A word: a part, a gel.
    Text(String),
}

impl fmt::Display for Drawn {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Drawn::Number(x) => write!(f, "{x}"),
            Drawn::Text(text) => f.write_str(text),
        }
    }
}

impl Drawn {
    /// As it stands in a configuration.
    pub fn to_toml(&self) -> toml::Value {
        match self {
            Drawn::Number(x) => toml::Value::Float(*x),
            Drawn::Text(text) => toml::Value::String(text.clone()),
        }
    }
}

/// Where the values of a key come from.
#[derive(Debug, Clone, PartialEq)]
pub enum Distribution {
    /// One of a list, equally likely; a grid takes all of them.
    Choice(Vec<Drawn>),
    /// Equally likely anywhere between the ends.
    Uniform {
        /// Lower end.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Equally likely on a logarithmic scale.
    LogUniform {
        /// Lower end, more than 0.
        low: f64,
        /// Upper end.
        high: f64,
    },
    /// Gaussian.
    Normal {
        /// Mean.
        mean: f64,
        /// Standard deviation.
        deviation: f64,
    },
    /// Gaussian in the natural logarithm.
    LogNormal {
        /// Median.
        median: f64,
        /// Standard deviation of the natural logarithm.
        deviation: f64,
    },
    /// The calibrated uncertainty that stands beside the key in the twin; becomes `Normal` when a sweep is
    /// planned.
    Interval,
    /// Of the key `twin`: cause and parameters together, from the draws in a file; the one beside the twin where it is `None`. A
    /// sweep draws from it with [`crate::Sweep::with_posterior`].
    Posterior {
        /// The file, called from where the twin is.
        file: Option<String>,
    },
}

/// A key of `[vary]`.
#[derive(Debug, Clone, PartialEq)]
pub struct VariedKey {
    /// Dotted key.
    pub key: String,
    /// Where its values come from.
    pub distribution: Distribution,
    /// What shares a draw: samples that are of one group of each of these levels.
    pub per: Vec<Level>,
    /// Standard deviations of what further levels add; of a logarithmic distribution, of the natural logarithm of their factors.
    pub spread: Vec<(Level, f64)>,
    /// Ends that the value is kept within.
    pub limits: Option<[f64; 2]>,
}

impl Distribution {
    /// The value at probability `u` in (0, 1): the inverse of the distribution function.
    ///
    /// # Panics
    /// For [`Distribution::Interval`], which planning replaces, and [`Distribution::Posterior`], which is not one number.
    pub fn at(&self, u: f64) -> Drawn {
        Drawn::Number(match self {
            Distribution::Choice(values) => {
                let i = ((u * values.len() as f64) as usize).min(values.len() - 1);
                return values[i].clone();
            }
            Distribution::Uniform { low, high } => low + (high - low) * u,
            Distribution::LogUniform { low, high } => {
                let (a, b) = (libm::log(*low), libm::log(*high));
                libm::exp(a + (b - a) * u)
            }
            Distribution::Normal { mean, deviation } => mean + deviation * normal_quantile(u),
            Distribution::LogNormal { median, deviation } => {
                median * libm::exp(deviation * normal_quantile(u))
            }
            Distribution::Interval => unreachable!("a planned sweep has no interval left"),
            Distribution::Posterior { .. } => unreachable!("a posterior gives a draw of many keys"),
        })
    }

    /// Values that show whether the distribution stays inside what its key allows: all of a list, the ends of
    /// an interval, the middle of a Gaussian.
    pub fn extremes(&self) -> Vec<Drawn> {
        match self {
            Distribution::Choice(values) => values.clone(),
            Distribution::Uniform { low, high } | Distribution::LogUniform { low, high } => {
                vec![Drawn::Number(*low), Drawn::Number(*high)]
            }
            Distribution::Normal { mean: middle, .. } | Distribution::LogNormal { median: middle, .. } => {
                vec![Drawn::Number(*middle)]
            }
            Distribution::Interval | Distribution::Posterior { .. } => vec![],
        }
    }

    /// The only value that it has; `None` of one that gives several, or none of its own.
    pub fn constant(&self) -> Option<&Drawn> {
        match self {
            Distribution::Choice(values) => values.first().filter(|first| values.iter().all(|v| v == *first)),
            _ => None,
        }
    }

    /// As it stands in `[vary]` where nothing is said of levels.
    pub fn to_toml(&self) -> toml::Value {
        let pair = |name: &str, a: f64, b: f64| {
            let numbers = vec![toml::Value::Float(a), toml::Value::Float(b)];
            toml::Value::Table(toml::Table::from_iter([(name.to_string(), toml::Value::Array(numbers))]))
        };
        match self {
            Distribution::Choice(values) => toml::Value::Array(values.iter().map(Drawn::to_toml).collect()),
            Distribution::Uniform { low, high } => pair("uniform", *low, *high),
            Distribution::LogUniform { low, high } => pair("log_uniform", *low, *high),
            Distribution::Normal { mean, deviation } => pair("normal", *mean, *deviation),
            Distribution::LogNormal { median, deviation } => pair("log_normal", *median, *deviation),
            Distribution::Interval => {
                let from = ("from".to_string(), toml::Value::String("interval".into()));
                toml::Value::Table(toml::Table::from_iter([from]))
            }
            Distribution::Posterior { file } => {
                let from = ("from".to_string(), toml::Value::String("posterior".into()));
                let file = file.iter().map(|file| ("file".to_string(), toml::Value::String(file.clone())));
                toml::Value::Table(toml::Table::from_iter([from].into_iter().chain(file)))
            }
        }
    }
}

/// A uniform number for key `key` of configuration `group`: independent of all other keys and groups.
pub(crate) fn random_coordinate(seed: u64, group: u64, key: &str) -> f64 {
    Stream::with_lane(seed, group, Purpose::Draw, fnv1a(key)).uniform()
}

/// 64-bit FNV-1a of a key, so that adding one key leaves the draws of the others alone.
pub(crate) fn fnv1a(key: &str) -> u64 {
    key.bytes()
        .fold(0xcbf2_9ce4_8422_2325, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(d: &Drawn) -> f64 {
        match d {
            Drawn::Number(x) => *x,
            Drawn::Text(t) => panic!("{t} is no number"),
        }
    }

    #[test]
    fn quantiles_of_the_distributions() {
        let uniform = Distribution::Uniform { low: 20.0, high: 80.0 };
        assert_eq!(number(&uniform.at(0.25)), 35.0);
        let log = Distribution::LogUniform { low: 0.01, high: 1.0 };
        assert!(
            (number(&log.at(0.5)) - 0.1).abs() < 1e-15,
            "the median of a log-uniform is the geometric mean"
        );
        let normal = Distribution::Normal { mean: 3.0, deviation: 2.0 };
        assert_eq!(number(&normal.at(0.5)), 3.0);
        assert!((number(&normal.at(0.975)) - (3.0 + 2.0 * 1.959_963_984_540_054)).abs() < 1e-12);
        let choice = Distribution::Choice(vec![Drawn::Number(1.0), Drawn::Number(2.0), Drawn::Number(3.0)]);
        let counts = (0..3000).fold([0; 3], |mut c, i| {
            c[number(&choice.at((f64::from(i) + 0.5) / 3000.0)) as usize - 1] += 1;
            c
        });
        assert_eq!(counts, [1000; 3]);
    }

    #[test]
    fn a_list_of_one_value_is_constant() {
        let of = |values: &[f64]| Distribution::Choice(values.iter().map(|&x| Drawn::Number(x)).collect());
        assert_eq!(of(&[3.0, 3.0]).constant(), Some(&Drawn::Number(3.0)));
        assert_eq!(of(&[3.0, 4.0]).constant(), None);
        assert_eq!(Distribution::Uniform { low: 1.0, high: 2.0 }.constant(), None);
    }

    #[test]
    fn coordinates_of_different_keys_are_independent() {
        let pairs: Vec<(f64, f64)> =
            (0..4000).map(|g| (random_coordinate(1, g, "a"), random_coordinate(1, g, "b"))).collect();
        let n = pairs.len() as f64;
        let covariance = pairs.iter().map(|(x, y)| (x - 0.5) * (y - 0.5)).sum::<f64>() / n;
        assert!(covariance.abs() < 4.0 / 12.0 / n.sqrt(), "{covariance}");
    }
}
