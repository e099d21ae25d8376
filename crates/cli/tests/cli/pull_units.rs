//! Measured pulls whose numbers or names are not what was meant: what is refused, and what is said without being asked.

use super::{assert_code, run, text};

/// Pulls of a shaft with a coefficient of 0.2; labels and grip forces are in other units by these factors.
fn folder(rows: usize, label: f64, grip: f64) -> tempfile::TempDir {
    let mut table = String::from("pull_id,part,grip_force_n,max_pull_force_n\n");
    for i in 0..rows {
        let force_n = [20.0, 40.0, 60.0, 30.0][i % 4];
        let label_n = 0.4 * force_n * (1.0 + 0.01 * ((i * 5 % 11) as f64 - 5.0));
        table += &format!("p{i},long_shaft,{},{}\n", grip * force_n, label * label_n);
    }
    super::measured::folder(&table)
}

#[test]
fn labels_in_another_unit_or_with_a_sign_are_not_fitted() {
    for (label, grip, says) in [
        (1e3, 1.0, ["200 times twice the grip force", "with labels in millinewtons"]),
        (1.0, 1e3, ["0.0002", "with grip forces in millinewtons"]),
        (-1.0, 1.0, ["12 of 12 labels are below 0: pull p0 has -", "`max_pull_force_n` is a magnitude"]),
    ] {
        let wrong = folder(12, label, grip);
        let (at, out) = (wrong.path().to_str().unwrap(), wrong.path().join("out.toml"));
        for verb in [&["calibrate", "pulls"][..], &["diagnose"]] {
            // A diagnosis of a wrong unit is an answer: that it can say nothing, and why.
            let answers = verb == ["diagnose"] && label > 0.0;
            let refused = run(&[verb, &[at, "-o", out.to_str().unwrap()]].concat());
            assert_code(&refused, if answers { 0 } else { 2 });
            let said = text(&refused.stderr);
            assert!(says.iter().all(|part| said.contains(part)), "{verb:?}: {said}");
            assert!(said.contains(if answers { "warning: " } else { "hint: " }), "{said}");
            assert!(answers || !out.exists());
        }
        // What is only looked at is shown.
        let shown = run(&["info", at]);
        assert_code(&shown, 0);
        let said = text(&shown.stderr);
        assert!(said.contains("warning: ") && said.contains(says[0]), "{said}");
    }
}

#[test]
fn odd_units_and_misspelt_names_are_said_unless_it_is_to_be_quiet() {
    let odd = folder(12, 0.102, 1.0);
    std::fs::create_dir(odd.path().join("traces")).unwrap();
    let trace = "time_s,desired_force_n,measured_force_n,displacement_mm\n0,1,0,0\n";
    std::fs::write(odd.path().join("traces/p12.csv"), trace).unwrap();
    std::fs::write(odd.path().join("campaign.toml"), "force_convetion = \"total\"\n").unwrap();
    let at = odd.path().to_str().unwrap();
    let said = text(&run(&["info", at]).stderr);
    for says in [
        "with labels in kilograms-force (kgf)",
        "p12.csv belongs to no pull and is not read: the nearest pull to `p12.csv` is `p1`",
        "the key `force_convetion` means nothing here and was left alone: did you mean `force_convention`?",
    ] {
        assert!(said.contains(says), "{says}: {said}");
    }
    assert_eq!(said.matches("warning: ").count(), 3, "{said}");
    assert!(run(&["info", at, "-q"]).stderr.is_empty());
    assert!(text(&run(&["info", folder(12, 1.0, 1.0).path().to_str().unwrap()]).stderr).is_empty());
}

/// One word in a column of numbers is taken for missing, and a folder that is named twice would be evidence twice.
#[test]
fn a_word_among_numbers_and_a_folder_named_twice_are_said() {
    let wet = folder(12, 1.0, 1.0);
    let at = wet.path().join("pulls.csv");
    let table = std::fs::read_to_string(&at).unwrap();
    let with = |p7: &str| {
        let cell = |i: usize, row: &str| match i {
            0 => format!("{row},humidity_pct"),
            8 => format!("{row},{p7}"),
            _ => format!("{row},{}", 30 + i),
        };
        let rows: Vec<String> = table.lines().enumerate().map(|(i, row)| cell(i, row)).collect();
        std::fs::write(&at, rows.join("\n")).unwrap();
        text(&run(&["info", wet.path().to_str().unwrap()]).stderr)
    };
    let said = with("wet");
    assert!(said.contains("humidity_pct is one of numbers: 1 of 12 cells are words (`wet`)"), "{said}");
    for missing in ["", "n/a"] {
        let said = with(missing);
        assert!(said.contains("humidity_pct: 1 cell is missing"), "`{missing}`: {said}");
    }
    let [plain, dotted] =
        [wet.path().to_path_buf(), wet.path().join(".")].map(|path| path.display().to_string());
    let twice = run(&["diagnose", &plain, "--also", &dotted]);
    assert_code(&twice, 2);
    assert!(text(&twice.stderr).contains("is named twice"), "{}", text(&twice.stderr));
}

/// What the twin depends on and the table lacks is a warning of a comparison; a file in the place of its folder is told.
#[test]
fn a_column_that_the_pulls_lack_and_a_file_for_a_folder_are_said() {
    let dry = folder(12, 1.0, 1.0);
    let (at, table) = (dry.path().to_str().unwrap(), dry.path().join("pulls.csv"));
    let twin = dry.path().join("wet.toml");
    let baseline = String::from_utf8(gripgen::assets::get("configs/twin-baseline.toml").unwrap().to_vec());
    let effect = "\n[[effects]]\nname = \"table\"\ncovariate = \"humidity_pct\"\nx = [30, 60]\nfactor = [1.0, 0.7]\nphysical = false\n";
    std::fs::write(&twin, format!("{}{effect}", baseline.unwrap())).unwrap();
    let twin = twin.to_str().unwrap();
    let lacks = "the twin depends on humidity_pct (a table of humidity_pct), which these pulls do not have";
    let said = text(&run(&["compare", at, "--twin", twin]).stderr);
    assert!(said.contains(lacks), "{said}");
    // A diagnosis starts from the twin without its effects and tables.
    assert!(!text(&run(&["diagnose", at, "--twin", twin]).stderr).contains("depends on"));
    assert!(!text(&run(&["compare", at]).stderr).contains("depends on"));
    let file = run(&["diagnose", table.to_str().unwrap()]);
    assert_code(&file, 2);
    let said = text(&file.stderr);
    let sensor = dry.path().join("sensor.csv");
    std::fs::write(&sensor, "x\n").unwrap();
    let of_sensor = text(&run(&["compare", sensor.to_str().unwrap()]).stderr);
    assert!(of_sensor.contains(&format!("name its folder: {at}")), "{of_sensor}");
    assert!(said.contains("this is a file") && said.contains(&format!("name its folder: {at}")), "{said}");
}

#[test]
fn one_pull_is_calibrated_with_a_word_on_beliefs() {
    let one = folder(1, 1.0, 1.0);
    let out = one.path().join("out.toml");
    let json = one.path().join("found.json");
    let [at, out, json] = [one.path(), &out, &json].map(|path| path.to_str().unwrap());
    let fitted = run(&["calibrate", "pulls", at, "-o", out, "--json", json]);
    assert_code(&fitted, 0);
    let said = text(&fitted.stderr);
    assert!(said.contains("one pull is not enough on its own"), "{said}");
    assert!(said.contains("assets/priors/pulls.toml") && said.contains("docs/few-pulls.md"), "{said}");
    let found: serde_json::Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    assert_eq!((&found["leans_on_beliefs"], &found["warnings"]), (&true.into(), &serde_json::json!([])));
    // No value lies outside of its own interval.
    for (key, value) in found["baseline"].as_object().unwrap() {
        let [low, at, high] = ["low90", "value", "high90"].map(|k| value[k].as_f64().unwrap());
        assert!(low <= at && at <= high, "{key}: {value}");
    }
}

#[test]
fn a_pull_that_is_far_off_is_named_by_a_calibration() {
    let bad = folder(24, 1.0, 1.0);
    let at = bad.path().join("pulls.csv");
    let table = std::fs::read_to_string(&at).unwrap();
    let changed: Vec<String> = table
        .lines()
        .map(|row| if row.starts_with("p7,") { "p7,long_shaft,30,12000".into() } else { row.into() })
        .collect();
    std::fs::write(&at, changed.join("\n")).unwrap();
    let [out, json] = ["out.toml", "found.json"].map(|name| bad.path().join(name));
    let [folder, out, json] = [bad.path(), &out, &json].map(|path| path.to_str().unwrap());
    let fitted = run(&["calibrate", "pulls", folder, "-o", out, "--json", json]);
    assert_code(&fitted, 0);
    let found: serde_json::Value = serde_json::from_slice(&std::fs::read(json).unwrap()).unwrap();
    let error_n = found["error"]["rmse_n"].as_f64().unwrap();
    assert!(error_n < 3.0, "{error_n} N are not the error of this twin but of one bad label");
    let said = text(&fitted.stderr);
    assert!(said.contains("1 of 24 pulls lie far off (p7)"), "{said}");
    assert!(said.contains("pull p7 has 12000 N at a grip force of 30 N"), "{said}");
    assert!(!said.contains("believed"), "{said}");
}
