//! Commands that a person copies into a shell: every word comes back as it was.

use std::path::Path;

/// A command of these words, quoted for a POSIX shell. A path or a value that may begin with a dash goes through [`operand`] or
/// [`path`] first.
pub fn command_line(words: &[impl AsRef<str>]) -> String {
    words.iter().map(|word| quoted(word.as_ref())).collect::<Vec<_>>().join(" ")
}

/// A word as a POSIX shell reads it back: as it is where nothing in it has a meaning of its own, else in single quotes.
pub fn quoted(word: &str) -> String {
    let plain = |c: char| c.is_alphanumeric() || "_-./:=,+@%".contains(c);
    if !word.is_empty() && word.chars().all(plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

/// A path as it is typed, such that it is no option: `-plate.ply` is `./-plate.ply`. `asset:...` stays.
pub fn operand(path: &str) -> String {
    if path.starts_with('-') { format!("./{path}") } else { path.into() }
}

/// The same of a path.
pub fn path(path: &Path) -> String {
    operand(&path.to_string_lossy())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn plain_words_stay_and_others_are_quoted() {
        for (word, wanted) in [
            ("runs/a-1_b.toml", "runs/a-1_b.toml"),
            ("asset:configs/twin.toml", "asset:configs/twin.toml"),
            ("twin=d.toml", "twin=d.toml"),
            ("größe.stl", "größe.stl"),
            ("ring ascii.stl", "'ring ascii.stl'"),
            ("vary.part=[\"gear\"]", "'vary.part=[\"gear\"]'"),
            ("it's", r"'it'\''s'"),
            ("$HOME;rm", "'$HOME;rm'"),
            ("~/a", "'~/a'"),
            ("", "''"),
        ] {
            assert_eq!(quoted(word), wanted);
        }
    }

    #[test]
    fn a_path_is_no_option() {
        let words = ["gripgen", "init", &path(Path::new("-plate one.ply")), "-o", &operand("-plate")];
        assert_eq!(command_line(&words), "gripgen init './-plate one.ply' -o ./-plate");
        assert_eq!(operand("asset:configs/twin.toml"), "asset:configs/twin.toml");
    }

    /// What a shell makes of it is what went in.
    #[cfg(unix)]
    #[test]
    fn a_shell_reads_the_words_back() {
        let words = ["a b", "it's", "$(true)", "*", "\\", "\"q\"", "-x", "", "~", "#c", "a\nb"];
        let line = format!("for w in {}; do printf '%s|' \"$w\"; done", command_line(&words));
        let said = std::process::Command::new("sh").args(["-c", &line]).output().unwrap();
        assert_eq!(String::from_utf8(said.stdout).unwrap(), format!("{}|", words.join("|")));
    }
}
