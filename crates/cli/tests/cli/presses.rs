//! `gripgen calibrate presses` and `gripgen compare`.

use super::{assert_code, run, text};

/// Presses of a ball as a folder of pictures, drawn with the shipped sensor.
fn press_folder(count: usize) -> tempfile::TempDir {
    use gripgen::tactile::presses::{Circle, Press, predict_press};
    let folder = tempfile::tempdir().unwrap();
    let bytes = gripgen::assets::get("sensors/gelsight_r15/sensor.npz").unwrap();
    let sensor = gripgen::tactile::Sensor::from_npz(bytes, None, None).unwrap();
    let rest = gripgen::tactile::finish(&sensor, None, Some(1));
    let save = |name: &str, image: &gripgen::twin::TactileImage| {
        std::fs::write(folder.path().join(name), gripgen::record::encode_png(image).unwrap()).unwrap();
    };
    save("rest.png", &rest);
    let mut table = String::from("image,x_px,y_px,radius_px\n");
    for i in 0..count {
        let x_px = 40.0 + 240.0 * (i as f64 * 0.754_877_666).fract();
        let y_px = 40.0 + 160.0 * (i as f64 * 0.569_840_291).fract();
        let circle = Circle { x_px, y_px, radius_px: 20.0 + (i % 3) as f64 };
        let press = Press::of_ball("", rest.clone(), Some(circle));
        let name = format!("press-{i:02}.png");
        save(&name, &predict_press(&press, 5e-3, &sensor).unwrap());
        // Every fourth contact is left for the program to find.
        let marks = match i % 4 {
            1 => ",,".into(),
            2 => format!(",,{}", circle.radius_px),
            _ => format!("{x_px},{y_px},{}", circle.radius_px),
        };
        table += &format!("{name},{marks}\n");
    }
    std::fs::write(folder.path().join("presses.csv"), table).unwrap();
    folder
}

#[test]
fn a_sensor_is_calibrated_from_a_folder_of_presses_and_compared_with_it() {
    let presses = press_folder(16);
    let path = presses.path().to_str().unwrap();
    let out = tempfile::tempdir().unwrap();
    let sensor = out.path().join("sensor.npz");
    let flags = ["calibrate", "presses", path, "-o", sensor.to_str().unwrap(), "--json"];
    let missing = run(&flags);
    assert_code(&missing, 2);
    assert!(text(&missing.stderr).contains("--ball-mm"), "{}", text(&missing.stderr));
    let done = run(&[&flags[..], &["--ball-mm", "5", "--mm-per-px", "0.0877"]].concat());
    assert_code(&done, 0);
    assert!(text(&done.stderr).contains("4 presses, it was looked for"), "{}", text(&done.stderr));
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(json["held_out"]["n"], 16);
    assert_eq!(json["fitted"]["ball_mm"], 5.0);
    assert!(std::fs::read_to_string(out.path().join("sensor.html")).unwrap().contains("press-07.png"));
    // The file holds ball and pixel size, so comparing takes no flags.
    let compared = run(&["compare", path, "--sensor", sensor.to_str().unwrap(), "--json"]);
    assert_code(&compared, 0);
    let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!((&json["schema"], &json["presses"]["n"]), (&"gripgen.comparison/1".into(), &16.into()));
    let mse = json["presses"]["full"]["mse"].as_f64().unwrap();
    // The noise of rest.png is in it, and circles that were found.
    assert!(mse < 3.0, "{mse}");
    assert_eq!(json["presses"]["each"].as_array().unwrap().len(), 16);
    // A twin's sensor, with the deformation of its gel.
    let twin = run(&["compare", path, "--json"]);
    assert_code(&twin, 2);
    assert!(text(&twin.stderr).contains("how large the ball is"), "{}", text(&twin.stderr));
    let wrong = run(&["compare", path, "--sensor", "asset:sensors/none.npz"]);
    assert_code(&wrong, 2);
    let nothing = run(&["compare", out.path().to_str().unwrap()]);
    assert_code(&nothing, 2);
    assert!(text(&nothing.stderr).contains("presses.csv"));
}

#[test]
fn presses_that_cannot_be_are_refused_before_the_fit() {
    let presses = press_folder(5);
    let path = presses.path().to_str().unwrap();
    let out = tempfile::tempdir().unwrap();
    let at = |name: &str| out.path().join(name).to_str().unwrap().to_string();
    let calibrate = |more: &[&str]| {
        run(&[&["calibrate", "presses", path, "--ball-mm", "5", "--mm-per-px", "0.0877"], more].concat())
    };
    let table = presses.path().join("presses.csv");
    let good = std::fs::read_to_string(&table).unwrap();
    for (faulty, says) in [
        ("image,x_px,y_px,depth_mm\npress-00.png,40,40,1200\n", "1200 mm deep, the ball's radius is 2.5 mm"),
        ("image,x_px,y_px,radius_px\npress-00.png,40,40,90\n", "needs at least 4"),
        (&good.replacen("\npress-00.png,40", "\npress-00.png,4000", 1), "outside the 320x240 image"),
    ] {
        std::fs::write(&table, faulty).unwrap();
        let refused = calibrate(&["-o", &at("s.npz")]);
        assert_code(&refused, 2);
        assert!(text(&refused.stderr).contains(says), "{}", text(&refused.stderr));
    }
    std::fs::write(&table, good).unwrap();
    for flags in [
        vec!["-o".into(), at("none/s.npz")],
        vec!["-o".into(), at("")],
        vec!["-o".into(), at("s.html")],
        vec!["-o".into(), at("s.npz"), "--report".into(), at("none/r.html")],
        vec!["-o".into(), at("s.npz"), "--json".into(), at("none/j.json")],
    ] {
        assert_code(&calibrate(&flags.iter().map(String::as_str).collect::<Vec<_>>()), 2);
    }
    assert_eq!(std::fs::read_dir(out.path()).unwrap().count(), 0, "nothing was written");
}
