//! What a robot says while it is watched, and whether an experiment can be made with that.

use crate::experiment::config::RigConfig;
use crate::experiment::robot::{RATE_HZ, RobotRow};
use crate::rtde::{Event, RtdeClient};
use std::time::{Duration, Instant};

/// Largest difference between the robot's clock and this machine's, as a share: in a second and a half a reading may be late by some
/// hundredths of a second, and no controller's clock is off by more than that.
const CLOCK_SHARE: f64 = 0.1;
/// Messages of the controller that are repeated.
const SHOWN: usize = 2;

/// A time of watching.
pub(super) struct Watch {
    pub(super) rows: Vec<RobotRow>,
    version: Option<[u32; 4]>,
    /// Warnings and errors that the controller said.
    said: Vec<String>,
    /// Why the connection ended, where it did.
    pub(super) ended: Option<String>,
    began: Instant,
    over: Instant,
}

/// Watches until `rows` readings have come, the connection ends, or the time is over.
pub(super) fn watch(robot: &RtdeClient, rows: usize, limit: Duration) -> Watch {
    let began = Instant::now();
    let mut watch =
        Watch { rows: Vec::new(), version: None, said: Vec::new(), ended: None, began, over: began };
    while let Some(left) = limit.checked_sub(began.elapsed()) {
        let Ok(event) = robot.events().recv_timeout(left) else { break };
        match event.event {
            Event::ControllerVersion(version) => watch.version = Some(version),
            Event::Data(values) => watch.rows.extend(RobotRow::from_values(event.at, &values)),
            // 3 is information.
            Event::Text { text, source, level: 0..=2 } => watch.said.push(format!("{source}: {text}")),
            _ => {}
        }
        if watch.rows.len() >= rows {
            break;
        }
    }
    watch.over = Instant::now();
    watch.ended = robot.ended().map(|end| end.to_string());
    watch
}

impl Watch {
    /// What was found, the worst first, and whether it is good enough.
    pub(super) fn judged(&self, config: &RigConfig, connected_ms: f64) -> (bool, String) {
        let problem = self.problem(config);
        let version = self.version.map_or("unknown".into(), |[a, b, c, d]| format!("{a}.{b}.{c}.{d}"));
        let mut words = problem.clone().map(|problem| problem + "; ").unwrap_or_default();
        words += &format!(
            "controller {version}, connected in {connected_ms:.0} ms, {} of {:.0} readings",
            self.rows.len(),
            self.expected(config)
        );
        if self.rows.len() > 1 {
            let (gap_s, late_s) = gaps(&self.rows);
            words += &format!(
                ", largest gap {:.1} ms by its own clock, which runs at {:.3} s per second here, 99 % arrive within {:.1} ms of the \
                 earliest",
                1e3 * gap_s,
                self.clock_rate().unwrap_or_default(),
                1e3 * late_s
            );
        }
        for said in self.said.iter().take(SHOWN) {
            words += &format!("; it says \"{said}\"");
        }
        (problem.is_none(), words)
    }

    /// Why no experiment can be made with such a stream.
    fn problem(&self, config: &RigConfig) -> Option<String> {
        let watched_s = (self.over - self.began).as_secs_f64();
        if let Some(end) = &self.ended {
            let last = self.rows.last().map_or(self.began, |row| row.at);
            let after_s = last.saturating_duration_since(self.began).as_secs_f64();
            return Some(format!("the connection ended after {after_s:.2} s: {end}"));
        }
        if self.rows.is_empty() {
            return Some(format!("connected, but no reading came within {watched_s:.2} s"));
        }
        let silence = config.patient(Duration::from_secs_f64(config.limits.robot_silence_s));
        if let Some((from, to, time_s)) =
            self.longest_standstill().filter(|(from, to, _)| *to - *from > silence)
        {
            let (stood_s, limit_s) = ((to - from).as_secs_f64(), silence.as_secs_f64());
            let repeats = self.rows.iter().any(|row| row.at > from && row.at < to);
            return Some(match repeats {
                true => format!(
                    "its clock stood at {time_s:.3} s for {stood_s:.2} s while readings came, {limit_s:.2} s are allowed"
                ),
                false => format!("no reading came for {stood_s:.2} s, {limit_s:.2} s are allowed"),
            });
        }
        let limit_s = config.limits.robot_gap_s;
        if let Some(pair) =
            self.rows.windows(2).find(|pair| pair[1].timestamp_s - pair[0].timestamp_s > limit_s)
        {
            let [from_s, to_s] = [0, 1].map(|i: usize| pair[i].timestamp_s);
            return Some(format!(
                "its clock went from {from_s:.3} s to {to_s:.3} s between two readings, {limit_s} s are allowed"
            ));
        }
        let rate = self.clock_rate()?;
        // A virtual rig may be served at another speed.
        let off = (rate - 1.0).abs() > CLOCK_SHARE && !config.is_on_this_machine();
        off.then(|| format!("its clock runs at {rate:.3} s per second here"))
    }

    /// The longest time in which the robot's clock did not go on, and where it stood; the beginning and the end of the watch count.
    fn longest_standstill(&self) -> Option<(Instant, Instant, f64)> {
        let first = self.rows.first()?;
        let (mut longest, mut since, mut time_s) = (None, self.began, first.timestamp_s);
        let mut take = |from: Instant, to: Instant, time_s: f64| {
            let is_longer =
                |(a, b, _): &(Instant, Instant, f64)| to.saturating_duration_since(from) > *b - *a;
            if longest.as_ref().is_none_or(is_longer) {
                longest = Some((from, to.max(from), time_s));
            }
        };
        for (i, row) in self.rows.iter().enumerate() {
            if i == 0 || row.timestamp_s > time_s {
                take(since, row.at, time_s);
                (since, time_s) = (row.at, row.timestamp_s);
            }
        }
        take(since, self.over, time_s);
        longest
    }

    /// Seconds of the robot's clock for a second here; `None` where two readings have to come first.
    fn clock_rate(&self) -> Option<f64> {
        let (first, last) = (self.rows.first()?, self.rows.last()?);
        let here_s = last.at.saturating_duration_since(first.at).as_secs_f64();
        (here_s > 0.0).then(|| (last.timestamp_s - first.timestamp_s) / here_s)
    }

    /// Readings that were asked for; by the clock of a virtual rig where that goes evenly at another speed.
    fn expected(&self, config: &RigConfig) -> f64 {
        let is_even = self.ended.is_none() && gaps(&self.rows).0 <= config.limits.robot_gap_s;
        let rate = self.clock_rate().filter(|rate| *rate > CLOCK_SHARE && is_even);
        let rate = rate.filter(|_| config.is_on_this_machine()).unwrap_or(1.0);
        RATE_HZ * rate * (self.over - self.began).as_secs_f64()
    }
}

/// Largest gap in the robot's clock, and how late 99 % of the readings are at most, compared with the earliest, when a constant
/// rate between both clocks is taken out.
fn gaps(rows: &[RobotRow]) -> (f64, f64) {
    let gap_s = rows.windows(2).map(|w| w[1].timestamp_s - w[0].timestamp_s).fold(0.0, f64::max);
    let (Some(first), Some(last)) = (rows.first(), rows.last()) else { return (gap_s, 0.0) };
    let device_s = (last.timestamp_s - first.timestamp_s).max(1e-9);
    let rate = (last.at - first.at).as_secs_f64() / device_s;
    let late: Vec<f64> = rows
        .iter()
        .map(|row| (row.at - first.at).as_secs_f64() - rate * (row.timestamp_s - first.timestamp_s))
        .collect();
    let earliest = late.iter().copied().fold(f64::INFINITY, f64::min);
    let mut late: Vec<f64> = late.iter().map(|x| x - earliest).collect();
    late.sort_by(f64::total_cmp);
    (gap_s, late.get(late.len() * 99 / 100).copied().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::program::TcpPose;
    use gripgen_twin::config::Document;

    /// Readings at these times here and by the robot's clock, watched for a second and a half.
    fn watch_of(times: impl Iterator<Item = (f64, f64)>) -> Watch {
        let began = Instant::now();
        let row = |(at_s, timestamp_s)| RobotRow {
            at: began + Duration::from_secs_f64(at_s),
            timestamp_s,
            tcp: TcpPose { position_m: [0.0; 3], rotation_rad: [0.0; 3] },
            speed: [0.0; 6],
            force: [0.0; 6],
            raw_force: [0.0; 6],
            mode: 7,
            safety: 1,
            safety_bits: 1,
            runtime: 1,
            speed_scaling: 1.0,
            speed_slider: 1.0,
            phase: 0,
            step: 0,
            run: 0,
            reason: 0,
            desired_n: 0.0,
            displacement_m: 0.0,
            lateral_m: 0.0,
            preload_n: 0.0,
        };
        Watch {
            rows: times.map(row).collect(),
            version: Some([5, 12, 0, 1]),
            said: vec![],
            ended: None,
            began,
            over: began + Duration::from_millis(1500),
        }
    }

    fn config(robot: &str) -> RigConfig {
        let mut document =
            Document::parse("rig.toml", include_str!("../../../../../assets/configs/rig.toml")).unwrap();
        document.set("robot.address", robot).unwrap();
        RigConfig::read(&document).unwrap()
    }

    #[test]
    fn a_watch_is_judged_from_its_beginning_to_its_end() {
        let even = |n: u32, every_s: f64| -> Vec<(f64, f64)> {
            (0..n).map(|i| (f64::from(i) * every_s, 40.0 + f64::from(i) * every_s)).collect()
        };
        let with = |change: &dyn Fn(f64, f64) -> (f64, f64)| -> Vec<(f64, f64)> {
            even(750, 0.002).into_iter().map(|(at_s, time_s)| change(at_s, time_s)).collect()
        };
        let of = |times: Vec<(f64, f64)>| watch_of(times.into_iter()).judged(&config("10.0.0.2"), 3.0);
        let (ok, words) = of(even(750, 0.002));
        assert!(
            ok && words.contains("750 of 750 readings") && words.contains("1.000 s per second"),
            "{words}"
        );
        // A quarter of them comes, evenly: the gaps are small enough for a pull, and both numbers are said.
        let (ok, words) = of(even(188, 0.008));
        assert!(ok && words.contains("188 of 750 readings"), "{words}");
        for (name, times, words) in [
            ("paused", even(100, 0.002), "no reading came for 1.30 s, 0.25 s are allowed"),
            ("one", even(1, 0.002), "no reading came for 1.50 s"),
            ("none", even(0, 0.002), "no reading came within 1.50 s"),
            ("late", with(&|at_s, t| (at_s + 0.5, t)), "no reading came for 0.50 s"),
            ("10 Hz", even(15, 0.1), "from 40.000 s to 40.100 s between two readings, 0.02 s are allowed"),
            (
                "frozen",
                with(&|at_s, t| (at_s, t.min(40.04))),
                "stood at 40.040 s for 1.46 s while readings came",
            ),
            (
                "jumped",
                with(&|at_s, t| (at_s, if at_s > 0.6 { t + 1000.0 } else { t })),
                "between two readings, 0.02 s are allowed",
            ),
            ("slow", with(&|at_s, t| (at_s, 40.0 + 0.5 * (t - 40.0))), "runs at 0.500 s per second"),
        ] {
            let (ok, found) = of(times);
            assert!(!ok && found.contains(words), "{name}: {found}");
        }
        // A virtual rig may go at another speed.
        let fast = with(&|at_s, t| (at_s, 40.0 + 5.0 * (t - 40.0)));
        let (ok, words) = watch_of(fast.into_iter()).judged(&config("127.0.0.1"), 3.0);
        assert!(ok && words.contains("runs at 5.000 s per second"), "{words}");
        let closed = Some("10.0.0.2:30004: closed".into());
        let ended = Watch { ended: closed, ..watch_of(even(50, 0.002).into_iter()) };
        let (ok, words) = ended.judged(&config("10.0.0.2"), 3.0);
        assert!(
            !ok && words.starts_with("the connection ended after 0.10 s: 10.0.0.2:30004: closed; "),
            "{words}"
        );
    }
}
