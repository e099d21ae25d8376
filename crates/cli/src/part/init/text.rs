//! Words and TOML of what was found.

use super::trial::{ANGLES_DEG, Varied};
use super::{IMPRINT_MM3_PER_N, MU, PartOptions, Proposal, StarterPart};
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

/// What every part stands: the narrowest of each. Where two have no angle in common, the first of the first.
pub(super) fn narrowest<'a>(all: impl Iterator<Item = &'a Varied>) -> Varied {
    let both = |a: Varied, b: &Varied| {
        let common: Vec<f64> =
            a.grip_angle_deg.iter().copied().filter(|angle| b.grip_angle_deg.contains(angle)).collect();
        Varied {
            grip_force_n: (a.grip_force_n.0.max(b.grip_force_n.0), a.grip_force_n.1.min(b.grip_force_n.1)),
            grip_offset_sd_mm: a.grip_offset_sd_mm.min(b.grip_offset_sd_mm),
            grip_angle_deg: if common.is_empty() { vec![a.grip_angle_deg[0]] } else { common },
        }
    };
    let mut all = all.cloned();
    let first = all.next().expect("a starter has a part");
    all.fold(first, |a, b| both(a, &b))
}

/// The parts in a sentence.
pub(super) fn listed(parts: &[StarterPart]) -> String {
    let each: Vec<String> = parts.iter().map(|part| format!("{} ({})", part.name, part.size)).collect();
    each.join(", ")
}

/// The prior of a friction coefficient that was measured, in place of the shipped one.
pub(super) fn mu_known(mu: Option<f64>) -> String {
    let line = |mu: f64| {
        format!(
            "\"parts.*.mu\" = {{ log_normal = [{mu:?}, 0.05], per = [\"rig\", \"part\"], spread = {{ gel = 0.12, session = 0.08, grip = 0.08 }} }}   # --mu\n"
        )
    };
    mu.map(line).unwrap_or_default()
}

/// The section of a part in the twin.
pub(super) fn part_section(
    name: &str,
    mesh: &str,
    size: &str,
    options: PartOptions,
    proposals: &[Proposal],
) -> String {
    let mu_is = match options.mu {
        Some(_) => "as it was given to `gripgen init --mu`",
        None => "an assumption: measure it with a few pulls",
    };
    format!(
        "[parts.{name}]                # {size}\nmesh = {mesh:?}\nscale_mm_per_unit = {:?}\nmu = {:?}                   # {mu_is}\n\
         scatter = 0.04              # an assumption: repetitions of such pulls scatter by 3 to 7 %\n\
         imprint_mm3_per_n = {IMPRINT_MM3_PER_N:?}     # an assumption\n\n{}\n",
        options.scale_mm_per_unit,
        options.mu.unwrap_or(MU),
        grips_toml(name, proposals)
    )
}

/// A comment for the sweep that says what was left out.
pub(super) fn narrowed_comment(varied: &Varied, parts: &[StarterPart]) -> String {
    let Some(left_out) = narrowed(varied) else { return String::new() };
    let failing = parts.iter().find_map(|part| Some((&part.name, part.proposed.failure.as_ref()?)));
    let why = failing.map_or_else(|| "they fail".into(), |(name, why)| format!("of {name}: {why}"));
    format!("# Left out, because grips fail there: {left_out}.\n# The first that failed {why}.\n")
}

/// What to do with what was written.
pub(super) const LOOK: &str =
    "look at the pictures of the grips; friction and imprint constant in twin.toml are assumptions\n";

pub(super) fn summary(part: &StarterPart) -> String {
    let StarterPart { name, size, mesh_words, proposed } = part;
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
    text
}
