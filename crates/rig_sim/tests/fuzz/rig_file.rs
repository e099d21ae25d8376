//! `rig.toml` with hostile values, and with lines and words that are lost, doubled and exchanged.

use super::mutate::{Random, shuffled};
use gripgen_rig::experiment::RigConfig;
use gripgen_twin::config::Document;

/// What is written in the place of a value.
const HOSTILE: [&str; 14] = [
    "nan",
    "-inf",
    "1e308",
    "5e-324",
    "-1",
    "0",
    "65536",
    "9223372036854775807",
    "\"\"",
    "\"127.0.0.1:99999\"",
    "[]",
    "[nan, nan, nan]",
    "{}",
    "true",
];

#[test]
fn changed_rigs_never_panic() {
    let shipped = include_str!("../../../../assets/configs/rig.toml").to_string();
    let read = |text: &str| Document::parse("rig.toml", text).and_then(|document| RigConfig::read(&document));
    read(&shipped).unwrap();
    let mut random = Random::named("rig_file");
    let (mut refused, mut taken) = (0, 0);
    for _ in 0..super::inputs().min(100_000) {
        let text = if random.below(3) == 0 {
            shuffled(&mut random, std::slice::from_ref(&shipped))
        } else {
            let mut lines: Vec<String> = shipped.lines().map(String::from).collect();
            for _ in 0..=random.below(3) {
                let at = random.below(lines.len());
                if let Some((key, _)) = lines[at].clone().split_once('=') {
                    lines[at] = format!("{key}= {}", random.pick(&HOSTILE));
                }
            }
            lines.join("\n")
        };
        match read(&text) {
            Ok(_) => taken += 1,
            Err(problem) => {
                assert!(!problem.to_string().is_empty());
                refused += 1;
            }
        }
    }
    println!("{refused} rigs were refused, {taken} taken");
    assert!(refused > 0 && taken > 0);
}
