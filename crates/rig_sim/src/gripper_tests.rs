use super::gripper::*;
use gripgen_rig::gcl::{
    GclCommand, GclEvent, GclLimits, GclLink, GripState, Query, SHIPPED_LIMITS, SendError, status_meaning,
};

/// Jaws around a part of this width, and what was asked of them.
#[derive(Default)]
struct Vice {
    part_mm: Option<f64>,
    asked: Vec<String>,
}

impl Vice {
    fn around(part_mm: f64) -> Self {
        Self { part_mm: Some(part_mm), asked: Vec::new() }
    }
}

impl Jaws for Vice {
    fn close(&mut self, force_per_jaw_n: f64) -> Closed {
        self.asked.push(format!("close {force_per_jaw_n}"));
        Closed { width_mm: self.part_mm.unwrap_or(0.0), part: self.part_mm.is_some() }
    }
    fn open(&mut self) {
        self.asked.push("open".into());
    }
}

fn ready() -> VirtualGripper {
    VirtualGripper::new(SHIPPED_LIMITS).homed(true)
}

/// Everything that a line leads to: the answer, and what comes within ten seconds.
fn whole(gripper: &mut VirtualGripper, jaws: &mut Vice, line: &str) -> Vec<String> {
    let mut lines = gripper.line(0.0, line);
    for tick in 0..=5000 {
        lines.extend(gripper.advance(f64::from(tick) * 0.002, jaws));
    }
    lines
}

/// Lines of the manual, in order, and what they lead to.
#[test]
fn answers_are_those_of_the_table() {
    let mut gripper = VirtualGripper::new(SHIPPED_LIMITS);
    let mut jaws = Vice::around(20.0);
    let table: &[(&str, &[&str])] = &[
        ("GRIPSTATE?", &["GRIPSTATE=0"]),
        ("MOVE(50)", &["ERR MOVE 3"]),
        ("GRIP(40)", &["ERR GRIP 3"]),
        ("HOME()", &["ACK HOME", "FIN HOME"]),
        ("HOME(1)", &["ACK HOME", "FIN HOME"]),
        ("POS?", &["POS=110.0"]),
        ("MOVE(60, 200)", &["ACK MOVE", "FIN MOVE"]),
        ("POS?", &["POS=60.0"]),
        ("SPEED?", &["SPEED=0.0"]),
        ("RELEASE()", &["ERR RELEASE 1"]),
        ("GRIP()", &["ACK GRIP", "FIN GRIP"]),
        ("FORCE?", &["FORCE=40.0"]),
        ("GRIPSTATE?", &["GRIPSTATE=4"]),
        ("GRIP(20)", &["ERR GRIP 1"]),
        ("MOVE(5)", &["ERR MOVE 29"]),
        ("RELEASE()", &["ACK RELEASE", "FIN RELEASE"]),
        ("POS?", &["POS=30.0"]),
        ("RELEASE(5)", &["ERR RELEASE 1"]),
        ("GRIP(25)", &["ACK GRIP", "FIN GRIP"]),
        ("RELEASE(5, 50)", &["ACK RELEASE", "FIN RELEASE"]),
        ("GRIP(25, 20)", &["ACK GRIP", "FIN GRIP"]),
        ("FORCE?", &["FORCE=25.0"]),
        ("POS?", &["POS=20.0"]),
        (" release ( 5 ) ", &["ACK RELEASE", "FIN RELEASE"]),
        ("grip(25,20.5,50)", &["ACK GRIP", "FIN GRIP"]),
        ("HOME(0)", &["ACK HOME", "ERR HOME 29"]),
        ("GRIPSTATE?", &["GRIPSTATE=7"]),
        ("STOP()", &["ACK STOP"]),
        ("PWT?", &["PWT=2.0"]),
        ("PWT=3.5", &["PWT=3.5"]),
        ("CLT?", &["CLT=5.0"]),
        ("CLT = 4", &["CLT=4.0"]),
        ("VERBOSE=1", &["VERBOSE=1"]),
        ("VERBOSE?", &["VERBOSE=1"]),
        ("VERBOSE=0", &["VERBOSE=0"]),
        ("FSACK()", &["ACK FSACK"]),
        ("FASTSTOP()", &["ACK FASTSTOP"]),
        ("FSACK()", &["ACK FSACK"]),
        ("AUTOSEND(\"POS\", 0)", &["ACK AUTOSEND"]),
        ("", &[]),
        ("  \r", &[]),
        ("BYE()", &["ACK BYE"]),
        ("POS?", &[]),
    ];
    for (line, wanted) in table {
        assert_eq!(whole(&mut gripper, &mut jaws, line), *wanted, "{line}");
    }
    assert!(gripper.said_goodbye());
}

#[test]
fn what_is_no_command_is_refused_with_the_number_of_the_manual() {
    let mut gripper = ready();
    for (line, wanted) in [
        ("JUMP()", "ERR JUMP 14"),
        ("POSITION?", "ERR POSITION 14"),
        ("18()", "ERR 14"),
        ("?", "ERR 14"),
        ("\u{fc}ber()", "ERR 14"),
        ("MOVE()", "ERR MOVE 13"),
        ("AUTOSEND(\"POS\")", "ERR AUTOSEND 13"),
        ("STOP(1)", "ERR STOP 12"),
        ("GRIP(40, 20, 50, 1)", "ERR GRIP 12"),
        ("GRIP(strong)", "ERR GRIP 15"),
        ("GRIP(NaN)", "ERR GRIP 15"),
        ("MOVE(inf)", "ERR MOVE 15"),
        ("GRIP(40,)", "ERR GRIP 15"),
        ("GRIP(40", "ERR GRIP 15"),
        ("GRIP", "ERR GRIP 15"),
        ("POS=20", "ERR POS 15"),
        ("GRIP(81)", "ERR GRIP 28"),
        ("GRIP(4.9)", "ERR GRIP 28"),
        ("GRIP(40, 111)", "ERR GRIP 28"),
        ("MOVE(20, 421)", "ERR MOVE 28"),
        ("RELEASE(-1)", "ERR RELEASE 28"),
        ("HOME(2)", "ERR HOME 28"),
        ("VERBOSE=2", "ERR VERBOSE 28"),
        ("PWT=-1", "ERR PWT 28"),
        ("AUTOSEND(\"PWT\", 50)", "ERR AUTOSEND 28"),
        ("AUTOSEND(\"POS\", 1)", "ERR AUTOSEND 28"),
    ] {
        assert_eq!(gripper.line(0.0, line), [wanted], "{line}");
    }
    assert_eq!(gripper.line(0.0, &"x".repeat(257)), ["ERR 27"]);
    assert_eq!(gripper.line(0.0, &"x".repeat(256)), ["ERR 14"], "a name that long is not repeated");
    gripper.line(0.0, "VERBOSE=1");
    assert_eq!(gripper.line(0.0, "GRIP(81)"), [format!("ERR GRIP 28 \"{}\"", status_meaning(28))]);
}

/// The wire says the sum of both jaws, the world is asked for each.
#[test]
fn the_force_of_the_wire_is_that_of_both_jaws() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    whole(&mut gripper, &mut jaws, "GRIP(40)");
    assert_eq!(jaws.asked, ["close 20"]);
    assert_eq!((gripper.force_sum_n(), gripper.state()), (40.0, GripState::Holding));
    jaws.asked.clear();
    whole(&mut gripper, &mut jaws, "RELEASE()");
    assert_eq!(jaws.asked, ["open"]);
    assert_eq!((gripper.force_sum_n(), gripper.state()), (0.0, GripState::Idle));
}

/// From 110 mm to 20 mm at 45 mm/s are two seconds; nothing is faster than 20 ms.
#[test]
fn motions_take_their_time() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    assert_eq!(gripper.line(1.0, "GRIP(40, 20, 45)"), ["ACK GRIP"]);
    assert!(gripper.advance(1.0, &mut jaws).is_empty());
    assert!(gripper.advance(2.0, &mut jaws).is_empty());
    assert_eq!(gripper.line(2.0, "POS?"), ["POS=65.0"]);
    assert_eq!(gripper.line(2.0, "SPEED?"), ["SPEED=45.0"]);
    assert_eq!(gripper.line(2.0, "FORCE?"), ["FORCE=0.0"]);
    assert_eq!(gripper.line(2.0, "GRIPSTATE?"), ["GRIPSTATE=1"]);
    assert_eq!(gripper.line(2.0, "MOVE(50)"), ["ERR MOVE 4"]);
    assert_eq!(gripper.line(2.0, "HOME()"), ["ERR HOME 4"]);
    assert!(gripper.advance(2.99, &mut jaws).is_empty());
    assert_eq!(gripper.advance(3.0, &mut jaws), ["FIN GRIP"]);
    assert_eq!(jaws.asked, ["close 20"], "the world is asked once");
    // No way to go, and still not at once.
    gripper.line(4.0, "RELEASE(0)");
    assert!(gripper.advance(4.019, &mut jaws).is_empty());
    assert_eq!(gripper.advance(4.0201, &mut jaws), ["FIN RELEASE"]);
    assert_eq!(gripper.width_mm(), 20.0);
}

#[test]
fn a_grip_of_a_known_width_tells_whether_it_holds_the_part() {
    // Tolerance 2 mm. Part, what GRIP(40, 20) leads to, GRIPSTATE, width.
    for (part_mm, wanted, state, width_mm) in [
        (Some(20.0), "FIN GRIP", 4, 20.0),
        (Some(22.0), "FIN GRIP", 4, 22.0),
        (Some(18.0), "FIN GRIP", 4, 18.0),
        (Some(17.9), "ERR GRIP 18", 2, 18.0),
        (None, "ERR GRIP 18", 2, 18.0),
        (Some(22.1), "ERR GRIP 29", 7, 22.1),
    ] {
        let (mut gripper, mut jaws) = (ready(), Vice { part_mm, asked: Vec::new() });
        assert_eq!(whole(&mut gripper, &mut jaws, "GRIP(40, 20)"), ["ACK GRIP", wanted], "{part_mm:?}");
        assert_eq!(gripper.line(10.0, "GRIPSTATE?"), [format!("GRIPSTATE={state}")], "{part_mm:?}");
        assert_eq!(gripper.width_mm(), width_mm, "{part_mm:?}");
        let open = jaws.asked.last().map(String::as_str) == Some("open");
        assert_eq!((open, gripper.force_sum_n() > 0.0), (state != 4, state == 4), "{part_mm:?}");
        // Whatever it ended on, it can be released.
        assert_eq!(whole(&mut gripper, &mut jaws, "RELEASE(5)"), ["ACK RELEASE", "FIN RELEASE"]);
    }
    // Without a width it always says that it holds.
    let (mut gripper, mut jaws) = (ready(), Vice::default());
    assert_eq!(whole(&mut gripper, &mut jaws, "GRIP(40)"), ["ACK GRIP", "FIN GRIP"]);
    assert_eq!((gripper.state(), gripper.width_mm()), (GripState::Holding, 0.0));
}

#[test]
fn a_move_is_no_grip() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    assert_eq!(whole(&mut gripper, &mut jaws, "MOVE(10)"), ["ACK MOVE", "ERR MOVE 29"]);
    assert_eq!(jaws.asked, ["open", "close 2.5", "open"]);
    assert_eq!((gripper.width_mm(), gripper.force_sum_n()), (20.0, 0.0));
    // Blocked until it is stopped.
    assert_eq!(whole(&mut gripper, &mut jaws, "MOVE(50)"), ["ERR MOVE 29"]);
    assert_eq!(whole(&mut gripper, &mut jaws, "STOP()"), ["ACK STOP"]);
    assert_eq!(whole(&mut gripper, &mut jaws, "MOVE(50)"), ["ACK MOVE", "FIN MOVE"]);
}

#[test]
fn a_stop_ends_a_motion_and_holds_what_is_held() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    gripper.line(0.0, "GRIP(40, 20, 45)");
    gripper.advance(1.0, &mut jaws);
    assert_eq!(gripper.line(1.0, "STOP()"), ["ACK STOP", "ERR GRIP 19"]);
    assert_eq!((gripper.width_mm(), gripper.state()), (65.0, GripState::Idle));
    assert!(gripper.advance(9.0, &mut jaws).is_empty());
    assert_eq!(jaws.asked, ["close 20", "open"], "the jaws never arrived");
    whole(&mut gripper, &mut jaws, "GRIP(40, 20)");
    assert_eq!(gripper.line(10.0, "FASTSTOP()"), ["ACK FASTSTOP"]);
    assert_eq!((gripper.state(), gripper.force_sum_n()), (GripState::Holding, 40.0));
    gripper.part_lost();
    assert_eq!((gripper.state(), gripper.force_sum_n()), (GripState::PartLost, 0.0));
    assert_eq!(gripper.line(10.0, "GRIPSTATE?"), ["GRIPSTATE=3"]);
}

#[test]
fn a_fast_stop_refuses_everything_until_it_is_acknowledged() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    gripper.line(0.0, "MOVE(60)");
    gripper.advance(0.1, &mut jaws);
    assert_eq!(gripper.line(0.1, "FASTSTOP()"), ["ACK FASTSTOP", "ERR MOVE 19"]);
    assert!(gripper.fast_stop());
    for line in ["HOME()", "MOVE(50)", "GRIP()", "RELEASE()", "STOP()", "FASTSTOP()", "PWT=1", "VERBOSE=1"] {
        let name = line.split(['(', '=']).next().unwrap();
        assert_eq!(gripper.line(0.2, line), [format!("ERR {name} 16")], "{line}");
    }
    assert_eq!(gripper.line(0.2, "GRIPSTATE?"), ["GRIPSTATE=7"]);
    assert_eq!(gripper.line(0.2, "FSACK()"), ["ACK FSACK"]);
    assert!(!gripper.fast_stop());
    assert_eq!(whole(&mut gripper, &mut jaws, "MOVE(50)"), ["ACK MOVE", "FIN MOVE"]);
}

#[test]
fn a_connection_that_is_cut_is_a_fast_stop_and_settings_end_with_it() {
    let mut gripper = ready();
    gripper.connected();
    gripper.line(0.0, "PWT=9");
    gripper.line(0.0, "VERBOSE=1");
    gripper.disconnected();
    assert!(gripper.fast_stop());
    gripper.connected();
    assert_eq!(gripper.line(1.0, "MOVE(50)"), ["ERR MOVE 16"], "no words: VERBOSE is off again");
    assert_eq!(gripper.line(1.0, "PWT?"), ["PWT=2.0"]);
    gripper.line(1.0, "FSACK()");
    gripper.line(1.0, "BYE()");
    gripper.disconnected();
    assert!(!gripper.fast_stop());
}

#[test]
fn values_are_sent_by_themselves_at_their_period() {
    let (mut gripper, mut jaws) = (ready(), Vice::default());
    assert_eq!(gripper.line(0.0, "AUTOSEND(\"POS\", 50)"), ["ACK AUTOSEND"]);
    assert_eq!(gripper.line(0.0, "AUTOSEND(GripState, 100)"), ["ACK AUTOSEND"]);
    let lines: Vec<String> =
        (0..500).flat_map(|tick| gripper.advance(f64::from(tick) * 0.002, &mut jaws)).collect();
    assert_eq!(lines.iter().filter(|l| *l == "@POS=110.0").count(), 19);
    assert_eq!(lines.iter().filter(|l| *l == "@GRIPSTATE=0").count(), 9);
    // A long silence is not made up for.
    assert_eq!(gripper.advance(60.0, &mut jaws).len(), 2);
    assert_eq!(gripper.advance(60.001, &mut jaws).len(), 0);
    gripper.line(60.0, "AUTOSEND(\"POS\", 0)");
    gripper.connected();
    assert!(gripper.advance(70.0, &mut jaws).is_empty());
}

/// A world that works its answer out elsewhere is told what to work out, and never of a grip that was given up.
#[test]
fn the_world_can_be_asked_beforehand() {
    let (mut gripper, mut jaws) = (ready(), Vice::around(20.0));
    assert_eq!(gripper.pending_force_per_jaw_n(), None);
    gripper.line(0.0, "GRIP(40)");
    assert_eq!(gripper.pending_force_per_jaw_n(), Some(20.0));
    gripper.advance(0.1, &mut jaws);
    assert_eq!(gripper.pending_force_per_jaw_n(), None, "it is known now");
    gripper.line(0.2, "STOP()");
    gripper.line(0.2, "GRIP(30)");
    assert_eq!(gripper.pending_force_per_jaw_n(), None, "the jaws open first");
    gripper.advance(0.3, &mut jaws);
    assert_eq!(jaws.asked, ["close 20", "open"]);
    assert_eq!(gripper.pending_force_per_jaw_n(), Some(15.0));
    gripper.advance(0.4, &mut jaws);
    assert_eq!(jaws.asked, ["close 20", "open", "close 15"]);
    // Opening asks for nothing, looking for an obstacle does.
    for (now_s, line, force_n) in
        [(10.0, "RELEASE()", None), (20.0, "MOVE(90)", None), (30.0, "MOVE(10)", Some(2.5))]
    {
        gripper.advance(now_s, &mut jaws);
        let name = line.split('(').next().unwrap();
        assert_eq!(gripper.line(now_s, line), [format!("ACK {name}")]);
        gripper.advance(now_s, &mut jaws);
        assert_eq!(gripper.pending_force_per_jaw_n(), force_n, "{line}");
        gripper.advance(now_s, &mut jaws);
    }
}

/// The crate's own client on the other side, over a wire that cuts lines anywhere.
#[test]
fn the_client_of_this_crate_grips_and_releases() {
    let (mut gripper, mut jaws, mut link) = (ready(), Vice::around(20.0), GclLink::new(SHIPPED_LIMITS));
    let mut now_s = 0.0;
    let mut run = |link: &mut GclLink, gripper: &mut VirtualGripper| {
        let mut events = Vec::new();
        for _ in 0..2000 {
            let asked = String::from_utf8(link.take_outgoing()).unwrap();
            let mut lines: Vec<String> = asked.lines().flat_map(|l| gripper.line(now_s, l)).collect();
            lines.extend(gripper.advance(now_s, &mut jaws));
            let wire: String = lines.iter().map(|l| format!("{l}\n")).collect();
            for piece in wire.as_bytes().chunks(3) {
                events.extend(link.receive(piece).unwrap());
            }
            now_s += 0.002;
        }
        events
    };
    let grip = GclCommand::Grip { force_per_jaw_n: 20.0, part_width_mm: Some(20.0), speed_mm_s: Some(90.0) };
    link.send(&GclCommand::AcknowledgeFastStop).unwrap();
    link.send(&GclCommand::Verbose(true)).unwrap();
    link.send(&grip).unwrap();
    let events = run(&mut link, &mut gripper);
    assert_eq!(events.last(), Some(&GclEvent::Finished("GRIP".into())), "{events:?}");
    assert_eq!(link.send(&grip), Err(SendError::Holding));
    link.send(&GclCommand::Ask(Query::Force)).unwrap();
    assert_eq!(run(&mut link, &mut gripper), [GclEvent::Value { name: "FORCE".into(), number: 40.0 }]);
    link.send(&GclCommand::Release { pull_back_mm: 5.0 }).unwrap();
    run(&mut link, &mut gripper);
    assert_eq!((gripper.width_mm(), link.moving()), (25.0, None));
    // A part that is too wide, in the words of the device.
    let thin = GclCommand::Grip { force_per_jaw_n: 20.0, part_width_mm: Some(10.0), speed_mm_s: None };
    link.send(&thin).unwrap();
    let events = run(&mut link, &mut gripper);
    let Some(GclEvent::Failed { command, status: Some(29), line }) = events.last() else {
        panic!("{events:?}")
    };
    assert!(command == "GRIP" && line.contains("axis blocked"), "{line}");
    link.send(&GclCommand::Bye).unwrap();
    run(&mut link, &mut gripper);
    assert!(gripper.said_goodbye());
}

#[test]
fn no_line_and_no_limits_panic() {
    let backwards =
        GclLimits { force_sum_n: (80.0, 5.0), width_mm: (110.0, f64::NAN), speed_mm_s: (9.0, 1.0) };
    let words = [
        "GRIP", "MOVE", "HOME", "RELEASE", "FSACK", "STOP", "AUTOSEND", "POS", "PWT", "BY\u{e4}", "(", ")",
        "=", "?", ",", "20", "1e308", "-", "\"", " ", "\u{2028}",
    ];
    let mut state = 5_u64;
    let mut random = move |most: usize| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % most
    };
    for limits in [SHIPPED_LIMITS, backwards] {
        let (mut gripper, mut jaws) = (VirtualGripper::new(limits).homed(true), Vice::around(20.0));
        for round in 0..20_000 {
            let line: String = (0..random(8)).map(|_| words[random(words.len())]).collect();
            let now_s = f64::from(round) * 0.01;
            let answers = gripper.line(now_s, &line);
            assert!(answers.len() <= 2 && answers.iter().all(|a| !a.contains('\n') && a.len() < 200));
            assert!(gripper.advance(now_s, &mut jaws).len() <= 5);
        }
    }
}
