//! `gripgen rig rehearse`: what the rig is like today, on one page.

use crate::rig::load_rig;
use crate::rig::programs::judged;
use crate::args::RigRehearseArgs;
use crate::failure::{Failure, code};
use crate::interrupt::stop_flag;
use crate::mark::Format;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use gripgen::{VERSION, plain_campaign};
use gripgen_rig::experiment::check::{CheckLine, check};
use gripgen_rig::experiment::prepare::Permit;
use gripgen_rig::experiment::rehearse::{REHEARSED_N, Rehearsal, SCHEMA, StoredRehearsal};
use gripgen_rig::experiment::slowing::TRAILS_N;
use gripgen_rig::experiment::{Devices, Experiment, RigEvent, check_campaign};
use std::fmt::Write;
use std::time::SystemTime;

/// Runs the verb.
pub fn run(args: &RigRehearseArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::of("rig rehearse", args.json.force).reads_config(&args.rig, &args.set);
    outputs.allow(&args.out)?;
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let config = load_rig(&args.rig, &args.set)?;
    let Some(part) = args.part.clone().or_else(|| config.poses.keys().next().cloned()) else {
        return Err(Failure::usage(format!("{}: no pose is taught", args.rig))
            .hint("move the tool to a part by hand, then `gripgen rig teach NAME`"));
    };
    if !(0.5..=3600.0).contains(&args.dwell_s) {
        return Err(Failure::usage(format!("--dwell-s: {} s, it must be from 0.5 to 3600 s", args.dwell_s)));
    }
    let campaign = plain_campaign(std::slice::from_ref(&part), &[args.grip_force_n], 1, 0);
    check_campaign(&config, &campaign)
        .map_err(|e| Failure::usage(e).hint("nothing was sent and nothing moved"))?;
    judged(&config, &campaign).map_err(|e| Failure::new(e).hint("nothing was sent and nothing moved"))?;
    let mut lines: Vec<CheckLine> = Vec::new();
    check(&config, |line| lines.push(line));
    if let Some(bad) = lines.iter().find(|line| !line.ok) {
        return Err(Failure::new(format!("{}: {}", bad.what, bad.found))
            .hint("`gripgen rig check` says all; nothing was moved"));
    }
    let stop = stop_flag("stopping the robot safely");
    let mut devices = Devices::connect(&config).map_err(Failure::new)?;
    devices.prepare(Permit::default()).map_err(Failure::new)?;
    let quiet = args.talk.quiet || sink.on_stdout();
    let mut emit = |event| {
        if let RigEvent::Step(step) = event
            && !quiet
        {
            eprintln!("{step}");
        }
    };
    let mut experiment = Experiment::new(&config, devices, stop, &mut emit);
    let made = experiment.begin().and_then(|()| experiment.rehearse(&part, args.grip_force_n, args.dwell_s));
    let rehearsal = match made {
        Ok(rehearsal) => rehearsal,
        Err(fault) => {
            let stopped = experiment.safe_stop(&fault);
            let rest = if stopped.still {
                "the robot stands still"
            } else {
                "NOBODY KNOWS WHETHER THE ROBOT STANDS STILL"
            };
            return Err(Failure::new(format!("{}; {rest}, the gripper keeps what it holds", stopped.reason)));
        }
    };
    experiment.close();
    let since = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    let stored = StoredRehearsal {
        schema: SCHEMA.into(),
        gripgen_version: VERSION.into(),
        unix_s: since.map_or(0.0, |since| since.as_secs_f64()),
        checks: lines.into_iter().map(|line| (line.what.to_string(), line.found)).collect(),
        doubts: rehearsal.doubts(&config),
        rehearsal,
    };
    let mut text = serde_json::to_string_pretty(&stored).map_err(Failure::new)?;
    text.push('\n');
    outputs.write(&args.out, Format::Json, text.as_bytes())?;
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
