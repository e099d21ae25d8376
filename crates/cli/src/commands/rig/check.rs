//! `gripgen rig check`: does every device answer.

use crate::args::RigCheckArgs;
use crate::failure::{Failure, code};
use crate::output::{JsonSink, print};
use crate::outputs::Outputs;
use crate::rig::{check_rig, load_rehearsal, load_rig};
use gripgen_rig::experiment::check::check_force;
use serde_json::{Value, json};

/// Runs the verb.
pub fn run(args: &RigCheckArgs) -> Result<u8, Failure> {
    let mut outputs = Outputs::new(args.json.force).reads_config(&args.rig, &args.set);
    let mut sink = JsonSink::open(args.json.json.as_deref(), &mut outputs)?;
    let config = load_rig(&args.rig, &args.set)?;
    let rehearsal = args.rehearsal.as_deref().map(load_rehearsal).transpose()?;
    let (on_stdout, mut failed) = (sink.on_stdout(), Ok(()));
    let lines = check_rig(&config, rehearsal.as_ref(), |line| {
        let mark = if line.ok { "ok  " } else { "BAD " };
        if !on_stdout && failed.is_ok() {
            failed = print(&format!("{mark} {:<18} {}\n", line.what, line.found));
        }
    });
    failed?;
    let (mut force, mut force_ok) = (Value::Null, true);
    if let Some(mass_kg) = args.mass_kg {
        let hang = || eprintln!("hang {mass_kg} kg on the tool now, and let it come to rest");
        let found = check_force(&config, mass_kg, hang).map_err(Failure::new)?;
        force_ok =
            found.sign == config.robot.force_sign && (found.gain - config.robot.force_gain).abs() < 0.05;
        force = json!({"change_n": found.change_n, "weight_n": found.weight_n, "force_sign": found.sign, "force_gain": found.gain});
        if !on_stdout {
            let words = format!(
                "the reading changed by {:.2} N for {:.2} N: force_sign = {:.1}, force_gain = {:.3}",
                found.change_n, found.weight_n, found.sign, found.gain
            );
            let verdict = if force_ok { "as in the rig's file" } else { "set them in the rig's file" };
            print(&format!(
                "{}  {:<18} {words}; {verdict}\n",
                if force_ok { "ok " } else { "BAD" },
                "force sign"
            ))?;
        }
    }
    let ok = force_ok && lines.iter().all(|line| line.ok);
    let entries: Vec<Value> =
        lines.iter().map(|l| json!({"what": l.what, "ok": l.ok, "found": l.found})).collect();
    sink.document(&json!({"schema": "gripgen.rigcheck/1", "ok": ok, "checks": entries, "force": force}))?;
    if !ok && !args.talk.quiet && !on_stdout {
        eprintln!("an experiment needs all of them; nothing was moved");
    }
    Ok(if ok { 0 } else { code::FAILED })
}
