use super::*;
use crate::robot_state::RobotMode;

fn bytes(hex: &str) -> Vec<u8> {
    let hex: String = hex.split_whitespace().collect();
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

/// Everything that a stream brings in pieces of `size`, how it ended, and what was skipped.
fn read(wire: &[u8], size: usize) -> (Vec<PrimaryEvent>, Option<PrimaryStreamError>, u64) {
    let mut primary = PrimaryStream::default();
    let mut events = Vec::new();
    for piece in wire.chunks(size) {
        primary.push(piece);
        loop {
            match primary.next_event() {
                Ok(Some(event)) => events.push(event),
                Ok(None) => break,
                Err(e) => return (events, Some(e), primary.skipped()),
            }
        }
    }
    (events, None, primary.skipped())
}

const HEADER: MessageHeader = MessageHeader { device_ticks: 0x0102_0304_0506_0708, source: -3 };

fn version() -> VersionMessage {
    let (project, date) = ("URControl".into(), "04-10-2025, 00:25:33".into());
    VersionMessage { project, major: 5, minor: 24, bugfix: 0, build: 0, date }
}

fn safety() -> SafetyModeMessage {
    SafetyModeMessage { code: 0, argument: 0, mode: 3, data_type: 0, data: 1 }
}

fn error() -> ErrorCodeMessage {
    let text = "Protective stop".into();
    ErrorCodeMessage { code: 153, argument: -1, level: 3, data_type: 4, data: 0x8007_0605, text }
}

fn key() -> KeyMessage {
    KeyMessage { code: 0, argument: 0, title: PROGRAM_STARTED.into(), text: "pull".into() }
}

fn exception() -> RuntimeException {
    RuntimeException { line: 3, column: 1, text: "compile_error_name_not_found:txtmsg:".into() }
}

fn mode() -> RobotModeData {
    RobotModeData {
        device_ticks: 0x0005_f87d_1740,
        real_robot_connected: true,
        real_robot_enabled: true,
        power_on: true,
        mode_number: 7,
        target_speed_fraction: 0.97,
        target_speed_fraction_limit: 1.0,
        ..RobotModeData::default()
    }
}

/// One packet of each kind, and what it says.
fn all() -> Vec<(Vec<u8>, PrimaryEvent)> {
    let of = |message| PrimaryEvent::Message { header: HEADER, message };
    vec![
        (encode_version_message(HEADER, &version()), of(RobotMessage::Version(version()))),
        (encode_text_message(HEADER, "gr\u{fc}n"), of(RobotMessage::Text("gr\u{fc}n".into()))),
        (encode_safety_mode_message(HEADER, &safety()), of(RobotMessage::SafetyMode(safety()))),
        (encode_error_code_message(HEADER, &error()), of(RobotMessage::ErrorCode(error()))),
        (encode_key_message(HEADER, &key()), of(RobotMessage::Key(key()))),
        (
            encode_runtime_exception_message(HEADER, &exception()),
            of(RobotMessage::RuntimeException(exception())),
        ),
        (encode_robot_mode_data(&mode()), PrimaryEvent::RobotMode(mode())),
    ]
}

/// Byte by byte; the version, the key and the mode stand so in the tests of the Universal Robots Client Library,
/// and so does the exception, but for its size: there it says two bytes less than it has.
#[test]
fn packets_are_those_on_the_wire() {
    let from = |source| MessageHeader { device_ticks: 0, source };
    let wire = bytes(
        "00000037 14 0000000000000000 fe 03  09 5552436f6e74726f6c  05 18 00000000 00000000
         30342d31302d323032352c2030303a32353a3333",
    );
    assert_eq!(wire.len(), 55);
    assert_eq!(encode_version_message(from(-2), &version()), wire);
    let message = RobotMessage::Version(version());
    assert_eq!(read(&wire, 55).0, [PrimaryEvent::Message { header: from(-2), message }]);
    let wire = bytes(
        "0000003b 14 0000000000000000 fd 0a  00000003 00000001
         636f6d70696c655f6572726f725f6e616d655f6e6f745f666f756e643a7478746d73673a",
    );
    assert_eq!(encode_runtime_exception_message(from(-3), &exception()), wire);
    let wire = bytes("00000020 14 0000000000000000 fd 05  00000000 00000000 03 00000000 00000001");
    assert_eq!(encode_safety_mode_message(from(-3), &safety()), wire);
    let key = KeyMessage { text: "textmsg".into(), ..key() };
    let wire = bytes(
        "00000032 14 0000000000000000 fe 07  00000000 00000000
         13 50524f4752414d5f5858585f53544152544544  746578746d7367",
    );
    assert_eq!(encode_key_message(from(-2), &key), wire);
    let error = ErrorCodeMessage { text: "!".into(), ..error() };
    let wire = bytes("00000024 14 0000000000000000 07 06  00000099 ffffffff 00000003 00000004 80070605 21");
    assert_eq!(encode_error_code_message(from(7), &error), wire);
    assert_eq!(encode_text_message(from(7), "Hi"), bytes("00000011 14 0000000000000000 07 00  4869"));
    let wire = bytes(
        "00000034 10  0000002f 00  00000005f87d1740 01 01 01 00 00 00 00 07 00
         3fef0a3d70a3d70a 0000000000000000 3ff0000000000000 00",
    );
    assert_eq!(encode_robot_mode_data(&mode()), wire);
    assert_eq!(mode().mode(), Some(RobotMode::Running));
}

#[test]
fn what_is_written_is_read_in_pieces_of_any_size() {
    let wire: Vec<u8> = all().into_iter().flat_map(|(packet, _)| packet).collect();
    let events: Vec<PrimaryEvent> = all().into_iter().map(|(_, event)| event).collect();
    for size in [1, 2, 3, 5, 19, 54, 55, 56, wire.len()] {
        assert_eq!(read(&wire, size), (events.clone(), None, 0), "pieces of {size}");
    }
}

#[test]
fn unknown_packets_are_skipped_and_counted() {
    let program_state = bytes("0000000e 19 000000000000000000");
    let unknown_message = bytes("00000010 14 0000000000000000 fe 09 ff");
    let disconnect = bytes("00000005 ff");
    // The state of an arm without its mode: joints and cartesian values are not read.
    let state = bytes("00000010 10  00000006 01 aa  00000005 04");
    // With it, behind others; a later version may say more at its end.
    let mut sub = encode_robot_mode_data(&mode())[5..].to_vec();
    sub.extend([9; 4]);
    sub[3] += 4;
    let mut with_mode = bytes("0000003e 10  00000006 01 aa");
    with_mode.extend(sub);
    assert_eq!(with_mode.len(), 0x3e);
    let wire = [program_state, unknown_message, disconnect, state, with_mode].concat();
    assert_eq!(read(&wire, 7), (vec![PrimaryEvent::RobotMode(mode())], None, 4));
}

#[test]
fn what_is_no_packet_is_said_with_both_numbers() {
    let end = |hex: &str| read(&bytes(hex), 3).1.unwrap().to_string();
    assert_eq!(end("00000004 14"), "a packet says that it has 4 bytes, packets have 5 to 65536");
    assert!(end("ffffffff 14").contains("-1 bytes"));
    assert!(end("00010001").contains("65537 bytes, packets have 5 to 65536"));
    assert_eq!(end("00000007 14 0000"), "a robot message of 2 bytes is too short, 8 are needed");
    let short = end("00000014 14 0000000000000000 fe 07 0000000000");
    assert_eq!(short, "a key message of 5 bytes is too short, 8 are needed");
    // A title that is longer than its message.
    let short = end("00000019 14 0000000000000000 fe 07 00000000 00000000 05 41");
    assert_eq!(short, "a key message of 10 bytes is too short, 14 are needed");
    let long = "a sub-packet says that it has 7 bytes, it has at least 5 and its packet has 6 left";
    assert_eq!(end("0000000b 10  00000007 01 aa"), long);
    assert!(end("0000000b 10  00000000 01 aa").contains("0 bytes, it has at least 5"));
    assert!(end("0000000b 10  00000006 00 aa").contains("a robot mode of 1 bytes is too short"));
    assert!(end("00000008 10  000000").contains("a robot state of 3 bytes is too short, 4 are needed"));
    // Nothing is read behind it, whatever follows.
    let mut primary = PrimaryStream::default();
    primary.push(&bytes("00000004 14"));
    assert!(primary.next_event().is_err());
    primary.push(&encode_text_message(HEADER, "late"));
    assert!(primary.next_event().is_err());
}

#[test]
fn texts_that_do_not_fit_are_cut_between_characters() {
    let title = format!("{}\u{e9}", "x".repeat(254));
    let long = KeyMessage { title, text: "y".repeat(1 << 17), ..key() };
    let wire = encode_key_message(HEADER, &long);
    assert!(wire.len() <= MAX_PACKET, "{}", wire.len());
    let (events, end, _) = read(&wire, wire.len());
    let [PrimaryEvent::Message { message: RobotMessage::Key(key), .. }] = &events[..] else {
        panic!("{end:?}")
    };
    assert_eq!((key.title.as_str(), &key.text[..3]), (&long.title[..254], "yyy"));
}

#[test]
fn damage_never_panics_and_pieces_do_not_matter() {
    let good: Vec<u8> = all().into_iter().flat_map(|(packet, _)| packet).collect();
    let mut state = 5_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    let mut ended = 0;
    for _ in 0..20_000 {
        let mut wire = good.clone();
        for _ in 0..1 + random() % 4 {
            let at = random() % wire.len();
            match random() % 3 {
                0 => wire[at] = random() as u8,
                1 => drop(wire.drain(at..(at + random() % 9).min(wire.len()))),
                _ => wire.insert(at, random() as u8),
            }
        }
        let (events, end, skipped) = read(&wire, wire.len());
        ended += usize::from(end.is_some());
        // Numbers that are none are equal here.
        let words = format!("{:?}", (&events, end, skipped));
        assert_eq!(format!("{:?}", read(&wire, 1 + random() % 90)), words);
    }
    assert!(ended > 2_000, "only {ended} streams were damaged");
}
