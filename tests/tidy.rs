//! The repository itself.

use crate::common::root;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

fn read(path: &str) -> String {
    std::fs::read_to_string(root().join(path)).unwrap_or_else(|e| panic!("{path}: {e}"))
}

/// Files below a folder, without what is built.
fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if ["target", ".git", "runs", "__pycache__"].contains(&name.as_str()) {
            continue;
        }
        if path.is_dir() {
            files(&path, found);
        } else {
            found.push(path);
        }
    }
}

fn with_extension(extensions: &[&str]) -> Vec<PathBuf> {
    let mut all = Vec::new();
    files(&root(), &mut all);
    all.retain(|p| p.extension().is_some_and(|e| extensions.contains(&&*e.to_string_lossy())));
    all
}

/// Every path in backquotes that looks like one of ours exists.
#[test]
fn paths_named_in_the_documentation_exist() {
    let mut checked = 0;
    for document in [
        "ARCHITECTURE.md",
        "README.md",
        "docs/model.md",
        "docs/format.md",
        "docs/adding.md",
        "docs/adding-a-column.md",
        "docs/adding-an-effect.md",
    ] {
        let text = read(document);
        for word in text.split('`').skip(1).step_by(2) {
            let ours = ["crates/", "src/", "assets/", "docs/", "tests/", "benches/", "research/", "xtask/"];
            if ours.iter().any(|p| word.starts_with(p)) && !word.contains(['<', '*', ' ']) {
                checked += 1;
                assert!(root().join(word.trim_end_matches('/')).exists(), "{document} names `{word}`");
            }
        }
    }
    assert!(checked > 40, "only {checked} paths checked");
}

/// Every test that docs/model.md names is there.
#[test]
fn tests_named_in_the_model_exist() {
    let sources: String =
        with_extension(&["rs", "py"]).iter().map(|p| std::fs::read_to_string(p).unwrap()).collect();
    let text = read("docs/model.md");
    let mut named = 0;
    for word in text.split('`').skip(1).step_by(2) {
        let is_name =
            word.len() > 20 && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_');
        if is_name {
            named += 1;
            let found =
                sources.contains(&format!("fn {word}(")) || sources.contains(&format!("def test_{word}("));
            assert!(found, "docs/model.md names the test `{word}`");
        }
    }
    assert!(named > 25, "only {named} tests named");
}

/// Code files stay short enough to read at once.
#[test]
fn no_code_file_is_longer_than_500_lines() {
    for path in with_extension(&["rs", "py", "wgsl"]) {
        let lines = std::fs::read_to_string(&path).unwrap().lines().count();
        let table = path.ends_with("proto/gripgen.v1.rs");
        assert!(lines <= 500 || table, "{} has {lines} lines", path.display());
    }
}

/// The arrows between packages are those of ARCHITECTURE.md.
#[test]
fn packages_depend_on_each_other_as_drawn() {
    let allowed = [
        ("crates/twin", &[][..]),
        ("crates/identify", &["gripgen-twin"][..]),
        ("crates/physics", &["gripgen-twin"][..]),
        ("crates/tactile", &["gripgen-twin"][..]),
        ("crates/record", &["gripgen-twin"][..]),
        ("crates/measured", &["gripgen-record", "gripgen-twin"][..]),
        ("crates/report", &["gripgen-identify", "gripgen-record", "gripgen-twin"][..]),
        ("crates/rig", &["gripgen-twin"][..]),
        ("crates/rig_sim", &["gripgen-rig", "gripgen-twin"][..]),
        (".", &["gripgen-physics", "gripgen-record", "gripgen-tactile", "gripgen-twin"][..]),
        ("xtask", &[][..]),
    ];
    for (package, arrows) in allowed {
        let manifest: toml::Table = read(&format!("{package}/Cargo.toml")).parse().unwrap();
        let dependencies =
            manifest.get("dependencies").and_then(toml::Value::as_table).cloned().unwrap_or_default();
        let ours: Vec<&String> = dependencies.keys().filter(|k| k.starts_with("gripgen")).collect();
        assert_eq!(ours, arrows, "{package}");
    }
}

/// A Rust file without its tests: items under `#[cfg(test)]` are left out, whatever follows them stays. Strings and comments
/// stay as they are.
fn without_tests(text: &str) -> String {
    let mut kept = String::with_capacity(text.len());
    let mut rest = text;
    while let Some(at) = rest.find("#[cfg(test)]") {
        kept.push_str(&rest[..at]);
        rest = &rest[at + item_len(&rest[at..])..];
    }
    kept + rest
}

/// Bytes of an item from its attributes on: up to the `;` or the closing brace that ends it, outside strings, characters and comments.
fn item_len(text: &str) -> usize {
    let bytes = text.as_bytes();
    let (mut depth, mut i) = (0usize, 0);
    while i < bytes.len() {
        match bytes[i] {
            b'/' if text[i..].starts_with("//") => i += text[i..].find('\n').unwrap_or(text.len() - i),
            b'r' if text[i..].starts_with("r#\"") => i += 3 + text[i + 3..].find("\"#").unwrap_or(0) + 1,
            b'"' => {
                i += 1;
                while i < bytes.len() && bytes[i] != b'"' {
                    i += 1 + usize::from(bytes[i] == b'\\');
                }
            }
            // A character, and no lifetime.
            b'\'' if text[i..].chars().nth(2) == Some('\'') => i += 2,
            b'\'' if text[i..].starts_with("'\\") => i += 3 + text[i + 3..].find('\'').unwrap_or(0),
            b'{' | b'(' | b'[' => depth += 1,
            // The end of what the item stands in: a field, a variant, an arm.
            b'}' | b')' | b']' if depth == 0 => return i,
            b'}' if depth == 1 => return i + 1,
            b'}' | b')' | b']' => depth -= 1,
            b';' if depth == 0 => return i + 1,
            _ => {}
        }
        i += 1;
    }
    text.len()
}

/// Names of functions whose last bit depends on the host's mathematical library.
const TRANSCENDENTAL: [&str; 25] = [
    "sin", "cos", "tan", "sin_cos", "asin", "acos", "atan", "atan2", "sinh", "cosh", "tanh", "asinh",
    "acosh", "atanh", "exp", "exp2", "exp_m1", "ln", "ln_1p", "log", "log2", "log10", "powf", "cbrt",
    "hypot",
];

/// What a package or a folder may not use, outside tests and examples.
fn absent_from(relative: &str) -> (&'static [&'static str], bool) {
    let starts = |folder: &str| relative.starts_with(folder);
    let no_world = &["std::fs", "std::time", "std::thread", "std::net", "Instant::now"];
    if starts("crates/twin/src") || starts("crates/physics/src") || starts("crates/tactile/src") {
        (no_world, true)
    } else if starts("crates/identify/src") || starts("src/") {
        (&["std::net"], true)
    } else if (starts("crates/rig/src") || starts("crates/rig_sim/src")) && relative.ends_with("/socket.rs") {
        (&["std::fs"], false)
    } else if starts("crates/rig/src/experiment") {
        // The experiment waits and hurries, on connections that others made.
        (&["std::fs", "TcpStream", "TcpListener"], false)
    } else if starts("crates/rig/src") || starts("crates/rig_sim/src") {
        // Protocols are sessions without sockets.
        (&["std::fs", "std::time", "std::thread", "TcpStream", "TcpListener", "Instant::now"], false)
    } else if starts("crates/cli/src/commands/rig") {
        (&["TcpStream", "TcpListener"], false)
    } else if relative == "crates/cli/tests/cli/live.rs" {
        // A client of the page.
        (&[], false)
    } else if relative == "crates/cli/src/live.rs" {
        // The one page that is served.
        (&["std::net"], false)
    } else {
        (&["std::net", "tiny_http"], false)
    }
}

/// `twin` opens no file, reads no clock, starts no thread; only `rig` opens sockets, in files of their own, and the page of `--live`; what a sample or a
/// diagnosis depends on takes no function of the host's mathematical library.
#[test]
fn absences_that_the_architecture_promises() {
    let mut exact = 0;
    for path in with_extension(&["rs"]) {
        let text = std::fs::read_to_string(&path).unwrap();
        let relative = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        if relative.ends_with("tests.rs")
            || relative.ends_with("/testing.rs")
            || relative.contains("/src/tests/")
            || relative.contains("/examples/")
            || relative == "tests/tidy.rs"
        {
            continue;
        }
        let code = without_tests(&text);
        let (absent, deterministic) = absent_from(&relative);
        for word in absent {
            assert!(!code.contains(word), "{relative} uses {word}");
        }
        exact += usize::from(deterministic);
        for name in TRANSCENDENTAL.iter().filter(|_| deterministic) {
            let calls = [
                format!(".{name}("),
                format!("f64::{name}("),
                format!("f64::{name})"),
                format!("f32::{name}("),
            ];
            let found = calls.iter().any(|call| code.contains(call));
            assert!(!found, "{relative} uses {name} of the host, not of libm");
        }
    }
    assert!(exact > 200, "only {exact} files checked");
}

/// Items under test are left out wherever they stand, and what follows them is read.
#[test]
fn only_tests_are_left_out() {
    let text = "a;\n#[cfg(test)]\nmod tests;\nb.sin();\n#[cfg(test)]\nfn f() -> [u8; 2] { \"}\"; '{'; [1, 2] } // }\nc;";
    assert_eq!(without_tests(text), "a;\n\nb.sin();\n // }\nc;");
}

/// Who else names an effect than its own file, tests, benchmarks and studies is listed in ARCHITECTURE.md with its reason.
#[test]
fn effects_are_named_in_their_own_files() {
    let architecture = read("ARCHITECTURE.md");
    let (_, list) = architecture.split_once("## Who names an effect").unwrap();
    let list = list.split("\n## ").next().unwrap();
    let listed: BTreeSet<&str> =
        list.lines().filter_map(|l| l.strip_prefix("- `")?.split('`').next()).collect();
    let mut naming = BTreeSet::new();
    for path in with_extension(&["rs", "py", "wgsl", "html"]) {
        let relative = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        let elsewhere = ["crates/twin/src/effects/", "tests/", "benches/", "research/"]
            .iter()
            .any(|f| relative.starts_with(f))
            || relative.contains("/tests/")
            || relative.ends_with("tests.rs");
        if elsewhere {
            continue;
        }
        let text = without_tests(&std::fs::read_to_string(&path).unwrap());
        for spec in gripgen::twin::effects::LIBRARY {
            if ['"', '\'', '`'].iter().any(|quote| text.contains(&format!("{quote}{}{quote}", spec.id))) {
                assert!(listed.contains(&*relative), "{relative} names `{}`", spec.id);
                naming.insert(relative.clone());
            }
        }
    }
    assert!(listed.iter().eq(&naming), "{listed:?} are listed, {naming:?} name effects");
}

/// Keys of configuration files carry their unit.
#[test]
fn configuration_keys_carry_their_units() {
    let plain = [
        "mu",
        "scatter",
        "seed",
        "samples",
        "repetitions",
        "value",
        "jitter",
        "shard_samples",
        "a",
        "low90",
        "high90",
        "grip_pose",
        "kinetic_ratio",
        "restore_depth_fraction",
        "direction",
    ];
    let units = [
        "_n",
        "_mm",
        "_m",
        "_s",
        "_hz",
        "_deg",
        "_rad",
        "_c",
        "_kg",
        "_kg_m2",
        "_px",
        "_per_n",
        "_per_m",
        "_per_mm",
        "_per_unit",
    ];
    for file in [
        "assets/configs/twin.toml",
        "assets/configs/quickstart.toml",
        "assets/configs/paper.toml",
        "assets/templates/sweep.toml",
        "assets/templates/twin.toml",
    ] {
        let table: toml::Table = read(file).parse().unwrap();
        check_units(&toml::Value::Table(table), file, "", &plain, &units);
    }
}

fn check_units(value: &toml::Value, file: &str, key: &str, plain: &[&str], units: &[&str]) {
    match value {
        toml::Value::Table(t) => t.iter().for_each(|(k, v)| {
            // The names of distributions are not quantities; the key above them is.
            let shown = if ["uniform", "normal", "log_uniform"].contains(&k.as_str()) { key } else { k };
            check_units(v, file, shown, plain, units);
        }),
        toml::Value::Array(a) => a.iter().for_each(|v| check_units(v, file, key, plain, units)),
        toml::Value::Integer(_) | toml::Value::Float(_) => {
            let leaf = key.rsplit('.').next().unwrap_or(key);
            let good = plain.contains(&leaf) || units.iter().any(|u| leaf.ends_with(u));
            assert!(good, "{file}: `{key}` has no unit in its name");
        }
        _ => {}
    }
}

/// Every asset says where it comes from.
#[test]
fn assets_state_their_provenance() {
    for folder in
        ["assets", "assets/parts", "assets/sensors", "assets/sensors/gelsight_r15", "assets/configs"]
    {
        let text = read(&format!("{folder}/README.md"));
        assert!(text.len() > 300, "{folder}/README.md is too short to be of use");
    }
}
