//! An interpreter of URScript: what a controller makes of the text of a program, control step by control step.
//!
//! Written from Universal Robots, "The URScript Programming Language" for e-Series (5.x), and not from the programs that this
//! rig writes. It knows the language and those functions of it that programs for a pull need; a word that it does not know ends
//! a program with its line before anything moves. What the manual leaves open (an integer division with a rest) is an error
//! too: a program of this rig must not depend on it.
//!
//! A text becomes a [`Program`]; a [`Machine`] runs it on [`Hands`], which are whatever moves and feels. One call of
//! [`Machine::step`] is one control step: each thread runs until it waits (`sync`, `sleep`, a motion, `join`). A thread that
//! never waits is ended by an error, as are too many threads and too deep calls: a step is bounded in time and memory, whatever
//! the text is.

mod builtins;
mod hands;
mod lexer;
mod machine;
mod motion;
mod operators;
mod outcome;
mod parser;
mod program;
#[cfg(test)]
mod tests;
mod value;

pub use builtins::is_word;
pub use hands::{ForceMode, Hands, Watchdog, WatchdogAction};
pub use machine::{Machine, Progress};
pub use program::{Program, ScriptError};
pub use value::Value;
