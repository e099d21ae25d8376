//! A twin with the files that it names, without a sweep: for single pulls, campaigns and images.

use crate::location::Location;
use crate::project::{LoadError, Project};
use gripgen_twin::config::ConfigError;

impl Project {
    /// Loads a twin for pulls of `parts`. Its sweep has the shipped pull settings and draws nothing of use; `images` says
    /// whether files of the sensors are needed. `sets` are overrides of the twin, and of the sweep's settings.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, a part that the twin lacks, or a key with a value out of range.
    pub fn of_twin(
        twin: &Location,
        parts: &[&str],
        images: bool,
        sets: &[(String, String)],
    ) -> Result<Self, LoadError> {
        let word = |text: &str| toml::Value::String(text.into()).to_string();
        let at = match twin {
            Location::Asset(_) => twin.to_string(),
            Location::Disk(path) => {
                let path = std::path::absolute(path).map_err(|e| ConfigError::new("twin", e.to_string()))?;
                path.display().to_string()
            }
        };
        let names = parts.iter().map(|p| word(p)).collect::<Vec<_>>().join(", ");
        let own = [
            ("twin", word(&at)),
            ("vary", format!("{{ part = [{names}], grip_force_n = [1.0] }}")),
            ("images", word(if images { "png" } else { "none" })),
            ("mechanics", word("reduced")),
        ];
        let mut all: Vec<(String, String)> = own.map(|(key, value)| (key.to_string(), value)).into();
        all.extend(sets.iter().cloned());
        Self::load(&Location::parse("asset:configs/quickstart.toml"), &all)
    }
}
