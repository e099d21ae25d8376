//! `gripgen rig rehearse`: what the rig is like today, on one page.

use crate::args::RigRehearseArgs;
use crate::failure::{Failure, code};
use crate::interrupt::stop_flag;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::rig::{RigEvent, StoredRehearsal, load_rig, plan_rehearsal, rehearsal_text, rehearse_rig};
use gripgen_rig::experiment::rehearse::{REHEARSED_N, Rehearsal};
use gripgen_rig::experiment::slowing::TRAILS_N;
use std::fmt::Write;

/// Runs the verb.
pub fn run(args: &RigRehearseArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads_config(&args.rig, &args.set);
    outputs.allow(&args.out)?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let config = load_rig(&args.rig, &args.set)?;
    let plan = plan_rehearsal(&config, &args.rig, args.part.clone(), args.grip_force_n, args.dwell_s)?;
    let quiet = args.talk.quiet || sink.on_stdout();
    let mut emit = |event| {
        if let RigEvent::Step(step) = event
            && !quiet
        {
            eprintln!("{step}");
        }
    };
    let stored = rehearse_rig(&config, &plan, stop_flag("stopping the robot safely"), &mut emit)?;
    outputs.write(&args.out, rehearsal_text(&stored)?.as_bytes())?;
    sink.document(&serde_json::to_value(&stored).map_err(Failure::new)?)?;
    if !sink.on_stdout() {
        print(&page(&stored))?;
    }
    Ok(if stored.doubts.is_empty() { 0 } else { code::SAMPLES_FAILED })
}

/// Everything on one page.
fn page(stored: &StoredRehearsal) -> String {
    let Rehearsal { rest, response, .. } = &stored.rehearsal;
    let r = &stored.rehearsal;
    let mut page = String::new();
    let mut line = |what: &str, found: String| _ = writeln!(page, "{what:<20} {found}");
    for (what, found) in &stored.checks {
        line(what, found.clone());
    }
    let [x, y, z] = rest.noise_n;
    line("noise", format!("{x:.3}, {y:.3}, {z:.3} N of a reading along x, y, z"));
    line("zero", format!("{:.3} N after zeroing, {:.2} N were zeroed away", rest.zero_error_n, rest.raw_z_n));
    line("drift", format!("{:.3} N in {:.1} s without a load", rest.drift_n, rest.dwell_s));
    line(
        "in air",
        format!("{:.1} mm/s at most, {:.2} mm beyond the stop", r.air_speed_mm_s, r.air_overshoot_mm),
    );
    line("grip", format!("{:.1} N per jaw asked, {:.1} N reported", r.grip_force_n, r.reported_force_n));
    line("clamping", format!("{:.2} N along the pull, {:.2} N across it", r.preload_n, r.lateral_n));
    if let Some(response) = response {
        let (force, tool) = (response.force, response.displacement);
        line(
            "force mode",
            format!("dead time {:.3} s, time constant {:.3} s (of the tool)", tool.dead_s, tool.lag_s),
        );
        line(
            "force that is read",
            format!(
                "dead time {:.3} s, time constant {:.3} s, gain {:.3}",
                force.dead_s, force.lag_s, force.gain
            ),
        );
        line("sensor", format!("{:.3} s behind the tool", response.sensor_s));
        line(
            "steps",
            format!(
                "{:.2} N beyond a step, {:.2} N from it at its end, up to {REHEARSED_N} N",
                response.overshoot_n, response.deadband_n
            ),
        );
        let trails_s = force.trails_s();
        if trails_s > 1e-4 {
            line("staircase", format!("up to {:.2} N/s trail by {TRAILS_N} N at most", TRAILS_N / trails_s));
        }
    }
    for (what, clock) in [
        ("robot clock", r.robot_clock),
        ("left clock", r.camera_clock.left),
        ("right clock", r.camera_clock.right),
    ] {
        let words = clock.map_or("has no stamps".into(), |c| {
            format!(
                "{:.5} s per second here, over {:.1} s, at most {:.1} ms late",
                c.rate,
                c.over_s,
                1e3 * c.late_s
            )
        });
        line(what, words);
    }
    if stored.doubts.is_empty() {
        line("pulls", "nothing speaks against them".into());
    }
    for doubt in &stored.doubts {
        line("BAD", doubt.clone());
    }
    page
}
