//! `gripgen compare` of a force-sensor table.

use crate::args::CompareArgs;
use crate::failure::Failure;
use crate::load::load_twin;
use crate::output::{JsonSink, print};
use crate::{compare_sensor_table, load_sensor_table};
use serde_json::{Map, json};

/// Runs the verb.
pub fn run(args: &CompareArgs, mut sink: JsonSink) -> Result<u8, Failure> {
    let table = load_sensor_table(&args.measured).map_err(Failure::usage)?;
    let twin = load_twin(&args.twin, &[])?;
    let found = compare_sensor_table(&table, &twin)
        .map_err(|reason| Failure::usage(format!("{}: {reason}", args.measured.display())))?;
    if sink.wanted() {
        let by_session: Map<String, serde_json::Value> = found
            .by_session
            .iter()
            .map(|(name, n, rmse_n)| (name.clone(), json!({"n": n, "rmse_n": rmse_n})))
            .collect();
        sink.document(&json!({
            "schema": "gripgen.comparison/1",
            "sensor": {"n": found.n, "rmse_n": found.rmse_n, "mape_pct": found.mape_pct, "bias_n": found.bias_n,
                "by_session": by_session},
        }))?;
    }
    if !sink.on_stdout() && !args.talk.quiet {
        print(&format!(
            "{} rows, error {:.4} N ({:.1} %), gain and offset of each session refitted\n",
            found.n, found.rmse_n, found.mape_pct
        ))?;
    }
    Ok(0)
}
