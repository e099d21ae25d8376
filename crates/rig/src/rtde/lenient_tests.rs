//! A server that is lax, byte by byte as the Universal Robots Client Library's `fake_rtde_server` answered on 2026-11-22.

use super::fields::{input_type, output_type};
use super::*;

const OUTPUTS: &str = "timestamp,robot_mode,actual_q,target_speed_fraction";
const INPUTS: &str = "speed_slider_mask,speed_slider_fraction";
/// What it answered to V, v, O and I: names where types belong.
const ANSWERS: [&str; 4] = [
    "00045601",
    "0013760000000a0000000a0000000a0000000a",
    "00374f0174696d657374616d702c726f626f745f6d6f64652c61637475616c5f712c7461726765745f73706565645f6672616374696f6e",
    "002b490173706565645f736c696465725f6d61736b2c73706565645f736c696465725f6672616374696f6e",
];
/// The answer to S and the first data frame, which came in one piece. Its number is a byte that the server never sets: here it
/// was 0, in other sessions 84.
const STARTED: &str = "00045301004855003ff8c23ed2b4d46f";

fn bytes(hex: &str) -> Vec<u8> {
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

fn names(list: &str) -> Vec<String> {
    list.split(',').map(String::from).collect()
}

fn link(outputs: &str, lenient: bool) -> Link {
    let inputs = vec![names(INPUTS)];
    Link::new(SessionPlan { outputs: names(outputs), frequency_hz: 10.0, inputs, lenient }).unwrap()
}

fn started() -> Vec<u8> {
    let mut wire = bytes(STARTED);
    wire.extend([0; 60]);
    wire
}

#[test]
fn a_lenient_session_reads_a_lax_server() {
    let mut link = link(OUTPUTS, true);
    for (request, answer) in [b'V', b'v', b'O', b'I'].into_iter().zip(ANSWERS) {
        // One request at a time: it answers only the first of a segment.
        let asked = link.take_outgoing();
        let length = usize::from(u16::from_be_bytes([asked[0], asked[1]]));
        assert_eq!((asked[2], asked.len()), (request, length));
        link.receive(&bytes(answer)).unwrap();
    }
    let types = link.output().unwrap().fields.iter().map(|(_, kind)| kind.name());
    assert_eq!(types.collect::<Vec<_>>(), ["DOUBLE", "INT32", "VECTOR6D", "DOUBLE"]);
    let events = link.receive(&started()).unwrap();
    let [Event::Started, Event::Data(values)] = &events[..] else { panic!("{events:?}") };
    let [Value::Double(time_s), Value::Int32(0), Value::Vector6d(_), Value::Double(0.0)] = values[..] else {
        panic!("{values:?}")
    };
    assert!((1.5..1.6).contains(&time_s), "{time_s}");
    link.take_outgoing();
    link.write_input(0, &[Value::Uint32(1), Value::Double(0.5)]).unwrap();
    assert_eq!(link.take_outgoing(), bytes("00105501000000013fe0000000000000"));
}

#[test]
fn a_strict_session_refuses_the_same_bytes() {
    let mut strict = link(OUTPUTS, false);
    strict.receive(&bytes(&ANSWERS[..2].concat())).unwrap();
    let e = strict.receive(&bytes(ANSWERS[2])).unwrap_err();
    assert_eq!(e.to_string(), "`timestamp` has the unknown type `timestamp`");
    // With honest types, the number alone is reason enough.
    let honest = [
        encode_frame(Kind::SetUpOutputs, b"\x01DOUBLE,INT32,VECTOR6D,DOUBLE").unwrap(),
        encode_frame(Kind::SetUpInputs, b"\x01UINT32,DOUBLE").unwrap(),
    ];
    let mut strict = link(OUTPUTS, false);
    strict.receive(&bytes(&ANSWERS[..2].concat())).unwrap();
    strict.receive(&honest.concat()).unwrap();
    let e = strict.receive(&started()).unwrap_err();
    assert_eq!(e, SessionError::Data { found: 69, wanted: 69 });
}

/// Lenient is no licence: what a lax server does not do is refused as ever.
#[test]
fn a_lenient_session_refuses_everything_else() {
    let answered = |outputs: &str, answer: &[u8]| {
        let mut link = link(outputs, true);
        link.receive(&bytes(&ANSWERS[..2].concat())).unwrap();
        link.receive(&encode_frame(Kind::SetUpOutputs, answer).unwrap()).map(|_| link)
    };
    let refused = |outputs, answer: &[u8]| answered(outputs, answer).unwrap_err().to_string();
    assert_eq!(
        refused("timestamp,my_field", b"\x01timestamp,my_field"),
        "`my_field` has the unknown type `my_field`"
    );
    assert_eq!(
        refused("timestamp,actual_q", b"\x01DOUBLE,actual_q"),
        "`actual_q` has the unknown type `actual_q`"
    );
    assert_eq!(
        refused("timestamp,actual_q", b"\0timestamp,NOT_FOUND"),
        "the controller does not know actual_q"
    );
    // The types of an honest server are its own, whatever the table says.
    let mut honest = answered("timestamp,actual_q", b"\x01DOUBLE,VECTOR3D").unwrap();
    assert_eq!(honest.output().unwrap().fields[1].1, FieldType::Vector3d);
    honest.receive(&encode_frame(Kind::SetUpInputs, b"\x01UINT32,DOUBLE").unwrap()).unwrap();
    honest.receive(&bytes("00045301")).unwrap();
    let data = |number: u8, length: usize| {
        let payload = [vec![number], vec![0; length]].concat();
        honest.clone().receive(&encode_frame(Kind::Data, &payload).unwrap())
    };
    assert!([0, 1, 84].iter().all(|number| data(*number, 32).is_ok()));
    assert!(data(0, 31).is_err() && data(0, 33).is_err(), "another length");
}

/// Types as in the table of the Universal Robots Client Library.
#[test]
fn known_fields_have_their_types() {
    for (name, kind) in [
        ("timestamp", FieldType::Double),
        ("actual_TCP_force", FieldType::Vector6d),
        ("tcp_offset", FieldType::Vector6d),
        ("elbow_position", FieldType::Vector3d),
        ("joint_mode", FieldType::Vector6int32),
        ("safety_status", FieldType::Int32),
        ("tool_mode", FieldType::Uint32),
        ("tool_output_voltage", FieldType::Int32),
        ("tool_output_mode", FieldType::Uint8),
        ("tool_temperature", FieldType::Double),
        ("analog_io_types", FieldType::Uint32),
        ("actual_configurable_digital_input_bits", FieldType::Uint64),
        ("output_int_register_47", FieldType::Int32),
        ("output_bit_register_64", FieldType::Bool),
        ("output_bit_registers0_to_31", FieldType::Uint32),
        ("input_double_register_0", FieldType::Double),
    ] {
        assert_eq!(output_type(name), Some(kind), "{name}");
    }
    for (name, kind) in [
        ("speed_slider_mask", FieldType::Uint32),
        ("standard_digital_output", FieldType::Uint8),
        ("external_force_torque", FieldType::Vector6d),
        ("input_int_register_24", FieldType::Int32),
    ] {
        assert_eq!(input_type(name), Some(kind), "{name}");
    }
    for unknown in ["", "output_", "output_int_register_48", "output_bit_register_63", "Timestamp"] {
        assert_eq!((output_type(unknown), input_type(unknown)), (None, None), "{unknown}");
    }
    assert_eq!(input_type("output_int_register_24"), None);
}
