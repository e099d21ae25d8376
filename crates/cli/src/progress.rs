//! Progress on standard error: a bar on a terminal, a line every ten seconds elsewhere.

use crate::args::TalkArgs;
use crate::output::duration;
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::io::IsTerminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Time between two lines where there is no terminal.
const LINE_EVERY: Duration = Duration::from_secs(10);

/// A bar on a terminal; none elsewhere.
fn bar(total: u64, template: &str, prefix: &'static str, talk: &TalkArgs) -> Option<ProgressBar> {
    (std::io::stderr().is_terminal() && !talk.quiet).then(|| {
        let bar = ProgressBar::with_draw_target(Some(total), ProgressDrawTarget::stderr_with_hz(10));
        bar.set_style(ProgressStyle::with_template(template).expect("the template is a constant"));
        bar.set_prefix(prefix);
        bar
    })
}

/// Progress of a known amount of work.
pub struct Progress {
    unit: &'static str,
    total: u64,
    done_before: u64,
    done: u64,
    start: Instant,
    last_line: Instant,
    bar: Option<ProgressBar>,
    silent: bool,
}

impl Progress {
    /// Starts at `done` of `total` units.
    pub fn start(unit: &'static str, done: u64, total: u64, talk: &TalkArgs) -> Self {
        let template = "{bar:32} {human_pos}/{human_len} {prefix}  {per_sec}  {eta} left {msg}";
        let bar = bar(total, template, unit, talk);
        if let Some(bar) = &bar {
            bar.set_position(done);
            bar.reset_eta();
        }
        let now = Instant::now();
        Self { unit, total, done_before: done, done, start: now, last_line: now, bar, silent: talk.quiet }
    }

    /// One more unit is done.
    pub fn step(&mut self) {
        self.done += 1;
        if let Some(bar) = &self.bar {
            bar.inc(1);
        } else if !self.silent && self.last_line.elapsed() >= LINE_EVERY {
            self.last_line = Instant::now();
            let elapsed = self.start.elapsed().as_secs_f64();
            let rate = (self.done - self.done_before) as f64 / elapsed;
            let left = duration((self.total - self.done) as f64 / rate);
            eprintln!("{}/{} {}, {rate:.1} per second, {left} left", self.done, self.total, self.unit);
        }
    }

    /// Words behind the bar; nothing without one.
    pub fn message(&self, text: &str) {
        if let Some(bar) = &self.bar {
            bar.set_message(text.to_string());
        }
    }

    /// A line that does not disturb the bar.
    pub fn say(&self, text: &str) {
        match &self.bar {
            Some(bar) => bar.suspend(|| eprintln!("{text}")),
            None => eprintln!("{text}"),
        }
    }

    /// Ends the display; returns the time it took.
    pub fn finish(&self) -> Duration {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
        self.start.elapsed()
    }
}

/// Progress of work whose amount is known as a share only. May be told from many threads.
pub struct Share {
    what: &'static str,
    silent: bool,
    start: Instant,
    state: Mutex<(f64, Instant)>,
    bar: Option<ProgressBar>,
}

impl Share {
    /// Starts at nothing.
    pub fn start(what: &'static str, talk: &TalkArgs) -> Self {
        let bar = bar(1000, "{bar:32} {percent} % {prefix}  {eta} left", what, talk);
        let now = Instant::now();
        Self { what, silent: talk.quiet, start: now, state: Mutex::new((0.0, now)), bar }
    }

    /// This share is done. Progress never goes back.
    pub fn at(&self, share: f64) {
        let Ok(mut state) = self.state.lock() else { return };
        state.0 = state.0.max(share.clamp(0.0, 1.0));
        if let Some(bar) = &self.bar {
            bar.set_position((state.0 * 1000.0) as u64);
        } else if !self.silent && state.1.elapsed() >= LINE_EVERY {
            state.1 = Instant::now();
            let elapsed = self.start.elapsed().as_secs_f64();
            let left = duration(elapsed * (1.0 / state.0.max(1e-3) - 1.0));
            eprintln!("{}: {:.0} %, {left} left", self.what, 100.0 * state.0);
        }
    }

    /// The work is done.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}
