//! Calls of functions of the text: their arguments, and the functions once all are known.

use super::super::lexer::Token;
use super::super::program::{Function, Op, ScriptError};
use super::super::value::Value;
use super::{Call, Parser};
use std::collections::BTreeMap;

impl Parser {
    pub(super) fn call(
        &mut self,
        name: String,
        arguments: Vec<Option<String>>,
        by_run: bool,
    ) -> Result<(), ScriptError> {
        let line = self.line();
        let place = self.emit(Op::Halt)?;
        let number = self.here()?.number;
        self.calls.push(Call { number, place, name, arguments, line, by_run });
        Ok(())
    }

    /// The name of the parameter that an argument is for, where it says so.
    pub(super) fn argument_name(&mut self) -> Option<String> {
        let named = matches!(self.words.get(self.at + 1), Some((Token::Symbol("="), _)));
        match (self.peek().clone(), named) {
            (Token::Name(word), true) => {
                self.at += 2;
                Some(word)
            }
            _ => None,
        }
    }

    /// Arguments of a function of the text, up to the bracket.
    pub(super) fn own_arguments(&mut self) -> Result<Vec<Option<String>>, ScriptError> {
        let mut names = Vec::new();
        while !self.take_symbol(")") {
            names.push(self.argument_name());
            self.expression()?;
            if !self.is_symbol(")") {
                self.expect(",")?;
            }
        }
        Ok(names)
    }

    /// What a parameter is where a call does not say it: a number, a text, a truth value.
    pub(super) fn constant(&mut self) -> Result<Value, ScriptError> {
        let negative = self.take_symbol("-");
        let value = match self.next() {
            Token::Int(x) => Value::Int(if negative { -x } else { x }),
            Token::Float(x) => Value::Float(if negative { -x } else { x }),
            Token::Text(text) if !negative => Value::Text(text.into()),
            Token::Name(word) if !negative && word == "True" => Value::Bool(true),
            Token::Name(word) if !negative && word == "False" => Value::Bool(false),
            _ => {
                self.at -= 1;
                return Err(self.wrong("the default of a parameter is a number, a text, True or False here"));
            }
        };
        Ok(value)
    }
}

impl Call {
    /// The step that calls its function.
    pub(super) fn found(
        self,
        functions: &[Function],
        known: &BTreeMap<String, usize>,
    ) -> Result<Op, ScriptError> {
        let Call { name, arguments, line, by_run, .. } = self;
        let wrong = |problem: String| ScriptError { line, problem };
        let to = *known.get(&name).ok_or_else(|| wrong(format!("`{name}` is no function that is known")))?;
        let called = &functions[to];
        if called.is_thread != by_run {
            let how = if by_run { "only threads are run" } else { "a thread is run, not called" };
            return Err(wrong(format!("`{name}`: {how}")));
        }
        let parameters = &called.locals[..called.parameters.len()];
        let mut places: Vec<usize> = Vec::with_capacity(arguments.len());
        for (i, argument) in arguments.iter().enumerate() {
            let place = match argument {
                None => i,
                Some(word) => parameters
                    .iter()
                    .position(|parameter| parameter == word)
                    .ok_or_else(|| wrong(format!("`{name}` has no parameter `{word}`")))?,
            };
            if places.contains(&place) {
                return Err(wrong(format!("`{name}` is given a value twice")));
            }
            places.push(place);
        }
        let lacks = (0..parameters.len()).any(|i| called.parameters[i].is_none() && !places.contains(&i));
        if lacks || places.iter().any(|place| *place >= parameters.len()) {
            return Err(wrong(format!(
                "`{name}` takes {} values, not {}",
                parameters.len(),
                arguments.len()
            )));
        }
        Ok(if by_run { Op::Run(to) } else { Op::Call(to, places.into_boxed_slice()) })
    }
}
