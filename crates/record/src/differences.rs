//! What two resolved configurations differ in.

/// Differences that are named; the rest are counted.
const SHOWN: usize = 4;

/// The keys in which two configurations differ, with both values; `None` if they are the same or cannot be read.
pub fn differences(there: &str, here: &str) -> Option<String> {
    let (there, here) = (there.parse::<toml::Table>().ok()?, here.parse::<toml::Table>().ok()?);
    let mut found = Vec::new();
    compare("", &there.into(), &here.into(), &mut found);
    let more = found.len().saturating_sub(SHOWN);
    let mut text = found.iter().take(SHOWN).cloned().collect::<Vec<_>>().join("; ");
    if more > 0 {
        text += &format!("; and {more} more");
    }
    (!found.is_empty()).then_some(text)
}

fn compare(key: &str, there: &toml::Value, here: &toml::Value, found: &mut Vec<String>) {
    match (there, here) {
        (toml::Value::Table(a), toml::Value::Table(b)) => {
            let mut names: Vec<&String> = a.keys().chain(b.keys()).collect();
            names.sort();
            names.dedup();
            for name in names {
                let inner = if key.is_empty() { name.clone() } else { format!("{key}.{name}") };
                match (a.get(name), b.get(name)) {
                    (Some(a), Some(b)) => compare(&inner, a, b, found),
                    (Some(a), None) => found.push(format!("{inner} is {} there, not set here", brief(a))),
                    (_, b) => found
                        .push(format!("{inner} is not set there, {} here", b.map_or(String::new(), brief))),
                }
            }
        }
        _ if there == here => {}
        (toml::Value::Array(a), toml::Value::Array(b)) if a.iter().chain(b).all(toml::Value::is_str) => {
            let only = |of: &[toml::Value], other: &[toml::Value]| {
                let words: Vec<String> =
                    of.iter().filter(|word| !other.contains(word)).map(ToString::to_string).collect();
                if words.is_empty() { "nothing more".into() } else { words.join(", ") }
            };
            found.push(format!("{key} has {} there alone, {} here alone", only(a, b), only(b, a)));
        }
        (toml::Value::Array(a), toml::Value::Array(b)) if a.iter().chain(b).any(toml::Value::is_table) => {
            if a.len() != b.len() {
                found.push(format!("{key} has {} entries there, {} here", a.len(), b.len()));
            }
            for (i, (a, b)) in a.iter().zip(b).enumerate() {
                compare(&format!("{key}[{i}]"), a, b, found);
            }
        }
        _ => found.push(format!("{key} is {} there, {} here", brief(there), brief(here))),
    }
}

/// A value in a few words.
fn brief(value: &toml::Value) -> String {
    let text = value.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
    if text.chars().count() <= 60 {
        text
    } else {
        format!("{} ...", text.chars().take(56).collect::<String>())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_difference_is_named_with_both_values() {
        let text =
            differences("[a]\nx = 1\ny = [1, 2]\nz = 3\n", "[a]\nx = 2\ny = [1, 2]\nw = \"p\"\n").unwrap();
        assert_eq!(
            text,
            "a.w is not set there, \"p\" here; a.x is 1 there, 2 here; a.z is 3 there, not set here"
        );
        assert_eq!(differences("a = 1", "a = 1"), None);
        // Lists of entries by their entries, lists of words by the words.
        assert_eq!(
            differences("p = [{f = 20.0, x = 1}, {f = 25.0}]", "p = [{f = 20.0, x = 1}, {f = 30.0}]")
                .unwrap(),
            "p[1].f is 25.0 there, 30.0 here"
        );
        assert_eq!(
            differences("p = [{f = 20.0}, {f = 25.0}]", "p = [{f = 21.0}]").unwrap(),
            "p has 2 entries there, 1 here; p[0].f is 20.0 there, 21.0 here"
        );
        assert_eq!(
            differences("r = [\"a\", \"b\"]", "r = [\"b\", \"operator\"]").unwrap(),
            "r has \"a\" there alone, \"operator\" here alone"
        );
    }
}
