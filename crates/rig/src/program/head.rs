//! The head of a program: its numbers as named assignments.

use std::fmt::Write;

/// Digits behind the point of every number.
const DIGITS: usize = 6;

/// The head of the program `name` of run `run`.
pub(super) fn write(name: &str, run: i32, numbers: &[(&str, f64)]) -> String {
    let mut text = format!("def {name}():\n  run_id = {run}\n");
    for (name, value) in numbers {
        let _ = writeln!(text, "  {name} = {value:.DIGITS$}");
    }
    text
}

/// Lines that every program begins with: it says which run it is, and waits for a heartbeat that changes; only then the watchdog
/// is set, when somebody kicks it.
pub(super) fn heartbeat() -> String {
    use super::registers::{
        DESIRED_FORCE, DISPLACEMENT, HEARTBEAT, LATERAL, PHASE, PRELOAD, REASON, RUN, STEP,
    };
    let mut text = String::from("  reason = 0\n");
    for register in [REASON, STEP] {
        let _ = writeln!(text, "  write_output_integer_register({register}, 0)");
    }
    for register in [DESIRED_FORCE, DISPLACEMENT, LATERAL, PRELOAD] {
        let _ = writeln!(text, "  write_output_float_register({register}, 0.0)");
    }
    let _ = write!(
        text,
        "  write_output_integer_register({PHASE}, {started})
  write_output_integer_register({RUN}, run_id)
  first = read_input_integer_register({HEARTBEAT})
  waited = 0.0
  while reason == 0 and read_input_integer_register({HEARTBEAT}) == first:
    sync()
    waited = waited + get_steptime()
    if waited > {wait:.1}:
      reason = {no_heartbeat}
    end
  end
  if reason == 0:
    rtde_set_watchdog(\"input_int_register_{HEARTBEAT}\", {rate:.1}, \"stop\")
  end
",
        started = super::Phase::Started as i32,
        wait = super::HEARTBEAT_WAIT_S,
        no_heartbeat = super::StopReason::NoHeartbeat as i32,
        rate = super::HEARTBEAT_LEAST_HZ,
    );
    text
}

/// Lines that every program ends with. The host reads the reason and takes its go back; the watchdog ends with the
/// program.
///
/// Nothing follows the function: a client interface runs it when its `end` has come, and would take a call after it for
/// another program, which replaces the first.
pub(super) fn farewell() -> String {
    use super::registers::{GO, PHASE, REASON};
    format!(
        "  write_output_integer_register({REASON}, reason)
  write_output_integer_register({PHASE}, {stopped})
  waited = 0.0
  while read_input_integer_register({GO}) == run_id and waited < {wait:.1}:
    sync()
    waited = waited + get_steptime()
  end
end
",
        stopped = super::Phase::Stopped as i32,
        wait = super::ACKNOWLEDGE_S,
    )
}
