//! Reading the values of `[vary]`.

use super::{ConfigError, suggestion};
use crate::draw::{Distribution, Drawn, Level, VariedKey};
use crate::scenario::keys::{pull_keys, scenario_keys};

/// Names of the distributions.
const NAMES: [&str; 6] = ["uniform", "normal", "log_uniform", "log_normal", "one_of", "from"];

/// What may stand with a distribution: what shares a draw, what further levels add, and where values end.
const WITH: [&str; 3] = ["per", "spread", "limits"];

/// Reads all entries of `[vary]`, sorted by key. Nested tables count as dotted keys.
pub(crate) fn read(vary: &toml::Table) -> Result<Vec<VariedKey>, ConfigError> {
    let mut keys = Vec::new();
    collect(vary, "", &mut keys)?;
    keys.sort_by(|a, b| a.key.cmp(&b.key));
    Ok(keys)
}

fn collect(table: &toml::Table, prefix: &str, keys: &mut Vec<VariedKey>) -> Result<(), ConfigError> {
    for (name, value) in table {
        let key = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
        match value {
            toml::Value::Table(inner) if !is_distribution(&key, inner) => collect(inner, &key, keys)?,
            _ => keys.push(varied(key, value)?),
        }
    }
    Ok(())
}

/// Whether a table is meant as a distribution: because its key takes values, by its names, or by words that are close to
/// them or customary elsewhere. Other tables are sections of keys.
fn is_distribution(key: &str, table: &toml::Table) -> bool {
    const CUSTOMARY: [&str; 9] = ["min", "max", "low", "high", "mean", "std", "sigma", "choice", "values"];
    let takes_values = scenario_keys().any(|known| known == key)
        || (pull_keys().any(|known| known == key) && !table.contains_key("jitter"));
    let pair = |v: &toml::Value| v.as_array().is_some_and(|a| a.len() == 2);
    takes_values
        || table.iter().any(|(k, v)| {
            [&NAMES[..], &WITH, &CUSTOMARY].concat().contains(&k.as_str())
                || (pair(v) && suggestion(k, NAMES).is_some())
        })
}

fn varied(key: String, value: &toml::Value) -> Result<VariedKey, ConfigError> {
    let place = format!("vary.{key}");
    let toml::Value::Table(table) = value else {
        let distribution = distribution(&key, value)?;
        return Ok(VariedKey::new(key, distribution));
    };
    let own = table.iter().filter(|(name, _)| !WITH.contains(&name.as_str()));
    let own = toml::Value::Table(own.map(|(name, value)| (name.clone(), value.clone())).collect());
    let mut varied = VariedKey::new(key.clone(), distribution(&key, &own)?);
    if let Some(name) = table.get("per") {
        varied.per = per(&place, name)?;
    }
    if let Some(spread) = table.get("spread") {
        varied.spread = self::spread(&place, spread)?;
    }
    if let Some(ends) = table.get("limits") {
        let [low, high] = pair(&place, "limits", ends)?;
        ordered(&place, low, high)?;
        varied.limits = Some([low, high]);
    }
    let words = matches!(varied.distribution, Distribution::Choice(_) | Distribution::Posterior { .. });
    if words && (varied.limits.is_some() || !varied.spread.is_empty()) {
        let problem = "a list of values has neither spread nor limits";
        return Err(ConfigError::new(place, problem)
            .hint("normal, log_normal, uniform, log_uniform and from = \"interval\" have them"));
    }
    if !varied.is_per_grip() && matches!(varied.distribution, Distribution::Posterior { .. }) {
        return Err(ConfigError::new(place, "a posterior is drawn for each grip, it takes no `per`"));
    }
    if let Some((twice, _)) = varied.spread.iter().find(|(level, _)| varied.per == [*level]) {
        let problem = format!("the spread of the level `{twice}` is in the distribution already");
        return Err(ConfigError::new(format!("{place}.spread"), problem)
            .hint("name other levels in `spread`, or another one in `per`"));
    }
    Ok(varied)
}

/// One level, or several: what is drawn for each part on each rig.
fn per(place: &str, value: &toml::Value) -> Result<Vec<Level>, ConfigError> {
    let names: Vec<&str> = match value {
        toml::Value::Array(names) => names.iter().map(|name| name.as_str().unwrap_or_default()).collect(),
        name => vec![name.as_str().unwrap_or_default()],
    };
    let mut levels = names.into_iter().map(|name| level(place, name)).collect::<Result<Vec<_>, _>>()?;
    levels.sort();
    levels.dedup();
    match levels[..] {
        [] => {
            Err(ConfigError::new(place, "`per` names no level").hint("leave it out, or write per = \"rig\""))
        }
        _ => Ok(levels),
    }
}

fn level(place: &str, name: &str) -> Result<Level, ConfigError> {
    let names = Level::ALL.map(Level::name);
    Level::ALL.into_iter().find(|level| level.name() == name).ok_or_else(|| {
        ConfigError::new(place, format!("there is no level `{name}`"))
            .suggest(name, names, || format!("levels: {}", names.join(", ")))
    })
}

fn spread(place: &str, value: &toml::Value) -> Result<Vec<(Level, f64)>, ConfigError> {
    let place = format!("{place}.spread");
    let Some(table) = value.as_table() else {
        return Err(ConfigError::new(
            place,
            format!("levels with their deviations are needed, found {value}"),
        )
        .hint("write for example spread = { gel = 0.12, session = 0.08 }"));
    };
    let mut levels = table
        .iter()
        .map(|(name, value)| match number(value) {
            Some(x) if x.is_finite() && x >= 0.0 => Ok((level(&place, name)?, x)),
            _ => Err(ConfigError::new(
                &place,
                format!("the deviation of `{name}` must be at least 0, found {value}"),
            )),
        })
        .collect::<Result<Vec<_>, _>>()?;
    levels.sort_by_key(|(level, _)| *level);
    Ok(levels)
}

fn list(place: &str, items: &[toml::Value]) -> Result<Distribution, ConfigError> {
    if items.is_empty() {
        return Err(ConfigError::new(place, "the list of values is empty"));
    }
    let values = items.iter().enumerate().map(|(i, item)| drawn(&format!("{place}[{i}]"), item));
    Ok(Distribution::Choice(values.collect::<Result<_, _>>()?))
}

fn distribution(key: &str, value: &toml::Value) -> Result<Distribution, ConfigError> {
    let place = format!("vary.{key}");
    match value {
        toml::Value::Array(items) => list(&place, items),
        toml::Value::Table(table) if key == POSTERIOR_KEY => posterior(&place, table),
        toml::Value::Table(table) => {
            let [(name, argument)] = &table.iter().collect::<Vec<_>>()[..] else {
                return Err(ConfigError::new(place, "a distribution has exactly one of its names as key")
                    .hint("write for example { uniform = [20, 80] }"));
            };
            named(&place, name, argument)
        }
        other => Ok(Distribution::Choice(vec![drawn(&place, other)?])),
    }
}

/// The key whose values are those of a posterior.
const POSTERIOR_KEY: &str = "twin";

/// `twin = { from = "posterior" }`, with the file where it is not the one beside the twin.
fn posterior(place: &str, table: &toml::Table) -> Result<Distribution, ConfigError> {
    let word = |key: &str| table.get(key).and_then(toml::Value::as_str).map(String::from);
    let file = word("file");
    let known = table.keys().all(|key| key == "from" || (key == "file" && file.is_some()));
    if word("from").as_deref() == Some("posterior") && known {
        return Ok(Distribution::Posterior { file });
    }
    let found = toml::Value::Table(table.clone());
    Err(ConfigError::new(place, format!("the twin cannot be drawn from {found}"))
        .hint("write twin = { from = \"posterior\" }, with file = \"NAME.csv\" where it is not the one beside the twin"))
}

fn named(place: &str, name: &str, argument: &toml::Value) -> Result<Distribution, ConfigError> {
    match name {
        "uniform" => {
            let [low, high] = pair(place, name, argument)?;
            ordered(place, low, high)?;
            Ok(Distribution::Uniform { low, high })
        }
        "log_uniform" => {
            let [low, high] = pair(place, name, argument)?;
            ordered(place, low, high)?;
            if low <= 0.0 {
                let problem = format!("the lower end {low} of log_uniform must be more than 0");
                return Err(ConfigError::new(place, problem));
            }
            Ok(Distribution::LogUniform { low, high })
        }
        "normal" => {
            let [mean, deviation] = pair(place, name, argument)?;
            if deviation < 0.0 {
                let problem = format!("the standard deviation {deviation} must not be negative");
                return Err(ConfigError::new(place, problem).hint("normal is [mean, standard deviation]"));
            }
            Ok(Distribution::Normal { mean, deviation })
        }
        "log_normal" => {
            let [median, deviation] = pair(place, name, argument)?;
            if median <= 0.0 || deviation < 0.0 {
                let problem = format!("log_normal = [{median}, {deviation}]: the median must be more than 0, the deviation at least 0");
                return Err(ConfigError::new(place, problem)
                    .hint("log_normal is [median, standard deviation of the natural logarithm]"));
            }
            Ok(Distribution::LogNormal { median, deviation })
        }
        "one_of" => list(place, argument.as_array().map_or(&[], Vec::as_slice)),
        "from" if argument.as_str() == Some("interval") => Ok(Distribution::Interval),
        "from" => Err(ConfigError::new(place, format!("cannot draw from {argument}"))
            .hint("the calibrated uncertainty of the key is from = \"interval\"; twin = { from = \"posterior\" } draws all keys together")),
        other => {
            let error = ConfigError::new(place, format!("there is no distribution `{other}`"));
            let known = "write a list of values, uniform, normal, log_uniform, log_normal, one_of or from = \"interval\"";
            Err(error.suggest(other, NAMES, || known.into()))
        }
    }
}

fn pair(place: &str, name: &str, argument: &toml::Value) -> Result<[f64; 2], ConfigError> {
    let numbers: Option<Vec<f64>> =
        argument.as_array().and_then(|items| items.iter().map(number).collect::<Option<_>>());
    match numbers.as_deref() {
        Some(&[a, b]) if a.is_finite() && b.is_finite() => Ok([a, b]),
        _ => Err(ConfigError::new(place, format!("{name} takes two finite numbers, found {argument}"))),
    }
}

fn ordered(place: &str, low: f64, high: f64) -> Result<(), ConfigError> {
    if low <= high {
        return Ok(());
    }
    Err(ConfigError::new(place, format!("the lower end {low} is above the upper end {high}"))
        .hint("swap the two numbers"))
}

fn number(value: &toml::Value) -> Option<f64> {
    value.as_float().or_else(|| value.as_integer().map(|i| i as f64))
}

fn drawn(place: &str, value: &toml::Value) -> Result<Drawn, ConfigError> {
    match value {
        toml::Value::String(text) => Ok(Drawn::Text(text.clone())),
        _ => match number(value) {
            Some(x) if x.is_finite() => Ok(Drawn::Number(x)),
            _ => Err(ConfigError::new(
                place,
                format!("a value must be a finite number or text, found {value}"),
            )),
        },
    }
}
