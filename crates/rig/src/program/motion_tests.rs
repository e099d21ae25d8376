use super::*;

fn motion() -> MotionProgram {
    MotionProgram {
        run: 4,
        target: TcpPose { position_m: [0.3, -0.2, 0.25], rotation_rad: [0.0, 1.25, 0.0] },
        speed_mm_s: 100.0,
        abort_force_n: 20.0,
        max_time_s: 20.0,
        payload_kg: 1.6,
        centre_of_gravity_mm: [0.0, 0.0, 80.0],
        tool_mm: [0.0, 0.0, 200.0],
    }
}

#[test]
fn every_way_out_of_a_motion_kills_it_and_stops() {
    let text = motion().script().unwrap();
    let (kill, stop) = (text.find("kill handle").unwrap(), text.find("stopl(").unwrap());
    assert!(text.find("movel(").unwrap() < kill && kill < stop);
    assert!(text.find("rtde_set_watchdog").unwrap() < text.find("movel(").unwrap());
    use StopReason::{Arrived, Force, Host, Time, Unreachable};
    for reason in [Force, Host, Time, Arrived, Unreachable] {
        assert!(text.contains(&format!("reason = {}\n", reason as i32)), "{}", reason.meaning());
    }
    assert!(!text.contains("break") && !text.contains("return") && !text.contains("halt"));
}

#[test]
fn nothing_beyond_the_limits_becomes_a_motion() {
    let refused = |of: fn(&mut MotionProgram)| {
        let mut motion = motion();
        of(&mut motion);
        motion.script().unwrap_err().to_string()
    };
    assert!(refused(|m| m.speed_mm_s = 1000.0).contains("1000 mm/s, it must be from 1 to 500"));
    assert!(refused(|m| m.target.position_m[2] = 2.0).contains("the target is 2 m"));
    assert!(refused(|m| m.target.rotation_rad[0] = f64::NAN).contains("NaN"));
    assert!(refused(|m| m.abort_force_n = 0.0).contains("0 N"));
}
