//! What a robot will be sent, checked by running it on the virtual robot first.

use gripgen::twin::{Campaign, PullKind};
use gripgen_rig::experiment::RigConfig;
use gripgen_rig::experiment::plan::{motion_program, pull_program};
use gripgen_rig::program::TcpPose;
use gripgen_rig_sim::program_check::{Finding, check_motion, check_pull};

/// Different pulls of a campaign that are checked; their text is the same but for its numbers.
const MOST: usize = 8;
/// Where the checked motion goes: it is checked without a robot.
const TARGET: TcpPose = TcpPose { position_m: [0.4, 0.1, 0.3], rotation_rad: [0.0, 3.1, 0.0] };

/// How many programs were checked; the first that does not do what its numbers say.
pub fn checked_programs(config: &RigConfig, campaign: &Campaign) -> Result<usize, String> {
    let mut seen: Vec<String> = Vec::new();
    for planned in campaign.pulls.iter().filter(|p| p.kind == PullKind::Pull) {
        let program = pull_program(config, campaign, planned, 1);
        let text = program.script().map_err(|e| e.to_string())?;
        if seen.len() >= MOST || seen.contains(&text) {
            continue;
        }
        first("pull", check_pull(&program, &text).next())?;
        seen.push(text);
    }
    for speed_mm_s in [config.motion.speed_mm_s, config.motion.approach_speed_mm_s] {
        let program = motion_program(config, TARGET, speed_mm_s, 0.1, 1);
        let text = program.script().map_err(|e| e.to_string())?;
        first("motion", check_motion(&program, &text).next())?;
    }
    Ok(seen.len() + 2)
}

fn first(what: &str, finding: Option<Finding>) -> Result<(), String> {
    match finding {
        Some(finding) => Err(format!("the {what} program does not do what its numbers say: {finding}")),
        None => Ok(()),
    }
}
