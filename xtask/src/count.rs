//! How large the repository is: Rust lines by place, files by folder, numeric constants of `identify`.
//!
//! Files are those that git tracks. A line is a test line in a test file, or in an item under `#[cfg(test)]`.

use crate::root;
use std::collections::BTreeMap;
use std::process::Command;

/// More source files in one folder are listed.
const MOST_FILES: usize = 30;

/// Lines of a file or of a place.
#[derive(Default)]
struct Lines {
    files: usize,
    code: usize,
    comments: usize,
    tests: usize,
    total: usize,
    /// Numeric constants, in code and in tests.
    constants: [usize; 2],
}

impl Lines {
    fn of(path: &str, text: &str) -> Self {
        let all_tests = is_test_file(path);
        let mut lines = Self { files: 1, total: text.lines().count(), ..Self::default() };
        // Indentation of the item under test that a line belongs to.
        let mut item: Option<usize> = None;
        for line in text.lines() {
            let trimmed = line.trim_start();
            let indentation = line.len() - trimmed.len();
            if item.is_none() && trimmed.starts_with("#[cfg(test)]") {
                item = Some(indentation);
            }
            let test = all_tests || item.is_some();
            lines.constants[usize::from(test)] += usize::from(is_numeric_constant(trimmed));
            match trimmed {
                _ if test => lines.tests += 1,
                "" => {}
                _ if trimmed.starts_with("//") => lines.comments += 1,
                _ => lines.code += 1,
            }
            // rustfmt puts the end of an item at the indentation of its first line.
            let closes = trimmed.starts_with('}') || trimmed.ends_with(';') || trimmed.ends_with('}');
            if item == Some(indentation) && closes && !trimmed.starts_with("//") {
                item = None;
            }
        }
        lines
    }

    fn add(&mut self, other: &Self) {
        self.files += other.files;
        self.code += other.code;
        self.comments += other.comments;
        self.tests += other.tests;
        self.total += other.total;
        self.constants[0] += other.constants[0];
        self.constants[1] += other.constants[1];
    }

    fn print(&self, place: &str) {
        let Self { files, code, comments, tests, total, .. } = self;
        println!("{place:<18}{files:>7}{code:>9}{comments:>10}{tests:>9}{total:>9}");
    }
}

fn is_test_file(path: &str) -> bool {
    path.starts_with("tests/") || path.contains("/tests/") || path.ends_with("tests.rs")
}

/// `const NAME: f64`, `f32`, `usize`, `u32` or a tuple that begins with an `f64`.
fn is_numeric_constant(trimmed: &str) -> bool {
    let rest = trimmed
        .strip_prefix("pub")
        .map_or(trimmed, |rest| rest.split_once(' ').map_or(rest, |(_visibility, rest)| rest));
    let Some((name, kind)) = rest.strip_prefix("const ").and_then(|rest| rest.split_once(':')) else {
        return false;
    };
    let numeric = ["f64", "f32", "usize", "u32", "(f64"];
    name.bytes().all(|b| b.is_ascii_uppercase() || b.is_ascii_digit() || b == b'_')
        && numeric.iter().any(|n| kind.trim_start().starts_with(n))
}

/// The crate or top folder that a file belongs to.
fn place(path: &str) -> &str {
    let mut slashes = path.match_indices('/').map(|(at, _)| at);
    let end = if path.starts_with("crates/") { slashes.nth(1) } else { slashes.next() };
    end.map_or(".", |end| &path[..end])
}

/// Prints the counts.
pub fn count() -> Result<(), String> {
    let listed = Command::new("git").args(["ls-files", "-z"]).current_dir(root()).output();
    let listed = listed.map_err(|e| format!("git: {e}"))?;
    let listed = String::from_utf8_lossy(&listed.stdout);
    let mut places: BTreeMap<&str, Lines> = BTreeMap::new();
    let mut folders: BTreeMap<&str, usize> = BTreeMap::new();
    let (mut all, mut longest) = (Lines::default(), (0, ""));
    for path in listed.split('\0').filter(|path| root().join(path).is_file()) {
        if [".rs", ".py", ".wgsl"].iter().any(|end| path.ends_with(end)) {
            *folders.entry(path.rsplit_once('/').map_or(".", |(folder, _)| folder)).or_default() += 1;
        }
        if path.ends_with(".rs") {
            let text = std::fs::read_to_string(root().join(path)).map_err(|e| format!("{path}: {e}"))?;
            let lines = Lines::of(path, &text);
            longest = longest.max((lines.total, path));
            places.entry(place(path)).or_default().add(&lines);
            all.add(&lines);
        }
    }
    println!("{:<18}{:>7}{:>9}{:>10}{:>9}{:>9}", "Rust lines", "files", "code", "comments", "tests", "total");
    places.iter().for_each(|(place, lines)| lines.print(place));
    all.print("all");
    println!("\nmean file {} lines, longest {} ({})", all.total / all.files.max(1), longest.0, longest.1);
    println!("\nfolders with more than {MOST_FILES} source files:");
    let mut crowded: Vec<_> = folders.into_iter().filter(|(_, files)| *files > MOST_FILES).collect();
    crowded.sort_by_key(|(_, files)| std::cmp::Reverse(*files));
    crowded.iter().for_each(|(folder, files)| println!("{files:>7}  {folder}"));
    if let Some(identify) = places.get("crates/identify") {
        let [code, tests] = identify.constants;
        println!("\nnumeric constants of crates/identify: {code}, and {tests} in tests");
    }
    Ok(())
}
