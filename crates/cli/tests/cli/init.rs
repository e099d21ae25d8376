//! `gripgen init`.

use super::{assert_code, run, text};

#[test]
fn init_gives_something_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("start");
    let output = run(&["init", at.to_str().unwrap()]);
    assert_code(&output, 0);
    assert_eq!(text(&output.stdout).lines().count(), 2);
    assert_code(&run(&["check", at.join("sweep.toml").to_str().unwrap()]), 0);
    let again = run(&["init", at.to_str().unwrap()]);
    assert_code(&again, 2);
    assert!(text(&again.stderr).contains("--force"));
    assert_code(&run(&["init", at.to_str().unwrap(), "--force"]), 0);
    // A file that is no mesh becomes no folder, nor does one that is not there.
    for (name, there) in [("part.3mf", false), ("part.step", true)] {
        let file = folder.path().join(name);
        if there {
            std::fs::write(&file, "solid?").unwrap();
        }
        for more in [&[][..], &["-o", at.to_str().unwrap()]] {
            let refused = run(&[&["init", file.to_str().unwrap()], more].concat());
            assert_code(&refused, 2);
            let says = text(&refused.stderr);
            assert!(says.contains("STL") && says.contains("hint:"), "{says}");
            assert!(!file.is_dir(), "{name}");
        }
    }
    let version = folder.path().join("v1.2");
    assert_code(&run(&["init", version.to_str().unwrap()]), 0);
}

#[test]
fn init_with_a_mesh_proposes_grips_that_run() {
    let folder = tempfile::tempdir().unwrap();
    let mesh = folder.path().join("My Gear.STL");
    std::fs::write(&mesh, gripgen::assets::get("parts/gear/part.stl").unwrap()).unwrap();
    let at = folder.path().join("gear");
    let output = run(&["init", mesh.to_str().unwrap(), "-o", at.to_str().unwrap()]);
    assert_code(&output, 0);
    assert!(text(&output.stderr).contains("33.0") && text(&output.stderr).contains("grip 0"));
    assert_eq!(&std::fs::read(at.join("grips.png")).unwrap()[..4], b"\x89PNG");
    let check = run(&["check", at.join("sweep.toml").to_str().unwrap()]);
    assert_code(&check, 0);
    let again = run(&["init", mesh.to_str().unwrap(), "-o", at.to_str().unwrap(), "--force", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&again.stdout).unwrap();
    // The mesh is copied beside the twin, whose path to it is relative: the folder can be moved.
    assert_eq!(json["files"].as_array().unwrap().len(), 4);
    assert_eq!(std::fs::read(at.join("my_gear.stl")).unwrap(), std::fs::read(&mesh).unwrap());
    let moved = folder.path().join("moved");
    std::fs::rename(&at, &moved).unwrap();
    std::fs::rename(&mesh, folder.path().join("elsewhere.stl")).unwrap();
    assert_code(&run(&["check", moved.join("sweep.toml").to_str().unwrap()]), 0);
    std::fs::rename(&moved, &at).unwrap();
    std::fs::rename(folder.path().join("elsewhere.stl"), &mesh).unwrap();
    let inside =
        run(&["init", at.join("my_gear.stl").to_str().unwrap(), "-o", at.to_str().unwrap(), "--force"]);
    assert_code(&inside, 0);
    assert_eq!(text(&inside.stdout).lines().count(), 3, "a mesh that is there is not copied onto itself");
    assert!(json["grips"][0]["contact_mm2"].as_f64().unwrap() > 10.0);
    assert_code(&run(&["init", mesh.to_str().unwrap(), "--scale-mm-per-unit", "0"]), 2);

    let inches = run(&[
        "init",
        mesh.to_str().unwrap(),
        "-o",
        at.to_str().unwrap(),
        "--scale-mm-per-unit",
        "1000",
        "--force",
    ]);
    assert_code(&inches, 2);
    assert!(text(&inches.stderr).contains("33000") && text(&inches.stderr).contains("hint:"));
}

/// Of a part in PLY the grips are those of the same part in STL, and the copy keeps its format.
#[test]
fn init_reads_ply() {
    use std::fmt::Write as _;
    let folder = tempfile::tempdir().unwrap();
    let stl = gripgen::assets::get("parts/gear/part.stl").unwrap();
    let mesh = gripgen::twin::TriMesh::from_file_bytes(stl, "stl", 1e-3).unwrap();
    let mut ply = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\nelement face {}\n\
         property list uchar uint vertex_indices\nend_header\n",
        mesh.vertices_m().len(),
        mesh.triangles().len()
    );
    for v in mesh.vertices_m() {
        writeln!(ply, "{} {} {}", v.x * 1e3, v.y * 1e3, v.z * 1e3).unwrap();
    }
    for t in mesh.triangles() {
        writeln!(ply, "3 {} {} {}", t[0], t[1], t[2]).unwrap();
    }
    let grips = |name: &str, bytes: &[u8]| {
        let path = folder.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let at = folder.path().join(format!("of-{name}"));
        let output = run(&["init", path.to_str().unwrap(), "-o", at.to_str().unwrap(), "--json"]);
        assert_code(&output, 0);
        let json: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        json["grips"].clone()
    };
    assert_eq!(grips("gear.ply", ply.as_bytes()), grips("gear.stl", stl));
    assert!(folder.path().join("of-gear.ply/gear.ply").exists());
    assert_code(&run(&["check", folder.path().join("of-gear.ply/sweep.toml").to_str().unwrap()]), 0);
}

/// The benchmark: a sweep that runs, without a mesh on disk; what belongs to a mesh is refused.
#[test]
fn init_writes_the_benchmark() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path().join("bench");
    let output = run(&["init", "--benchmark", "--per-family", "1", "-o", at.to_str().unwrap()]);
    assert_code(&output, 0);
    assert_eq!(text(&output.stdout).lines().count(), 2);
    assert!(text(&output.stderr).contains("connector (test): 1"), "{}", text(&output.stderr));
    assert_code(&run(&["check", at.join("sweep.toml").to_str().unwrap()]), 0);
    assert_code(&run(&["init", "--benchmark", "--per-family", "1", "-o", at.to_str().unwrap()]), 2);
    for wrong in [&["--per-family", "1"][..], &["--benchmark", "--scale-mm-per-unit", "2"]] {
        assert_code(&run(&[&["init"], wrong].concat()), 2);
    }
}

/// A file that is not read is no folder to write into.
#[test]
fn init_of_a_file_that_is_not_read_says_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    for (name, word) in [("part.step", "CAD"), ("part.3MF", "convert")] {
        let at = folder.path().join(name);
        let output = run(&["init", at.to_str().unwrap()]);
        assert_code(&output, 2);
        assert!(text(&output.stderr).contains("hint:") && text(&output.stderr).contains(word));
        assert!(!at.exists(), "{name} became a folder");
    }
}
