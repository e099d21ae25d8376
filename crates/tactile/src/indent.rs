//! Stage `indent`: how deep the part sinks into the gel, and the pressure that follows.

pub(crate) mod press;

use crate::convolve::Area;
use crate::deform::Edges;
use crate::grid::{Grid, Plane};
use crate::patch::{CellPlaces, aggregate};
use crate::raster::{ClusteredMesh, HeightMap};
use crate::simd::{Kernel, Lanes, SimdLevel};
use gripgen_twin::{ContactPatch, Gel};

/// The part pressed into the gel.
#[derive(Debug, Clone, PartialEq)]
pub struct Imprint {
    /// Depth of each pixel of the part's surface below the unloaded gel surface, in pixels; 0 without contact.
    pub depth_px: Plane,
    /// Depths within the pixels beside its steps.
    pub edges: Edges,
    /// Largest depth.
    pub press_depth_m: f64,
    /// How far the part went into the gel from the pose it was pressed at: depth is height plus this.
    pub lift_m: f64,
    /// The pressure field as a few cells, from the centres of pixels.
    pub patch: ContactPatch,
    /// Where these cells are in the image.
    pub places: CellPlaces,
    /// Surface and pressure, if the gel is elastic.
    pub elastic: Option<ElasticField>,
}

/// What the contact with an elastic gel gives beyond an imprint.
#[derive(Debug, Clone, PartialEq)]
pub struct ElasticField {
    /// Height of the gel's surface above its state at rest, towards the camera, in pixels.
    pub surface_px: Plane,
    /// Pressure of part and gel.
    pub pressure_pa: Plane,
}

/// The gel of a press.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PressedGel {
    /// Thickness, the deepest press there can be.
    pub thickness_m: f64,
    /// Imprint constant c of `V = c F`.
    pub imprint_m3_per_n: f64,
    /// Whether it stiffens as it gets thinner: `V = c F (1 - d / t)` at a press of depth d into a thickness of t.
    pub stiffens: bool,
}

impl PressedGel {
    /// The gel of a twin, pressed by a part with this imprint constant.
    pub fn of(gel: &Gel, imprint_m3_per_n: f64) -> Self {
        Self { thickness_m: gel.thickness_m, imprint_m3_per_n, stiffens: gel.stiffens }
    }
}

/// Why a part could not be pressed into the gel.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IndentError {
    /// No surface lies in front of the camera.
    #[error("no surface of the part lies in front of the {width_mm:.1} x {height_mm:.1} mm of gel")]
    NothingInFront {
        /// Width of the window.
        width_mm: f64,
        /// Height of the window.
        height_mm: f64,
    },
    /// The imprint does not fit into the gel.
    #[error(
        "the press is deeper than the gel: {force_n} N need an imprint of {wanted_mm3:.2} mm3, pressed through the \
         whole {thickness_mm:.2} mm of gel it has {available_mm3:.2} mm3"
    )]
    ThroughTheGel {
        /// Normal force.
        force_n: f64,
        /// Volume that the force needs.
        wanted_mm3: f64,
        /// Thickness of the gel, or nine tenths of that of one which stiffens.
        thickness_mm: f64,
        /// Volume at a press that deep.
        available_mm3: f64,
    },
    /// The force presses an elastic gel through.
    #[error(
        "the press is deeper than the gel: {force_n} N press the elastic gel in by {press_mm:.2} mm, it is \
         {thickness_mm:.2} mm thick"
    )]
    DeeperThanTheGel {
        /// Normal force.
        force_n: f64,
        /// Depth of the press.
        press_mm: f64,
        /// Thickness of the gel.
        thickness_mm: f64,
    },
}

/// The error for a window without any surface.
pub(crate) fn nothing_in_front(grid: &Grid) -> IndentError {
    let size = |n: usize| n as f64 * grid.metres_per_px * 1e3;
    IndentError::NothingInFront { width_mm: size(grid.width_px), height_mm: size(grid.height_px) }
}

/// Presses the surface `heights` (in pixels above the gel at rest, towards it) in with `force_n`.
///
/// The imprint volume is proportional to the force, `V = c F` (taxim_robot; Wucherer et al. 2023), and pressure is
/// that of a Winkler bed, `p = depth / c`, so that the pressure integrates to the force. The depth d solves
///
/// ```text
/// a^3 sum max(0, h_i + d) = c F          (a: side of a pixel)
/// ```
///
/// by Newton's method on a convex, piecewise linear function, from the deep side: it converges monotonically and
/// ends exactly, when the set of pixels in contact no longer changes. The result is a function of that set alone.
///
/// A gel that stiffens keeps of the compliance what it keeps of its thickness, `V = c F (1 - d / t)`: a layer on a rigid base that is
/// compressed to the stretch 1 - d / t. The function stays piecewise linear. A press deeper than nine tenths of the thickness is an error. On a ball of 21.3 mm in 5.5 mm of
/// gel V then grows as F^0.76 from 10 to 43 N; rigid bodies in a real gel have 0.8.
///
/// For a gel that is not flat at rest, `heights` are those above the gel plane plus the rest surface
/// ([`crate::GelShape::rest_px`]); [`crate::Renderer::press`] adds it.
///
/// # Errors
///
/// No surface in front of the gel, or a press deeper than the gel.
pub fn indent(heights: &Plane, grid: &Grid, gel: &PressedGel, force_n: f64) -> Result<Imprint, IndentError> {
    let level = SimdLevel::best();
    let map = HeightMap::of(heights);
    let top = map.top(None, level);
    Indentation { grid, gel, force_n, rest: None, level }.finish(&map, top)
}

/// Share of its thickness that a gel which stiffens is pressed in at most: ten times as stiff as at rest. Of what is beyond, a tip that
/// pierces it, the law says nothing.
const DEEPEST: f64 = 0.9;

/// The first piece drawn of a part.
const FIRST_DEPTH_PX: f64 = 4.0;
/// What an estimate of the next piece is enlarged by, and how much deeper than before it is at least.
const MARGIN: f64 = 1.1;
const MIN_GROWTH: f64 = 1.5;

/// A depth, and what a part touches that is pressed in so deep: sum of heights above its highest pixel, and number of pixels.
#[derive(Debug, Clone, Copy)]
struct Press {
    depth_px: f64,
    below: f64,
    count: f64,
}

impl Press {
    /// In cubic pixels.
    fn volume(&self) -> f64 {
        self.below + self.count * self.depth_px
    }
}

fn cube(a: f64) -> f64 {
    a * a * a
}

/// A gel and what presses on it.
pub(crate) struct Indentation<'a> {
    pub(crate) grid: &'a Grid,
    pub(crate) gel: &'a PressedGel,
    pub(crate) force_n: f64,
    /// The surface of the gel at rest; `None` if it is flat.
    pub(crate) rest: Option<&'a Plane>,
    pub(crate) level: SimdLevel,
}

impl Indentation<'_> {
    fn thickness_px(&self) -> f64 {
        self.gel.thickness_m / self.grid.metres_per_px
    }

    /// The deepest press.
    fn deepest_px(&self) -> f64 {
        if self.gel.stiffens { DEEPEST * self.thickness_px() } else { self.thickness_px() }
    }

    /// Volume of the imprint without stiffening, in cubic pixels.
    fn wanted(&self) -> f64 {
        self.gel.imprint_m3_per_n * self.force_n / cube(self.grid.metres_per_px)
    }

    /// Volume that each pixel of depth takes off it, in square pixels; 0 of a gel that does not stiffen.
    fn stiffening(&self) -> f64 {
        if self.gel.stiffens { self.wanted() / self.thickness_px() } else { 0.0 }
    }

    /// Draws a part only as deep as the press reaches, and presses it in. `map` has been started.
    ///
    /// A piece of the part is drawn, and deepened until the volume above its lower end is that of the force. Where that
    /// contact has a step, the pixels beside it are drawn again at nine points each, and pressed in with those. The
    /// imprint is that of the part drawn through the whole gel.
    pub(crate) fn sink(&self, map: &mut HeightMap, mesh: &ClusteredMesh) -> Result<Imprint, IndentError> {
        let (wanted, deepest_px) = (self.wanted(), self.deepest_px());
        let mut depth_px = FIRST_DEPTH_PX.min(deepest_px);
        loop {
            let top = map.draw_down(mesh, depth_px, self.rest, self.level);
            if top == f32::NEG_INFINITY {
                return Err(nothing_in_front(self.grid));
            }
            let press = self.touched(map, top, depth_px);
            let volume = press.volume() + self.stiffening() * depth_px;
            if volume >= wanted {
                return self.smooth(map, mesh, top, press);
            }
            if depth_px >= deepest_px {
                return Err(self.through_the_gel(press.volume()));
            }
            // Deeper than `enough` it cannot be, since more pixels only make it shallower; and on a round part the
            // volume grows with the square of the depth.
            let enough = depth_px + (wanted - volume) / press.count + 1e-6;
            let round = (MARGIN * (wanted / volume).sqrt()).max(MIN_GROWTH);
            depth_px = enough.min(round * depth_px).min(deepest_px);
        }
    }

    /// The imprint of a map that is complete, with the highest pixel `top`.
    fn finish(&self, map: &HeightMap, top: f32) -> Result<Imprint, IndentError> {
        if top == f32::NEG_INFINITY {
            return Err(nothing_in_front(self.grid));
        }
        let whole = self.touched(map, top, self.deepest_px());
        if whole.volume() + self.stiffening() * whole.depth_px < self.wanted() {
            return Err(self.through_the_gel(whole.volume()));
        }
        let press_px = self.settle(whole, |depth_px| self.touched(map, top, depth_px)).depth_px;
        let mut depth_px = Plane::filled(map.width, map.height, 0.0);
        self.write_depths(map, press_px - f64::from(top), &mut depth_px);
        let patch = self.patch(&depth_px);
        Ok(self.imprint((depth_px, Edges::default()), press_px, f64::from(top), patch))
    }

    /// The part `lift_px` deeper than it was drawn, whatever force that takes: depths as those of an imprint, 0 where the part does
    /// not reach. `map` has been started.
    pub(crate) fn lifted(&self, map: &mut HeightMap, mesh: &ClusteredMesh, lift_px: f64) -> (Plane, Edges) {
        let mut depth_px = Plane::filled(map.width, map.height, 0.0);
        let top = map.draw_down(mesh, FIRST_DEPTH_PX, self.rest, self.level);
        let deepest_px = f64::from(top) + lift_px;
        // No part in front of the gel, or one that stays above it.
        if deepest_px.is_nan() || deepest_px <= 0.0 {
            return (depth_px, Edges::default());
        }
        if deepest_px > FIRST_DEPTH_PX {
            map.draw_down(mesh, deepest_px, self.rest, self.level);
        }
        self.write_depths(map, lift_px, &mut depth_px);
        let area = Area::of_positive(&depth_px, self.level);
        let mut edges = Edges::default();
        if map.find_steps(&depth_px, area, self.level) {
            map.draw_steps(mesh, f64::from(top) - MARGIN * deepest_px, self.rest, self.level);
            edges = map.write_steps(lift_px, &mut depth_px, self.level);
        }
        (depth_px, edges)
    }

    /// The imprint of a map that is complete as deep as `limit`, which is deep enough, with the pixels beside steps at
    /// their points.
    fn smooth(
        &self,
        map: &mut HeightMap,
        mesh: &ClusteredMesh,
        top: f32,
        limit: Press,
    ) -> Result<Imprint, IndentError> {
        let by_centres = self.settle(limit, |depth_px| self.touched(map, top, depth_px));
        let mut press_px = by_centres.depth_px;
        let mut depth_px = Plane::filled(map.width, map.height, 0.0);
        let top_px = f64::from(top);
        self.write_depths(map, press_px - top_px, &mut depth_px);
        // Areas and moments are unbiased by pixels that are in contact or not; one whose mean depth is above 0 may be so in part.
        let patch = self.patch(&depth_px);
        let mut edges = Edges::default();
        if map.find_steps(&depth_px, patch.1.area, self.level) {
            let mut limit_px = limit.depth_px;
            // Points change a press little: only what lies so deep is drawn at first.
            let mut drawn_px = limit_px.min(MARGIN * press_px);
            loop {
                map.draw_steps(mesh, top_px - drawn_px, self.rest, self.level);
                let with_steps = |press: Press| {
                    let sums = (press.below, press.count);
                    let (below, count) = map.with_steps(sums, top_px, press.depth_px, self.level);
                    Press { below, count, ..press }
                };
                let touched = |depth_px| with_steps(self.touched(map, top, depth_px));
                press_px = self.settle(with_steps(by_centres), touched).depth_px;
                if press_px <= drawn_px {
                    break;
                }
                if drawn_px >= self.deepest_px() {
                    return Err(self.through_the_gel(touched(drawn_px).volume()));
                }
                if drawn_px >= limit_px {
                    limit_px = (MIN_GROWTH * press_px).min(self.deepest_px());
                    map.draw_down(mesh, limit_px, self.rest, self.level);
                }
                drawn_px = limit_px;
            }
            self.write_depths(map, press_px - top_px, &mut depth_px);
            edges = map.write_steps(press_px - top_px, &mut depth_px, self.level);
        }
        Ok(self.imprint((depth_px, edges), press_px, top_px, patch))
    }

    /// What a press touches by the centres of pixels.
    fn touched(&self, map: &HeightMap, top: f32, depth_px: f64) -> Press {
        let (below, count) = map.touched(self.rest, f64::from(top), depth_px, self.level);
        Press { depth_px, below, count }
    }

    /// Newton's method from a press that is too deep, with what others touch.
    fn settle(&self, from: Press, touched: impl Fn(f64) -> Press) -> Press {
        let mut press = from;
        // Only the first step may go deeper; from there on it is shallower with each.
        let mut deepest_px = f64::INFINITY;
        while press.count >= 1e-9 {
            deepest_px = ((self.wanted() - press.below) / (press.count + self.stiffening())).min(deepest_px);
            let next = touched(deepest_px);
            if next.count == press.count {
                return next;
            }
            press = next;
        }
        press
    }

    fn write_depths(&self, map: &HeightMap, lift: f64, depth_px: &mut Plane) {
        self.level.run(Depths { map, rest: self.rest, lift, depth_px });
    }

    fn patch(&self, depth_px: &Plane) -> (ContactPatch, CellPlaces) {
        aggregate(depth_px, self.grid, self.force_n, self.level)
    }

    fn imprint(
        &self,
        (depth_px, edges): (Plane, Edges),
        press_px: f64,
        top_px: f64,
        (patch, places): (ContactPatch, CellPlaces),
    ) -> Imprint {
        let a = self.grid.metres_per_px;
        let (press_depth_m, lift_m) = (press_px * a, (press_px - top_px) * a);
        Imprint { depth_px, edges, press_depth_m, lift_m, patch, places, elastic: None }
    }

    fn through_the_gel(&self, available: f64) -> IndentError {
        IndentError::ThroughTheGel {
            force_n: self.force_n,
            wanted_mm3: (self.wanted() - self.stiffening() * self.deepest_px())
                * cube(self.grid.metres_per_px)
                * 1e9,
            thickness_mm: self.deepest_px() * self.grid.metres_per_px * 1e3,
            available_mm3: available * cube(self.grid.metres_per_px) * 1e9,
        }
    }
}

/// Writes `height + rest + lift` where that is above 0.
struct Depths<'a> {
    map: &'a HeightMap,
    rest: Option<&'a Plane>,
    lift: f64,
    depth_px: &'a mut Plane,
}

impl Kernel for Depths<'_> {
    type Output = ();
    #[inline(always)]
    unsafe fn run<L: Lanes>(self) {
        let area = self.map.area;
        let mut sums = Vec::new();
        for y in area.y.0..area.y.1 {
            let row = &mut self.depth_px.values[y * self.map.width..][area.x.0..area.x.1];
            for (depth, &h) in row.iter_mut().zip(self.map.above_gel(self.rest, y, &mut sums)) {
                let d = f64::from(h) + self.lift;
                *depth = if d > 0.0 { d as f32 } else { 0.0 };
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { width_px: 200, height_px: 160, metres_per_px: 5e-5 };
    const GEL: PressedGel = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };

    fn heights(f: impl Fn(f64, f64) -> f64) -> Plane {
        GRID.plane(|x, y| f(x, y) / GRID.metres_per_px)
    }

    /// The volume of a spherical cap is `pi d^2 (R - d / 3)`.
    #[test]
    fn a_ball_sinks_in_by_its_cap() {
        let radius = 4e-3_f64;
        let ball = heights(|x, y| (radius * radius - x * x - y * y).max(0.0).sqrt() - 7e-3);
        for force in [0.5, 5.0, 15.0] {
            let imprint = indent(&ball, &GRID, &GEL, force).unwrap();
            let d = imprint.press_depth_m;
            let volume = std::f64::consts::PI * d * d * (radius - d / 3.0);
            assert!((volume / (1e-9 * force) - 1.0).abs() < 5e-3, "{force} N: {d} m");
            assert!(
                (imprint.patch.normal_force_n() / force - 1.0).abs() < 1e-12,
                "pressure integrates to force"
            );
        }
    }

    /// `pi d^2 (R - d / 3) = c F (1 - d / t)` also where c F alone would be too much; a pin still goes through.
    #[test]
    fn a_gel_that_stiffens_bears_more() {
        let gel = PressedGel { stiffens: true, ..GEL };
        let radius = 4e-3_f64;
        let ball = heights(|x, y| (radius * radius - x * x - y * y).max(0.0).sqrt() - 7e-3);
        for force in [0.5, 5.0, 15.0, 60.0, 400.0] {
            let d = indent(&ball, &GRID, &gel, force).unwrap().press_depth_m;
            let volume = std::f64::consts::PI * d * d * (radius - d / 3.0);
            let wanted = 1e-9 * force * (1.0 - d / gel.thickness_m);
            assert!((volume / wanted - 1.0).abs() < 7e-3 && d < gel.thickness_m, "{force} N: {d} m");
        }
        let pin = heights(|x, y| if x * x + y * y < 1e-6 { 0.0 } else { f64::NEG_INFINITY });
        let error = indent(&pin, &GRID, &gel, 200.0).unwrap_err().to_string();
        assert!(
            error.contains("need an imprint of 20.00 mm3") && error.contains("3.60 mm of gel"),
            "{error}"
        );
    }

    /// A flat stamp of area A: `p = F / A`, `d = c F / A`.
    #[test]
    fn a_flat_stamp_presses_evenly() {
        let stamp = heights(|x, y| if x.abs() < 2e-3 && y.abs() < 1e-3 { -1e-3 } else { f64::NEG_INFINITY });
        let imprint = indent(&stamp, &GRID, &GEL, 10.0).unwrap();
        let area = 8e-6;
        assert!((imprint.press_depth_m - 1e-9 * 10.0 / area).abs() < 1e-9);
        for cell in &imprint.patch.cells {
            assert!((cell.pressure_pa() / (10.0 / area) - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn pressing_harder_never_makes_the_imprint_smaller() {
        let rough = heights(|x, y| 2e-4 * ((x * 4e3).sin() * (y * 5e3).cos()) - 0.1 * x.abs());
        let mut last = 0.0;
        for i in 1..60 {
            let depth = indent(&rough, &GRID, &GEL, f64::from(i) * 0.5).unwrap().press_depth_m;
            assert!(depth > last);
            last = depth;
        }
    }

    #[test]
    fn a_press_through_the_gel_and_an_empty_window_are_errors() {
        let pin = heights(|x, y| if x * x + y * y < 1e-6 { 0.0 } else { f64::NEG_INFINITY });
        let error = indent(&pin, &GRID, &GEL, 80.0).unwrap_err().to_string();
        assert!(error.contains("80 N need an imprint of 80.00 mm3"), "{error}");
        assert!(error.contains("4.00 mm of gel it has 12."), "{error}");
        let empty = Plane::filled(GRID.width_px, GRID.height_px, f32::NEG_INFINITY);
        let error = indent(&empty, &GRID, &GEL, 1.0).unwrap_err().to_string();
        assert!(error.contains("10.0 x 8.0 mm"), "{error}");
    }
}
