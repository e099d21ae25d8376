//! JSON Schemas of the configuration files.

use gripgen::assets;
use gripgen_measured::CampaignFile;
use gripgen_twin::DEFAULTED_SECTIONS;
use gripgen_twin::config::{SweepFile, TwinFile};
use serde_json::Value;

/// Schema of `sweep.toml`.
pub fn sweep_schema() -> Value {
    schemars::schema_for!(SweepFile).to_value()
}

/// Schema of `campaign.toml`.
pub fn campaign_schema() -> Value {
    schemars::schema_for!(CampaignFile).to_value()
}

/// Schema of `rosbag.toml`, which the Python package reads.
pub fn rosbag_schema() -> Value {
    serde_json::from_str(assets::text("schemas/rosbag.json")).unwrap_or_default()
}

/// Schema of `twin.toml`. Sections that fall back to the baseline twin, and their keys, may be left out.
pub fn twin_schema() -> Value {
    let mut schema = schemars::schema_for!(TwinFile).to_value();
    let keep = |required: &mut Vec<Value>| {
        required.retain(|key| !key.as_str().is_some_and(|k| DEFAULTED_SECTIONS.contains(&k)));
    };
    if let Some(Value::Array(required)) = schema.get_mut("required") {
        keep(required);
    }
    if let Some(Value::Object(definitions)) = schema.get_mut("$defs") {
        for (name, definition) in definitions {
            let defaulted = ["RobotFile", "GripperFile", "WristFile", "GelFile", "OpticsFile"]
                .contains(&name.as_str())
                || name.starts_with("PerJawFile");
            if let (true, Some(object)) = (defaulted, definition.as_object_mut()) {
                object.remove("required");
            }
        }
    }
    schema
}
