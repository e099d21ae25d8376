//! Pulls of a little integration of their own: a first-order loop pulls a block on a spring with dry friction.

use super::*;
use crate::TraceRow;
use crate::random::{Purpose, Stream};
use crate::slip_label;

const TOLERANCE_N: f64 = 3.0;
const STOP_M: f64 = 5e-3;

/// A pull made up, and the rig it was made on.
#[derive(Clone, Copy)]
struct SyntheticPull {
    slips_at_n: f64,
    kinetic: f64,
    increment_n: f64,
    start_n: f64,
    lag_s: f64,
    noise_n: f64,
    no_load: usize,
    rate_hz: f64,
}

const SYNTHETIC: SyntheticPull = SyntheticPull {
    slips_at_n: 12.0,
    kinetic: 1.0,
    increment_n: 1.0,
    start_n: 0.0,
    lag_s: 0.05,
    noise_n: 0.12,
    no_load: 250,
    rate_hz: 500.0,
};

/// A trace: `tau dy/dt = F_des - y` behind a damper of 2 kN s/m, against a spring of 30 N/mm in series with dry friction.
fn pull(rig: SyntheticPull, seed: u64) -> PullTrace {
    let mut noise = Stream::new(41, seed, Purpose::ForceNoise);
    let step_s = 1.0 / rig.rate_hz;
    let before = (0..rig.no_load).map(|i| (i as f64 - rig.no_load as f64) * step_s);
    let mut trace: PullTrace = before
        .map(|time_s| TraceRow {
            time_s,
            desired_force_n: 0.0,
            measured_force_n: rig.noise_n * noise.normal(),
            displacement_m: 0.0,
        })
        .collect();
    let (stiffness, damping, tick_s) = (3e4, 2000.0, 2e-4);
    let (mut loop_n, mut x, mut anchor, mut sliding) = (0.0, 0.0_f64, 0.0_f64, false);
    for row in 0.. {
        let time_s = f64::from(row) * step_s;
        let desired_force_n = rig.start_n + rig.increment_n * ((time_s / 0.104 + 1e-9).floor() + 1.0);
        let held_n = stiffness * (x - anchor);
        let measured_force_n = held_n + rig.noise_n * noise.normal();
        trace.push(TraceRow { time_s, desired_force_n, measured_force_n, displacement_m: x });
        if x > STOP_M || time_s > 20.0 {
            break;
        }
        for _ in 0..(step_s / tick_s).round() as usize {
            loop_n += (desired_force_n - loop_n) * (1.0 - libm::exp(-tick_s / rig.lag_s.max(1e-4)));
            let holds_n = rig.slips_at_n * if sliding { rig.kinetic } else { 1.0 };
            let force_n = stiffness * (x - anchor);
            let speed = ((loop_n - force_n) / damping).clamp(-0.02, 0.02);
            x += speed * tick_s;
            if stiffness * (x - anchor) > holds_n {
                sliding = true;
                anchor = x - rig.slips_at_n * rig.kinetic / stiffness;
            }
        }
    }
    trace
}

/// The rule, on what the displacement stop leaves.
fn label_of(trace: &PullTrace) -> Option<f64> {
    let pulled: PullTrace = trace.rows().filter(|row| row.time_s >= 0.0).collect();
    let label = slip_label(&pulled.until_displacement(STOP_M), TOLERANCE_N, true);
    label.ok().map(|label| label.max_pull_force_n)
}

fn judged(trace: &PullTrace, label_n: f64) -> Judgement {
    check_label(&LabelEvidence::of_trace(label_n, TOLERANCE_N, STOP_M, Some(trace)), &Expected::default())
}

/// Every fifth row, as such traces are stored.
fn thinned(trace: &PullTrace) -> PullTrace {
    trace.rows().enumerate().filter(|(i, _)| i % 5 == 0).map(|(_, row)| row).collect()
}

/// Pulls of many forces, staircases, loops and frictions.
fn rig_of(seed: u64) -> SyntheticPull {
    let mut draw = Stream::new(7, seed, Purpose::Scatter);
    let increment_n = [0.5, 1.0, 2.0][(draw.bits() % 3) as usize];
    SyntheticPull {
        slips_at_n: 4.0 + 31.0 * draw.uniform(),
        kinetic: [1.0, 1.0, 0.9, 0.8][(draw.bits() % 4) as usize],
        increment_n,
        start_n: [0.0, 0.0, 2.0][(draw.bits() % 3) as usize],
        lag_s: 0.02 + 0.06 * draw.uniform(),
        noise_n: 0.05 + 0.15 * draw.uniform(),
        ..SYNTHETIC
    }
}

#[test]
fn clean_pulls_prove_their_labels() {
    for thin in [false, true] {
        let mut suspect = Vec::new();
        for seed in 0..400 {
            let full = pull(rig_of(seed), seed);
            let label_n = label_of(&full).unwrap();
            let judgement = judged(&if thin { thinned(&full) } else { full }, label_n);
            assert_ne!(judgement.verdict, Verdict::NoEvidence);
            suspect.extend(judgement.reason().map(|reason| format!("{seed}: {reason}")));
        }
        assert!(suspect.len() <= 2, "thinned {thin}: {} of 400: {suspect:#?}", suspect.len());
    }
}

#[test]
fn labels_that_are_not_those_of_their_traces_are_noticed() {
    for thin in [false, true] {
        let (mut smaller, mut larger) = (0, 0);
        for seed in 0..48 {
            let rig = SyntheticPull { slips_at_n: 9.0 + 0.5 * seed as f64, kinetic: 1.0, ..rig_of(seed) };
            let full = pull(rig, seed);
            let label_n = label_of(&full).unwrap();
            let trace = if thin { thinned(&full) } else { full };
            smaller += usize::from(judged(&trace, 0.9 * label_n).verdict == Verdict::Suspect);
            larger += usize::from(judged(&trace, label_n + 1.2).verdict == Verdict::Suspect);
        }
        assert!(smaller >= 44 && larger >= 44, "thinned {thin}: {smaller}, {larger} of 48");
    }
}

#[test]
fn a_trace_with_every_reading_gives_the_label_to_the_last_digit() {
    let trace = pull(SYNTHETIC, 3);
    let label_n = label_of(&trace).unwrap();
    let of = |label_n: f64| {
        let of_trace = LabelEvidence::of_trace(label_n, TOLERANCE_N, STOP_M, Some(&trace));
        check_label(&LabelEvidence { every_reading: true, ..of_trace }, &Expected::default())
    };
    assert_eq!(of(label_n).verdict, Verdict::Holds);
    let off = of(label_n - 0.1);
    let reason = off.reason().unwrap();
    assert!(reason.starts_with("the label rule gives"), "{reason}");
    assert_eq!(off.behind(), Behind::Pull);
}

/// A pull is suspect, or its label is that of the rig by at most what a label may be off.
fn found_or_right(change: impl Fn(&SyntheticPull, &mut PullTrace), pulls: u64) -> (usize, Vec<String>) {
    let (mut found, mut missed) = (0, Vec::new());
    for seed in 0..pulls {
        let rig = SyntheticPull {
            slips_at_n: 8.0 + 0.6 * seed as f64,
            kinetic: 1.0,
            increment_n: 1.0,
            ..rig_of(seed)
        };
        let mut trace = pull(rig, seed);
        let true_n = rig.slips_at_n;
        change(&rig, &mut trace);
        let Some(label_n) = label_of(&trace) else { continue };
        let judgement = judged(&trace, label_n);
        if judgement.verdict == Verdict::Suspect {
            found += 1;
        } else if (label_n - true_n).abs() > cap_n(true_n) + 2.0 * rig.noise_n {
            missed.push(format!("{label_n:.2} of {true_n:.2} N, {:?}", judgement.budget));
        }
    }
    (found, missed)
}

#[test]
fn slow_loops_are_found_or_harmless() {
    let mut found = [0; 10];
    for (tenth, found) in (1_u8..).zip(&mut found) {
        let lag_s = 0.05 * f64::from(tenth);
        // The loop is slow, so the force is late.
        let (of_loop, missed) =
            found_or_right(|rig, trace| *trace = pull(SyntheticPull { lag_s, ..*rig }, tenth.into()), 24);
        assert!(missed.is_empty(), "loop of {lag_s} s: {missed:#?}");
        // The reading is late, and the force is not.
        let (of_sensor, missed) = found_or_right(
            |_, trace| {
                let (mut slow_n, mut before_s) = (0.0, trace.time_s[0]);
                for (force_n, &time_s) in trace.measured_force_n.iter_mut().zip(&trace.time_s) {
                    slow_n += (*force_n - slow_n) * (1.0 - libm::exp(-(time_s - before_s) / lag_s));
                    before_s = time_s;
                    *force_n = slow_n;
                }
            },
            24,
        );
        assert!(missed.len() <= 1, "sensor of {lag_s} s: {missed:#?}");
        *found = of_loop.max(of_sensor);
    }
    assert!(found[9] >= 22, "half a second spoils most labels: {found:?}");
    assert_eq!(found[0], 0, "a twentieth of one spoils none: {found:?}");
}

#[test]
fn zero_errors_are_found_or_harmless() {
    for zero_n in [-5.0, -2.5, -1.0, -0.7, -0.3, 0.3, 0.7, 1.0, 2.5, 5.0] {
        for (from, name) in [(-9.0, "all along"), (0.0, "from the pull on"), (0.25, "while the part is held")]
        {
            let (_, missed) = found_or_right(
                |_, trace| {
                    let end_s = trace.time_s[trace.len() - 1];
                    for (force_n, &time_s) in trace.measured_force_n.iter_mut().zip(&trace.time_s) {
                        *force_n += if time_s >= from * end_s { zero_n } else { 0.0 };
                    }
                },
                24,
            );
            assert!(missed.len() <= 1, "{zero_n} N {name}: {missed:#?}");
        }
    }
}

#[test]
fn a_zero_that_moved_shows_in_the_readings_after_the_pull() {
    let trace = pull(SYNTHETIC, 5);
    let label_n = label_of(&trace).unwrap();
    let of_trace = LabelEvidence::of_trace(label_n, TOLERANCE_N, STOP_M, Some(&trace));
    let after = |zero_n: f64| {
        let no_load_after_n = [zero_n; 20];
        check_label(&LabelEvidence { no_load_after_n: &no_load_after_n, ..of_trace }, &Expected::default())
    };
    assert_eq!(after(0.1).verdict, Verdict::Holds);
    let moved = after(1.6);
    assert!(moved.reason().unwrap().contains("zero is 1.60 N"), "{:?}", moved.reason());
    assert!((moved.budget.zero_n - 1.6).abs() < 0.1 && moved.budget.total_n() > 1.6);
    assert_eq!(moved.behind(), Behind::Rig);
}

#[test]
fn missing_evidence_is_no_reason() {
    let nothing = LabelEvidence::of_trace(1e9, TOLERANCE_N, STOP_M, None);
    assert_eq!(check_label(&nothing, &Expected::default()).verdict, Verdict::NoEvidence);
    let few = pull(SYNTHETIC, 1).rows().take(SYNTHETIC.no_load + 3).collect();
    assert_eq!(judged(&few, 1e9).verdict, Verdict::NoEvidence, "three rows of a pull");
    let trace = pull(SyntheticPull { no_load: 0, ..SYNTHETIC }, 2);
    let judgement = judged(&trace, label_of(&trace).unwrap());
    assert_eq!(judgement.verdict, Verdict::Holds);
    assert!(judgement.findings.iter().all(|f| f.kind != FindingKind::Zero));
}

#[test]
fn nothing_panics_on_what_is_no_trace() {
    for bad in [f64::NAN, f64::INFINITY, -1e300] {
        let mut trace = pull(SYNTHETIC, 1);
        trace.measured_force_n[400] = bad;
        trace.displacement_m[500] = bad;
        judged(&trace, bad);
    }
    let row = TraceRow { time_s: 0.0, desired_force_n: 1.0, measured_force_n: 1.0, displacement_m: 0.0 };
    for n in 0..20 {
        for step_s in [0.0, 1e-9, 0.01, 5.0] {
            let at = |i: i32| TraceRow { time_s: f64::from(i) * step_s, ..row };
            judged(&(0..n).map(at).collect(), 1.0);
        }
    }
}

#[test]
fn other_devices_speak_against_a_label() {
    let base = LabelEvidence::of_trace(20.0, TOLERANCE_N, STOP_M, None);
    let says = |reported_n| {
        let grip_force = Some(GripForceEvidence { asked_n: 20.0, reported_n, allowed_n: 1.0 });
        check_label(&LabelEvidence { grip_force, ..base }, &Expected::default())
    };
    assert_eq!(says(20.4).verdict, Verdict::Holds);
    assert_eq!(
        says(14.0).reason().unwrap(),
        "the gripper reports 14.00 N per jaw, 20.00 N were asked (1.00 N are allowed)"
    );
    let wrench = |across: f64, arm_m: f64, torque_nm: f64| {
        let row = |i: i32| {
            let pull_n = f64::from(i.max(0)) * 0.2;
            let share = if i > 90 { 1.0 } else { 0.0 };
            WrenchRow {
                time_s: f64::from(i) * 0.01,
                pull_n,
                across_n: [across * pull_n / 20.0, 0.3],
                torque_nm: [0.1 + arm_m * pull_n, torque_nm * share, 0.0],
            }
        };
        let rows: Vec<WrenchRow> = (-20..=100).map(row).collect();
        check_label(&LabelEvidence { wrench: &rows, ..base }, &Expected::default())
    };
    assert_eq!(wrench(2.0, 0.03, 0.0).verdict, Verdict::Holds, "0.1 N of friction, and a lever of 3 cm");
    // sqrt(20^2 + 8^2) = 21.54.
    let aside = wrench(8.3, 0.0, 0.0).reason().unwrap();
    assert!(aside.contains("21.5") && aside.contains("20.00 N"), "{aside}");
    assert!(wrench(0.0, 0.03, 0.8).reason().unwrap().contains("Nm of torque are no lever"));
}

#[test]
fn a_recorded_reason_says_as_much_as_its_findings() {
    let all: Vec<(FindingKind, String)> = FindingKind::ALL
        .into_iter()
        .flat_map(|kind| [None, Some(0.104)].map(|time_s| (kind, time_s)))
        .map(|(kind, time_s)| Finding { kind, found: -12.5, wanted: 3.25, allowed: 0.33, time_s })
        .map(|finding| (finding.kind, finding.to_string()))
        .collect();
    for (kind, reason) in &all {
        assert_eq!(recorded_behind(reason), kind.behind(), "{reason}");
        for (other, second) in &all {
            let both = format!("{reason}; {second}");
            assert_eq!(recorded_behind(&both), kind.behind().min(other.behind()), "{both}");
        }
        assert_eq!(recorded_behind(&format!("{reason}; the left camera fell silent")), Behind::Pull);
    }
    assert_eq!(recorded_behind(""), Behind::Pull);
}
