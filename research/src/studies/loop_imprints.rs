//! The tables of research/loop/imprints.md: real grasps as a set of imprints, diagnosed.
//!
//! Run with `cargo xtask research loop-imprints [DATA] [OUT]`: DATA is a folder with `grasps.csv` and a table for each grasp
//! (`../shared/real/grasp_force_wedge` where it is left out), OUT where sets are written, a folder each: `rigid`, `gel-a`, `gel-b` and
//! `soft`. `gripgen diagnose OUT/rigid` then says the same as the table. Nothing is written where the data are absent.

use crate::{StudyResult, arguments};
use gripgen_cli::load_imprint_set;
use gripgen_identify::{Diagnosis, ImprintDiagnosis, diagnose_imprints};
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// A table as names and rows of cells.
struct Cells {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Cells {
    fn read(path: &Path) -> Result<Self, Box<dyn Error>> {
        let text = std::fs::read_to_string(path).map_err(|e| format!("{}: {e}", path.display()))?;
        let cells = |line: &str| line.split(',').map(|c| c.trim().to_string()).collect::<Vec<_>>();
        let mut lines = text.lines();
        let names = cells(lines.next().unwrap_or_default());
        Ok(Self { names, rows: lines.map(cells).collect() })
    }

    fn column(&self, name: &str) -> Result<Vec<&str>, Box<dyn Error>> {
        let at = self.names.iter().position(|n| n == name).ok_or_else(|| format!("no column {name}"))?;
        Ok(self.rows.iter().map(|row| row.get(at).map_or("", String::as_str)).collect())
    }
}

pub fn run() -> StudyResult {
    let mut words = arguments();
    let data = PathBuf::from(words.next().unwrap_or_else(|| "../shared/real/grasp_force_wedge".into()));
    let out = PathBuf::from(words.next().unwrap_or_else(|| "target/imprints".into()));
    if !data.join("grasps.csv").is_file() {
        println!("{} is absent: nothing to do", data.display());
        return Ok(());
    }
    let grasps = Cells::read(&data.join("grasps.csv"))?;
    let column = |name| grasps.column(name);
    let (names, days, objects, gels, rigid) =
        (column("grasp")?, column("day")?, column("object")?, column("gel")?, column("rigid")?);
    let sets: [(&str, &dyn Fn(usize) -> bool); 4] = [
        ("rigid", &|g| rigid[g] == "1"),
        ("gel-a", &|g| rigid[g] == "1" && gels[g] == "a"),
        ("gel-b", &|g| rigid[g] == "1" && gels[g] == "b"),
        ("soft", &|g| rigid[g] == "0"),
    ];
    for (set, belongs) in sets {
        let mut table =
            String::from("imprint_id,grip_force_n,volume_mm3,grasp,part,time_s,width_mm,session,gel\n");
        for g in (0..names.len()).filter(|&g| belongs(g)) {
            let rows = Cells::read(&data.join(format!("{}.csv", names[g])))?;
            let of = |name| rows.column(name);
            let (frame, time, force) = (of("frame")?, of("time_s")?, of("force_n")?);
            let (volume, width) = (of("volume_mm3")?, of("width_mm")?);
            for i in 0..frame.len() {
                let _ = writeln!(
                    table,
                    "{}-{},{},{},{},{},{},{},{},{}",
                    names[g],
                    frame[i],
                    force[i],
                    volume[i],
                    names[g],
                    objects[g],
                    time[i],
                    width[i],
                    days[g],
                    gels[g]
                );
            }
        }
        let folder = out.join(set);
        std::fs::create_dir_all(&folder)?;
        std::fs::write(folder.join("imprints.csv"), table)?;
        let loaded = load_imprint_set(&folder, None)?;
        print!("{}", page(set, &diagnose_imprints(&loaded.data)));
    }
    Ok(())
}

fn page(set: &str, found: &ImprintDiagnosis) -> String {
    let d = &found.diagnosis;
    let mut text = format!("## {set}\n\n{}\n\n{}\n\n", answer(d), errors(d));
    text += "| grasp | rows | peak mm³ | before | after | beyond 10 N: rows | before | after |\n";
    text += "|---|---|---|---|---|---|---|---|\n";
    for grasp in &found.grasps {
        let peak = grasp.constant.peak_mm3;
        let share = |rmse: f64| format!("{rmse:.1} ({:.1} %)", 100.0 * rmse / peak);
        let beyond = match grasp.beyond {
            Some((n, before, after)) => format!("{n} | {} | {}", share(before), share(after)),
            None => "| | ".into(),
        };
        let (before, after) = grasp.rmse_mm3;
        let _ = writeln!(
            text,
            "| {} | {} | {peak:.0} | {} | {} | {beyond} |",
            grasp.constant.name,
            grasp.constant.rows,
            share(before),
            share(after)
        );
    }
    text += "\n| effects | held-out error mm³ | values | |\n|---|---|---|---|\n";
    for e in &found.evidence {
        let _ = writeln!(text, "| {} | {:.2} | {} | {} |", e.name, e.rmse_mm3, e.values, e.fate);
    }
    text + "\n"
}

fn answer(d: &Diagnosis) -> String {
    let mut text = format!("verdict: {:?}", d.verdict);
    for e in &d.effects {
        let _ = write!(text, "; {} (weight {:.2}", e.name, e.weight);
        for (name, p) in e.parameters.iter().filter(|(_, p)| p.low90 < p.high90) {
            let _ = write!(text, ", {name} = {:.3} {} ({:.3} to {:.3})", p.value, p.unit, p.low90, p.high90);
        }
        for rival in &e.indistinguishable_from {
            let _ = write!(text, ", = {} {:.2}", rival.name, rival.weight);
        }
        text += ")";
    }
    for u in &d.unknown {
        let _ = write!(text, "; unknown: {} ({:.2})", u.covariate, u.strength);
    }
    for hint in &d.hints {
        let _ = write!(text, "; hint: {}: {}", hint.name, hint.reason);
    }
    text
}

fn errors(d: &Diagnosis) -> String {
    let Some(error) = &d.error else { return d.notes.join("; ") };
    let one = |e: &gripgen_identify::HeldOutError| {
        format!("{:.2} ({:.2} to {:.2})", e.rmse_mm3.unwrap_or(f64::NAN), e.low90, e.high90)
    };
    let mut text = format!("held-out {}: {} -> {} mm³", error.heldout, one(&error.before), one(&error.after));
    for (name, pair) in [("beyond 10 N", error.by.levels), ("other sessions", error.by.sessions)] {
        if let Some(pair) = pair {
            let _ = write!(text, "; {name}: {} -> {}", one(&pair.before), one(&pair.after));
        }
    }
    text + &d.noise_floor_mm3.map_or(String::new(), |f| format!("; floor {f:.2}"))
}
