use super::*;
use gripgen_twin::Values;
use gripgen_twin::columns::value;
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
    assert_eq!((a.covariates.dwell_s, b.covariates.dwell_s), (20.0, 20.0), "a stand-in from the column");
    assert_eq!((a.covariates.session.as_str(), b.covariates.session.as_str()), ("2", "2"));
    assert_eq!(value("dwell_s", a.view()), None, "nobody wrote it down");
    assert_eq!(value("session", b.view()), None);
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
        (&cell("g", "5", "inf"), "`max_pull_force_n` is `inf`"),
        (&cell("g", "5", "high"), "line 3, `max_pull_force_n` is `high`, it must be a number"),
        ("pull_id,part,grip_force_n,force_start_n,max_pull_force_n\na,g,1,-2,1\n", "`force_start_n` is `-2`"),
        (&cell("g", "0", "1"), "line 3, `grip_force_n` is `0`, it must be a number above 0"),
        (&cell("g", "-7", "1"), "`grip_force_n` is `-7`"),
        (&cell("g", "five", "1"), "`grip_force_n` is `five`"),
        (
            "pull_id,part,grip_force_n,max_pull_force_n\n-,g,1,1\n",
            "line 2, `pull_id` is `-`, it must be a name",
        ),
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
            "pull_id,part,grip_force_n,max_pull_force_n,temperature_c\na,g,1,1,warm\n",
            "`temperature_c` is `warm`",
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
            &TRACE.replace("2,0.01", "2,-0.02"),
            "line 3, `time_s` is `-0.02`, it must be later than -0.01",
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
    let packed = said(&[("traces/p0000.csv.gz", "x"), ("traces/p0001.parquet", "x")]);
    assert_eq!(packed.len(), 1, "{packed:?}");
    assert!(
        packed[0].contains("2 traces are not read (p0000.csv.gz): unpack it to `p0000.csv`"),
        "{packed:?}"
    );
    let keys = said(&[("campaign.toml", "force_convetion = \"total\"\noperator = \"x\"\n")]);
    let [close, other] = &keys[..] else { panic!("{keys:?}") };
    assert!(
        close.contains("`force_convetion`") && close.ends_with("did you mean `force_convention`?"),
        "{close}"
    );
    assert!(other.contains("`operator`") && other.contains("known are force_convention,"), "{other}");
}

/// `45 mm` is a word, and `sesion` is nobody's column.
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
        [["2b", "3a", "4c"], ["3-left", "4-left", "5-left"], ["45 %", "46%", "-47.5 %"], ["a", "b", "c"]]
    {
        assert_eq!(said("batch", cells), Vec::<String>::new(), "{cells:?}");
    }
    let units = said("table", ["45 mm", "46mm", "-47.5 mm"]);
    assert!(units.len() == 1 && units[0].contains("all cells of the column table end in `mm`"), "{units:?}");
    assert_eq!(said("Temperature [C]", ["20", "21", "22"]), Vec::<String>::new(), "it is that column");
    for (typed, name) in [("gel", "gel_id"), ("Dwell", "dwell_s"), ("sesion", "session")] {
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

/// A table of `rows` pulls with what `cells` says behind the four columns that have to be there.
fn rows(columns: &str, rows: usize, cells: impl Fn(usize) -> String) -> String {
    let row = |i: usize| format!("p{i},gear,{},6,{}\n", [20, 40][i % 2], cells(i));
    let body: String = (0..rows).map(row).collect();
    format!("pull_id,part,grip_force_n,max_pull_force_n,{columns}\n{body}")
}

fn judged(table: &str, files: &[(&str, &str)]) -> JudgedPulls {
    read_judged_pulls(folder(table, files).path()).unwrap()
}

#[test]
fn missing_clocks_and_counts_are_interpolated_in_the_order_of_the_rows() {
    for word in ["", "n/a", "NA", "-", "NaN", "null", "#N/A"] {
        let gap = |i: usize, x: usize| if [0, 3, 4, 9].contains(&i) { word.into() } else { x.to_string() };
        let table = rows("time_s,pull_index", 10, |i| format!("{},{}", gap(i, 60 * i), gap(i, 7 + i)));
        let read = judged(&table, &[]);
        let clocks: Vec<f64> = read.pulls.pulls.iter().map(|p| p.covariates.time_s).collect();
        let counts: Vec<u64> = read.pulls.pulls.iter().map(|p| p.covariates.pull_index).collect();
        assert_eq!(clocks, (0..10).map(|i| 60.0 * f64::from(i)).collect::<Vec<_>>(), "`{word}`");
        assert_eq!(counts, (7..17).collect::<Vec<_>>(), "`{word}`");
        assert!(read.pulls.pulls.iter().all(|p| p.covariates.missing.is_empty()), "they are known now");
        assert_eq!(read.missing.counts(), [("pull_index".into(), 4), ("time_s".into(), 4)].into());
        let notes: Vec<String> = read.missing.notes().collect();
        assert_eq!(notes[1], "time_s: 4 cells are missing, interpolated in the order of the rows");
    }
    // Over the night between two sessions nothing is interpolated.
    let at = |i: usize| if i == 4 { String::new() } else { (60 * i + 50_000 * (i / 5)).to_string() };
    let read = judged(&rows("time_s,session", 10, |i| format!("{},{}", at(i), i / 5)), &[]);
    assert_eq!(read.pulls.pulls[4].covariates.time_s, 240.0);
}

#[test]
fn other_missing_cells_are_a_mask_and_no_value() {
    let cell = |i: usize, value: &str| if i % 4 == 1 { "n/a".into() } else { value.to_string() };
    let columns = "temperature_c,gel_id,operator,humidity_pct,step_time_s";
    let of = |i| [("31.5", "b"), ("30", "b")].map(|(t, _)| cell(i, t))[i % 2].clone();
    let table = rows(columns, 8, |i| {
        format!("{},{},{},{},{}", of(i), cell(i, "b7"), cell(i, "ann"), cell(i, "45 %"), cell(i, "0.2"))
    });
    let read = judged(&table, &[]).pulls;
    let masked = read.pulls[1].view();
    for name in ["temperature_c", "gel_id", "operator", "humidity_pct", "step_time_s"] {
        assert_eq!(value(name, masked), None, "{name}");
        assert!(value(name, read.pulls[0].view()).is_some(), "{name}");
    }
    // What stands in is of this campaign, and no default: 23 degrees, the gel g1, 0.104 s.
    let stands_in = &read.pulls[1];
    assert_eq!(
        (stands_in.covariates.temperature_c, stands_in.covariates.gel_id.as_str(), stands_in.step_s),
        (31.5, "b7", 0.2)
    );
    assert_eq!(read.pulls[0].covariates.extra["humidity_pct"], Drawn::Number(45.0));
    let copy = tempfile::tempdir().unwrap();
    write_pull_folder(copy.path(), &read).unwrap();
    let again = read_pull_folder(copy.path()).unwrap();
    assert_eq!(value("temperature_c", again.pulls[1].view()), None, "an empty cell is written");
}

/// A pull without its label is no pull of 0 N, and a table with one is no bad table.
#[test]
fn pulls_without_a_label_a_force_or_a_part_are_left_out_and_counted() {
    let table =
        "pull_id,part,grip_force_n,max_pull_force_n\na,g,20,6\nb,g,20,n/a\nc,g,-,6\nd,,20,6\n,,,\n,,,\n";
    let read = judged(table, &[]);
    let status: Vec<_> = read.standing.iter().map(|s| (s.status, s.reason.as_str())).collect();
    assert_eq!(status[0], (Status::Slipped, ""));
    assert_eq!(status[1], (Status::Failed, "its `max_pull_force_n` is missing"));
    assert_eq!(status[2], (Status::Failed, "its `grip_force_n` is missing"));
    assert_eq!(status[3], (Status::Failed, "its `part` is missing"));
    assert_eq!(read.missing.counts().len(), 3);
    assert_eq!(read_pull_folder(folder(table, &[]).path()).unwrap().pulls.len(), 1);
}

#[test]
fn names_that_differ_in_capitals_are_one() {
    let table = "Pull ID,Part,Grip Force [N],max_pull_force_n,operator\na,gear,20,6,ann\nb,Gear,20,6,Ann\nc,gear,20,6,ann\n";
    let read = judged(table, &[]);
    assert!(read.pulls.pulls.iter().all(|p| p.part == "gear"));
    assert_eq!(read.pulls.extra[0].values, Values::Words(vec!["ann".into(); 3]));
    assert!(read.warnings.iter().any(|w| w.contains("part: names") && w.contains("`Gear` as `gear`")));
}

#[test]
fn clock_times_become_seconds() {
    let of = |i: usize| format!("2026-05-01 23:{:02}:00", 50 + i);
    let read = judged(&rows("time_s", 4, of), &[]);
    let clocks: Vec<f64> = read.pulls.pulls.iter().map(|p| p.covariates.time_s).collect();
    assert_eq!(clocks, [0.0, 60.0, 120.0, 180.0]);
    let mixed = rows("time_s", 2, |i| if i == 0 { "9:15".into() } else { "60".into() });
    let error = read_pull_folder(folder(&mixed, &[]).path()).unwrap_err().to_string();
    assert!(error.contains("line 2, `time_s` is a clock time, and other rows have a number"), "{error}");
}

/// A staircase of 1 N each 104 ms for 1.2 s, with 0.2 s before it, from `zero_s` on.
fn staircase(zero_s: f64, change: impl Fn(usize, &mut [f64; 4])) -> String {
    let mut text = "time_s,desired_force_n,measured_force_n,displacement_mm\n".to_string();
    for i in 0..140 {
        let since_s = 0.01 * f64::from(i) - 0.2;
        let command = if since_s < -1e-9 { 0.0 } else { 1.0 + (since_s / 0.104 + 1e-9).floor() };
        let mut row = [zero_s + since_s, command, 0.5 * command, 0.01 * command];
        change(i as usize, &mut row);
        text += &format!("{},{},{},{}\n", row[0], row[1], row[2], row[3]);
    }
    text
}

#[test]
fn traces_begin_where_their_command_does() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n\na,g,20,6\n";
    let right = judged(table, &[("traces/a.csv", &staircase(0.0, |_, _| {}))]);
    assert_eq!(right.warnings, Vec::<String>::new());
    let wanted = right.pulls.pulls[0].trace.clone().unwrap();
    for zero_s in [0.3, 5.0, -0.7, 1.7e9] {
        let read = judged(table, &[("traces/a.csv", &staircase(zero_s, |_, _| {}))]);
        let trace = read.pulls.pulls[0].trace.as_ref().unwrap();
        let off = trace.time_s.iter().zip(&wanted.time_s).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(off < 1e-5 && trace.desired_force_n == wanted.desired_force_n, "{zero_s}: {off}");
        let said = &read.warnings[0];
        assert!(
            said.contains("time 0 of 1 of 1 traces is not where their command begins (a.csv: it begins at"),
            "{said}"
        );
    }
    let still = judged(table, &[("traces/a.csv", &staircase(0.0, |_, row| row[1] = 0.0))]);
    assert!(still.pulls.pulls[0].trace.is_none());
    assert!(
        still.warnings[0].contains("1 of 1 traces are not used") && still.warnings[0].contains("it is 0 N")
    );
}

#[test]
fn what_is_odd_in_a_trace_is_said_with_its_numbers() {
    let table = "pull_id,part,grip_force_n,max_pull_force_n\na,g,20,6\n";
    let said = |text: &str| judged(table, &[("traces/a.csv", text)]).warnings.join("; ");
    let again = said(&staircase(0.0, |i, row| {
        if i == 50 {
            row[0] -= 0.01;
        }
    }));
    assert!(
        again.contains("1 rows of 1 of 1 traces have the time of the row before and are left out"),
        "{again}"
    );
    let gap = said(&staircase(0.0, |i, row| {
        if i >= 80 {
            row[0] += 0.5;
        }
    }));
    assert!(gap.contains("a gap (a.csv: no reading for 0.510 s from 0.590 s on)"), "{gap}");
    let empty = staircase(0.0, |_, _| {}).replacen("0.5,0.01\n", "NaN,0.01\n", 3);
    assert!(said(&empty).contains("3 rows of 1 of 1 traces lack one of the four values"), "{}", said(&empty));
    // Steps of 5 N in a table that says nothing of them, and in one that says 1 N.
    let steep = staircase(0.0, |_, row| row[1] *= 5.0);
    let bare = judged(table, &[("traces/a.csv", &steep)]);
    assert_eq!(bare.pulls.pulls[0].increment_n, 5.0);
    assert!(bare.warnings[0].contains("the command rises by 5 N every 0.1"), "{:?}", bare.warnings);
    let stated = table.replace("\na", ",force_increment_n\na").replace(",6\n", ",6,1\n");
    let stated = judged(&stated, &[("traces/a.csv", &steep)]);
    assert_eq!(stated.pulls.pulls[0].increment_n, 1.0);
    assert!(stated.warnings[0].contains("the table says 1 N every 0.104 s"), "{:?}", stated.warnings);
}
