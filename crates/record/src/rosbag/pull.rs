//! One pull of a bag: its trace, and the label that the trace gives.

use super::mapping::{BagCell, BagPull, RosbagFile};
use super::signals::{At, Signals, along, between, held};
use gripgen_twin::config::PullFile;
use gripgen_twin::{PullTrace, Staircase, TraceRow, slip_label};

/// Where the tool of an arm is in its base, in m, for six joint angles in rad.
pub type TipOfJoints<'a> = &'a dyn Fn(&[f64; 6]) -> [f64; 3];

/// What a bag says of a pull.
pub(super) struct ReadPull {
    pub(super) trace: PullTrace,
    /// Readings without a load after it.
    pub(super) after_n: Vec<f64>,
    /// Somebody recorded how the tool moved.
    pub(super) moved: bool,
    pub(super) label: BagLabel,
}

/// The label of a pull.
pub(super) enum BagLabel {
    Slipped(f64),
    Censored(f64),
    /// There is none, because.
    None(String),
}

/// What is wrong with a pull, and what to do about it.
pub(super) struct PullFault {
    pub(super) problem: String,
    pub(super) hint: String,
}

fn fault(problem: String, hint: &str) -> PullFault {
    PullFault { problem, hint: hint.into() }
}

/// The time of a mark.
pub(super) fn mark_ns(signals: &Signals, seconds: f64) -> i64 {
    let origin = signals.wrench.first().map_or(0, |at| at.ns);
    origin.saturating_add((seconds * 1e9).round() as i64)
}

/// Start and end of the staircase, in ns of the bag.
pub(super) fn span_ns(signals: &Signals, marks: &BagPull) -> Result<(i64, i64), PullFault> {
    let origin = signals.wrench.first().map_or(0, |at| at.ns);
    let last = signals.wrench.last().map_or(0, |at| at.ns);
    let from = marks.from_s.map_or(i64::MIN, |s| mark_ns(signals, s));
    let begin = match marks.begin_s {
        Some(s) => mark_ns(signals, s),
        None => {
            let commanded = signals.command.iter().find(|at| at.ns >= from && at.value > 0.0);
            let commanded = commanded.ok_or_else(|| {
                let n = signals.command.len();
                let problem = format!("nothing says when it begins: none of {n} commands is above 0 N");
                fault(problem, "`begin_s` is the start of the staircase, in seconds after the first wrench; or name topics.command")
            })?;
            commanded.ns
        }
    };
    let end = match marks.end_s {
        Some(s) => mark_ns(signals, s),
        // The command that ends it is the first that is not above 0.
        None => {
            signals.command.iter().find(|at| at.ns > begin && at.value <= 0.0).map_or(last, |at| at.ns - 1)
        }
    };
    let seconds = |ns: i64| (ns - origin) as f64 / 1e9;
    if begin >= end || begin > last || end < origin {
        return Err(fault(
            format!(
                "it is from {} to {} s, the wrench from 0 to {} s",
                seconds(begin),
                seconds(end),
                seconds(last)
            ),
            "times are in seconds after the first wrench; `clock = \"log\"` counts when messages were recorded",
        ));
    }
    Ok((begin, end))
}

/// A number among the columns of a pull.
fn number(marks: &BagPull, key: &str) -> Result<Option<f64>, PullFault> {
    match marks.columns.get(key) {
        None => Ok(None),
        Some(BagCell::Whole(x)) => Ok(Some(*x as f64)),
        Some(BagCell::Number(x)) => Ok(Some(*x)),
        Some(other) => Err(fault(format!("`{key}` is `{}`, it must be a number", other.text()), "")),
    }
}

/// The command without a topic of its own.
fn staircase(marks: &BagPull, duration_s: f64) -> Result<Staircase, PullFault> {
    let above = |key: &str, default: f64| {
        let found = number(marks, key)?.unwrap_or(default);
        let problem = || fault(format!("`{key}` is {found}, it must be a number above 0"), "");
        if found.is_finite() && found > 0.0 { Ok(found) } else { Err(problem()) }
    };
    let increment_n = above("force_increment_n", PullFile::default().increment_n)?;
    let step_s = above("step_time_s", crate::pulls::DEFAULT_STEP_S)?;
    let steps = duration_s / step_s;
    if steps > 1e6 {
        return Err(fault(
            format!("{duration_s} s have {steps:.0} steps of {step_s} s, at most 1000000"),
            "`end_s` is the end of the pull",
        ));
    }
    Ok(Staircase::constant(increment_n, step_s, duration_s).starting_at(number(marks, "force_start_n")?))
}

/// Reads a pull; `direction` is 1 or -1.
pub(super) fn read_pull(
    signals: &Signals,
    marks: &BagPull,
    mapping: &RosbagFile,
    direction: f64,
    tip: Option<TipOfJoints<'_>>,
) -> Result<ReadPull, PullFault> {
    let (begin, end) = span_ns(signals, marks)?;
    let force_n = |at: &At<[f64; 3]>| direction * along(&mapping.force.along, &at.value);
    let within = |from: i64, to: i64| {
        let first = signals.wrench.partition_point(|at| at.ns < from);
        let past = signals.wrench.partition_point(|at| at.ns <= to).max(first);
        &signals.wrench[first..past]
    };
    let rows_of = |pair: [f64; 2]| within(mark_ns(signals, pair[0]), mark_ns(signals, pair[1]));
    let unloaded = marks.no_load_s.map(rows_of).unwrap_or_default();
    if let Some(late) = unloaded.last().filter(|at| at.ns >= begin) {
        let seconds = |ns: i64| (ns - mark_ns(signals, 0.0)) as f64 / 1e9;
        let problem =
            format!("`no_load_s` reaches {} s, the pull begins at {} s", seconds(late.ns), seconds(begin));
        return Err(fault(problem, "readings without a load are those before the jaws pull"));
    }
    let zero_n = match (mapping.force.tare, unloaded) {
        (false, _) => 0.0,
        (true, []) => {
            return Err(fault(
                "`force.tare` has no reading to take off".into(),
                "`no_load_s` says when there was no load",
            ));
        }
        (true, rows) => rows.iter().map(force_n).sum::<f64>() / rows.len() as f64,
    };
    let place = |ns: i64| -> Option<f64> {
        let at = match (between(&signals.pose, ns), tip) {
            (Some(at), _) => at,
            (None, Some(tip)) => tip(&between(&signals.joints, ns)?),
            (None, None) => return None,
        };
        Some(direction * along(&mapping.motion.along, &at))
    };
    let pulled = within(begin, end);
    let start_m = place(begin);
    let stairs = staircase(marks, (end - begin) as f64 / 1e9)?;
    let since_s = |ns: i64| (ns - begin) as f64 / 1e9;
    let command_n = |ns: i64| match &signals.command[..] {
        [] => stairs.desired_n(since_s(ns)),
        commands => held(commands, ns).map_or(0.0, |at| at.value),
    };
    let row = |at: &At<[f64; 3]>, desired_force_n: f64, displacement_m: f64| TraceRow {
        time_s: since_s(at.ns),
        desired_force_n,
        measured_force_n: force_n(at) - zero_n,
        displacement_m,
    };
    let before = unloaded.iter().map(|at| row(at, 0.0, 0.0));
    let moved_m = |ns: i64| place(ns).zip(start_m).map_or(0.0, |(a, b)| a - b);
    let rows = pulled.iter().map(|at| row(at, command_n(at.ns), moved_m(at.ns)));
    let trace: PullTrace = before.chain(rows).collect();
    let after_n = marks.no_load_after_s.map(rows_of).unwrap_or_default();
    let after_n = after_n.iter().filter(|at| at.ns > end).map(|at| force_n(at) - zero_n).collect();
    let (tolerance_n, stop_m) = (mapping.campaign.label_tolerance_n, mapping.campaign.stop_mm * 1e-3);
    let label = label(&trace, tolerance_n, stop_m, start_m.is_some());
    Ok(ReadPull { trace: trace.until_displacement(stop_m), after_n, moved: start_m.is_some(), label })
}

/// The label of a trace. The jaws slid where the tool passed the stop; where nobody recorded the tool, where the command ended farther
/// above the force than the label rule lets it be.
fn label(trace: &PullTrace, tolerance_n: f64, stop_m: f64, moved: bool) -> BagLabel {
    let passed = trace.displacement_m.iter().any(|&d| d > stop_m);
    let left =
        trace.rows().last().is_some_and(|row| row.desired_force_n - row.measured_force_n > tolerance_n);
    let slid = if moved { passed } else { left };
    match slip_label(&trace.until_displacement(stop_m), tolerance_n, slid) {
        Ok(label) if label.censored => BagLabel::Censored(label.max_pull_force_n),
        Ok(label) => BagLabel::Slipped(label.max_pull_force_n),
        Err(e) => BagLabel::None(e.to_string()),
    }
}
