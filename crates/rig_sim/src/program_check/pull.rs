//! Trials of a pull.

use super::bench::{Bench, Verdict, near};
use crate::arm::STEP_S;
use crate::spring::Spring;
use gripgen_rig::program::{
    HEARTBEAT_WAIT_S, PRELOAD_S, Phase, PullProgram, SETTLE_S, StopReason, TcpPose, registers,
};

type Trial = fn(&PullProgram, &str) -> Verdict;

/// What is tried, by its name.
pub(super) const TRIALS: [(&str, Trial); 13] = [
    ("a part slips", slips),
    ("nothing is between the jaws", air),
    ("the tool is pushed back", pushed_back),
    ("the part holds", holds),
    ("too much force", force),
    ("too much torque", torque),
    ("the tool is pushed aside", aside),
    ("the host takes its go back", host_stops),
    ("the host says stop before the pull", host_stops_waiting),
    ("the host dies", host_dies),
    ("the host dies while it waits", host_dies_waiting),
    ("nobody beats", nobody_beats),
    ("nobody says go", nobody_says_go),
];

const START: TcpPose = TcpPose { position_m: [0.4, 0.1, 0.25], rotation_rad: [0.0, 3.1, 0.0] };
/// Longest waits that are tried.
const LONGEST_WAIT_S: f64 = 300.0;
const GRAVITY_M_S2: f64 = 9.806_65;
/// More than any program applies.
const STRONG: Spring = Spring { limit_n: 1e6, ..Spring::PLAIN };
/// What hangs on the tool when the sensor is zeroed, and what is added when the jaws close.
const TARE_KG: f64 = 0.1;
const PRELOAD_KG: f64 = 0.05;

fn start(p: &PullProgram, text: &str, spring: Spring) -> Result<Bench, String> {
    Bench::start(spring, START, p.tool_mm, p.run, text)
}

/// Up to the wait for the go.
fn zeroed(p: &PullProgram, text: &str, spring: Spring) -> Result<Bench, String> {
    let mut bench = start(p, text, spring)?;
    bench.until_phase(Phase::Zeroed, 2.0)?;
    Ok(bench)
}

/// Up to the first step.
fn pulling(p: &PullProgram, text: &str, spring: Spring, part: bool) -> Result<Bench, String> {
    let mut bench = zeroed(p, text, spring)?;
    if part {
        bench.close_jaws()?;
    }
    bench.go(p.run);
    bench.until_phase(Phase::Pulling, 1.0)?;
    Ok(bench)
}

fn moved_m(p: &PullProgram, bench: &Bench) -> f64 {
    p.direction * (bench.robot().tcp.position_m[2] - START.position_m[2])
}

/// Command of a step, from 1.
fn command_n(p: &PullProgram, step: i32) -> f64 {
    p.start_n + f64::from(step - 1) * p.increment_n
}

/// How long a staircase is on its way to this force.
fn time_to_s(p: &PullProgram, force_n: f64) -> f64 {
    ((force_n - p.start_n) / p.increment_n).max(0.0).floor() * p.step_s + p.step_s
}

/// What a step of the staircase says and asks for, `tick` control steps after the first.
fn stair(p: &PullProgram, bench: &Bench, tick: u64) -> Verdict {
    let step = bench.int(registers::STEP);
    // A controller rounds a step to its own.
    let about = |ticks: f64| ((tick as f64 + ticks) * STEP_S / p.step_s).floor() as i32 + 1;
    if !(about(-1.01)..=about(1.01)).contains(&step) {
        return Err(format!("step {step} after {:.3} s", tick as f64 * STEP_S));
    }
    near("the command that it says", bench.double(registers::DESIRED_FORCE), command_n(p, step), 1e-6)?;
    let Some(mode) = bench.arm().force_command() else { return Err("it pulls without force mode".into()) };
    if mode.compliant != [false, false, true, false, false, false] {
        return Err(format!("axes that give way: {:?}", mode.compliant));
    }
    near("the force that it applies", mode.wrench[2], p.direction * command_n(p, step), 1e-6)?;
    near(
        "force and torque beside the pull",
        mode.wrench.iter().map(|x| x.abs()).sum::<f64>(),
        command_n(p, step),
        1e-6,
    )?;
    near("the speed limit along the pull", 1e3 * mode.limits[2], p.speed_mm_s, 1e-6)?;
    for i in [0, 1] {
        near("the deviation across the pull", 1e3 * mode.limits[i], p.lateral_mm, 1e-6)?;
    }
    if !mode.limits[3..].iter().all(|rad| (0.005..=0.1).contains(rad)) {
        return Err(format!("deviations in angle: {:?} rad", &mode.limits[3..]));
    }
    for i in 0..3 {
        near("the frame of the force", mode.frame[i], START.position_m[i], 1e-3)?;
        near("the turn of the frame", mode.frame[3 + i], 0.0, 1e-9)?;
    }
    let (damping, gain) = bench.arm().force_settings();
    near("the damping", damping, 0.025, 1e-9)?;
    near("the gain", gain, 0.5, 1e-9)
}

fn slips(p: &PullProgram, text: &str) -> Verdict {
    let limit_n = p.start_n.max(0.25 * p.max_force_n) + 0.25 * p.increment_n;
    let mut bench = start(p, text, Spring { limit_n, ..Spring::PLAIN })?;
    bench.until_phase(Phase::Started, 0.02)?;
    // The zero at the start of a program is the controller's; what hangs there since has to be zeroed by the program.
    bench.arm_mut().hang(TARE_KG);
    let took_s = bench.until_phase(Phase::Zeroed, 2.0)?;
    if took_s < 0.4 {
        return Err(format!("the sensor rested {took_s:.2} s"));
    }
    bench.step()?;
    near("the zeroed force", bench.robot().wrench[2], 0.0, 0.02)?;
    near("the payload", bench.robot().payload_kg, p.payload_kg, 1e-6)?;
    for i in 0..3 {
        near(
            "the centre of gravity",
            1e3 * bench.robot().centre_of_gravity_m[i],
            p.centre_of_gravity_mm[i],
            1e-3,
        )?;
        near("the grip centre", 1e3 * bench.robot().tool_m[i], p.tool_mm[i], 1e-3)?;
    }
    // Jaws close; a go for another run is none.
    bench.close_jaws()?;
    bench.arm_mut().hang(TARE_KG + PRELOAD_KG);
    bench.arm_mut().pull_aside(2.0);
    bench.go(p.run + 1);
    bench.steps(0.3)?;
    if bench.phase() != Some(Phase::Zeroed) {
        return Err(format!("it went on to {:?} without its go", bench.phase()));
    }
    bench.rests("before the go")?;
    bench.go(p.run);
    let mut before_s = 0.0;
    while bench.phase() != Some(Phase::Pulling) {
        if before_s > 1.0 {
            return Err("phase Pulling did not come within 1 s of the go".into());
        }
        bench.rests("before the pull")?;
        bench.step()?;
        before_s += STEP_S;
    }
    near("the time from the go to the pull", before_s, PRELOAD_S + SETTLE_S, 0.02)?;
    let load_n = -PRELOAD_KG * GRAVITY_M_S2;
    near("the preload", bench.double(registers::PRELOAD), p.direction * load_n, 0.02)?;
    let mut tick = 0;
    let mut before_m = 0.0;
    while bench.phase() == Some(Phase::Pulling) {
        stair(p, &bench, tick)?;
        near(
            "the displacement that it says",
            1e3 * bench.double(registers::DISPLACEMENT),
            1e3 * before_m,
            0.001,
        )?;
        near("the displacement aside", 1e3 * bench.double(registers::LATERAL), 0.0, 0.001)?;
        // What the program says is from before the step that it commands.
        before_m = moved_m(p, &bench);
        bench.step()?;
        tick += 1;
        if tick as f64 * STEP_S > time_to_s(p, limit_n) + 2.0 {
            return Err("the pull goes on after the part has slipped".into());
        }
    }
    let expected_s = time_to_s(p, limit_n) + 1e-3 * p.stop_mm / Spring::PLAIN.sliding_m_s;
    near("the time of the pull", tick as f64 * STEP_S, expected_s, 0.03)?;
    bench.stops_for(StopReason::Displacement, 0.3)?;
    let over_mm = 1e3 * moved_m(p, &bench) - p.stop_mm;
    if !(0.0..0.3).contains(&over_mm) {
        return Err(format!("the tool stands {over_mm:.3} mm beyond the stop"));
    }
    if bench.phases != [Phase::Started, Phase::Zeroed, Phase::Pulling, Phase::Braking, Phase::Stopped] {
        return Err(format!("its phases are {:?}", bench.phases));
    }
    bench.acknowledge()
}

fn air(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = pulling(p, text, STRONG, false)?;
    let mut fastest = 0.0_f64;
    let mut k = 0;
    while bench.phase() == Some(Phase::Pulling) && k < 10_000 {
        fastest = fastest.max(bench.arm().speed_m_s());
        bench.step()?;
        k += 1;
    }
    near("the speed in air", 1e3 * fastest, p.speed_mm_s, 1e-3 * p.speed_mm_s)?;
    bench.stops_for(StopReason::Displacement, 0.5)?;
    let speed_m_s = 1e-3 * p.speed_mm_s;
    let over_mm = 1e3 * moved_m(p, &bench) - p.stop_mm;
    let most_mm = 1e3 * (4.0 * STEP_S * speed_m_s + speed_m_s * speed_m_s / 4.0);
    if !(0.0..=most_mm).contains(&over_mm) {
        return Err(format!(
            "the tool stands {over_mm:.3} mm beyond the stop, at most {most_mm:.3} mm are needed to brake"
        ));
    }
    bench.acknowledge()
}

fn pushed_back(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = pulling(p, text, STRONG, false)?;
    bench.arm_mut().push([0.0, 0.0, -p.direction * 1.5e-3 * p.stop_mm]);
    bench.stops_for(StopReason::Displacement, 0.1)?;
    bench.acknowledge()
}

/// Forces just below the one that ends the pull do not end it.
fn holds(p: &PullProgram, text: &str) -> Verdict {
    let gain = 0.95 * p.abort_force_n / p.max_force_n;
    let mut bench = pulling(p, text, Spring { gain, ..STRONG }, true)?;
    let lever_m = 1e-3 * p.tool_mm[2];
    if lever_m > 0.01 {
        bench.arm_mut().pull_aside(0.9 * p.abort_torque_nm / lever_m);
    }
    bench.arm_mut().push([0.8e-3 * p.lateral_mm, 0.0, 0.0]);
    let largest_s = time_to_s(p, p.max_force_n);
    let by_time = p.max_time_s < largest_s - 0.01;
    let (reason, end_s) =
        if by_time { (StopReason::Time, p.max_time_s) } else { (StopReason::LargestCommand, largest_s) };
    let (mut tick, mut largest_n) = (0_u64, 0.0_f64);
    while bench.phase() == Some(Phase::Pulling) && tick as f64 * STEP_S < end_s + 1.0 {
        let applied_n = bench.arm().force_command().map_or(0.0, |mode| mode.wrench[2].abs());
        largest_n = largest_n.max(applied_n);
        bench.step()?;
        tick += 1;
    }
    let took_s = tick as f64 * STEP_S;
    bench.stops_for(reason, 0.5)?;
    near("the time of the pull", took_s, end_s, 0.02 + 1e-3 * end_s)?;
    if largest_n > p.max_force_n + 1e-9 {
        return Err(format!("it applied {largest_n:.2} N, {} N are allowed", p.max_force_n));
    }
    bench.ends_alone()
}

fn force(p: &PullProgram, text: &str) -> Verdict {
    let gain = p.abort_force_n / (0.6 * p.max_force_n);
    let mut bench = pulling(p, text, Spring { gain, ..STRONG }, true)?;
    let most_s = time_to_s(p, 0.6 * p.max_force_n) + p.step_s + 0.5;
    if p.max_time_s < most_s || p.start_n > 0.6 * p.max_force_n {
        return Ok(());
    }
    bench.stops_for(StopReason::Force, most_s)?;
    let felt_n = bench.robot().wrench[2].abs();
    if felt_n < p.abort_force_n - 1e-6 || felt_n > p.abort_force_n + gain * p.increment_n + 1.0 {
        return Err(format!("it stopped at {felt_n:.1} N, not at {} N", p.abort_force_n));
    }
    bench.acknowledge()
}

fn torque(p: &PullProgram, text: &str) -> Verdict {
    let lever_m = 1e-3 * p.tool_mm[2];
    if lever_m <= 0.01 {
        return Ok(());
    }
    let mut bench = pulling(p, text, STRONG, true)?;
    bench.steps(0.02)?;
    bench.arm_mut().pull_aside(1.1 * p.abort_torque_nm / lever_m);
    bench.stops_for(StopReason::Torque, 0.1)?;
    bench.acknowledge()
}

fn aside(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = pulling(p, text, STRONG, true)?;
    bench.steps(0.02)?;
    let by_m = 1.1e-3 * p.lateral_mm;
    bench.arm_mut().push([0.6 * by_m, 0.8 * by_m, 0.0]);
    bench.steps(2.0 * STEP_S)?;
    near("the displacement aside", 1e3 * bench.double(registers::LATERAL), 1e3 * by_m, 0.001)?;
    bench.stops_for(StopReason::Lateral, 0.1)?;
    bench.acknowledge()
}

fn host_stops(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = pulling(p, text, STRONG, true)?;
    bench.steps(0.05)?;
    bench.go(0);
    bench.stops_for(StopReason::Host, 0.1)?;
    bench.until("its end", 0.02, Bench::is_over)?;
    bench.rests("after the host took its go back")
}

fn host_stops_waiting(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = zeroed(p, text, STRONG)?;
    bench.go(registers::STOP);
    bench.stops_for(StopReason::Host, 0.05)?;
    bench.stayed()
}

fn host_dies(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = pulling(p, text, STRONG, true)?;
    bench.steps(0.02)?;
    bench.dies_with_the_host()
}

/// Before and after the sensor is zeroed.
fn host_dies_waiting(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = start(p, text, STRONG)?;
    bench.until_phase(Phase::Started, 0.02)?;
    bench.steps(0.1)?;
    bench.dies_with_the_host()?;
    let mut bench = zeroed(p, text, STRONG)?;
    bench.steps(0.1)?;
    bench.dies_with_the_host()
}

fn nobody_beats(p: &PullProgram, text: &str) -> Verdict {
    let mut bench = start(p, text, STRONG)?;
    bench.die();
    bench.go(p.run);
    never_begins(&mut bench)
}

/// Without a beat nothing happens, and it ends by itself.
pub(super) fn never_begins(bench: &mut Bench) -> Verdict {
    let took_s = bench.stops_for(StopReason::NoHeartbeat, HEARTBEAT_WAIT_S + 0.1)?;
    near("the wait for a beat", took_s, HEARTBEAT_WAIT_S, 0.05)?;
    if bench.phases != [Phase::Started, Phase::Stopped]
        && bench.phases != [Phase::Started, Phase::Braking, Phase::Stopped]
    {
        return Err(format!("its phases without a beat are {:?}", bench.phases));
    }
    bench.stayed()?;
    let payload_kg = bench.robot().payload_kg;
    near("the payload without a beat", payload_kg, crate::controller::PAYLOAD_KG, 0.0)?;
    bench.ends_alone()
}

fn nobody_says_go(p: &PullProgram, text: &str) -> Verdict {
    if p.wait_s > LONGEST_WAIT_S {
        return Ok(());
    }
    let mut bench = zeroed(p, text, STRONG)?;
    let took_s = bench.stops_for(StopReason::Host, p.wait_s + 0.2)?;
    near("the wait for the go", took_s, p.wait_s, 0.05 + 1e-3 * p.wait_s)?;
    bench.stayed()
}
