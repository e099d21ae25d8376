//! Operators.

use super::value::{MAX_TEXT, Value};
use std::sync::Arc;

/// Operators with two sides.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Binary {
    Add,
    Subtract,
    Multiply,
    Divide,
    Remainder,
    Equal,
    Unequal,
    Less,
    LessEqual,
    More,
    MoreEqual,
    And,
    Or,
    Xor,
}

impl Binary {
    fn word(self) -> &'static str {
        match self {
            Binary::Add => "+",
            Binary::Subtract => "-",
            Binary::Multiply => "*",
            Binary::Divide => "/",
            Binary::Remainder => "%",
            Binary::Equal => "==",
            Binary::Unequal => "!=",
            Binary::Less => "<",
            Binary::LessEqual => "<=",
            Binary::More => ">",
            Binary::MoreEqual => ">=",
            Binary::And => "and",
            Binary::Or => "or",
            Binary::Xor => "xor",
        }
    }

    pub(super) fn apply(self, a: &Value, b: &Value) -> Result<Value, String> {
        use Binary::{
            Add, And, Divide, Equal, Less, LessEqual, More, MoreEqual, Multiply, Or, Remainder, Subtract,
            Unequal, Xor,
        };
        match self {
            And => Ok(Value::Bool(a.truth()? & b.truth()?)),
            Or => Ok(Value::Bool(a.truth()? | b.truth()?)),
            Xor => Ok(Value::Bool(a.truth()? ^ b.truth()?)),
            Equal => equal(a, b).map(Value::Bool),
            Unequal => equal(a, b).map(|same| Value::Bool(!same)),
            Less | LessEqual | More | MoreEqual => {
                let (a, b) = (a.number()?, b.number()?);
                Ok(Value::Bool(match self {
                    Less => a < b,
                    LessEqual => a <= b,
                    More => a > b,
                    _ => a >= b,
                }))
            }
            Add | Subtract | Multiply | Divide | Remainder => match (a, b) {
                (Value::Text(a), Value::Text(b)) if self == Add => {
                    if a.len() + b.len() > MAX_TEXT {
                        return Err(format!("a text of {}, at most {MAX_TEXT} are kept", a.len() + b.len()));
                    }
                    Ok(Value::Text(Arc::from(format!("{a}{b}"))))
                }
                (Value::Int(a), Value::Int(b)) => self.whole(*a, *b),
                _ => {
                    self.real(a.number().map_err(|e| self.hint(&e))?, b.number().map_err(|e| self.hint(&e))?)
                }
            },
        }
    }

    fn hint(self, e: &str) -> String {
        format!("{e}, beside `{}`", self.word())
    }

    fn whole(self, a: i32, b: i32) -> Result<Value, String> {
        let found = match self {
            Binary::Add => a.checked_add(b),
            Binary::Subtract => a.checked_sub(b),
            Binary::Multiply => a.checked_mul(b),
            Binary::Remainder => a.checked_rem(b),
            _ if b != 0 && a % b != 0 => {
                return Err(format!("{a} / {b} has a rest: the manual does not say what becomes of it"));
            }
            _ => a.checked_div(b),
        };
        found.map(Value::Int).ok_or_else(|| format!("{a} {} {b} is no whole number of 32 bits", self.word()))
    }

    fn real(self, a: f64, b: f64) -> Result<Value, String> {
        let found = match self {
            Binary::Add => a + b,
            Binary::Subtract => a - b,
            Binary::Multiply => a * b,
            Binary::Remainder => a % b,
            _ => a / b,
        };
        if found.is_finite() {
            Ok(Value::Float(found))
        } else {
            Err(format!("{a} {} {b} is no number", self.word()))
        }
    }
}

fn equal(a: &Value, b: &Value) -> Result<bool, String> {
    match (a, b) {
        (Value::Int(_) | Value::Float(_), Value::Int(_) | Value::Float(_)) => Ok(a.number()? == b.number()?),
        (Value::List(a), Value::List(b)) => {
            if a.len() != b.len() {
                return Ok(false);
            }
            for (a, b) in a.iter().zip(b.iter()) {
                if !equal(a, b)? {
                    return Ok(false);
                }
            }
            Ok(true)
        }
        _ if a.kind() == b.kind() => Ok(a == b),
        _ => Err(format!("{} is compared with {}", a.kind(), b.kind())),
    }
}

/// `-x`.
pub(super) fn negate(a: &Value) -> Result<Value, String> {
    match a {
        Value::Int(x) => {
            x.checked_neg().map(Value::Int).ok_or_else(|| format!("-({x}) is no whole number of 32 bits"))
        }
        other => Ok(Value::Float(-other.number()?)),
    }
}

/// `a[i]`.
pub(super) fn element(a: &Value, i: &Value) -> Result<Value, String> {
    let at = i.int()?;
    let found = match a {
        Value::Pose(pose) => usize::try_from(at).ok().and_then(|at| pose.get(at)).map(|x| Value::Float(*x)),
        Value::List(list) => usize::try_from(at).ok().and_then(|at| list.get(at)).cloned(),
        other => return Err(format!("{} has no elements", other.kind())),
    };
    found.ok_or_else(|| format!("there is no element {at}"))
}

/// `a[i] = x`.
pub(super) fn set_element(a: &mut Value, i: &Value, x: Value) -> Result<(), String> {
    let at = i.int()?;
    let wrong = || format!("there is no element {at}");
    let index = usize::try_from(at).map_err(|_| wrong())?;
    match a {
        Value::Pose(pose) => *pose.get_mut(index).ok_or_else(wrong)? = x.number()?,
        Value::List(list) => {
            if matches!(x, Value::List(_)) {
                return Err("a list as an element that is set is not known".into());
            }
            *Arc::make_mut(list).get_mut(index).ok_or_else(wrong)? = x;
        }
        other => return Err(format!("{} has no elements", other.kind())),
    }
    Ok(())
}
