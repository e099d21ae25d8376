use super::*;
use gripgen_twin::Values;
use gripgen_twin::config::Feedback;
use gripgen_twin::draw::Drawn;

fn folder(table: &str, files: &[(&str, &str)]) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join(TRACES_FOLDER)).unwrap();
    std::fs::write(folder.path().join(PULLS_FILE), table).unwrap();
    for (name, text) in files {
        std::fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

const TRACE: &str = "displacement_mm,time_s,measured_force_n,desired_force_n\n0,-0.01,0.1,0\n2,0.01,0.9,1\n";

#[test]
fn columns_stand_in_any_order_and_the_rest_are_covariates_of_unknown_meaning() {
    let table = "\u{feff}max_pull_force_n, part ,pull_id,humidity_pct,operator,grip_force_n,grip_angle_deg,\
                 dwell_s,session,pull_direction,temperature_c,,blank\n\
                 11.5, gear ,a,40,ann,60,90,,2,-1,,7,\n\
                 3, shaft,b,,bo,10,0,20,,1,,8,\n";
    let campaign =
        "force_convention = \"total\"\nlabel_tolerance_n = 2\nfeedback = \"measured\"\noperator = \"x\"\n";
    let folder = folder(table, &[("campaign.toml", campaign), ("traces/b.csv", TRACE)]);
    let read = read_pull_folder(folder.path()).unwrap();
    let [a, b] = &read.pulls[..] else { panic!("two pulls") };
    assert_eq!((a.id.as_str(), a.part.as_str(), a.max_pull_force_n), ("a", "gear", 11.5));
    assert_eq!((a.grip_force_n, b.grip_force_n), (30.0, 5.0), "the campaign says that forces are sums");
    assert_eq!((a.covariates.dwell_s, b.covariates.dwell_s), (1.0, 20.0), "an empty cell is the default");
    assert_eq!((a.covariates.session.as_str(), b.covariates.session.as_str()), ("2", "1"));
    assert_eq!((a.covariates.pull_direction, a.increment_n, a.step_s), (-1.0, 1.0, 0.104));
    assert!((a.covariates.grip_angle_rad - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    let recorded = ["part", "grip_force_n", "grip_angle_deg", "dwell_s", "session", "pull_direction"];
    assert_eq!(read.recorded, recorded, "a column without a value was not recorded");
    let [humidity, operator] = &read.extra[..] else { panic!("{:?}", read.extra) };
    let Values::Numbers(humidity) = &humidity.values else { panic!("numbers") };
    assert_eq!(humidity[0], 40.0);
    assert!(humidity[1].is_nan());
    assert_eq!(a.covariates.extra["humidity_pct"], Drawn::Number(40.0));
    assert!(!b.covariates.extra.contains_key("humidity_pct"), "nobody wrote it down");
    assert_eq!(b.covariates.extra["operator"], Drawn::Text("bo".into()));
    assert_eq!(operator.values, Values::Words(vec!["ann".into(), "bo".into()]));
    assert_eq!((read.label_tolerance_n, read.stop_m, read.feedback), (2.0, 5e-3, Some(Feedback::Measured)));
    assert!(a.trace.is_none());
    let trace = b.trace.as_ref().unwrap();
    assert_eq!((trace.time_s[0], trace.displacement_m[1], trace.desired_force_n[1]), (-0.01, 2e-3, 1.0));
}

#[test]
fn the_start_force_of_a_staircase_is_read_and_written() {
    let table = "pull_id,part,grip_force_n,force_start_n,max_pull_force_n\na,gear,20,4.5,6\nb,gear,20,,6\n";
    let folder = folder(table, &[]);
    let read = read_pull_folder(folder.path()).unwrap();
    let starts = |m: &MeasuredPulls| m.pulls.iter().map(|p| p.start_n).collect::<Vec<_>>();
    assert_eq!(starts(&read), [Some(4.5), None]);
    assert_eq!((read.extra.len(), read.recorded.len()), (0, 2), "a setting, no covariate");
    let copy = tempfile::tempdir().unwrap();
    write_pull_folder(copy.path(), &read).unwrap();
    assert_eq!(starts(&read_pull_folder(copy.path()).unwrap()), [Some(4.5), None]);
}

#[test]
fn faults_name_file_line_column_and_value() {
    let cell = |part: &str, force: &str, label: &str| {
        format!("pull_id,part,grip_force_n,max_pull_force_n\na,g,1,1\nb,{part},{force},{label}\n")
    };
    for (table, part) in [
        ("pull_id,part,grip_force_n\n", "no column `max_pull_force_n`; found: pull_id, part, grip_force_n"),
        ("pull_id,part,grip_force_n,max_pull_force_n\n", "holds no rows"),
        (&cell("g", "5", "nan"), "line 3, `max_pull_force_n` is `nan`, it must be a number"),
        (&cell("g", "5", "inf"), "`max_pull_force_n` is `inf`"),
        (&cell("g", "5", ""), "`max_pull_force_n` is ``"),
        ("pull_id,part,grip_force_n,force_start_n,max_pull_force_n\na,g,1,-2,1\n", "`force_start_n` is `-2`"),
        (&cell("g", "0", "1"), "line 3, `grip_force_n` is `0`, it must be a number above 0"),
        (&cell("g", "-7", "1"), "`grip_force_n` is `-7`"),
        (&cell("g", "five", "1"), "`grip_force_n` is `five`"),
        (&cell("", "5", "1"), "`part` is ``, it must be a name"),
        (
            "pull_id,part,grip_force_n,max_pull_force_n\n../x,g,1,1\n",
            "`pull_id` is `../x`, it must be a name without",
        ),
        (
            "pull_id,part,grip_force_n,max_pull_force_n\na,g,1,1\nb,g,1,1\na,g,2,2\n",
            "lines 2 and 4 are both pull `a`",
        ),
        ("pull_id,part,grip_force_n,max_pull_force_n\na,g,1\n", "cells of line 2: "),
        ("pull_id,part,part,grip_force_n,max_pull_force_n\na,g,g,1,1\n", "two columns `part`"),
        ("pull_id,part,grip_force_n,max_pull_force_n,pull_direction\na,g,1,1,0\n", "1 (up) or -1 (down)"),
        ("pull_id,part,grip_force_n,max_pull_force_n,pull_index\na,g,1,1,1.5\n", "`pull_index` is `1.5`"),
        (
            "pull_id,part,grip_force_n,max_pull_force_n,temperature_c\na,g,1,1,NaN\n",
            "`temperature_c` is `NaN`",
        ),
        ("", "no column `pull_id`"),
    ] {
        let folder = folder(table, &[]);
        let error = read_pull_folder(folder.path()).unwrap_err().to_string();
        assert!(error.contains(part) && error.contains("pulls.csv"), "{table:?}: {error}");
    }
}

/// A sensor that is off reads less than nothing of a grip that hardly holds.
#[test]
fn a_label_below_zero_is_read() {
    let folder = folder("pull_id,part,grip_force_n,max_pull_force_n\na,g,5,-0.286\n", &[]);
    assert_eq!(read_pull_folder(folder.path()).unwrap().pulls[0].max_pull_force_n, -0.286);
}

#[test]
fn faults_of_the_other_files_are_theirs() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n\na,g,1,1\n";
    for (file, text, part) in [
        (
            "campaign.toml",
            "label_tolerance_n = -1\n",
            "`label_tolerance_n` is -1, it must be a number above 0",
        ),
        ("campaign.toml", "\nforce_convention = \"sum\"\n", "campaign.toml:2: unknown variant `sum`"),
        ("campaign.toml", "stop_mm = ", "campaign.toml"),
        ("traces/a.csv", "time_s,desired_force_n,measured_force_n\n", "no column `displacement_mm`"),
        (
            "traces/a.csv",
            &TRACE.replace("0.9", "x"),
            "line 3, `measured_force_n` is `x`, it must be a number",
        ),
        (
            "traces/a.csv",
            &TRACE.replace("2,0.01", "2,-0.01"),
            "line 3, `time_s` is `-0.01`, it must be later",
        ),
        ("traces/a.csv", &TRACE[..56], "a.csv: the table holds no rows"),
    ] {
        let error = read_pull_folder(folder(table, &[(file, text)]).path()).unwrap_err().to_string();
        assert!(error.contains(part), "{text:?}: {error}");
    }
    let error = read_pull_folder(&tempfile::tempdir().unwrap().path().join("none")).unwrap_err().to_string();
    assert!(error.contains("pulls.csv"), "{error}");
}

/// A trace under a misspelt name and a misspelt key are read as if they were not there, so that people are told.
#[test]
fn what_is_not_read_and_may_be_misspelt_is_named() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n\np0000,g,1,1\np0001,g,1,1\np0010,g,1,1\n";
    let said = |files: &[(&str, &str)]| read_judged_pulls(folder(table, files).path()).unwrap().warnings;
    let all = "force_convention = \"per_jaw\"\nlabel_tolerance_n = 3\nstop_mm = 5\nfeedback = \"measured\"\n\
               label_evidence = \"none\"\npulls = []\n";
    let fine = [("traces/p0001.csv", TRACE), ("traces/README.md", "x"), ("campaign.toml", all)];
    assert_eq!(said(&fine), Vec::<String>::new());
    let near = said(&[("traces/p0001.csv", TRACE), ("traces/p001.csv", TRACE)]);
    assert_eq!(near.len(), 1);
    assert!(near[0].contains("p001.csv belongs to no pull and is not read"), "{near:?}");
    assert!(near[0].ends_with("the nearest pull to `p001.csv` is `p0010`"), "{near:?}");
    let far = said(&[("traces/ghost.csv", TRACE), ("traces/other.csv", TRACE)]);
    assert_eq!(far.len(), 1);
    assert!(far[0].contains("2 files belong to no pull and are not read (ghost.csv, other.csv)"), "{far:?}");
    assert!(far[0].ends_with("a trace has the name of its pull, as `p0000.csv`"), "{far:?}");
    let keys = said(&[("campaign.toml", "force_convetion = \"total\"\noperator = \"x\"\n")]);
    let [close, other] = &keys[..] else { panic!("{keys:?}") };
    assert!(
        close.contains("`force_convetion`") && close.ends_with("did you mean `force_convention`?"),
        "{close}"
    );
    assert!(other.contains("`operator`") && other.contains("known are force_convention,"), "{other}");
}

/// `45 %` is a word, and `Temperature_C` is nobody's column.
#[test]
fn a_unit_in_a_cell_and_a_name_that_is_nearly_known_are_told() {
    let said = |columns: &str, cells: [&str; 3]| {
        let rows: String = cells.iter().zip(0..).map(|(cell, i)| format!("p{i},g,1,1,{cell}\n")).collect();
        let table = format!("pull_id,part,grip_force_n,max_pull_force_n,{columns}\n{rows}");
        read_judged_pulls(folder(&table, &[]).path()).unwrap().warnings
    };
    for fine in [
        "humidity_pct",
        "table_mm",
        "operator",
        "batch",
        "lot_id",
        "run_id",
        "tool_id",
        "version",
        "force",
        "grip",
        "t",
    ] {
        assert_eq!(said(fine, ["45", "46", "47"]), Vec::<String>::new(), "{fine}");
    }
    for cells in
        [["2b", "3a", "4c"], ["3-left", "4-left", "5-left"], ["45 %", "dry", "50 %"], ["a", "b", "c"]]
    {
        assert_eq!(said("batch", cells), Vec::<String>::new(), "{cells:?}");
    }
    let units = said("humidity_pct", ["45 %", "46%", "-47.5 %"]);
    assert!(
        units.len() == 1 && units[0].contains("all cells of the column humidity_pct end in `%`"),
        "{units:?}"
    );
    for (typed, name) in
        [("Temperature_C", "temperature_c"), ("gel", "gel_id"), ("dwell-s", "dwell_s"), ("sesion", "session")]
    {
        let near = said(typed, ["1", "2", "3"]);
        assert!(near.len() == 1 && near[0].ends_with(&format!("did you mean {name}?")), "{typed}: {near:?}");
    }
    let taken = said("Temperature_C,temperature_c", ["1,20", "2,21", "3,22"]);
    assert_eq!(taken, Vec::<String>::new(), "it has one already");
}

#[test]
fn the_hash_covers_every_file_that_was_read() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n\na,g,1,1\n";
    let hash = |files: &[(&str, &str)]| read_pull_folder(folder(table, files).path()).unwrap().sha256;
    let plain = hash(&[]);
    assert_eq!(plain.len(), 64);
    assert_eq!(plain, hash(&[("notes.txt", "x")]), "what is not read does not count");
    let traced = hash(&[("traces/a.csv", TRACE)]);
    let campaign = hash(&[("campaign.toml", "stop_mm = 4\n")]);
    assert!(plain != traced && plain != campaign && traced != campaign);
}

#[test]
fn what_is_written_is_read_back() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n,grip_angle_deg,grip_offset_mm,humidity_pct,operator,session\n\
                 a,gear,30,11.5,30,0.3,40,\"a, b\",1\nb,gear,0.1,3,-7.7,-2,,c,2\n";
    let first = folder(table, &[("traces/b.csv", TRACE), ("campaign.toml", "feedback = \"measured\"\n")]);
    let mut read = read_pull_folder(first.path()).unwrap();
    let second = tempfile::tempdir().unwrap();
    let out = second.path().join("new/folder");
    write_pull_folder(&out, &read).unwrap();
    let mut again = read_pull_folder(&out).unwrap();
    let text = std::fs::read_to_string(out.join(PULLS_FILE)).unwrap();
    assert!(text.contains("30,") && !text.contains("29.99"), "{text}");
    assert!(!text.contains("dwell_s"), "what nobody wrote down stays out");
    read.sha256.clear();
    again.sha256.clear();
    read.recorded.sort();
    again.recorded.sort();
    // An empty cell is no number, which is not equal to itself.
    assert_eq!(format!("{read:?}"), format!("{again:?}"));
    let error = write_pull_folder(&out, &read).unwrap_err().to_string();
    assert!(error.contains("pulls.csv"), "a table that is there is left alone: {error}");
}
