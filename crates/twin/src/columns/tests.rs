use super::*;
use crate::{PullSettings, Scenario, pull_keys, scenario_keys};

fn scenario() -> Scenario {
    let pull = PullSettings { increment_n: 0.0, step_s: 0.0, ..Default::default() };
    Scenario { pull, ..Scenario::default() }
}

/// A cell that a column may hold, and no other column has by default.
fn sample(column: &Column) -> &'static str {
    match column.kind {
        Kind::Name | Kind::Word => "b 7",
        Kind::Whole => "11",
        Kind::Direction => "-1",
        Kind::Number => "7.5",
    }
}

/// Files and reports stand in this order.
#[test]
fn the_order_of_the_columns_is_that_of_the_files() {
    let names = |all: &mut dyn Iterator<Item = &'static Column>| all.map(|c| c.name).collect::<Vec<_>>();
    assert_eq!(
        names(&mut covariates()),
        [
            "part",
            "grip_force_n",
            "gel_id",
            "session",
            "force_increment_n",
            "step_time_s",
            "dwell_s",
            "pull_index",
            "time_s",
            "temperature_c",
            "grip_offset_mm",
            "grip_angle_deg",
            "pull_direction",
        ]
    );
    assert_eq!(
        names(&mut COLUMNS.iter().filter(|c| c.indexed)),
        [
            "part",
            "grip_pose",
            "gel_id",
            "session",
            "grip_force_n",
            "force_increment_n",
            "step_time_s",
            "dwell_s",
            "pull_index",
            "time_s",
            "temperature_c",
            "grip_offset_mm",
            "grip_angle_deg",
            "pull_direction",
        ]
    );
    let unknown = names(&mut covariates().filter(|c| !c.known_to_rig));
    assert_eq!(unknown, ["temperature_c"], "a rig has no thermometer");
    assert_eq!(
        scenario_keys().collect::<Vec<_>>(),
        [
            "part",
            "grip_pose",
            "rig_id",
            "gel_id",
            "session",
            "grip_force_n",
            "dwell_s",
            "pull_index",
            "time_s",
            "temperature_c",
            "grip_offset_mm",
            "grip_angle_deg",
            "pull_direction",
        ]
    );
    assert_eq!(
        pull_keys().collect::<Vec<_>>(),
        [
            "pull.increment_n",
            "pull.start_n",
            "pull.step_s",
            "pull.step_s.jitter",
            "pull.stop_mm",
            "pull.max_force_n",
            "pull.label_tolerance_n",
        ]
    );
}

#[test]
fn every_column_is_read_back_as_it_was_put_in() {
    for column in COLUMNS {
        let (mut pull, cell) = (scenario(), sample(column));
        let before = COLUMNS.iter().map(|c| c.cell(pull.view()).into_owned()).collect::<Vec<_>>();
        column.read_cell(cell, &mut pull.edit()).unwrap_or_else(|e| panic!("{}: {e}", column.name));
        assert_eq!(column.cell(pull.view()), cell, "{}", column.name);
        let value = match (column.holds_words(), column.written_number(pull.view())) {
            (false, Some(x)) => Drawn::Number(x),
            _ => column.value(pull.view()).unwrap(),
        };
        assert_eq!(value.to_string(), cell, "{}", column.name);
        assert_eq!(column.number(pull.view()).is_some(), !column.holds_words(), "{}", column.name);
        assert_eq!(column.word(pull.view()).is_some(), column.holds_words(), "{}", column.name);
        // A sweep puts in the same, and nothing else of the pull changes.
        let mut drawn = scenario();
        column.set_drawn(&mut drawn.edit(), column.sweep_key(), &value).unwrap();
        assert_eq!(drawn, pull, "{}", column.name);
        for (other, before) in COLUMNS.iter().zip(before).filter(|(c, _)| c.name != column.name) {
            assert_eq!(other.cell(pull.view()), before, "{} changes {}", column.name, other.name);
        }
    }
}

#[test]
fn numbers_are_in_si_units_inside() {
    let mut pull = scenario();
    for (name, cell) in [("grip_offset_mm", "3"), ("grip_angle_deg", "30"), ("step_time_s", "0.5")] {
        find(name).unwrap().read_cell(cell, &mut pull.edit()).unwrap();
        assert_eq!(find(name).unwrap().cell(pull.view()), cell, "no 29.999999999999996");
    }
    assert_eq!((pull.covariates.grip_offset_m, pull.pull.step_s), (3e-3, 0.5));
    assert!((pull.covariates.grip_angle_rad - std::f64::consts::FRAC_PI_6).abs() < 1e-15);
}

#[test]
fn every_alias_is_that_of_one_column() {
    for column in COLUMNS {
        for name in [&[column.name], column.aliases].concat() {
            assert_eq!(find(name).map(|c| c.name), Some(column.name), "{name}");
            let others = COLUMNS.iter().filter(|c| c.name == name || c.aliases.contains(&name)).count();
            assert_eq!(others, 1, "{name}");
        }
        let keys: Vec<&str> = scenario_keys().chain(pull_keys()).collect();
        assert!(keys.contains(&column.sweep_key()), "{}", column.name);
        assert_eq!(column.unit.is_empty(), column.holds_words(), "{} has no unit", column.name);
        assert!(!column.about.is_empty(), "{}", column.name);
    }
    assert_eq!(find("pull.increment_n").map(|c| c.name), Some("force_increment_n"));
    assert!(find("increment").is_none() && covariate("pull.step_s").is_none());
}

/// Tables take what people measured, sweeps what can be simulated.
#[test]
fn ranges_are_those_of_tables_and_of_sweeps() {
    let table = |name: &str, x: f64| find(name).unwrap().check_measured(x).map_err(Cow::into_owned);
    let sweep = |name: &str, x: f64| {
        let column = find(name).unwrap();
        column.check_drawn(column.sweep_key(), x).map_err(|e| e.problem)
    };
    assert_eq!(table("temperature_c", 400.0), Ok(400.0));
    assert_eq!(
        sweep("temperature_c", 400.0).unwrap_err(),
        "400 C is out of range, it must be at least -40 C and at most 120 C"
    );
    assert_eq!(table("grip_force_n", 0.0).unwrap_err(), "a number above 0");
    assert!(sweep("grip_force_n", 0.01).unwrap_err().contains("at least 0.05 N and at most 2000 N"));
    assert_eq!(table("dwell_s", -1.0).unwrap_err(), "a number of at least 0");
    assert_eq!(table("pull_index", 1.5).unwrap_err(), "a whole number of at least 0");
    assert_eq!(sweep("pull_index", 1.5).unwrap_err(), "1.5 is not a whole number");
    assert_eq!(table("pull_direction", 0.5).unwrap_err(), "1 (up) or -1 (down)");
    assert_eq!(sweep("pull_direction", 0.5).unwrap_err(), "0.5 is neither 1 (up) nor -1 (down)");
    for column in COLUMNS.iter().filter(|c| !c.holds_words()) {
        assert!(column.check_measured(f64::NAN).is_err(), "{}", column.name);
        assert!(column.check_drawn(column.name, f64::INFINITY).is_err(), "{}", column.name);
    }
}

#[test]
fn a_column_without_a_field_stands_beside_the_others() {
    let column =
        Column { name: "humidity_pct", unit: "%", kind: Kind::Number, held: Held::Extra, ..COLUMNS[8] };
    let mut pull = scenario();
    assert_eq!((column.value(pull.view()), column.cell(pull.view())), (None, "".into()));
    column.read_cell("40.5", &mut pull.edit()).unwrap();
    assert_eq!((column.number(pull.view()), column.cell(pull.view())), (Some(40.5), "40.5".into()));
    assert_eq!(value("humidity_pct", pull.view()), Some(Drawn::Number(40.5)), "tables of a twin see it too");
}
