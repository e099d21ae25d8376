//! Robot, gripper and cameras together, control step by control step.

use super::arm::STEP_S;
use super::controller::{Announcement, Controller};
use super::gripper::{Closed, Jaws, VirtualGripper};
use super::rtde::InputOwners;
use gripgen_rig::gcl::{GripState, SHIPPED_LIMITS};
use gripgen_rig::program::TcpPose;
use gripgen_twin::plant::{EmptyGrip, Grip, GripRequest, Plant, PlantError};
use gripgen_twin::{PerJaw, TactileImage};
use std::sync::Arc;

/// The jaws' way to the part, which somebody else works out.
enum Closing {
    /// Nobody closes.
    No,
    /// Somebody is at work on it.
    Asked,
    /// What they will close on.
    Ready(Box<dyn Grip>),
}

/// What a step gave to tell.
#[derive(Debug, Default)]
pub struct Told {
    /// Lines of the gripper.
    pub gripper: Vec<String>,
    /// What the controller announces.
    pub robot: Vec<Announcement>,
}

/// The virtual rig without its sockets.
pub struct World {
    /// The robot's controller.
    pub controller: Controller,
    /// The gripper.
    pub gripper: VirtualGripper,
    /// Who writes the robot's inputs.
    pub owners: InputOwners,
    plant: Arc<dyn Plant>,
    closing: Closing,
    images: PerJaw<Arc<TactileImage>>,
    changed: u64,
    step: u64,
}

impl World {
    /// A rig at rest: powered on, brakes released, the gripper homed and open.
    pub fn new(plant: Arc<dyn Plant>, tcp: TcpPose, clock_rate: f64) -> Self {
        let images = plant.rest_images(0.0);
        Self {
            controller: Controller::new(plant.clone(), tcp, clock_rate),
            gripper: VirtualGripper::new(SHIPPED_LIMITS).homed(true),
            owners: InputOwners::default(),
            plant,
            closing: Closing::No,
            images: PerJaw { left: Arc::new(images.left), right: Arc::new(images.right) },
            changed: 1,
            step: 0,
        }
    }

    /// Number of the control step.
    pub fn step_number(&self) -> u64 {
        self.step
    }

    /// Time since the rig was started.
    pub fn time_s(&self) -> f64 {
        self.step as f64 * STEP_S
    }

    /// What the cameras see, and a number that changes when that changes.
    pub fn images(&self) -> (&PerJaw<Arc<TactileImage>>, u64) {
        (&self.images, self.changed)
    }

    /// First half of a control step; what RTDE clients are sent is the robot after it.
    pub fn begin_step(&mut self) {
        self.controller.begin_step();
    }

    /// Second half.
    pub fn end_step(&mut self) -> Told {
        self.controller.end_step();
        self.step += 1;
        let mut told = Told { gripper: Vec::new(), robot: self.controller.take_announcements() };
        // The gripper waits while it is worked out what it closes on.
        let waits =
            self.gripper.pending_force_per_jaw_n().is_some() && !matches!(self.closing, Closing::Ready(_));
        if !waits {
            told.gripper = self.advance_gripper();
        }
        told
    }

    fn advance_gripper(&mut self) -> Vec<String> {
        let before = self.gripper.state();
        let mut meets = Meets { closing: &self.closing, opened: false };
        let lines = self.gripper.advance(self.step as f64 * STEP_S, &mut meets);
        let opened = meets.opened;
        let time_s = self.controller.robot().timestamp_s;
        if opened {
            self.closing = Closing::No;
            if self.controller.arm().grip().is_some() {
                self.controller.arm_mut().open();
                self.show(self.plant.rest_images(self.time_s()));
            }
        }
        let state = self.gripper.state();
        if state != before
            && state == GripState::Holding
            && let Closing::Ready(grip) = std::mem::replace(&mut self.closing, Closing::No)
        {
            self.show(grip.images().clone());
            self.controller.arm_mut().close(grip, time_s);
        }
        lines
    }

    fn show(&mut self, images: PerJaw<TactileImage>) {
        self.images = PerJaw { left: Arc::new(images.left), right: Arc::new(images.right) };
        self.changed += 1;
    }

    /// A grip that has to be worked out; nothing while somebody is at work on it.
    pub fn take_grip_request(&mut self) -> Option<GripRequest> {
        let force_n = self.gripper.pending_force_per_jaw_n()?;
        if !matches!(self.closing, Closing::No) {
            return None;
        }
        self.closing = Closing::Asked;
        // The plant's clock is that of the rig, not of a controller that booted before it.
        Some(self.controller.arm().grip_request(force_n, self.time_s()))
    }

    /// What the jaws will close on.
    pub fn answer_grip(&mut self, grip: Result<Box<dyn Grip>, PlantError>) {
        match grip {
            Ok(grip) => self.closing = Closing::Ready(grip),
            Err(e) => {
                // Jaws that meet nothing: the client hears it, the operator reads why.
                self.closing =
                    Closing::Ready(Box::new(EmptyGrip { images: self.plant.rest_images(self.time_s()) }));
                self.controller.announce_problem(&e.to_string());
            }
        }
    }

    /// The part slips out of the jaws.
    pub fn lose_part(&mut self) {
        self.gripper.part_lost();
        self.controller.arm_mut().open();
        self.show(self.plant.rest_images(self.time_s()));
    }
}

/// What the jaws meet in this step.
struct Meets<'a> {
    closing: &'a Closing,
    opened: bool,
}

impl Jaws for Meets<'_> {
    fn close(&mut self, _force_per_jaw_n: f64) -> Closed {
        match self.closing {
            Closing::Ready(grip) => Closed { width_mm: grip.width_mm(), part: grip.holds() },
            Closing::No | Closing::Asked => Closed { width_mm: 0.0, part: false },
        }
    }

    fn open(&mut self) {
        self.opened = true;
    }
}
