//! Words of a text.

use super::program::ScriptError;

/// A word.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Token {
    Name(String),
    Int(i32),
    Float(f64),
    Text(String),
    Symbol(&'static str),
    Newline,
    End,
}

const SYMBOLS: [&str; 19] =
    ["==", "!=", "<=", ">=", "<", ">", "=", "+", "-", "*", "/", "%", "(", ")", "[", "]", ",", ":", "."];

/// Words with their lines; the last is [`Token::End`]. A line goes on in the next one while a bracket is open and behind an operator, as in the program that UR's own
/// client library sends.
pub(super) fn words(text: &str) -> Result<Vec<(Token, u32)>, ScriptError> {
    let mut words: Vec<(Token, u32)> = Vec::new();
    let (mut line, mut open) = (0, 0_u32);
    for row in text.lines() {
        line += 1;
        let wrong = |problem: String| ScriptError { line, problem };
        let mut rest = row.trim_start();
        // Labels for the log of the pendant.
        if rest.starts_with('$') {
            continue;
        }
        while !rest.is_empty() && !rest.starts_with('#') {
            let (token, length) = word(rest).map_err(wrong)?;
            match token {
                Token::Symbol("(" | "[") => open += 1,
                Token::Symbol(")" | "]") => open = open.saturating_sub(1),
                _ => {}
            }
            words.push((token, line));
            rest = rest[length..].trim_start();
        }
        let goes_on = matches!(words.last(), Some((token, at)) if *at == line && wants_more(token));
        if open == 0 && !goes_on {
            words.push((Token::Newline, line));
        }
    }
    words.push((Token::End, line));
    Ok(words)
}

/// Whether a value has to follow.
fn wants_more(token: &Token) -> bool {
    match token {
        Token::Symbol(symbol) => {
            ["==", "!=", "<=", ">=", "<", ">", "+", "-", "*", "/", "%", ","].contains(symbol)
        }
        Token::Name(name) => ["and", "or", "xor", "not"].contains(&name.as_str()),
        _ => false,
    }
}

/// The first word and its length in bytes.
fn word(rest: &str) -> Result<(Token, usize), String> {
    let first = rest.chars().next().unwrap_or(' ');
    if first.is_ascii_alphabetic() || first == '_' {
        let length = rest.find(|c: char| !c.is_ascii_alphanumeric() && c != '_').unwrap_or(rest.len());
        return Ok((Token::Name(rest[..length].into()), length));
    }
    if first.is_ascii_digit() || (first == '.' && rest[1..].starts_with(|c: char| c.is_ascii_digit())) {
        return number(rest);
    }
    if first == '"' {
        let length = rest[1..].find('"').ok_or("a text without its end")?;
        return Ok((Token::Text(rest[1..=length].into()), length + 2));
    }
    let symbol = SYMBOLS.into_iter().find(|symbol| rest.starts_with(symbol));
    symbol.map(|s| (Token::Symbol(s), s.len())).ok_or_else(|| format!("`{first}` is no word of URScript"))
}

fn number(rest: &str) -> Result<(Token, usize), String> {
    let bytes = rest.as_bytes();
    let digits = |from: usize| from + bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let mut end = digits(0);
    let mut whole = true;
    if bytes.get(end) == Some(&b'.') {
        (end, whole) = (digits(end + 1), false);
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits(end + 1 + sign);
        if exponent > end + 1 + sign {
            (end, whole) = (exponent, false);
        }
    }
    let word = &rest[..end];
    let token = if whole { word.parse().ok().map(Token::Int) } else { word.parse().ok().map(Token::Float) };
    match token {
        Some(Token::Float(x)) if !x.is_finite() => Err(format!("`{word}` is too large")),
        Some(token) => Ok((token, end)),
        None => Err(format!("`{word}` is no number of 32 bits")),
    }
}
