//! Where a file is: on disk, or embedded.

use crate::assets::{self, ASSET_PREFIX};
use std::borrow::Cow;
use std::fmt;
use std::path::{Component, Path, PathBuf};

/// A file on disk or an embedded one (`asset:configs/twin.toml`).
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Location {
    /// A path of the file system.
    Disk(PathBuf),
    /// A path inside `assets/`.
    Asset(String),
}

/// A file could not be read.
#[derive(Debug, thiserror::Error)]
#[error("{location}: {problem}")]
pub struct ReadFileError {
    /// The file.
    pub location: Location,
    /// What the system says.
    pub problem: String,
}

impl Location {
    /// A location as a user writes it.
    pub fn parse(text: &str) -> Self {
        match text.strip_prefix(ASSET_PREFIX) {
            Some(path) => Location::Asset(path.into()),
            None => Location::Disk(text.into()),
        }
    }

    /// The file that `path` names in a configuration that lies here. Relative paths are relative to it.
    pub fn beside(&self, path: &str) -> Self {
        if path.starts_with(ASSET_PREFIX) || Path::new(path).is_absolute() {
            return Location::parse(path);
        }
        match self {
            Location::Disk(file) => {
                Location::Disk(file.parent().map_or_else(|| path.into(), |folder| folder.join(path)))
            }
            Location::Asset(file) => {
                let mut parts: Vec<&str> = file.split('/').collect();
                parts.pop();
                for part in path.split('/') {
                    match part {
                        ".." => drop(parts.pop()),
                        "." => {}
                        other => parts.push(other),
                    }
                }
                Location::Asset(parts.join("/"))
            }
        }
    }

    /// What a path that was typed in a shell is called in a configuration that lies here.
    pub(crate) fn named_from_shell(&self, path: &str) -> String {
        if path.starts_with(ASSET_PREFIX) || Path::new(path).is_absolute() {
            return path.into();
        }
        let folder = match self {
            Location::Asset(_) => None,
            Location::Disk(file) => {
                file.parent().map(|p| if p.as_os_str().is_empty() { Path::new(".") } else { p })
            }
        };
        match folder.and_then(|folder| folder.canonicalize().ok()) {
            Some(folder) => path_from(&folder, &Location::Disk(path.into())),
            None => std::path::absolute(path).unwrap_or_else(|_| path.into()).display().to_string(),
        }
    }

    /// The file that a robot description here refers to: `package://NAME/PATH` in a folder NAME beside or above it,
    /// other paths relative to it. `None` if there is none.
    pub fn ros_file(&self, reference: &str) -> Option<String> {
        let Location::Disk(file) = self else { return None };
        let plain = reference.strip_prefix("file://").unwrap_or(reference);
        let found = match plain.strip_prefix("package://") {
            None => file.parent()?.join(plain),
            Some(path) => file.ancestors().skip(1).map(|folder| folder.join(path)).find(|p| p.is_file())?,
        };
        found.is_file().then(|| found.display().to_string())
    }

    /// Reads the file.
    ///
    /// # Errors
    ///
    /// No such file or asset, or one that cannot be read.
    pub fn read(&self) -> Result<Cow<'static, [u8]>, ReadFileError> {
        let error = |problem: String| ReadFileError { location: self.clone(), problem };
        match self {
            Location::Disk(path) => std::fs::read(path).map(Cow::Owned).map_err(|e| error(e.to_string())),
            Location::Asset(path) => assets::read(path)
                .ok_or_else(|| error(format!("gripgen holds no such file; near it: {}", assets::near(path)))),
        }
    }

    /// Reads a text file.
    ///
    /// # Errors
    ///
    /// As [`Self::read`], or bytes that are not UTF-8.
    pub fn read_text(&self) -> Result<String, ReadFileError> {
        String::from_utf8(self.read()?.into_owned())
            .map_err(|e| ReadFileError { location: self.clone(), problem: format!("not text: {e}") })
    }

    /// Extension of the file name, without the dot.
    pub fn extension(&self) -> &str {
        let name = match self {
            Location::Disk(path) => path.as_path(),
            Location::Asset(name) => Path::new(name),
        };
        name.extension().and_then(|e| e.to_str()).unwrap_or_default()
    }

    /// What a run of this configuration is called: the file name without extension, or the folder of a `sweep.toml`.
    pub fn run_name(&self) -> String {
        let path = match self {
            Location::Disk(path) => std::path::absolute(path).unwrap_or_else(|_| path.clone()),
            Location::Asset(name) => PathBuf::from(name),
        };
        let stem = path.file_stem().map_or_else(|| "run".into(), |s| s.to_string_lossy().into_owned());
        let folder = path.parent().and_then(|p| p.file_name()).map(|f| f.to_string_lossy().into_owned());
        match folder {
            Some(folder) if stem == "sweep" => folder,
            _ => stem,
        }
    }
}

/// How a file is called in a configuration that lies in `folder` (canonical): relative to it where there is a way.
pub fn path_from(folder: &Path, file: &Location) -> String {
    let Location::Disk(path) = file else { return file.to_string() };
    if path.is_absolute() {
        return path.display().to_string();
    }
    let absolute = std::path::absolute(path).unwrap_or_else(|_| path.clone());
    // The folder of the file as it really lies, so that `..` does what it seems to do; its own name is kept.
    let real = match (absolute.parent().map(Path::canonicalize), absolute.file_name()) {
        (Some(Ok(parent)), Some(name)) => parent.join(name),
        _ => absolute,
    };
    let same = folder.components().zip(real.components()).take_while(|(a, b)| a == b).count();
    if same == 0 {
        return real.display().to_string();
    }
    let up = folder.components().skip(same).map(|_| Component::ParentDir);
    let relative: PathBuf = up.chain(real.components().skip(same)).collect();
    // Written with slashes everywhere, which every system reads.
    relative.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
}

impl fmt::Display for Location {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Location::Disk(path) => write!(f, "{}", path.display()),
            Location::Asset(path) => write!(f, "{ASSET_PREFIX}{path}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn paths_are_relative_to_the_configuration() {
        let disk = Location::parse("runs/a/sweep.toml");
        assert_eq!(disk.beside("twin.toml"), Location::Disk("runs/a/twin.toml".into()));
        assert_eq!(disk.beside("/x/twin.toml"), Location::Disk("/x/twin.toml".into()));
        assert_eq!(disk.beside("asset:configs/twin.toml"), Location::Asset("configs/twin.toml".into()));
        let asset = Location::parse("asset:configs/quickstart.toml");
        assert_eq!(asset.beside("twin.toml"), Location::Asset("configs/twin.toml".into()));
        assert_eq!(asset.beside("../parts/x.stl"), Location::Asset("parts/x.stl".into()));
        assert_eq!((asset.run_name().as_str(), asset.extension()), ("quickstart", "toml"));
        assert_eq!(disk.run_name(), "a", "many configurations are called sweep.toml");
        let made = Location::parse("asset:parts/benchmark/shaft_007.stl");
        assert_eq!(made.read().unwrap()[..9], *b"shaft_007");
        let none = Location::parse("asset:parts/benchmark/spoon_000.stl").read().unwrap_err().to_string();
        assert!(none.contains("gear_000.stl to gear_016.stl"), "{none}");
        assert!(
            Location::parse("asset:configs/none.toml").read().unwrap_err().to_string().contains("quickstart")
        );
    }
}
