//! A pull as a film: what the cameras see while the part is pulled, and what the gels do.
//!
//! The part moves in front of a gel as the gripper moves along the pull, and is pressed in anew at each frame, with the force of the
//! grip. What holds the part is that of the grip: its cells keep their limits and go along with the part in the image.

use crate::gpu::PlacedPart;
use crate::gripped::{Contact, Gripped, Indenter};
use crate::library::Library;
use crate::sample::{SampleError, SimulateOptions};
use gripgen_physics::{JawFriction, PullCells, PullState, grip_point, pull_direction};
use gripgen_tactile::{CellMap, ClusteredMesh, Pad, Renderer, Sensor, SimdLevel, finish};
use gripgen_twin::effects::optics_state;
use gripgen_twin::frames::world_from_gel;
use gripgen_twin::{
    CellShear, ContactPatch, FilmFrame, FilmPace, Jaw, OpticsState, PerJaw, PullTrace, Scenario, Twin,
};
use nalgebra::Vector3;
use std::sync::Arc;

/// A filmed pull. Frames are made when they are asked for.
pub struct Film {
    twin: Twin,
    mesh: Arc<ClusteredMesh>,
    level: SimdLevel,
    jaws: PerJaw<FilmJaw>,
    moments: Vec<Moment>,
    /// Time at which the first cell of either jaw left its place on the part, if one did.
    pub incipient_slip_s: Option<f64>,
    /// Time at which the last one did.
    pub whole_slip_s: Option<f64>,
}

/// What does not change from frame to frame.
struct FilmJaw {
    sensor: Arc<Sensor>,
    part: PlacedPart,
    optics: OpticsState,
    /// Direction of the pull in the gel.
    pull: Vector3<f64>,
    patch: ContactPatch,
    cells: CellMap,
}

struct Moment {
    state: PullState,
    cells: PerJaw<Vec<CellShear>>,
}

/// A pull as it was seen: its states, what its jaws held, and when frames are taken of it.
pub(crate) struct Seen<'a> {
    pub(crate) states: &'a [PullState],
    pub(crate) trace: &'a PullTrace,
    pub(crate) friction: &'a PerJaw<JawFriction>,
    pub(crate) pace: FilmPace,
}

impl Film {
    pub(crate) fn new(
        twin: &Twin,
        library: &Library,
        scenario: &Scenario,
        gripped: &Gripped,
        contact: &Contact,
        options: SimulateOptions,
        seen: &Seen<'_>,
    ) -> Result<Self, SampleError> {
        let mut cells = PullCells::new(options.mechanics, &twin.gel, seen.friction);
        let (mut first, mut whole) = (None, None);
        for (row, state) in seen.states.iter().enumerate() {
            cells.follow(state);
            let (slipped, all) = cells.slipped();
            if slipped > 0 {
                first = first.or(Some(row));
            }
            if slipped == all {
                whole = Some(row);
                break;
            }
        }
        let rows = seen.pace.rows(seen.trace, whole);
        let mut cells = PullCells::new(options.mechanics, &twin.gel, seen.friction);
        let mut moments = Vec::with_capacity(rows.len());
        for (row, state) in seen.states.iter().enumerate() {
            cells.follow(state);
            if rows.get(moments.len()) == Some(&row) {
                moments.push(Moment { state: *state, cells: cells.cells() });
            }
        }
        let along = Vector3::from(pull_direction(scenario));
        let press =
            Indenter::new(twin, library, scenario, &contact.force_n, &contact.held.grasp, options.level)?;
        let jaws = PerJaw::from_fn(|jaw| FilmJaw {
            sensor: gripped.sensors[jaw].clone(),
            part: press.part(jaw).clone(),
            optics: optics_state(twin, &scenario.part, &grip_point(scenario, jaw, 0.0)),
            pull: world_from_gel(jaw, 0.0).rotation.inverse() * along,
            patch: contact.imprint[jaw].patch.clone(),
            cells: CellMap::new(&contact.imprint[jaw].places),
        });
        let time_s = |row: usize| seen.states[row].time_s;
        Ok(Self {
            twin: twin.clone(),
            mesh: library.clustered_mesh(&twin.parts[&scenario.part])?,
            level: options.level,
            jaws,
            moments,
            incipient_slip_s: first.map(time_s),
            whole_slip_s: whole.map(time_s),
        })
    }

    /// How many frames there are.
    pub fn len(&self) -> usize {
        self.moments.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.moments.is_empty()
    }

    /// A frame of both jaws; the first one is the grip.
    ///
    /// # Errors
    ///
    /// A part that has left the window, or that the force presses through the gel there.
    pub fn frame(&self, number: usize) -> Result<PerJaw<FilmFrame>, SampleError> {
        let Moment { state, cells } = &self.moments[number];
        PerJaw::try_from_fn(|jaw| self.jaw_frame(jaw, state, &cells[jaw]))
    }

    fn jaw_frame(&self, jaw: Jaw, state: &PullState, cells: &[CellShear]) -> Result<FilmFrame, SampleError> {
        let FilmJaw { sensor, part, optics, pull, patch, cells: map } = &self.jaws[jaw];
        let gel = &self.twin.gel[jaw];
        let (renderer, pad) = (Renderer { sensor, gel, level: self.level }, Pad { gel, level: self.level });
        // The gel goes along with the gripper, so that in it the part moves against the pull.
        let moved_m = -state.displacement_m * pull;
        let mut gel_from_mesh = part.gel_from_mesh;
        gel_from_mesh.translation.vector += moved_m;
        let failed = |source| SampleError::Indent { jaw, source };
        let (c, force_n) = (part.imprint_m3_per_n, part.force_n);
        let own =
            pad.press_seen(&renderer, &self.mesh, &gel_from_mesh, c, force_n, optics).map_err(failed)?;
        let imprint = renderer.seen(&self.mesh, &gel_from_mesh, &own, optics);
        let mut moved = patch.clone();
        for cell in &mut moved.cells {
            cell.x_m += moved_m.x;
            cell.y_m += moved_m.y;
        }
        // The part holds the gel back.
        let tangential_n: Vec<[f64; 2]> =
            cells.iter().map(|cell| [-cell.force_n * pull.x, -cell.force_n * pull.y]).collect();
        let (change, markers_px) = renderer.change_pulled(&imprint, optics, &moved, &tangential_n);
        let depth = &imprint.depth_px;
        let um_per_px = (sensor.grid.metres_per_px * 1e6) as f32;
        Ok(FilmFrame {
            time_s: state.time_s,
            contact_force_n: state.contact_force_n,
            displacement_m: state.displacement_m,
            pull_px: [pull.x, pull.y],
            camera: None,
            image: finish(sensor, Some(&change), None),
            cell_of_px: map.of_contact(depth, &sensor.grid, [moved_m.x, moved_m.y]),
            depth_um: depth.values.iter().map(|&d| (d * um_per_px + 0.5) as u16).collect(),
            cells: cells.to_vec(),
            markers_px,
        })
    }
}
