//! Words and numbers as a page or a picture may hold them.

use base64::Engine;

/// Letters of a name and of a sentence.
pub(crate) const NAME: usize = 60;
pub(crate) const SENTENCE: usize = 600;

/// A text that a page may hold: markup characters escaped, characters that XML forbids left out.
pub(crate) fn escape(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for c in text.chars() {
        match c {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            '\n' | '\t' => safe.push(' '),
            c if is_forbidden(c) => {}
            c => safe.push(c),
        }
    }
    safe
}

/// A text of the data without control characters, not longer than `most`. The template escapes it.
pub(crate) fn clean(text: &str, most: usize) -> String {
    let plain: String = text.chars().filter(|c| !is_forbidden(*c)).collect();
    shorten(&plain, most)
}

/// Whether a character may not be in a page.
pub(crate) fn is_forbidden(c: char) -> bool {
    c.is_control() || ('\u{fffe}'..='\u{ffff}').contains(&c)
}

/// At most `most` letters of a text, the end replaced by a dot-dot-dot.
pub(crate) fn shorten(text: &str, most: usize) -> String {
    if text.chars().count() <= most {
        return text.into();
    }
    text.chars().take(most - 1).chain(['\u{2026}']).collect()
}

/// A number with three digits that count.
pub(crate) fn number(x: f64) -> String {
    if !x.is_finite() {
        return "\u{2013}".into();
    }
    let text = match x.abs() {
        0.0 => "0".into(),
        size if !(1e-4..1e6).contains(&size) => format!("{x:.2e}"),
        size => {
            let decimals = (2.0 - libm::floor(libm::log10(size))).clamp(0.0, 6.0) as usize;
            format!("{x:.decimals$}")
        }
    };
    text.replace('-', "\u{2212}")
}

/// A picture as it stands in a page; `kind`: `png` or `jpeg`.
pub(crate) fn data_url(kind: &str, bytes: &[u8]) -> String {
    format!("data:image/{kind};base64,{}", base64::engine::general_purpose::STANDARD.encode(bytes))
}

/// A text broken between words into lines of at most `most` letters; a longer word has a line to itself, cut.
pub(crate) fn wrapped(text: &str, most: usize) -> Vec<String> {
    let mut lines: Vec<String> = Vec::new();
    for word in text.split_whitespace() {
        let word: String = word.chars().take(most).collect();
        match lines.last_mut() {
            Some(line) if line.chars().count() + 1 + word.chars().count() <= most => {
                *line += &format!(" {word}");
            }
            _ => lines.push(word),
        }
    }
    lines
}

/// At most `most` of a list, from its first to its last; the middle one where it is one.
pub(crate) fn spread<T>(all: &[T], most: usize) -> impl Iterator<Item = &T> {
    let n = most.min(all.len());
    (0..n).map(move |k| &all[if n == 1 { all.len() / 2 } else { k * (all.len() - 1) / (n - 1) }])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_three_digits() {
        let shown = [0.0, 0.331, 12.34, 412.7, 0.012_345, -2.0, 1.5e-9, 2e7, f64::NAN].map(number);
        assert_eq!(shown[..6], ["0", "0.331", "12.3", "413", "0.0123", "\u{2212}2.00"]);
        assert_eq!(shown[6..], ["1.50e\u{2212}9", "2.00e7", "\u{2013}"]);
    }

    #[test]
    fn reasons_are_broken_between_words() {
        assert_eq!(wrapped("the part is deeper than the gel", 12), ["the part is", "deeper than", "the gel"]);
        assert!(wrapped("", 12).is_empty());
        assert_eq!(wrapped("abcdefghijklmnop x", 5), ["abcde", "x"]);
    }
}
