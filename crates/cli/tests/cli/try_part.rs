//! `gripgen try`.

use super::{assert_code, run, text};

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

    // The same verb replaces its own; an edited page needs the word.
    assert_code(&run(&["try", mesh, "-o", at, "--force", "12", "--grip", "0"]), 0);
    assert!(std::fs::read_to_string(&page).unwrap().contains("at 12 N"));
    std::fs::write(&page, "mine").unwrap();
    assert_code(&run(&["try", mesh, "-o", at]), 2);
    assert_code(&run(&["try", mesh, "-o", at, "--force-n", "12"]), 2);
    assert_code(&run(&["try", mesh, "-o", at, "--force", "-q"]), 0);
    let refused = run(&["try", mesh, "-o", at, "--force", "-3"]);
    assert_code(&refused, 2);
    let unread = run(&["try", folder.path().join("part.step").to_str().unwrap()]);
    assert_code(&unread, 2);
    assert!(text(&unread.stderr).contains("hint:") && text(&unread.stderr).contains("CAD"));
}
