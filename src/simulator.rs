//! Single pulls on a twin: for Python, policies and the virtual rig.

use crate::generate::{StartedPull, simulate, start_pull};
use crate::location::Location;
use crate::project::{LoadError, Project, load_twin_document};
use crate::sample::{SampleError, SimulateOptions};
use gripgen_tactile::SimdLevel;
use gripgen_twin::config::{Backend, ConfigError, Mechanics};
use gripgen_twin::draw::Drawn;
use gripgen_twin::{Outcome, Sample, Scenario, Sweep, Twin, is_twin_key};
use std::borrow::Cow;
use std::collections::BTreeMap;

/// A twin that pulls are asked of one by one.
pub struct Simulator {
    project: Project,
    mechanics: Mechanics,
}

/// Which of the innumerable grips of a twin: seed and index draw scatter and noise.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Draw {
    /// Seed.
    pub seed: u64,
    /// Index of the sample.
    pub index: u64,
}

impl Simulator {
    /// Loads a twin with its files. `sets` are overrides of the twin, and of the pull (`pull.increment_n`).
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a key with a value out of range.
    pub fn open(
        twin: &Location,
        sets: &[(String, String)],
        mechanics: Mechanics,
        images: bool,
    ) -> Result<Self, LoadError> {
        let document = load_twin_document(twin, sets)?;
        let checked = document.read_twin().and_then(|file| Twin::new(&file));
        let checked = checked.map_err(|e| LoadError::from(document.located(e)))?;
        let parts: Vec<&str> = checked.parts.keys().map(String::as_str).collect();
        Ok(Self { project: Project::of_twin(twin, &parts, images, sets)?, mechanics })
    }

    /// The twin before anything is put in.
    pub fn twin(&self) -> &Twin {
        &self.project.twin
    }

    /// The sweep of one pull that it is asked for.
    pub fn project(&self) -> &Project {
        &self.project
    }

    /// Twin and scenario of a pull: `values` are keys of a sweep's `[vary]`. One part need not be named.
    fn pull_of(
        &self,
        values: &BTreeMap<String, Drawn>,
        draw: Draw,
    ) -> Result<(Cow<'_, Twin>, Scenario), ConfigError> {
        let mut values = values.clone();
        let parts = &self.project.twin.parts;
        if !values.contains_key("part") {
            let mut names = parts.keys();
            match (names.next(), names.next()) {
                (Some(only), None) => {
                    values.insert("part".into(), Drawn::Text(only.clone()));
                }
                _ => {
                    let all = parts.keys().cloned().collect::<Vec<_>>().join(", ");
                    let problem = format!("the twin has {} parts: {all}", parts.len());
                    return Err(ConfigError::new("part", problem).hint("say which one is pulled"));
                }
            }
        }
        let mut twin = Cow::Borrowed(&self.project.twin);
        let of_twin = values.iter().filter(|(key, _)| is_twin_key(key));
        if let Some(twin_with) = Sweep::twin_with_all(&self.project.twin_table, of_twin)? {
            twin = Cow::Owned(twin_with);
        }
        let (mut scenario, usable) = self.project.sweep.scenario_of(values, draw.index, &twin);
        usable?;
        scenario.seed = draw.seed;
        (scenario.group, scenario.repetition) = (draw.index, 0);
        Ok((twin, scenario))
    }

    fn options(&self, images: bool, trace: bool) -> SimulateOptions {
        let level = SimdLevel::best();
        SimulateOptions {
            mechanics: self.mechanics,
            images,
            noise: true,
            trace,
            backend: Backend::Cpu,
            level,
        }
    }

    /// Simulates a pull. What the configuration forbids is an error; what physics forbids is a failed sample.
    ///
    /// # Errors
    ///
    /// An unknown key, or a value out of range.
    pub fn pull(
        &self,
        values: &BTreeMap<String, Drawn>,
        draw: Draw,
        images: bool,
        trace: bool,
    ) -> Result<Sample, ConfigError> {
        let (twin, scenario) = self.pull_of(values, draw)?;
        let options = self.options(images, trace);
        let outcome = simulate(&twin, &self.project.library, &scenario, options, None)
            .unwrap_or_else(|e| Outcome::Failed { reason: e.to_string() });
        Ok(Sample { scenario, outcome })
    }

    /// Grips, and is ready to pull: what follows is up to the caller's commands.
    ///
    /// # Errors
    ///
    /// An unknown key, a value out of range, or what makes a sample fail before its pull.
    pub fn start(
        &self,
        values: &BTreeMap<String, Drawn>,
        draw: Draw,
        images: bool,
    ) -> Result<(Scenario, StartedPull), SampleError> {
        let (twin, scenario) = self.pull_of(values, draw)?;
        let started = start_pull(&twin, &self.project.library, &scenario, self.options(images, true))?;
        Ok((scenario, started))
    }
}
