//! What the page shows.

use gripgen::record::{Dataset, encode_png};
use gripgen::twin::{Jaw, PerJaw};
use gripgen_rig::camera::{CameraFrame, CameraView, SHIPPED_FRAME_LIMITS, decode_jpeg};
use serde_json::{Value, json};
use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Points of the curve of the pull under way: with more, every second is dropped.
const CURVE: usize = 1200;
/// Points of the curve of a pull that was made.
const MADE_CURVE: usize = 80;
/// Pulls that are shown with their curves.
const SHOWN: usize = 24;
/// Labels of the plot of labels over grip force; older ones give way.
const LABELS: usize = 4000;
/// Reasons of pulls that failed or are suspect.
const REASONS: usize = 20;
/// Time between two pictures of a jaw.
const PICTURE_EVERY: Duration = Duration::from_millis(200);

/// One reading of a pull.
#[derive(Debug, Clone, Copy)]
pub struct CurvePoint {
    /// Time since the pull began.
    pub time_s: f64,
    /// Command.
    pub desired_n: f64,
    /// Reading.
    pub measured_n: f64,
    /// Displacement.
    pub displacement_mm: f64,
}

/// A pull or sample that was made.
#[derive(Debug, Clone, Default)]
pub struct Made {
    /// Its place in the run.
    pub index: u64,
    /// Part.
    pub part: String,
    /// Grip force of a jaw.
    pub grip_force_n: f64,
    /// How it ended.
    pub status: String,
    /// Label, where it has one.
    pub label_n: Option<f64>,
    /// Why it failed or is suspect.
    pub reason: String,
}

/// Where a picture comes from.
#[derive(Debug, Clone)]
pub enum Picture {
    /// A frame of a camera, and how it is looked at.
    Frame(Arc<CameraFrame>, PerJaw<CameraView>),
    /// The last sample of a shard.
    Shard(PathBuf),
}

impl Picture {
    /// As a PNG, decoded when the page asks for it; `None` where there is none, or it cannot be read.
    pub fn png(&self, jaw: Jaw) -> Option<Vec<u8>> {
        match self {
            Self::Frame(frame, views) => {
                let frame = decode_jpeg(&frame.jpeg, &SHIPPED_FRAME_LIMITS).ok()?;
                encode_png(&views[jaw].apply(&frame).ok()?).ok()
            }
            Self::Shard(path) => {
                let shard = Dataset::open(path).ok()?;
                let last = shard.table().rows().checked_sub(1)?;
                let [left, right] = shard.images_png(last).ok()??;
                Some(if jaw == Jaw::Left { left } else { right })
            }
        }
    }
}

/// The numbers behind the page.
pub struct State {
    title: String,
    unit: &'static str,
    total: u64,
    done_before: u64,
    done: u64,
    started: Instant,
    /// What is done now, in words.
    pub now: String,
    curve: Vec<CurvePoint>,
    /// One in so many readings is kept.
    every: usize,
    passed: usize,
    made: VecDeque<(Made, Vec<[f64; 2]>)>,
    reasons: VecDeque<Made>,
    counts: Vec<(String, u64)>,
    labels: VecDeque<(String, f64, f64)>,
    /// The newest picture of each jaw, with the number of pictures until then.
    pub pictures: PerJaw<Option<(u64, Picture)>>,
    pictured: PerJaw<Option<Instant>>,
}

impl State {
    /// Of `total` pulls or samples, `done` are there already.
    pub fn new(title: impl Into<String>, unit: &'static str, done: u64, total: u64) -> Self {
        Self {
            title: title.into(),
            unit,
            total,
            done_before: done,
            done,
            started: Instant::now(),
            now: String::new(),
            curve: Vec::new(),
            every: 1,
            passed: 0,
            made: VecDeque::new(),
            reasons: VecDeque::new(),
            counts: Vec::new(),
            labels: VecDeque::new(),
            pictures: PerJaw { left: None, right: None },
            pictured: PerJaw { left: None, right: None },
        }
    }

    /// The work is known: so many, of which some are there.
    pub fn plan(&mut self, done: u64, total: u64) {
        (self.done_before, self.done, self.total, self.started) = (done, done, total, Instant::now());
    }

    /// A pull begins.
    pub fn begin(&mut self, words: impl Into<String>) {
        self.now = words.into();
        self.curve.clear();
        (self.every, self.passed) = (1, 0);
    }

    /// A reading of the pull under way.
    pub fn reading(&mut self, point: CurvePoint) {
        if self.passed.is_multiple_of(self.every) {
            self.curve.push(point);
        }
        self.passed += 1;
        if self.curve.len() >= CURVE {
            let mut place = 0;
            self.curve.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// A pull or sample is over.
    pub fn made(&mut self, made: Made) {
        self.done += u64::from(made.status != "failed" || self.unit == "samples");
        match self.counts.iter_mut().find(|(status, _)| *status == made.status) {
            Some((_, n)) => *n += 1,
            None => self.counts.push((made.status.clone(), 1)),
        }
        if let Some(label_n) = made.label_n {
            push(&mut self.labels, (made.part.clone(), made.grip_force_n, label_n), LABELS);
        }
        if !made.reason.is_empty() {
            push(&mut self.reasons, made.clone(), REASONS);
        }
        let step = self.curve.len().div_ceil(MADE_CURVE).max(1);
        let curve = self.curve.iter().step_by(step).map(|p| [p.time_s, p.measured_n]).collect();
        push(&mut self.made, (made, curve), SHOWN);
    }

    /// A picture of a jaw, if the last one is old enough.
    pub fn picture(&mut self, jaw: Jaw, picture: Picture) {
        let old = self.pictured[jaw].is_none_or(|at| at.elapsed() >= PICTURE_EVERY);
        if old {
            let number = self.pictures[jaw].as_ref().map_or(0, |(number, _)| *number) + 1;
            self.pictures[jaw] = Some((number, picture));
            self.pictured[jaw] = Some(Instant::now());
        }
    }

    /// As the page reads it.
    pub fn to_json(&self) -> Value {
        let (passed_s, new) = (self.started.elapsed().as_secs_f64(), self.done - self.done_before);
        let per_s = new as f64 / passed_s.max(1e-3);
        let left_s = (new > 0).then(|| (self.total - self.done.min(self.total)) as f64 / per_s);
        let column = |of: fn(&CurvePoint) -> f64| self.curve.iter().map(|p| round(of(p))).collect::<Vec<_>>();
        let words = |made: &Made| {
            json!({
                "index": made.index, "part": made.part, "grip_force_n": made.grip_force_n, "status": made.status,
                "label_n": made.label_n.map(round), "reason": made.reason,
            })
        };
        let made = self.made.iter().rev().map(|(made, curve)| {
            let mut row = words(made);
            row["curve"] = json!(curve.iter().map(|p| p.map(round)).collect::<Vec<_>>());
            row
        });
        let labels = self
            .labels
            .iter()
            .map(|(part, force_n, label_n)| json!([part, round(*force_n), round(*label_n)]));
        let pictures =
            [&self.pictures.left, &self.pictures.right].map(|p| p.as_ref().map_or(0, |(number, _)| *number));
        json!({
            "schema": "gripgen.live/1", "title": self.title, "unit": self.unit, "total": self.total, "done": self.done,
            "per_s": per_s, "left_s": left_s, "now": self.now,
            "counts": self.counts.iter().map(|(s, n)| json!([s, n])).collect::<Vec<_>>(),
            "curve": {
                "time_s": column(|p| p.time_s), "desired_n": column(|p| p.desired_n),
                "measured_n": column(|p| p.measured_n), "displacement_mm": column(|p| p.displacement_mm),
            },
            "made": made.collect::<Vec<_>>(),
            "reasons": self.reasons.iter().rev().map(words).collect::<Vec<_>>(),
            "labels": labels.collect::<Vec<_>>(),
            "pictures": pictures,
        })
    }
}

fn round(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

fn push<T>(queue: &mut VecDeque<T>, value: T, most: usize) {
    if queue.len() >= most {
        queue.pop_front();
    }
    queue.push_back(value);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn memory_is_bounded_and_counts_are_not() {
        let mut state = State::new("t", "pulls", 2, 20_000);
        for index in 0..10_000 {
            state.begin("pulling");
            for k in 0..if index == 9_999 { 100_000 } else { 3 } {
                let time_s = f64::from(k) * 0.002;
                state.reading(CurvePoint {
                    time_s,
                    desired_n: time_s,
                    measured_n: time_s,
                    displacement_mm: 0.0,
                });
            }
            let failed = index % 10 == 0;
            state.made(Made {
                index,
                part: "gear".into(),
                grip_force_n: 20.0,
                status: if failed { "failed" } else { "slipped" }.into(),
                label_n: (!failed).then_some(6.0),
                reason: if failed { "because".into() } else { String::new() },
            });
        }
        let json = state.to_json();
        assert_eq!((json["done"].as_u64(), json["total"].as_u64()), (Some(9_002), Some(20_000)));
        assert_eq!(json["counts"], json!([["failed", 1000], ["slipped", 9000]]));
        assert_eq!(json["made"].as_array().unwrap().len(), SHOWN);
        assert_eq!(json["made"][0]["index"], 9_999, "newest first");
        assert_eq!(json["reasons"].as_array().unwrap().len(), REASONS);
        assert_eq!(json["labels"].as_array().unwrap().len(), LABELS);
        // A long pull keeps its first and its last second.
        let times = json["curve"]["time_s"].as_array().unwrap();
        assert!((CURVE / 2..CURVE).contains(&times.len()), "{}", times.len());
        assert_eq!(times[0], 0.0);
        assert!(times.last().unwrap().as_f64().unwrap() > 199.0);
    }
}
