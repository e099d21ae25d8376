//! Listens to a robot's controller over RTDE and says what comes: for a first look at any controller, real or virtual.
//!
//! ```text
//! cargo run -p gripgen-rig --example rtde_receive -- 127.0.0.1:30004 5
//! ```
//!
//! It asks for no input and writes nothing. `--lenient` is for test servers that answer names where types belong, never for a
//! robot.

use gripgen_rig::rtde::{Event, RtdeClient, SessionPlan, Value};
use std::error::Error;
use std::process::ExitCode;
use std::time::{Duration, Instant};

/// What is asked for, how often, and for how long an answer is awaited.
const OUTPUTS: [&str; 8] = [
    "timestamp",
    "actual_TCP_pose",
    "actual_TCP_force",
    "actual_q",
    "robot_mode",
    "safety_mode",
    "runtime_state",
    "speed_scaling",
];
const RATE_HZ: f64 = 125.0;
const TIMEOUT: Duration = Duration::from_secs(5);
/// Data frames further apart than this many periods of the controller's clock have others missing between them.
const GAP_PERIODS: f64 = 1.5;

fn main() -> ExitCode {
    match receive() {
        Ok(()) => ExitCode::SUCCESS,
        Err(e) => {
            eprintln!("error: {e}");
            ExitCode::FAILURE
        }
    }
}

fn receive() -> Result<(), Box<dyn Error>> {
    let mut words: Vec<String> = std::env::args().skip(1).collect();
    let count = words.len();
    words.retain(|word| word != "--lenient");
    let lenient = words.len() < count;
    let [address, seconds] = &words[..] else {
        return Err("usage: rtde_receive ADDRESS:PORT SECONDS [--lenient]".into());
    };
    let (address, wanted) = (address.parse()?, Duration::try_from_secs_f64(seconds.parse()?)?);
    let outputs = OUTPUTS.map(String::from).to_vec();
    let plan = SessionPlan { outputs, frequency_hz: RATE_HZ, inputs: vec![], lenient };
    let client = RtdeClient::connect(address, &plan, TIMEOUT)?;

    let begun = Instant::now();
    let mut seen = Seen::default();
    while let Some(left) = wanted.checked_sub(begun.elapsed()) {
        let Ok(event) = client.events().recv_timeout(left) else { break };
        match event.event {
            Event::ControllerVersion([major, minor, bugfix, build]) => {
                println!("version  {major}.{minor}.{bugfix}.{build}");
            }
            Event::Text { text, source, level } => println!("message  {source}, level {level}: {text}"),
            Event::Data(values) => seen.take(event.at, &values),
            _ => {}
        }
    }
    seen.print();
    if let Some(values) = client.newest() {
        for ((name, _), value) in client.recipe().fields.iter().zip(values) {
            println!("{name:17} {value:?}");
        }
    }
    match client.ended() {
        Some(end) => Err(end.into()),
        None => Ok(()),
    }
}

/// When data frames came, by the clock here and by the controller's.
#[derive(Default)]
struct Seen {
    frames: u64,
    gaps: u64,
    /// Longest time between two frames: here, and on the controller.
    longest_here_s: f64,
    longest_there_s: f64,
    first: Option<(Instant, f64)>,
    last: Option<(Instant, f64)>,
}

impl Seen {
    fn take(&mut self, at: Instant, values: &[Value]) {
        let Some(&Value::Double(there_s)) = values.first() else { return };
        if let Some((before, before_s)) = self.last {
            let step_s = there_s - before_s;
            self.gaps += u64::from(step_s > GAP_PERIODS / RATE_HZ);
            self.longest_there_s = self.longest_there_s.max(step_s);
            self.longest_here_s = self.longest_here_s.max(at.duration_since(before).as_secs_f64());
        }
        self.frames += 1;
        self.first.get_or_insert((at, there_s));
        self.last = Some((at, there_s));
    }

    fn print(&self) {
        let (Some((began, began_s)), Some((ended, ended_s))) = (self.first, self.last) else {
            return println!("no data");
        };
        let steps = self.frames.saturating_sub(1) as f64;
        let here_hz = steps / ended.duration_since(began).as_secs_f64();
        let there_hz = steps / (ended_s - began_s);
        println!("frames   {}, of {RATE_HZ} Hz asked", self.frames);
        println!("rate     {here_hz:.2} Hz by this clock, {there_hz:.2} Hz by the controller's");
        let (here_ms, there_ms) = (1e3 * self.longest_here_s, 1e3 * self.longest_there_s);
        println!("gaps     {}; longest step {here_ms:.1} ms here, {there_ms:.1} ms there", self.gaps);
    }
}
