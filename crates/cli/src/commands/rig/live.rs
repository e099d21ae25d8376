//! What somebody sees who looks on.

use crate::args::TalkArgs;
use crate::failure::Failure;
use crate::live::{CurvePoint, LivePage, Made, Picture, State};
use crate::output::{JsonSink, count, print, program};
use crate::progress::Progress;
use crate::rig::Standing;
use gripgen::twin::{PerJaw, PlannedPull};
use gripgen_rig::camera::CameraView;
use gripgen_rig::experiment::pull::ExecutedPull;
use gripgen_rig::experiment::{PullOutcome, RigEvent};
use serde_json::json;
use std::path::Path;
use std::time::{Duration, Instant};

/// Time between two redraws of the curve.
const REDRAW: Duration = Duration::from_millis(100);
/// Columns of the curve.
const COLUMNS: usize = 24;
/// Heights of a column.
const BLOCKS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// Progress and curve on standard error, JSON where it was asked for.
pub struct Live {
    progress: Progress,
    sink: JsonSink,
    quiet: bool,
    verbose: bool,
    total: u64,
    done: u64,
    label: String,
    curve: Vec<f64>,
    drawn: Instant,
    page: Option<(LivePage, PerJaw<CameraView>)>,
}

impl Live {
    /// Progress of `total` pulls, of which `todo` are left.
    pub fn new(total: u64, todo: u64, talk: &TalkArgs, sink: JsonSink) -> Self {
        Self {
            progress: Progress::start("pulls", total - todo, total, talk),
            sink,
            quiet: talk.quiet,
            verbose: talk.verbose,
            total,
            done: total - todo,
            label: String::new(),
            curve: Vec::new(),
            drawn: Instant::now(),
            page: None,
        }
    }

    /// Opens a page of this machine and says where.
    pub fn show_on_page(&mut self, port: u16, name: &str, views: PerJaw<CameraView>) -> Result<(), Failure> {
        let page =
            LivePage::open(port, State::new(format!("rig pull {name}"), "pulls", self.done, self.total))?;
        self.say(&format!("live: {}", page.url()));
        self.page = Some((page, views));
        Ok(())
    }

    fn on_page(&self, change: impl FnOnce(&mut State)) {
        if let Some((page, _)) = &self.page {
            page.tell(change);
        }
    }

    /// A line.
    pub fn say(&self, text: &str) {
        if !self.quiet {
            self.progress.say(text);
        }
    }

    /// A pull begins.
    fn begin(&mut self, place: u64, planned: &PlannedPull) {
        self.label = format!("{}/{} {} {} N", place + 1, self.total, planned.part, planned.grip_force_n);
        self.curve.clear();
        self.progress.message(&self.label);
        self.on_page(|state| state.begin(&self.label));
    }

    /// Something happens.
    pub fn event(&mut self, event: &RigEvent) {
        match event {
            RigEvent::PullStarted { place, planned } => self.begin(*place, planned),
            RigEvent::Reconnecting { reason } => {
                self.say(&format!("{reason}; the robot stands still, connecting again"));
            }
            RigEvent::Step(step) => {
                self.progress.message(&format!("{}: {step}", self.label));
                self.on_page(|state| state.now = format!("{}: {step}", self.label));
                if self.verbose {
                    self.say(&format!("{}: {step}", self.label));
                }
            }
            RigEvent::Reading { time_s, desired_n, measured_n, displacement_mm } => {
                self.curve.push(*measured_n);
                let point = CurvePoint {
                    time_s: *time_s,
                    desired_n: *desired_n,
                    measured_n: *measured_n,
                    displacement_mm: *displacement_mm,
                };
                self.on_page(|state| state.reading(point));
                if self.drawn.elapsed() >= REDRAW {
                    self.drawn = Instant::now();
                    let curve = sparkline(&self.curve);
                    self.progress.message(&format!(
                        "{}: {time_s:.1} s, {desired_n:.1} N asked, {measured_n:.1} N, {displacement_mm:.2} mm {curve}",
                        self.label
                    ));
                }
            }
            RigEvent::Frame { jaw, frame } => {
                if let Some((page, views)) = &self.page {
                    page.tell(|state| state.picture(*jaw, Picture::Frame(frame.clone(), *views)));
                }
            }
            RigEvent::Said { source, text } => self.say(&format!("{source}: {text}")),
            _ => {}
        }
    }

    /// A pull is over.
    pub fn pulled(
        &mut self,
        standing: &Standing,
        measured: &ExecutedPull,
        suspect: Option<&str>,
    ) -> Result<(), Failure> {
        let (status, words, force_n) = match &measured.outcome {
            PullOutcome::Labelled(l) if suspect.is_some() => (
                "suspect",
                format!("{:.2} N is suspect: {}", l.max_pull_force_n, suspect.unwrap_or_default()),
                Some(l.max_pull_force_n),
            ),
            PullOutcome::Labelled(l) if l.censored => {
                ("censored", format!("held {:.2} N", l.max_pull_force_n), Some(l.max_pull_force_n))
            }
            PullOutcome::Labelled(l) => {
                ("slipped", format!("slipped at {:.2} N", l.max_pull_force_n), Some(l.max_pull_force_n))
            }
            PullOutcome::NoContact => ("no_contact", "nothing between the jaws".into(), Some(0.0)),
            PullOutcome::Failed { reason } => ("failed", format!("failed: {reason}"), None),
        };
        self.say(&format!("{}: {words} {}", self.label, sparkline(&self.curve)));
        let labelled = !matches!(measured.outcome, PullOutcome::Failed { .. });
        if labelled {
            self.progress.step();
        }
        let reason = if let PullOutcome::Failed { reason } = &measured.outcome { reason } else { "" };
        let made = Made {
            index: standing.index,
            part: measured.planned.part.clone(),
            grip_force_n: measured.planned.grip_force_n,
            status: status.into(),
            label_n: force_n,
            reason: suspect.unwrap_or(reason).into(),
        };
        self.on_page(|state| state.made(made));
        self.sink.line(&json!({
            "event": "pull",
            "index": standing.index,
            "part": measured.planned.part,
            "grip_force_n": measured.planned.grip_force_n,
            "status": status,
            "max_pull_force_n": force_n,
            "time_s": standing.time_s,
            "dwell_s": measured.dwell_s,
            "columns": measured.planned.notes,
            "failure": reason,
            "status_reason": suspect.unwrap_or(reason),
            "still": measured.stopped.as_ref().map(|s| s.still),
        }))
    }

    /// Everything is over.
    pub fn done(&self, folder: &Path, failed: usize, suspect: usize, complete: bool) -> Result<(), Failure> {
        self.progress.finish();
        if self.sink.on_stdout() {
            return Ok(());
        }
        if failed > 0 {
            self.say(&format!(
                "without a label: {}; the same command makes what is missing",
                count(failed as u64, "pull")
            ));
        }
        if suspect > 0 {
            self.say(&format!(
                "{} with a suspect label: kept with the reason (`{} info {}`), and left out of fits and training",
                count(suspect as u64, "pull"),
                program(),
                folder.display()
            ));
        }
        print(&format!("{}\n", folder.display()))?;
        if complete {
            self.say(&format!("next: {} diagnose {}", program(), folder.display()));
        }
        Ok(())
    }
}

/// A curve in a line of text.
fn sparkline(values: &[f64]) -> String {
    let most = values.iter().copied().fold(0.0, f64::max);
    if values.is_empty() || most <= 0.0 {
        return String::new();
    }
    let columns = COLUMNS.min(values.len());
    let column = |i: usize| {
        let piece = &values[i * values.len() / columns..((i + 1) * values.len() / columns)];
        let highest = piece.iter().copied().fold(0.0, f64::max);
        BLOCKS[((highest / most) * 7.0).round().clamp(0.0, 7.0) as usize]
    };
    (0..columns).map(column).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_curve_fits_into_a_line() {
        assert_eq!(sparkline(&[0.0, 1.0, 2.0, 4.0]), "▁▃▅█");
        assert_eq!(sparkline(&[]), "");
        let long: Vec<f64> = (0..1000).map(f64::from).collect();
        assert_eq!(sparkline(&long).chars().count(), COLUMNS);
        assert!(sparkline(&long).starts_with('▁') && sparkline(&long).ends_with('█'));
    }
}
