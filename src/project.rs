//! A sweep with everything it needs: twin, meshes, sensors, and the hash over all of it.

use crate::assets;
use crate::gpu::Gpu;
use crate::gripped::{Gripped, check_damping};
use crate::library::{Library, LibraryError};
use crate::location::{Location, ReadFileError};
use crate::resolve::{Files, Named, Resolved, config_hash, is_file_key, resolve};
use crate::sample::SimulateOptions;
use crate::version::VERSION;
use gripgen_physics::Cache;
use gripgen_record::{Background, RunFolder, sha256_hex};
use gripgen_tactile::finish;
use gripgen_tactile::gpu::{GpuError, makes};
use gripgen_twin::config::{
    Backend, Compression, ConfigError, Document, ImageStorage, PriorFile, SweepFile, missing_effects,
};
use gripgen_twin::{
    DEFAULTED_SECTIONS, Jaw, PerJaw, Posterior, RobotArm, Sweep, Twin, is_twin_key, scenario_keys,
};
use std::borrow::Cow;
use std::sync::{Arc, OnceLock};

/// The twin whose sections stand in for what a twin leaves out, and the default of `--twin`.
pub const BASELINE_TWIN: &str = "asset:configs/twin-baseline.toml";

/// Grips kept for their repetitions, which are made one after another.
const GRIPS: usize = 8;

/// A loaded sweep.
pub struct Project {
    /// Name of the run: the configuration's file name.
    pub name: String,
    /// The checked sweep.
    pub sweep: Sweep,
    /// The twin before anything is drawn.
    pub twin: Twin,
    /// Its values, for drawing.
    pub twin_table: toml::Table,
    /// Meshes, contact shapes and sensors.
    pub library: Library,
    /// Grips that repetitions share.
    pub(crate) grips: Cache<(u64, SimulateOptions), Gripped>,
    /// The graphics processor of `backend = "gpu"`, opened when it is first needed.
    gpu: OnceLock<Result<Gpu, GpuError>>,
    /// What images are stored without, made when it is first needed.
    background: OnceLock<Option<Arc<PerJaw<Background>>>>,
    /// The configuration as it was resolved: sweep and twin with all defaults and overrides.
    pub config_toml: String,
    /// SHA-256 of everything a sample is a function of, beside gripgen's version.
    pub config_sha256: String,
}

/// Why a sweep cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum LoadError {
    /// A key of a configuration, or a file that it names.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The configuration itself cannot be read.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// A run folder of another version of gripgen.
    #[error("the run was made by gripgen {found}, this is {VERSION}")]
    Version {
        /// Version that made the run.
        found: String,
    },
    /// A run folder whose content is not what its hash says.
    #[error("{what} has the hash {found}, run.json says {wanted}")]
    Changed {
        /// Which file.
        what: String,
        /// Hash of what is there.
        found: String,
        /// Hash of what was there.
        wanted: String,
    },
}

/// Loads a twin: its text, the overrides meant for it, and defaults for what it leaves out.
///
/// # Errors
///
/// A file that cannot be read or is no TOML, or an override of a key that cannot be set.
pub fn load_twin_document(location: &Location, sets: &[(String, String)]) -> Result<Document, LoadError> {
    twin_document(location, sets, &[])
}

fn twin_document(
    location: &Location,
    sets: &[(String, String)],
    priors: &[PriorFile],
) -> Result<Document, LoadError> {
    let mut document = Document::parse(&location.to_string(), &location.read_text()?)?;
    let baseline: toml::Table =
        assets::text("configs/twin-baseline.toml").parse().expect("a test reads the baseline twin");
    document.fill_from(&baseline, DEFAULTED_SECTIONS);
    add_effects(&mut document, priors)?;
    for (key, value) in sets.iter().filter(|(key, _)| is_twin_key(key)) {
        set(&mut document, location, key, value)?;
    }
    Ok(document)
}

/// Adds the effects of priors that a twin lacks.
fn add_effects(twin: &mut Document, priors: &[PriorFile]) -> Result<(), ConfigError> {
    if priors.iter().all(|prior| prior.effects.is_empty()) {
        return Ok(());
    }
    let own = twin.read_twin()?.effects;
    let unwritable = |e: toml::ser::Error| ConfigError::new("effects", e.to_string());
    let mut all = match twin.get("effects") {
        Some(toml::Value::Array(effects)) => effects.clone(),
        _ => vec![],
    };
    for effect in missing_effects(&own, priors) {
        all.push(toml::Value::try_from(effect).map_err(unwritable)?);
    }
    twin.assign("effects", toml::Value::Array(all)).map(drop)
}

/// The files of priors that a sweep names.
fn priors(sweep: &Document, location: &Location, named: &[String]) -> Result<Vec<PriorFile>, LoadError> {
    let read = |(i, path): (usize, &String)| -> Result<PriorFile, LoadError> {
        let at = location.beside(path);
        let text = at.read_text().map_err(|e| {
            let error = ConfigError::new(format!("priors[{i}]"), e.to_string());
            sweep.located(error.hint(
                "paths are relative to this file; shipped: asset:priors/friction.toml, gel.toml, rig.toml",
            ))
        })?;
        let document = Document::parse(&at.to_string(), &text)?;
        let file: PriorFile = document.read().map_err(|e| document.located(e))?;
        Ok(file)
    };
    named.iter().enumerate().map(read).collect()
}

/// Applies an override of a document that lies at `location`. A path in it is relative to the shell's folder.
fn set(document: &mut Document, location: &Location, key: &str, value: &str) -> Result<(), ConfigError> {
    document.set(key, value)?;
    if key == "twin" || is_file_key(key.strip_prefix("vary.").unwrap_or(key)) {
        let placed = document.get(key).cloned().map(|value| from_shell(location, value));
        placed.map(|value| document.assign(key, value)).transpose()?;
    }
    Ok(())
}

/// A key of a scenario stands in `[vary]`, also where it has one value.
fn meant_to_vary(error: ConfigError, document: &Document) -> ConfigError {
    match scenario_keys().find(|key| *key == error.key) {
        Some(key) if document.get(key).is_some() => ConfigError {
            hint: Some(format!("did you mean `vary.{key}`? One value there is the same in every sample")),
            ..error
        },
        _ => error,
    }
}

/// A value with its paths as they are called from a configuration at `location`.
fn from_shell(location: &Location, value: toml::Value) -> toml::Value {
    match value {
        toml::Value::String(path) => toml::Value::String(location.named_from_shell(&path)),
        toml::Value::Array(all) => {
            toml::Value::Array(all.into_iter().map(|value| from_shell(location, value)).collect())
        }
        other => other,
    }
}

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

    /// Loads a sweep and all files it names. `sets` are overrides `key=value`, for the sweep or for the twin.
    ///
    /// # Errors
    ///
    /// A file that cannot be read, or a key with a value out of range.
    pub fn load(location: &Location, sets: &[(String, String)]) -> Result<Self, LoadError> {
        let mut document = Document::parse(&location.to_string(), &location.read_text()?)?;
        for (key, value) in sets.iter().filter(|(key, _)| !is_twin_key(key)) {
            set(&mut document, location, key, value)?;
        }
        let file: SweepFile = document.read().map_err(|e| meant_to_vary(e, &document))?;
        let priors = priors(&document, location, &file.priors)?;
        let file = file.with_priors(&priors).map_err(|e| document.located(e))?;
        let twin_location = location.beside(&file.twin);
        let twin_document = twin_document(&twin_location, sets, &priors).map_err(|e| match e {
            LoadError::Read(e) => LoadError::from(
                document
                    .located(ConfigError::new("twin", e.to_string()).hint("paths are relative to this file")),
            ),
            other => other,
        })?;
        let sweep = Sweep::new(&file, &twin_document).map_err(|e| document.located(e))?;
        let locate = |path: &str| twin_location.beside(path);
        let Resolved { config_toml, files, named } = resolve(&sweep, &twin_document, &document, locate)?;
        let project = Self::from_resolved(location.run_name(), config_toml, files)?;
        project.check_arms().map_err(|e| twin_document.located(e))?;
        for file in &named {
            project.check_file(file).map_err(|e| {
                let document = if file.key == file.twin_key { &twin_document } else { &document };
                let error = ConfigError::new(&file.key, e.to_string());
                document.located(ConfigError { hint: e.hint().map(Into::into), ..error })
            })?;
        }
        Ok(project)
    }

    /// Loads the sweep that made a run folder, from what the folder holds. Refuses what this gripgen would not make
    /// again bit for bit.
    ///
    /// # Errors
    ///
    /// A run of another version, or whose files were changed.
    pub fn from_run(folder: &RunFolder) -> Result<Self, LoadError> {
        let info = folder.info();
        if info.gripgen_version != VERSION {
            return Err(LoadError::Version { found: info.gripgen_version.clone() });
        }
        let changed = |what: &str, found: String, wanted: &str| match found == wanted {
            true => Ok(()),
            false => Err(LoadError::Changed { what: what.into(), found, wanted: wanted.into() }),
        };
        let beside = Location::Disk(folder.path().join("run.json"));
        let mut files = Files::new();
        for (path, sha256) in &info.files_sha256 {
            let at = beside.beside(path);
            let bytes = at.read()?.into_owned();
            changed(path, sha256_hex(&bytes), sha256)?;
            files.insert(path.clone(), (at, bytes));
        }
        let project = Self::from_resolved(info.name.clone(), info.config_toml.clone(), files)?;
        changed("config_toml", project.config_sha256.clone(), &info.config_sha256)?;
        Ok(project)
    }

    /// The graphics processor that makes the images; `None` if the processor does.
    ///
    /// # Errors
    ///
    /// No adapter, or one that cannot do what the sweep asks for.
    pub fn gpu(&self) -> Result<Option<&Gpu>, GpuError> {
        if self.sweep.backend == Backend::Cpu || self.sweep.images == ImageStorage::None {
            return Ok(None);
        }
        let opened = self.gpu.get_or_init(|| Gpu::open(self.sweep.gpu_adapter.as_deref()));
        opened.as_ref().map(Some).map_err(Clone::clone)
    }

    /// What images are stored without under `compression = "small"`.
    pub(crate) fn background(&self) -> Option<Arc<PerJaw<Background>>> {
        if self.sweep.compression == Compression::Fast {
            return None;
        }
        let made = self.background.get_or_init(|| {
            // Without its sensors a sweep has no images.
            let of = |jaw: Jaw| self.library.sensor(&self.twin.optics[jaw]);
            let both = PerJaw::try_from_fn(|jaw| of(jaw).map(|s| Background::new(finish(&s, None, None))));
            both.ok().map(Arc::new)
        });
        made.clone()
    }

    /// Opens the graphics processor, if images are made there, and puts both sensors on it: what cannot be done shows
    /// before anything is written. Images that are the processor's in any case need neither.
    pub fn prepare_gpu(&self) -> Result<Option<&Gpu>, GpuError> {
        let Some(gpu) = self.gpu()? else { return Ok(None) };
        for jaw in Jaw::BOTH {
            // A sensor that cannot be read fails its samples, with its own reason.
            let sensor = self.library.sensor(&self.twin.optics[jaw]);
            if let Some(sensor) = sensor.ok().filter(|sensor| makes(sensor, &self.twin.gel[jaw])) {
                gpu.prepare(&sensor, &self.twin.gel[jaw])?;
            }
        }
        Ok(Some(gpu))
    }

    /// The twin of sample `index`.
    ///
    /// # Errors
    ///
    /// Values drawn for this sample that make no twin.
    pub fn twin_of(&self, index: u64) -> Result<Cow<'_, Twin>, ConfigError> {
        if !self.sweep.varies_twin() {
            return Ok(Cow::Borrowed(&self.twin));
        }
        self.sweep.twin_of(index, &self.twin_table).map(Cow::Owned)
    }

    fn from_resolved(name: String, config_toml: String, files: Files) -> Result<Self, LoadError> {
        let both: toml::Table = config_toml
            .parse()
            .map_err(|e: toml::de::Error| ConfigError::new("config_toml", e.message().to_string()))?;
        let part = |key: &str| -> Result<Document, ConfigError> {
            let table = both.get(key).and_then(toml::Value::as_table).cloned().unwrap_or_default();
            Document::parse(&format!("resolved configuration, {key}"), &table.to_string())
        };
        let (document, twin_document) = (part("sweep")?, part("twin")?);
        let file: SweepFile = document.read()?;
        let mut sweep = Sweep::new(&file, &twin_document).map_err(|e| document.located(e))?;
        if let Some(path) = sweep.posterior_file() {
            let fault = |problem: String| document.located(ConfigError::new("vary.twin", problem));
            let (at, bytes) = files.get(&path).ok_or_else(|| fault(format!("there is no {path}")))?;
            let text = String::from_utf8_lossy(bytes);
            let posterior = Posterior::parse(&text).map_err(|e| fault(format!("{at}: {e}")))?;
            sweep = sweep.with_posterior(posterior, &twin_document).map_err(|e| document.located(e))?;
        }
        let twin = Twin::new(&twin_document.read_twin()?).map_err(|e| twin_document.located(e))?;
        let config_sha256 = config_hash(&config_toml, &files);
        let twin_table = twin_document.table().clone();
        let library = Library::new(files);
        let grips = Cache::new(GRIPS);
        let (gpu, background) = (OnceLock::new(), OnceLock::new());
        Ok(Self {
            name,
            sweep,
            twin,
            twin_table,
            library,
            grips,
            gpu,
            background,
            config_toml,
            config_sha256,
        })
    }

    /// Builds the arm in every stance that its varied keys can draw, and checks the force loop against its mass.
    fn check_arms(&self) -> Result<(), ConfigError> {
        let mut twins = vec![(String::new(), self.twin.clone())];
        for varied in self.sweep.vary.iter().filter(|v| v.key.starts_with("robot.")) {
            for value in varied.distribution.extremes() {
                let twin = Sweep::twin_with(&self.twin_table, &varied.key, &value)?;
                twins.push((format!("vary.{} = {value}: ", varied.key), twin));
            }
        }
        for (drawn, twin) in twins {
            let Some(arm) = &twin.arm else { continue };
            let fault = |key: &str, e: &dyn std::fmt::Display, hint: &str| {
                ConfigError::new(key, format!("{drawn}{e}")).hint(hint)
            };
            let placed = self.library.arm(arm).map_err(|e| match &e {
                LibraryError::Arm(_) => fault(
                    "robot.arm.joints_deg",
                    &e,
                    "the shipped stance stands in asset:configs/twin-baseline.toml",
                ),
                LibraryError::Urdf { .. } => fault(
                    "robot.arm.urdf",
                    &e,
                    "robot.arm.tip names a link of the URDF; the arm needs six revolute joints",
                ),
                _ => fault("robot.arm.urdf", &e, "a file that varies has to stand in the twin or in a list"),
            })?;
            check_damping(&twin, &placed, self.sweep.pull().direction).map_err(|e| {
                fault("robot.damping_n_s_per_m", &e, "lower the damping or raise wrist.rate_hz")
            })?;
        }
        Ok(())
    }

    /// Reads a mesh or sensor as every sample will, so that a broken file is found before any work is done.
    fn check_file(&self, file: &Named) -> Result<(), LibraryError> {
        let segments: Vec<&str> = file.twin_key.split('.').collect();
        match segments[..] {
            ["parts", name, "mesh"] => {
                let Some(part) = self.twin.parts.get(name) else { return Ok(()) };
                let part = gripgen_twin::Part { mesh: file.path.clone(), ..part.clone() };
                (0..part.grips.len()).try_for_each(|grip| self.library.shape(&part, grip).map(drop))
            }
            ["robot", "arm", "urdf"] => {
                let Some(arm) = &self.twin.arm else { return Ok(()) };
                self.library.check_arm(&RobotArm { urdf: file.path.clone(), ..arm.clone() })
            }
            ["optics", jaw, leaf] => {
                let jaw = if jaw == "right" { Jaw::Right } else { Jaw::Left };
                let mut optics = self.twin.optics[jaw].clone();
                // What stands beside a sensor is checked in turn, so that each fault is told of the key that has it.
                if matches!(leaf, "sensor" | "background") {
                    optics.gel_map = None;
                }
                if leaf != "shadow_table" {
                    optics.shadow_table = None;
                }
                match leaf {
                    "sensor" => optics.sensor.clone_from(&file.path),
                    "gel_map" => optics.gel_map = Some(file.path.clone()),
                    "shadow_table" => optics.shadow_table = Some(file.path.clone()),
                    _ => optics.background = Some(file.path.clone()),
                }
                self.library.check_sensor(&optics, &self.twin.gel[jaw])
            }
            _ => Ok(()),
        }
    }
}
