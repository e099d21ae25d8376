//! The files of `assets/`, embedded, so that an installed gripgen needs no checkout.

/// Prefix of a path that names an embedded file.
pub const ASSET_PREFIX: &str = "asset:";

macro_rules! embedded {
    ($($path:literal),* $(,)?) => {
        &[$(($path, include_bytes!(concat!("../assets/", $path)).as_slice())),*]
    };
}

/// Path (relative to `assets/`) and content of every embedded file.
static FILES: &[(&str, &[u8])] = embedded![
    "configs/paper.toml",
    "configs/quickstart.toml",
    "configs/large.toml",
    "configs/rig.toml",
    "configs/twin-large.toml",
    "configs/twin-baseline.toml",
    "configs/twin-contact.toml",
    "configs/twin.toml",
    "robots/ur5e/ur5e.urdf",
    "parts/ball_bearing/part.stl",
    "parts/gear/part.stl",
    "parts/long_shaft/part.stl",
    "parts/roller_bearing/part.stl",
    "sensors/gelsight_r15/sensor.npz",
    "templates/diagnosis.html",
    "templates/page.css",
    "templates/part-sweep.toml",
    "templates/part-twin.toml",
    "templates/presses.html",
    "templates/sweep.toml",
    "templates/twin.toml",
    "templates/view.html",
];

/// The content of an embedded file.
pub fn get(path: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
}

/// The content of an embedded text file.
///
/// # Panics
/// If there is no such file: its name is a constant of this crate.
pub(crate) fn text(path: &str) -> &'static str {
    std::str::from_utf8(get(path).expect("the name is one of the list")).expect("templates are text")
}

/// Paths of all embedded files.
pub fn paths() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}
