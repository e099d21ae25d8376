//! What RTDE clients get: every control step, in time, whatever another client does.

use super::{TIMEOUT, serve};
use gripgen_rig::link::Stamped;
use gripgen_rig::rtde::{Event, Kind, RtdeClient, SessionPlan, Value, encode_frame};
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpStream};
use std::time::Instant;

/// What the experiment asks for: about 350 bytes.
const NAMES: [&str; 13] = [
    "timestamp",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "actual_TCP_force",
    "ft_raw_wrench",
    "actual_q",
    "robot_mode",
    "safety_mode",
    "safety_status_bits",
    "runtime_state",
    "speed_scaling",
    "output_int_register_24",
    "output_double_register_24",
];

fn client(address: SocketAddr) -> RtdeClient {
    let outputs = NAMES.map(String::from).to_vec();
    let plan = SessionPlan { outputs, frequency_hz: 500.0, inputs: vec![] };
    RtdeClient::connect(address, &plan, TIMEOUT).unwrap()
}

/// Counts data frames, each a control step after the one before.
#[derive(Default)]
struct Steps {
    frames: u64,
    last_s: f64,
}

impl Steps {
    fn take(&mut self, event: &Stamped<Event>) {
        let Event::Data(values) = &event.event else { return };
        let Value::Double(now_s) = values[0] else { panic!("{values:?}") };
        if self.frames > 0 {
            let gap_s = now_s - self.last_s;
            assert!((gap_s - 0.002).abs() < 1e-6, "after {} frames {gap_s} s are missing", self.frames);
        }
        (self.frames, self.last_s) = (self.frames + 1, now_s);
    }

    /// Takes this many frames.
    fn take_frames(&mut self, client: &RtdeClient, frames: u64) {
        let end = self.frames + frames;
        while self.frames < end {
            self.take(&client.events().recv_timeout(TIMEOUT).unwrap());
        }
    }
}

/// Twenty seconds in real time, beside the other tests of this file. How far the arrivals are off is printed and not tested:
/// it is the machine's.
#[test]
fn ten_thousand_frames_come_in_real_time_without_a_gap() {
    const FRAMES: usize = 10_000;
    let rig = serve(1.0);
    let client = client(rig.addresses().rtde);
    let (mut steps, mut arrivals) = (Steps::default(), Vec::with_capacity(FRAMES));
    while arrivals.len() < FRAMES {
        let event = client.events().recv_timeout(TIMEOUT).unwrap();
        steps.take(&event);
        if matches!(event.event, Event::Data(_)) {
            arrivals.push(event.at);
        }
    }
    // Off a grid of 2 ms through the arrival that was the earliest on it.
    let late = |k: usize, at: Instant| (at - arrivals[0]).as_secs_f64() - k as f64 * 0.002;
    let mut late_ms: Vec<f64> = arrivals.iter().enumerate().map(|(k, at)| 1e3 * late(k, *at)).collect();
    late_ms.sort_by(f64::total_cmp);
    let at = |share: f64| late_ms[((FRAMES - 1) as f64 * share) as usize] - late_ms[0];
    println!(
        "arrivals after their time: p50 {:.3} ms, p99 {:.3} ms, largest {:.3} ms",
        at(0.5),
        at(0.99),
        at(1.0)
    );
    let seconds = (arrivals[FRAMES - 1] - arrivals[0]).as_secs_f64();
    assert!(seconds > 19.0, "the clock runs ahead: {seconds} s");
}

#[test]
fn a_client_that_never_reads_is_cut_off_and_takes_nothing_from_the_others() {
    let rig = serve(5.0);
    let address = rig.addresses().rtde;
    let clients = [client(address), client(address)];
    let mut mute = TcpStream::connect(address).unwrap();
    // The longest recipe there is: 11 kB per frame, 27 MB per second.
    let names = [&500.0_f64.to_be_bytes()[..], "actual_q,".repeat(227).as_bytes()].concat();
    mute.write_all(&[0, 5, b'V', 0, 2]).unwrap();
    mute.write_all(&encode_frame(Kind::SetUpOutputs, &names).unwrap()).unwrap();
    mute.write_all(&encode_frame(Kind::Start, &[]).unwrap()).unwrap();
    // Half a minute of the rig's time; what nobody reads is 27 MB for each second of real time.
    for client in &clients {
        Steps::default().take_frames(client, 15_000);
    }
    // What was sent before is there; then comes the end, with or without a word.
    mute.set_read_timeout(Some(TIMEOUT)).unwrap();
    let (mut left, mut buffer) = (0, vec![0; 1 << 20]);
    let end = loop {
        match mute.read(&mut buffer) {
            Ok(0) => break None,
            Ok(n) => left += n,
            Err(e) => break Some(e.kind()),
        }
        assert!(left < 40 << 20, "it is still being sent to");
    };
    assert!(end.is_none_or(|kind| kind == std::io::ErrorKind::ConnectionReset), "{end:?}");
    assert!(clients.iter().all(|client| client.ended().is_none()));
}

#[test]
fn a_clock_twenty_times_as_fast_leaves_nothing_out() {
    let rig = serve(20.0);
    let (began, began_s) = (Instant::now(), rig.status().timestamp_s);
    let client = client(rig.addresses().rtde);
    Steps::default().take_frames(&client, 20_000);
    let passed_s = rig.status().timestamp_s - began_s;
    // A machine that is busy falls behind, but never leaves a step out; no machine makes the clock faster.
    let most_s = 20.0 * (began.elapsed().as_secs_f64() + 0.25);
    assert!((40.0..=most_s).contains(&passed_s), "{passed_s} s of {most_s} s at most");
}
