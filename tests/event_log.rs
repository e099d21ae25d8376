//! The log of a real robot (UR3 CobotOps) as a control: its lost grips look like a warm-up effect, row by row.

use crate::common::root;
use gripgen_identify::{Covariate, Dependence, dependence};

/// Row of the log: session, cycle, temperature of joint 4, whether the grip was lost.
struct Row {
    session: usize,
    cycle: u32,
    temperature_c: f64,
    lost: bool,
}

fn log() -> Vec<Row> {
    let path = root().join("../shared/real/ur3_cobotops/ur3_cobotops.csv");
    let text = std::fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let header: Vec<&str> = lines.next().unwrap().split(',').collect();
    let at = |name: &str| header.iter().position(|h| *h == name).unwrap();
    let (temperature, cycle, lost) = (at("Temperature_J4"), at("cycle"), at("grip_lost"));
    let mut session = 0;
    let mut hour = None;
    let mut rows = Vec::new();
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let clock = &cells[1][11..16];
        let minutes = clock[..2].parse::<i32>().unwrap() * 60 + clock[3..].parse::<i32>().unwrap();
        // The pause of hours between the sessions.
        if hour.is_some_and(|before| minutes - before > 60) {
            session += 1;
        }
        hour = Some(minutes);
        // Some rows have no readings: their temperature is not known, and they say nothing of the grip.
        let number = |i: usize| cells[i].parse::<f64>().ok();
        let temperature_c = number(temperature).unwrap_or(f64::NAN);
        if let (Some(cycle), "True" | "False") = (number(cycle), cells[lost]) {
            rows.push(Row { session, cycle: cycle as u32, temperature_c, lost: cells[lost] == "True" });
        }
    }
    rows
}

/// One cycle of work: the unit in which grips are lost or not.
struct Cycle {
    session: usize,
    number: u32,
    temperature_c: f64,
    events: u32,
}

/// Cycles with their events: grips lost that were not lost before.
fn cycles(rows: &[Row]) -> Vec<Cycle> {
    let mut cycles: Vec<(Cycle, f64)> = Vec::new();
    let mut before = false;
    for row in rows {
        let event = u32::from(row.lost && !before);
        before = row.lost;
        match cycles.last_mut() {
            Some((c, _)) if (c.session, c.number) == (row.session, row.cycle) => {
                c.events += event;
            }
            _ => {
                let (session, number) = (row.session, row.cycle);
                cycles.push((Cycle { session, number, temperature_c: 0.0, events: event }, 0.0));
            }
        }
        if let (true, Some((c, n))) = (row.temperature_c.is_finite(), cycles.last_mut()) {
            c.temperature_c += row.temperature_c;
            *n += 1.0;
        }
    }
    let mean = |(mut c, n): (Cycle, f64)| {
        c.temperature_c /= n;
        c
    };
    cycles.into_iter().map(mean).collect()
}

fn as_number(lost: bool) -> f64 {
    f64::from(u8::from(lost))
}

fn show(name: &str, found: Dependence) {
    println!("{name}: strength {:.4}, p {:.3}", found.strength, found.p_value);
}

/// Rows in a row are one event, not many: what looks certain by rows is gone by events, by blocks and by sessions.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn lost_grips_are_no_warm_up_effect_when_events_are_counted() {
    let rows = log();
    assert!(rows.len() > 7000 && rows.iter().map(|r| r.session).max() == Some(1));
    let lost: Vec<f64> = rows.iter().map(|r| as_number(r.lost)).collect();
    let temperature = Covariate::Number(rows.iter().map(|r| r.temperature_c).collect());
    let by_rows = dependence(&lost, &[], &temperature, &(0..rows.len()).collect::<Vec<_>>(), 499, 1);
    show("rows", by_rows);
    assert!(by_rows.p_value <= 0.01, "the trap is not there: {by_rows:?}");

    let session: Vec<usize> = rows.iter().map(|r| r.session).collect();
    let by_session = dependence(&lost, &[], &temperature, &session, 499, 1);
    show("rows, by session", by_session);
    assert!(by_session.p_value > 0.2, "{by_session:?}");
    // Stretches of half an hour, about as long as the joint takes to warm up.
    let stretch: Vec<usize> = (0..rows.len()).map(|i| 1000 * rows[i].session + i / 1800).collect();
    let by_stretch = dependence(&lost, &[], &temperature, &stretch, 999, 1);
    show("rows, by half hour", by_stretch);
    assert!(by_stretch.p_value > 0.05, "{by_stretch:?}");
    // A lost grip lasts for many rows: each run of rows that are alike is one event.
    let mut run = 0;
    let runs: Vec<usize> = (0..rows.len())
        .map(|i| {
            run += usize::from(i > 0 && rows[i].lost != rows[i - 1].lost);
            run
        })
        .collect();
    let by_run = dependence(&lost, &[], &temperature, &runs, 499, 1);
    show("rows, by run", by_run);
    assert!(by_run.p_value > 0.05, "{by_run:?}");

    let cycles = cycles(&rows);
    let events: u32 = cycles.iter().map(|c| c.events).sum();
    println!("{events} events in {} cycles", cycles.len());
    assert_eq!(events, 77, "counted by hand in the file");
    let lost: Vec<f64> = cycles.iter().map(|c| f64::from(c.events)).collect();
    let each: Vec<usize> = (0..cycles.len()).collect();
    for (name, values) in [
        ("events, temperature", cycles.iter().map(|c| c.temperature_c).collect::<Vec<f64>>()),
        ("events, cycle", cycles.iter().map(|c| f64::from(c.number)).collect()),
    ] {
        let found = dependence(&lost, &[], &Covariate::Number(values), &each, 999, 1);
        show(name, found);
        assert!(found.p_value > 0.05, "{name}: {found:?}");
    }
}
