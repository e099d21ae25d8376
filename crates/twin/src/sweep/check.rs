//! Checking a sweep against the twin it names, before any work is done.

use super::{MAX_SAMPLES, Sweep, groups, put, read_twin};
use crate::columns::{self, Column};
use crate::config::{
    Backend, Compression, ConfigError, DesignFile, Document, ImageStorage, PullFile, StepFile, SweepFile,
    in_range, is_twin_key, of_part, read_vary, suggestion,
};
use crate::draw::{Distribution, Drawn, VariedKey};
use crate::image::film::FilmPace;
use crate::random::sobol;
use crate::scenario::keys::{self, KeyError, drawn_column, pull_keys, scenario_keys};
use crate::{PullSettings, Twin};

impl Sweep {
    /// Checks a sweep against the twin it names. `twin` is the twin's document with all defaults filled in.
    ///
    /// # Errors
    ///
    /// A key that neither the scenario nor the twin has, or a value out of its range; the error names the key.
    pub fn new(file: &SweepFile, twin: &Document) -> Result<Self, ConfigError> {
        let checked_twin = Twin::new(&twin.read_twin()?).map_err(|e| twin.located(e))?;
        check_size(file)?;
        pull_settings(&file.pull)?;
        let mut vary = read_vary(&file.vary)?;
        for (key, default) in [
            ("part", checked_twin.parts.keys().cloned().map(Drawn::Text).collect()),
            ("grip_force_n", vec![Drawn::Number(super::DEFAULT_GRIP_FORCE_N)]),
        ] {
            if vary.iter().all(|v| v.key != key) {
                vary.push(VariedKey::new(key, Distribution::Choice(default)));
            }
        }
        vary.sort_by(|a, b| a.key.cmp(&b.key));
        for varied in &mut vary {
            if varied.distribution == Distribution::Interval {
                varied.distribution = calibrated(&varied.key, twin)?;
            }
            check_listed(varied)?;
        }
        groups::check(file.groups, &vary, file.design)?;
        let samples = number_of_samples(file, &vary)?;
        if file.design == DesignFile::Sobol {
            check_sobol(samples.div_ceil(file.repetitions), vary.len())?;
        }
        check_direction(file.pull.direction, &checked_twin)?;
        if file.gpu_adapter.is_some() && file.backend != Backend::Gpu {
            let problem = "an adapter is named, but backend is \"cpu\"";
            return Err(ConfigError::new("gpu_adapter", problem).hint("backend = \"gpu\" uses it"));
        }
        let sweep = Self {
            twin: file.twin.clone(),
            samples,
            design: file.design,
            repetitions: file.repetitions,
            seed: file.seed,
            mechanics: file.mechanics,
            backend: file.backend,
            gpu_adapter: file.gpu_adapter.clone(),
            images: file.images.storage,
            compression: compression(file, &vary)?,
            film: film(file)?,
            trace: file.trace,
            shard_samples: file.shard_samples,
            vary,
            groups: file.groups,
            posterior: None,
            pull: file.pull.clone(),
        };
        sweep.check_values(twin, &checked_twin)?;
        sweep.check_grips(&checked_twin)?;
        Ok(sweep)
    }

    /// Tries out representative values of every key, so that a bad range is found before any work is done.
    fn check_values(&self, twin: &Document, checked: &Twin) -> Result<(), ConfigError> {
        for varied in &self.vary {
            let place = format!("vary.{}", varied.key);
            let listed = matches!(varied.distribution, Distribution::Choice(_));
            for (i, value) in varied.extremes().into_iter().enumerate() {
                let key = if listed { format!("{place}[{i}]") } else { place.clone() };
                self.check_value(twin, checked, &varied.key, &value).map_err(|e| match e {
                    KeyError::Unknown => unknown_key(key, &varied.key, &keys::own_columns(checked)),
                    KeyError::Bad(e) => ConfigError { key, place: None, ..e },
                })?;
            }
        }
        Ok(())
    }

    fn check_value(&self, twin: &Document, checked: &Twin, key: &str, value: &Drawn) -> Result<(), KeyError> {
        if key.starts_with("pull.") {
            let mut pull = self.pull.clone();
            keys::set_pull(&mut pull, key, value)?;
            pull_settings(&pull)?;
            return Ok(());
        }
        if is_twin_key(key) {
            let mut table = twin.table().clone();
            for part in self.drawn_parts() {
                put(&mut table, &of_part(key, part), value)?;
            }
            read_twin(&table)?;
            return Ok(());
        }
        let mut scenario = self.blank();
        scenario.part = checked.parts.keys().next().cloned().unwrap_or_default();
        if keys::own_columns(checked).contains(&key) {
            return if keys::is_taken(key) { Err(KeyError::Bad(taken(key))) } else { Ok(()) };
        }
        keys::set(&mut scenario, key, value)?;
        match key {
            // Which grips exist depends on the part, see `check_grips`.
            "grip_pose" => return Ok(()),
            "grip_force_n" => scenario.grip_force_n = checked.force_per_jaw_n(scenario.grip_force_n),
            _ => {}
        }
        Ok(keys::check_against_twin(&scenario, checked)?)
    }

    /// Every drawn grip has to exist for every drawn part.
    fn check_grips(&self, twin: &Twin) -> Result<(), ConfigError> {
        for (i, pose) in self.representatives("grip_pose").into_iter().enumerate() {
            for part in self.representatives("part") {
                let mut scenario = self.blank();
                let put = keys::set(&mut scenario, "part", part)
                    .and_then(|()| keys::set(&mut scenario, "grip_pose", pose));
                put.map_err(|e| e.into_config_error("grip_pose"))
                    .and_then(|()| keys::check_against_twin(&scenario, twin))
                    .map_err(|e| ConfigError { key: format!("vary.grip_pose[{i}]"), ..e })?;
            }
        }
        Ok(())
    }
}

/// What leaves out the frame at rest needs one for all samples.
fn compression(file: &SweepFile, vary: &[VariedKey]) -> Result<Compression, ConfigError> {
    let (key, images) = ("images.compression", file.images);
    if images.compression == Compression::Small && images.storage != ImageStorage::Clean {
        let problem = "only frames without noise can be stored small";
        return Err(ConfigError::new(key, problem).hint("storage = \"clean\""));
    }
    let sensor = vary.iter().find(|v| v.key.starts_with("optics") && v.key.ends_with("sensor"));
    if let (Compression::Small, Some(varied)) = (images.compression, sensor) {
        let problem = format!("the frame at rest is left out, but `{}` varies", varied.key);
        return Err(ConfigError::new(key, problem).hint("compression = \"fast\""));
    }
    Ok(images.compression)
}

/// The frames that a file asks for.
fn film(file: &SweepFile) -> Result<Option<FilmPace>, ConfigError> {
    let Some(asked) = file.images.during_pull else { return Ok(None) };
    let pace = FilmPace::new(&asked)?;
    if file.images.storage == ImageStorage::None {
        let problem = "the pull is filmed, but storage is \"none\"";
        return Err(ConfigError::new("images.during_pull", problem).hint("storage = \"clean\" or \"png\""));
    }
    if file.backend == Backend::Gpu {
        let problem = "films are made by the processor, but backend is \"gpu\"";
        return Err(ConfigError::new("images.during_pull", problem).hint("backend = \"cpu\""));
    }
    Ok(Some(pace))
}

fn check_direction(direction: [f64; 3], twin: &Twin) -> Result<(), ConfigError> {
    let upright = direction[0] == 0.0 && direction[1] == 0.0 && direction[2] > 0.0;
    match twin.effects.iter().find(|e| e.spec.upright_only) {
        Some(effect) if !upright => {
            let problem = format!(
                "the effect `{}` of the twin knows pulls along z only, not {direction:?}",
                effect.spec.id
            );
            Err(ConfigError::new("pull.direction", problem)
                .hint("a pull downwards is direction = [0, 0, 1] with pull_direction = [-1] in [vary]"))
        }
        _ => Ok(()),
    }
}

/// A column of the user's own that the index would not show.
fn taken(key: &str) -> ConfigError {
    let problem =
        format!("every sample has a `{key}` of its own in index.csv, so that this one would not be recorded");
    ConfigError::new(key, problem).hint(format!(
        "give the column another name, in the pulls and in the table of the twin: `{key}_of_pull`"
    ))
}

fn unknown_key(place: String, key: &str, own: &[&str]) -> ConfigError {
    let fixed = ["pull.direction", "pull.max_time_s"];
    if fixed.contains(&key) {
        return ConfigError::new(place, format!("`{key}` cannot vary: it is one for the whole sweep"));
    }
    let problem = format!("neither the scenario, `pull` nor the twin has a key `{key}`");
    // The name of a column in tables is close enough.
    let column: Option<&str> = columns::find(key).map(Column::sweep_key);
    let mut known: Vec<&str> = scenario_keys().collect();
    known.extend(own);
    let pull = pull_keys().collect::<Vec<&str>>();
    let all = known.iter().chain(&pull).copied();
    let close = column.or_else(|| suggestion(key, all));
    ConfigError::new(place, problem).hint(match close {
        Some(close) => format!("did you mean `{close}`?"),
        None => format!(
            "keys of a scenario: {}; a column of your own is one where a table of the twin depends on it",
            known.join(", ")
        ),
    })
}

/// Names and whole numbers are drawn from a list: a distribution would hit no valid value.
fn check_listed(varied: &VariedKey) -> Result<(), ConfigError> {
    let listed = drawn_column(&varied.key).is_some_and(Column::is_listed);
    if !listed || matches!(varied.distribution, Distribution::Choice(_)) {
        return Ok(());
    }
    let problem =
        format!("`{}` takes names or whole numbers, which a distribution does not give", varied.key);
    Err(ConfigError::new(format!("vary.{}", varied.key), problem).hint("list the values: [0, 1, 2]"))
}

fn check_sobol(groups: u64, keys: usize) -> Result<(), ConfigError> {
    if keys > sobol::MAX_DIMENSIONS {
        let problem = format!("{keys} keys vary, a Sobol design has at most {}", sobol::MAX_DIMENSIONS);
        return Err(ConfigError::new("vary", problem).hint("use design = \"random\""));
    }
    if groups > sobol::MAX_POINTS {
        let problem = format!("{groups} configurations, a Sobol sequence has {}", sobol::MAX_POINTS);
        return Err(ConfigError::new("samples", problem).hint("use design = \"random\""));
    }
    Ok(())
}

/// The calibrated uncertainty of a twin key as a Gaussian with the value as mean: `low90` and `high90` lie
/// 2 x 1.645 standard deviations apart.
fn calibrated(key: &str, twin: &Document) -> Result<Distribution, ConfigError> {
    let place = format!("vary.{key}");
    let missing = |what: &str| {
        ConfigError::new(&place, format!("the twin has no {what}"))
            .hint("`gripgen calibrate` writes it; or add low90 and high90 there yourself")
    };
    let (section, leaf) = key.rsplit_once('.').unwrap_or(("", key));
    let interval = format!("{section}.calibration.{leaf}");
    let number =
        |key: &str| twin.get(key).and_then(|v| v.as_float().or_else(|| v.as_integer().map(|i| i as f64)));
    let mean = number(key).ok_or_else(|| missing(&format!("number `{key}`")))?;
    let low = number(&format!("{interval}.low90")).ok_or_else(|| missing(&format!("`{interval}.low90`")))?;
    let high =
        number(&format!("{interval}.high90")).ok_or_else(|| missing(&format!("`{interval}.high90`")))?;
    if low > high {
        return Err(ConfigError::new(&place, format!("low90 = {low} is above high90 = {high} in the twin")));
    }
    Ok(Distribution::Normal { mean, deviation: (high - low) / (2.0 * 1.644_853_626_951_472_2) })
}

fn check_size(file: &SweepFile) -> Result<(), ConfigError> {
    for (key, value, low, high) in [
        ("samples", file.samples.unwrap_or(1), 1, MAX_SAMPLES),
        ("repetitions", file.repetitions, 1, 1_000_000),
        ("shard_samples", file.shard_samples, 1, 100_000),
    ] {
        if !(low..=high).contains(&value) {
            let problem = format!("{value} is out of range, it must be at least {low} and at most {high}");
            return Err(ConfigError::new(key, problem));
        }
    }
    Ok(())
}

fn number_of_samples(file: &SweepFile, vary: &[VariedKey]) -> Result<u64, ConfigError> {
    if file.design != DesignFile::Grid {
        return file.samples.ok_or_else(|| {
            ConfigError::new("samples", "the key `samples` is missing")
                .hint("only a grid design knows its own size")
        });
    }
    let size = vary.iter().try_fold(file.repetitions, |n, v| match &v.distribution {
        Distribution::Choice(values) => n.checked_mul(values.len() as u64),
        _ => Some(n),
    });
    let Some(size) = size.filter(|&n| n <= MAX_SAMPLES) else {
        return Err(ConfigError::new("vary", format!("the grid has more than {MAX_SAMPLES} samples")));
    };
    match file.samples {
        Some(samples) if samples != size => {
            let problem = format!("samples = {samples}, but the grid has {size} (repetitions included)");
            Err(ConfigError::new("samples", problem)
                .hint("leave `samples` out of a grid, or draw so many: --set design=random"))
        }
        _ => Ok(size),
    }
}

/// Checks `[pull]` and converts it.
pub(super) fn pull_settings(file: &PullFile) -> Result<PullSettings, ConfigError> {
    let (step, jitter) = match file.step_s {
        StepFile::Constant(value) => (value, 0.0),
        StepFile::Jittered(step) => (step.value, step.jitter),
    };
    let [x, y, z] = file.direction;
    let length = (x * x + y * y + z * z).sqrt();
    if !(length.is_finite() && length > 1e-9) {
        return Err(ConfigError::new("pull.direction", format!("[{x}, {y}, {z}] has no direction")));
    }
    let direction = [x / length, y / length, z / length];
    if direction[1].abs() > 1e-9 {
        let problem = format!("[{x}, {y}, {z}] has a component along y, the jaw axis");
        return Err(ConfigError::new("pull.direction", problem)
            .hint("the arm pulls at right angles to the jaws; set y to 0"));
    }
    let max_time_s = in_range("pull.max_time_s", file.max_time_s, 0.1..=3600.0, "s")?;
    let column = |key: &str, x: f64| columns::find(key).map_or(Ok(x), |column| column.check_drawn(key, x));
    let settings = PullSettings {
        increment_n: column("pull.increment_n", file.increment_n)?,
        start_n: file.start_n.map(|force| column("pull.start_n", force)).transpose()?,
        step_s: column("pull.step_s", step)?,
        step_jitter: in_range("pull.step_s.jitter", jitter, 0.0..=0.9, "1")?,
        stop_m: in_range("pull.stop_mm", file.stop_mm, 0.05..=100.0, "mm")? * 1e-3,
        direction,
        max_force_n: file
            .max_force_n
            .map(|force| in_range("pull.max_force_n", force, 0.1..=10_000.0, "N"))
            .transpose()?,
        max_time_s,
        label_tolerance_n: in_range("pull.label_tolerance_n", file.label_tolerance_n, 0.01..=100.0, "N")?,
    };
    if settings.step_s > max_time_s {
        let problem = format!("one step of {} s is longer than max_time_s = {max_time_s} s", settings.step_s);
        return Err(ConfigError::new("pull.step_s", problem));
    }
    if let (Some(start_n), Some(max_n)) = (settings.start_n, settings.max_force_n)
        && start_n > max_n
    {
        let problem =
            format!("{start_n} N is above max_force_n = {max_n} N: the pull would end before it begins");
        return Err(ConfigError::new("pull.start_n", problem));
    }
    Ok(settings)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sweep_that_says_nothing_of_the_pull_has_the_default_one() {
        assert_eq!(pull_settings(&PullFile::default()).unwrap(), PullSettings::default());
    }

    #[test]
    fn the_name_of_a_column_in_tables_leads_to_its_key() {
        let hint =
            |key: &str| unknown_key(format!("vary.{key}"), key, &["moisture_pct"]).hint.unwrap_or_default();
        assert_eq!(hint("force_increment_n"), "did you mean `pull.increment_n`?");
        assert_eq!(hint("step_time_s"), "did you mean `pull.step_s`?");
        assert_eq!(hint("grip_forc_n"), "did you mean `grip_force_n`?");
        assert_eq!(hint("moisture"), "did you mean `moisture_pct`?");
        let other = hint("humidity");
        assert!(
            other.starts_with(
                "keys of a scenario: part, grip_pose, rig_id, gel_id, session, grip_force_n, dwell_s"
            ),
            "{other}"
        );
    }
}
