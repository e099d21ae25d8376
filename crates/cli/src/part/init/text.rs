//! Words and TOML of what was found.

use super::Proposal;
use super::propose::Proposed;
use super::trial::{ANGLES_DEG, Varied};
use std::fmt::Write as _;

pub(super) fn grips_toml(part: &str, proposals: &[Proposal]) -> String {
    let mut text = String::new();
    for (i, p) in proposals.iter().enumerate() {
        let _ = write!(
            text,
            "[[parts.{part}.grips]]     # grip_pose = {i}: {:.1} mm between the jaws\norigin_mm = {:?}\norientation_deg = {:?}\n\n",
            p.width_mm, p.origin_mm, p.orientation_deg
        );
    }
    text.trim_end().to_string()
}

pub(super) fn pose_list(n: usize) -> String {
    let poses: Vec<String> = (0..n).map(|i| i.to_string()).collect();
    format!("[{}]", poses.join(", "))
}

/// Numbers as a TOML array, whole ones without a point.
pub(super) fn numbers(values: &[f64]) -> String {
    let values: Vec<String> = values.iter().map(f64::to_string).collect();
    format!("[{}]", values.join(", "))
}

/// What was left out of the sweep, and why; `None` of the widest.
fn narrowed(varied: &Varied) -> Option<String> {
    let mut left_out = Vec::new();
    if varied.grip_force_n.1 < 40.0 {
        left_out.push(format!("forces above {} N", varied.grip_force_n.1));
    }
    if varied.grip_offset_sd_mm < 1.0 {
        left_out.push(format!("offsets spread by more than {} mm", varied.grip_offset_sd_mm));
    }
    let angles: Vec<f64> =
        ANGLES_DEG.into_iter().filter(|angle| !varied.grip_angle_deg.contains(angle)).collect();
    if !angles.is_empty() {
        left_out.push(format!("angles of {} degrees", numbers(&angles)));
    }
    (!left_out.is_empty()).then(|| left_out.join(", "))
}

/// A comment for the sweep that says what was left out.
pub(super) fn narrowed_comment(proposed: &Proposed) -> String {
    let Some(left_out) = narrowed(&proposed.varied) else { return String::new() };
    let why = proposed.failure.as_deref().unwrap_or("they fail");
    format!("# Left out, because grips fail there: {left_out}.\n# The first that failed: {why}.\n")
}

pub(super) fn summary(name: &str, size: &str, mesh_words: &[String], proposed: &Proposed) -> String {
    let n = proposed.grips.len();
    let mut text = format!("{name}: {size}, {n} of {} grips that were tried are proposed\n", proposed.tried);
    for words in mesh_words {
        let _ = writeln!(text, "note: {words}");
    }
    for (i, p) in proposed.grips.iter().enumerate() {
        let [ox, oy, oz] = p.origin_mm.map(|x| (x * 10.0).round() / 10.0 + 0.0);
        let _ = write!(
            text,
            "grip {i}: {:.1} mm between the jaws at [{ox:.1}, {oy:.1}, {oz:.1}] mm, {:.0} mm2 in contact, middle of mass {:.1} mm \
             beside the jaw axis",
            p.width_mm, p.contact_mm2, p.lever_mm
        );
        if p.clearance_mm < -0.05 {
            let _ =
                write!(text, "; beside the pads the part rises {:.1} mm towards a finger", -p.clearance_mm);
        }
        text.push('\n');
    }
    for (i, words) in proposed.doubts.iter().enumerate().flat_map(|(i, all)| all.iter().map(move |w| (i, w)))
    {
        let _ = writeln!(text, "warning: grip {i}: {words}");
    }
    if let Some(left_out) = narrowed(&proposed.varied) {
        let why = proposed.failure.as_deref().unwrap_or("they fail");
        let _ = writeln!(text, "left out of the sweep, because grips fail there: {left_out} ({why})");
    }
    text + "look at grips.png; friction and imprint constant in twin.toml are assumptions\n"
}
