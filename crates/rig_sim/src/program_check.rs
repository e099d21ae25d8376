//! What a program does, judged before it is sent to a robot.
//!
//! A text is run by the interpreter on a virtual robot ([`crate`]), through each of its ways out: nobody beats, the
//! host dies, says stop or never says go, the part holds, slips or is not there, force, torque and a push aside come too large.
//! What must happen follows from the numbers of the program alone ([`PullProgram`], [`MotionProgram`]); of the text nothing is
//! taken for granted. So a text whose meaning has changed is found, wherever it was changed.
//!
//! This is software in the loop: it proves what the text means to an interpreter that was written from the manual. **Nothing
//! here has met a real robot.**

mod bench;
mod motion;
mod pull;
#[cfg(test)]
mod tests;

use gripgen_rig::program::{MotionProgram, PullProgram};

/// A text that does not do what its numbers say.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{trial}: {problem}")]
pub struct Finding {
    /// In which trial.
    pub trial: &'static str,
    /// What it did.
    pub problem: String,
}

/// Trials of a pull, one after the other; what is wrong with it.
pub fn check_pull<'a>(program: &'a PullProgram, text: &'a str) -> impl Iterator<Item = Finding> + use<'a> {
    let trials = pull::TRIALS.iter();
    trials.filter_map(move |(trial, run)| run(program, text).err().map(|problem| Finding { trial, problem }))
}

/// Trials of a motion, one after the other; what is wrong with it.
pub fn check_motion<'a>(
    program: &'a MotionProgram,
    text: &'a str,
) -> impl Iterator<Item = Finding> + use<'a> {
    let trials = motion::TRIALS.iter();
    trials.filter_map(move |(trial, run)| run(program, text).err().map(|problem| Finding { trial, problem }))
}
