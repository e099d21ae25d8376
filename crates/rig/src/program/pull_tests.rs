use super::*;

fn script(of: impl FnOnce(&mut PullProgram)) -> String {
    let mut program = PullProgram::default();
    of(&mut program);
    program.script().unwrap()
}

/// Every block that is opened is closed at its own depth, and the lines in it are indented by it.
#[test]
fn blocks_close_where_they_open() {
    let text = script(|_| ());
    let mut open = vec![];
    for line in text.lines() {
        let depth = line.len() - line.trim_start().len();
        let words = line.trim();
        if words == "end" {
            assert_eq!(open.pop(), Some(depth), "{line}");
        } else if words.starts_with("elif") || words.starts_with("else") {
            assert_eq!(open.last(), Some(&depth), "{line}");
        } else {
            assert_eq!(depth, 2 * open.len(), "{line}");
        }
        if words.ends_with(':') && !words.starts_with("el") {
            open.push(depth);
        }
    }
    assert!(open.is_empty());
    assert!(text.ends_with("\nend\n"), "nothing after the function");
}

#[test]
fn every_way_out_of_the_pull_ends_force_mode_and_stops() {
    let text = script(|_| ());
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    let at =
        |wanted: &str| lines.iter().position(|l| l.starts_with(wanted)).unwrap_or_else(|| panic!("{wanted}"));
    // One loop commands the force, it is left by its condition alone, and what follows it is the stop.
    assert_eq!(text.matches("force_mode(frame").count(), 1);
    assert!(!text.contains("break") && !text.contains("return") && !text.contains("halt"));
    let (pull, stop) = (at("force_mode(frame"), at("end_force_mode()"));
    assert!(pull < stop && lines[stop + 1].starts_with("stopl("));
    for reason in 1..=8 {
        assert!(text.contains(&format!("reason = {reason}\n")), "reason {reason}");
        assert_eq!(StopReason::from_number(reason).unwrap() as i32, reason);
    }
    assert_eq!(StopReason::from_number(0), None);
    // The reason is out before the phase that says so.
    assert!(at("write_output_integer_register(27, reason)") < at("write_output_integer_register(24, 4)"));
}

#[test]
fn the_watchdog_is_set_after_the_first_heartbeat_and_before_anything_moves() {
    let text = script(|_| ());
    let at = |wanted: &str| text.find(wanted).unwrap_or_else(|| panic!("{wanted}"));
    let order = [
        "first = read_input_integer_register(24)",
        "rtde_set_watchdog(\"input_int_register_24\", 10.0, \"stop\")",
        "zero_ftsensor()",
        "write_output_integer_register(24, 2)",
        "read_input_integer_register(25) != run_id",
        "start = get_actual_tcp_pose()",
        "force_mode(frame",
    ];
    let places: Vec<usize> = order.iter().map(|line| at(line)).collect();
    assert!(places.is_sorted(), "{places:?}");
}

#[test]
fn the_numbers_of_the_pull_stand_in_the_program() {
    let text = script(|p| {
        (p.run, p.increment_n, p.start_n, p.step_s, p.stop_mm) = (7, 0.5, 2.0, 0.2, 3.0);
        (p.max_force_n, p.abort_force_n, p.speed_mm_s, p.direction) = (30.0, 35.0, 10.0, -1.0);
    });
    for wanted in [
        "  run_id = 7\n",
        "  increment_n = 0.500000\n",
        "  start_n = 2.000000\n",
        "desired = start_n + (step - 1) * increment_n",
        "  step_s = 0.200000\n",
        "  max_force_n = 30.000000\n",
        "  abort_force_n = 35.000000\n",
        "  stop_mm = 3.000000\n",
        "  direction = -1.000000\n",
        "[0, 0, direction * desired, 0, 0, 0], 2, [aside_m, aside_m, speed_mm_s / 1000, 0.03, 0.03, 0.03])",
        "read_input_integer_register(25) != run_id",
    ] {
        assert!(text.contains(wanted), "{wanted}\n{text}");
    }
    // Outside clients have the registers from 24 on.
    for digits in
        text.split("register(").skip(1).map(|rest| rest.split([',', ')']).next().unwrap_or_default())
    {
        assert!((24..48).contains(&digits.parse::<u8>().unwrap()), "{digits}");
    }
}

#[test]
fn nothing_beyond_the_limits_becomes_a_program() {
    let refused = |of: fn(&mut PullProgram)| {
        let mut program = PullProgram::default();
        of(&mut program);
        program.script().unwrap_err().to_string()
    };
    assert_eq!(refused(|p| p.max_force_n = 60.0), "the largest command is 60 N, it must be from 1 to 45 N");
    assert!(refused(|p| p.abort_force_n = 40.0).contains("40 N, it must be from 45 to 50 N"));
    assert!(refused(|p| p.start_n = 46.0).contains("the start force is 46 N, it must be from 0 to 45 N"));
    assert!(refused(|p| p.speed_mm_s = 1500.0).contains("1500 mm/s"));
    assert!(refused(|p| p.direction = 0.5).contains("the direction is 0.5"));
    assert!(refused(|p| p.step_s = f64::NAN).contains("NaN"));
    assert!(refused(|p| p.centre_of_gravity_mm = [0.0, f64::NAN, 0.0]).contains("centre of gravity is NaN"));
    assert!(refused(|p| p.run = 0).contains("the run is 0"));
}
