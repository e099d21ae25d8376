//! Priors of a sweep: what varies between laboratories, shared by many sweeps.

use super::{ConfigError, EffectFile, SweepFile, draw_file};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// A file that `priors` of a sweep names: values for `[vary]`, and the effects of the twin whose parameters they draw.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct PriorFile {
    /// Effects, with neutral parameters. A twin that has one keeps its own.
    pub effects: Vec<EffectFile>,
    /// As in a sweep. A sweep that has a key keeps its own.
    #[schemars(with = "std::collections::BTreeMap<String, serde_json::Value>")]
    pub vary: toml::Table,
}

impl SweepFile {
    /// The sweep with what it lacks of its priors; of two that have a key, the first counts.
    ///
    /// # Errors
    ///
    /// A value of `[vary]`, there or here, that says nothing that can be drawn.
    pub fn with_priors(mut self, priors: &[PriorFile]) -> Result<Self, ConfigError> {
        let mut vary = draw_file::read(&self.vary)?;
        for prior in priors {
            for varied in draw_file::read(&prior.vary)? {
                if vary.iter().all(|own| own.key != varied.key) {
                    vary.push(varied);
                }
            }
        }
        self.vary = vary.into_iter().map(|varied| (varied.key.clone(), varied.to_toml())).collect();
        self.priors.clear();
        Ok(self)
    }
}

/// The effects of priors that a twin lacks.
pub fn missing_effects<'a>(
    own: &'a [EffectFile],
    priors: &'a [PriorFile],
) -> impl Iterator<Item = &'a EffectFile> {
    let mut known: Vec<&str> = own.iter().map(|effect| effect.name.as_str()).collect();
    priors.iter().flat_map(|prior| &prior.effects).filter(move |effect| {
        let missing = !known.contains(&effect.name.as_str());
        if missing {
            known.push(&effect.name);
        }
        missing
    })
}
