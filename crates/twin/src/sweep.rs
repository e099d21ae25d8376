//! The checked sweep: which scenario belongs to which sample index.

mod check;
mod groups;
mod posterior;

use crate::config::{
    Backend, Compression, ConfigError, DesignFile, GroupsFile, ImageStorage, ImagesFile, Mechanics, PullFile,
    SweepFile, TraceStorage, assign, check_part, get, is_twin_key, of_part, read_twin_table, segments,
};
use crate::draw::{Distribution, Drawn, Level, VariedKey, fnv1a, level_coordinate, random_coordinate};
use crate::image::film::FilmPace;
use crate::random::sobol;
use crate::scenario::keys;
use crate::{CAUSE_KEY, Posterior, PullSettings, Scenario, Twin};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

/// Grip force per jaw (or in total, as the twin has it) where a sweep does not say: 40 N, the force of the
/// pull profiles in Wucherer et al. 2023.
pub const DEFAULT_GRIP_FORCE_N: f64 = 40.0;

/// Most samples of a sweep.
pub const MAX_SAMPLES: u64 = 1_000_000_000_000;

/// A sweep whose values are checked and whose size is known. Built by [`Sweep::new`].
#[derive(Debug, Clone, PartialEq)]
pub struct Sweep {
    /// Path of the twin, as written.
    pub twin: String,
    /// Number of samples, repetitions included.
    pub samples: u64,
    /// How values are drawn.
    pub design: DesignFile,
    /// Samples of each configuration.
    pub repetitions: u64,
    /// Seed of all randomness.
    pub seed: u64,
    /// Which mechanics.
    pub mechanics: Mechanics,
    /// Where images are computed.
    pub backend: Backend,
    /// Part of the name of the graphics adapter; the first graphics processor where there is none.
    pub gpu_adapter: Option<String>,
    /// How images are stored.
    pub images: ImageStorage,
    /// How small images are stored.
    pub compression: Compression,
    /// Which frames there are of a pull, if it is filmed.
    pub film: Option<FilmPace>,
    /// Whether traces are stored.
    pub trace: TraceStorage,
    /// Samples in one file.
    pub shard_samples: u64,
    /// What varies, sorted by key; always contains `part` and `grip_force_n`.
    pub vary: Vec<VariedKey>,
    /// Rigs, gels and sessions that samples come from.
    pub groups: Option<GroupsFile>,
    posterior: Option<Arc<Posterior>>,
    pull: PullFile,
}

impl Sweep {
    /// Number of shard files.
    pub fn shards(&self) -> u64 {
        self.samples.div_ceil(self.shard_samples)
    }

    /// The pull settings without what varies.
    pub fn pull(&self) -> PullSettings {
        check::pull_settings(&self.pull).expect("checked when the sweep was built")
    }

    /// Whether keys of the twin vary, so that every sample has a twin of its own.
    pub fn varies_twin(&self) -> bool {
        self.vary.iter().any(|v| is_twin_key(&v.key)) || self.posterior.is_some()
    }

    /// The parts that can be drawn.
    pub fn drawn_parts(&self) -> Vec<&str> {
        self.representatives("part")
            .into_iter()
            .filter_map(|value| match value {
                Drawn::Text(name) => Some(name.as_str()),
                Drawn::Number(_) => None,
            })
            .collect()
    }

    /// The values in the list of a key, none if it is not drawn from a list.
    pub fn representatives(&self, key: &str) -> Vec<&Drawn> {
        match self.vary.iter().find(|v| v.key == key).map(|v| &v.distribution) {
            Some(Distribution::Choice(values)) => values.iter().collect(),
            _ => vec![],
        }
    }

    /// The sweep as a file in which every default and every drawn key stands.
    pub fn to_file(&self) -> SweepFile {
        SweepFile {
            twin: self.twin.clone(),
            samples: Some(self.samples),
            design: self.design,
            repetitions: self.repetitions,
            seed: self.seed,
            mechanics: self.mechanics,
            backend: self.backend,
            gpu_adapter: self.gpu_adapter.clone(),
            images: ImagesFile {
                storage: self.images,
                compression: self.compression,
                during_pull: self.film.map(FilmPace::to_file),
            },
            trace: self.trace,
            shard_samples: self.shard_samples,
            priors: vec![],
            vary: self.vary.iter().map(|v| (v.key.clone(), v.to_toml())).collect(),
            groups: self.groups,
            pull: self.pull.clone(),
        }
    }

    /// The values drawn for sample `index`, by key.
    pub fn drawn(&self, index: u64) -> BTreeMap<String, Drawn> {
        let group = index / self.repetitions;
        let mut remaining = group;
        let mut grid = BTreeMap::new();
        if self.design == DesignFile::Grid {
            // The last key varies fastest.
            for varied in self.vary.iter().rev() {
                if let Distribution::Choice(values) = &varied.distribution {
                    let n = values.len() as u64;
                    grid.insert(varied.key.as_str(), &values[(remaining % n) as usize]);
                    remaining /= n;
                }
            }
        }
        let mut drawn = self.groups_of(group);
        // What is drawn for a part, a gel or a session follows from its name.
        for names in [true, false] {
            for (dimension, varied) in self.vary.iter().enumerate() {
                if groups::names_groups(&varied.key) != names {
                    continue;
                }
                if let Some(value) = grid.get(varied.key.as_str()) {
                    drawn.insert(varied.key.clone(), (*value).clone());
                } else if let Distribution::Posterior { .. } = varied.distribution {
                    let Some((posterior, draw)) = self.posterior_draw(index) else { continue };
                    drawn.insert(CAUSE_KEY.into(), Drawn::Text(draw.cause.clone()));
                    drawn.extend(posterior.values(draw).map(|(key, x)| (key.to_string(), Drawn::Number(x))));
                } else {
                    let at = |levels: &[Level]| self.coordinate(index, dimension, varied, levels, &drawn);
                    let value = varied.value(at);
                    drawn.insert(varied.key.clone(), value);
                }
            }
        }
        drawn
    }

    /// A number in (0, 1) for a key of sample `index` at some levels. `drawn` has the names of its groups.
    fn coordinate(
        &self,
        index: u64,
        dimension: usize,
        varied: &VariedKey,
        levels: &[Level],
        drawn: &BTreeMap<String, Drawn>,
    ) -> f64 {
        let group = index / self.repetitions;
        if varied.is_per_grip() && levels == [Level::Grip] {
            return self.grip_coordinate(group, dimension, varied);
        }
        let named = |level: &Level| match (level, level.column()) {
            (_, Some(column)) => drawn.get(column).map(Drawn::to_string).unwrap_or_default(),
            (Level::Grip, None) => group.to_string(),
            (_, None) => index.to_string(),
        };
        let groups: Vec<String> = levels.iter().map(named).collect();
        level_coordinate(self.seed, levels, &groups.join(" "), &varied.key)
    }

    /// A number in (0, 1) for a key of configuration `group`.
    fn grip_coordinate(&self, group: u64, dimension: usize, varied: &VariedKey) -> f64 {
        if self.design == DesignFile::Sobol {
            let shift = (self.seed ^ fnv1a(&varied.key)).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 32;
            return sobol::coordinate(group, dimension, shift as u32);
        }
        random_coordinate(self.seed, group, &varied.key)
    }

    /// Whether the repetitions of a configuration share their grip: nothing is drawn for each of them.
    pub fn repetitions_share_grip(&self) -> bool {
        self.repetitions > 1 && self.vary.iter().all(|v| v.levels().all(|level| level != Level::Sample))
    }

    /// The scenario of sample `index`, with forces per jaw by the convention of `twin`, and whether it can be
    /// simulated. A scenario that cannot still holds what was drawn, for the record.
    pub fn scenario(&self, index: u64, twin: &Twin) -> (Scenario, Result<(), ConfigError>) {
        self.scenario_of(self.drawn(index), index, twin)
    }

    /// The same with `drawn` values instead of those of the sweep.
    pub fn scenario_of(
        &self,
        drawn: BTreeMap<String, Drawn>,
        index: u64,
        twin: &Twin,
    ) -> (Scenario, Result<(), ConfigError>) {
        let mut pull = self.pull.clone();
        let mut scenario = self.blank();
        scenario.index = index;
        (scenario.group, scenario.repetition) = (index / self.repetitions, index % self.repetitions);
        let mut problem = Ok(());
        for (key, value) in &drawn {
            let put = match key {
                key if key.starts_with("pull.") => keys::set_pull(&mut pull, key, value),
                key if is_twin_key(key) || key == CAUSE_KEY => Ok(()),
                key if self.draws_own(key) || keys::own_columns(twin).contains(&key.as_str()) => {
                    keys::set_own(&mut scenario, key, value);
                    Ok(())
                }
                key => keys::set(&mut scenario, key, value),
            };
            problem = problem.and(put.map_err(|e| e.into_config_error(key)));
        }
        match check::pull_settings(&pull) {
            Ok(settings) => scenario.pull = settings,
            Err(e) => problem = problem.and(Err(e)),
        }
        scenario.grip_force_n = twin.force_per_jaw_n(scenario.grip_force_n);
        scenario.drawn = drawn;
        problem = problem.and_then(|()| keys::check_against_twin(&scenario, twin));
        (scenario, problem)
    }

    /// Whether `[vary]` has a column of the user's own, which its twin was asked for. Not each draw of a posterior has the table.
    fn draws_own(&self, key: &str) -> bool {
        keys::is_own_column(key) && self.vary.iter().any(|varied| varied.key == key)
    }

    /// The twin of sample `index`: a copy of `base` with the drawn values put in.
    ///
    /// # Errors
    ///
    /// Values drawn for this sample that make no twin.
    pub fn twin_of(&self, index: u64, base: &toml::Table) -> Result<Twin, ConfigError> {
        let drawn = self.drawn(index);
        let Some((posterior, draw)) = self.posterior_draw(index) else {
            return Self::twin_of_drawn(&drawn, base);
        };
        let mut table = base.clone();
        posterior.put(draw, &mut table)?;
        twin_with_drawn(&drawn, table)
    }

    /// The twin of `base` with the drawn values of a sample put in, and without parts that the sample does not need.
    ///
    /// # Errors
    ///
    /// Values that make no twin.
    pub fn twin_of_drawn(drawn: &BTreeMap<String, Drawn>, base: &toml::Table) -> Result<Twin, ConfigError> {
        twin_with_drawn(drawn, with_needed_parts(base, drawn))
    }

    /// The twin of `base` with one value put in.
    ///
    /// # Errors
    ///
    /// A key that the twin lacks, or a value that makes no twin.
    pub fn twin_with(base: &toml::Table, key: &str, value: &Drawn) -> Result<Twin, ConfigError> {
        let mut table = base.clone();
        put(&mut table, key, value)?;
        read_twin(&table)
    }

    /// The twin of `base` with values put in; `None` if there are none.
    ///
    /// # Errors
    ///
    /// As [`Self::twin_with`], with all values set.
    pub fn twin_with_all<'a>(
        base: &toml::Table,
        values: impl IntoIterator<Item = (&'a String, &'a Drawn)>,
    ) -> Result<Option<Twin>, ConfigError> {
        let mut table = None;
        for (key, value) in values {
            put(table.get_or_insert_with(|| base.clone()), key, value)?;
        }
        table.map(|table| read_twin(&table)).transpose()
    }

    /// A scenario in which nothing is drawn yet.
    fn blank(&self) -> Scenario {
        Scenario { seed: self.seed, grip_force_n: 1.0, pull: self.pull(), ..Scenario::default() }
    }
}

fn twin_with_drawn(drawn: &BTreeMap<String, Drawn>, mut table: toml::Table) -> Result<Twin, ConfigError> {
    let part = drawn_part(drawn);
    for (key, value) in drawn.iter().filter(|(key, _)| is_twin_key(key)) {
        put(&mut table, &of_part(key, &part), value)?;
    }
    read_twin(&table)
}

fn drawn_part(drawn: &BTreeMap<String, Drawn>) -> String {
    drawn.get("part").map(Drawn::to_string).unwrap_or_default()
}

/// `base` with the drawn part, those of drawn keys and those that effects name: a twin may have many parts, and each sample reads its own.
fn with_needed_parts(base: &toml::Table, drawn: &BTreeMap<String, Drawn>) -> toml::Table {
    let Some(parts) = base.get("parts").and_then(toml::Value::as_table) else { return base.clone() };
    let effects = base.get("effects").and_then(toml::Value::as_array);
    let by_effects = effects.into_iter().flatten().filter_map(|effect| effect.get("part")?.as_str());
    let by_keys = drawn.keys().filter_map(|key| match segments(key)[..] {
        ["parts", part, _, ..] => Some(part),
        _ => None,
    });
    let own = drawn_part(drawn);
    let names: BTreeSet<&str> = by_effects.chain(by_keys).chain([own.as_str()]).collect();
    let needed = parts.iter().filter(|(name, _)| names.contains(name.as_str()));
    let needed: toml::Table = needed.map(|(name, part)| (name.clone(), part.clone())).collect();
    let others = base.iter().filter(|(key, _)| *key != "parts");
    let mut table: toml::Table = others.map(|(key, value)| (key.clone(), value.clone())).collect();
    table.insert("parts".into(), needed.into());
    table
}

fn read_twin(table: &toml::Table) -> Result<Twin, ConfigError> {
    Twin::new(&read_twin_table(table)?)
}

/// Puts a drawn value into a twin's table.
fn put(table: &mut toml::Table, key: &str, value: &Drawn) -> Result<(), ConfigError> {
    check_part(table, key)?;
    let value = match (value, get(table, key)) {
        // A whole number stays one where the twin has one, a kernel's size for example.
        (Drawn::Number(x), Some(toml::Value::Integer(_))) if x.fract() == 0.0 => {
            toml::Value::Integer(*x as i64)
        }
        _ => value.to_toml(),
    };
    assign(table, key, value).map(|_| ())
}
