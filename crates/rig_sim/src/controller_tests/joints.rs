//! The joints under the tool: they follow it, they lead it, and they end what they cannot do.

use super::{HostedRobot, START, rig};
use crate::arm::STEP_S;
use crate::controller::Announcement;
use crate::kinematics::{MAX_SPEED_RAD_S, base_from_flange};
use gripgen_rig::robot_state::SafetyStatus;
use nalgebra::Translation3;

fn with(lines: &str) -> HostedRobot {
    let mut rig = rig();
    rig.controller.run_script(&format!("def my_program():\n{lines}end\n"));
    rig
}

fn told(rig: &HostedRobot) -> String {
    rig.told.iter().map(|told| format!("{told:?}")).collect()
}

/// How far the tool is from where the joints carry it.
fn apart_m(rig: &HostedRobot) -> f64 {
    let robot = rig.controller.robot();
    let carried = base_from_flange(&robot.joints_rad) * Translation3::from(robot.tool_m);
    (carried.translation.vector - robot.tcp.base_from_tool().translation.vector).norm()
}

#[test]
fn joints_follow_a_line_and_their_speeds_are_those_of_their_angles() {
    let mut rig = with("  movel(p[0.4, 0.1, 0.3, 0, 0.4, 0], a=0.5, v=0.2)\n");
    let mut before = rig.controller.robot().joints_rad;
    let mut fastest: f64 = 0.0;
    for _ in 0..1000 {
        rig.step();
        let robot = rig.controller.robot();
        assert!(apart_m(&rig) < 1e-9);
        for i in 0..6 {
            let speed_rad_s = (robot.joints_rad[i] - before[i]) / STEP_S;
            assert!((speed_rad_s - robot.joint_speeds_rad_s[i]).abs() < 1e-9);
            fastest = fastest.max(speed_rad_s.abs());
        }
        before = robot.joints_rad;
    }
    assert!((0.1..1.5).contains(&fastest), "{fastest} rad/s");
    assert!(rig.controller.robot().tcp.distance_m(&START) > 0.17);
    assert!(rig.stands_still());
}

/// The joint with the longest way keeps the speed and the acceleration that were asked for; all arrive together.
#[test]
fn a_motion_of_joints_has_their_pace() {
    let mut rig = rig();
    let from = rig.controller.robot().joints_rad;
    let to = [from[0] + 0.5, from[1], from[2] - 0.25, from[3], from[4], from[5] + 0.1];
    rig.controller.run_script(&format!("def my_program():\n  movej({to:?}, a=1.0, v=0.4)\nend\n"));
    let (mut fastest, mut hardest, mut last) = (0.0_f64, 0.0_f64, 0.0);
    let took_s = rig.until(|c| c.program_title().is_none());
    assert_eq!(rig.controller.robot().joints_rad, to);
    // 0.4 s to speed up and as long to brake over 0.08 rad each, the rest at 0.4 rad/s.
    assert!((took_s - (0.8 + (0.5 - 0.16) / 0.4)).abs() < 0.02, "{took_s} s");
    assert!(apart_m(&rig) < 1e-9);
    let mut rig = super::rig();
    rig.controller.run_script(&format!("def my_program():\n  movej({to:?}, a=1.0, v=0.4)\nend\n"));
    for _ in 0..1000 {
        rig.step();
        let speed = rig.controller.robot().joint_speeds_rad_s[0];
        fastest = fastest.max(speed.abs());
        hardest = hardest.max((speed - last).abs() / STEP_S);
        last = speed;
    }
    // The last step ends where the way does.
    assert!(fastest < 0.4 + 1e-9 && hardest < 2.5, "{fastest} rad/s, {hardest} rad/s^2");
    let mut rig = with(
        "  thread moves():\n    movej([1, -1, 1, -1, -1, 0])\n  end\n  h = run moves()\n  sleep(0.5)\n  kill h\n  stopj(2)\n",
    );
    rig.until(|c| c.program_title().is_none());
    assert!(rig.stands_still());
    assert_eq!(rig.controller.robot().joint_speeds_rad_s, [0.0; 6]);
}

/// With its links nearly stretched an arm is slow, or a joint is too fast; with them stretched it is at its end.
#[test]
fn a_line_that_leaves_the_reach_ends_in_a_protective_stop() {
    let ends = |speed_m_s: f64| {
        let mut rig = with(&format!(
            "  movel(p[0.88, 0, 0.2, 0, 0, 0])\n  movel(p[1.6, 0, 0.2, 0, 0, 0], a=0.5, v={speed_m_s})\n"
        ));
        rig.until(|c| c.robot().safety == SafetyStatus::ProtectiveStop);
        rig.run(0.3);
        assert!(rig.stands_still());
        assert!(apart_m(&rig) < 1e-9);
        (told(&rig), rig.controller.robot().tcp.position_m[0])
    };
    let (words, slowly_m) = ends(0.001);
    assert!(words.contains("no joints of a UR5e carry its flange to"), "{words}");
    let (words, fast_m) = ends(0.2);
    assert!(
        words.contains("joint 3 would turn at")
            && words.contains(&format!("{MAX_SPEED_RAD_S:.1} rad/s are the most")),
        "{words}"
    );
    assert!(fast_m < slowly_m && slowly_m < 0.9, "{fast_m} m and {slowly_m} m");
}

/// Close to its own axis the base would have to turn half around at once.
#[test]
fn a_line_through_a_singularity_ends_in_a_protective_stop() {
    let mut rig =
        with("  movel(p[0.3, 0.136, 0.6, 0, 0, 0])\n  movel(p[-0.3, 0.136, 0.6, 0, 0, 0], a=2, v=0.5)\n");
    rig.until(|c| c.robot().safety == SafetyStatus::ProtectiveStop);
    assert!(told(&rig).contains(" would turn at "), "{}", told(&rig));
    rig.run(0.3);
    assert!(rig.stands_still());
}

/// What is called the tool's pose is another with another tool, the arm has not moved.
#[test]
fn another_tool_leaves_the_joints_where_they_are() {
    let mut rig = with("  set_tcp(p[0, 0, 0.15, 0, 0, 0])\n");
    let before = rig.controller.robot().joints_rad;
    rig.run(0.1);
    let robot = rig.controller.robot();
    assert_eq!(robot.joints_rad, before);
    // The tool points up here: 50 mm of it are gone.
    assert!((robot.tcp.position_m[2] - (START.position_m[2] - 0.05)).abs() < 1e-9, "{:?}", robot.tcp);
    let mut rig = with("  set_tcp(p[0, 0, 0.15, 0, 0.1, 0])\n");
    rig.run(0.1);
    assert!(told(&rig).contains("a tool that is turned at the flange"));
    assert!(matches!(rig.told.last(), Some(Announcement::Stopped { .. })));
}
