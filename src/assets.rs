//! The files of `assets/`, embedded, so that an installed gripgen needs no checkout; and the meshes of the benchmark, which are
//! made when they are asked for.

use gripgen_twin::parts::benchmark;
use gripgen_twin::write_binary_stl;
use std::borrow::Cow;

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
    "configs/rig.toml",
    "configs/training.toml",
    "configs/twin-baseline.toml",
    "configs/twin-contact.toml",
    "configs/twin-training.toml",
    "configs/twin.toml",
    "priors/friction.toml",
    "priors/gel.toml",
    "priors/images.toml",
    "priors/pulls.toml",
    "priors/rig.toml",
    "robots/ur5e/ur5e.urdf",
    "parts/ball_bearing/part.stl",
    "parts/gear/part.stl",
    "parts/long_shaft/part.stl",
    "parts/roller_bearing/part.stl",
    "schemas/rosbag.json",
    "sensors/dots_generic/sensor.npz",
    "sensors/gelsight_objectfolder/sensor.npz",
    "sensors/gelsight_r15/sensor.npz",
    "sensors/gelsight_synthetic/sensor.npz",
    "sensors/gelsight_taxim/sensor.npz",
    "templates/benchmark-sweep.toml",
    "templates/benchmark-twin.toml",
    "templates/part-sweep.toml",
    "templates/part-twin.toml",
    "templates/sweep.toml",
    "templates/twin.toml",
];

/// The content of an embedded file.
pub fn get(path: &str) -> Option<&'static [u8]> {
    FILES.iter().find(|(name, _)| *name == path).map(|(_, bytes)| *bytes)
}

/// Folder of the parts that are made on demand: `parts/benchmark/shaft_007.stl`.
pub const BENCHMARK: &str = "parts/benchmark/";

/// The content of an embedded file, or of a mesh of the benchmark: binary STL in millimetres, the same bytes everywhere.
pub fn read(path: &str) -> Option<Cow<'static, [u8]>> {
    let Some(file) = path.strip_prefix(BENCHMARK) else { return get(path).map(Cow::Borrowed) };
    let part = benchmark::part(file.strip_suffix(".stl")?)?;
    Some(Cow::Owned(write_binary_stl(&part.mesh(), &part.name, 1e-3)))
}

/// What lies near a path that is none: files of its folder, for people.
pub(crate) fn near(path: &str) -> String {
    if path.starts_with(BENCHMARK.trim_end_matches('/')) {
        let families = benchmark::FAMILIES.iter().map(|family| {
            let last = benchmark::all().iter().rfind(|part| part.family == family.name);
            last.map_or_else(String::new, |last| {
                format!("{BENCHMARK}{}_000.stl to {}.stl", family.name, last.name)
            })
        });
        return families.collect::<Vec<_>>().join(", ");
    }
    let folder = path.rsplit_once('/').map_or("", |(folder, _)| folder);
    paths().filter(|p| p.starts_with(folder)).collect::<Vec<_>>().join(", ")
}

/// The content of an embedded text file.
///
/// # Panics
/// If there is no such file: its name is a constant of this crate.
pub fn text(path: &str) -> &'static str {
    std::str::from_utf8(get(path).expect("the name is one of the list")).expect("templates are text")
}

/// Paths of all embedded files.
pub fn paths() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}
