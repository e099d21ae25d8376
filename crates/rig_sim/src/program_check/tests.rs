//! The programs as they are, and mutations of their text: each is found.

use super::*;
use gripgen_rig::program::TcpPose;

/// Short times, and numbers that are not those of another quantity.
fn pull() -> PullProgram {
    PullProgram {
        run: 7,
        step_s: 0.03,
        increment_n: 0.9,
        start_n: 1.2,
        max_force_n: 9.5,
        abort_force_n: 13.0,
        stop_mm: 2.0,
        lateral_mm: 3.0,
        wait_s: 3.0,
        centre_of_gravity_mm: [1.0, -2.0, 81.0],
        payload_kg: 1.4,
        tool_mm: [3.0, 4.0, 190.0],
        ..PullProgram::default()
    }
}

fn motion() -> MotionProgram {
    MotionProgram {
        run: 4,
        target: TcpPose { position_m: [0.41, -0.2, 0.35], rotation_rad: [0.3, 1.25, 0.4] },
        speed_mm_s: 90.0,
        abort_force_n: 18.0,
        max_time_s: 3.0,
        payload_kg: 1.4,
        centre_of_gravity_mm: [1.0, -2.0, 81.0],
        tool_mm: [3.0, 4.0, 190.0],
    }
}

fn nothing(findings: &[Finding]) {
    assert!(findings.is_empty(), "{findings:#?}");
}

#[test]
fn what_this_rig_sends_does_what_its_numbers_say() {
    let by_time = PullProgram { max_time_s: 0.2, direction: -1.0, ..pull() };
    for program in [pull(), by_time, PullProgram::default()] {
        let text = program.script().unwrap();
        nothing(&check_pull(&program, &text).collect::<Vec<_>>());
    }
    for program in [motion(), MotionProgram { speed_mm_s: 250.0, ..motion() }] {
        let text = program.script().unwrap();
        nothing(&check_motion(&program, &text).collect::<Vec<_>>());
    }
}

/// The text of another program is found by its numbers.
#[test]
fn other_numbers_are_another_program() {
    let text = PullProgram { abort_torque_nm: 9.5, ..pull() }.script().unwrap();
    let found = check_pull(&pull(), &text).next().unwrap();
    assert_eq!(found.trial, "too much torque", "{found}");
    let text = MotionProgram { abort_force_n: 30.0, ..motion() }.script().unwrap();
    assert_eq!(check_motion(&motion(), &text).next().unwrap().trial, "a force on the way");
}

/// What is changed, the old words, the new words; all places of the old words.
type Mutation = (&'static str, &'static str, &'static str);

const OF_BOTH: [Mutation; 15] = [
    ("no watchdog", "rtde_set_watchdog(\"input_int_register_24\", 10.0, \"stop\")", "textmsg(\"no dog\")"),
    ("a slow watchdog", ", 10.0, \"stop\")", ", 1.0, \"stop\")"),
    ("a watchdog that pauses", "10.0, \"stop\"", "10.0, \"pause\""),
    ("a watchdog that does nothing", "10.0, \"stop\"", "10.0, \"ignore\""),
    ("a watchdog on the go", "\"input_int_register_24\"", "\"input_int_register_25\""),
    ("no sync in the wait for a beat", "== first:\n    sync()", "== first:"),
    ("a long wait for a beat", "if waited > 10.0:", "if waited > 100.0:"),
    ("the beat is read as the go", "read_input_integer_register(25)", "read_input_integer_register(24)"),
    ("no run number", "write_output_integer_register(26, run_id)", "textmsg(run_id)"),
    (
        "a swapped output register",
        "write_output_integer_register(27, reason)",
        "write_output_integer_register(28, reason)",
    ),
    ("no reason", "  write_output_integer_register(27, reason)\n", ""),
    ("no wait for the host at the end", "and waited < 2.0:", "and waited < 0.0:"),
    (
        "the grip centre in mm",
        "set_tcp(p[tool_x_mm / 1000, tool_y_mm / 1000, tool_z_mm / 1000,",
        "set_tcp(p[tool_x_mm, tool_y_mm, tool_z_mm,",
    ),
    ("a payload without a beat", "  first = read", "  set_payload(0.7)\n  first = read"),
    ("the payload in grams", "set_payload(payload_kg,", "set_payload(payload_kg * 1000,"),
];

const OF_THE_PULL: [Mutation; 53] = [
    ("no end of force mode", "    end_force_mode()\n", ""),
    ("no stop", "    stopl(2.0)\n", ""),
    ("a slow stop", "stopl(2.0)", "stopl(0.1)"),
    ("a wrong sign of the force", "[0, 0, direction * desired,", "[0, 0, -direction * desired,"),
    ("no direction of the force", "[0, 0, direction * desired,", "[0, 0, desired * desired / desired * -1,"),
    ("the speed limit in mm/s", "speed_mm_s / 1000, 0.03", "speed_mm_s, 0.03"),
    ("the stop in mm", "norm(moved) > stop_mm / 1000", "norm(moved) > stop_mm"),
    ("the lateral stop in mm", "aside > lateral_mm / 1000", "aside > lateral_mm"),
    ("the deviation in mm", "aside_m = lateral_mm / 1000", "aside_m = lateral_mm"),
    (
        "no sync in the pull",
        "      ticks = ticks + 1\n      sync()\n    end\n    write_output_integer_register(24, 6)",
        "      ticks = ticks + 1\n    end\n    write_output_integer_register(24, 6)",
    ),
    ("no sync in the wait for the go", "and reason == 0:\n      sync()", "and reason == 0:"),
    ("the sensor is not zeroed", "    zero_ftsensor()\n", ""),
    ("zeroed again after the grip", "    sum = 0.0\n", "    sum = 0.0\n    zero_ftsensor()\n"),
    (
        "command and displacement swapped",
        "write_output_float_register(24, desired)\n      write_output_float_register(25, moved)",
        "write_output_float_register(25, desired)\n      write_output_float_register(24, moved)",
    ),
    (
        "the displacement aside is that along",
        "write_output_float_register(26, aside)",
        "write_output_float_register(26, moved)",
    ),
    (
        "the phase in another register",
        "write_output_integer_register(24, 3)",
        "write_output_integer_register(25, 3)",
    ),
    ("another phase", "write_output_integer_register(24, 6)", "write_output_integer_register(24, 5)"),
    ("all axes give way", "[0, 0, 1, 0, 0, 0]", "[1, 1, 1, 0, 0, 0]"),
    ("another axis gives way", "[0, 0, 1, 0, 0, 0]", "[0, 1, 0, 0, 0, 0]"),
    ("an angle gives way", "[0, 0, 1, 0, 0, 0]", "[0, 0, 1, 0, 1, 0]"),
    ("no axis gives way", "[0, 0, 1, 0, 0, 0]", "[0, 0, 0, 0, 0, 0]"),
    (
        "the frame of the base",
        "frame = p[start[0], start[1], start[2], 0, 0, 0]",
        "frame = p[0, 0, 0, 0, 0, 0]",
    ),
    ("the frame of the tool", "start[2], 0, 0, 0]", "start[2], start[3], start[4], start[5]]"),
    ("a moving frame type", "], 2, [aside_m", "], 1, [aside_m"),
    ("a limit is missing", "0.03, 0.03, 0.03])", "0.03, 0.03])"),
    (
        "limits in another order",
        "[aside_m, aside_m, speed_mm_s / 1000,",
        "[speed_mm_s / 1000, aside_m, aside_m,",
    ),
    ("another axis of the sensor", "norm(wrench[2]) > abort_force_n", "norm(wrench[1]) > abort_force_n"),
    ("force of one sign", "norm(wrench[2])", "wrench[2]"),
    ("displacement of one sign", "norm(moved)", "moved"),
    (
        "torque of one axis",
        "wrench[3] * wrench[3] + wrench[4] * wrench[4] + wrench[5] * wrench[5]",
        "wrench[3] * wrench[3]",
    ),
    ("torque in Ncm", "torque > abort_torque_nm", "torque > abort_torque_nm * 100"),
    ("forces taken for torques", "sqrt(wrench[3] * wrench[3]", "sqrt(wrench[2] * wrench[2]"),
    ("no time limit", "elapsed > max_time_s", "elapsed > 1000 + max_time_s"),
    ("no largest command", "if desired > max_force_n:", "if desired > 1000 * max_force_n:"),
    ("a step too early", "start_n + (step - 1) * increment_n", "start_n + step * increment_n"),
    ("a step too many", "/ step_s + 0.000001) + 1", "/ step_s + 0.000001) + 2"),
    ("the start is forgotten", "desired = start_n + ", "desired = "),
    ("the tick of a CB3", "elapsed = ticks * get_steptime()", "elapsed = ticks * 0.008"),
    (
        "time does not pass",
        "      ticks = ticks + 1\n      sync()\n    end\n    write_output_integer_register(24, 6)",
        "      sync()\n    end\n    write_output_integer_register(24, 6)",
    ),
    ("another gain", "force_mode_set_gain_scaling(0.5)", "force_mode_set_gain_scaling(2.0)"),
    ("another damping", "force_mode_set_damping(0.025)", "force_mode_set_damping(1.0)"),
    ("no gain", "    force_mode_set_gain_scaling(0.5)\n", ""),
    ("a preload without direction", "direction * sum / ticks", "-1 * direction * sum / ticks"),
    ("a preload that is a sum", "direction * sum / ticks", "direction * sum"),
    ("no rest before force mode", "    sleep(0.05)\n", ""),
    ("no rest before the zero", "    sleep(0.5)\n", ""),
    (
        "the go is not looked at",
        "elif read_input_integer_register(25) != run_id:",
        "elif read_input_integer_register(25) == 12345:",
    ),
    ("no stop while it waits", " or read_input_integer_register(25) == -1:", ":"),
    ("it waits for ever", "if waited > wait_s or", "if waited > 1000 * wait_s or"),
    (
        "displacement along another axis",
        "direction * (pose[2] - start[2])",
        "direction * (pose[1] - start[1])",
    ),
    ("displacement without direction", "moved = direction * (", "moved = -1 * direction * ("),
    ("y aside is forgotten", " + (pose[1] - start[1]) * (pose[1] - start[1])", ""),
    (
        "another reason",
        "elif norm(moved) > stop_mm / 1000:\n        reason = 1",
        "elif norm(moved) > stop_mm / 1000:\n        reason = 6",
    ),
];

const OF_THE_MOTION: [Mutation; 16] = [
    ("the motion is not killed", "    kill handle\n", ""),
    ("no stop", "    stopl(2.0)\n", ""),
    ("a slow stop", "stopl(2.0)", "stopl(0.1)"),
    ("a speed of its own", "v=gripgen_speed", "v=3.0"),
    ("the speed in mm/s", "gripgen_speed = speed_mm_s / 1000", "gripgen_speed = speed_mm_s"),
    ("a hard start", "a=0.5", "a=5.0"),
    ("y and z swapped", "target_y_m, target_z_m", "target_z_m, target_y_m"),
    ("no turn", "target_rx_rad, target_ry_rad, target_rz_rad", "target_rx_rad, target_ry_rad, 0.0"),
    ("force along z alone", "norm([wrench[0], wrench[1], wrench[2]])", "norm(wrench[2])"),
    ("no force limit", "> abort_force_n:", "> 100 * abort_force_n:"),
    (
        "the go is not looked at",
        "elif read_input_integer_register(25) != run_id:",
        "elif read_input_integer_register(25) == 12345:",
    ),
    ("no time limit", "> max_time_s:", "> 1000 * max_time_s:"),
    ("it never says that it has arrived", "    gripgen_arrived = True\n", ""),
    (
        "it does not wait for its go",
        "while read_input_integer_register(25) != run_id and reason == 0:",
        "while False and reason == 0:",
    ),
    (
        "no sync on the way",
        "      ticks = ticks + 1\n      sync()\n    end\n    write_output_integer_register(24, 6)",
        "      ticks = ticks + 1\n    end\n    write_output_integer_register(24, 6)",
    ),
    ("the motion is called, not run", "handle = run motion()", "handle = motion()"),
];

/// Words that are broken, in any program.
const OF_WORDS: [Mutation; 7] = [
    ("a lost `end`", "  end\nend\n", "  end\n"),
    ("a name that is wrong", "waited = waited + get_steptime()", "waited = wated + get_steptime()"),
    ("a function that is wrong", "get_steptime()", "get_step_time()"),
    ("a lost colon", "if reason == 0:", "if reason == 0"),
    ("an assignment for a comparison", "if reason == 0:", "if reason = 0:"),
    ("a line after the end", "  end\nend\n", "  end\nend\nmovel(p[0,0,0,0,0,0])\n"),
    ("a text for a number", "reason = 0\n", "reason = \"0\"\n"),
];

/// One line of the table in docs/rig-fuzz.md.
fn row(
    of: &str,
    (what, old, new): Mutation,
    text: &str,
    find: impl Fn(&str) -> Option<Finding>,
) -> Option<String> {
    let mutated = text.replace(old, new);
    assert_ne!(mutated, text, "{what}: `{old}` is not in the text");
    let found = find(&mutated)?;
    Some(format!("| {of} | {what} | {} | {} |", found.trial, found.problem))
}

/// Each mutation is found. Where the numbers of one program do not show it, those of another do.
#[test]
fn mutations_of_the_text_are_found() {
    let pulls = [pull(), PullProgram { direction: -1.0, max_time_s: 0.2, ..pull() }];
    let (mut rows, mut missed) = (Vec::new(), Vec::new());
    for mutation in OF_BOTH.into_iter().chain(OF_THE_PULL).chain(OF_WORDS) {
        let found = pulls.iter().find_map(|program| {
            let text = program.script().unwrap();
            row("pull", mutation, &text, |text| check_pull(program, text).next())
        });
        found.map_or_else(|| missed.push(("pull", mutation.0)), |found| rows.push(found));
    }
    for mutation in OF_BOTH.into_iter().chain(OF_THE_MOTION).chain(OF_WORDS) {
        let text = motion().script().unwrap();
        let found = row("motion", mutation, &text, |text| check_motion(&motion(), text).next());
        found.map_or_else(|| missed.push(("motion", mutation.0)), |found| rows.push(found));
    }
    println!("{}", rows.join("\n"));
    println!("{} found, {} missed", rows.len(), missed.len());
    assert!(missed.is_empty(), "missed: {missed:?}");
}
