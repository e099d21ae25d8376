//! The bytes of tables: names and order of columns, numbers as they are written.

use crate::proto::gripgen_v1::{Sample, Status};
use crate::{csv_lines, extra_columns, index_header, index_row};
use std::collections::HashMap;

const INDEX: &str = "\
index,shard,in_shard,status,part,grip_pose,gel_id,session,grip_force_n,force_increment_n,step_time_s,dwell_s,\
pull_index,time_s,temperature_c,grip_offset_mm,grip_angle_deg,pull_direction,max_pull_force_n,slip_time_s,\
peak_force_n,kinetic_force_n,label_branch,limit_force_n,slip_onset_s,slip_s,mu_drawn,mu_effective,group,repetition,failure,\
parts.gear.mu,pull.start_n,pull.step_s.jitter
7,,,suspect,\"gear, left\",2,g2,3,30.1,0.5,0.104,20,12,3600.25,21.5,-0.3,30,-1,11.25,1.5,12.5,,static,12.75,0.5,1.25,0.33,0.31,3,1,why not,0.3,4.5,
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
        peak_force_n: Some(12.5),
        label_branch: "static".into(),
        limit_force_n: Some(12.75),
        slip_onset_s: Some(0.5),
        slip_s: Some(1.25),
        mu_drawn: Some(0.33),
        mu_effective: Some(0.31),
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
