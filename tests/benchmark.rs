//! The benchmark of two hundred parts: made on demand, with grips that hold wherever its sweep goes.

use crate::common::{project_in, pulled};
use gripgen::assets;
use gripgen::twin::TriMesh;
use gripgen::twin::parts::benchmark;
use gripgen_cli::benchmark_starter;

/// A part of each family: grips of all, no sample fails, and families and their split stand in what every run carries.
#[test]
fn a_sweep_over_the_benchmark_holds() {
    let made = benchmark_starter(Some(1), 2).unwrap();
    assert!(made.parts >= 10 && made.parts + made.left_out.len() == 12, "{}", made.summary);
    let folder = tempfile::tempdir().unwrap();
    for file in &made.files {
        std::fs::write(folder.path().join(&file.name), &file.bytes).unwrap();
    }
    let project = project_in(folder.path(), &[("images", "none"), ("samples", "60")]);
    let config: toml::Table = project.config_toml.parse().unwrap();
    let part = |name: &str, key: &str| config["twin"]["parts"][name][key].as_str().map(str::to_string);
    for (name, parts) in project.twin.parts.iter().map(|(name, part)| (name, part.grips.len())) {
        let of = benchmark::part(name).unwrap();
        assert_eq!(parts, 2);
        assert_eq!(part(name, "family").as_deref(), Some(of.family));
        assert_eq!(part(name, "split").as_deref(), Some(of.split.name()));
    }
    for index in 0..60 {
        assert!(pulled(&project, index).is_some(), "sample {index} has no contact");
    }
}

/// An asset like any other: the bytes of a mesh in millimetres, the same each time.
#[test]
fn parts_of_the_benchmark_are_assets() {
    let path = "parts/benchmark/gear_003.stl";
    let bytes = assets::read(path).unwrap();
    assert_eq!(bytes, assets::read(path).unwrap());
    let mesh = TriMesh::from_file_bytes(&bytes, "stl", 1e-3).unwrap();
    let of = benchmark::part("gear_003").unwrap().mesh();
    assert_eq!(mesh.triangles().len(), of.triangles().len());
    assert!((mesh.signed_volume_m3() / of.signed_volume_m3() - 1.0).abs() < 1e-5);
    assert!(
        assets::read("parts/benchmark/gear_003.obj").is_none()
            && assets::read("parts/gear/part.stl").is_some()
    );
}
