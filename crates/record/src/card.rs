//! What somebody who only has exported files wants to know: what is what, units, twin and effects, hash, licence, how to split.

use crate::dataset::Dataset;
use gripgen_twin::Values;
use gripgen_twin::columns::find;
use std::fmt::Write;

/// What columns are that no pull has beside them.
const ABOUT: [(&str, &str, &str); 17] = [
    ("index", "", "index of the sample in its run"),
    ("sample_index", "", "index of the sample in its run"),
    (
        "status",
        "",
        "slipped; censored: the label is a lower bound; no_contact: 0; suspect: contradicted by the trace; failed: no label",
    ),
    ("max_pull_force_n", "N", "the label: the measured pull force at slip"),
    ("slip_time_s", "s", "when it slips, since the start of the pull"),
    ("peak_force_n", "N", "largest mean over 20 ms while the jaws held"),
    ("kinetic_force_n", "N", "median from 0.2 to 1 mm past the peak: friction of jaws that slide"),
    (
        "label_branch",
        "",
        "static, early (before the slip, off the peak by more than the tolerance) or kinetic: where the label was read",
    ),
    ("limit_force_n", "N", "what both jaws held, without noise and label rule"),
    ("slip_onset_s", "s", "when the first part of the contact slid"),
    ("slip_s", "s", "when all of it did"),
    ("mu_drawn", "1", "friction coefficient of the part as it was drawn for this grip"),
    ("mu_effective", "1", "friction coefficient that acted, after friction laws and contact"),
    ("group", "", "repetitions of one configuration share it"),
    ("repetition", "", "which repetition"),
    ("pull_id", "", "what the pull is called in its table"),
    ("status_reason", "", "why it failed or is suspect"),
];

/// The common part of all cards, in Markdown.
pub(crate) fn facts(dataset: &Dataset) -> String {
    let mut text = String::from(
        "Grip forces are those of one jaw; forces are in newtons, what else has a unit has it in its name. Images are RGB, 8 bits, as they \
         were read or made, with the noise of the sensor, without loss.\n\n\
         **Split** by `group` (repetitions of one configuration share it), or by `part`, never by row: repetitions are nearly the same sample. \
         Leave `failed` and `suspect` rows out of training.\n\n\
         **Inputs, labels, answers**: an input is known before the pull, a label came out of it. An answer (`answer.` in its name) is what \
         only the simulation knows: a network that is given one predicts nothing that a robot could.\n\n\
         **Licence**: gripgen is MIT OR Apache-2.0 and claims nothing of what it makes; whoever publishes these data chooses theirs. The meshes and \
         sensor files that they were made with may have terms of their own.\n",
    );
    if let Some(run) = dataset.run() {
        let info = run.info();
        let effects = effects(&info.config_toml);
        let effects = if effects.is_empty() { "none".to_string() } else { effects.join(", ") };
        let _ = write!(
            text,
            "\n**Made** by gripgen {} (source: {}), run `{}` of {} samples, configuration {}. **Effects** of its twin: {effects}.\n",
            info.gripgen_version, info.source, info.name, info.samples, info.config_sha256
        );
    }
    text
}

/// The columns of the table with their units, in Markdown; `renamed` says what they are called in the files.
pub(crate) fn columns(dataset: &Dataset, renamed: impl Fn(&str) -> String) -> String {
    let mut text = String::from("| column | role | unit | what it is |\n|---|---|---|---|\n");
    for (name, values) in dataset.table().columns() {
        let known = find(name).map(|c| (c.unit, c.about));
        let beside = || ABOUT.iter().find(|(n, ..)| n == name).map(|(_, unit, about)| (*unit, *about));
        let kind = if matches!(values, Values::Words(_)) { "a word" } else { "a number" };
        let (unit, about) = known.or_else(beside).unwrap_or(("", kind));
        let role = dataset.role(name).name();
        let _ = writeln!(text, "| `{}` | {role} | {unit} | {about} |", renamed(name));
    }
    text
}

/// The configuration of a run, in Markdown.
pub(crate) fn configuration(dataset: &Dataset) -> String {
    let text = dataset.run().map(|run| run.info().config_toml.clone());
    text.map_or_else(String::new, |text| format!("\n```toml\n{text}```\n"))
}

/// Ids of the effects of a resolved configuration.
fn effects(config_toml: &str) -> Vec<String> {
    let Ok(config) = config_toml.parse::<toml::Table>() else { return vec![] };
    let twin = config.get("twin").and_then(toml::Value::as_table).unwrap_or(&config);
    let all = twin.get("effects").or_else(|| config.get("effects")).and_then(toml::Value::as_array);
    let name = |effect: &toml::Value| {
        let id = ["id", "name", "effect"].into_iter().find_map(|key| effect.get(key)?.as_str());
        id.map(String::from)
    };
    all.into_iter().flatten().filter_map(name).collect()
}
