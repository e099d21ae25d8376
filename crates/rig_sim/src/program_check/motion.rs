//! Trials of a motion.

use super::bench::{Bench, Verdict, near};
use super::pull::never_begins;
use crate::arm::STEP_S;
use crate::spring::Spring;
use gripgen_rig::program::{GO_WAIT_S, MotionProgram, Phase, StopReason, TcpPose, registers};

type Trial = fn(&MotionProgram, &str) -> Verdict;

/// What is tried, by its name.
pub(super) const TRIALS: [(&str, Trial); 9] = [
    ("the way", way),
    ("a force on the way", force),
    ("a force aside on the way", force_aside),
    ("the way takes too long", time),
    ("the host takes its go back on the way", host_stops),
    ("the host says stop before the way", host_stops_waiting),
    ("the host dies on the way", host_dies),
    ("nobody beats before the way", nobody_beats),
    ("nobody says go before the way", nobody_says_go),
];

const NOTHING: Spring = Spring { limit_n: 1.0, ..Spring::PLAIN };
/// How long the way is, and how much the tool turns on it.
const WAY_M: f64 = 0.1;
const TURN_RAD: f64 = 0.2;
/// Harder than this is no gentle motion (the program asks for 0.5 m/s^2).
const MOST_M_S2: f64 = 0.6;
/// Braking at 2 m/s^2, from the moment of the cause.
const BRAKE_M_S2: f64 = 2.0;
const GRAVITY_M_S2: f64 = 9.806_65;

fn start_of(m: &MotionProgram, way_m: f64) -> TcpPose {
    let mut start = m.target;
    start.position_m[0] -= 0.6 * way_m;
    start.position_m[2] -= 0.8 * way_m;
    start.rotation_rad[2] -= TURN_RAD;
    start
}

fn start(m: &MotionProgram, text: &str, way_m: f64) -> Result<Bench, String> {
    Bench::start(NOTHING, start_of(m, way_m), m.tool_mm, m.run, text)
}

/// On the way, with some speed.
fn moving(m: &MotionProgram, text: &str, way_m: f64) -> Result<Bench, String> {
    let mut bench = start(m, text, way_m)?;
    bench.go(m.run);
    bench.until_phase(Phase::Moving, 0.1)?;
    bench.steps(0.1)?;
    if bench.arm().speed_m_s() > 0.0 { Ok(bench) } else { Err("it does not move".into()) }
}

fn arrived(m: &MotionProgram, bench: &Bench) -> bool {
    let (is, wanted) = (bench.robot().tcp.numbers(), m.target.numbers());
    is.iter().zip(wanted).all(|(is, wanted)| (is - wanted).abs() < 2e-6)
}

/// It stands, not at its target, and no farther than it takes to brake.
fn broken_off(m: &MotionProgram, bench: &mut Bench, reason: StopReason) -> Verdict {
    let (from, speed) = (bench.robot().tcp, bench.arm().speed_m_s());
    bench.stops_for(reason, 0.5)?;
    let (went_m, most_m) = (
        bench.robot().tcp.distance_m(&from),
        speed * speed / (2.0 * BRAKE_M_S2) + 4.0 * STEP_S * speed + 1e-4,
    );
    if went_m > most_m {
        return Err(format!(
            "it went on for {:.2} mm, {:.2} mm are needed to brake",
            1e3 * went_m,
            1e3 * most_m
        ));
    }
    if arrived(m, bench) { Err("it went on to its target".into()) } else { Ok(()) }
}

fn way(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = start(m, text, WAY_M)?;
    bench.go(m.run);
    bench.until_phase(Phase::Moving, 0.1)?;
    near("the payload", bench.robot().payload_kg, m.payload_kg, 1e-6)?;
    for i in 0..3 {
        near(
            "the centre of gravity",
            1e3 * bench.robot().centre_of_gravity_m[i],
            m.centre_of_gravity_mm[i],
            1e-3,
        )?;
        near("the grip centre", 1e3 * bench.robot().tool_m[i], m.tool_mm[i], 1e-3)?;
    }
    let (mut fastest, mut before, mut hardest) = (0.0_f64, bench.arm().speed_m_s(), 0.0_f64);
    let most = ((2.0 * WAY_M / (1e-3 * m.speed_mm_s) + 3.0) / STEP_S) as u64;
    let mut k = 0;
    while bench.phase() == Some(Phase::Moving) && k < most {
        bench.step()?;
        let speed = bench.arm().speed_m_s();
        (fastest, hardest, before) = (fastest.max(speed), hardest.max((speed - before) / STEP_S), speed);
        k += 1;
    }
    bench.stops_for(StopReason::Arrived, 0.5)?;
    if !arrived(m, &bench) {
        return Err(format!("it says that it has arrived at {:?}", bench.robot().tcp.numbers()));
    }
    // From rest to rest with the program's acceleration it becomes no faster.
    let reached_mm_s = 1e3 * (0.5 * WAY_M).sqrt().min(1e-3 * m.speed_mm_s);
    if 1e3 * fastest > m.speed_mm_s + 0.01 || 1e3 * fastest < 0.9 * reached_mm_s {
        return Err(format!("its speed is {:.1} mm/s, not {} mm/s", 1e3 * fastest, m.speed_mm_s));
    }
    if hardest > MOST_M_S2 {
        return Err(format!("it accelerates with {hardest:.2} m/s^2"));
    }
    if bench.phases != [Phase::Started, Phase::Moving, Phase::Braking, Phase::Stopped] {
        return Err(format!("its phases are {:?}", bench.phases));
    }
    bench.acknowledge()
}

fn force(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = moving(m, text, WAY_M)?;
    bench.arm_mut().hang(0.8 * m.abort_force_n / GRAVITY_M_S2);
    bench.steps(0.02)?;
    if bench.phase() != Some(Phase::Moving) {
        return Err(format!("{:.1} N broke it off", 0.8 * m.abort_force_n));
    }
    bench.arm_mut().hang(1.2 * m.abort_force_n / GRAVITY_M_S2);
    bench.steps(2.0 * STEP_S)?;
    broken_off(m, &mut bench, StopReason::Force)?;
    bench.acknowledge()
}

fn force_aside(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = moving(m, text, WAY_M)?;
    bench.arm_mut().pull_aside(1.2 * m.abort_force_n);
    bench.steps(2.0 * STEP_S)?;
    broken_off(m, &mut bench, StopReason::Force)
}

fn time(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = moving(m, text, 1.5e-3 * m.speed_mm_s * m.max_time_s + WAY_M)?;
    let took_s = bench.stops_for(StopReason::Time, m.max_time_s + 0.5)? + 0.1;
    near(
        "the time of the way",
        took_s,
        m.max_time_s,
        0.05 + 1e-3 * m.max_time_s + 1e-3 * m.speed_mm_s / BRAKE_M_S2,
    )
}

fn host_stops(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = moving(m, text, WAY_M)?;
    bench.go(0);
    broken_off(m, &mut bench, StopReason::Host)?;
    bench.until("its end", 0.02, Bench::is_over)?;
    bench.rests("after the host took its go back")
}

fn host_stops_waiting(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = start(m, text, WAY_M)?;
    bench.go(registers::STOP);
    bench.stops_for(StopReason::Host, 0.1)?;
    bench.stayed()
}

fn host_dies(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = moving(m, text, WAY_M)?;
    bench.dies_with_the_host()?;
    if arrived(m, &bench) { Err("it went on to its target".into()) } else { Ok(()) }
}

fn nobody_beats(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = start(m, text, WAY_M)?;
    bench.die();
    bench.go(m.run);
    never_begins(&mut bench)
}

fn nobody_says_go(m: &MotionProgram, text: &str) -> Verdict {
    let mut bench = start(m, text, WAY_M)?;
    bench.go(m.run + 1);
    let took_s = bench.stops_for(StopReason::Host, GO_WAIT_S + 0.2)?;
    near("the wait for the go", took_s, GO_WAIT_S, 0.1)?;
    bench.stayed()
}
