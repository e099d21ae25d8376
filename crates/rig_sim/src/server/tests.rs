use super::*;
use gripgen_rig::primary::{PrimaryEvent, PrimaryStream, RobotMessage};
use gripgen_rig::robot_state::SafetyStatus;

fn read(bytes: &[u8]) -> RobotMessage {
    let mut stream = PrimaryStream::default();
    stream.push(bytes);
    let Ok(Some(PrimaryEvent::Message { message, .. })) = stream.next_event() else { panic!("{bytes:?}") };
    assert_eq!(stream.next_event(), Ok(None), "one message and no more");
    message
}

/// What is announced reads as the client of this crate reads a controller.
#[test]
fn announcements_are_messages_of_the_primary_interface() {
    let RobotMessage::Version(version) = read(&version_message()) else { panic!("no version") };
    assert_eq!((version.project.as_str(), version.major, version.minor), ("URControl", 5, 12));
    let said = |announcement: &Announcement| read(&announcement_message(announcement, 61.5));
    let RobotMessage::Key(key) = said(&Announcement::Started { title: "gripgen_pull".into() }) else {
        panic!()
    };
    assert_eq!((key.title.as_str(), key.text.as_str()), (PROGRAM_STARTED, "gripgen_pull"));
    for (why, text) in [("", "gripgen_pull"), ("watchdog", "gripgen_pull: watchdog")] {
        let stopped = Announcement::Stopped { title: "gripgen_pull".into(), why: why.into() };
        let RobotMessage::Key(key) = said(&stopped) else { panic!() };
        assert_eq!((key.title.as_str(), key.text.as_str()), (PROGRAM_STOPPED, text));
    }
    // However long the words are, the packet is one.
    let problem = "\u{e4}".repeat(100_000);
    let RobotMessage::ErrorCode(error) = said(&Announcement::CannotRun { problem }) else { panic!() };
    assert_eq!((error.code, error.level), (207, 3));
    let RobotMessage::SafetyMode(safety) = said(&Announcement::Safety(SafetyStatus::ProtectiveStop)) else {
        panic!()
    };
    assert_eq!(safety.mode, 3);
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
