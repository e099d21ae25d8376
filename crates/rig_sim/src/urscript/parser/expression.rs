//! Expressions and calls.

use super::super::builtins::{self, Builtin, Run};
use super::super::lexer::Token;
use super::super::operators::Binary;
use super::super::program::{Op, ScriptError};
use super::super::value::Value;
use super::Parser;
use std::sync::Arc;

impl Parser {
    pub(super) fn expression(&mut self) -> Result<(), ScriptError> {
        self.deeper()?;
        self.level(0)?;
        self.depth -= 1;
        Ok(())
    }

    /// Operators of a level and tighter: or and xor, and, not, comparisons, sums, products.
    fn level(&mut self, level: usize) -> Result<(), ScriptError> {
        match level {
            2 if self.take_name("not") => {
                self.deeper()?;
                self.level(2)?;
                self.depth -= 1;
                self.emit(Op::Not)?;
                return Ok(());
            }
            6 => return self.unary(),
            _ => {}
        }
        self.level(level + 1)?;
        while let Some(operator) = self.operator(level) {
            self.at += 1;
            self.level(level + 1)?;
            self.emit(Op::Binary(operator))?;
        }
        Ok(())
    }

    fn operator(&self, level: usize) -> Option<Binary> {
        Some(match (level, self.peek()) {
            (0, Token::Name(word)) if word == "or" => Binary::Or,
            (0, Token::Name(word)) if word == "xor" => Binary::Xor,
            (1, Token::Name(word)) if word == "and" => Binary::And,
            (3, Token::Symbol(symbol)) => match *symbol {
                "==" => Binary::Equal,
                "!=" => Binary::Unequal,
                "<" => Binary::Less,
                "<=" => Binary::LessEqual,
                ">" => Binary::More,
                ">=" => Binary::MoreEqual,
                _ => return None,
            },
            (4, Token::Symbol("+")) => Binary::Add,
            (4, Token::Symbol("-")) => Binary::Subtract,
            (5, Token::Symbol("*")) => Binary::Multiply,
            (5, Token::Symbol("/")) => Binary::Divide,
            (5, Token::Symbol("%")) => Binary::Remainder,
            _ => return None,
        })
    }

    fn unary(&mut self) -> Result<(), ScriptError> {
        if self.take_symbol("-") {
            self.deeper()?;
            self.unary()?;
            self.depth -= 1;
            self.emit(Op::Negate)?;
            return Ok(());
        }
        self.primary()?;
        while self.take_symbol("[") {
            self.expression()?;
            self.expect("]")?;
            self.emit(Op::Element)?;
        }
        Ok(())
    }

    fn primary(&mut self) -> Result<(), ScriptError> {
        let wrong = self.wrong("a value is missing");
        match self.next() {
            Token::Int(x) => drop(self.emit(Op::Const(Value::Int(x)))?),
            Token::Float(x) => drop(self.emit(Op::Const(Value::Float(x)))?),
            Token::Text(x) => drop(self.emit(Op::Const(Value::Text(Arc::from(x))))?),
            Token::Symbol("(") => {
                self.expression()?;
                self.expect(")")?;
            }
            Token::Symbol("[") => {
                let count = self.elements("]")?;
                self.emit(Op::List(count))?;
            }
            Token::Name(name) => match name.as_str() {
                "True" | "False" => drop(self.emit(Op::Const(Value::Bool(name == "True")))?),
                "p" if !self.p_is_a_variable() && self.take_symbol("[") => {
                    if self.elements("]")? != 6 {
                        return Err(self.wrong("a pose has six numbers"));
                    }
                    self.emit(Op::Pose)?;
                }
                "run" => {
                    let name = self.own_name()?;
                    self.expect("(")?;
                    self.expect(")")?;
                    self.call(name, Vec::new(), true)?;
                }
                _ if self.is_symbol("(") => self.called(name)?,
                _ if builtins::is_keyword(&name) => {
                    self.at -= 1;
                    return Err(self.wrong(format!("`{name}` stands where a value is wanted")));
                }
                _ => {
                    let line = wrong.line;
                    let slot = self.slot(&name)?;
                    self.here()?.read.push((name, line));
                    self.emit(Op::Load(slot))?;
                }
            },
            _ => {
                self.at -= 1;
                return Err(wrong);
            }
        }
        Ok(())
    }

    /// Values up to a bracket.
    fn elements(&mut self, close: &str) -> Result<usize, ScriptError> {
        let mut count = 0;
        while !self.take_symbol(close) {
            self.expression()?;
            count += 1;
            if !self.is_symbol(close) {
                self.expect(",")?;
            }
        }
        Ok(count)
    }

    /// A call, from its bracket on.
    fn called(&mut self, name: String) -> Result<(), ScriptError> {
        self.expect("(")?;
        let Some(builtin) = builtins::find(&name) else {
            if builtins::is_word(&name) {
                return Err(self.wrong(format!("`{name}` is no function")));
            }
            let arguments = self.own_arguments()?;
            return self.call(name, arguments, false);
        };
        let places = self.arguments(builtin)?;
        self.emit(Op::Builtin(builtin, places.into_boxed_slice()))?;
        Ok(())
    }

    /// Arguments of a function of the language, by place or by name; where each belongs.
    fn arguments(&mut self, builtin: &'static Builtin) -> Result<Vec<usize>, ScriptError> {
        let missing = matches!(builtin.run, Run::Missing);
        let mut places: Vec<usize> = Vec::new();
        while !self.take_symbol(")") {
            let place = match self.argument_name() {
                Some(word) => {
                    let place = builtin.parameters.iter().position(|parameter| **parameter == *word);
                    match place {
                        Some(place) => place,
                        None if missing => places.len(),
                        None => {
                            return Err(self.wrong(format!("`{}` has no parameter `{word}`", builtin.name)));
                        }
                    }
                }
                None => places.len(),
            };
            self.expression()?;
            let most = builtin.parameters.len();
            if !missing && place >= most {
                return Err(self.wrong(format!("`{}` takes at most {most} values", builtin.name)));
            }
            if places.contains(&place) {
                return Err(self.wrong(format!("`{}` is given a value twice", builtin.name)));
            }
            places.push(place);
            if !self.is_symbol(")") {
                self.expect(",")?;
            }
        }
        let lacking = (0..builtin.required).find(|place| !places.contains(place));
        match lacking.and_then(|place| builtin.parameters.get(place)) {
            Some(parameter) => Err(self.wrong(format!("`{}` lacks `{parameter}`", builtin.name))),
            None => Ok(places),
        }
    }
}
