//! `gripgen sensor check`.

use super::{assert_code, run, text};
use gripgen::record::encode_png;
use gripgen::tactile::presses::{Circle, Press, predict_press};
use gripgen::tactile::{Sensor, finish};
use gripgen::twin::TactileImage;
use serde_json::Value;
use std::path::Path;

const SENSOR: &str = "asset:sensors/gelsight_synthetic/sensor.npz";

/// Five presses of a ball of 5 mm into the shipped sensor, as a camera of these gains takes them.
fn presses(gain: [f64; 3]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let bytes = gripgen::assets::get("sensors/gelsight_synthetic/sensor.npz").unwrap();
    let sensor = Sensor::from_npz(bytes, None, None).unwrap();
    let save = |name: &str, image: &TactileImage| {
        let level = |(i, v): (usize, &u8)| (f64::from(*v) * gain[i % 3]).round().min(255.0) as u8;
        let rgb = image.rgb.iter().enumerate().map(level).collect();
        let png = encode_png(&TactileImage { rgb, ..*image }).unwrap();
        std::fs::write(folder.path().join(name), png).unwrap();
    };
    save("rest.png", &finish(&sensor, None, Some(1)));
    let mut table = String::from("image,x_px,y_px,radius_px\n");
    let places = [(80.0, 60.0), (230.0, 70.0), (160.0, 125.0), (90.0, 180.0), (240.0, 175.0)];
    for (i, (x_px, y_px)) in places.into_iter().enumerate() {
        let circle = Circle { x_px, y_px, radius_px: 19.0 + i as f64 };
        let blank = TactileImage { width_px: 320, height_px: 240, rgb: vec![0; 320 * 240 * 3] };
        let clean = predict_press(&Press::of_ball("", blank, Some(circle)), 5e-3, &sensor).unwrap();
        let rest = [0, 1, 2].map(|c| clean.rgb.iter().skip(c).step_by(3).map(|&v| f32::from(v)).collect());
        let noisy = finish(&Sensor { rest, ..sensor.clone() }, None, Some(10 + i as u64));
        save(&format!("{i}.png"), &noisy);
        table += &format!("{i}.png,{x_px},{y_px},{}\n", circle.radius_px);
    }
    std::fs::write(folder.path().join("presses.csv"), table).unwrap();
    folder
}

fn check(sensor: &str, folder: &Path, more: &[&str]) -> (std::process::Output, Value) {
    let done =
        run(&[&["sensor", "check", sensor, folder.to_str().unwrap(), "--json", "--ball-mm", "5"], more]
            .concat());
    let json = serde_json::from_slice(&done.stdout).unwrap_or(Value::Null);
    (done, json)
}

#[test]
fn another_light_is_named_and_has_a_file_that_shows_no_change_afterwards() {
    let dimmer = presses([0.8, 1.0, 1.1]);
    let out = tempfile::tempdir().unwrap();
    let (today, page) = (out.path().join("today.npz"), out.path().join("today.html"));
    let files = ["-o", today.to_str().unwrap(), "--report", page.to_str().unwrap()];
    let (done, json) = check(SENSOR, dimmer.path(), &files);
    assert_code(&done, 0);
    assert_eq!(
        (&json["schema"], &json["verdict"]),
        (&"gripgen.sensor_check/1".into(), &"light".into()),
        "{json}"
    );
    assert_eq!((&json["n"], &json["doubts"]["rest"]["used"]), (&5.into(), &true.into()));
    let number = |name: &str| json["numbers"][name]["value"].as_f64().unwrap();
    assert!(
        (number("level_ratio_red") - 0.8).abs() < 0.02 && (number("level_ratio_blue") - 1.1).abs() < 0.02,
        "{json}"
    );
    let frame = |when: &str| json["grey_rms"][when]["frame"].as_f64().unwrap();
    assert!(frame("before") > 5.0 && frame("after") < 2.0, "{json}");
    let weights: f64 =
        json["explanations"].as_array().unwrap().iter().map(|e| e["weight"].as_f64().unwrap()).sum();
    assert!((weights - 1.0).abs() < 1e-9);
    let shown = std::fs::read_to_string(&page).unwrap();
    assert!(shown.contains("Where something is left") && shown.contains("light: the light"), "the page");
    // The file of the day holds for that day, and no file is replaced unasked.
    let (again, json) = check(today.to_str().unwrap(), dimmer.path(), &[]);
    assert_code(&again, 0);
    assert_eq!(json["verdict"], "nothing", "{json}");
    assert_code(&check(SENSOR, dimmer.path(), &files).0, 2);
}

#[test]
fn presses_of_the_same_day_change_nothing_and_what_cannot_be_is_refused() {
    let same = presses([1.0; 3]);
    let (done, json) = check(SENSOR, same.path(), &[]);
    assert_code(&done, 0);
    assert_eq!(json["verdict"], "nothing", "{json}");
    assert!(
        json["today"].is_null()
            && json["doubts"]["beyond_ball"].is_null()
            && json["doubts"]["spots"] == serde_json::json!([])
    );
    let words = run(&["sensor", "check", SENSOR, same.path().to_str().unwrap(), "--ball-mm", "5"]);
    assert!(text(&words.stdout).contains("nothing: the sensor file holds"), "{}", text(&words.stdout));
    // A ball that is smaller than its marks: how many, and the smallest that fits.
    let small =
        run(&["sensor", "check", SENSOR, same.path().to_str().unwrap(), "--ball-mm", "3.6", "--json"]);
    let json: Value = serde_json::from_slice(&small.stdout).unwrap();
    // Radii of 22 and 23 px of 0.0877 mm lie beyond 1.05 times 1.8 mm.
    assert_eq!(json["doubts"]["beyond_ball"]["presses"], 2, "{json}");
    let smallest = json["doubts"]["beyond_ball"]["smallest_ball_mm"].as_f64().unwrap();
    assert!((smallest - 2.0 * 23.0 * 0.0877 / 1.05).abs() < 0.01, "{smallest}");
    assert!(text(&small.stderr).contains("2 of 5 marks are wider than the ball"), "{}", text(&small.stderr));
    // Three presses are too few, with both numbers.
    let table = std::fs::read_to_string(same.path().join("presses.csv")).unwrap();
    let few: Vec<&str> = table.lines().take(4).collect();
    std::fs::write(same.path().join("presses.csv"), few.join("\n")).unwrap();
    let (done, _) = check(SENSOR, same.path(), &[]);
    assert_code(&done, 2);
    assert!(
        text(&done.stderr).contains("3 presses of a ball, a check needs at least 4"),
        "{}",
        text(&done.stderr)
    );
}
