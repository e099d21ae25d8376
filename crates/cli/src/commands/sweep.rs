//! `gripgen sweep`: run it, or what is missing of it.

use crate::args::SweepArgs;
use crate::commands::check;
use crate::failure::{Failure, code};
use crate::interrupt::stop_flag;
use crate::live::{LivePage, Made, Picture, State};
use crate::load;
use crate::output::{JsonSink, count, duration, print, program, size};
use crate::outputs::Outputs;
use crate::progress::Progress;
use gripgen::record::{RunFolder, status_name};
use gripgen::tactile::SimdLevel;
use gripgen::twin::Jaw;
use gripgen::twin::config::ImageStorage;
use gripgen::{Project, SweepEvent, SweepOptions, SweepSummary, sweep};
use gripgen_report::{CONTACT_SHEET, contact_sheet};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// Failures that are printed one by one; the rest are in the index.
const FAILURES_SHOWN: u64 = 10;

/// Runs the verb.
pub fn run(args: &SweepArgs) -> Result<u8, Failure> {
    if args.dry_run {
        return check::check(&args.config, args.jobs, &args.json, &args.talk);
    }
    let project = check::load(&args.config)?;
    if !args.allow_constant {
        check::all_varied(&project)?;
    }
    let out = args.out.clone().unwrap_or_else(|| PathBuf::from("runs").join(&project.name));
    let jobs = args.jobs.unwrap_or_else(load::jobs).max(1);
    let options = SweepOptions { jobs, slice: args.slice, simd: simd_level(args)? };
    let mut outputs =
        Outputs::new(args.json.force).reads_config(&args.config.config, &args.config.set).makes_run(&out);
    let json = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let mut watch = Watch::new(args, &project, json);
    watch.out = out.clone();
    if let Some(port) = args.live {
        let page = LivePage::open(port, State::new(format!("sweep {}", project.name), "samples", 0, 0))?;
        watch.say(&format!("live: {}", page.url()));
        watch.page = Some(page);
    }
    watch.warnings = check::of_columns(&project);
    for still in &watch.warnings {
        watch.say(&format!("warning: {still}"));
    }
    let stop = stop_flag("finishing the shards under way");
    let result = sweep(&project, &out, options, stop, |event| watch.on_event(&event));
    let summary = result?;
    watch.finish(&out, &summary)?;
    if summary.interrupted {
        return Ok(code::INTERRUPTED);
    }
    Ok(if summary.failed > 0 { code::SAMPLES_FAILED } else { 0 })
}

fn simd_level(args: &SweepArgs) -> Result<SimdLevel, Failure> {
    let Some(name) = &args.simd else { return Ok(SimdLevel::best()) };
    let level = SimdLevel::from_name(name).filter(|level| SimdLevel::available().contains(level));
    level.ok_or_else(|| {
        Failure::usage(format!("--simd {name}: this processor has {:?}", SimdLevel::available()))
    })
}

/// Turns events into progress, warnings and JSON lines.
struct Watch<'a> {
    args: &'a SweepArgs,
    project: &'a Project,
    json: JsonSink,
    progress: Option<Progress>,
    /// A JSON line that could not be written; reported at the end, the run goes on.
    json_failure: Option<Failure>,
    failures: u64,
    bytes: u64,
    made: u64,
    page: Option<LivePage>,
    out: PathBuf,
    /// What the sweep leaves at one value, for the JSON lines.
    warnings: Vec<String>,
}

impl<'a> Watch<'a> {
    fn new(args: &'a SweepArgs, project: &'a Project, json: JsonSink) -> Self {
        Self {
            args,
            project,
            json,
            progress: None,
            json_failure: None,
            failures: 0,
            bytes: 0,
            made: 0,
            page: None,
            out: PathBuf::new(),
            warnings: Vec::new(),
        }
    }

    fn line(&mut self, value: &Value) {
        if let Err(e) = self.json.line(value) {
            self.json_failure.get_or_insert(e);
        }
    }

    /// What the page shows of an event.
    fn on_page(&self, event: &SweepEvent) {
        let Some(page) = &self.page else { return };
        match event {
            SweepEvent::Planned { samples, done, .. } => page.tell(|state| state.plan(*done, *samples)),
            SweepEvent::Sample { index, status, failure, part, grip_force_n, label_n } => {
                let made = Made {
                    index: *index,
                    part: part.clone(),
                    grip_force_n: *grip_force_n,
                    status: status_name(*status).into(),
                    label_n: *label_n,
                    reason: failure.clone(),
                };
                page.tell(|state| state.made(made));
            }
            SweepEvent::Shard { shard, .. } if self.project.sweep.images != ImageStorage::None => {
                let path = self.out.join(format!("shard-{shard:05}.mcap"));
                page.tell(|state| {
                    for jaw in Jaw::BOTH {
                        state.picture(jaw, Picture::Shard(path.clone()));
                    }
                });
            }
            _ => {}
        }
    }

    fn on_event(&mut self, event: &SweepEvent) {
        self.on_page(event);
        match event {
            SweepEvent::Planned { samples, done, shards } => {
                self.line(&json!({
                    "event": "plan", "name": self.project.name, "samples": samples, "done": done, "shards": shards,
                    "config_sha256": self.project.config_sha256,
                }));
                for warning in std::mem::take(&mut self.warnings) {
                    self.line(&json!({"event": "warning", "warning": warning}));
                }
                if !self.args.talk.quiet {
                    if *done > 0 {
                        eprintln!(
                            "{}: {done} of {} are there already",
                            self.project.name,
                            count(*samples, "sample")
                        );
                    } else {
                        eprintln!(
                            "{}: {} in {}",
                            self.project.name,
                            count(*samples, "sample"),
                            count(*shards, "shard")
                        );
                    }
                }
                self.progress = Some(Progress::start("samples", *done, *samples, &self.args.talk));
            }
            SweepEvent::Sample { index, status, failure, .. } => {
                self.made += 1;
                if !failure.is_empty() {
                    self.failures += 1;
                    self.line(&json!({"event": "sample_failed", "index": index, "reason": failure}));
                    if self.failures <= FAILURES_SHOWN {
                        self.say(&format!("warning: sample {index} failed: {failure}"));
                    }
                } else if self.args.talk.verbose {
                    self.say(&format!("sample {index}: {}", status_name(*status)));
                }
                if let Some(progress) = &mut self.progress {
                    progress.step();
                }
            }
            SweepEvent::Shard { shard, bytes, failed } => {
                self.bytes += bytes;
                self.line(&json!({"event": "shard", "shard": shard, "bytes": bytes, "failed": failed}));
            }
            SweepEvent::Gpu { adapter, another } => {
                self.line(&json!({"event": "gpu", "adapter": adapter.to_string()}));
                self.say(&format!("images by {adapter}"));
                if let Some(another) = another {
                    self.say(&format!(
                        "warning: what is there was made by {another}; images are equal within the tolerance of the \
                         gpu backend, not to the bit"
                    ));
                }
            }
            SweepEvent::Waiting { shards } => {
                self.line(&json!({"event": "waiting", "shards": shards}));
                self.say(&format!("waiting for {} that another process is writing", count(*shards, "shard")));
            }
        }
    }

    fn say(&self, text: &str) {
        if self.args.talk.quiet {
            return;
        }
        match &self.progress {
            Some(progress) => progress.say(text),
            None => eprintln!("{text}"),
        }
    }

    fn finish(mut self, out: &Path, summary: &SweepSummary) -> Result<(), Failure> {
        let took = self.progress.take().map_or(0.0, |p| p.finish().as_secs_f64());
        let sheet = out.join(CONTACT_SHEET);
        if summary.complete && (self.made > 0 || !sheet.exists()) {
            let folder = RunFolder::open(out)?;
            folder.publish(CONTACT_SHEET, &contact_sheet(&folder).map_err(Failure::new)?)?;
        }
        self.line(&json!({
            "event": "done", "out": out, "samples": summary.samples, "failed": summary.failed,
            "censored": summary.censored, "no_contact": summary.no_contact, "suspect": summary.suspect,
            "interrupted": summary.interrupted, "complete": summary.complete, "seconds": took,
        }));
        if !self.args.talk.quiet {
            self.tell(out, summary, took);
        }
        if !self.json.on_stdout() {
            print(&format!("{}\n", out.display()))?;
        }
        self.json_failure.map_or(Ok(()), Err)
    }

    fn tell(&self, out: &Path, summary: &SweepSummary, took: f64) {
        if self.failures > FAILURES_SHOWN {
            eprintln!("warning: {} more samples failed", self.failures - FAILURES_SHOWN);
        }
        if self.made > 0 {
            let rate = self.made as f64 / took.max(1e-9);
            eprintln!(
                "{} in {} ({rate:.0} per second), {} written",
                count(self.made, "sample"),
                duration(took),
                size(self.bytes)
            );
        }
        if summary.failed > 0 {
            eprintln!(
                "{} of {} samples failed; why is in the column `failure` of index.csv",
                summary.failed, summary.samples
            );
        }
        for (n, what) in [
            (summary.no_contact, "missed the part (label 0)"),
            (summary.censored, "ended before the jaws slipped (label is a lower bound)"),
            (
                summary.suspect,
                "are suspect: their trace contradicts their label (column `failure` of index.csv)",
            ),
        ] {
            if n > 0 {
                eprintln!("{n} of {} samples {what}", summary.samples);
            }
        }
        if summary.interrupted {
            eprintln!("stopped at {} samples; run the same command again to continue", summary.samples);
        } else if summary.complete {
            eprintln!(
                "look at {}, or at one sample with: {} show {} 0",
                out.join(CONTACT_SHEET).display(),
                program(),
                out.display()
            );
        } else {
            eprintln!("this piece is done; index.csv follows when all pieces are");
        }
    }
}
