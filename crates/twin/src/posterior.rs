//! What measured pulls leave open of a twin: weighted draws of its causes and parameters.
//!
//! A table of text, one draw in a row: `weight`, `cause`, then a column for each key of the twin. A cause is the ids of the effects
//! that act, joined by `+`, or `none`. An effect whose cells are empty does not act in that draw.

use crate::Twin;
use crate::config::{ConfigError, assign, read_twin_table};
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write;

/// Column of the cause of a sample that was drawn from a posterior.
pub const CAUSE_KEY: &str = "twin.cause";

/// One draw.
#[derive(Debug, Clone, PartialEq)]
pub struct PosteriorDraw {
    /// Its share; those of all draws sum to 1.
    pub weight: f64,
    /// What acts.
    pub cause: String,
    /// A value for each key, in the units of the twin; `None` where that does not act.
    pub values: Vec<Option<f64>>,
}

/// Weighted draws.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Posterior {
    /// Keys of the twin, as in `parts.gear.mu` or `effects.wear.depth`.
    pub keys: Vec<String>,
    /// The draws.
    pub draws: Vec<PosteriorDraw>,
}

/// What is wrong with the text of a posterior.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct PosteriorError {
    /// Line, from 1.
    pub line: usize,
    /// What is wrong there.
    pub problem: String,
}

/// An effect of a twin, by its id and the only part it acts on.
type EffectName<'a> = (&'a str, Option<&'a str>);

/// The effect that a key belongs to.
fn effect_of(key: &str) -> Option<EffectName<'_>> {
    let mut segments = key.strip_prefix("effects.")?.split('.');
    let name = segments.next()?;
    let rest: Vec<&str> = segments.collect();
    Some((name, (rest.len() > 1).then(|| rest[0])))
}

impl Posterior {
    /// Whether a key can be a column: nothing in it that a table would need quotes for.
    pub fn can_hold(key: &str) -> bool {
        !key.contains([',', '"', '\n', '\r', '['])
    }

    /// Name of the file beside a twin, from the name of the twin's.
    pub fn name_beside(twin: &str) -> String {
        format!("{}.posterior.csv", twin.strip_suffix(".toml").unwrap_or(twin))
    }

    /// The text.
    pub fn to_csv(&self) -> String {
        let mut text = format!("weight,cause,{}\n", self.keys.join(","));
        for draw in &self.draws {
            let _ = write!(text, "{},{}", draw.weight, draw.cause);
            for value in &draw.values {
                let _ = match value {
                    Some(x) => write!(text, ",{x}"),
                    None => write!(text, ","),
                };
            }
            text.push('\n');
        }
        text
    }

    /// Reads a text.
    ///
    /// # Errors
    ///
    /// Columns that are not these, cells that are no numbers, or weights that are negative or nothing together.
    pub fn parse(text: &str) -> Result<Self, PosteriorError> {
        let wrong = |line: usize, problem: String| PosteriorError { line: line + 1, problem };
        let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
        let (_, header) = lines.next().ok_or_else(|| wrong(0, "there is nothing".into()))?;
        let columns: Vec<&str> = header.split(',').map(str::trim).collect();
        let keys = match &columns[..] {
            ["weight", "cause", keys @ ..] => keys.iter().map(|k| k.to_string()).collect::<Vec<_>>(),
            _ => {
                return Err(wrong(
                    0,
                    format!("the columns begin with weight and cause, not with `{header}`"),
                ));
            }
        };
        let mut draws = Vec::new();
        for (line, row) in lines {
            let cells: Vec<&str> = row.split(',').map(str::trim).collect();
            if cells.len() != columns.len() {
                return Err(wrong(
                    line,
                    format!("{} cells, there are {} columns", cells.len(), columns.len()),
                ));
            }
            let number = |cell: &str| match cell.parse::<f64>() {
                Ok(x) if x.is_finite() => Ok(x),
                _ => Err(wrong(line, format!("`{cell}` is no finite number"))),
            };
            let weight = number(cells[0])?;
            if weight < 0.0 {
                return Err(wrong(line, format!("the weight {weight} is negative")));
            }
            let value = |cell: &&str| if cell.is_empty() { Ok(None) } else { number(cell).map(Some) };
            let values = cells[2..].iter().map(value).collect::<Result<_, _>>()?;
            draws.push(PosteriorDraw { weight, cause: cells[1].into(), values });
        }
        let mut found = Self { keys, draws };
        if !found.normalize() {
            return Err(wrong(0, format!("the weights of {} draws sum to 0", found.draws.len())));
        }
        Ok(found)
    }

    /// Makes the weights sum to 1; `false` where they sum to nothing.
    pub fn normalize(&mut self) -> bool {
        let sum: f64 = self.draws.iter().map(|d| d.weight).sum();
        if !(sum.is_finite() && sum > 0.0) {
            return false;
        }
        self.draws.iter_mut().for_each(|d| d.weight /= sum);
        true
    }

    /// The draw at probability `u` in (0, 1).
    ///
    /// # Panics
    /// If there is no draw.
    pub fn at(&self, u: f64) -> &PosteriorDraw {
        let mut sum = 0.0;
        let found = self.draws.iter().find(|d| {
            sum += d.weight;
            u < sum
        });
        found.unwrap_or_else(|| &self.draws[self.draws.len() - 1])
    }

    /// Weight of each cause, the heaviest first.
    pub fn causes(&self) -> Vec<(&str, f64)> {
        let mut sums: BTreeMap<&str, f64> = BTreeMap::new();
        self.draws.iter().for_each(|d| *sums.entry(&d.cause).or_default() += d.weight);
        let mut all: Vec<(&str, f64)> = sums.into_iter().collect();
        all.sort_by(|a, b| b.1.total_cmp(&a.1));
        all
    }

    /// Keys and values of a draw, of what acts in it.
    pub fn values<'a>(&'a self, draw: &'a PosteriorDraw) -> impl Iterator<Item = (&'a str, f64)> {
        self.keys.iter().zip(&draw.values).filter_map(|(key, value)| Some((key.as_str(), (*value)?)))
    }

    /// The twin of a draw; `base` is the table of the twin with all defaults filled in.
    ///
    /// # Errors
    ///
    /// As [`Self::put`], or values that make no twin.
    pub fn twin(&self, draw: &PosteriorDraw, base: &toml::Table) -> Result<Twin, ConfigError> {
        let mut table = base.clone();
        self.put(draw, &mut table)?;
        Twin::new(&read_twin_table(&table)?)
    }

    /// Puts a draw into the table of a twin: the effects of its cause are there, the other ones that the posterior knows are not.
    ///
    /// # Errors
    ///
    /// A key that the twin cannot have.
    pub fn put(&self, draw: &PosteriorDraw, table: &mut toml::Table) -> Result<(), ConfigError> {
        let known: BTreeSet<EffectName<'_>> = self.keys.iter().filter_map(|k| effect_of(k)).collect();
        if !known.is_empty() {
            let acting: BTreeSet<EffectName<'_>> =
                self.values(draw).filter_map(|(key, _)| effect_of(key)).collect();
            let list = table.entry("effects").or_insert_with(|| toml::Value::Array(vec![]));
            if let toml::Value::Array(entries) = list {
                entries.retain(|entry| !known.contains(&name_of(entry)) || acting.contains(&name_of(entry)));
                for &(name, part) in &acting {
                    if entries.iter().any(|entry| name_of(entry) == (name, part)) {
                        continue;
                    }
                    let mut entry = toml::Table::new();
                    entry.insert("name".into(), name.into());
                    entry.extend(part.map(|part| ("part".to_string(), toml::Value::from(part))));
                    entry.insert("outside_fit".into(), "extrapolate".into());
                    entries.push(toml::Value::Table(entry));
                }
            }
        }
        for (key, value) in self.values(draw) {
            assign(table, key, toml::Value::Float(value))?;
        }
        Ok(())
    }
}

/// The effect of an entry of a twin.
fn name_of(entry: &toml::Value) -> EffectName<'_> {
    let text = |key: &str| entry.get(key).and_then(toml::Value::as_str);
    (text("name").unwrap_or_default(), text("part"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn two() -> Posterior {
        let keys = ["parts.gear.mu", "effects.wear.depth", "effects.load_offset.gear.b_n"];
        let draw = |weight, cause: &str, values: [Option<f64>; 3]| PosteriorDraw {
            weight,
            cause: cause.into(),
            values: values.to_vec(),
        };
        Posterior {
            keys: keys.map(String::from).to_vec(),
            draws: vec![
                draw(0.75, "wear", [Some(0.2), Some(0.1), None]),
                draw(0.25, "load_offset", [Some(0.25), None, Some(-3.0)]),
            ],
        }
    }

    #[test]
    fn a_text_gives_back_what_was_written() {
        let posterior = two();
        let text = posterior.to_csv();
        assert!(text.starts_with("weight,cause,parts.gear.mu,"), "{text}");
        assert_eq!(Posterior::parse(&text).unwrap(), posterior);
        assert_eq!(posterior.causes(), [("wear", 0.75), ("load_offset", 0.25)]);
        for (from, to, says) in [
            ("weight,", "mass,", "line 1"),
            ("0.75,", "much,", "line 2: `much`"),
            (",0.1,", ",", "line 2: 4 cells, there are 5"),
            ("0.25,load", "-0.25,load", "negative"),
        ] {
            let error = Posterior::parse(&text.replacen(from, to, 1)).unwrap_err().to_string();
            assert!(error.contains(says), "{error}");
        }
    }

    #[test]
    fn draws_come_by_weight() {
        let posterior = two();
        let wear = (0..1000).filter(|i| posterior.at((f64::from(*i) + 0.5) / 1000.0).cause == "wear").count();
        assert_eq!(wear, 750);
        assert_eq!(posterior.at(0.999_999_999).cause, "load_offset");
    }

    /// Each cause takes the place of the other, and what the posterior does not speak of stays.
    #[test]
    fn a_draw_brings_its_cause_and_takes_the_other_one_away() {
        let posterior = two();
        let base: toml::Table = "[parts.gear]\nmu = 0.1\n[[effects]]\nname = \"wear\"\ndepth = 0.3\nn0 = 50.0\n[[effects]]\nname = \"temperature\"\n"
            .parse()
            .unwrap();
        let of = |k: usize| {
            let mut table = base.clone();
            posterior.put(&posterior.draws[k], &mut table).unwrap();
            table
        };
        let names = |table: &toml::Table| -> Vec<String> {
            table["effects"].as_array().unwrap().iter().map(|e| e["name"].as_str().unwrap().into()).collect()
        };
        let wear = of(0);
        assert_eq!(names(&wear), ["wear", "temperature"]);
        assert_eq!(wear["effects"][0]["depth"].as_float(), Some(0.1));
        assert_eq!(wear["effects"][0]["n0"].as_float(), Some(50.0));
        let offset = of(1);
        assert_eq!(names(&offset), ["temperature", "load_offset"]);
        assert_eq!(offset["effects"][1]["part"].as_str(), Some("gear"));
        assert_eq!(offset["effects"][1]["b_n"].as_float(), Some(-3.0));
        assert_eq!(offset["parts"]["gear"]["mu"].as_float(), Some(0.25));
    }
}
