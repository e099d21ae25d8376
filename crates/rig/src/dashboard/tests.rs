use super::*;
use crate::robot_state::{RobotMode, SafetyStatus};

/// Everything that a stream brings, in pieces of `size`, and how it ended.
fn read(
    wire: &[u8],
    size: usize,
    sent: &[DashboardCommand],
) -> (Vec<DashboardEvent>, Option<DashboardSessionError>) {
    let mut link = DashboardLink::default();
    sent.iter().for_each(|command| assert!(link.send(*command).is_ok()));
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
    let program = |state, name: &str| R::Program { state, name: name.into() };
    let table = [
        (C::RobotMode, "robotmode", "Robotmode: POWER_OFF", R::RobotMode(RobotMode::PowerOff)),
        (C::RobotMode, "robotmode", "Robotmode: RUNNING", R::RobotMode(RobotMode::Running)),
        (C::SafetyStatus, "safetystatus", "Safetystatus: NORMAL", R::SafetyStatus(SafetyStatus::Normal)),
        (C::PowerOn, "power on", "Powering on", R::Done),
        (C::PowerOff, "power off", "Powering off", R::Done),
        (C::BrakeRelease, "brake release", "Brake releasing", R::Done),
        (C::UnlockProtectiveStop, "unlock protective stop", "Protective stop releasing", R::Done),
        (C::CloseSafetyPopup, "close safety popup", "closing safety popup", R::Done),
        (C::RestartSafety, "restart safety", "Restarting safety", R::Done),
        (
            C::ProgramState,
            "programState",
            "STOPPED pull it.urp",
            program(ProgramState::Stopped, "pull it.urp"),
        ),
        (C::ProgramState, "programState", "PLAYING null", program(ProgramState::Playing, "")),
        (C::Running, "running", "Program running: false", R::Running(false)),
        (C::Stop, "stop", "Stopped", R::Done),
        (C::Play, "play", "Starting program", R::Done),
        (C::IsInRemoteControl, "is in remote control", "true", R::RemoteControl(true)),
        (
            C::PolyscopeVersion,
            "PolyscopeVersion",
            "URSoftware 5.12.0.1101319 (Mar 22 2022)",
            R::Version(version),
        ),
        (C::SerialNumber, "get serial number", "20195500001", R::SerialNumber("20195500001".into())),
        (C::RobotModel, "get robot model", "UR5", R::RobotModel("UR5".into())),
        (C::Quit, "quit", "Disconnected", R::Done),
    ];
    for (command, line, answer, reply) in table {
        assert_eq!(command.line(), line);
        assert_eq!(command.reply(answer), Ok(reply), "{line}");
    }
    assert!(C::ALL.iter().all(|c| c.line().is_ascii()));
}

#[test]
fn a_refusal_is_given_in_the_controllers_words() {
    let e = DashboardCommand::Play.reply("Failed to execute: play").unwrap_err();
    let wanted =
        "the controller answers `Failed to execute: play` to `play`, which is answered by `Starting program`";
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
    assert_eq!(link.send(DashboardCommand::Quit), Ok(1));
    assert_eq!(link.send(DashboardCommand::Stop), Err(DashboardSendError::Closed { asked: "stop" }));
    assert_eq!(link.take_outgoing(), b"robotmode\nquit\n");
    assert!(link.take_outgoing().is_empty() && link.outstanding() == 2);
    link.push(format!("{GREETING}\r\nRobotmode: IDLE\nDisconn").as_bytes());
    assert_eq!(link.next_event(), Ok(Some(DashboardEvent::Greeting(GREETING.into()))));
    let reply = |number, command, line: &str| DashboardEvent::Reply { number, command, line: line.into() };
    assert_eq!(link.next_event(), Ok(Some(reply(0, DashboardCommand::RobotMode, "Robotmode: IDLE"))));
    assert_eq!(link.next_event(), Ok(None));
    link.push(b"ected\n\nmore\n");
    assert_eq!(link.next_event(), Ok(Some(reply(1, DashboardCommand::Quit, "Disconnected"))));
    assert_eq!(link.next_event(), Ok(Some(DashboardEvent::Unasked("more".into()))));
    assert_eq!((link.next_event(), link.outstanding()), (Ok(None), 0));
}

#[test]
fn nothing_waits_or_grows_without_end() {
    let mut link = DashboardLink::default();
    let refused = (0..99).find_map(|_| link.send(DashboardCommand::Running).err());
    assert_eq!(refused, Some(DashboardSendError::Outstanding { asked: "running", outstanding: 16 }));
    assert!(refused.unwrap().to_string().contains("16 commands have no answer yet, at most 16"));
    // A longest line is read, one byte more is not; in one piece or in many.
    let line = |bytes: usize| format!("{GREETING:.<bytes$}\n");
    for size in [1, 7, 4096, 9000] {
        assert_eq!(read(line(4096).as_bytes(), size, &[]).1, None, "pieces of {size}");
        let (events, end) = read(line(4097).as_bytes(), size, &[]);
        assert_eq!(
            (events.len(), end),
            (0, Some(DashboardSessionError::Line { bytes: 4097 })),
            "pieces of {size}"
        );
    }
    let (events, end) = read(b"SSH-2.0-OpenSSH_8.9\r\nmore\n", 3, &[]);
    assert!(
        events.is_empty()
            && matches!(end, Some(DashboardSessionError::Greeting { line }) if line.contains("SSH"))
    );
}

#[test]
fn damage_never_panics_and_pieces_do_not_matter() {
    let sent = &DashboardCommand::ALL[..6];
    let good =
        format!("{GREETING}\nRobotmode: RUNNING\nSafetystatus: NORMAL\r\nPowering on\n\nPowering off\n");
    let mut state = 3_u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    };
    for _ in 0..5_000 {
        let mut wire = good.clone().into_bytes();
        for _ in 0..random() % 4 {
            let at = random() % wire.len();
            match random() % 4 {
                0 => wire[at] = random() as u8,
                1 => drop(wire.drain(at..(at + random() % 9).min(wire.len()))),
                2 => wire.splice(at..at, vec![b'z'; random() % 5000]).for_each(drop),
                _ => wire.insert(at, b"\n\r\0\xff"[random() % 4]),
            }
        }
        let whole = read(&wire, wire.len(), sent);
        assert_eq!(read(&wire, 1 + random() % 60, sent), whole);
        for event in whole.0 {
            if let DashboardEvent::Reply { command, line, .. } = event {
                let _ = command.reply(&line);
            }
        }
    }
}
