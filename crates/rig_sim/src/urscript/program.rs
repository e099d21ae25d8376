//! A text that was understood.

use super::builtins::Builtin;
use super::operators::Binary;
use super::value::Value;

/// What is wrong with a program, and where.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {problem}")]
pub struct ScriptError {
    /// Line of the text, from 1.
    pub line: u32,
    /// What is wrong.
    pub problem: String,
}

/// Where a name lives: its place among the locals of its function, and among the globals.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Slot {
    pub(super) local: usize,
    pub(super) global: usize,
}

/// One step of the machine.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Op {
    Const(Value),
    Load(Slot),
    Store(Slot),
    StoreGlobal(Slot),
    StoreLocal(Slot),
    /// The index and the new element are on the stack.
    StoreElement(Slot),
    Element,
    List(usize),
    Pose,
    Not,
    Negate,
    Binary(Binary),
    Jump(usize),
    JumpIfFalse(usize),
    /// A function of the text, by its number; places of its arguments.
    Call(usize, Box<[usize]>),
    /// A function of the language; places of its arguments.
    Builtin(&'static Builtin, Box<[usize]>),
    Pop,
    Return,
    Run(usize),
    Join,
    Kill,
    Halt,
}

/// A function or a thread.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Function {
    pub(super) name: String,
    pub(super) is_thread: bool,
    /// Its parameters, with what they are where a call says nothing.
    pub(super) parameters: Vec<Option<Value>>,
    /// Names of its locals; the parameters come first.
    pub(super) locals: Vec<String>,
    pub(super) code: Vec<Op>,
    /// Line of each step.
    pub(super) lines: Vec<u32>,
}

/// A program that can be run.
#[derive(Debug, Clone, PartialEq)]
pub struct Program {
    /// The first is the program itself.
    pub(super) functions: Vec<Function>,
    /// Names of all variables.
    pub(super) names: Vec<String>,
}

impl Program {
    /// Its name; nothing for lines without a `def`.
    pub fn title(&self) -> &str {
        self.functions.first().map_or("", |main| &main.name)
    }
}
