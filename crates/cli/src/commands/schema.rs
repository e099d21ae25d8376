//! `gripgen schema` and `gripgen completions`: for editors and shells that complete what is typed.

use crate::args::{Cli, CompletionsArgs, SchemaArgs, SchemaKind};
use crate::failure::Failure;
use crate::output::print;
use crate::{campaign_schema, rosbag_schema, sweep_schema, twin_schema};
use clap::CommandFactory;
use gripgen_rig::experiment::rig_schema;

/// Runs the verb.
pub fn run(args: &SchemaArgs) -> Result<u8, Failure> {
    let schema = match args.kind {
        SchemaKind::Sweep => sweep_schema(),
        SchemaKind::Twin => twin_schema(),
        SchemaKind::Rig => rig_schema(),
        SchemaKind::Campaign => campaign_schema(),
        SchemaKind::Rosbag => rosbag_schema(),
    };
    print(&format!("{schema:#}\n"))?;
    Ok(0)
}

/// Runs `gripgen completions`.
pub fn completions(args: &CompletionsArgs) -> Result<u8, Failure> {
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut Cli::command(), "gripgen", &mut script);
    print(&String::from_utf8_lossy(&script))?;
    Ok(0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    /// The properties that a schema knows at a place, through its references.
    fn properties<'a>(schema: &'a Value, at: &'a Value) -> Option<&'a serde_json::Map<String, Value>> {
        let name = at.get("$ref").and_then(Value::as_str).and_then(|r| r.rsplit('/').next());
        let at = name.map_or(at, |name| &schema["$defs"][name]);
        at.get("properties").and_then(Value::as_object)
    }

    #[test]
    fn schemas_know_the_keys_of_shipped_files() {
        let rig = rig_schema();
        let text = gripgen::assets::read("configs/rig.toml").unwrap_or_default();
        let document: toml_edit::DocumentMut = String::from_utf8_lossy(&text).parse().unwrap_or_default();
        let mut keys = 0;
        for (section, item) in document.iter() {
            let place = &properties(&rig, &rig).and_then(|p| p.get(section)).unwrap_or(&Value::Null);
            let Some(known) = properties(&rig, place) else { continue };
            for (key, _) in item.as_table().into_iter().flat_map(|table| table.iter()) {
                assert!(known.contains_key(key), "{section}.{key}");
                keys += 1;
            }
        }
        assert!(keys > 20, "{keys} keys of rig.toml were looked up");
        let campaign = campaign_schema();
        let known = properties(&campaign, &campaign).map(|p| p.keys().cloned().collect::<Vec<_>>());
        let known = known.unwrap_or_default();
        for key in ["force_convention", "label_tolerance_n", "stop_mm", "feedback", "pulls"] {
            assert!(known.iter().any(|k| k == key), "{key}: {known:?}");
        }
        let rosbag = rosbag_schema();
        assert!(
            rosbag["$defs"]["BagTopics"]["properties"]["wrench"]["description"].is_string(),
            "{rosbag:#}"
        );
    }
}
