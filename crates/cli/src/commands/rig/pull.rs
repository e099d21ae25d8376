//! `gripgen rig pull`: the experiment, recorded.

use super::live::Live;
use crate::args::RigPullArgs;
use crate::failure::{Failure, code};
use crate::interrupt::stop_flag;
use crate::output::{JsonSink, count, duration, print};
use crate::outputs::Outputs;
use crate::rig::{HowToPull, Permit, PullJob, PullProgress, ask_at_keyboard, load_rig, plan_pulls};
use gripgen_measured::read_campaign;
use gripgen_rig::experiment::plan::pull_program;
use serde_json::json;
use std::path::PathBuf;

/// Runs the verb.
pub fn run(args: &RigPullArgs) -> Result<u8, Failure> {
    let config = load_rig(&args.rig, &args.set)?;
    let campaign = match &args.campaign {
        Some(path) => read_campaign(path).map_err(Failure::usage)?,
        None => plan_pulls(&config, &args.rig, &args.parts, &args.grip_force_n, args.repetitions, args.seed)?,
    };
    let job =
        PullJob::new(config, campaign, args.rehearsal.as_deref())?.with_notes(&args.column, &args.ask)?;
    let (name, out) = (name_of(args), folder_of(args));
    let mut outputs = Outputs::new(args.json.force)
        .reads_config(&args.rig, &args.set)
        .reads_all(&args.campaign)
        .reads_all(&args.after)
        .makes_run(&out);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let pulls = job.pulls();
    if args.print_program {
        let Some(first) = pulls.first() else { return Ok(0) };
        let script = pull_program(&job.config, &job.campaign, first, 1).script().map_err(Failure::usage)?;
        return print(&script).map(|()| 0);
    }
    job.check_programs()?;
    let minutes = job.campaign.estimated_minutes();
    let words = format!("{}, about {}", count(pulls.len() as u64, "pull"), duration(60.0 * minutes));
    if args.dry_run {
        sink.line(&json!({"event": "checked", "pulls": pulls.len(), "minutes": minutes}))?;
        if !sink.on_stdout() {
            print(&format!("{words}; everything is inside the limits, nothing was sent\n"))?;
        }
        return Ok(0);
    }
    let run = job.open(&name, &out, args.after.as_deref())?;
    let mut live = Live::new(pulls.len() as u64, run.todo() as u64, &args.talk, sink);
    if let Some(port) = args.live {
        live.show_on_page(port, &name, job.config.views())?;
    }
    if run.todo() > 0 {
        if let Some(slowed) = &job.slowed {
            live.say(slowed);
        }
        live.say(&format!("{words}; {} to make, into {}", run.todo(), run.folder().display()));
    }
    let how = HowToPull {
        permit: Permit { power_on: args.power_on, unlock: args.unlock },
        reconnects: args.reconnect,
        frames: args.live.is_some(),
    };
    let mut tell = |progress: PullProgress<'_>| match progress {
        PullProgress::Rig(event) => {
            live.event(&event);
            Ok(())
        }
        PullProgress::Pulled { standing, pull, suspect } => live.pulled(&standing, pull, suspect),
    };
    let made = run.make(how, stop_flag("stopping the robot safely"), &mut ask_at_keyboard, &mut tell)?;
    live.done(run.folder(), made.failed, made.suspect, made.complete)?;
    Ok(if made.failed > 0 || made.suspect > 0 { code::SAMPLES_FAILED } else { 0 })
}

fn name_of(args: &RigPullArgs) -> String {
    let stem = args.campaign.as_ref().and_then(|path| path.file_stem());
    stem.map_or("rig".into(), |stem| stem.to_string_lossy().into_owned())
}

/// The run folder.
fn folder_of(args: &RigPullArgs) -> PathBuf {
    args.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(name_of(args)))
}
