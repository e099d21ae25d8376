//! The page of a part that was tried.

use super::{GripTried, TriedPart, friction_words};
use crate::part::init::drawing::grip_picture;
use crate::part::init::{ANGLES_DEG, Searched};
use gripgen::report::{Mark, PageFigure, PageSection, PageTable, Plot, Series, sections_page};
use gripgen_record::encode_png;
use gripgen_twin::Jaw;

/// One page with a section for each grip.
pub(super) fn page(part: &TriedPart, searched: &Searched) -> String {
    let varied = &searched.proposed.varied;
    let list = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    let mut facts = vec![
        ("size", searched.size()),
        ("grips", format!("{} found of {} that were tried", searched.proposed.grips.len(), part.tried)),
        ("friction", friction_words(part.mu)),
        (
            "a sweep may vary",
            format!(
                "{} to {} N of a jaw, offsets with a deviation of {} mm, angles of {} degrees",
                varied.grip_force_n.0,
                varied.grip_force_n.1,
                varied.grip_offset_sd_mm,
                list(&varied.grip_angle_deg)
            ),
        ),
    ];
    facts.extend(part.mesh_words.iter().map(|words| ("mesh", words.clone())));
    let sentence = part.grips.first().map_or_else(String::new, |best| sentence(part, best));
    let sections: Vec<PageSection> = part.grips.iter().map(|grip| section(grip, searched)).collect();
    sections_page(&format!("{}: grips that were tried", part.name), &sentence, &facts, &sections)
}

/// What the best grip is expected to hold.
fn sentence(part: &TriedPart, grip: &GripTried) -> String {
    let at_force = grip.holding.iter().find(|h| h.grip_force_n == grip.force_n);
    let held = at_force.and_then(|h| h.max_pull_force_n.as_ref().ok());
    let Some([low, value, high]) = held else { return String::new() };
    let why = if part.mu.is_measured { "repetitions scatter" } else { "its friction is not known" };
    format!(
        "At {} N a jaw, grip {} is expected to hold {value:.1} N: {low:.1} to {high:.1} N, as {why}.",
        grip.force_n, grip.grip_pose
    )
}

fn section(grip: &GripTried, searched: &Searched) -> PageSection {
    let p = &grip.proposal;
    let drawn = grip_picture(grip.grip_pose, &searched.mesh, p);
    let mut figures = vec![PageFigure { caption: "the part between the jaws".into(), png: drawn }];
    figures.extend(Jaw::BOTH.into_iter().map(|jaw| PageFigure {
        caption: format!("{jaw} jaw at {} N, without noise", grip.force_n),
        png: encode_png(&grip.images[jaw]).expect("an RGB image can be encoded"),
    }));
    let doubts: String = grip.doubts.iter().map(|words| format!(" Warning: {words}.")).collect();
    let about = format!(
        "{:.1} mm between the jaws, {:.0} mm2 in contact, middle of mass {:.1} mm beside the jaw axis. {}{doubts}",
        p.width_mm,
        p.contact_mm2,
        p.lever_mm,
        if grip.fails.is_empty() {
            "It works at all angles, offsets and forces that were tried.".to_string()
        } else {
            "What would fail stands in the tables.".to_string()
        }
    );
    let tables = [forces_table(grip), places_table(grip), fails_table(grip)].into_iter().flatten().collect();
    PageSection { title: format!("Grip {}", grip.grip_pose), about, figures, plots: vec![plot(grip)], tables }
}

fn plot(grip: &GripTried) -> Plot {
    let holds: Vec<(f64, [f64; 3])> = grip
        .holding
        .iter()
        .filter_map(|h| Some((h.grip_force_n, *h.max_pull_force_n.as_ref().ok()?)))
        .collect();
    let over = |at: usize| holds.iter().map(move |(n, pull)| (*n, pull[at]));
    let band: Vec<(f64, f64)> = over(0).chain(over(2).collect::<Vec<_>>().into_iter().rev()).collect();
    let series = |name: &str, mark, points| Series { name: name.into(), mark, points, errors: vec![] };
    Plot {
        title: "what it is expected to hold".into(),
        x_label: "grip force of a jaw, N".into(),
        y_label: "pull at slip, N".into(),
        x_words: vec![],
        series: vec![
            series("expected", Mark::Line, over(1).collect()),
            series("what friction may be", Mark::Band, band),
        ],
    }
}

fn forces_table(grip: &GripTried) -> Option<PageTable> {
    let row = |h: &super::Holding| {
        let force = format!("{} N", h.grip_force_n);
        match &h.max_pull_force_n {
            Ok(pull) => [vec![force], pull.map(|n| format!("{n:.1}")).to_vec(), vec![String::new()]].concat(),
            Err(why) => {
                vec![force, "fails".into(), "fails".into(), "fails".into(), why.clone()]
            }
        }
    };
    Some(PageTable {
        title: "Pull at slip".into(),
        about: "In newtons, in the middle of the part, not turned.".into(),
        head: ["grip force", "from", "expected", "to", ""].map(String::from).to_vec(),
        rows: grip.holding.iter().map(row).collect(),
    })
}

/// The largest force that works, by angle and offset; nothing where all do.
fn places_table(grip: &GripTried) -> Option<PageTable> {
    if grip.fails.is_empty() {
        return None;
    }
    let mut offsets: Vec<f64> = grip.works.iter().map(|w| w.grip_offset_mm).collect();
    offsets.sort_by(f64::total_cmp);
    offsets.dedup();
    let cell = |angle: f64, offset: f64| {
        let found = grip.works.iter().find(|w| w.grip_angle_deg == angle && w.grip_offset_mm == offset);
        found.map_or_else(String::new, |w| {
            if w.largest_n > 0.0 { format!("{} N", w.largest_n) } else { "fails".into() }
        })
    };
    Some(PageTable {
        title: "Where it works".into(),
        about: "The largest force of a jaw that works, of 10, 20 and 40 N, by grip angle and grip offset."
            .into(),
        head: std::iter::once("angle".to_string())
            .chain(offsets.iter().map(|mm| format!("{mm} mm")))
            .collect(),
        rows: ANGLES_DEG
            .iter()
            .map(|&angle| {
                let cells = offsets.iter().map(|&offset| cell(angle, offset));
                std::iter::once(format!("{angle} degrees")).chain(cells).collect()
            })
            .collect(),
    })
}

fn fails_table(grip: &GripTried) -> Option<PageTable> {
    (!grip.fails.is_empty()).then(|| PageTable {
        title: "What would fail".into(),
        about: "One reason for each angle and force.".into(),
        head: vec!["where, and why".into()],
        rows: grip.fails.iter().map(|sentence| vec![sentence.clone()]).collect(),
    })
}
