//! `gripgen calibrate pulls`, `compare` and `diagnose` of measured pulls: one way through, and input that cannot be used.

use super::{assert_code, run, text};

/// Pulls of a shaft with a coefficient of 0.2, 12 of them at three forces.
fn pulls(rows: usize) -> String {
    let mut table = String::from("pull_id,part,grip_force_n,max_pull_force_n\n");
    for i in 0..rows {
        let force_n = [20.0, 40.0, 60.0][i % 3];
        let label_n = 0.4 * force_n * (1.0 + 0.01 * (i as f64 - 5.5));
        table += &format!("p{i},long_shaft,{force_n},{label_n:.3}\n");
    }
    table
}

/// A folder with this table of pulls.
pub fn folder(table: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pulls.csv"), table).unwrap();
    folder
}

#[test]
fn a_fitted_twin_predicts_the_pulls_it_was_fitted_to() {
    let folder = folder(&pulls(12));
    let (at, twin) = (folder.path().to_str().unwrap(), folder.path().join("fitted.toml"));
    let twin = twin.to_str().unwrap();
    let fitted = run(&["calibrate", "pulls", at, "-o", twin, "--json"]);
    assert_code(&fitted, 0);
    let json: serde_json::Value = serde_json::from_slice(&fitted.stdout).unwrap();
    // Labels alone do not tell a small fall after the slip from a small coefficient: the product is what they show.
    let value = |key: &str| json["baseline"][key]["value"].as_f64().unwrap();
    let kinetic = value("parts.long_shaft.mu") * value("kinetic_ratio");
    assert!((kinetic / 0.2 - 1.0).abs() < 0.05, "{kinetic}");
    let error = |twin: &str| {
        let compared = run(&["compare", at, "--twin", twin, "--json"]);
        assert_code(&compared, 0);
        let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
        assert_eq!(json["pulls"]["n"], 12);
        json["pulls"]["rmse_n"].as_f64().unwrap()
    };
    assert!(error(twin) < 0.5 * error("asset:configs/twin-baseline.toml"));
    let unknown = run(&["calibrate", "pulls", at, "-o", twin, "--fit", "dwell_ageing", "--force"]);
    assert_code(&unknown, 2);
    assert!(text(&unknown.stderr).contains("it needs dwell_s"), "{}", text(&unknown.stderr));
}

#[test]
fn mean_and_rms_over_grip_force_of_any_folder() {
    let folder = folder(&pulls(12));
    let at = folder.path().to_str().unwrap();
    let info = run(&["info", at, "--json"]);
    assert_code(&info, 0);
    let json: serde_json::Value = serde_json::from_slice(&info.stdout).unwrap();
    let levels = json["parts"]["long_shaft"]["levels"].as_array().unwrap();
    assert_eq!(levels.len(), 3);
    // Labels at 40 N: 16 N times 1 + 0.01 (i - 5.5) for i = 1, 4, 7, 10.
    let near = |key: &str, wanted: f64| (levels[1][key].as_f64().unwrap() - wanted).abs() < 1e-3;
    assert!(levels[1]["n"] == 4 && near("grip_force_n", 40.0), "{json}");
    assert!(near("mean_n", 16.0) && near("rms_n", 0.16 * (11.25_f64).sqrt()), "{json}");
    assert!(near("low_n", 15.28) && near("high_n", 16.72), "{json}");
    assert!(text(&run(&["info", at]).stdout).contains("16.000   0.537  15.280  16.720"));

    let page = folder.path().join("page.html");
    let compared = run(&["compare", at, "--report", page.to_str().unwrap(), "--json"]);
    assert_code(&compared, 0);
    let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    let ratio = &json["pulls"]["ratio"]["long_shaft"];
    // mu 0.168 of the plain twin against 0.2, whatever the grip force.
    assert!((ratio["fit"]["a"].as_f64().unwrap() - 0.2 / 0.168).abs() < 0.1, "{json}");
    assert!(ratio["before_pct"].as_f64().unwrap() > 10.0 && ratio["after_pct"].as_f64().unwrap() < 3.0);
    let page = std::fs::read_to_string(page).unwrap();
    assert!(page.contains("Measured over predicted") && page.contains("<svg"));
}

#[test]
fn images_of_a_run_are_compared_with_those_of_a_twin() {
    let out = tempfile::tempdir().unwrap();
    let at = out.path().join("run");
    let at = at.to_str().unwrap();
    let sets = ["mechanics=reduced", "vary.part=[\"gear\"]", "vary.grip_angle_deg=[0]", "vary.grip_pose=[0]"];
    let sets = sets.iter().flat_map(|set| ["--set", set]);
    assert_code(&run(&["sweep", super::QUICKSTART, "-o", at].into_iter().chain(sets).collect::<Vec<_>>()), 0);
    let twin = ["compare", at, "--twin", "asset:configs/twin-contact.toml"];
    let compared = run(&[&twin[..], &["--json"]].concat());
    assert_code(&compared, 0);
    let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    let (images, made) = (&json["images"], json["pulls"]["n"].as_u64().unwrap());
    assert!(made >= 3 && images["n"] == 2 * made && images["by_part"]["gear"]["n"] == 2 * made, "{json}");
    assert_eq!(images["each"].as_array().unwrap().len() as u64, 2 * made);
    let number = |key: &str| images[key].as_f64().unwrap();
    // The noise of the sensor, 1.08, and rounding.
    assert!((1.1..1.3).contains(&number("mse")), "{images}");
    assert!(number("psnr") > 45.0 && (0.97..1.0).contains(&number("ssim")) && number("l1") < 1.0, "{images}");
    let table = text(&run(&twin).stdout);
    assert!(table.contains("PSNR dB") && table.contains("least alike: pull "), "{table}");
    // Pulls without images say nothing of them.
    let without = folder(&pulls(3));
    let compared = run(&["compare", without.path().to_str().unwrap(), "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert!(json["images"].is_null() && json["pulls"]["n"] == 3, "{json}");
}

#[test]
fn what_cannot_be_answered_says_so_and_what_cannot_be_read_is_an_error() {
    let one = folder(&pulls(1));
    let out = one.path().join("out.toml");
    let found = run(&["diagnose", one.path().to_str().unwrap(), "--json", "-o", out.to_str().unwrap()]);
    assert_code(&found, 0);
    let json: serde_json::Value = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!((&json["schema"], &json["verdict"]), (&"gripgen.diagnosis/1".into(), &"insufficient".into()));
    assert!(json["notes"][0].as_str().unwrap().contains("too few") && out.is_file());
    // In five lines, the last of which says what to do.
    let said = text(&run(&["diagnose", one.path().to_str().unwrap()]).stdout);
    assert!(said.lines().count() <= 5 && said.starts_with("The data cannot answer"), "{said}");
    assert!(said.lines().last().unwrap().starts_with("next: ") && said.contains(" campaign -o "), "{said}");
    // Quiet is quiet, and a second time nothing is replaced without a word.
    let again = ["diagnose", one.path().to_str().unwrap(), "-q", "-o", out.to_str().unwrap()];
    let refused = run(&again);
    assert_code(&refused, 2);
    assert!(text(&refused.stderr).contains("hint: --force replaces it"), "{}", text(&refused.stderr));
    let forced = run(&[&again[..], &["--force"]].concat());
    assert_code(&forced, 0);
    assert!(forced.stdout.is_empty() && forced.stderr.is_empty(), "{forced:?}");
    // Where no pulls are left to make, the plan of an earlier diagnosis goes.
    let equal: String = (0..14).map(|i| format!("p{i},long_shaft,40,16\n")).collect();
    let equal = folder(&format!("pull_id,part,grip_force_n,max_pull_force_n\n{equal}"));
    let [next, out] = ["next.toml", "out.toml"].map(|name| equal.path().join(name));
    std::fs::write(&next, "pulls = []\n").unwrap();
    let asked = ["diagnose", equal.path().to_str().unwrap(), "-o", out.to_str().unwrap()];
    assert_code(&run(&asked), 2);
    let forced = run(&[&asked[..], &["--force"]].concat());
    assert_code(&forced, 0);
    assert!(text(&forced.stderr).contains("removed ") && !next.exists(), "{}", text(&forced.stderr));
    for (table, says) in [
        (pulls(12).replace("max_pull_force_n", "force"), "max_pull_force_n"),
        (pulls(12).replace("p3,", "p2,"), "p2"),
        (pulls(12).replace(",8.", ",nan8."), "line"),
    ] {
        let folder = folder(&table);
        let refused = run(&["diagnose", folder.path().to_str().unwrap()]);
        assert_code(&refused, 2);
        assert!(text(&refused.stderr).contains(says), "{says}: {}", text(&refused.stderr));
    }
    // A part that the twin lacks has labels, and no geometry.
    let anvil = folder(&pulls(12).replace("long_shaft", "anvil"));
    let found = run(&["diagnose", anvil.path().to_str().unwrap()]);
    assert_code(&found, 0);
    let said = text(&found.stdout);
    assert!(said.contains("the twin has no part `anvil`: one was made for 12 pulls"), "{said}");
}

/// The next command names the twin that was named, and pulls that were planned are a list for who has no rig of ours.
#[test]
fn the_next_command_is_one_that_helps() {
    let one = folder(&pulls(1));
    let twin = one.path().join("a twin.toml");
    let shipped = std::str::from_utf8(gripgen::assets::get("configs/twin-baseline.toml").unwrap()).unwrap();
    std::fs::write(&twin, shipped.replace("\"../", "\"asset:")).unwrap();
    let (at, twin) = (one.path().to_str().unwrap(), twin.to_str().unwrap());
    let found = run(&["diagnose", at, "--twin", twin, "--set", "wrist.noise_n=0.2"]);
    assert_code(&found, 0);
    let said = text(&found.stdout);
    let wanted = format!("--twin '{twin}' --set wrist.noise_n=0.2");
    assert!(said.lines().last().unwrap().ends_with(&wanted), "{said}");
    // Nor is a second campaign offered.
    let (out, page) = (one.path().join("d.toml"), one.path().join("d.html"));
    let more = ["-o", out.to_str().unwrap(), "--report", page.to_str().unwrap()];
    let found = run(&[&["diagnose", at, "--twin", twin][..], &more[..]].concat());
    let said = text(&found.stdout);
    assert!(said.contains("next.toml lists (up to ") && !said.contains("rig pull"), "{said}");
    let page = std::fs::read_to_string(page).unwrap();
    assert!(!page.contains("campaign -o") && !page.contains("rig pull"));
}

/// Three pulls are calibrated and their draws lie beside the twin, `compare` reads them, a sweep draws from them, and of one pull a
/// diagnosis says what it shows.
#[test]
fn few_pulls_leave_draws_beside_their_twin() {
    let three = folder(&pulls(3));
    let (at, twin) = (three.path().to_str().unwrap(), three.path().join("few.toml"));
    let draws = three.path().join("few.posterior.csv");
    let arguments = ["calibrate", "pulls", at, "--law", "offset", "-o", twin.to_str().unwrap(), "--json"];
    let fitted = run(&arguments);
    assert_code(&fitted, 0);
    let json: serde_json::Value = serde_json::from_slice(&fitted.stdout).unwrap();
    assert_eq!(json["posterior"]["file"], "few.posterior.csv");
    let table = std::fs::read_to_string(&draws).unwrap();
    assert!(table.starts_with("weight,cause,"), "{table}");
    assert_eq!(json["posterior"]["draws"].as_u64().unwrap() as usize, table.lines().count() - 1);
    let law = &json["laws"][0]["b_n"];
    assert!(law["low90"].as_f64().unwrap() < 0.0 && law["high90"].as_f64().unwrap() > 0.0, "{law}");

    let compared = run(&["compare", at, "--twin", twin.to_str().unwrap(), "--json"]);
    assert_code(&compared, 0);
    let json: serde_json::Value = serde_json::from_slice(&compared.stdout).unwrap();
    assert_eq!(json["coverage90"], 1.0, "{json}");
    assert_eq!(json["pulls"]["coverage90"], json["coverage90"]);

    let sweep = three.path().join("sweep.toml");
    let text_of = "twin = \"few.toml\"\nsamples = 6\nimages = \"none\"\nmechanics = \"reduced\"\n[vary]\npart = [\"long_shaft\"]\ntwin = { from = \"posterior\" }\n";
    std::fs::write(&sweep, text_of).unwrap();
    let out = three.path().join("run");
    assert_code(&run(&["sweep", sweep.to_str().unwrap(), "-o", out.to_str().unwrap(), "-q"]), 0);
    let index = std::fs::read_to_string(out.join("index.csv")).unwrap();
    let header: Vec<&str> = index.lines().next().unwrap().split(',').collect();
    let place = |name: &str| header.iter().position(|c| *c == name).unwrap();
    let (cause, b_n) = (place("twin.cause"), place("effects.load_offset.long_shaft.b_n"));
    let rows: Vec<Vec<&str>> = index.lines().skip(1).map(|row| row.split(',').collect()).collect();
    assert!(rows.len() == 6 && rows.iter().all(|row| row[cause] == "load_offset"), "{index}");
    assert!(rows.iter().any(|row| row[b_n] != rows[0][b_n]), "{index}");
    assert_code(&run(&["verify", out.to_str().unwrap()]), 0);

    let one = folder(&pulls(1));
    let twin = one.path().join("one.toml");
    let asked = ["diagnose", one.path().to_str().unwrap(), "-o", twin.to_str().unwrap(), "--json"];
    let found = run(&asked);
    assert_code(&found, 0);
    let json: serde_json::Value = serde_json::from_slice(&found.stdout).unwrap();
    assert_eq!(json["verdict"], "insufficient");
    assert_eq!(json["posterior"]["file"], "one.posterior.csv");
    assert!(one.path().join("one.posterior.csv").is_file() && one.path().join("next.toml").is_file());
}
