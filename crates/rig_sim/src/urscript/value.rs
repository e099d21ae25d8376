//! Values of the language.

use std::fmt;
use std::sync::Arc;

/// Longest text and longest list that a program may make.
pub(super) const MAX_TEXT: usize = 1024;
pub(super) const MAX_LIST: usize = 256;

/// A value.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// What a function gives that gives nothing.
    None,
    /// `True` or `False`.
    Bool(bool),
    /// A whole number.
    Int(i32),
    /// Any other number.
    Float(f64),
    /// Text.
    Text(Arc<str>),
    /// A list; its elements are values or lists of values.
    List(Arc<Vec<Value>>),
    /// A pose: metres and a rotation vector in radians.
    Pose([f64; 6]),
}

impl Value {
    /// What kind it is, in words.
    pub fn kind(&self) -> &'static str {
        match self {
            Value::None => "nothing",
            Value::Bool(_) => "a truth value",
            Value::Int(_) | Value::Float(_) => "a number",
            Value::Text(_) => "a text",
            Value::List(_) => "a list",
            Value::Pose(_) => "a pose",
        }
    }

    /// As a number.
    pub(super) fn number(&self) -> Result<f64, String> {
        match self {
            Value::Int(x) => Ok(f64::from(*x)),
            Value::Float(x) => Ok(*x),
            other => Err(format!("{} stands where a number is wanted", other.kind())),
        }
    }

    pub(super) fn int(&self) -> Result<i32, String> {
        match self {
            Value::Int(x) => Ok(*x),
            other => Err(format!("{} stands where a whole number is wanted: {other}", other.kind())),
        }
    }

    pub(super) fn truth(&self) -> Result<bool, String> {
        match self {
            Value::Bool(x) => Ok(*x),
            other => Err(format!("{} stands where a truth value is wanted", other.kind())),
        }
    }

    pub(super) fn text(&self) -> Result<&str, String> {
        match self {
            Value::Text(x) => Ok(x),
            other => Err(format!("{} stands where a text is wanted", other.kind())),
        }
    }

    /// A list of so many numbers, or a pose for six.
    pub(super) fn numbers<const N: usize>(&self) -> Result<[f64; N], String> {
        let mut numbers = [0.0; N];
        match self {
            Value::Pose(pose) if N == 6 => numbers.copy_from_slice(pose),
            Value::List(list) if list.len() == N => {
                for (number, value) in numbers.iter_mut().zip(list.iter()) {
                    *number = value.number()?;
                }
            }
            Value::List(list) => return Err(format!("a list of {} where {N} are wanted", list.len())),
            other => return Err(format!("{} stands where a list of {N} is wanted", other.kind())),
        }
        if !numbers.iter().all(|x| x.is_finite()) {
            return Err(format!("a number that is none: {numbers:?}"));
        }
        Ok(numbers)
    }

    pub(super) fn pose(&self) -> Result<[f64; 6], String> {
        match self {
            Value::Pose(_) => self.numbers(),
            other => Err(format!("{} stands where a pose is wanted", other.kind())),
        }
    }

    /// A list of these.
    pub(super) fn list(values: Vec<Value>) -> Result<Value, String> {
        if values.len() > MAX_LIST {
            return Err(format!("a list of {}, at most {MAX_LIST} are kept", values.len()));
        }
        let deep = |value: &Value| matches!(value, Value::List(inner) if inner.iter().any(|v| matches!(v, Value::List(_))));
        if values.iter().any(deep) {
            return Err("lists in lists in lists are not known".into());
        }
        Ok(Value::List(Arc::new(values)))
    }
}

/// As `textmsg` writes it. No more than the longest text of a list.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Value::None => write!(f, "None"),
            Value::Bool(true) => write!(f, "True"),
            Value::Bool(false) => write!(f, "False"),
            Value::Int(x) => write!(f, "{x}"),
            Value::Float(x) => write!(f, "{x:.6}"),
            Value::Text(x) => write!(f, "{x}"),
            Value::Pose(x) => write!(f, "p[{}, {}, {}, {}, {}, {}]", x[0], x[1], x[2], x[3], x[4], x[5]),
            Value::List(values) => {
                write!(f, "[")?;
                for (i, value) in values.iter().take(16).enumerate() {
                    write!(f, "{}{value}", if i == 0 { "" } else { ", " })?;
                }
                write!(f, "{}]", if values.len() > 16 { ", ..." } else { "" })
            }
        }
    }
}
