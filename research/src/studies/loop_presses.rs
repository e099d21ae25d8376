//! Closes the loop on real presses: the plain colour table of Taxim's GelSight on one raw rest frame, diagnosed.
//!
//! `cargo xtask research loop-presses [FOLDER]`: FOLDER is `gelsight` of the shared Taxim data
//! (`../shared/real/taxim/gelsight` where it is left out). Writes `research/loop/presses.md` and its plots.

use crate::{StudyResult, arguments};
use gripgen::tactile::presses::{CalibrateOptions, PressScene, PressSet, calibrate_presses, frame_mse};
use gripgen::tactile::{Sensor, SensorFiles};
use gripgen::twin::effects::{GripPoint, find};
use gripgen::twin::{Covariates, Jaw, OpticsState};
use gripgen_cli::{Diagnosed, PressDiagnosisInput, PressGeometry, diagnose_presses, load_presses};
use gripgen_identify::{Diagnosis, HeldOutError, NamedEffect};
use gripgen_report::Plot;
use std::error::Error;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

mod svg;

pub fn run() -> StudyResult {
    let folder = PathBuf::from(arguments().next().unwrap_or_else(|| "../shared/real/taxim/gelsight".into()));
    let set = load_presses(&folder.join("dataPack.npz"), PressGeometry::default())?;
    let table = std::fs::read(folder.join("polycalib.npz"))?;
    let gel_map = std::fs::read(folder.join("gelmap.npy"))?;
    let out = Path::new("research/loop");
    std::fs::create_dir_all(out)?;
    let mut text = String::from(HEAD);
    for (name, title, map) in [
        ("flat", "Plain table, flat gel", None),
        ("dome", "Plain table, measured shape of the gel", Some(gel_map.as_slice())),
    ] {
        let sensor = plain(&set, &table, map)?;
        let all = diagnosed(&set, &sensor);
        chapter(&mut text, name, title, &all, out)?;
        stated_and_measured(&mut text, &set, &sensor)?;
    }
    let calibrated = calibrate_presses(&part(&set, |i| i % 2 == 0), &CalibrateOptions::default())?.sensor;
    let control = diagnosed(&part(&set, |i| i % 2 == 1), &calibrated);
    writeln!(
        text,
        "\n## Control: a calibrated sensor\n\nCalibrated on 18 of the presses (`gripgen calibrate presses`), diagnosed on the other 18: verdict `{}`; error {} grey levels^2, noise {:.2}.\n",
        serde_json::to_value(control.diagnosis.verdict)?.as_str().unwrap_or_default(),
        error(&control.diagnosis, |e| &e.before),
        control.diagnosis.noise_floor_mse.unwrap_or(f64::NAN)
    )?;
    evidence(&mut text, &control, 1)?;
    std::fs::write(out.join("presses.md"), text)?;
    Ok(())
}

const HEAD: &str = "# The loop on real presses\n\nMade by `cargo xtask research loop-presses`; data: 36 presses of a 4 mm ball into a GelSight (Si & Yuan 2022, \
MIT licence), not part of this repository. Start: Taxim's colour table (`polycalib.npz`) with one raw frame without contact, no shadow table, kernels of Wucherer et al. 2023. \
Errors are mean squares over whole frames and channels, in grey levels squared, on presses that the fit had not seen (folds), with 90 % intervals over presses. The table was made by its authors from \
all presses, so the start knows the presses; what is added here does not.\n";

fn plain(set: &PressSet, table: &[u8], gel_map: Option<&[u8]>) -> Result<Sensor, Box<dyn Error>> {
    Ok(Sensor::from_files(&SensorFiles {
        table: Default::default(),
        sensor: table,
        metres_per_px: Some(set.metres_per_px),
        background: set.rest.as_ref(),
        gel_map,
        shadow_table: None,
    })?)
}

fn part(set: &PressSet, wanted: impl Fn(usize) -> bool) -> PressSet {
    let presses = set.presses.iter().enumerate().filter(|(i, _)| wanted(*i)).map(|(_, p)| p.clone());
    PressSet { presses: presses.collect(), ..set.clone() }
}

fn diagnosed(set: &PressSet, sensor: &Sensor) -> Diagnosed {
    let input = PressDiagnosisInput {
        set,
        sensor,
        time_s: None,
        covariates: Vec::new(),
        marked: true,
        sha256: String::new(),
        kept_effects: Vec::new(),
    };
    diagnose_presses(&input, &mut |share, what| eprintln!("{:3.0} % {what}", 100.0 * share))
}

fn error(d: &Diagnosis, of: fn(&gripgen_identify::ErrorReport) -> &HeldOutError) -> String {
    d.error.as_ref().map_or("-".into(), |e| {
        let e = of(e);
        format!("{:.2} ({:.2} to {:.2})", e.mse.unwrap_or(f64::NAN), e.low90, e.high90)
    })
}

fn chapter(
    text: &mut String,
    name: &str,
    title: &str,
    found: &Diagnosed,
    out: &Path,
) -> Result<(), Box<dyn Error>> {
    let d = &found.diagnosis;
    writeln!(text, "\n## {title}\n\n{}\n", found.diagnosis.plain.as_deref().unwrap_or_default())?;
    writeln!(text, "| | whole frame, held-out presses |\n|---|---|")?;
    writeln!(text, "| before | {} |", error(d, |e| &e.before))?;
    writeln!(text, "| after | {} |", error(d, |e| &e.after))?;
    writeln!(text, "| noise of the camera | {:.2} |\n", d.noise_floor_mse.unwrap_or(f64::NAN))?;
    zones(text, &found.report.groups[0].plots[0])?;
    for effect in &d.effects {
        let rivals: Vec<&str> = effect.indistinguishable_from.iter().map(|r| r.name.as_str()).collect();
        let tied = if rivals.is_empty() {
            String::new()
        } else {
            format!(", not told apart from {}", rivals.join(", "))
        };
        writeln!(text, "- `{}` (weight {:.2}{tied}): {}", effect.name, effect.weight, values(effect))?;
    }
    for unknown in &d.unknown {
        writeln!(text, "- unknown: `{}` (share {:.2})", unknown.covariate, unknown.strength)?;
    }
    writeln!(text)?;
    evidence(text, found, 2)?;
    for (suffix, plot) in
        [("zones", &found.report.groups[0].plots[0]), ("order", &found.report.groups[1].plots[0])]
    {
        let file = format!("presses-{name}-{suffix}.svg");
        std::fs::write(out.join(&file), svg::plot(plot))?;
        writeln!(text, "![{}]({file})", plot.title)?;
    }
    Ok(())
}

fn values(effect: &NamedEffect) -> String {
    let one = |(name, p): (&String, &gripgen_identify::ParameterEstimate)| {
        format!("{name} {:.3} ({:.3} to {:.3})", p.value, p.low90, p.high90)
    };
    effect.parameters.iter().map(one).collect::<Vec<_>>().join(", ")
}

fn zones(text: &mut String, plot: &Plot) -> Result<(), Box<dyn Error>> {
    writeln!(
        text,
        "| mean squared residual | {} |\n|---|{}",
        plot.x_words.join(" | "),
        "---|".repeat(plot.x_words.len())
    )?;
    for series in &plot.series {
        let cells: Vec<String> = series.points.iter().map(|p| format!("{:.1}", p.1)).collect();
        writeln!(text, "| {} | {} |", series.name, cells.join(" | "))?;
    }
    writeln!(text)?;
    Ok(())
}

/// The candidates of the first rounds.
fn evidence(text: &mut String, found: &Diagnosed, rounds: usize) -> Result<(), Box<dyn Error>> {
    writeln!(
        text,
        "| round. candidate | gain, share of the zones' mean error | standard error | what became of it |\n|---|---|---|---|"
    )?;
    for row in
        found.report.evidence.iter().filter(|r| (1..=rounds).any(|k| r.name.starts_with(&format!("{k}."))))
    {
        writeln!(
            text,
            "| {} | {:.3} | {:.3} | {} |",
            row.name, row.heldout_gain, row.standard_error, row.fate
        )?;
    }
    writeln!(text)?;
    Ok(())
}

/// Diagnosed on two thirds of the presses, measured on the last third, which it never saw.
fn stated_and_measured(text: &mut String, set: &PressSet, sensor: &Sensor) -> Result<(), Box<dyn Error>> {
    let found = diagnosed(&part(set, |i| i % 3 != 2), sensor);
    let unseen = part(set, |i| i % 3 == 2);
    let scene = PressScene::new(sensor, set.ball_m);
    let n = unseen.presses.len();
    let mean = |effects: &[NamedEffect]| {
        (0..n).map(|i| frame_mse(&unseen, i, &scene, &optics(effects, 3 * i + 2), None)).sum::<f64>()
            / n as f64
    };
    let names: Vec<&str> = found.diagnosis.effects.iter().map(|e| e.name.as_str()).collect();
    let stated = found.diagnosis.error.as_ref().and_then(|e| e.after.mse).unwrap_or(f64::NAN);
    let measured = mean(&found.diagnosis.effects);
    writeln!(
        text,
        "\nFrom 24 presses alone ({}): stated {stated:.2}; measured on the 12 others {measured:.2}, where the plain table has {:.2}. Stated over measured: {:.2}.",
        names.join(", "),
        mean(&[]),
        stated / measured
    )?;
    Ok(())
}

fn optics(effects: &[NamedEffect], index: usize) -> OpticsState {
    let covariates =
        Covariates { pull_index: index as u64, time_s: 60.0 * index as f64, ..Default::default() };
    let at = GripPoint {
        jaw: Jaw::Left,
        grip_force_n: 0.0,
        contact_area_m2: 0.0,
        pull_rate_n_per_s: 0.0,
        covariates: &covariates,
        grip: (0, 0),
    };
    let mut state = OpticsState::default();
    for effect in effects {
        let Some(spec) = find(&effect.name) else { continue };
        let values: Vec<f64> = spec
            .parameters
            .iter()
            .map(|p| effect.parameters.get(p.name).map_or(p.neutral, |e| e.value))
            .collect();
        if let Some(hook) = spec.optics {
            hook(&values, &mut state, &at);
        }
    }
    state
}
