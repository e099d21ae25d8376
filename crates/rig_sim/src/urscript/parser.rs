//! From words to steps.

mod calls;
mod expression;

use super::builtins;
use super::lexer::{Token, words};
use super::program::{Function, Op, Program, ScriptError, Slot};
use super::value::Value;
use std::collections::{BTreeMap, BTreeSet};

/// How deep blocks and expressions may lie in each other.
const MAX_DEPTH: usize = 64;

impl Program {
    /// Reads a text: a `def`, or lines without one.
    ///
    /// # Errors
    ///
    /// The first word or line that is not understood.
    pub fn parse(text: &str) -> Result<Self, ScriptError> {
        let mut parser = Parser { words: words(text)?, ..Parser::default() };
        parser.skip_newlines();
        if parser.is_name("def") {
            parser.function(false)?;
            parser.skip_newlines();
            if *parser.peek() != Token::End {
                return Err(parser.wrong("something follows the program's end"));
            }
        } else {
            parser.open("", false);
            parser.block()?;
            if *parser.peek() != Token::End {
                return Err(parser.wrong("an `end`, `elif` or `else` without its beginning"));
            }
            parser.close()?;
        }
        parser.finish()
    }
}

/// Where a `while` begins, and the jumps out of it.
struct Loop {
    start: usize,
    breaks: Vec<usize>,
}

struct Open {
    number: usize,
    function: Function,
    loops: Vec<Loop>,
    /// Names that it gives a value without `global`.
    assigned: BTreeSet<String>,
    /// Names that it reads, with a line.
    read: Vec<(String, u32)>,
}

/// A call of a function that may come later in the text.
struct Call {
    /// In which function it stands, and at which step.
    number: usize,
    place: usize,
    name: String,
    /// One for each argument: the parameter that it names.
    arguments: Vec<Option<String>>,
    line: u32,
    by_run: bool,
}

#[derive(Default)]
struct Parser {
    words: Vec<(Token, u32)>,
    at: usize,
    /// Whether the value of the assignment that is being read stood in a later line.
    carried: bool,
    depth: usize,
    open: Vec<Open>,
    functions: Vec<Option<Function>>,
    known: BTreeMap<String, usize>,
    names: BTreeMap<String, usize>,
    globals: BTreeSet<String>,
    /// Names that were read and are none of a function's own.
    free: Vec<(String, u32)>,
    /// Calls of functions of the text.
    calls: Vec<Call>,
}

impl Parser {
    fn peek(&self) -> &Token {
        self.words.get(self.at).map_or(&Token::End, |(token, _)| token)
    }

    fn line(&self) -> u32 {
        self.words.get(self.at).or(self.words.last()).map_or(1, |(_, line)| *line)
    }

    fn next(&mut self) -> Token {
        let token = self.peek().clone();
        self.at += 1;
        token
    }

    fn wrong(&self, problem: impl Into<String>) -> ScriptError {
        ScriptError { line: self.line(), problem: problem.into() }
    }

    fn is_name(&self, name: &str) -> bool {
        matches!(self.peek(), Token::Name(n) if n == name)
    }

    fn take_name(&mut self, name: &str) -> bool {
        let is = self.is_name(name);
        self.at += usize::from(is);
        is
    }

    fn is_symbol(&self, symbol: &str) -> bool {
        matches!(self.peek(), Token::Symbol(s) if *s == symbol)
    }

    fn take_symbol(&mut self, symbol: &str) -> bool {
        let is = self.is_symbol(symbol);
        self.at += usize::from(is);
        is
    }

    fn expect(&mut self, symbol: &str) -> Result<(), ScriptError> {
        if self.take_symbol(symbol) { Ok(()) } else { Err(self.wrong(format!("`{symbol}` is missing"))) }
    }

    fn skip_newlines(&mut self) {
        while *self.peek() == Token::Newline {
            self.at += 1;
        }
    }

    fn end_of_line(&mut self) -> Result<(), ScriptError> {
        match self.peek() {
            Token::Newline => {
                self.at += 1;
                self.carried = false;
                Ok(())
            }
            Token::End => Ok(()),
            _ if self.carried => {
                self.carried = false;
                Ok(())
            }
            _ => Err(self.wrong("more than one statement in a line")),
        }
    }

    /// A name that a program may give.
    fn own_name(&mut self) -> Result<String, ScriptError> {
        match self.peek().clone() {
            Token::Name(name) if !builtins::is_keyword(&name) => {
                self.at += 1;
                Ok(name)
            }
            Token::Name(name) => Err(self.wrong(format!("`{name}` is a word of the language"))),
            _ => Err(self.wrong("a name is missing")),
        }
    }

    fn open(&mut self, name: &str, is_thread: bool) {
        let number = self.functions.len();
        self.functions.push(None);
        let function = Function {
            name: name.into(),
            is_thread,
            parameters: Vec::new(),
            locals: Vec::new(),
            code: Vec::new(),
            lines: Vec::new(),
        };
        self.open.push(Open {
            number,
            function,
            loops: Vec::new(),
            assigned: BTreeSet::new(),
            read: Vec::new(),
        });
    }

    fn close(&mut self) -> Result<(), ScriptError> {
        self.emit(Op::Const(Value::None))?;
        self.emit(Op::Return)?;
        if let Some(open) = self.open.pop() {
            self.free.extend(open.read.into_iter().filter(|(name, _)| !open.assigned.contains(name)));
            self.functions[open.number] = Some(open.function);
        }
        Ok(())
    }

    /// The function that is being read.
    fn here(&mut self) -> Result<&mut Open, ScriptError> {
        let line = self.line();
        self.open.last_mut().ok_or(ScriptError { line, problem: "a line outside of a program".into() })
    }

    fn emit(&mut self, op: Op) -> Result<usize, ScriptError> {
        // The word that was just read.
        let line = self.words.get(self.at.saturating_sub(1)).map_or(1, |(_, line)| *line);
        let function = &mut self.here()?.function;
        function.code.push(op);
        function.lines.push(line);
        Ok(function.code.len() - 1)
    }

    fn place(&mut self) -> Result<usize, ScriptError> {
        Ok(self.here()?.function.code.len())
    }

    /// A jump that was emitted goes to here.
    fn land(&mut self, jump: usize) -> Result<(), ScriptError> {
        let to = self.place()?;
        if let Op::Jump(target) | Op::JumpIfFalse(target) = &mut self.here()?.function.code[jump] {
            *target = to;
        }
        Ok(())
    }

    fn slot(&mut self, name: &str) -> Result<Slot, ScriptError> {
        let count = self.names.len();
        let global = *self.names.entry(name.into()).or_insert(count);
        let locals = &mut self.here()?.function.locals;
        let local = locals.iter().position(|local| local == name).unwrap_or_else(|| {
            locals.push(name.into());
            locals.len() - 1
        });
        Ok(Slot { local, global })
    }

    /// From `def` or `thread` to its `end`.
    fn function(&mut self, is_thread: bool) -> Result<(), ScriptError> {
        self.at += 1;
        self.deeper()?;
        let name = self.own_name()?;
        if builtins::is_word(&name) {
            return Err(self.wrong(format!("`{name}` is a word of the language")));
        }
        if self.known.insert(name.clone(), self.functions.len()).is_some() {
            return Err(self.wrong(format!("`{name}` is defined twice")));
        }
        self.open(&name, is_thread);
        self.expect("(")?;
        while !self.take_symbol(")") {
            let parameter = self.own_name()?;
            if self.here()?.function.locals.contains(&parameter) {
                return Err(self.wrong(format!("`{parameter}` is a parameter twice")));
            }
            self.slot(&parameter)?;
            self.here()?.assigned.insert(parameter);
            let default = if self.take_symbol("=") { Some(self.constant()?) } else { None };
            let parameters = &mut self.here()?.function.parameters;
            if default.is_none() && parameters.iter().any(Option::is_some) {
                return Err(self.wrong("a parameter without a default behind one that has one"));
            }
            parameters.push(default);
            if !self.is_symbol(")") {
                self.expect(",")?;
            }
        }
        if is_thread && !self.here()?.function.parameters.is_empty() {
            return Err(self.wrong("a thread has no parameters"));
        }
        self.expect(":")?;
        self.end_of_line()?;
        self.block()?;
        self.end_of_block()?;
        self.close()?;
        self.depth -= 1;
        Ok(())
    }

    fn end_of_block(&mut self) -> Result<(), ScriptError> {
        if !self.take_name("end") {
            return Err(self.wrong("an `end` is missing"));
        }
        self.end_of_line()
    }

    fn deeper(&mut self) -> Result<(), ScriptError> {
        self.depth += 1;
        if self.depth > MAX_DEPTH {
            Err(self.wrong(format!("more than {MAX_DEPTH} blocks or brackets in each other")))
        } else {
            Ok(())
        }
    }

    /// Statements up to an `end`, `elif`, `else` or the end of the text.
    fn block(&mut self) -> Result<(), ScriptError> {
        loop {
            self.skip_newlines();
            let ends = ["end", "elif", "else"].into_iter().any(|word| self.is_name(word));
            if ends || *self.peek() == Token::End {
                return Ok(());
            }
            self.statement()?;
        }
    }

    fn statement(&mut self) -> Result<(), ScriptError> {
        let Token::Name(word) = self.peek().clone() else {
            self.expression()?;
            self.emit(Op::Pop)?;
            return self.end_of_line();
        };
        match word.as_str() {
            "def" => return self.function(false),
            "thread" => return self.function(true),
            "sec" => return Err(self.wrong("secondary programs are not run here")),
            "if" => return self.branches(),
            "while" => return self.repeat(),
            "break" => {
                self.at += 1;
                let jump = self.emit(Op::Jump(0))?;
                let outside = self.wrong("`break` outside of a loop");
                self.here()?.loops.last_mut().ok_or(outside)?.breaks.push(jump);
            }
            "continue" => {
                self.at += 1;
                let outside = self.wrong("`continue` outside of a loop");
                let start = self.here()?.loops.last().ok_or(outside)?.start;
                self.emit(Op::Jump(start))?;
            }
            "return" => {
                self.at += 1;
                match self.peek() {
                    Token::Newline | Token::End => drop(self.emit(Op::Const(Value::None))?),
                    _ => self.expression()?,
                }
                self.emit(Op::Return)?;
            }
            "halt" => {
                self.at += 1;
                self.emit(Op::Halt)?;
            }
            // Threads change only where they wait: every line is critical.
            "enter_critical" | "exit_critical" => self.at += 1,
            "join" | "kill" => {
                self.at += 1;
                self.expression()?;
                self.emit(if word == "join" { Op::Join } else { Op::Kill })?;
            }
            "global" | "local" => {
                self.at += 1;
                let name = self.own_name()?;
                self.value_of_assignment()?;
                let slot = self.slot(&name)?;
                if word == "global" || self.open.len() == 1 {
                    self.globals.insert(name);
                    self.emit(Op::StoreGlobal(slot))?;
                } else {
                    self.here()?.assigned.insert(name);
                    self.emit(Op::StoreLocal(slot))?;
                }
            }
            _ if self.assigns() => {
                let name = self.own_name()?;
                let slot = self.slot(&name)?;
                if self.take_symbol("[") {
                    let line = self.line();
                    self.here()?.read.push((name, line));
                    self.expression()?;
                    self.expect("]")?;
                    self.value_of_assignment()?;
                    self.emit(Op::StoreElement(slot))?;
                } else {
                    self.value_of_assignment()?;
                    if self.open.len() == 1 {
                        // On the first level all names are global (script manual, "Scoping rules").
                        self.globals.insert(name);
                        self.emit(Op::StoreGlobal(slot))?;
                    } else {
                        self.here()?.assigned.insert(name);
                        self.emit(Op::Store(slot))?;
                    }
                }
            }
            _ => {
                self.expression()?;
                self.emit(Op::Pop)?;
            }
        }
        self.end_of_line()
    }

    /// Whether `p[` is an element of a variable of that name, and no pose: ur_rtde has such a parameter.
    fn p_is_a_variable(&self) -> bool {
        self.globals.contains("p") || self.open.last().is_some_and(|open| open.assigned.contains("p"))
    }

    /// Whether a line that begins with a name gives it, or one of its elements, a value.
    fn assigns(&self) -> bool {
        match self.words.get(self.at + 1).map(|(token, _)| token) {
            Some(Token::Symbol("=")) => true,
            Some(Token::Symbol("[")) if !self.is_name("p") || self.p_is_a_variable() => {
                let line = self.words[self.at..].iter().take_while(|(t, _)| *t != Token::Newline);
                line.into_iter().any(|(t, _)| *t == Token::Symbol("="))
            }
            _ => false,
        }
    }

    /// From `=` on. The value may stand in a later line, and the next statement behind it: ur_rtde puts its numbers in so.
    fn value_of_assignment(&mut self) -> Result<(), ScriptError> {
        self.expect("=")?;
        self.carried = *self.peek() == Token::Newline;
        self.skip_newlines();
        self.expression()
    }

    fn branches(&mut self) -> Result<(), ScriptError> {
        self.deeper()?;
        let mut ends = Vec::new();
        loop {
            self.at += 1;
            self.expression()?;
            let over = self.emit(Op::JumpIfFalse(0))?;
            self.expect(":")?;
            self.end_of_line()?;
            self.block()?;
            ends.push(self.emit(Op::Jump(0))?);
            self.land(over)?;
            if !self.is_name("elif") {
                break;
            }
        }
        if self.take_name("else") {
            self.expect(":")?;
            self.end_of_line()?;
            self.block()?;
        }
        self.end_of_block()?;
        for jump in ends {
            self.land(jump)?;
        }
        self.depth -= 1;
        Ok(())
    }

    fn repeat(&mut self) -> Result<(), ScriptError> {
        self.deeper()?;
        self.at += 1;
        let start = self.place()?;
        self.here()?.loops.push(Loop { start, breaks: Vec::new() });
        self.expression()?;
        let out = self.emit(Op::JumpIfFalse(0))?;
        self.expect(":")?;
        self.end_of_line()?;
        self.block()?;
        self.end_of_block()?;
        self.emit(Op::Jump(start))?;
        self.land(out)?;
        let breaks = self.here()?.loops.pop().map(|l| l.breaks).unwrap_or_default();
        for jump in breaks {
            self.land(jump)?;
        }
        self.depth -= 1;
        Ok(())
    }

    /// Calls find their functions, and every name has a value somewhere.
    fn finish(self) -> Result<Program, ScriptError> {
        let Self { functions, calls, known, names, globals, free, .. } = self;
        let mut functions: Vec<Function> = functions.into_iter().flatten().collect();
        for call in calls {
            let (number, place) = (call.number, call.place);
            functions[number].code[place] = call.found(&functions, &known)?;
        }
        if let Some((name, line)) = free.into_iter().find(|(name, _)| !globals.contains(name)) {
            return Err(ScriptError { line, problem: format!("`{name}` is no name that is known") });
        }
        let mut ordered = vec![String::new(); names.len()];
        for (name, i) in names {
            ordered[i] = name;
        }
        Ok(Program { functions, names: ordered })
    }
}
