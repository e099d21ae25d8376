//! A pull, whatever struct holds it, as the columns see it.

use crate::{Covariates, MeasuredPull, PlannedPull, Scenario};

/// What the columns read.
#[derive(Debug, Clone, Copy)]
pub struct PullView<'a> {
    /// Name of the part.
    pub part: &'a str,
    /// Which of the part's grips.
    pub grip_pose: usize,
    /// Grip force, per jaw.
    pub grip_force_n: f64,
    /// Height of a step of the staircase.
    pub increment_n: f64,
    /// Command of the first step; one increment where it is `None`.
    pub start_n: Option<f64>,
    /// Length of a step.
    pub step_s: f64,
    /// Circumstances.
    pub covariates: &'a Covariates,
}

/// What the columns write.
#[derive(Debug)]
pub struct PullEdit<'a> {
    /// Name of the part.
    pub part: &'a mut String,
    /// Which of the part's grips.
    pub grip_pose: &'a mut usize,
    /// Grip force, per jaw.
    pub grip_force_n: &'a mut f64,
    /// Height of a step of the staircase.
    pub increment_n: &'a mut f64,
    /// Command of the first step; one increment where it is `None`.
    pub start_n: &'a mut Option<f64>,
    /// Length of a step.
    pub step_s: &'a mut f64,
    /// Circumstances.
    pub covariates: &'a mut Covariates,
}

impl MeasuredPull {
    /// What the columns read.
    pub fn view(&self) -> PullView<'_> {
        PullView {
            part: &self.part,
            grip_pose: self.grip_pose,
            grip_force_n: self.grip_force_n,
            increment_n: self.increment_n,
            start_n: self.start_n,
            step_s: self.step_s,
            covariates: &self.covariates,
        }
    }

    /// What the columns write.
    pub fn edit(&mut self) -> PullEdit<'_> {
        PullEdit {
            part: &mut self.part,
            grip_pose: &mut self.grip_pose,
            grip_force_n: &mut self.grip_force_n,
            increment_n: &mut self.increment_n,
            start_n: &mut self.start_n,
            step_s: &mut self.step_s,
            covariates: &mut self.covariates,
        }
    }
}

impl Scenario {
    /// What the columns read.
    pub fn view(&self) -> PullView<'_> {
        PullView {
            part: &self.part,
            grip_pose: self.grip_pose,
            grip_force_n: self.grip_force_n,
            increment_n: self.pull.increment_n,
            start_n: self.pull.start_n,
            step_s: self.pull.step_s,
            covariates: &self.covariates,
        }
    }

    /// What the columns write.
    pub fn edit(&mut self) -> PullEdit<'_> {
        PullEdit {
            part: &mut self.part,
            grip_pose: &mut self.grip_pose,
            grip_force_n: &mut self.grip_force_n,
            increment_n: &mut self.pull.increment_n,
            start_n: &mut self.pull.start_n,
            step_s: &mut self.pull.step_s,
            covariates: &mut self.covariates,
        }
    }
}

impl PlannedPull {
    /// The circumstances that are planned; number, clock and temperature of the pull are not among them and have their
    /// defaults.
    pub fn covariates(&self) -> Covariates {
        Covariates {
            gel_id: self.gel_id.clone(),
            session: self.session.clone(),
            dwell_s: self.dwell_s,
            grip_offset_m: self.grip_offset_mm * 1e-3,
            grip_angle_rad: self.grip_angle_deg.to_radians(),
            pull_direction: self.pull_direction,
            ..Covariates::default()
        }
    }

    /// What the columns read, beside the circumstances of [`Self::covariates`].
    pub fn view<'a>(&'a self, covariates: &'a Covariates) -> PullView<'a> {
        PullView {
            part: &self.part,
            grip_pose: 0,
            grip_force_n: self.grip_force_n,
            increment_n: self.force_increment_n,
            start_n: self.force_start_n,
            step_s: self.step_time_s,
            covariates,
        }
    }
}
