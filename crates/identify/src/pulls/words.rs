//! What a diagnosis says to people.

/// What tells effects apart, for people.
pub(super) fn separation(name: &str, rivals: &[&str]) -> String {
    let any = |ids: &[&str]| ids.iter().any(|id| *id == name || rivals.contains(id));
    let mut steps: Vec<&str> = Vec::new();
    if any(&["sensor_bias", "sensor_drift"]) {
        steps.push("record half a second without load before every pull");
        steps.push("pull the same grip down as well as up");
    }
    if any(&["grip_force_loss", "load_offset"]) {
        steps.push(
            "measure the grip force with a load cell at 5, 20 and 80 N, and pull with the jaws just touching",
        );
    }
    if any(&["rate_dependence", "load_power_law", "sensor_lowpass"]) {
        steps.push("pull two grip forces with steps a fifth and five times as fast");
    }
    if any(&["regime_transition", "area_saturation", "load_power_law"]) {
        steps.push("add grip forces below 20 N and above 60 N");
    }
    if any(&["sensor_gain", "controller_gain", "sensor_quadratic", "sensor_saturation", "jaw_tilt"]) {
        steps.push("hang two known masses on the gripper");
    }
    if any(&["wear", "sensor_gain_drift", "temperature", "conditioning", "contamination", "sensor_drift"]) {
        steps.push("pause 30 min without pulls, then repeat the first grip 5 times");
    }
    if any(&["dwell_ageing", "grip_relaxation"]) {
        steps.push("dwell 1, 10 and 100 s, once holding the force and once the width");
    }
    if steps.is_empty() {
        steps.push("repeat the campaign with every covariate varied in random order");
    }
    steps.join("; ")
}
