//! What the gels see of a grip, on a coarse grid: enough to move it to a better place and to compare it with others.

use super::pose::GripAt;
use gripgen_physics::{Surface, Window};
use gripgen_tactile::{ClusteredMesh, Grid, IndentError, Plane, PressedGel, indent};
use gripgen_twin::frames::{Pose, world_from_gel};
use gripgen_twin::{Jaw, PerJaw, Twin};
use nalgebra::{Point3, Vector3};

/// Pixel of the coarse grid.
const METRES_PER_PX: f64 = 0.5e-3;
/// Side of a cell of the picture by which grips are compared, in pixels.
const CELL_PX: usize = 7;
/// How far beside its pad a finger reaches: the rim of a sensor's housing.
const RIM_M: f64 = 3e-3;
/// Pixel on which a chosen grip is looked at again.
const FINE_METRES_PER_PX: f64 = 0.125e-3;
/// Forces at which a part is pressed in, the first that fits into the gel.
const FORCES_N: [f64; 3] = [40.0, 20.0, 10.0];

/// A part that gels look at.
pub(super) struct Viewer<'a> {
    pub(super) twin: &'a Twin,
    pub(super) surface: &'a Surface,
    pub(super) mesh: &'a ClusteredMesh,
    pub(super) imprint_m3_per_n: f64,
}

/// What both gels see of a grip.
#[derive(Debug, Clone)]
pub(super) struct Seen {
    /// Distance between the gels where they first touch.
    pub(super) width_m: f64,
    /// Contact area of the jaw that has less of it.
    pub(super) area_m2: f64,
    /// Mean slope of the steeper contact.
    pub(super) slope: f64,
    /// How much lower than the contact all lies that is beside a pad, for the jaw where it is less; negative where the part rises
    /// above the contact beside the pad.
    pub(super) clearance_m: f64,
    /// From the grip centre to the middle of both contacts, in the part frame.
    pub(super) to_middle: Vector3<f64>,
    /// Depth of the imprints, a number per cell.
    picture: PerJaw<Vec<f32>>,
    columns: usize,
}

/// Why a grip is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Unseen {
    /// A gel has nothing in front of it.
    Nothing,
    /// The part reaches beyond the open jaws.
    Beyond,
    /// The smallest force wants more volume than the gel has.
    Deep {
        /// Volume that the smallest force wants.
        wanted_m3: f64,
        /// Volume at a press as deep as the gel.
        available_m3: f64,
    },
}

impl Viewer<'_> {
    pub(super) fn look(&self, at: &GripAt) -> Result<Seen, Unseen> {
        let part = at.part_from_mesh();
        let open_m = self.twin.gripper.opening_m / 2.0;
        let mut sides = Vec::with_capacity(2);
        for jaw in Jaw::BOTH {
            let side = self.side(jaw, &(world_from_gel(jaw, 0.0).inverse() * part))?;
            if side.touch_m >= open_m {
                return Err(Unseen::Beyond);
            }
            sides.push(side);
        }
        let (left, right) = (&sides[0], &sides[1]);
        let width_m = left.touch_m + right.touch_m;
        if width_m <= 0.0 {
            return Err(Unseen::Nothing);
        }
        let middle = |side: &Side, jaw: Jaw| {
            let (x, y) = side.centre_m;
            (world_from_gel(jaw, 0.0) * Point3::new(x, y, 0.0)).coords
        };
        let mut to_middle = (middle(left, Jaw::Left) + middle(right, Jaw::Right)) / 2.0;
        to_middle.y = (left.touch_m - right.touch_m) / 2.0;
        Ok(Seen {
            width_m,
            area_m2: left.area_m2.min(right.area_m2),
            slope: left.slope.max(right.slope),
            clearance_m: left.clearance_m.min(right.clearance_m),
            to_middle,
            columns: left.columns,
            picture: PerJaw { left: left.picture.clone(), right: right.picture.clone() },
        })
    }

    /// How a jaw presses at a force, on a finer grid.
    pub(super) fn pressed(&self, at: &GripAt, jaw: Jaw, force_n: f64) -> Result<Pressed, IndentError> {
        let grid = self.grid(jaw, FINE_METRES_PER_PX);
        let thickness_m = self.twin.gel[jaw].thickness_m;
        let gel_from_mesh = world_from_gel(jaw, 0.0).inverse() * at.part_from_mesh();
        let heights = self.mesh.raster(&gel_from_mesh, &grid, thickness_m / FINE_METRES_PER_PX);
        let gel = PressedGel::of(&self.twin.gel[jaw], self.imprint_m3_per_n);
        let imprint = indent(&heights, &grid, &gel, force_n)?;
        let ((x, y), gel) = (imprint.patch.centre_m(), &self.twin.gel[jaw]);
        let rim_m = (gel.width_m / 2.0 - x.abs()).min(gel.height_m / 2.0 - y.abs());
        Ok(Pressed { area_m2: imprint.patch.area_m2(), depth_m: imprint.press_depth_m, rim_m })
    }

    fn grid(&self, jaw: Jaw, metres_per_px: f64) -> Grid {
        let gel = &self.twin.gel[jaw];
        Grid {
            width_px: (gel.width_m / metres_per_px) as usize,
            height_px: (gel.height_m / metres_per_px) as usize,
            metres_per_px,
        }
    }

    fn side(&self, jaw: Jaw, gel_from_mesh: &Pose) -> Result<Side, Unseen> {
        let gel = &self.twin.gel[jaw];
        let grid = self.grid(jaw, METRES_PER_PX);
        let heights = self.mesh.raster(gel_from_mesh, &grid, gel.thickness_m / METRES_PER_PX);
        let top = heights.values.iter().fold(f32::NEG_INFINITY, |a, &b| a.max(b));
        if top == f32::NEG_INFINITY {
            return Err(Unseen::Nothing);
        }
        let pressed = PressedGel::of(gel, self.imprint_m3_per_n);
        let mut imprint = Err(Unseen::Nothing);
        for force_n in FORCES_N {
            imprint = indent(&heights, &grid, &pressed, force_n).map_err(|e| match e {
                IndentError::ThroughTheGel { wanted_mm3, available_mm3, .. } => {
                    Unseen::Deep { wanted_m3: wanted_mm3 * 1e-9, available_m3: available_mm3 * 1e-9 }
                }
                _ => Unseen::Nothing,
            });
            if imprint.is_ok() {
                break;
            }
        }
        let imprint = imprint?;
        let touch_m = f64::from(top) * METRES_PER_PX;
        let wider =
            Window { half_width_m: gel.width_m / 2.0 + RIM_M, half_height_m: gel.height_m / 2.0 + RIM_M };
        let beside_m = self.surface.height_m(gel_from_mesh, wider).unwrap_or(touch_m);
        Ok(Side {
            touch_m,
            area_m2: imprint.patch.area_m2(),
            centre_m: imprint.patch.centre_m(),
            slope: mean_slope(&heights, &imprint.depth_px),
            clearance_m: touch_m - beside_m,
            picture: cells(&imprint.depth_px),
            columns: grid.width_px.div_ceil(CELL_PX),
        })
    }
}

/// A jaw at a force.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Pressed {
    pub(super) area_m2: f64,
    /// The deepest place of the imprint.
    pub(super) depth_m: f64,
    /// From the centre of pressure to the nearest rim of the pad.
    pub(super) rim_m: f64,
}

/// What one gel sees.
struct Side {
    touch_m: f64,
    area_m2: f64,
    centre_m: (f64, f64),
    slope: f64,
    clearance_m: f64,
    picture: Vec<f32>,
    columns: usize,
}

/// How steep the contact is on the whole, weighted by pressure: the jaw's force along it over that across it.
fn mean_slope(heights: &Plane, depth_px: &Plane) -> f64 {
    let (width, height) = (heights.width, heights.height);
    let at = |x: usize, y: usize| f64::from(heights.values[y * width + x]);
    let depth = |x: usize, y: usize| f64::from(depth_px.values[y * width + x]);
    let mut sum = (0.0, 0.0, 0.0);
    for y in 1..height - 1 {
        for x in 1..width - 1 {
            let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
            // The rim of a contact is an edge of the part and no slope.
            if depth(x, y) > 0.0 && around.iter().all(|&(x, y)| depth(x, y) > 0.0) {
                let (dx, dy) = ((at(x + 1, y) - at(x - 1, y)) / 2.0, (at(x, y + 1) - at(x, y - 1)) / 2.0);
                let w = depth(x, y);
                sum = (sum.0 + w, sum.1 + w * dx, sum.2 + w * dy);
            }
        }
    }
    if sum.0 == 0.0 { 0.0 } else { libm::hypot(sum.1, sum.2) / sum.0 }
}

fn cells(depth_px: &Plane) -> Vec<f32> {
    let columns = depth_px.width.div_ceil(CELL_PX);
    let mut sums = vec![0.0; columns * depth_px.height.div_ceil(CELL_PX)];
    for (y, row) in depth_px.values.chunks(depth_px.width).enumerate() {
        for (x, depth) in row.iter().enumerate() {
            sums[y / CELL_PX * columns + x / CELL_PX] += depth;
        }
    }
    sums
}

impl Seen {
    /// How different the imprints of two grips are: 0 for the same, 1 where nothing overlaps. A part that is turned by half a turn,
    /// or between the jaws, is the same.
    pub(super) fn unlike(&self, other: &Self) -> f64 {
        let norm = |p: &PerJaw<Vec<f32>>| {
            p.iter().flat_map(|(_, v)| v).map(|&x| f64::from(x) * f64::from(x)).sum::<f64>().sqrt()
        };
        let together = (norm(&self.picture) + norm(&other.picture)).max(f64::MIN_POSITIVE);
        let apart = |turned: bool, swapped: bool| {
            let squares = Jaw::BOTH.into_iter().map(|jaw| {
                let mine = &self.picture[jaw];
                let beside = match (swapped, jaw) {
                    (true, Jaw::Left) | (false, Jaw::Right) => &other.picture.right,
                    _ => &other.picture.left,
                };
                let n = mine.len();
                let theirs = |i: usize| if turned { beside[n - 1 - i] } else { beside[i] };
                (0..n).map(|i| f64::from(mine[i] - theirs(i)).powi(2)).sum::<f64>()
            });
            squares.sum::<f64>().sqrt() / together
        };
        debug_assert_eq!(self.columns, other.columns);
        [(false, false), (true, false), (false, true), (true, true)]
            .map(|(turned, swapped)| apart(turned, swapped))
            .into_iter()
            .fold(f64::INFINITY, f64::min)
    }
}
