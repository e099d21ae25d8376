//! Sweeps that draw cause and parameters of the twin together.

use super::{Sweep, groups};
use crate::config::{ConfigError, Document, is_twin_key};
use crate::draw::Distribution;
use crate::{CAUSE_KEY, Posterior, PosteriorDraw};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Where errors of a posterior are.
const PLACE: &str = "vary.twin";

impl Sweep {
    /// The file of the posterior that the sweep draws from, called from where the twin is; `None` where it draws from none. Without
    /// a name in `[vary]` it is that of the twin with the ending `.posterior.csv`.
    pub fn posterior_file(&self) -> Option<String> {
        let named = self.vary.iter().find_map(|v| match &v.distribution {
            Distribution::Posterior { file } => Some(file.clone()),
            _ => None,
        })?;
        Some(
            named.unwrap_or_else(|| {
                Posterior::name_beside(self.twin.rsplit('/').next().unwrap_or(&self.twin))
            }),
        )
    }

    /// The sweep with the draws of that file. `twin` is the twin's document with all defaults filled in.
    ///
    /// # Errors
    ///
    /// Keys that the twin cannot have or that `[vary]` draws on its own, or values that make no twin.
    pub fn with_posterior(self, posterior: Posterior, twin: &Document) -> Result<Self, ConfigError> {
        let fault = |problem: String| ConfigError::new(PLACE, problem);
        if posterior.draws.is_empty() {
            return Err(fault("the posterior has no draw".into()));
        }
        if let Some(key) = posterior.keys.iter().find(|key| !is_twin_key(key)) {
            return Err(fault(format!("the posterior has a column `{key}`, which is no key of a twin")));
        }
        if let Some(own) = self.vary.iter().find(|v| posterior.keys.contains(&v.key)) {
            let problem = format!("`{}` is a column of the posterior and drawn on its own too", own.key);
            return Err(fault(problem).hint("leave one of them out of [vary]"));
        }
        // The first draw of each cause, and those with the ends of each key.
        let mut tried: BTreeMap<String, &PosteriorDraw> = BTreeMap::new();
        for draw in &posterior.draws {
            tried.entry(draw.cause.clone()).or_insert(draw);
        }
        for (k, key) in posterior.keys.iter().enumerate() {
            let with = || posterior.draws.iter().filter_map(|d| Some((d, d.values[k]?)));
            let ends = [with().min_by(|a, b| a.1.total_cmp(&b.1)), with().max_by(|a, b| a.1.total_cmp(&b.1))];
            for (end, (draw, _)) in ends.into_iter().flatten().enumerate() {
                tried.insert(format!("{key} {end}"), draw);
            }
        }
        for draw in tried.values() {
            posterior.twin(draw, twin.table()).map_err(|e| {
                fault(format!("a draw of the cause `{}` makes no twin: {e}", draw.cause))
                    .hint("the posterior belongs to the twin that was written with it")
            })?;
        }
        Ok(Self { posterior: Some(Arc::new(posterior)), ..self })
    }

    /// The draw of the posterior for sample `index`.
    pub(super) fn posterior_draw(&self, index: u64) -> Option<(&Posterior, &PosteriorDraw)> {
        let posterior = self.posterior.as_deref()?;
        let from = |v: &crate::draw::VariedKey| matches!(v.distribution, Distribution::Posterior { .. });
        let dimension = self.vary.iter().position(from)?;
        let u = self.grip_coordinate(index / self.repetitions, dimension, &self.vary[dimension]);
        Some((posterior, posterior.at(u)))
    }

    /// Keys whose values are recorded with each sample: those of `[groups]` and `[vary]`, and those of its posterior.
    pub fn drawn_keys(&self) -> impl Iterator<Item = &str> {
        let of_posterior = self.posterior.as_deref();
        let cause = of_posterior.map(|_| CAUSE_KEY);
        let keys = of_posterior.into_iter().flat_map(|p| p.keys.iter().map(String::as_str));
        let own = self.vary.iter().filter(|v| !matches!(v.distribution, Distribution::Posterior { .. }));
        let groups = if self.groups.is_some() { &groups::COLUMNS[..] } else { &[] };
        groups.iter().copied().chain(own.map(|v| v.key.as_str())).chain(cause).chain(keys)
    }
}
