use super::*;

fn link() -> GclLink {
    GclLink::new(SHIPPED_LIMITS)
}

fn grip(force_per_jaw_n: f64) -> GclCommand {
    GclCommand::Grip { force_per_jaw_n, part_width_mm: None, speed_mm_s: None }
}

fn sent(link: &mut GclLink) -> String {
    String::from_utf8(link.take_outgoing()).unwrap()
}

/// Both jaws together: 20 N of each are GRIP(40).
#[test]
fn commands_are_the_lines_of_the_manual() {
    let line = |command: GclCommand| command.line(&SHIPPED_LIMITS).unwrap();
    assert_eq!(line(grip(20.0)), "GRIP(40)\n");
    let whole = GclCommand::Grip { force_per_jaw_n: 12.5, part_width_mm: Some(20.0), speed_mm_s: Some(50.0) };
    assert_eq!(line(whole), "GRIP(25, 20, 50)\n");
    assert_eq!(line(GclCommand::Release { pull_back_mm: 5.0 }), "RELEASE(5)\n");
    assert_eq!(line(GclCommand::Home), "HOME()\n");
    assert_eq!(line(GclCommand::Move { width_mm: 100.0 }), "MOVE(100)\n");
    assert_eq!(line(GclCommand::AcknowledgeFastStop), "FSACK()\n");
    assert_eq!(line(GclCommand::Ask(Query::GripState)), "GRIPSTATE?\n");
    assert_eq!(line(GclCommand::Verbose(true)), "VERBOSE=1\n");
    assert_eq!(line(GclCommand::PartWidthTolerance { tolerance_mm: 2.5 }), "PWT=2.5\n");
}

#[test]
fn what_the_device_would_clamp_is_refused_with_both_numbers() {
    let error = |command: GclCommand| command.line(&SHIPPED_LIMITS).unwrap_err().to_string();
    let force = error(grip(45.0));
    assert_eq!(force, "45 N per jaw are 90 N for the gripper, which allows 5 to 80 N (sum of both jaws)");
    assert!(error(grip(2.0)).contains("4 N") && error(grip(f64::NAN)).contains("NaN"));
    assert!(error(GclCommand::Release { pull_back_mm: 200.0 }).contains("200 mm is outside 0 to 110 mm"));
    let fast = GclCommand::Grip { force_per_jaw_n: 10.0, part_width_mm: Some(20.0), speed_mm_s: Some(900.0) };
    assert!(error(fast).contains("900 mm/s is outside 5 to 420 mm/s"));
    let mut link = link();
    assert!(link.send(&grip(45.0)).is_err());
    assert!(sent(&mut link).is_empty() && link.moving().is_none(), "nothing was sent");
}

#[test]
fn a_grip_is_acknowledged_finished_and_released_before_the_next() {
    let mut link = link();
    link.send(&grip(20.0)).unwrap();
    assert_eq!(sent(&mut link), "GRIP(40)\n");
    assert_eq!(link.send(&GclCommand::Home), Err(SendError::Moving { asked: "HOME", moving: "GRIP" }));
    // Queries are allowed while the jaws move; answers may come in between and in pieces.
    link.send(&GclCommand::Ask(Query::Position)).unwrap();
    assert_eq!(link.receive(b"ACK GR").unwrap(), []);
    let events = link.receive(b"IP\nPOS=20.5\r\n@FORCE=38.2\nFIN GRIP\n").unwrap();
    let value = |name: &str, number| GclEvent::Value { name: name.into(), number };
    let wanted = [
        GclEvent::Acknowledged("GRIP".into()),
        value("POS", 20.5),
        GclEvent::Streamed { name: "FORCE".into(), number: 38.2 },
        GclEvent::Finished("GRIP".into()),
    ];
    assert_eq!(events, wanted);
    assert_eq!(link.send(&grip(10.0)), Err(SendError::Holding));
    link.send(&GclCommand::Release { pull_back_mm: 5.0 }).unwrap();
    link.receive(b"ACK RELEASE\nFIN RELEASE\n").unwrap();
    link.send(&grip(10.0)).unwrap();
    assert_eq!(GripState::from_number(4.0), Some(GripState::Holding));
    assert_eq!(GripState::from_number(8.0), None);
}

#[test]
fn errors_say_what_failed_and_why() {
    let mut link = link();
    link.send(&grip(20.0)).unwrap();
    let events = link.receive(b"ACK GRIP\nERR GRIP 18 \"no part\"\nERR 14\n").unwrap();
    let GclEvent::Failed { command, status, .. } = &events[1] else { panic!("{events:?}") };
    assert_eq!((command.as_str(), *status), ("GRIP", Some(18)));
    assert!(status_meaning(18).contains("no part") && status_meaning(16).contains("FSACK"));
    assert_eq!(status_meaning(99), "unknown status");
    assert!(matches!(&events[2], GclEvent::Failed { status: Some(14), .. }));
    // The jaws have moved: they are opened like those of a grip that holds.
    assert!(link.moving().is_none());
    assert_eq!(link.send(&grip(20.0)), Err(SendError::Holding));
}

#[test]
fn a_fast_stop_is_always_sent_and_nothing_after_goodbye() {
    let mut link = link();
    link.send(&grip(20.0)).unwrap();
    link.send(&GclCommand::FastStop).unwrap();
    link.send(&GclCommand::AcknowledgeFastStop).unwrap();
    link.send(&GclCommand::Bye).unwrap();
    assert_eq!(sent(&mut link), "GRIP(40)\nFASTSTOP()\nFSACK()\nBYE()\n");
    assert_eq!(link.send(&GclCommand::Home), Err(SendError::Closed { asked: "HOME" }));
}

#[test]
fn no_line_grows_without_end() {
    let mut endless = link();
    let flood = (0..10).map(|_| endless.receive(&[b'x'; 200])).find(Result::is_err);
    assert!(flood.is_some());
}
