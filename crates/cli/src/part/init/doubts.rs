//! Grips that work and are doubtful: hardly a contact, one at the rim of a pad, deep in the gel, or gels that meet next to the part.

use super::Proposal;
use super::pose::GripAt;
use super::seen::{Pressed, Viewer};
use super::trial::Varied;
use gripgen_twin::{Jaw, PerJaw};

/// A contact smaller than this is the tip of something.
const LEAST_MM2: f64 = 1.0;
/// Share of the gel's thickness beyond which a press is deep: the image model knows shallow ones.
const DEEP: f64 = 0.5;

/// What is doubtful of each grip in the middle of the forces, a sentence each.
pub(super) fn doubts(viewer: &Viewer<'_>, grips: &[Proposal], varied: &Varied) -> Vec<Vec<String>> {
    let force_n = (varied.grip_force_n.0 + varied.grip_force_n.1) / 2.0;
    grips.iter().map(|grip| of_grip(viewer, grip, force_n)).collect()
}

fn of_grip(viewer: &Viewer<'_>, grip: &Proposal, force_n: f64) -> Vec<String> {
    let at = GripAt { origin_mm: grip.origin_mm, orientation_deg: grip.orientation_deg };
    let Ok(pressed) = PerJaw::try_from_fn(|jaw| viewer.pressed(&at, jaw, force_n)) else { return vec![] };
    let thickness_mm = Jaw::BOTH.map(|jaw| viewer.twin.gel[jaw].thickness_m * 1e3);
    said(&pressed, thickness_mm, grip.width_mm, force_n)
}

fn said(pressed: &PerJaw<Pressed>, thickness_mm: [f64; 2], width_mm: f64, force_n: f64) -> Vec<String> {
    let both = [&pressed.left, &pressed.right];
    let mut words = Vec::new();
    let area_mm2 = both.iter().fold(f64::INFINITY, |least, p| least.min(p.area_m2 * 1e6));
    if area_mm2 < LEAST_MM2 {
        words.push(format!(
            "{area_mm2:.2} mm2 in contact at {force_n} N, less than {LEAST_MM2} mm2: the pressure there is beyond what a gel bears"
        ));
    }
    let depths_mm = both.map(|p| p.depth_m * 1e3);
    let (deep_mm, of_mm) = if depths_mm[0] / thickness_mm[0] >= depths_mm[1] / thickness_mm[1] {
        (depths_mm[0], thickness_mm[0])
    } else {
        (depths_mm[1], thickness_mm[1])
    };
    if deep_mm > DEEP * of_mm {
        words.push(format!(
            "{force_n} N press it {deep_mm:.1} mm into {of_mm:.1} mm of gel, deeper than half: images and imprints are an extrapolation"
        ));
    }
    for (pressed, thickness_mm) in both.into_iter().zip(thickness_mm) {
        let rim_mm = pressed.rim_m * 1e3;
        if rim_mm < thickness_mm {
            words.push(format!(
                "the centre of its contact is {rim_mm:.1} mm from the rim of the pad, less than the {thickness_mm:.1} mm of gel: \
                 a gel gives way more there than the model says"
            ));
            break;
        }
    }
    let both_mm = depths_mm[0] + depths_mm[1];
    if both_mm > width_mm {
        words.push(format!(
            "at {force_n} N the gels meet beside it, which is not modelled: they are pressed in by {both_mm:.1} mm together, it is \
             {width_mm:.1} mm thick there"
        ));
    }
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sound_grip_has_nothing_doubtful_and_each_doubt_has_both_numbers() {
        let at = |rim_mm: f64, area_mm2: f64, depth_mm: f64, width_mm: f64| {
            let pressed =
                || Pressed { area_m2: area_mm2 * 1e-6, depth_m: depth_mm * 1e-3, rim_m: rim_mm * 1e-3 };
            said(&PerJaw { left: pressed(), right: pressed() }, [4.0; 2], width_mm, 22.5)
        };
        let of = |area_mm2, depth_mm, width_mm| at(9.0, area_mm2, depth_mm, width_mm);
        assert_eq!(of(100.0, 0.4, 10.0), Vec::<String>::new());
        let tip = of(0.3, 0.4, 10.0);
        assert!(tip.len() == 1 && tip[0].contains("0.30 mm2") && tip[0].contains("1 mm2"), "{tip:?}");
        let deep = of(40.0, 2.2, 10.0);
        assert!(deep.len() == 1 && deep[0].contains("2.2 mm into 4.0 mm"), "{deep:?}");
        let rim = at(1.5, 40.0, 0.4, 10.0);
        assert!(
            rim.len() == 1 && rim[0].contains("1.5 mm from the rim") && rim[0].contains("4.0 mm"),
            "{rim:?}"
        );
        let thin = of(40.0, 1.6, 0.6);
        assert!(thin.len() == 1 && thin[0].contains("3.2 mm") && thin[0].contains("0.6 mm"), "{thin:?}");
    }
}
