//! What a campaign asks of the rig, checked before anything moves.

use super::config::RigConfig;
use crate::gcl::{GclCommand, LimitError};
use crate::program::{MotionProgram, ProgramLimitError, PullProgram, TcpPose};
use gripgen_twin::frames::tool_at;
use gripgen_twin::{Campaign, PlannedPull, PullKind};

/// Longer than any dwell: handling, images, and the hesitation of a host.
const HANDLING_S: f64 = 120.0;

/// A campaign that this rig does not make. Nothing moved.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A part that nobody taught.
    #[error("pulls[{index}]: nobody taught where `{part}` is; taught are: {known}")]
    Pose {
        /// Which entry of the campaign.
        index: usize,
        /// Its part.
        part: String,
        /// What is taught.
        known: String,
    },
    /// More or less force than the gripper has.
    #[error("pulls[{index}]: {source}")]
    Grip {
        /// Which entry of the campaign.
        index: usize,
        /// What is wrong.
        source: LimitError,
    },
    /// A number that no pull may have.
    #[error("pulls[{index}]: {source}")]
    Program {
        /// Which entry of the campaign.
        index: usize,
        /// What is wrong.
        source: ProgramLimitError,
    },
    /// A pose outside the box.
    #[error(
        "pulls[{index}]: the tool would go to {axis} = {value_mm:.1} mm, the workspace goes from {low_mm} to {high_mm} mm"
    )]
    Workspace {
        /// Which entry of the campaign.
        index: usize,
        /// x, y or z.
        axis: char,
        /// Where it would be.
        value_mm: f64,
        /// Where the box begins.
        low_mm: f64,
        /// Where it ends.
        high_mm: f64,
    },
}

/// The poses of a grip.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GripPoses {
    /// Where the jaws close.
    pub grip: TcpPose,
    /// Above it.
    pub approach: TcpPose,
}

/// The poses of a planned pull; `None` if nobody taught where its part is.
pub fn grip_poses(config: &RigConfig, planned: &PlannedPull) -> Option<GripPoses> {
    let middle = config.poses.get(&planned.part)?.tcp().base_from_tool();
    let (offset_m, angle_rad) = (planned.grip_offset_mm * 1e-3, planned.grip_angle_deg.to_radians());
    let grip = TcpPose::from_base_from_tool(&tool_at(&middle, offset_m, angle_rad));
    Some(GripPoses { grip, approach: grip.raised(config.motion.approach_mm * 1e-3) })
}

/// The pull of a planned pull as a program.
pub fn pull_program(config: &RigConfig, campaign: &Campaign, planned: &PlannedPull, run: i32) -> PullProgram {
    let limits = &config.limits;
    PullProgram {
        run,
        increment_n: planned.force_increment_n,
        start_n: planned.force_start_n.unwrap_or(planned.force_increment_n),
        step_s: planned.step_time_s,
        direction: planned.pull_direction,
        stop_mm: 1e3 * campaign.stop_m,
        max_force_n: limits.pull_force_n,
        abort_force_n: limits.abort_force_n,
        abort_torque_nm: limits.abort_torque_nm,
        speed_mm_s: limits.pull_speed_mm_s,
        lateral_mm: limits.lateral_mm,
        max_time_s: limits.pull_time_s,
        wait_s: planned.dwell_s + HANDLING_S,
        payload_kg: config.robot.payload_kg,
        centre_of_gravity_mm: config.robot.centre_of_gravity_mm,
        tool_mm: config.robot.tool_mm,
    }
}

/// A motion as a program.
pub fn motion_program(
    config: &RigConfig,
    target: TcpPose,
    speed_mm_s: f64,
    way_m: f64,
    run: i32,
) -> MotionProgram {
    MotionProgram {
        run,
        target,
        speed_mm_s,
        abort_force_n: config.limits.motion_force_n,
        // Twice the time at constant speed, and time to get going.
        max_time_s: (2.0 * 1e3 * way_m / speed_mm_s + 2.0).min(120.0),
        payload_kg: config.robot.payload_kg,
        centre_of_gravity_mm: config.robot.centre_of_gravity_mm,
        tool_mm: config.robot.tool_mm,
    }
}

/// Whether a pose is inside the box; else the axis, the value and its limits, in mm.
pub fn outside_workspace(config: &RigConfig, pose: &TcpPose) -> Option<(char, f64, f64, f64)> {
    let limits = &config.limits;
    ['x', 'y', 'z'].into_iter().enumerate().find_map(|(i, axis)| {
        let value = 1e3 * pose.position_m[i];
        let (low, high) = (limits.workspace_low_mm[i], limits.workspace_high_mm[i]);
        (!(value >= low && value <= high)).then_some((axis, value, low, high))
    })
}

/// Checks every entry of a campaign: poses, grip forces, programs.
///
/// # Errors
///
/// A part that nobody taught, a grip that the gripper cannot do, or a pull that leaves the workspace or the limits of
/// its program.
pub fn check_campaign(config: &RigConfig, campaign: &Campaign) -> Result<(), PlanError> {
    let pulls = campaign.pulls.iter().enumerate().filter(|(_, p)| p.kind == PullKind::Pull);
    for (index, planned) in pulls {
        let poses = grip_poses(config, planned).ok_or_else(|| {
            let known = config.poses.keys().cloned().collect::<Vec<_>>().join(", ");
            PlanError::Pose { index, part: planned.part.clone(), known }
        })?;
        for pose in [poses.grip, poses.approach] {
            if let Some((axis, value_mm, low_mm, high_mm)) = outside_workspace(config, &pose) {
                return Err(PlanError::Workspace { index, axis, value_mm, low_mm, high_mm });
            }
        }
        let program = |source| PlanError::Program { index, source };
        pull_program(config, campaign, planned, 1).check().map_err(program)?;
        let (motion, speed_mm_s) = (&config.motion, config.motion.speed_mm_s);
        motion_program(config, poses.approach, speed_mm_s, 0.1, 1).check().map_err(program)?;
        motion_program(config, poses.grip, motion.approach_speed_mm_s, 0.1, 1).check().map_err(program)?;
        grip_command(planned.grip_force_n)
            .line(&config.gripper_limits())
            .map_err(|source| PlanError::Grip { index, source })?;
    }
    Ok(())
}

/// The grip of a pull. Without a width: the state of the gripper says afterwards whether it holds.
pub fn grip_command(force_per_jaw_n: f64) -> GclCommand {
    GclCommand::Grip { force_per_jaw_n, part_width_mm: None, speed_mm_s: None }
}
