//! Tables: a dependence that was measured and has no name.
//!
//! A diagnosis that finds structure in the data which no effect of the library explains adds it to the twin as a table
//! over one covariate. It repeats what was seen and says nothing about why: it is marked `physical = false`, and outside
//! its range it is held.

use crate::Values;
use crate::columns::{self, Column, PullView};
use crate::config::{ConfigError, EffectFile, TwinFile, in_range};
use crate::draw::Drawn;
use crate::effects::{OutsideFit, Per};

/// The `name` of a table among the effects of a twin file. It is not in the library.
pub const TABLE_EFFECT: &str = "table";

/// What a table changes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum TableTarget {
    /// It multiplies the friction of both jaws.
    Factor,
    /// It is added to the readings of the wrist sensor, in newtons.
    Offset,
}

/// A table over one covariate.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// A column of a pull table, in its units, or one of unknown meaning; the product of two as `a*b`.
    pub covariate: String,
    /// What is taken off both factors of a product.
    pub centre: Option<[f64; 2]>,
    /// The only part it acts on, or all of them.
    pub part: Option<String>,
    /// Columns of words with the only word of each at which it acts.
    pub only: Vec<(String, String)>,
    /// Where its values are: at numbers that increase, linear in between and held outside; or at words, at others it does
    /// nothing.
    pub axis: Values,
    /// One value for each place of the axis.
    pub values: Vec<f64>,
    /// What it changes.
    pub target: TableTarget,
}

impl Table {
    /// The columns that it depends on: its covariate, or both factors of a product, and those that say where it acts.
    pub fn columns(&self) -> impl Iterator<Item = &str> {
        let (first, second) = match self.covariate.split_once('*').filter(|_| self.centre.is_some()) {
            Some((a, b)) => (a, Some(b)),
            None => (self.covariate.as_str(), None),
        };
        let only = self.only.iter().map(|(name, _)| name.as_str());
        [Some(first), second].into_iter().flatten().chain(only)
    }

    /// The value where the covariate is `at`; `None` where the table says nothing.
    pub fn value(&self, at: &Drawn) -> Option<f64> {
        match (&self.axis, at) {
            (Values::Words(words), at) => {
                let at = at.to_string();
                words.iter().position(|w| *w == at).map(|i| self.values[i])
            }
            (Values::Numbers(x), Drawn::Number(at)) => Some(interpolate(x, &self.values, *at)),
            (Values::Numbers(_), Drawn::Text(_)) => None,
        }
    }

    /// The value at a pull; `None` where the table says nothing.
    pub fn at(&self, pull: PullView<'_>) -> Option<f64> {
        if self.part.as_ref().is_some_and(|own| own != pull.part) {
            return None;
        }
        let column = |name: &str| columns::value(name, pull);
        if !self.only.iter().all(|(name, word)| column(name).is_some_and(|at| at.to_string() == *word)) {
            return None;
        }
        let at = match (self.centre, self.covariate.split_once('*')) {
            (Some([a, b]), Some((first, second))) => match (column(first)?, column(second)?) {
                (Drawn::Number(x), Drawn::Number(y)) => Drawn::Number((x - a) * (y - b)),
                _ => return None,
            },
            _ => column(&self.covariate)?,
        };
        self.value(&at)
    }
}

/// Linear between the points, held outside.
fn interpolate(x: &[f64], y: &[f64], at: f64) -> f64 {
    let after = x.partition_point(|&x| x <= at);
    if after == 0 {
        return y[0];
    }
    if after == x.len() {
        return y[after - 1];
    }
    let share = (at - x[after - 1]) / (x[after] - x[after - 1]);
    y[after - 1] + share * (y[after] - y[after - 1])
}

const KEYS: [&str; 8] = ["covariate", "centre", "where", "x", "words", "factor", "offset_n", "physical"];

/// Checks a table of a twin file. Errors name the key.
pub(crate) fn check_table(file: &TwinFile, index: usize) -> Result<Table, ConfigError> {
    let effect = &file.effects[index];
    let key = |name: &str| format!("effects[{index}].{name}");
    refuse_foreign(effect, &key)?;
    if let Some(part) = effect.part.as_ref().filter(|part| !file.parts.contains_key(*part)) {
        return Err(ConfigError::unknown_part(key("part"), part, file.parts.keys()));
    }
    let get = |name: &str| effect.parameters.get(name);
    if get("physical") != Some(&toml::Value::Boolean(false)) {
        return Err(ConfigError::new(key("physical"), "a table explains nothing, it must say so")
            .hint("add physical = false"));
    }
    let covariate = match get("covariate") {
        Some(toml::Value::String(name)) if !name.is_empty() => name.clone(),
        _ => {
            return Err(ConfigError::new(key("covariate"), "the name of a column of a pull table is needed"));
        }
    };
    let centre = centre(&covariate, get("centre"), &key)?;
    let only = only(get("where"), &key)?;
    let known = columns::covariate(&covariate);
    let axis = match (get("x"), get("words")) {
        (Some(_), None) if known.is_some_and(Column::holds_words) => {
            let problem = format!("`{covariate}` holds words, not numbers");
            return Err(ConfigError::new(key("x"), problem).hint("give its values in words = [...]"));
        }
        (None, Some(_)) if centre.is_some() || known.is_some_and(|column| !column.holds_words()) => {
            let problem = format!("`{covariate}` holds numbers, not words");
            return Err(ConfigError::new(key("words"), problem).hint("give its values in x = [...]"));
        }
        (Some(x), None) => Values::Numbers(increasing(numbers(x, &key("x"))?, &key("x"))?),
        (None, Some(words)) => Values::Words(distinct(words, &key("words"))?),
        _ => return Err(ConfigError::new(key("x"), "a table has either `x` or `words`")),
    };
    let (values, target, name) = match (get("factor"), get("offset_n")) {
        (Some(v), None) => (numbers(v, &key("factor"))?, TableTarget::Factor, "factor"),
        (None, Some(v)) => (numbers(v, &key("offset_n"))?, TableTarget::Offset, "offset_n"),
        _ => return Err(ConfigError::new(key("factor"), "a table has either `factor` or `offset_n`")),
    };
    let places = axis.len();
    if values.len() != places {
        let problem = format!("{} values for {places} places of `{covariate}`", values.len());
        return Err(ConfigError::new(key(name), problem));
    }
    for (i, &value) in values.iter().enumerate() {
        let at = key(&format!("{name}[{i}]"));
        match target {
            TableTarget::Factor => in_range(&at, value, 1e-3..=1e3, "1")?,
            TableTarget::Offset => in_range(&at, value, -1e3..=1e3, "N")?,
        };
    }
    Ok(Table { covariate, centre, part: effect.part.clone(), only, axis, values, target })
}

/// What is taken off the factors of a product; a single column has none.
fn centre(
    covariate: &str,
    value: Option<&toml::Value>,
    key: &dyn Fn(&str) -> String,
) -> Result<Option<[f64; 2]>, ConfigError> {
    match (covariate.split_once('*'), value) {
        (None, None) => Ok(None),
        (None, Some(_)) => {
            let problem = format!("`{covariate}` is one column, only a product has a centre");
            Err(ConfigError::new(key("centre"), problem).hint("leave centre out"))
        }
        (Some((a, b)), value) => {
            let holds_words = |name: &str| columns::covariate(name).is_some_and(Column::holds_words);
            if let Some(word) = [a, b].into_iter().find(|name| holds_words(name) || name.is_empty()) {
                let problem = format!("`{word}` holds no numbers, it has no product");
                return Err(ConfigError::new(key("covariate"), problem));
            }
            let found = value.map_or(Ok(vec![]), |v| numbers(v, &key("centre")))?;
            let count = found.len();
            let pair = <[f64; 2]>::try_from(found).map_err(|_| {
                let problem = format!("a product needs what is taken off its 2 factors, {count} are given");
                ConfigError::new(key("centre"), problem)
                    .hint("centre = [mean of the first, mean of the second]")
            })?;
            Ok(Some(pair))
        }
    }
}

/// The words at which a table acts.
fn only(
    value: Option<&toml::Value>,
    key: &dyn Fn(&str) -> String,
) -> Result<Vec<(String, String)>, ConfigError> {
    let Some(value) = value else { return Ok(Vec::new()) };
    let needed = "where = { session = \"3\" }";
    let Some(words) = value.as_table().filter(|words| !words.is_empty()) else {
        let problem = format!("columns with a word each are needed, found {value}");
        return Err(ConfigError::new(key("where"), problem).hint(needed));
    };
    let each = words.iter().map(|(name, word)| match word.as_str() {
        Some(_) if columns::covariate(name).is_some_and(|column| !column.holds_words()) => {
            let problem = format!("`{name}` holds numbers, not words");
            Err(ConfigError::new(key(&format!("where.{name}")), problem).hint("put it into covariate and x"))
        }
        Some(word) => Ok((name.clone(), word.into())),
        None => {
            let problem = format!("a word is needed, found {word}");
            Err(ConfigError::new(key(&format!("where.{name}")), problem).hint(needed))
        }
    });
    each.collect()
}

/// Keys that a table does not have.
fn refuse_foreign(effect: &EffectFile, key: &dyn Fn(&str) -> String) -> Result<(), ConfigError> {
    if let Some(name) = effect.parameters.keys().find(|name| !KEYS.contains(&name.as_str())) {
        let error = ConfigError::new(key(name), format!("a table has no key `{name}`"));
        return Err(error.suggest(name, KEYS, || format!("its keys: {}", KEYS.join(", "))));
    }
    let foreign = [
        ("fitted_grip_force_n", effect.fitted_grip_force_n.is_some()),
        ("outside_fit", effect.outside_fit != OutsideFit::default()),
        ("per", effect.per != Per::default()),
        ("reference_area_mm2", effect.reference_area_mm2.is_some()),
    ];
    match foreign.iter().find(|(_, there)| *there) {
        Some((name, _)) => {
            Err(ConfigError::new(key(name), "a table is held outside its range and acts on the whole grip")
                .hint(format!("leave {name} out")))
        }
        None => Ok(()),
    }
}

pub(crate) fn list<'a>(value: &'a toml::Value, key: &str) -> Result<&'a [toml::Value], ConfigError> {
    match value.as_array() {
        Some(list) if !list.is_empty() => Ok(list),
        _ => Err(ConfigError::new(key, "a list with at least one value is needed")),
    }
}

pub(crate) fn numbers(value: &toml::Value, key: &str) -> Result<Vec<f64>, ConfigError> {
    let number = |(i, value): (usize, &toml::Value)| match value {
        toml::Value::Float(x) if x.is_finite() => Ok(*x),
        toml::Value::Integer(i) => Ok(*i as f64),
        other => Err(ConfigError::new(format!("{key}[{i}]"), format!("a number is needed, found {other}"))),
    };
    list(value, key)?.iter().enumerate().map(number).collect()
}

fn increasing(x: Vec<f64>, key: &str) -> Result<Vec<f64>, ConfigError> {
    match x.windows(2).position(|pair| pair[0] >= pair[1]) {
        None => Ok(x),
        Some(i) => {
            let problem = format!("{} after {}, the numbers must increase", x[i + 1], x[i]);
            Err(ConfigError::new(format!("{key}[{}]", i + 1), problem))
        }
    }
}

fn distinct(value: &toml::Value, key: &str) -> Result<Vec<String>, ConfigError> {
    let mut words: Vec<String> = Vec::new();
    for (i, value) in list(value, key)?.iter().enumerate() {
        match value.as_str() {
            Some(word) if !words.iter().any(|w| w == word) => words.push(word.into()),
            Some(word) => {
                return Err(ConfigError::new(format!("{key}[{i}]"), format!("`{word}` stands twice")));
            }
            None => {
                return Err(ConfigError::new(
                    format!("{key}[{i}]"),
                    format!("a word is needed, found {value}"),
                ));
            }
        }
    }
    Ok(words)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scenario;
    use crate::effects::testing::twin;
    use crate::{Covariates, PullSettings, TWIN_SCHEMA};

    fn scenario(part: &str, extra: &[(&str, Drawn)]) -> Scenario {
        let pull = PullSettings { increment_n: 0.5, step_s: 0.1, ..Default::default() };
        let extra = extra.iter().map(|(k, v)| (k.to_string(), v.clone())).collect();
        let covariates = Covariates { session: "2".into(), grip_offset_m: 3e-3, extra, ..Default::default() };
        Scenario { part: part.into(), grip_force_n: 40.0, covariates, pull, ..Scenario::default() }
    }

    const HUMIDITY: &str = "[[effects]]\nname = \"table\"\ncovariate = \"humidity_pct\"\nx = [30, 40.0, 60]\n\
                            factor = [1.0, 1.2, 0.8]\nphysical = false\n";

    #[test]
    fn a_table_is_linear_between_its_points_and_held_outside() {
        let twin = twin(HUMIDITY).unwrap();
        assert!(twin.effects.is_empty() && twin.tables.len() == 1);
        let at = |x: f64| twin.table_factor(&scenario("rod", &[("humidity_pct", Drawn::Number(x))]));
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        close(at(30.0), 1.0);
        close(at(35.0), 1.1);
        close(at(40.0), 1.2);
        close(at(50.0), 1.0);
        close(at(-5.0), 1.0);
        close(at(90.0), 0.8);
        close(twin.table_factor(&scenario("rod", &[])), 1.0);
        close(twin.table_factor(&scenario("rod", &[("humidity_pct", Drawn::Text("wet".into()))])), 1.0);
    }

    #[test]
    fn tables_know_the_columns_of_a_pull_and_their_part() {
        let table = |covariate: &str, axis: &str, more: &str| {
            let text = format!(
                "[[effects]]\nname = \"table\"\ncovariate = \"{covariate}\"\n{axis}\n{more}\nphysical = false\n"
            );
            twin(&text).unwrap()
        };
        let rod = scenario("rod", &[]);
        let factor = |covariate, axis| table(covariate, axis, "factor = [0.5, 1.5]").table_factor(&rod);
        assert_eq!(factor("session", "words = [\"1\", \"2\"]"), 1.5);
        assert_eq!(factor("session", "words = [\"1\", \"3\"]"), 1.0, "another word");
        assert_eq!(factor("force_increment_n", "x = [0.5, 1]"), 0.5);
        assert_eq!(factor("step_time_s", "x = [0.05, 0.1]"), 1.5);
        assert_eq!(factor("grip_force_n", "x = [20, 60]"), 1.0);
        assert!((factor("grip_offset_mm", "x = [0, 6]") - 1.0).abs() < 1e-12);
        let offset = table("part", "words = [\"rod\", \"plate\"]", "offset_n = [0.7, -0.2]");
        assert_eq!((offset.table_factor(&rod), offset.table_offset_n(&rod)), (1.0, 0.7));
        let own = table("dwell_s", "x = [1]", "factor = [2.0]\npart = \"plate\"");
        assert_eq!((own.table_factor(&rod), own.table_factor(&scenario("plate", &[]))), (1.0, 2.0));
    }

    /// A product is that of both columns about their centres.
    #[test]
    fn a_table_may_stand_over_the_product_of_two_columns() {
        let text = "[[effects]]\nname = \"table\"\ncovariate = \"grip_force_n*humidity_pct\"\ncentre = [30, 50]\n\
                    x = [-100, 100]\nfactor = [0.9, 1.1]\nphysical = false\n";
        let twin_of = |text: &str| twin(text);
        let made = twin_of(text).unwrap();
        let at = |x: f64| made.table_factor(&scenario("rod", &[("humidity_pct", Drawn::Number(x))]));
        // The grip is 40 N: (40 - 30) (55 - 50) = 50.
        assert!(
            (at(55.0) - 1.05).abs() < 1e-12 && (at(45.0) - 0.95).abs() < 1e-12,
            "{} {}",
            at(55.0),
            at(45.0)
        );
        assert_eq!(made.table_factor(&scenario("rod", &[])), 1.0, "nobody wrote it down");
        for (from, to, key) in [
            ("centre = [30, 50]\n", "", "effects[0].centre"),
            ("[30, 50]", "[30]", "effects[0].centre"),
            ("*humidity_pct", "*part", "effects[0].covariate"),
            ("*humidity_pct", "", "effects[0].centre"),
        ] {
            let error = twin_of(&text.replacen(from, to, 1)).unwrap_err();
            assert_eq!(error.key, key, "{error}");
        }
    }

    /// A table of one session does nothing in any other.
    #[test]
    fn a_table_may_act_in_one_session_alone() {
        let made = |only: &str| twin(&HUMIDITY.replace("physical", &format!("where = {only}\nphysical")));
        let wet = [("humidity_pct", Drawn::Number(40.0)), ("operator", Drawn::Text("ann".into()))];
        let rod = scenario("rod", &wet);
        let factor = |only: &str| made(only).unwrap().table_factor(&rod);
        assert_eq!(factor("{ session = \"2\" }"), 1.2);
        assert_eq!(factor("{ session = \"3\" }"), 1.0);
        assert_eq!(factor("{ session = \"2\", operator = \"ann\" }"), 1.2);
        assert_eq!(factor("{ session = \"2\", operator = \"bo\" }"), 1.0);
        assert_eq!(factor("{ supplier = \"a\" }"), 1.0, "nobody wrote it down");
        for (only, key) in [("3", "where"), ("{}", "where"), ("{ session = 3 }", "where.session")] {
            assert_eq!(made(only).unwrap_err().key, format!("effects[0].{key}"), "{only}");
        }
        assert_eq!(made("{ dwell_s = \"3\" }").unwrap_err().key, "effects[0].where.dwell_s");
    }

    #[test]
    fn faults_name_the_key() {
        for (from, to, key, part) in [
            ("physical = false", "physical = true", "effects[0].physical", "must say so"),
            ("physical = false", "", "effects[0].physical", "must say so"),
            ("40.0, 60", "60, 40.0", "effects[0].x[2]", "40 after 60"),
            ("[30, 40.0, 60]", "[]", "effects[0].x", "at least one"),
            ("[30, 40.0, 60]", "[30, \"a\", 60]", "effects[0].x[1]", "a number is needed"),
            ("1.2, 0.8", "1.2", "effects[0].factor", "2 values for 3 places of `humidity_pct`"),
            ("1.2, 0.8", "-1.2, 0.8", "effects[0].factor[1]", "out of range"),
            ("factor =", "facter =", "effects[0].facter", "no key `facter`"),
            ("x =", "words =", "effects[0].words[0]", "a word is needed"),
            ("humidity_pct", "session", "effects[0].x", "holds words"),
            ("covariate = \"humidity_pct\"", "", "effects[0].covariate", "name of a column"),
            ("physical", "per = \"cell\"\nphysical", "effects[0].per", "held outside"),
            ("physical", "part = \"rods\"\nphysical", "effects[0].part", "no part `rods`"),
        ] {
            assert!(HUMIDITY.contains(from), "{from}");
            let error = twin(&HUMIDITY.replacen(from, to, 1)).unwrap_err();
            assert!(error.key == key && error.problem.contains(part), "{to}: {error}");
        }
        assert!(twin(&format!("schema = \"{TWIN_SCHEMA}\"\n{HUMIDITY}")).is_ok());
    }
}
