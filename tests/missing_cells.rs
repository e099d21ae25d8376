//! Missing cells of tables: the names of a diagnosis are those of the complete table.

use crate::diagnose::diagnose;
use gripgen::twin::random::{Purpose, Stream, normal_quantile};
use gripgen_measured::load_pulls;

/// A lab of 60 pulls of labels alone, 90 s apart: `bo` grips with 15 % less friction than `ann`, the temperature takes 1.5 % a kelvin, a zero drifts by
/// 1.2 N/h. `cell` says what somebody wrote into the cell of a row.
fn lab(pulls: usize, acts: &str, cell: &dyn Fn(usize, &str, String) -> String) -> tempfile::TempDir {
    let mut random = Stream::new(11, 0, Purpose::Draw);
    let mut normal = move || normal_quantile(random.uniform().clamp(1e-6, 1.0 - 1e-6));
    let forces_n = [5.0, 45.0, 12.0, 80.0, 8.0, 30.0, 60.0, 20.0];
    let mut text = format!("pull_id,part,grip_force_n,max_pull_force_n,time_s,{acts}\n");
    for i in 0..pulls {
        let (force_n, time_s) = (forces_n[(i * 5 + i / 8) % 8], 90.0 * i as f64);
        let bo = (i * 7 / 3) % 2 == 1;
        let celsius = 24.0 + 5.0 * libm::sin(i as f64 / 6.0) + normal();
        let (factor, zero_n, own) = match acts {
            "operator" => (if bo { 0.85 } else { 1.0 }, 0.0, if bo { "bo" } else { "ann" }.to_string()),
            "temperature_c" => (libm::exp(-0.015 * (celsius - 23.0)), 0.0, format!("{celsius:.2}")),
            _ => (1.0, 1.2 * time_s / 3600.0, String::new()),
        };
        let label_n = 0.4 * force_n * factor * (1.0 + 0.02 * normal()) + zero_n + 0.08 * normal();
        let [time, own] = [cell(i, "time_s", time_s.to_string()), cell(i, acts, own)];
        text += &format!("p{i},gear,{force_n},{label_n:.3},{time},{own}\n");
    }
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("pulls.csv"), text).unwrap();
    folder
}

/// What is named: effects, and columns without one.
fn named(folder: &tempfile::TempDir) -> Vec<String> {
    let loaded = load_pulls(folder.path()).unwrap();
    let found = diagnose(&loaded.pulls, &[]).diagnosis;
    let effects = found.effects.iter().map(|effect| effect.name.clone());
    effects.chain(found.unknown.iter().map(|unknown| unknown.covariate.clone())).collect()
}

/// Gaps in a column, evenly over the rows.
fn gaps(
    pulls: usize,
    missing: usize,
    word: &'static str,
    column: &'static str,
) -> impl Fn(usize, &str, String) -> String {
    move |i, name, value| {
        let is_gap = missing > 0 && name == column && (i * missing) % pulls < missing && i > 0;
        if is_gap { word.into() } else { value }
    }
}

#[test]
#[ignore = "slow: nine campaigns"]
fn a_diagnosis_of_a_table_with_gaps_has_the_names_of_the_complete_one() {
    for (pulls, acts, column, expected, cases) in [
        (100, "lab", "time_s", None, [(2, ""), (10, "NA")]),
        (150, "temperature_c", "temperature_c", Some("temperature"), [(15, ""), (2, "n/a")]),
        (60, "operator", "operator", Some("operator"), [(5, ""), (2, "n/a")]),
    ] {
        let complete = named(&lab(pulls, acts, &|_, _, value| value));
        assert!(
            expected.is_none_or(|name| complete == [name]) && !complete.is_empty(),
            "{acts}: {complete:?}"
        );
        for (missing, word) in cases {
            let found = named(&lab(pulls, acts, &gaps(pulls, missing, word, column)));
            assert_eq!(found, complete, "{acts}, {missing} of {pulls} missing");
        }
    }
}
