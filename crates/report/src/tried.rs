//! The page and the picture of a part whose grips were tried.

mod picture;

use crate::page::{Page, Table};
use crate::picture::grips::grip_picture;
use crate::{Mark, Plot, Rasterise, Series};
use gripgen_record::encode_png;
use gripgen_twin::{Jaw, PerJaw, Proposal, TactileImage, TriMesh};
pub use picture::tried_picture;

/// Points of a line.
const POINTS: usize = 400;

/// A part that was tried.
#[derive(Debug, Clone)]
pub struct TriedPart {
    /// Its name: that of the file.
    pub name: String,
    /// Extent along the axes of the mesh.
    pub size_mm: [f64; 3],
    /// What is to be said of the mesh, a sentence each.
    pub mesh_words: Vec<String>,
    /// The mesh, in metres.
    pub mesh: TriMesh,
    /// The friction that was assumed.
    pub mu: FrictionRange,
    /// The same in words.
    pub friction: String,
    /// What a sweep may vary.
    pub varies: String,
    /// The grips, the best first.
    pub grips: Vec<GripTried>,
    /// Grips that were tried.
    pub tried: usize,
    /// Those of them that were found to work; some or all of them are shown.
    pub found: usize,
}

/// Friction between a gel and a part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FrictionRange {
    /// Lower end.
    pub low: f64,
    /// What is expected.
    pub value: f64,
    /// Upper end.
    pub high: f64,
    /// Whether it was measured.
    pub is_measured: bool,
}

/// A grip that was tried.
#[derive(Debug, Clone)]
pub struct GripTried {
    /// Its place among the grips found.
    pub grip_pose: usize,
    /// Where it is.
    pub proposal: Proposal,
    /// Force of a jaw at which the images were made.
    pub force_n: f64,
    /// What the cameras see.
    pub images: PerJaw<TactileImage>,
    /// What it is expected to hold, by grip force.
    pub holding: Vec<Holding>,
    /// Where it fails, a sentence each.
    pub fails: Vec<String>,
    /// What is doubtful of it where it works, a sentence each.
    pub doubts: Vec<String>,
    /// The same as numbers: angle, offset and the largest force of a jaw that works there, of 10, 20 and 40 N.
    pub works: Vec<WorksAt>,
}

/// What a grip is expected to hold.
#[derive(Debug, Clone, PartialEq)]
pub struct Holding {
    /// Force of a jaw.
    pub grip_force_n: f64,
    /// Lower end, expected value and upper end of the pull at slip; why there is none.
    pub max_pull_force_n: Result<[f64; 3], String>,
}

/// The largest force that works at a place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WorksAt {
    /// Grip angle.
    pub grip_angle_deg: f64,
    /// Offset of the grip.
    pub grip_offset_mm: f64,
    /// The largest force of a jaw that was tried and works; 0 if none does.
    pub largest_n: f64,
}

impl GripTried {
    /// Grip forces at which it holds, with the lower end, the expected value and the upper end of the pull.
    fn holds(&self) -> Vec<(f64, [f64; 3])> {
        let holding = self.holding.iter();
        holding.filter_map(|h| Some((h.grip_force_n, *h.max_pull_force_n.as_ref().ok()?))).collect()
    }
}

/// One page with a section for each grip.
pub fn tried_page(part: &TriedPart, rasterise: &Rasterise<'_>) -> String {
    let [x_mm, y_mm, z_mm] = part.size_mm;
    let mut facts = vec![
        ("size", format!("{x_mm:.1} x {y_mm:.1} x {z_mm:.1} mm")),
        ("grips", format!("{} found of {} that were tried", part.found, part.tried)),
        ("friction", part.friction.clone()),
        ("a sweep may vary", part.varies.clone()),
    ];
    facts.extend(part.mesh_words.iter().map(|words| ("mesh", words.clone())));
    let mut page = Page::new(&format!("{}: grips that were tried", part.name));
    page.text(&part.grips.first().map_or_else(String::new, |best| sentence(part, best)));
    page.facts(&facts);
    for grip in &part.grips {
        section(&mut page, part, grip, rasterise);
    }
    page.html()
}

/// What the best grip is expected to hold.
fn sentence(part: &TriedPart, grip: &GripTried) -> String {
    let held = grip.holds().into_iter().find(|(force_n, _)| *force_n == grip.force_n);
    let Some((force_n, [low, value, high])) = held else { return String::new() };
    let why = if part.mu.is_measured { "repetitions scatter" } else { "its friction is not known" };
    format!(
        "At {force_n} N a jaw, grip {} is expected to hold {value:.1} N: {low:.1} to {high:.1} N, as {why}.",
        grip.grip_pose
    )
}

fn section(page: &mut Page, part: &TriedPart, grip: &GripTried, rasterise: &Rasterise<'_>) {
    let doubts: String = grip.doubts.iter().map(|words| format!(" Warning: {words}.")).collect();
    let about = format!(
        "{:.1} mm between the jaws, {:.0} mm2 in contact, middle of mass {:.1} mm beside the jaw axis. {}{doubts}",
        grip.proposal.width_mm,
        grip.proposal.contact_mm2,
        grip.proposal.lever_mm,
        if grip.fails.is_empty() {
            "It works at all angles, offsets and forces that were tried."
        } else {
            "What would fail stands in the tables."
        }
    );
    page.section(&format!("Grip {}", grip.grip_pose), &about);
    let drawn = grip_picture(&part.mesh, (grip.grip_pose, &grip.proposal), rasterise);
    let mut figures = vec![("the part between the jaws".to_string(), drawn)];
    figures.extend(Jaw::BOTH.into_iter().map(|jaw| {
        let png = encode_png(&grip.images[jaw]).expect("an RGB image can be encoded");
        (format!("{jaw} jaw at {} N, without noise", grip.force_n), png)
    }));
    page.figures(&figures, &[plot(grip)], POINTS);
    page.part("Pull at slip", "In newtons, in the middle of the part, not turned.");
    page.table(&forces_table(grip));
    if !grip.fails.is_empty() {
        page.part(
            "Where it works",
            "The largest force of a jaw that works, of 10, 20 and 40 N, by grip angle and grip offset.",
        );
        page.table(&places_table(grip));
        page.part("What would fail", "One reason for each angle and force.");
        page.table(&Table::new(&["where, and why"], grip.fails.iter().map(|words| vec![words.clone()])));
    }
}

fn plot(grip: &GripTried) -> Plot {
    let holds = grip.holds();
    let over = |at: usize| holds.iter().map(move |(n, pull)| (*n, pull[at]));
    let series = vec![
        Series::line("expected", over(1)),
        Series::new("what friction may be", Mark::Band, over(0).chain(over(2).rev())),
    ];
    Plot::new("what it is expected to hold", "grip force of a jaw, N", "pull at slip, N", series)
}

fn forces_table(grip: &GripTried) -> Table {
    let row = |h: &Holding| {
        let (pulls, why) = match &h.max_pull_force_n {
            Ok(pulls) => (pulls.map(|n| format!("{n:.1}")), String::new()),
            Err(why) => (["fails"; 3].map(String::from), why.clone()),
        };
        [vec![format!("{} N", h.grip_force_n)], pulls.to_vec(), vec![why]].concat()
    };
    Table::new(&["grip force", "from", "expected", "to", ""], grip.holding.iter().map(row))
}

/// The largest force that works, by angle and offset.
fn places_table(grip: &GripTried) -> Table {
    let all = |of: fn(&WorksAt) -> f64| {
        let mut values: Vec<f64> = grip.works.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        values.dedup();
        values
    };
    let (angles, offsets) = (all(|w| w.grip_angle_deg), all(|w| w.grip_offset_mm));
    let cell = |angle: f64, offset: f64| {
        let found = grip.works.iter().find(|w| w.grip_angle_deg == angle && w.grip_offset_mm == offset);
        found.map_or_else(String::new, |w| {
            if w.largest_n > 0.0 { format!("{} N", w.largest_n) } else { "fails".into() }
        })
    };
    let row = |&angle: &f64| {
        let cells = offsets.iter().map(|&offset| cell(angle, offset));
        std::iter::once(format!("{angle} degrees")).chain(cells).collect()
    };
    let head = std::iter::once("angle".to_string()).chain(offsets.iter().map(|mm| format!("{mm} mm")));
    Table { head: head.collect(), rows: angles.iter().map(row).collect(), ..Table::default() }
}
