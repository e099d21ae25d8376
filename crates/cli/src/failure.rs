//! What went wrong, for a person: place, both numbers, a hint, and an exit code.

use crate::rig::OpenPlantError;
use crate::{BenchError, LoadSensorError, RenderError};
use annotate_snippets::{AnnotationKind, Group, Level, Renderer, Snippet};
use gripgen::record::{ExportError, FolderError, ReadError};
use gripgen::tactile::gpu::GpuError;
use gripgen::tactile::presses::HeightsError;
use gripgen::twin::config::{ConfigError, Place};
use gripgen::{LoadError, SweepError};
use gripgen_measured::OpenDatasetError;
use std::fmt::Display;
use std::io;

/// Exit codes.
pub mod code {
    /// The work failed.
    pub const FAILED: u8 = 1;
    /// Usage or configuration.
    pub const USAGE: u8 = 2;
    /// The folder holds another run.
    pub const ANOTHER_RUN: u8 = 3;
    /// Finished, but samples failed.
    pub const SAMPLES_FAILED: u8 = 4;
    /// Verification found a mismatch.
    pub const MISMATCH: u8 = 5;
    /// Interrupted.
    pub const INTERRUPTED: u8 = 130;
}

/// An error on its way to the terminal.
#[derive(Debug)]
pub struct Failure {
    message: String,
    place: Option<Place>,
    hint: Option<String>,
    exit_code: u8,
}

impl Failure {
    /// A failure of the work (exit code 1).
    pub fn new(message: impl Display) -> Self {
        Self { message: message.to_string(), place: None, hint: None, exit_code: code::FAILED }
    }

    /// A failure of usage or configuration (exit code 2).
    pub fn usage(message: impl Display) -> Self {
        Self { exit_code: code::USAGE, ..Self::new(message) }
    }

    /// The same with another exit code.
    #[must_use]
    pub fn with_code(mut self, exit_code: u8) -> Self {
        self.exit_code = exit_code;
        self
    }

    /// Adds what to do about it.
    #[must_use]
    pub fn hint(mut self, hint: impl Into<String>) -> Self {
        self.hint = Some(hint.into());
        self
    }

    /// Adds what to do about it, if that is known.
    #[must_use]
    pub fn hint_if(mut self, hint: Option<impl Into<String>>) -> Self {
        self.hint = hint.map(Into::into).or(self.hint);
        self
    }

    /// The process's exit code.
    pub fn exit_code(&self) -> u8 {
        self.exit_code
    }

    /// What is wrong, and where, without colours.
    pub fn message(&self) -> String {
        match &self.place {
            Some(_) => Renderer::plain().render(&[self.group()]),
            None => self.message.clone(),
        }
    }

    /// What to do about it.
    pub fn what_to_do(&self) -> Option<&str> {
        self.hint.as_deref()
    }

    /// Prints it to standard error.
    pub fn print(&self) {
        anstream::eprintln!("{}", self.rendered());
        if let Some(hint) = &self.hint {
            anstream::eprintln!("\nhint: {hint}");
        }
    }

    fn rendered(&self) -> String {
        Renderer::styled().render(&[self.group()])
    }

    fn group(&self) -> Group<'_> {
        let title = Level::ERROR.primary_title(&self.message);
        match &self.place {
            Some(Place { file, text, span: Some(span) }) => {
                let at = AnnotationKind::Primary.span(span.clone());
                title.element(Snippet::source(&**text).path(file.as_str()).annotation(at))
            }
            _ => Group::with_title(title),
        }
    }
}

impl From<ConfigError> for Failure {
    fn from(e: ConfigError) -> Self {
        let place = e.place.map(|place| *place);
        let where_to = match &place {
            Some(Place { file, span: None, .. }) => format!("{file}: "),
            _ => String::new(),
        };
        let key = if e.key.is_empty() { String::new() } else { format!("{}: ", e.key) };
        Self { message: format!("{where_to}{key}{}", e.problem), place, hint: e.hint, exit_code: code::USAGE }
    }
}

impl From<LoadError> for Failure {
    fn from(e: LoadError) -> Self {
        match e {
            LoadError::Config(e) => e.into(),
            LoadError::Read(e) => Failure::usage(e),
            other => Failure::usage(other),
        }
    }
}

impl From<LoadSensorError> for Failure {
    fn from(e: LoadSensorError) -> Self {
        match e {
            LoadSensorError::Twin(e) => e.into(),
            other => Failure::usage(other).hint(
                "`gripgen calibrate presses` writes a sensor file; one of ours is asset:sensors/gelsight_r15/sensor.npz",
            ),
        }
    }
}

impl From<RenderError> for Failure {
    fn from(e: RenderError) -> Self {
        let hint = match &e {
            RenderError::Body { .. } => Some(
                "--x-px and --y-px are the place of the mesh's origin in the image; --scale-mm-per-unit is the size of its unit",
            ),
            RenderError::Mesh(e) => e.hint(),
            RenderError::NoTravel { .. } => Some("--depth-mm 0.5, say"),
            RenderError::Placed => Some("move and turn the array itself, or render a mesh"),
            RenderError::Heights { source: HeightsError::Shape { .. }, .. } => {
                Some("one height for each pixel of the sensor's image, rows first")
            }
            RenderError::Heights { source: HeightsError::NotANumber { .. }, .. } => {
                Some("-inf is where there is no surface")
            }
            RenderError::Heights { source: HeightsError::Travel { .. }, .. } => {
                Some("heights are in mm, or in --scale-mm-per-unit; above 0 is into the gel")
            }
            _ => None,
        };
        Failure::usage(&e).hint_if(hint)
    }
}

impl From<OpenPlantError> for Failure {
    fn from(e: OpenPlantError) -> Self {
        match e {
            OpenPlantError::Load(e) => e.into(),
            other => Failure::new(other),
        }
    }
}

impl From<FolderError> for Failure {
    fn from(e: FolderError) -> Self {
        match &e {
            FolderError::AnotherRun { .. } | FolderError::Foreign { .. } => another_run(&e),
            FolderError::Url { .. } => Self::usage(&e).hint_if(e.hint()),
            FolderError::Io { path, .. } if path.ends_with("run.json") => {
                Self::new(&e).hint("a run folder is what `gripgen sweep` writes")
            }
            FolderError::Io { source, .. } if no_room(source) => {
                Self::new(&e).hint("make room, or choose a folder on another disk; what is done stays, and the same command goes on")
            }
            _ => Self::new(&e).hint_if(e.hint()),
        }
    }
}

/// Whether a file did not fit.
pub fn no_room(e: &io::Error) -> bool {
    matches!(
        e.kind(),
        io::ErrorKind::StorageFull | io::ErrorKind::QuotaExceeded | io::ErrorKind::FileTooLarge
    )
}

/// The folder of another run, which is left alone.
pub fn another_run(error: &dyn Display) -> Failure {
    let failure = Failure { exit_code: code::ANOTHER_RUN, ..Failure::new(error) };
    failure.hint("choose another folder with --out; nothing was touched")
}

impl From<GpuError> for Failure {
    fn from(e: GpuError) -> Self {
        let failure = if e == GpuError::NotBuilt { Self::usage(&e) } else { Self::new(&e) };
        failure.hint(e.hint())
    }
}

impl From<SweepError> for Failure {
    fn from(e: SweepError) -> Self {
        match e {
            SweepError::Folder(e) => e.into(),
            SweepError::AnotherConfig { .. } => another_run(&e),
            SweepError::Slice { .. } => Failure::usage(e),
            SweepError::Gpu(e) => e.into(),
            other => Failure::new(other),
        }
    }
}

impl From<BenchError> for Failure {
    fn from(e: BenchError) -> Self {
        match e {
            BenchError::Gpu(e) => e.into(),
            BenchError::Load(e) => e.into(),
            other => Failure::new(other),
        }
    }
}

impl From<ReadError> for Failure {
    fn from(e: ReadError) -> Self {
        let hint = match &e {
            ReadError::Mcap { .. } => {
                Some("`gripgen verify` reads the whole run; sweeping again rebuilds what is broken")
            }
            _ => None,
        };
        Self::new(&e).hint_if(hint)
    }
}

impl From<OpenDatasetError> for Failure {
    fn from(e: OpenDatasetError) -> Self {
        let hint = match &e {
            OpenDatasetError::Dataset(e) => e.hint(),
            _ => None,
        };
        Self::usage(&e).hint_if(hint)
    }
}

impl From<ExportError> for Failure {
    fn from(e: ExportError) -> Self {
        match e {
            ExportError::Read(e) => e.into(),
            other => Failure::new(other),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What a build without the feature `gpu` answers; the tests are built with it.
    #[test]
    fn gpu_backend_not_built_is_a_usage_error_with_the_build_command() {
        let failure = Failure::from(SweepError::Gpu(GpuError::NotBuilt));
        assert_eq!(failure.exit_code(), code::USAGE);
        assert!(failure.what_to_do().unwrap().contains("cargo build --release --features gpu"));
    }
}
