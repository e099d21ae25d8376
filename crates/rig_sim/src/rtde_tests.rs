//! What clients do to a controller: published byte sequences, the checklist of four public clients, and the crate's own client.

use super::controller::Controller;
use super::rtde::{InputOwners, RtdeServer};
use super::spring::Spring;
use gripgen_rig::program::TcpPose;
use gripgen_rig::rtde::{Event, Kind, Link, SessionError, SessionPlan, Value, encode_frame};
use std::sync::Arc;

const TWO: &[u8] = &[0, 5, b'V', 0, 2];

/// A robot and one of its connections.
struct Served {
    controller: Controller,
    owners: InputOwners,
    server: RtdeServer,
}

fn served() -> Served {
    let tcp = TcpPose { position_m: [0.3, 0.0, 0.2], rotation_rad: [0.0; 3] };
    let controller = Controller::new(Arc::new(Spring::default()), tcp, 1.0);
    Served { controller, owners: InputOwners::default(), server: RtdeServer::new(1) }
}

impl Served {
    /// The answers to these bytes.
    fn hear(&mut self, bytes: &[u8]) -> Vec<u8> {
        self.server.receive(bytes, &mut self.controller, &mut self.owners).unwrap()
    }

    fn refuses(&mut self, bytes: &[u8]) -> String {
        self.server.receive(bytes, &mut self.controller, &mut self.owners).unwrap_err().to_string()
    }

    /// Frames that are sent in these control steps.
    fn frames(&self, steps: std::ops::Range<u64>) -> usize {
        steps.filter(|step| self.server.data(*step, &self.controller).is_some()).count()
    }

    /// Another connection to the same robot.
    fn other(&mut self, connection: u64, bytes: &[u8]) -> Vec<u8> {
        let mut other = RtdeServer::new(connection);
        other.receive(bytes, &mut self.controller, &mut self.owners).unwrap()
    }
}

fn frame(kind: Kind, payload: &[u8]) -> Vec<u8> {
    encode_frame(kind, payload).unwrap()
}

fn outputs(rate_hz: f64, names: &str) -> Vec<u8> {
    frame(Kind::SetUpOutputs, &[&rate_hz.to_be_bytes(), names.as_bytes()].concat())
}

fn inputs(names: &str) -> Vec<u8> {
    frame(Kind::SetUpInputs, names.as_bytes())
}

fn start() -> Vec<u8> {
    frame(Kind::Start, &[])
}

fn pause() -> Vec<u8> {
    frame(Kind::Pause, &[])
}

/// Writes `value` to the one integer of input recipe `id`.
fn write(id: u8, value: i32) -> Vec<u8> {
    frame(Kind::Data, &[&[id][..], &value.to_be_bytes()].concat())
}

#[test]
fn the_published_requests_have_the_published_answers() {
    let mut s = served();
    assert_eq!(s.hear(TWO), [0, 4, b'V', 1]);
    let version = frame(Kind::ControllerVersion, &[0, 0, 0, 5, 0, 0, 0, 12, 0, 0, 0, 0, 0, 0, 0, 0]);
    assert_eq!(s.hear(&[0, 3, b'v']), version);
    assert_eq!(
        s.hear(&outputs(500.0, "actual_q,actual_qd")),
        frame(Kind::SetUpOutputs, b"\x01VECTOR6D,VECTOR6D")
    );
    let slider = inputs("speed_slider_mask,speed_slider_fraction");
    assert_eq!(s.hear(&slider), frame(Kind::SetUpInputs, b"\x01UINT32,DOUBLE"));
    assert_eq!(s.hear(&start()), [0, 4, b'S', 1]);
    assert_eq!(s.hear(&pause()), [0, 4, b'P', 1]);
    assert_eq!(s.hear(&[0, 5, b'V', 0, 3]), [0, 4, b'V', 0], "a protocol that there is not");
}

#[test]
fn a_comma_at_the_end_is_no_name() {
    let mut s = served();
    s.hear(TWO);
    assert_eq!(s.hear(&outputs(500.0, "timestamp,")), frame(Kind::SetUpOutputs, b"\x01DOUBLE"));
    assert_eq!(s.hear(&inputs("input_int_register_24,")), frame(Kind::SetUpInputs, b"\x01INT32"));
}

#[test]
fn it_starts_with_outputs_alone() {
    let mut s = served();
    s.hear(TWO);
    assert_eq!(s.hear(&start()), [0, 4, b'S', 0], "nothing to send");
    assert_eq!(
        s.hear(&outputs(500.0, "timestamp,nothing")),
        frame(Kind::SetUpOutputs, b"\0DOUBLE,NOT_FOUND")
    );
    assert_eq!(s.hear(&start()), [0, 4, b'S', 0], "a recipe that was refused");
    s.hear(&outputs(500.0, "timestamp"));
    // The controller's version was never asked for.
    assert_eq!(s.hear(&start()), [0, 4, b'S', 1]);
    assert_eq!(s.frames(0..10), 10);
    s.hear(&outputs(500.0, "nothing"));
    assert_eq!(s.frames(0..10), 0, "the recipe that was sent is gone");
}

#[test]
fn inputs_come_before_and_after_the_start_and_without_it() {
    let mut s = served();
    s.hear(&inputs("input_int_register_24"));
    s.hear(&write(1, -7));
    assert_eq!(s.controller.robot().inputs.int[24], -7);
    s.hear(&[TWO.to_vec(), outputs(500.0, "timestamp"), start()].concat());
    assert_eq!(s.hear(&inputs("input_int_register_25")), frame(Kind::SetUpInputs, b"\x02INT32"));
    s.hear(&[write(2, 9), write(1, 1)].concat());
    assert_eq!(s.controller.robot().inputs.int[24..26], [1, 9]);
    // Paused, given an input, started again.
    let again = [pause(), inputs("input_double_register_24"), start()].concat();
    let answers = [&[0, 4, b'P', 1][..], &frame(Kind::SetUpInputs, b"\x03DOUBLE"), &[0, 4, b'S', 1]].concat();
    assert_eq!(s.hear(&again), answers);
    assert_eq!(s.frames(0..10), 10);
}

#[test]
fn an_input_has_one_owner_until_its_connection_ends() {
    let mut s = served();
    let asked = inputs("input_int_register_24,input_double_register_24");
    assert_eq!(s.other(2, &asked), frame(Kind::SetUpInputs, b"\x01INT32,DOUBLE"), "numbers begin at 1");
    assert_eq!(s.hear(&asked), frame(Kind::SetUpInputs, b"\0IN_USE,IN_USE"));
    let half = inputs("input_int_register_25,input_int_register_24");
    assert_eq!(s.hear(&half), frame(Kind::SetUpInputs, b"\0INT32,IN_USE"));
    // What was refused belongs to nobody, and the next recipe is the first.
    assert_eq!(s.other(3, &inputs("input_int_register_25")), frame(Kind::SetUpInputs, b"\x01INT32"));
    s.owners.release(2);
    assert_eq!(s.hear(&asked), frame(Kind::SetUpInputs, b"\x01INT32,DOUBLE"));
    assert_eq!(s.hear(&asked), frame(Kind::SetUpInputs, b"\x02INT32,DOUBLE"), "its own, once more");
    assert_eq!(s.hear(&inputs("input_int_register_48")), frame(Kind::SetUpInputs, b"\0NOT_FOUND"));
    assert!(s.refuses(&write(7, 1)).contains("5 bytes fits none of the 2 input recipes"));
}

#[test]
fn protocol_1_has_no_rate_and_no_number() {
    let mut s = served();
    let asked = frame(Kind::SetUpOutputs, b"timestamp,robot_mode");
    assert_eq!(s.hear(&asked), frame(Kind::SetUpOutputs, b"DOUBLE,INT32"));
    s.hear(&start());
    let data = [&60.0_f64.to_be_bytes()[..], &7_i32.to_be_bytes()].concat();
    assert_eq!(s.server.data(0, &s.controller), Some(frame(Kind::Data, &data)));
    assert_eq!(s.frames(0..500), 500);
    assert_eq!(s.server.text("no", "RTDE", 1), frame(Kind::Text, b"\x01no"));
    s.hear(TWO);
    assert_eq!(s.server.text("no", "RTDE", 1), frame(Kind::Text, b"\x02no\x04RTDE\x01"));
}

#[test]
fn it_sends_at_the_rate_that_was_asked() {
    for (rate_hz, frames) in [(500.0, 500), (125.0, 125), (10.0, 10), (0.0, 1), (1e9, 500), (f64::NAN, 500)] {
        let mut s = served();
        s.hear(&[TWO.to_vec(), outputs(rate_hz, "timestamp"), start()].concat());
        assert_eq!(s.frames(0..500), frames, "{rate_hz} Hz");
    }
}

#[test]
fn pieces_of_any_size_have_the_same_answers() {
    let wire = [
        TWO.to_vec(),
        outputs(125.0, "timestamp,actual_q,"),
        inputs("input_int_register_24"),
        start(),
        frame(Kind::Text, b"\x02hi\x01x\x03"),
        write(1, 5),
        pause(),
    ]
    .concat();
    let whole = served().hear(&wire);
    for size in 1..40 {
        let mut s = served();
        let pieces: Vec<u8> = wire.chunks(size).flat_map(|piece| s.hear(piece)).collect();
        assert_eq!(pieces, whole, "pieces of {size}");
        assert_eq!(s.controller.robot().inputs.int[24], 5);
    }
}

#[test]
fn what_is_no_request_is_refused_with_its_numbers() {
    for (wire, words) in [
        (vec![0, 2, b'V'], "a frame says that it is 2 bytes long, its header alone is 3"),
        (vec![0, 5, 2, 0, 0], "a frame of 5 bytes is of the unknown kind 2"),
        (vec![0, 4, b'V', 2], "a request of kind ProtocolVersion is 1 bytes long"),
        (frame(Kind::SetUpInputs, &[0xff; 9]), "a request of kind SetUpInputs is 9 bytes long"),
        (inputs(&"x".repeat(2049)), "a request of kind SetUpInputs is 2049 bytes long"),
        (write(1, 1), "a data frame of 5 bytes fits none of the 0 input recipes"),
        (frame(Kind::Data, &[]), "a data frame of 0 bytes fits none of the 0 input recipes"),
    ] {
        assert_eq!(served().refuses(&wire), words);
    }
}

/// The crate's own client from its first byte to its last, with words of the controller between.
#[test]
fn the_client_of_this_crate_has_whole_sessions() {
    let plan = SessionPlan {
        outputs: ["timestamp", "actual_TCP_pose", "input_int_register_24"].map(String::from).to_vec(),
        frequency_hz: 250.0,
        inputs: vec![vec!["input_int_register_24".into()], vec!["input_double_register_24".into()]],
    };
    let (mut s, mut link) = (served(), Link::new(plan.clone()).unwrap());
    let mut values = Vec::new();
    for step in 0..100 {
        let answer = s.hear(&link.take_outgoing());
        link.receive(&s.server.text("still here", "test", 2)).unwrap();
        for event in link.receive(&answer).unwrap() {
            assert!(!matches!(event, Event::Data(_)));
        }
        if link.is_running() {
            link.write_input(0, &[Value::Int32(step)]).unwrap();
            let outgoing = link.take_outgoing();
            s.hear(&outgoing);
        }
        let data = s.server.data(step as u64, &s.controller).unwrap_or_default();
        for event in link.receive(&data).unwrap() {
            let Event::Data(of) = event else { panic!("{event:?}") };
            values.push(of);
        }
        s.controller.begin_step();
        s.controller.end_step();
    }
    let times: Vec<Value> = values.iter().map(|v| v[0]).collect();
    assert!(times.len() >= 45, "{}", times.len());
    for (k, pair) in values.windows(2).enumerate() {
        let [Value::Double(before), Value::Double(after)] = [pair[0][0], pair[1][0]] else {
            panic!("{pair:?}")
        };
        assert!((after - before - 0.004).abs() < 1e-9, "frame {k}: {before} s, {after} s");
        let [Value::Int32(before), Value::Int32(after)] = [pair[0][2], pair[1][2]] else {
            panic!("{pair:?}")
        };
        assert_eq!(after, before + 2);
    }
    // A second client wants the same inputs.
    let (mut second, mut other) = (RtdeServer::new(2), Link::new(plan).unwrap());
    let refused = (0..9).find_map(|_| {
        let answer = second.receive(&other.take_outgoing(), &mut s.controller, &mut s.owners).unwrap();
        other.receive(&answer).err()
    });
    assert!(matches!(refused, Some(SessionError::Recipe(_))), "{refused:?}");
}
