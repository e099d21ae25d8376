//! Tables that people hand in: what is written is read back, and what is wrong is named.

use crate::{
    TableError, open_dataset, read_press_columns, read_pull_folder, read_sensor_table, write_pull_folder,
};
use gripgen_twin::columns::{COLUMNS, Column, InTable, Kind, covariates};
use gripgen_twin::draw::Drawn;
use gripgen_twin::random::{Purpose, Stream};
use gripgen_twin::{Covariates, ExtraColumn, MeasuredPull, MeasuredPulls, Values};
use std::path::Path;

/// A cell that a column may hold, drawn at random.
fn cell(column: &Column, random: &mut Stream) -> String {
    // Six decimals: finer ones of millimetres and degrees get lost on the way to SI and back.
    let number = ((random.uniform() * 2e8).round() + 1.0) / 1e6;
    match column.kind {
        Kind::Name | Kind::Word => format!("{} \"{}\", {}", column.name, number, random.uniform() < 0.5),
        Kind::Whole => (random.uniform() * 1e9).floor().to_string(),
        Kind::Direction => if random.uniform() < 0.5 { "1" } else { "-1" }.into(),
        Kind::Number => number.to_string(),
    }
}

fn campaign(seed: u64) -> MeasuredPulls {
    let mut random = Stream::new(seed, 0, Purpose::Draw);
    let recorded: Vec<&Column> =
        covariates().filter(|c| c.in_table == InTable::Required || random.uniform() < 0.6).collect();
    let starts = random.uniform() < 0.5;
    let rows = 1 + (random.uniform() * 5.0) as usize;
    let mut pulls = Vec::new();
    for i in 0..rows {
        let mut pull = MeasuredPull {
            id: format!("pull {i}"),
            part: String::new(),
            grip_pose: 0,
            grip_force_n: 0.0,
            increment_n: 1.0,
            start_n: None,
            step_s: 0.104,
            covariates: Covariates::default(),
            max_pull_force_n: random.uniform() * 30.0 - 1.0,
            zero_shift_n: 0.0,
            trace: None,
        };
        let settings = COLUMNS.iter().filter(|c| c.in_table == InTable::Setting && starts);
        for column in recorded.iter().copied().chain(settings) {
            column.read_cell(&cell(column, &mut random), &mut pull.edit()).unwrap();
        }
        pulls.push(pull);
    }
    let numbers: Vec<f64> =
        (0..rows).map(|_| if random.uniform() < 0.3 { f64::NAN } else { random.uniform() - 0.5 }).collect();
    let words = (0..rows).map(|i| if i % 2 == 0 { "ann, b".into() } else { String::new() }).collect();
    let extra = [("gloves", Values::Words(words)), ("lamp_v", Values::Numbers(numbers))];
    let mut measured = MeasuredPulls {
        pulls,
        recorded: recorded.iter().map(|c| c.name.into()).collect(),
        extra: extra.map(|(name, values)| ExtraColumn { name: name.into(), values }).into(),
        label_tolerance_n: 2.5,
        stop_m: 4e-3,
        feedback: None,
        sha256: String::new(),
    };
    // A column without any value is not written down.
    measured.extra.retain(|column| (0..rows).any(|i| column.values.at(i).is_some()));
    for column in &measured.extra {
        for (i, pull) in measured.pulls.iter_mut().enumerate() {
            let value: Option<Drawn> = column.values.at(i);
            pull.covariates.extra.extend(value.map(|value| (column.name.clone(), value)));
        }
    }
    // A table that says nothing of the staircase is a steady rise.
    if !["force_increment_n", "step_time_s"].iter().any(|own| measured.recorded.iter().any(|c| c == own)) {
        measured.pulls.iter_mut().for_each(|pull| (pull.increment_n, pull.step_s) = (0.1, 0.0104));
    }
    measured.count();
    measured
}

/// For any values of any columns: what the writer writes the reader reads back, bit by bit.
#[test]
fn campaigns_of_any_columns_are_read_back_as_they_were_written() {
    let folder = tempfile::tempdir().unwrap();
    for seed in 0..300 {
        let (wanted, out) = (campaign(seed), folder.path().join(seed.to_string()));
        write_pull_folder(&out, &wanted).unwrap();
        let mut read = read_pull_folder(&out).unwrap();
        read.sha256.clear();
        // What nobody wrote down is no number, which is not equal to itself.
        assert_eq!(format!("{read:?}"), format!("{wanted:?}"), "seed {seed}");
    }
}

fn with_file(name: &str, text: &str) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("traces")).unwrap();
    let pulls = "pull_id,part,grip_force_n,max_pull_force_n\na,gear,20,6\n";
    std::fs::write(folder.path().join("pulls.csv"), pulls).unwrap();
    std::fs::write(folder.path().join(name), text).unwrap();
    folder
}

/// Decimal commas and semicolons are read, whichever table has them.
#[test]
fn every_table_of_a_spreadsheet_is_read() {
    let pulls: &dyn Fn(&Path) -> f64 = &|p| read_pull_folder(p).unwrap().pulls[0].grip_force_n;
    let trace: &dyn Fn(&Path) -> f64 =
        &|p| read_pull_folder(p).unwrap().pulls[0].trace.as_ref().unwrap().measured_force_n[0];
    let sensor: &dyn Fn(&Path) -> f64 = &|p| read_sensor_table(p).unwrap().reference_force_n[0];
    let presses: &dyn Fn(&Path) -> f64 = &|p| match &read_press_columns(p).unwrap().columns[1].1 {
        Values::Numbers(x) => x[0],
        Values::Words(words) => panic!("{words:?}"),
    };
    for (file, header, row, read) in [
        ("pulls.csv", "pull_id,part,grip_force_n,max_pull_force_n", "a,gear,\"12,5\",6", pulls),
        ("traces/a.csv", "time_s,desired_force_n,measured_force_n,displacement_mm", "0,1,\"12,5\",0", trace),
        ("sensor.csv", "time_s,reference_force_n,measured_force_n", "0,\"12,5\",2", sensor),
        ("presses.csv", "image,x_px", "a.png,\"12,5\"", presses),
    ] {
        let quoted = format!("{header}\n{row}\n");
        let (head, cells) = (header.replace(',', ";"), row.replace("\"12,5\"", "@").replace(',', ";"));
        let semicolons = format!("{head}\n{}\n", cells.replace('@', "12,5"));
        for text in [quoted, semicolons] {
            let folder = with_file(file, &text);
            assert_eq!(read(folder.path()), 12.5, "{text}");
        }
    }
}

/// An empty cell is a value that nobody wrote down, and a column of nothing else is not recorded, in every table.
#[test]
fn an_empty_cell_means_the_same_in_every_table() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write(
        "pulls.csv",
        "pull_id,part,grip_force_n,max_pull_force_n,lamp_v,blank\na,g,20,6,1.5,\nb,g,20,6,,\n",
    );
    write("sensor.csv", "time_s,reference_force_n,measured_force_n,lamp_v,blank\n0,1,2,1.5,\n1,1,2,,\n");
    write("presses.csv", "image,lamp_v,blank\na.png,1.5,\nb.png,,\n");
    let pulls = read_pull_folder(folder.path()).unwrap().extra;
    let found = [
        pulls.into_iter().map(|c| (c.name, c.values)).collect(),
        read_sensor_table(folder.path()).unwrap().extra,
        read_press_columns(folder.path()).unwrap().columns.into_iter().filter(|c| c.0 != "image").collect(),
    ];
    for columns in found {
        let [(name, Values::Numbers(x))] = &columns[..] else { panic!("{columns:?}") };
        assert!(name == "lamp_v" && x[0] == 1.5 && x[1].is_nan(), "{columns:?}");
    }
}

#[test]
fn a_file_that_is_not_there_is_named() {
    let error = read_sensor_table(Path::new("/nowhere/at/all")).unwrap_err();
    assert!(matches!(&error, TableError::Io { path, .. } if path.ends_with("sensor.csv")), "{error}");
}

const PULLS: &str = "\
pull_id,part,grip_force_n,gel_id,session,force_increment_n,step_time_s,dwell_s,pull_index,time_s,temperature_c,\
grip_offset_mm,grip_angle_deg,pull_direction,force_start_n,humidity_pct,grip_pose,operator,max_pull_force_n
a,gear,30.1,g1,1,0.5,0.1,1.5,3,0.25,21.5,-0.3,30,-1,4.5,40,1,\"ann, b\",11.25
b,shaft,0.1,g2,2,1,0.104,0,0,-7,-40.5,0.7,-7.7,1,,,0,bo,-0.286
";

#[test]
fn every_column_of_a_table_is_written_as_it_was_read() {
    // The same table, its columns turned round.
    let turned: Vec<String> = {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(PULLS.as_bytes());
        let rows = reader.records().map(|row| row.unwrap().iter().rev().map(String::from).collect());
        let rows: Vec<Vec<String>> = rows.collect();
        vec![String::from_utf8(gripgen_record::csv_lines(&rows)).unwrap()]
    };
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pulls.csv"), turned.concat()).unwrap();
    let read = read_pull_folder(folder.path()).unwrap();
    let (out, again) = (folder.path().join("out"), folder.path().join("again"));
    write_pull_folder(&out, &read).unwrap();
    let written = std::fs::read_to_string(out.join("pulls.csv")).unwrap();
    // Columns of unknown meaning keep the order of their table.
    let known = |text: &str| -> Vec<String> {
        let (header, rest) = text.split_once('\n').unwrap();
        let before = header.split(',').position(|name| name == "force_start_n").unwrap();
        let mut lines = vec![header.split(',').take(before + 1).collect::<Vec<_>>().join(",")];
        lines.extend(rest.lines().map(|l| l.split(',').take(before + 1).collect::<Vec<_>>().join(",")));
        lines
    };
    assert_eq!(known(&written), known(PULLS));
    assert!(written.starts_with(&PULLS[..PULLS.find("humidity").unwrap()]), "{written}");
    assert!(written.lines().next().unwrap().ends_with(",operator,grip_pose,humidity_pct,max_pull_force_n"));
    let back = read_pull_folder(&out).unwrap();
    write_pull_folder(&again, &back).unwrap();
    assert_eq!(written, std::fs::read_to_string(again.join("pulls.csv")).unwrap());
    assert_eq!(format!("{:?}", read.pulls), format!("{:?}", back.pulls));
    let dataset = open_dataset(&out).unwrap();
    let names: Vec<&str> = dataset.table().columns().iter().map(|(name, _)| name.as_str()).collect();
    let wanted = "pull_id,status,part,grip_force_n,gel_id,session,force_increment_n,step_time_s,dwell_s,pull_index,time_s,\
                  temperature_c,grip_offset_mm,grip_angle_deg,pull_direction,force_start_n,operator,grip_pose,humidity_pct,\
                  max_pull_force_n,status_reason";
    assert_eq!(names.join(","), wanted);
    assert_eq!(dataset.table().numbers("force_start_n"), Some(&[4.5, 1.0][..]));
    assert_eq!(dataset.table().numbers("temperature_c"), Some(&[21.5, -40.5][..]));
}

/// A folder of two measured pulls, one with images.
fn two_pulls() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    let table = "pull_id,part,grip_force_n,operator,max_pull_force_n\na,gear,20,ann,6.5\nb,gear,30,,9.25\n";
    std::fs::write(folder.path().join("pulls.csv"), table).unwrap();
    std::fs::create_dir(folder.path().join("images")).unwrap();
    for (jaw, level) in [("left", 7), ("right", 9)] {
        let image = gripgen_twin::TactileImage { width_px: 4, height_px: 2, rgb: vec![level; 24] };
        let path = folder.path().join(format!("images/a_{jaw}.png"));
        std::fs::write(path, gripgen_record::encode_png(&image).unwrap()).unwrap();
    }
    folder
}

#[test]
fn measured_pulls_are_rows_like_samples() {
    let folder = two_pulls();
    let found = open_dataset(folder.path()).unwrap();
    assert_eq!(found.table().rows(), 2);
    assert_eq!(found.table().numbers("max_pull_force_n").unwrap(), [6.5, 9.25]);
    assert_eq!(found.table().words("operator").unwrap(), ["ann", ""]);
    let mut out = vec![0; 48];
    found.images_with(0, gripgen_record::NoiseMode::Stored, &mut out).unwrap();
    assert!(out[..24].iter().all(|&v| v == 7) && out[24..].iter().all(|&v| v == 9));
    let mut images = |row| found.images_with(row, gripgen_record::NoiseMode::Stored, &mut out).unwrap_err();
    assert!(images(1).to_string().contains("row 1 has no images"));
    assert!(images(2).to_string().contains("no row 2, it has 2"));
}
