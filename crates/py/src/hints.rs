//! Hints of the command line in the words of Python: `--force` is `force=True` here.

/// Options of the command line that Python's calls take as keywords of the same name.
const KEYWORDS: [&str; 14] = [
    "depth-mm",
    "fit",
    "force",
    "jobs",
    "law",
    "out",
    "report",
    "rotation-deg",
    "scale-mm-per-unit",
    "set",
    "slice",
    "twin",
    "x-px",
    "y-px",
];

/// The hint with keywords in place of options. What Python has no keyword for stays, and so do whole commands in backquotes:
/// they are for a shell.
pub fn in_python(hint: &str) -> String {
    let pieces = hint.split('`').enumerate().map(|(i, piece)| match i % 2 {
        0 => with_keywords(piece, "`"),
        _ if piece.starts_with("--") => with_keywords(piece, ""),
        _ => piece.to_string(),
    });
    pieces.collect::<Vec<_>>().join("`")
}

/// A piece of a hint with its keywords between two of `quote`.
fn with_keywords(text: &str, quote: &str) -> String {
    let mut found = String::with_capacity(text.len());
    let mut rest = text;
    while let Some((before, option)) = rest.split_once("--") {
        found.push_str(before);
        let end = option.find(|c: char| !c.is_ascii_lowercase() && c != '-').unwrap_or(option.len());
        let (name, after) = option.split_at(end);
        rest = match keyword(name, after) {
            Some((written, left)) => {
                found.extend([quote, written.as_str(), quote]);
                left
            }
            None => {
                found.extend(["--", name]);
                after
            }
        };
    }
    found + rest
}

/// An option as a keyword, with its value if one follows; and what is left of the text.
fn keyword<'a>(name: &str, after: &'a str) -> Option<(String, &'a str)> {
    let known = KEYWORDS.into_iter().find(|known| *known == name)?.replace('-', "_");
    if known == "force" {
        return Some(("force=True".into(), after));
    }
    let (value, left) = after.strip_prefix([' ', '=']).map_or(("", after), first_word);
    let written = match value.split_once('=') {
        Some((key, value)) if known == "set" => Some(format!("set={{\"{key}\": {}}}", literal(value))),
        _ => is_number(value).then(|| format!("{known}={value}")),
    };
    // What follows is no value but the rest of the sentence.
    Some(written.map_or_else(|| (format!("{known}="), after), |written| (written, left)))
}

/// The first word without the shell's quotes or the punctuation behind it, and what is left of the text.
fn first_word(text: &str) -> (&str, &str) {
    if let Some(quoted) = text.strip_prefix('\'').and_then(|inside| inside.split_once('\'')) {
        return quoted;
    }
    let end = text.find(char::is_whitespace).unwrap_or(text.len());
    text.split_at(text[..end].trim_end_matches(['.', ',', ';', ':', ')']).len())
}

/// A value of `set` as Python writes it: what is no number is a string there, which is read as TOML.
fn literal(value: &str) -> String {
    match value {
        number if is_number(number) => number.into(),
        toml if toml.contains('"') => format!("'{toml}'"),
        word => format!("\"{word}\""),
    }
}

fn is_number(text: &str) -> bool {
    text.starts_with(|c: char| c.is_ascii_digit() || c == '-') && text.parse::<f64>().is_ok()
}
