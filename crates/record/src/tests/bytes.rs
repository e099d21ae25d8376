//! The bytes of tables: names and order of columns, numbers as they are written.

use crate::proto::gripgen_v1::{Sample, Status};
use crate::{
    Dataset, csv_lines, extra_columns, index_header, index_row, read_pull_folder, write_pull_folder,
};
use std::collections::HashMap;

const INDEX: &str = "\
index,shard,in_shard,status,part,grip_pose,gel_id,session,grip_force_n,force_increment_n,step_time_s,dwell_s,\
pull_index,time_s,temperature_c,grip_offset_mm,grip_angle_deg,pull_direction,max_pull_force_n,slip_time_s,mu,group,\
repetition,failure,parts.gear.mu,pull.start_n,pull.step_s.jitter
7,,,suspect,\"gear, left\",2,g2,3,30.1,0.5,0.104,20,12,3600.25,21.5,-0.3,30,-1,11.25,1.5,0.31,3,1,why not,0.3,4.5,
";

#[test]
fn the_index_has_the_columns_and_numbers_that_it_always_had() {
    let varied = [
        "grip_force_n",
        "parts.gear.mu",
        "pull.increment_n",
        "pull.start_n",
        "pull.step_s",
        "pull.step_s.jitter",
    ];
    let extra = extra_columns(varied);
    let mut sample = Sample {
        index: 7,
        group: 3,
        repetition: 1,
        part: "gear, left".into(),
        grip_pose: 2,
        gel_id: "g2".into(),
        session: "3".into(),
        grip_force_n: 30.1,
        force_increment_n: 0.5,
        force_start_n: Some(4.5),
        step_time_s: 0.104,
        dwell_s: 20.0,
        pull_index: 12,
        time_s: 3600.25,
        temperature_c: 21.5,
        grip_offset_mm: -0.3,
        grip_angle_deg: 30.0,
        pull_direction: -1,
        max_pull_force_n: Some(11.25),
        slip_time_s: Some(1.5),
        mu: Some(0.31),
        status_reason: "why not".into(),
        drawn_number: HashMap::from([("parts.gear.mu".to_string(), 0.3), ("pull.start_n".into(), 4.5)])
            .into_iter()
            .collect(),
        ..Default::default()
    };
    sample.set_status(Status::Suspect);
    let lines = csv_lines([&index_header(&extra), &index_row(&sample, &extra)]);
    assert_eq!(String::from_utf8(lines).unwrap(), INDEX);
}

const PULLS: &str = "\
pull_id,part,grip_force_n,gel_id,session,force_increment_n,step_time_s,dwell_s,pull_index,time_s,temperature_c,\
grip_offset_mm,grip_angle_deg,pull_direction,force_start_n,humidity_pct,grip_pose,operator,max_pull_force_n
a,gear,30.1,g1,1,0.5,0.1,1.5,3,0.25,21.5,-0.3,30,-1,4.5,40,1,\"ann, b\",11.25
b,shaft,0.1,g2,2,1,0.104,0,4,-7,-40.5,0.7,-7.7,1,,,0,bo,-0.286
";

#[test]
fn every_column_of_a_table_is_written_as_it_was_read() {
    // The same table, its columns turned round.
    let turned: Vec<String> = {
        let mut reader = csv::ReaderBuilder::new().has_headers(false).from_reader(PULLS.as_bytes());
        let rows = reader.records().map(|row| row.unwrap().iter().rev().map(String::from).collect());
        let rows: Vec<Vec<String>> = rows.collect();
        vec![String::from_utf8(csv_lines(&rows)).unwrap()]
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
    let dataset = Dataset::open(&out).unwrap();
    let names: Vec<&str> = dataset.table().columns().iter().map(|(name, _)| name.as_str()).collect();
    let wanted = "pull_id,status,part,grip_force_n,gel_id,session,force_increment_n,step_time_s,dwell_s,pull_index,time_s,\
                  temperature_c,grip_offset_mm,grip_angle_deg,pull_direction,force_start_n,operator,grip_pose,humidity_pct,\
                  max_pull_force_n,status_reason";
    assert_eq!(names.join(","), wanted);
    assert_eq!(dataset.table().numbers("force_start_n"), Some(&[4.5, 1.0][..]));
    assert_eq!(dataset.table().numbers("temperature_c"), Some(&[21.5, -40.5][..]));
}
