//! The Rapier world. Every engine parameter is set here, on purpose; no engine default is relied on.
//!
//! Of the engine's Cargo features, `enhanced-determinism` is on (the same bits on every machine) and `parallel` is off (a
//! world a sample, samples in parallel); `block-solver` is on as shipped: it solves the normal forces of two points of
//! a face together, and the slip forces of `docs/peers.md` were measured with it.

use rapier3d_f64::prelude::*;

/// Solver iterations of one step: with fewer, the pads drift before they slip.
pub(crate) const SOLVER_ITERATIONS: usize = 4;

/// A world that can be cloned: the sets of `PhysicsWorld`, and a pipeline that is only workspace.
pub(crate) struct World {
    pub(crate) bodies: RigidBodySet,
    pub(crate) colliders: ColliderSet,
    pub(crate) joints: ImpulseJointSet,
    pub(crate) narrow_phase: NarrowPhase,
    gravity: Vector,
    parameters: IntegrationParameters,
    islands: IslandManager,
    broad_phase: BroadPhaseBvh,
    pub(crate) multibodies: MultibodyJointSet,
    soft_bodies: SoftBodySet,
    ccd: CCDSolver,
    pipeline: PhysicsPipeline,
}

/// A body left the numbers: what Rapier quarantined.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct NotFinite {
    pub(crate) bodies: usize,
}

impl World {
    /// An empty world with time step `step_s` and gravity along -z of `world`.
    pub(crate) fn new(step_s: f64, gravity_m_per_s2: f64) -> Self {
        // Stiff, overdamped contacts: at the default 30 Hz a light jaw sinks through its pad at 80 N.
        let stiff = SpringCoefficients { natural_frequency: 1000.0, damping_ratio: 5.0 };
        let parameters = IntegrationParameters {
            dt: step_s,
            min_ccd_dt: step_s,
            contact_softness: stiff,
            static_contact_softness: stiff,
            warmstart_coefficient: 1.0,
            // Typical size of the contacts, in metres. Scales prediction distance (0.4 mm), slop and above all
            // the distance within which old contacts are recycled (0.5 mm instead of 50 mm): at 1 a pad keeps a
            // ghost contact for 30 mm after it left the part.
            length_unit: 0.02,
            normalized_allowed_linear_error: 0.005,
            normalized_max_corrective_velocity: 3.0,
            normalized_prediction_distance: 0.02,
            normalized_max_linear_velocity: 400.0,
            num_solver_iterations: SOLVER_ITERATIONS,
            num_internal_pgs_iterations: 1,
            num_internal_stabilization_iterations: 1,
            max_ccd_substeps: 0,
            contact_clustering: true,
            contact_recycling: true,
            normalized_contact_recycle_distance: 0.025,
            friction_in_bias_pass: false,
            warmstart_joints: false,
            // One friction constraint per manifold: per-point friction loses 0.9 % on flat faces of jointed jaws.
            friction_model: FrictionModel::Simplified,
            soft_bodies: SoftBodiesSettings::default(),
        };
        Self {
            bodies: RigidBodySet::new(),
            colliders: ColliderSet::new(),
            joints: ImpulseJointSet::new(),
            narrow_phase: NarrowPhase::new(),
            gravity: Vector::new(0.0, 0.0, -gravity_m_per_s2),
            parameters,
            islands: IslandManager::new(),
            broad_phase: BroadPhaseBvh::new(),
            multibodies: MultibodyJointSet::new(),
            soft_bodies: SoftBodySet::new(),
            ccd: CCDSolver::new(),
            pipeline: PhysicsPipeline::new(),
        }
    }

    /// Advances by one time step.
    ///
    /// `refresh_contacts` rebuilds every contact instead of recycling it: the only way in which a changed
    /// friction coefficient reaches a pair that is already in touch.
    pub(crate) fn step(&mut self, step_s: f64, refresh_contacts: bool) -> Result<(), NotFinite> {
        self.parameters.dt = step_s;
        self.parameters.contact_recycling = !refresh_contacts;
        self.pipeline.step(
            self.gravity,
            &self.parameters,
            &mut self.islands,
            &mut self.broad_phase,
            &mut self.narrow_phase,
            &mut self.bodies,
            &mut self.colliders,
            &mut self.joints,
            &mut self.multibodies,
            &mut self.soft_bodies,
            &mut self.ccd,
            &(),
            &(),
        );
        let bad = self.pipeline.quarantine();
        if bad.is_empty() { Ok(()) } else { Err(NotFinite { bodies: bad.bodies().len() }) }
    }

    /// Adds a body that never sleeps.
    pub(crate) fn add_body(&mut self, body: RigidBodyBuilder) -> RigidBodyHandle {
        self.bodies.insert(body.can_sleep(false))
    }

    /// Adds a collider to a body.
    pub(crate) fn add_collider(&mut self, collider: ColliderBuilder, to: RigidBodyHandle) -> ColliderHandle {
        self.colliders.insert_with_parent(collider, to, &mut self.bodies)
    }

    /// Length of the last step.
    pub(crate) fn step_s(&self) -> f64 {
        self.parameters.dt
    }
}

impl Clone for World {
    fn clone(&self) -> Self {
        Self {
            bodies: self.bodies.clone(),
            colliders: self.colliders.clone(),
            joints: self.joints.clone(),
            narrow_phase: self.narrow_phase.clone(),
            gravity: self.gravity,
            parameters: self.parameters,
            islands: self.islands.clone(),
            broad_phase: self.broad_phase.clone(),
            multibodies: self.multibodies.clone(),
            soft_bodies: self.soft_bodies.clone(),
            ccd: self.ccd.clone(),
            pipeline: PhysicsPipeline::new(),
        }
    }
}
