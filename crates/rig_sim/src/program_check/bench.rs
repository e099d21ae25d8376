//! A virtual robot with a host that does what a trial wants.

use crate::arm::{Arm, STEP_S};
use crate::controller::{Announcement, Controller, TOOL_M};
use crate::robot::Robot;
use crate::spring::Spring;
use gripgen_rig::program::{ACKNOWLEDGE_S, Phase, StopReason, TcpPose, registers};
use gripgen_rig::rtde::Value;
use gripgen_twin::frames::Pose;
use gripgen_twin::plant::{GripRequest, Plant};
use nalgebra::Translation3;
use std::sync::Arc;

/// Control steps between two beats of the host: 100 per second.
const BEAT_STEPS: u64 = 5;
/// The watchdog allows so long, and its step.
const SILENCE_S: f64 = 0.1 + 2.0 * STEP_S;
/// Registers that a program may write.
const INTS: [u8; 4] = [registers::PHASE, registers::STEP, registers::RUN, registers::REASON];
const DOUBLES: [u8; 4] =
    [registers::DESIRED_FORCE, registers::DISPLACEMENT, registers::LATERAL, registers::PRELOAD];

/// What a trial says of a program.
pub(super) type Verdict = Result<(), String>;

/// A number that has to be so.
pub(super) fn near(what: &str, is: f64, wanted: f64, within: f64) -> Verdict {
    if (is - wanted).abs() <= within { Ok(()) } else { Err(format!("{what} is {is:.6}, not {wanted:.6}")) }
}

/// The robot, its host, and what was seen.
pub(super) struct Bench {
    controller: Controller,
    spring: Spring,
    run: i32,
    steps: u64,
    beats: bool,
    started_at: Pose,
    /// Phases in their order.
    pub(super) phases: Vec<Phase>,
}

impl Bench {
    /// A robot at rest that is given a program, whose own tool is at `tcp`. What is judged is the text and not whether an arm reaches that far: a
    /// way that is to take too long may begin anywhere.
    pub(super) fn start(
        spring: Spring,
        tcp: TcpPose,
        tool_mm: [f64; 3],
        run: i32,
        text: &str,
    ) -> Result<Self, String> {
        let [of_program, of_robot] = [tool_mm.map(|mm| 1e-3 * mm), TOOL_M].map(Translation3::from);
        let from = TcpPose::from_base_from_tool(&(tcp.base_from_tool() * of_program.inverse() * of_robot));
        let mut controller = Controller::new(Arc::new(spring), from, 1.0);
        controller.arm_mut().reach_anything();
        let started_at = controller.arm().base_from_flange();
        controller.run_script(text);
        let mut bench =
            Self { controller, spring, run, steps: 0, beats: true, started_at, phases: Vec::new() };
        bench.heard()?;
        Ok(bench)
    }

    pub(super) fn robot(&self) -> &Robot {
        self.controller.robot()
    }

    pub(super) fn arm(&self) -> &Arm {
        self.controller.arm()
    }

    pub(super) fn arm_mut(&mut self) -> &mut Arm {
        self.controller.arm_mut()
    }

    /// The host goes silent.
    pub(super) fn die(&mut self) {
        self.beats = false;
    }

    /// Whether the arm is where it was at first.
    pub(super) fn stayed(&self) -> Verdict {
        let (is, was) = (self.arm().base_from_flange(), self.started_at);
        let moved_m = (is.translation.vector - was.translation.vector).norm();
        let stays = moved_m < 1e-9 && is.rotation.angle_to(&was.rotation) < 1e-6;
        if stays { Ok(()) } else { Err(format!("the tool moved by {:.3} mm", 1e3 * moved_m)) }
    }

    pub(super) fn go(&mut self, go: i32) {
        self.controller.write_input("input_int_register_25", Value::Int32(go));
    }

    /// The jaws close on the part.
    pub(super) fn close_jaws(&mut self) -> Verdict {
        let base_from_tool = self.robot().tcp.base_from_tool();
        let request = GripRequest { base_from_tool, force_per_jaw_n: 20.0, time_s: self.robot().timestamp_s };
        let grip = self.spring.grip(&request).map_err(|e| e.to_string())?;
        self.controller.arm_mut().close(grip, request.time_s);
        Ok(())
    }

    pub(super) fn int(&self, register: u8) -> i32 {
        self.robot().outputs.int[usize::from(register)]
    }

    pub(super) fn double(&self, register: u8) -> f64 {
        self.robot().outputs.double[usize::from(register)]
    }

    pub(super) fn phase(&self) -> Option<Phase> {
        Phase::from_number(self.int(registers::PHASE))
    }

    pub(super) fn is_over(&self) -> bool {
        self.controller.program_title().is_none()
    }

    /// What the controller announced: an error of a program is one.
    fn heard(&mut self) -> Verdict {
        for told in self.controller.take_announcements() {
            if let Announcement::CannotRun { problem } = told {
                return Err(problem);
            }
        }
        Ok(())
    }

    /// One control step.
    pub(super) fn step(&mut self) -> Verdict {
        self.steps += 1;
        if self.beats && self.steps.is_multiple_of(BEAT_STEPS) {
            let beat = Value::Int32((self.steps / BEAT_STEPS) as i32);
            self.controller.write_input("input_int_register_24", beat);
        }
        self.controller.begin_step();
        self.heard()?;
        self.registers()?;
        if let Some(phase) = self.phase()
            && self.phases.last() != Some(&phase)
        {
            self.phases.push(phase);
        }
        if self.phase() == Some(Phase::Stopped) {
            self.rests("after it said that it has stopped")?;
            if StopReason::from_number(self.int(registers::REASON)).is_none() {
                return Err(format!("it has stopped for reason {}", self.int(registers::REASON)));
            }
        }
        self.controller.end_step();
        self.heard()
    }

    /// Other registers belong to others.
    fn registers(&self) -> Verdict {
        let outputs = &self.robot().outputs;
        let strange = |own: &[u8], i: usize| !own.iter().any(|r| usize::from(*r) == i);
        if let Some(i) = (0..48).find(|i| strange(&INTS, *i) && outputs.int[*i] != 0) {
            return Err(format!("it writes integer register {i}"));
        }
        if let Some(i) = (0..48).find(|i| strange(&DOUBLES, *i) && outputs.double[*i] != 0.0) {
            return Err(format!("it writes floating register {i}"));
        }
        if self.phase().is_some() && self.int(registers::RUN) != self.run {
            return Err(format!("it says that it is run {}, not {}", self.int(registers::RUN), self.run));
        }
        Ok(())
    }

    /// The arm stands and applies nothing.
    pub(super) fn rests(&self, when: &str) -> Verdict {
        if self.arm().applies_force() {
            return Err(format!("force mode goes on {when}"));
        }
        let speed = self.arm().speed_m_s();
        if speed > 0.0 { Err(format!("the tool moves with {:.1} mm/s {when}", 1e3 * speed)) } else { Ok(()) }
    }

    pub(super) fn steps(&mut self, seconds: f64) -> Verdict {
        (0..(seconds / STEP_S).round() as u64).try_for_each(|_| self.step())
    }

    /// Goes on until `is`; how long it took.
    pub(super) fn until(
        &mut self,
        what: &str,
        most_s: f64,
        is: impl Fn(&Self) -> bool,
    ) -> Result<f64, String> {
        let steps = (most_s / STEP_S).round() as u64;
        for k in 0..=steps {
            if is(self) {
                return Ok(k as f64 * STEP_S);
            }
            self.step()?;
        }
        Err(format!("{what} did not come within {most_s:.2} s"))
    }

    pub(super) fn until_phase(&mut self, phase: Phase, most_s: f64) -> Result<f64, String> {
        self.until(&format!("phase {phase:?}"), most_s, |b| b.phase() == Some(phase))
    }

    /// It stops for this reason within so long, and ends when the host has read it.
    pub(super) fn stops_for(&mut self, reason: StopReason, most_s: f64) -> Result<f64, String> {
        let took_s = self.until_phase(Phase::Stopped, most_s)?;
        let found = self.int(registers::REASON);
        if found != reason as i32 {
            let words = StopReason::from_number(found).map_or("none", StopReason::meaning);
            return Err(format!(
                "it stopped for reason {found} ({words}), not {} ({})",
                reason as i32,
                reason.meaning()
            ));
        }
        Ok(took_s)
    }

    /// The host reads the reason and takes its go back.
    pub(super) fn acknowledge(&mut self) -> Verdict {
        self.steps(0.2)?;
        if self.is_over() && self.robot().inputs.int[usize::from(registers::GO)] == self.run {
            return Err("it ended before the host had read its reason".into());
        }
        self.go(0);
        self.until("its end", 0.02, Self::is_over)?;
        self.stays()
    }

    /// Nobody takes the go back: it ends by itself.
    pub(super) fn ends_alone(&mut self) -> Verdict {
        let took_s = self.until("its end without the host", ACKNOWLEDGE_S + 0.1, Self::is_over)?;
        if took_s < ACKNOWLEDGE_S - 0.1 {
            return Err(format!("it waited {took_s:.2} s for the host, not {ACKNOWLEDGE_S} s"));
        }
        self.stays()
    }

    /// Nothing goes on after the end.
    fn stays(&mut self) -> Verdict {
        let here = self.robot().tcp;
        self.steps(0.1)?;
        self.rests("after its end")?;
        if self.robot().tcp == here { Ok(()) } else { Err("the tool moved after the end".into()) }
    }

    /// The host dies: the watchdog ends the program, and the arm stands.
    pub(super) fn dies_with_the_host(&mut self) -> Verdict {
        while !self.steps.is_multiple_of(BEAT_STEPS) {
            self.step()?;
        }
        self.die();
        let seconds = self.until("the end that the watchdog makes", SILENCE_S + STEP_S, Self::is_over)?;
        if seconds < 0.1 - 1e-9 {
            return Err(format!("it ended {seconds:.3} s after the last beat"));
        }
        self.steps(0.15)?;
        self.rests("after the host has died")
    }
}
