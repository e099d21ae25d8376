use super::*;

fn bytes(hex: &str) -> Vec<u8> {
    let hex: String = hex.split_whitespace().collect();
    (0..hex.len()).step_by(2).map(|i| u8::from_str_radix(&hex[i..i + 2], 16).unwrap()).collect()
}

/// Everything that a stream brings in pieces of `size`, and how it ended.
fn read(wire: &[u8], size: usize) -> (Vec<PrimaryMessage>, Option<PrimaryStreamError>) {
    let mut primary = PrimaryStream::default();
    let mut messages = Vec::new();
    for piece in wire.chunks(size) {
        primary.push(piece);
        loop {
            match primary.next_message() {
                Ok(Some(message)) => messages.push(message),
                Ok(None) => break,
                Err(e) => return (messages, Some(e)),
            }
        }
    }
    (messages, None)
}

/// One packet of each kind with what it says. Version, key and exception stand so in the tests of the Universal Robots Client Library,
/// but for the size of the exception: there it says two bytes less than it has.
fn all() -> Vec<(&'static str, &'static str)> {
    vec![
        (
            "00000037 14 0000000000000000 fe 03  09 5552436f6e74726f6c  05 18 00000000 00000000
             30342d31302d323032352c2030303a32353a3333",
            "URControl 5.24.0",
        ),
        (
            "0000003b 14 0000000000000000 fd 0a  00000003 00000001
             636f6d70696c655f6572726f725f6e616d655f6e6f745f666f756e643a7478746d73673a",
            "line 3, column 1: compile_error_name_not_found:txtmsg:",
        ),
        (
            "00000032 14 0000000000000000 fe 07  00000000 00000000
             13 50524f4752414d5f5858585f53544152544544  746578746d7367",
            "PROGRAM_XXX_STARTED textmsg",
        ),
        ("00000024 14 0000000000000000 07 06  00000099 ffffffff 00000003 00000004 80070605 21", "C153A-1 !"),
    ]
}

#[test]
fn packets_are_read_in_pieces_of_any_size_and_others_are_skipped() {
    let others = [
        // A text, the safety mode, the state of a program, a kind that is not known, a robot state, the end.
        "00000011 14 0000000000000000 07 00  4869",
        "00000020 14 0000000000000000 fd 05  00000000 00000000 03 00000000 00000001",
        "0000000e 19 000000000000000000",
        "00000010 14 0000000000000000 fe 09 ff",
        "00000010 10  00000006 01 aa  00000005 04",
        "00000005 ff",
    ];
    let wire: Vec<u8> = all()
        .iter()
        .zip(others)
        .flat_map(|((packet, _), other)| [bytes(packet), bytes(other)].concat())
        .collect();
    let wire = [wire, bytes(others[4]), bytes(others[5])].concat();
    for size in [1, 2, 3, 5, 19, 54, 55, 56, wire.len()] {
        let (messages, end) = read(&wire, size);
        let words: Vec<String> = messages.iter().map(PrimaryMessage::to_string).collect();
        assert_eq!(words, all().iter().map(|(_, words)| *words).collect::<Vec<_>>(), "pieces of {size}");
        assert_eq!(end, None);
    }
}

#[test]
fn what_is_no_packet_is_said_with_both_numbers() {
    let end = |hex: &str| read(&bytes(hex), 3).1.unwrap().to_string();
    assert_eq!(end("00000004 14"), "a packet says that it has 4 bytes, packets have 5 to 65536");
    assert!(end("ffffffff 14").contains("-1 bytes"));
    assert!(end("00010001").contains("65537 bytes, packets have 5 to 65536"));
    assert_eq!(end("00000007 14 0000"), "a robot message of 2 bytes is too short, 9 are needed");
    let short = end("00000014 14 0000000000000000 fe 07 0000000000");
    assert_eq!(short, "a key message of 5 bytes is too short, 8 are needed");
    // A title that is longer than its message.
    let short = end("00000019 14 0000000000000000 fe 07 00000000 00000000 05 41");
    assert_eq!(short, "a key message of 10 bytes is too short, 14 are needed");
    // Nothing is read behind it, whatever follows.
    let mut primary = PrimaryStream::default();
    primary.push(&bytes("00000004 14"));
    assert!(primary.next_message().is_err());
    primary.push(&bytes(all()[0].0));
    assert!(primary.next_message().is_err());
}
