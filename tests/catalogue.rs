//! The catalogue of effects: what documents say of it, and what it says of labels.

use crate::common::{baseline, library, root, twin_at};
use gripgen::twin::effects::{EffectSpec, Group, LIBRARY, find};
use gripgen_cli::{EffectCurve, effect_curve};
use std::fmt::Write;

/// The table of a group, as docs/model.md has it.
fn table(group: Group) -> String {
    let mut text = String::from("| id | formula | parameters | source |\n|---|---|---|---|\n");
    for spec in LIBRARY.iter().filter(|s| s.group == group) {
        let parameter = |p: &gripgen::twin::effects::ParameterSpec| {
            let unit = if p.unit == "1" { String::new() } else { format!(" {}", p.unit) };
            let reference = if spec.references.contains(&p.name) { ", reference" } else { "" };
            format!("`{}` {}..{}{unit} ({}{reference})", p.name, p.bounds.0, p.bounds.1, p.neutral)
        };
        // Of many of a kind the first and the last.
        let mut parameters: Vec<String> = spec.parameters.iter().map(parameter).collect();
        if parameters.len() > 30 {
            let middle = parameters.len() - 17;
            parameters.splice(15..15 + middle, [format!("{middle} more of this kind")]);
        }
        writeln!(text, "| `{}` | {} | {} | {} |", spec.id, spec.formula, parameters.join("; "), spec.source)
            .unwrap();
    }
    text
}

/// The tables of docs/model.md are those of the specs.
#[test]
fn the_catalogue_in_the_model_is_current() {
    let path = root().join("docs/model.md");
    let text = std::fs::read_to_string(&path).unwrap();
    let mut wanted = text.clone();
    for group in Group::ALL {
        let begin = format!("<!-- effects: {} -->\n", group.title());
        let from =
            wanted.find(&begin).unwrap_or_else(|| panic!("docs/model.md has no {begin}")) + begin.len();
        let to = from + wanted[from..].find("<!-- end -->").unwrap();
        wanted.replace_range(from..to, &table(group));
    }
    if std::env::var_os("GRIPGEN_UPDATE").is_some() {
        std::fs::write(&path, &wanted).unwrap();
        return;
    }
    assert!(text == wanted, "docs/model.md is stale: GRIPGEN_UPDATE=1 cargo test --workspace -- catalogue");
}

fn curve(spec: &'static EffectSpec) -> EffectCurve {
    let twin = twin_at(&baseline());
    effect_curve(spec, &twin, &library(&twin), 2).unwrap()
}

/// What the catalogue draws is the formula, for laws of the coefficient: the label follows it.
#[test]
fn curves_of_the_catalogue_are_the_formulas() {
    let law = |id: &str, of: &dyn Fn(f64) -> f64| {
        let curve = curve(find(id).unwrap());
        for (x, ratio) in curve.x.iter().zip(&curve.ratio) {
            assert!(
                (ratio / of(*x) - 1.0).abs() < 1e-3,
                "{id} at {} {x}: {ratio}, {}",
                curve.covariate,
                of(*x)
            );
        }
        curve.covariate
    };
    assert_eq!(law("load_power_law", &|f| (f / 40.0).powf(-0.15)), "grip_force_n");
    assert_eq!(law("dwell_ageing", &|t| 1.0 + 0.03 * t.ln_1p()), "dwell_s");
    assert_eq!(law("temperature", &|t| (-0.01 * (t - 23.0)).exp()), "temperature_c");
    assert_eq!(law("contamination", &|n| if n >= 150.0 { 0.8 } else { 1.0 }), "pull_index");
    assert_eq!(law("anisotropy", &|a| 1.0 + 0.15 * (2.0 * a.to_radians()).cos()), "grip_angle_deg");
}

/// Every effect has a curve of finite numbers; those of images are 1 everywhere, most others are not.
#[test]
fn every_effect_has_a_curve() {
    let mut felt = 0;
    for spec in LIBRARY {
        let curve = curve(spec);
        assert!(curve.ratio.iter().all(|r| r.is_finite() && *r > 0.0), "{}: {:?}", spec.id, curve.ratio);
        let flat = curve.ratio.iter().all(|r| (r - 1.0).abs() < 1e-9);
        assert!(flat || spec.optics.is_none(), "{}: {:?}", spec.id, curve.ratio);
        felt += usize::from(!flat);
    }
    assert!(felt >= 25, "only {felt} effects are felt");
}
