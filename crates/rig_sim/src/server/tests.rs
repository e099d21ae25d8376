use super::messages::{announcement_message, version_message};
use super::*;
use crate::controller::Announcement;
use gripgen_rig::primary::PrimaryStream;
use gripgen_rig::robot_state::SafetyStatus;

fn read(bytes: &[u8]) -> String {
    let mut stream = PrimaryStream::default();
    stream.push(bytes);
    let Ok(Some(message)) = stream.next_message() else { panic!("{bytes:?}") };
    assert_eq!(stream.next_message(), Ok(None), "one message and no more");
    message.to_string()
}

/// What is announced reads as a client reads a controller.
#[test]
fn announcements_are_messages_of_the_primary_interface() {
    assert_eq!(read(&version_message()), "URControl 5.12.0");
    let said = |announcement: &Announcement| read(&announcement_message(announcement, 61.5));
    assert_eq!(
        said(&Announcement::Started { title: "gripgen_pull".into() }),
        "PROGRAM_XXX_STARTED gripgen_pull"
    );
    for (why, text) in [("", "gripgen_pull"), ("watchdog", "gripgen_pull: watchdog")] {
        let stopped = Announcement::Stopped { title: "gripgen_pull".into(), why: why.into() };
        assert_eq!(said(&stopped), format!("PROGRAM_XXX_STOPPED {text}"));
    }
    // However long the words are, the packet is one.
    let problem = "\u{e4}".repeat(100_000);
    assert!(said(&Announcement::CannotRun { problem }).starts_with("C207A0 \u{e4}"));
    // Byte by byte, as in the tests of the Universal Robots Client Library: 61.5 s, mode 3.
    let safety = announcement_message(&Announcement::Safety(SafetyStatus::ProtectiveStop), 61.5);
    let wire = [&[0, 0, 0, 32, 20, 0, 0, 0, 0, 3, 170, 106, 96, 254, 5][..], &[0; 8], &[3], &[0; 8]].concat();
    assert_eq!(safety, wire);
}

#[test]
fn the_shipped_addresses_are_loopback_and_apart() {
    let shipped = RigAddresses::loopback();
    let mut ports: Vec<u16> = shipped.all().iter().map(|(_, address)| address.port()).collect();
    ports.sort_unstable();
    ports.dedup();
    assert_eq!(ports.len(), 8);
    assert!(ports.iter().all(|port| *port > 1023), "none needs a privilege");
    assert!(shipped.all().iter().all(|(_, address)| address.ip().is_loopback()));
    assert_eq!(
        (shipped.rtde.port(), shipped.dashboard.port(), shipped.primary.port()),
        (30004, 29999, 30001)
    );
    let any = RigAddresses::any_ports();
    assert!(any.all().iter().all(|(_, address)| address.port() == 0 && address.ip().is_loopback()));
}
