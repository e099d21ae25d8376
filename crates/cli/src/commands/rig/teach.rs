//! `gripgen rig teach`: the pose of the tool becomes that of a part.

use crate::args::RigTeachArgs;
use crate::failure::Failure;
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::rig::load_rig;
use gripgen::twin::config::Document;
use gripgen_rig::experiment::RigConfig;
use gripgen_rig::experiment::check::read_pose;
use gripgen_rig::experiment::config::TaughtPose;
use gripgen_rig::experiment::plan::outside_workspace;
use gripgen_rig::program::TcpPose;
use serde_json::json;
use toml_edit::{Array, DocumentMut, Item, Table, value};

/// Runs the verb.
pub fn run(args: &RigTeachArgs) -> Result<u8, Failure> {
    let path = args.rig.display().to_string();
    // The rig's file is read and changed in its place: that is what it is for. All else is left alone.
    let mut outputs = Outputs::new(args.json.force).reads_config(&path, &args.set);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let config = load_rig(&path, &args.set)?;
    let pose = read_pose(&config)
        .map_err(|e| Failure::new(e).hint("`gripgen rig check` says which devices answer"))?;
    if let Some((axis, value_mm, low_mm, high_mm)) = outside_workspace(&config, &pose) {
        return Err(Failure::new(format!(
            "the tool is at {axis} = {value_mm:.1} mm, the workspace goes from {low_mm} to {high_mm} mm"
        ))
        .hint("a pose outside the workspace is never gone to: widen [limits], or move the part"));
    }
    let text = std::fs::read_to_string(&args.rig).map_err(|e| Failure::usage(format!("{path}: {e}")))?;
    let mut document: DocumentMut = text.parse().map_err(|e| Failure::usage(format!("{path}: {e}")))?;
    let replaced = config.poses.get(&args.name).map(TaughtPose::tcp);
    taught(&mut document, &args.name, pose.numbers());
    let text = document.to_string();
    // What was written is read once more before it replaces the file.
    RigConfig::read(&Document::parse(&path, &text)?)?;
    outputs.edit(&args.rig, text.as_bytes())?;
    let [x, y, z] = pose.position_m.map(|m| 1e3 * m);
    if sink.wanted() {
        let was = replaced.map(|was| was.numbers());
        sink.document(&json!({
            "name": args.name, "base_from_tool": pose.numbers(), "replaced": was.is_some(), "was": was
        }))?;
    }
    if !sink.on_stdout() {
        let instead = replaced.map(|was| instead_of(&was, &pose)).unwrap_or_default();
        print(&format!("{}: taught at {x:.1}, {y:.1}, {z:.1} mm{instead}\n", args.name))?;
    }
    Ok(0)
}

/// The pose that is replaced, and how far the new one is from it.
fn instead_of(was: &TcpPose, now: &TcpPose) -> String {
    let [x, y, z] = was.position_m.map(|m| 1e3 * m);
    let turned = was.base_from_tool().rotation.angle_to(&now.base_from_tool().rotation).to_degrees();
    let away_mm = 1e3 * was.distance_m(now);
    format!(", instead of {x:.1}, {y:.1}, {z:.1} mm: {away_mm:.1} mm and {turned:.1} degrees away")
}

/// Puts a pose in; comments and everything else stay.
pub fn taught(document: &mut DocumentMut, name: &str, numbers: [f64; 6]) {
    let poses = document.entry("poses").or_insert_with(|| {
        let mut table = Table::new();
        table.set_implicit(true);
        Item::Table(table)
    });
    let Some(poses) = poses.as_table_like_mut() else { return };
    let pose = poses.entry(name).or_insert_with(|| Item::Table(Table::new()));
    if let Some(pose) = pose.as_table_like_mut() {
        pose.insert("base_from_tool", value(numbers.iter().copied().collect::<Array>()));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pose_is_added_or_replaced_and_the_rest_stays() {
        let text = "# mine\n[robot]\naddress = \"a\" # there\n\n[poses.gear]\nbase_from_tool = [0, 0, 0, 0, 0, 0] # old\n";
        let mut document: DocumentMut = text.parse().unwrap();
        taught(&mut document, "gear", [0.1, 0.2, 0.3, 0.0, 1.5, 0.0]);
        taught(&mut document, "nut", [0.4, 0.0, 0.3, 0.0, 0.0, 0.0]);
        let text = document.to_string();
        assert!(text.starts_with("# mine\n[robot]\naddress = \"a\" # there\n"), "{text}");
        assert!(text.contains("[poses.gear]\nbase_from_tool = [0.1, 0.2, 0.3, 0.0, 1.5, 0.0]"), "{text}");
        assert!(text.contains("[poses.nut]\nbase_from_tool = [0.4"), "{text}");
    }

    #[test]
    fn a_pose_that_is_replaced_is_named() {
        let was = TcpPose { position_m: [0.45, 0.0, 0.25], rotation_rad: [std::f64::consts::PI, 0.0, 0.0] };
        let now = TcpPose {
            position_m: [0.45, 0.003, 0.254],
            rotation_rad: [std::f64::consts::PI - 0.1, 0.0, 0.0],
        };
        let words = instead_of(&was, &now);
        assert_eq!(words, ", instead of 450.0, 0.0, 250.0 mm: 5.0 mm and 5.7 degrees away");
    }
}
