//! `gripgen calibrate presses` and `gripgen compare`.

use super::{assert_code, run, text};
use gripgen::tactile::npz::{Array, ElementType, write_npy};

/// Presses of a ball as a folder of pictures, drawn with the shipped sensor.
fn press_folder(count: usize) -> tempfile::TempDir {
    use gripgen::tactile::presses::{Circle, Press, predict_press};
    let folder = tempfile::tempdir().unwrap();
    let bytes = gripgen::assets::get("sensors/gelsight_synthetic/sensor.npz").unwrap();
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
    assert_eq!(json["rest"]["used"], true, "{json}");
    assert_eq!(json["fitted"]["ball_mm"], 5.0);
    // One ball, and nothing that would show how large it is.
    assert_eq!(json["ball_size"]["checked"], false);
    assert!(json["ball_size"]["by"].is_null() && json["ball_size"]["factor"].is_null(), "{json}");
    assert!(text(&done.stderr).contains("the ball's size cannot be checked"), "{}", text(&done.stderr));
    let page = std::fs::read_to_string(out.path().join("sensor.html")).unwrap();
    assert!(page.contains("press-07.png") && page.contains("Where something was pressed"));
    // How much of the frame the presses cover, by parts too, and what is said of those that they do not.
    let coverage = &json["coverage"];
    let shares: Vec<f64> =
        serde_json::from_value::<Vec<Vec<f64>>>(coverage["part_shares"].clone()).unwrap().concat();
    let share = coverage["share"].as_f64().unwrap();
    assert!(
        (shares.iter().sum::<f64>() / 12.0 - share).abs() < 0.01 && share > 0.1 && share < 1.0,
        "{coverage}"
    );
    let unseen = coverage["unseen_parts"].as_array().unwrap().len();
    assert_eq!(shares.iter().filter(|share| **share < 0.25).count(), unseen);
    let words = format!("{:.0} % of the frame lay in a contact", 100.0 * share);
    assert!(page.contains(&words), "{words}");
    assert_eq!(text(&done.stderr).contains(&words), unseen > 0, "{}", text(&done.stderr));
    // The same command again gives the same bytes.
    let before = std::fs::read(&sensor).unwrap();
    let again = [&flags[..5], &["--ball-mm", "5", "--mm-per-px", "0.0877", "-q"]].concat();
    assert_code(&run(&again), 2);
    assert_code(&run(&[&again[..], &["--force"]].concat()), 0);
    assert!(std::fs::read(&sensor).unwrap() == before, "the same bytes");
    let onto =
        run(&["compare", path, "--sensor", sensor.to_str().unwrap(), "--report", sensor.to_str().unwrap()]);
    assert_code(&onto, 2);
    assert!(text(&onto.stderr).contains("is what the command reads"), "{}", text(&onto.stderr));
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

/// Images without colours are refused by every verb that reads presses; JPEGs are read, with a warning.
#[test]
fn grey_presses_are_refused_and_jpegs_warned_of() {
    use gripgen::twin::TactileImage;
    let presses = press_folder(4);
    let path = presses.path().to_str().unwrap();
    let out = tempfile::tempdir().unwrap();
    let (sensor, fitted) = (out.path().join("sensor.npz"), out.path().join("fitted.npz"));
    let sensor = sensor.to_str().unwrap();
    let bytes = gripgen::assets::get("sensors/gelsight_synthetic/sensor.npz").unwrap();
    let mut with_ball = gripgen::tactile::Sensor::from_npz(bytes, None, None).unwrap();
    with_ball.ball_m = Some(5e-3);
    std::fs::write(sensor, with_ball.to_npz().unwrap().unwrap()).unwrap();
    let size = ["--ball-mm", "5", "--mm-per-px", "0.0877"];
    let verbs = [
        [&["calibrate", "presses", path, "-o", fitted.to_str().unwrap()][..], &size].concat(),
        vec!["compare", path, "--sensor", sensor],
        vec!["diagnose", path, "--sensor", sensor],
    ];
    let refuse = |image: &[u8], name: &str, says: &str, hints: &str| {
        let file = presses.path().join(name);
        let good = std::fs::read(&file).unwrap();
        std::fs::write(&file, image).unwrap();
        for verb in &verbs {
            let refused = run(verb);
            assert_code(&refused, 2);
            let stderr = text(&refused.stderr);
            assert!(stderr.contains(says) && stderr.contains(hints), "{verb:?}: {stderr}");
        }
        std::fs::write(&file, good).unwrap();
    };
    let levels = (0..320 * 240u32).flat_map(|i| [(i % 251) as u8; 3]).collect();
    let grey = TactileImage { width_px: 320, height_px: 240, rgb: levels };
    let grey = gripgen::record::encode_png(&grey).unwrap();
    for (name, called) in [("press-02.png", "press-02.png"), ("rest.png", "rest frame")] {
        let says = format!("`{called}` is grey: red, green and blue are equal at all of its 76800 pixels");
        refuse(&grey, name, &says, "not converted to grey");
    }
    assert!(!fitted.exists());
    let file = presses.path().join("press-01.png");
    let image = gripgen::record::decode_picture(&std::fs::read(&file).unwrap()).unwrap();
    std::fs::write(&file, gripgen::record::encode_jpeg(&image, 95).unwrap()).unwrap();
    let read = run(&["compare", path, "--sensor", sensor]);
    assert_code(&read, 0);
    let stderr = text(&read.stderr);
    assert!(stderr.contains("1 of 5 images are JPEGs"), "{stderr}");
}

/// A mesh drawn with the shipped sensor: what it is in the image, in the surface, and what is refused.
#[test]
fn a_mesh_is_rendered_with_its_surface() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    // A tetrahedron that stands on its tip: 4 mm wide 2 mm above it.
    let corners = [[0.0, 0.0, 5.0], [-2.0, -2.0, 3.0], [2.0, -2.0, 3.0], [0.0, 2.5, 3.0]];
    let mut obj: String = corners.iter().map(|[x, y, z]| format!("v {x} {y} {z}\n")).collect();
    obj += "f 1 2 3\nf 1 3 4\nf 1 4 2\nf 2 4 3\n";
    std::fs::write(file("tip.obj"), obj).unwrap();
    let sensor = "asset:sensors/gelsight_synthetic/sensor.npz";
    let tip = file("tip.obj");
    let (image, heights, normals, mask) = (file("out.png"), file("h.npy"), file("n.npy"), file("m.png"));
    let wanted = ["--heights", &heights, "--normals", &normals, "--mask", &mask, "-o", &image, "--json"];
    let arguments = [&["render", &tip, "--depth-mm", "0.5", "--sensor", sensor][..], &wanted].concat();
    let output = run(&arguments);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!((told["x_px"].as_f64(), told["y_px"].as_f64()), (Some(159.5), Some(119.5)));
    let area_mm2 = told["contact_area_mm2"].as_f64().unwrap();
    // The section of the tip at 0.4 of the depth below the gel, 0.3 mm above the tip: 0.15^2 of 9 mm2.
    assert!((area_mm2 - 0.0225 * 9.0).abs() < 0.1, "{area_mm2}");
    let floats = |name: &str, header: usize| -> Vec<f32> {
        let bytes = std::fs::read(name).unwrap();
        let (words, _) = bytes[header..].as_chunks::<4>();
        words.iter().map(|word| f32::from_le_bytes(*word)).collect()
    };
    let heights = floats(&heights, 128);
    assert_eq!(heights.len(), 320 * 240);
    let deepest = heights.iter().fold(0.0f32, |m, &h| m.max(h));
    // The last blur rounds the tip off.
    assert!(deepest > 0.25 && deepest <= 0.5, "{deepest} mm");
    let normals = floats(&normals, 128);
    let unit = |n: &[f32]| (n[0] * n[0] + n[1] * n[1] + n[2] * n[2] - 1.0).abs() < 1e-5;
    assert!(normals.chunks_exact(3).all(unit));
    // Right of the tip the surface looks to the right, above it to the top.
    let at = |x: usize, y: usize| &normals[3 * (320 * y + x)..][..3];
    assert!(at(163, 120)[0] > 0.05 && at(156, 120)[0] < -0.05 && at(160, 116)[1] > 0.05);
    // The image shows it, and the mask is what was counted.
    let picture = |name: &str| gripgen::record::decode_picture(&std::fs::read(file(name)).unwrap()).unwrap();
    let bytes = gripgen::assets::get("sensors/gelsight_synthetic/sensor.npz").unwrap();
    let rest =
        gripgen::tactile::finish(&gripgen::tactile::Sensor::from_npz(bytes, None, None).unwrap(), None, None);
    let change = |x: usize, y: usize| {
        let at = 3 * (y * 320 + x);
        picture("out.png").rgb[at..at + 3].iter().zip(&rest.rgb[at..at + 3]).any(|(a, b)| a.abs_diff(*b) > 10)
    };
    assert!(change(163, 120) && change(156, 120) && !change(20, 20));
    let inside = |name: &str| -> Vec<(f64, f64)> {
        let rgb = picture(name).rgb;
        let white = (0..320 * 240).filter(|i| rgb[3 * i] == 255);
        white.map(|i| ((i % 320) as f64, (i / 320) as f64)).collect()
    };
    assert!((inside("m.png").len() as f64 * 0.0877 * 0.0877 - area_mm2).abs() < 1e-6);
    // Placed, turned by half a turn, and smaller: the middle of its section lies 0.5 mm times 0.6 beside its tip, 3.4 px.
    let middle = |more: &[&str]| {
        let placed = ["--x-px", "140", "--y-px", "90.5"];
        let drawn = run(&[
            &arguments[..2],
            &["--depth-mm", "2", "--sensor", sensor],
            &placed,
            &wanted,
            &["--force"],
            more,
        ]
        .concat());
        assert!(drawn.status.success(), "{}", text(&drawn.stderr));
        let all = inside("m.png");
        let n = all.len() as f64;
        (all.iter().map(|p| p.0).sum::<f64>() / n, all.iter().map(|p| p.1).sum::<f64>() / n, n)
    };
    let (plain, turned) = (middle(&[]), middle(&["--rotation-deg", "180"]));
    for ((x, y, n), wanted_y) in [(plain, 90.5 + 3.4), (turned, 90.5 - 3.4)] {
        assert!((x - 140.0).abs() < 0.5 && (y - wanted_y).abs() < 0.6, "{x} {y}, wanted {wanted_y}");
        // 0.6^2 of 9 mm2.
        assert!((n * 0.0877 * 0.0877 - 0.36 * 9.0).abs() < 0.15, "{n} px");
    }
    // A quarter of the size lies in the gel as a whole, a sixteenth of 9 mm2.
    let (_, _, n) = middle(&["--scale-mm-per-unit", "0.25"]);
    assert!((n * 0.0877 * 0.0877 - 9.0 / 16.0).abs() < 0.15, "{n} px");
    let both = ["-o", &image, "--mask", &image, "--force"];
    let twice = run(&[&["render", &tip, "--depth-mm", "1", "--sensor", sensor][..], &both].concat());
    assert_code(&twice, 2);
    assert!(text(&twice.stderr).contains("two files would be one"));
    // The same depth 100 times as large is not to be had, and a place beside the image neither.
    for (more, part) in [
        (["--depth-mm", "50", "--rotation-deg", "0"], "travels 50 mm"),
        (["--depth-mm", "0.5", "--x-px", "-900"], "nothing of `tip` lies over the 320x240 image"),
    ] {
        let arguments = [&["render", &tip, "--sensor", sensor, "-o", &image, "--force"][..], &more].concat();
        let refused = run(&arguments);
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
    let same = run(&["render", &tip, "--depth-mm", "1", "--sensor", sensor, "-o", &file("tip.obj")]);
    assert_eq!(same.status.code(), Some(2));
    let still = run(&["render", &tip, "--sensor", sensor, "-o", &image, "--force"]);
    assert_eq!(still.status.code(), Some(2));
    assert!(text(&still.stderr).contains("not said how far") && text(&still.stderr).contains("--depth-mm"));
}

#[test]
fn a_surface_is_rendered_from_its_heights() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name).to_str().unwrap().to_string();
    let sensor = "asset:sensors/gelsight_synthetic/sensor.npz";
    // Ridges along y, 0.2 mm high, the gel reached by the upper half of them.
    let ridge = |i: usize| 0.2 * f64::sin((i % 320) as f64 / 8.0);
    let array =
        |shape: [usize; 2]| Array { shape: shape.to_vec(), values: (0..320 * 240).map(ridge).collect() };
    std::fs::write(file("ridges.npy"), write_npy(&array([240, 320]), ElementType::F64)).unwrap();
    std::fs::write(file("turned.npy"), write_npy(&array([320, 240]), ElementType::F64)).unwrap();
    std::fs::write(file("no.npy"), "no array").unwrap();
    let (ridges, image) = (file("ridges.npy"), file("out.png"));
    let output = run(&["render", &ridges, "--sensor", sensor, "-o", &image, "--json"]);
    assert!(output.status.success(), "{}", text(&output.stderr));
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    assert!(told["x_px"].is_null() && told["width_px"] == 320, "{told}");
    let area_mm2 = told["contact_area_mm2"].as_f64().unwrap();
    // The gel follows where a ridge is deeper than 0.4 of its height.
    let columns = (0..320).filter(|&i| ridge(i) > 0.08).count();
    let expected_mm2 = columns as f64 * 240.0 * 0.0877 * 0.0877;
    assert!((area_mm2 / expected_mm2 - 1.0).abs() < 0.01, "{area_mm2} {expected_mm2}");
    for (name, more, part) in [
        ("turned.npy", vec![], "the heights have the shape [320, 240], the sensor's image has [240, 320]"),
        ("no.npy", vec![], "not in numpy's npy format"),
        ("ridges.npy", vec!["--x-px", "3"], "no place and no turn"),
        ("ridges.npy", vec!["--depth-mm", "11"], "pressed in by 11 mm"),
        ("ridges.npy", vec!["--scale-mm-per-unit", "100"], "pressed in by 19.99"),
    ] {
        let path = file(name);
        let refused =
            run(&[vec!["render", &path, "--sensor", sensor, "-o", &image, "--force"], more].concat());
        assert_eq!(refused.status.code(), Some(2), "{}", text(&refused.stderr));
        assert!(text(&refused.stderr).contains(part), "{}", text(&refused.stderr));
    }
}

/// A frame without contact of another light is not used, and is named; the contacts are found as well without it.
#[test]
fn a_rest_frame_that_contradicts_the_presses_is_named() {
    let presses = press_folder(8);
    let rest = presses.path().join("rest.png");
    let bytes = gripgen::assets::get("sensors/gelsight_synthetic/sensor.npz").unwrap();
    let shipped = gripgen::tactile::Sensor::from_npz(bytes, None, None).unwrap();
    let image = gripgen::tactile::finish(&shipped, None, Some(1));
    let darker =
        gripgen::twin::TactileImage { rgb: image.rgb.iter().map(|level| level / 2).collect(), ..image };
    std::fs::write(&rest, gripgen::record::encode_png(&darker).unwrap()).unwrap();
    let out = tempfile::tempdir().unwrap();
    let sensor = out.path().join("sensor.npz");
    let done = run(&[
        "calibrate",
        "presses",
        presses.path().to_str().unwrap(),
        "--ball-mm",
        "5",
        "--mm-per-px",
        "0.0877",
        "-o",
        sensor.to_str().unwrap(),
        "--json",
    ]);
    assert_code(&done, 0);
    let said = text(&done.stderr);
    assert!(
        said.contains("grey levels from the presses where nothing touches")
            && said.contains("it is not used"),
        "{said}"
    );
    let json: serde_json::Value = serde_json::from_slice(&done.stdout).unwrap();
    assert_eq!(json["rest"]["used"], false, "{json}");
    assert!(json["rest"]["differs"].as_f64().unwrap() > 10.0, "{json}");
}
