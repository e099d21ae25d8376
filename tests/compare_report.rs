//! Measured pulls of any folder beside a twin: the paper's panels.

use crate::common::{baseline, jobs, library, project, run, twin_at};
use gripgen::twin::Twin;
use gripgen_cli::compare_pulls;
use gripgen_identify::pull_ratios;
use gripgen_measured::load_pulls;
use gripgen_report::{ComparedPulls, pull_comparison_page};

/// Pulls of the paper's twin, taken as measured, against the twin without its correction: the fit gives back a and b of the
/// paper's table, which the twin carries.
#[test]
fn the_ratio_to_a_plain_twin_is_the_papers_correction() {
    let sets = [
        "vary.part=[\"gear\", \"roller_bearing\"]",
        "vary.grip_force_n=[20, 30, 40, 60, 80]",
        "vary.grip_pose=[0]",
        "vary.grip_angle_deg=[0]",
        "repetitions=6",
        "mechanics=reduced",
        "images=none",
    ];
    let sweep = project("asset:configs/paper.toml", &sets);
    let folder = tempfile::tempdir().unwrap();
    run(&sweep, folder.path(), jobs(2));
    let measured = load_pulls(folder.path()).unwrap().pulls;
    let plain = twin_at(&baseline());
    let found = compare_pulls(&measured, &plain, &library(&plain), 2).unwrap();
    let ratios = pull_ratios(&measured, &found.label_n);
    for (name, a, b_n) in laws(&sweep.twin) {
        let ratio = &ratios[&name];
        let fit = ratio.fit.unwrap();
        let (error_a, error_b) = (fit.covariance[0][0].sqrt(), fit.covariance[1][1].sqrt());
        assert!((fit.a - a).abs() < 4.0 * error_a && error_a < 0.05, "{name}: {fit:?}, a {a}");
        assert!((fit.b_n - b_n).abs() < 4.0 * error_b && error_b < 1.5, "{name}: {fit:?}, b {b_n}");
        assert!(ratio.before_pct > 5.0 && ratio.after_pct.unwrap() < 2.0, "{name}: {ratio:?}");
        assert!(ratio.left_out_pct.unwrap() < 3.0, "{name}: {ratio:?}");
        let counts: Vec<usize> = ratio.measured.iter().map(|level| level.rows.len()).collect();
        assert_eq!(counts, [6; 5], "{name}");
    }
    let shown = ComparedPulls {
        measured: &measured,
        label_n: &found.label_n,
        trace_n: &found.trace_n,
        rmse_n: found.pulls.rmse_n,
        mape_pct: found.pulls.mape_pct,
        bias_n: found.pulls.bias_n,
        coverage90: found.coverage90,
        outside_fit: found.outside_fit,
        traces: found.traces,
    };
    let page = pull_comparison_page("campaign", &shown);
    for part in [
        "Maximum pull force over grip force",
        "The pull nearest to 40 N",
        "Measured over predicted",
        "The correction a + b",
        "gear, 40 N: ",
        "class=\"band c",
    ] {
        assert!(page.contains(part), "{part}");
    }
    assert!(!page.contains("NaN") && !page.contains("<script") && page.len() < 500_000);
    if let Some(file) = std::env::var_os("GRIPGEN_COMPARE_PAGE") {
        std::fs::write(file, page).unwrap();
    }
}

/// Part, a and b of the corrections in a twin.
fn laws(twin: &Twin) -> Vec<(String, f64, f64)> {
    let law = |name: &str| {
        let own = twin.effects.iter().find(|e| e.spec.id == "load_offset" && e.acts_on(name)).unwrap();
        (name.to_string(), own.values[0], own.values[1])
    };
    vec![law("gear"), law("roller_bearing")]
}
