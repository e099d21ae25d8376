use super::*;
use crate::robot_state::{RobotMode, SafetyStatus};

/// Everything that a stream brings, in pieces of `size`, and how it ended.
fn read(wire: &[u8], size: usize) -> (Vec<DashboardEvent>, Option<DashboardSessionError>) {
    let mut link = DashboardLink::default();
    let mut events = Vec::new();
    for piece in wire.chunks(size) {
        link.push(piece);
        loop {
            match link.next_event() {
                Ok(Some(event)) => events.push(event),
                Ok(None) => break,
                Err(e) => return (events, Some(e)),
            }
        }
    }
    (events, None)
}

/// Commands and answers of the dashboard's document, for an e-Series robot.
#[test]
fn commands_and_answers_are_those_of_the_document() {
    use DashboardCommand as C;
    use DashboardReply as R;
    let version = PolyscopeVersion { major: 5, minor: 12, bugfix: 0, build: Some(1_101_319) };
    let table = [
        (C::RobotMode, "robotmode", "Robotmode: POWER_OFF", R::RobotMode(RobotMode::PowerOff)),
        (C::RobotMode, "robotmode", "Robotmode: RUNNING", R::RobotMode(RobotMode::Running)),
        (C::SafetyStatus, "safetystatus", "Safetystatus: NORMAL", R::SafetyStatus(SafetyStatus::Normal)),
        (C::PowerOn, "power on", "Powering on", R::Done),
        (C::BrakeRelease, "brake release", "Brake releasing", R::Done),
        (C::UnlockProtectiveStop, "unlock protective stop", "Protective stop releasing", R::Done),
        (C::CloseSafetyPopup, "close safety popup", "closing safety popup", R::Done),
        (C::Stop, "stop", "Stopped", R::Done),
        (C::IsInRemoteControl, "is in remote control", "true", R::RemoteControl(true)),
        (
            C::PolyscopeVersion,
            "PolyscopeVersion",
            "URSoftware 5.12.0.1101319 (Mar 22 2022)",
            R::Version(version),
        ),
        (C::SerialNumber, "get serial number", "20195500001", R::SerialNumber("20195500001".into())),
    ];
    for (command, line, answer, reply) in table {
        assert_eq!(command.line(), line);
        assert_eq!(command.reply(answer), Ok(reply), "{line}");
    }
    assert!(C::ALL.iter().all(|c| c.line().is_ascii()));
}

#[test]
fn a_refusal_is_given_in_the_controllers_words() {
    let e = DashboardCommand::Stop.reply("Failed to execute: stop").unwrap_err();
    let wanted = "the controller answers `Failed to execute: stop` to `stop`, which is answered by `Stopped`";
    assert_eq!(e.to_string(), wanted);
    for command in DashboardCommand::ALL {
        for line in [
            "",
            "Robotmode: ",
            "Robotmode: ASLEEP",
            "Safetystatus: FINE",
            "URSoftware 5.x",
            "True",
            "12a",
            "-",
        ] {
            assert!(command.reply(line).is_err(), "{command:?} takes `{line}`");
        }
    }
}

#[test]
fn answers_belong_to_commands_in_their_order() {
    let mut link = DashboardLink::default();
    assert_eq!(link.send(DashboardCommand::RobotMode), Ok(0));
    assert_eq!(link.send(DashboardCommand::Stop), Ok(1));
    assert_eq!(link.take_outgoing(), b"robotmode\nstop\n");
    assert!(link.take_outgoing().is_empty() && link.outstanding() == 2);
    link.push(format!("{GREETING}\r\nRobotmode: IDLE\nSto").as_bytes());
    assert_eq!(link.next_event(), Ok(Some(DashboardEvent::Greeting(GREETING.into()))));
    let reply = |number, command, line: &str| DashboardEvent::Reply { number, command, line: line.into() };
    assert_eq!(link.next_event(), Ok(Some(reply(0, DashboardCommand::RobotMode, "Robotmode: IDLE"))));
    assert_eq!(link.next_event(), Ok(None));
    link.push(b"pped\n\nmore\n");
    assert_eq!(link.next_event(), Ok(Some(reply(1, DashboardCommand::Stop, "Stopped"))));
    assert_eq!(link.next_event(), Ok(Some(DashboardEvent::Unasked("more".into()))));
    assert_eq!((link.next_event(), link.outstanding()), (Ok(None), 0));
}

#[test]
fn nothing_waits_or_grows_without_end() {
    let mut link = DashboardLink::default();
    let refused = (0..99).find_map(|_| link.send(DashboardCommand::RobotMode).err());
    assert_eq!(refused, Some(DashboardSendError::Outstanding { asked: "robotmode", outstanding: 16 }));
    assert!(refused.unwrap().to_string().contains("16 commands have no answer yet, at most 16"));
    // A longest line is read, one byte more is not; in one piece or in many.
    let line = |bytes: usize| format!("{GREETING:.<bytes$}\n");
    for size in [1, 7, 4096, 9000] {
        assert_eq!(read(line(4096).as_bytes(), size).1, None, "pieces of {size}");
        let (events, end) = read(line(4097).as_bytes(), size);
        assert_eq!(
            (events.len(), end),
            (0, Some(DashboardSessionError::Line { bytes: 4097 })),
            "pieces of {size}"
        );
    }
    let (events, end) = read(b"SSH-2.0-OpenSSH_8.9\r\nmore\n", 3);
    assert!(
        events.is_empty()
            && matches!(end, Some(DashboardSessionError::Greeting { line }) if line.contains("SSH"))
    );
}
