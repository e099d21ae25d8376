//! `gripgen try`.

use super::{assert_code, gripgen, run, text};
use gripgen::twin::{TriMesh, write_binary_stl};
use std::path::Path;

#[test]
fn try_writes_a_page_and_a_picture() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("gear.stl");
    std::fs::write(&mesh, gripgen::assets::get("parts/gear/part.stl").unwrap()).unwrap();
    let page = folder.path().join("gear.html");
    let (mesh, at) = (mesh.to_str().unwrap(), page.to_str().unwrap());
    let output = run(&["try", mesh, "-o", at, "--json"]);
    assert_code(&output, 0);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(json["schema"], "gripgen.try/1");
    let held = &json["grips"][0]["holding"][3];
    assert_eq!(held["grip_force_n"], 20.0);
    let [low, value, high] =
        ["low", "value", "high"].map(|key| held["max_pull_force_n"][key].as_f64().unwrap());
    assert!((value - 6.0).abs() < 0.05 && low < 0.5 * value && high > 4.0 * value, "{held}");
    let written = std::fs::read_to_string(&page).unwrap();
    // Nothing is fetched and nothing runs.
    assert!(!written.contains("<script") && !written.contains("http"), "the page stands alone");
    assert_eq!(
        written.matches("data:image/png;base64,").count(),
        3 * json["grips"].as_array().unwrap().len()
    );
    assert_eq!(&std::fs::read(folder.path().join("gear.png")).unwrap()[..4], b"\x89PNG");

    // With a number the word is the force of a jaw.
    let other = folder.path().join("other.html");
    let at_12_n = ["try", mesh, "-o", other.to_str().unwrap(), "--force", "12", "--grip", "0"];
    assert_code(&run(&at_12_n), 0);
    assert!(std::fs::read_to_string(&other).unwrap().contains("at 12 N"));
    assert_code(&run(&at_12_n), 2);
    assert_code(&run(&["try", mesh, "-o", at]), 2);
    assert_code(&run(&["try", mesh, "-o", at, "--force-n", "12"]), 2);
    assert_code(&run(&["try", mesh, "-o", at, "--force", "-q"]), 0);
    let refused = run(&["try", mesh, "-o", at, "--force", "-3"]);
    assert_code(&refused, 2);
    let unread = run(&["try", folder.path().join("part.step").to_str().unwrap()]);
    assert_code(&unread, 2);
    assert!(text(&unread.stderr).contains("hint:") && text(&unread.stderr).contains("CAD"));
}

/// A box of 20 x 12 x 10 mm in inches, without one of its triangles.
fn write_open_box(path: &Path) {
    let corner = |i: u32| {
        let at = |bit: u32, side_mm: f64| f64::from(i >> bit & 1) * side_mm / 25.4;
        [at(0, 20.0), at(1, 12.0), at(2, 10.0)].into()
    };
    let quads = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [1, 3, 7, 5], [0, 4, 6, 2]];
    let triangles = quads.into_iter().flat_map(|[a, b, c, d]: [u32; 4]| [[a, b, c], [a, c, d]]).take(11);
    let mesh = TriMesh::new((0..8).map(corner).collect(), triangles.collect()).unwrap();
    std::fs::write(path, write_binary_stl(&mesh, "open box", 1.0)).unwrap();
}

/// The command that is proposed reads the part as it was read, whatever its name is, and so do those that it proposes in turn.
#[cfg(unix)]
#[test]
fn proposed_commands_run_as_they_are_copied() {
    let folder = tempfile::tempdir().unwrap();
    write_open_box(&folder.path().join("-it's a box.stl"));
    let arguments =
        ["try", "./-it's a box.stl", "--accept-open-mesh", "--scale-mm-per-unit", "25.4", "--mu", "0.25"];
    let tried = gripgen().current_dir(folder.path()).args(arguments).output().unwrap();
    assert_code(&tried, 0);
    let shell = |line: &str| {
        let output = std::process::Command::new("sh").current_dir(folder.path()).args(["-c", line]).output();
        output.unwrap()
    };
    let next = |output: &std::process::Output| {
        let said = text(&output.stderr);
        said.lines()
            .find_map(|line| line.strip_prefix("next: "))
            .unwrap_or_else(|| panic!("{said}"))
            .to_string()
    };
    let line = next(&tried);
    assert!(line.contains("--mu 0.25"), "{line}");
    assert!(line.contains("--accept-open-mesh") && line.contains("--scale-mm-per-unit 25.4"), "{line}");
    let made = shell(&line);
    assert_code(&made, 0);
    assert!(folder.path().join("-it's a box/sweep.toml").exists());
    let twin = std::fs::read_to_string(folder.path().join("-it's a box/twin.toml")).unwrap();
    assert!(twin.contains("mu = 0.25 "), "{twin}");
    let line = next(&made);
    let check = line.split(", then ").next().unwrap();
    assert!(check.contains(" check "), "{line}");
    assert_code(&shell(check), 0);
}

/// What a twin would refuse is refused here, with both numbers.
#[test]
fn friction_beyond_that_of_a_twin_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("gear.stl");
    std::fs::write(&mesh, gripgen::assets::get("parts/gear/part.stl").unwrap()).unwrap();
    let refused = run(&["try", mesh.to_str().unwrap(), "--mu", "150"]);
    assert_code(&refused, 2);
    let below = run(&["try", mesh.to_str().unwrap(), "--mu", "-0.3"]);
    assert_code(&below, 2);
    assert!(text(&below.stderr).contains("a number above 0 is wanted"), "{}", text(&below.stderr));
    let said = text(&refused.stderr);
    assert!(said.contains("mu = 150") && said.contains("at most 5") && said.contains("hint:"), "{said}");
}
