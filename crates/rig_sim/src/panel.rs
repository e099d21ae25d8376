//! What the dashboard sees of the robot.

use super::controller::Controller;
use super::dashboard::{DashboardRobot, ProgramState};
use super::robot::RuntimeState;
use gripgen_rig::robot_state::{RobotMode, SafetyStatus};

/// The dashboard's hand on a controller.
pub struct Panel<'a>(pub &'a mut Controller);

impl DashboardRobot for Panel<'_> {
    fn robot_mode(&self) -> RobotMode {
        self.0.robot().mode
    }

    fn safety_status(&self) -> SafetyStatus {
        self.0.robot().safety
    }

    fn program_state(&self) -> ProgramState {
        match self.0.robot().runtime {
            RuntimeState::Playing | RuntimeState::Stopping => ProgramState::Playing,
            RuntimeState::Paused => ProgramState::Paused,
            RuntimeState::Stopped => ProgramState::Stopped,
        }
    }

    fn program_name(&self) -> &str {
        self.0.program_title().unwrap_or_default()
    }

    fn model(&self) -> &str {
        "UR5"
    }

    fn serial_number(&self) -> &str {
        "20265000001"
    }

    fn polyscope_version(&self) -> &str {
        "URSoftware 5.12.0.1101319 (Mar 22 2022)"
    }

    fn remote_control(&self) -> bool {
        true
    }

    fn power_on(&mut self) -> Result<(), String> {
        self.safe()?;
        if self.robot_mode() != RobotMode::Running {
            self.0.set_mode(RobotMode::Idle);
        }
        Ok(())
    }

    fn power_off(&mut self) -> Result<(), String> {
        self.0.set_mode(RobotMode::PowerOff);
        Ok(())
    }

    fn brake_release(&mut self) -> Result<(), String> {
        self.safe()?;
        self.0.set_mode(RobotMode::Running);
        Ok(())
    }

    fn unlock_protective_stop(&mut self) -> Result<(), String> {
        self.0.unlock().map_err(|e| format!("Cannot unlock protective stop: {e}"))
    }

    fn close_popup(&mut self) {}

    fn close_safety_popup(&mut self) {}

    fn restart_safety(&mut self) -> Result<(), String> {
        self.0.restart_safety();
        self.0.set_mode(RobotMode::PowerOff);
        Ok(())
    }

    fn play(&mut self) -> Result<(), String> {
        if self.0.program_title().is_none() || self.safety_status() != SafetyStatus::Normal {
            return Err("Failed to execute: play".into());
        }
        self.0.play();
        Ok(())
    }

    fn stop_program(&mut self) -> Result<(), String> {
        self.0.stop_program("the dashboard said stop");
        Ok(())
    }

    fn pause_program(&mut self) -> Result<(), String> {
        self.0.pause();
        Ok(())
    }
}

impl Panel<'_> {
    fn safe(&self) -> Result<(), String> {
        match self.safety_status() {
            SafetyStatus::Normal | SafetyStatus::Reduced => Ok(()),
            other => Err(format!("Failed: the robot is in {}", other.name())),
        }
    }
}
