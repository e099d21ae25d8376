//! A program under way.

use super::builtins::{Builtin, Run};
use super::hands::Hands;
use super::operators::{element, negate, set_element};
use super::outcome::Outcome;
use super::program::{Op, Program, ScriptError, Slot};
use super::value::Value;
use std::sync::Arc;

/// Steps of a thread in one control step; one that needs more never waits.
const MAX_STEPS: usize = 20_000;
/// Threads of a program.
const MAX_THREADS: usize = 50;
/// Calls in each other.
const MAX_CALLS: usize = 64;
/// Control step, s.
const STEP_S: f64 = 0.002;
/// How a robot brakes whose motion nobody commands any more.
const ABANDONED_M_S2: f64 = 2.0;

/// Where a program is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Progress {
    /// It goes on.
    Running,
    /// It has ended.
    Ended,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Wait {
    None,
    /// The next control step.
    Sync,
    /// Control steps.
    Sleep(u64),
    Motion,
    Thread(i32),
}

#[derive(Debug, Clone)]
struct Frame {
    function: usize,
    at: usize,
    locals: Vec<Option<Value>>,
}

#[derive(Debug, Clone)]
struct Thread {
    handle: i32,
    frames: Vec<Frame>,
    stack: Vec<Value>,
    wait: Wait,
    /// The motion that it waits for.
    motion: Option<(&'static Builtin, Vec<Value>)>,
}

/// A program under way.
#[derive(Debug, Clone)]
pub struct Machine {
    program: Arc<Program>,
    globals: Vec<Option<Value>>,
    /// The first is the program itself.
    threads: Vec<Thread>,
    handles: i32,
    /// Who commanded the newest motion.
    mover: i32,
}

/// What a step of a thread comes to.
enum Next {
    On,
    Waits,
    Ended,
    Halted,
}

impl Machine {
    /// At the first line.
    pub fn new(program: Arc<Program>) -> Self {
        let globals = vec![None; program.names.len()];
        let mut machine = Self { program, globals, threads: Vec::new(), handles: 0, mover: 0 };
        machine.begin(0);
        machine
    }

    /// The program.
    pub fn program(&self) -> &Program {
        &self.program
    }

    fn begin(&mut self, function: usize) -> i32 {
        self.handles += 1;
        let locals = self.program.functions.get(function).map_or(0, |f| f.locals.len());
        let frame = Frame { function, at: 0, locals: vec![None; locals] };
        let (handle, frames) = (self.handles, vec![frame]);
        self.threads.push(Thread { handle, frames, stack: Vec::new(), wait: Wait::None, motion: None });
        self.handles
    }

    /// One control step. The program has ended when its first function has, whatever its threads do.
    ///
    /// # Errors
    ///
    /// What a controller ends a program for, with its line.
    pub fn step(&mut self, hands: &mut dyn Hands) -> Result<Progress, ScriptError> {
        let mut k = 0;
        while k < self.threads.len() {
            if self.wakes(k, hands)? {
                match self.go_on(k, hands)? {
                    Next::Halted => return Ok(Progress::Ended),
                    Next::Ended if k == 0 => return Ok(Progress::Ended),
                    Next::Ended => self.threads[k].frames.clear(),
                    Next::On | Next::Waits => {}
                }
            }
            k += 1;
        }
        let mut first = true;
        self.threads.retain(|thread| std::mem::take(&mut first) || !thread.frames.is_empty());
        if self.threads.first().is_none_or(|main| main.frames.is_empty()) {
            return Ok(Progress::Ended);
        }
        Ok(Progress::Running)
    }

    /// Whether a thread does not wait any more. One whose motion another thread has broken off takes it up again.
    fn wakes(&mut self, k: usize, hands: &mut dyn Hands) -> Result<bool, ScriptError> {
        if self.threads[k].frames.is_empty() {
            return Ok(false);
        }
        let displaced = self.threads[k].wait == Wait::Motion && self.mover != self.threads[k].handle;
        if displaced
            && !hands.is_moving()
            && let Some((builtin, arguments)) = &self.threads[k].motion
            && let Run::Hands(run) = &builtin.run
            && builtin.name.starts_with("move")
        {
            self.mover = self.threads[k].handle;
            run(arguments, hands).map_err(|problem| ScriptError { line: self.line_of(k), problem })?;
            return Ok(false);
        }
        let wait = match self.threads[k].wait {
            Wait::None | Wait::Sync | Wait::Sleep(0 | 1) => Wait::None,
            Wait::Sleep(steps) => Wait::Sleep(steps - 1),
            Wait::Motion if hands.is_moving() => Wait::Motion,
            Wait::Thread(handle)
                if self.threads.iter().any(|t| t.handle == handle && !t.frames.is_empty()) =>
            {
                Wait::Thread(handle)
            }
            Wait::Motion | Wait::Thread(_) => Wait::None,
        };
        self.threads[k].wait = wait;
        Ok(wait == Wait::None)
    }

    fn line_of(&self, k: usize) -> u32 {
        let frame = self.threads[k].frames.last();
        let lines = frame.and_then(|f| self.program.functions[f.function].lines.get(f.at.saturating_sub(1)));
        lines.copied().unwrap_or(1)
    }

    /// Runs a thread until it waits.
    fn go_on(&mut self, k: usize, hands: &mut dyn Hands) -> Result<Next, ScriptError> {
        let (mut line, program) = (1, self.program.clone());
        for _ in 0..MAX_STEPS {
            match self.one(k, &program, hands, &mut line).map_err(|problem| ScriptError { line, problem })? {
                Next::On => {}
                other => return Ok(other),
            }
        }
        Err(ScriptError { line, problem: "the program never waits: a loop without `sync()`".into() })
    }

    /// One step of a thread.
    fn one(
        &mut self,
        k: usize,
        program: &Program,
        hands: &mut dyn Hands,
        line: &mut u32,
    ) -> Result<Next, String> {
        let Some(frame) = self.threads[k].frames.last_mut() else { return Ok(Next::Ended) };
        let function = &program.functions[frame.function];
        let Some(op) = function.code.get(frame.at) else { return Ok(Next::Ended) };
        *line = function.lines[frame.at];
        frame.at += 1;
        match op {
            Op::Const(value) => self.push(k, value.clone()),
            Op::Load(slot) => {
                let local = frame.locals[slot.local].clone();
                let value = local.or_else(|| self.globals[slot.global].clone());
                let value = value.ok_or_else(|| self.without_value(*slot))?;
                self.push(k, value);
            }
            Op::Store(slot) => {
                let value = self.pop(k)?;
                let global = self.local(k, *slot).is_none() && self.globals[slot.global].is_some();
                self.store(k, *slot, value, global)?;
            }
            Op::StoreLocal(slot) => {
                let value = self.pop(k)?;
                self.store(k, *slot, value, false)?;
            }
            Op::StoreGlobal(slot) => {
                let value = self.pop(k)?;
                self.store(k, *slot, value, true)?;
            }
            Op::StoreElement(slot) => {
                let (value, index) = (self.pop(k)?, self.pop(k)?);
                let without = self.without_value(*slot);
                let frame = self.threads[k].frames.last_mut();
                let local = frame.and_then(|frame| frame.locals[slot.local].as_mut());
                let into = local.or(self.globals[slot.global].as_mut()).ok_or(without)?;
                set_element(into, &index, value)?;
            }
            Op::Element => {
                let (index, of) = (self.pop(k)?, self.pop(k)?);
                self.push(k, element(&of, &index)?);
            }
            Op::List(count) => {
                let values = self.pop_many(k, *count)?;
                self.push(k, Value::list(values)?);
            }
            Op::Pose => {
                let mut pose = [0.0; 6];
                for (number, value) in pose.iter_mut().zip(self.pop_many(k, 6)?) {
                    *number = value.number()?;
                }
                self.push(k, Value::Pose(pose));
            }
            Op::Not => {
                let value = self.pop(k)?.truth()?;
                self.push(k, Value::Bool(!value));
            }
            Op::Negate => {
                let value = self.pop(k)?;
                self.push(k, negate(&value)?);
            }
            Op::Binary(operator) => {
                let (b, a) = (self.pop(k)?, self.pop(k)?);
                self.push(k, operator.apply(&a, &b)?);
            }
            Op::Jump(to) => frame.at = *to,
            Op::JumpIfFalse(to) => {
                if !self.pop(k)?.truth()?
                    && let Some(frame) = self.threads[k].frames.last_mut()
                {
                    frame.at = *to;
                }
            }
            Op::Call(to, places) => self.call(k, *to, places)?,
            Op::Builtin(builtin, places) => {
                let given = self.pop_many(k, places.len())?;
                let mut arguments = vec![Value::None; builtin.parameters.len()];
                for (place, value) in places.iter().zip(given) {
                    if let Some(argument) = arguments.get_mut(*place) {
                        *argument = value;
                    }
                }
                let named = |e: String| format!("{}: {e}", builtin.name);
                let outcome = match &builtin.run {
                    Run::Pure(run) => Outcome::Value(run(&arguments).map_err(named)?),
                    Run::Hands(run) => run(&arguments, hands).map_err(named)?,
                    Run::Missing => {
                        return Err(format!("`{}` cannot be followed by this robot", builtin.name));
                    }
                };
                if matches!(outcome, Outcome::Motion) {
                    self.mover = self.threads[k].handle;
                    self.threads[k].motion = Some((builtin, arguments));
                }
                return Ok(self.outcome(k, outcome));
            }
            Op::Pop => drop(self.pop(k)?),
            Op::Return => {
                let value = self.pop(k)?;
                self.threads[k].frames.pop();
                if self.threads[k].frames.is_empty() {
                    return Ok(Next::Ended);
                }
                self.push(k, value);
            }
            Op::Run(to) => {
                let alive = self.threads.iter().filter(|t| !t.frames.is_empty()).count();
                if alive >= MAX_THREADS || self.threads.len() > 4 * MAX_THREADS {
                    return Err(format!("more than {MAX_THREADS} threads"));
                }
                let handle = self.begin(*to);
                self.push(k, Value::Int(handle));
            }
            Op::Join => {
                self.threads[k].wait = Wait::Thread(self.pop(k)?.int()?);
                return Ok(Next::Waits);
            }
            Op::Kill => {
                let handle = self.pop(k)?.int()?;
                self.kill(handle, hands);
                if self.threads[k].frames.is_empty() {
                    return Ok(Next::Ended);
                }
            }
            Op::Halt => return Ok(Next::Halted),
        }
        Ok(Next::On)
    }

    /// A killed thread leaves its motion: nobody commands it any more, and the robot brakes.
    fn kill(&mut self, handle: i32, hands: &mut dyn Hands) {
        if let Some(thread) = self.threads.iter_mut().find(|t| t.handle == handle) {
            if thread.wait == Wait::Motion && !thread.frames.is_empty() {
                hands.brake(ABANDONED_M_S2);
            }
            thread.frames.clear();
        }
    }

    fn call(&mut self, k: usize, to: usize, places: &[usize]) -> Result<(), String> {
        let arguments = self.pop_many(k, places.len())?;
        if self.threads[k].frames.len() >= MAX_CALLS {
            return Err(format!("more than {MAX_CALLS} calls in each other"));
        }
        let function = &self.program.functions[to];
        let mut locals = function.parameters.clone();
        locals.resize(function.locals.len(), None);
        for (place, value) in places.iter().zip(arguments) {
            locals[*place] = Some(value);
        }
        self.threads[k].frames.push(Frame { function: to, at: 0, locals });
        Ok(())
    }

    fn outcome(&mut self, k: usize, outcome: Outcome) -> Next {
        let (value, wait) = match outcome {
            Outcome::Value(value) => (value, Wait::None),
            Outcome::Sync => (Value::None, Wait::Sync),
            Outcome::Sleep(seconds) => {
                (Value::None, Wait::Sleep((seconds / STEP_S - 1e-9).ceil().clamp(1.0, 1e12) as u64))
            }
            Outcome::Motion => (Value::None, Wait::Motion),
        };
        self.push(k, value);
        self.threads[k].wait = wait;
        if wait == Wait::None { Next::On } else { Next::Waits }
    }

    fn push(&mut self, k: usize, value: Value) {
        self.threads[k].stack.push(value);
    }

    fn pop(&mut self, k: usize) -> Result<Value, String> {
        self.threads[k].stack.pop().ok_or_else(|| "nothing to work with".into())
    }

    fn pop_many(&mut self, k: usize, count: usize) -> Result<Vec<Value>, String> {
        let stack = &mut self.threads[k].stack;
        let from = stack.len().checked_sub(count).ok_or("nothing to work with")?;
        Ok(stack.split_off(from))
    }

    fn local(&self, k: usize, slot: Slot) -> Option<&Value> {
        self.threads[k].frames.last().and_then(|frame| frame.locals[slot.local].as_ref())
    }

    /// The kind of a variable is that of its first value.
    fn store(&mut self, k: usize, slot: Slot, value: Value, global: bool) -> Result<(), String> {
        let name = &self.program.names[slot.global];
        let into = if global {
            &mut self.globals[slot.global]
        } else {
            match self.threads[k].frames.last_mut() {
                Some(frame) => &mut frame.locals[slot.local],
                None => return Ok(()),
            }
        };
        if let Some(before) = into.as_ref().filter(|before| before.kind() != value.kind()) {
            return Err(format!("`{name}` is {} and is given {}", before.kind(), value.kind()));
        }
        if matches!(value, Value::None) {
            return Err(format!("`{name}` is given nothing"));
        }
        *into = Some(value);
        Ok(())
    }

    fn without_value(&self, slot: Slot) -> String {
        format!("`{}` has no value", self.program.names[slot.global])
    }
}
