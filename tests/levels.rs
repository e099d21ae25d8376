//! Levels of randomness: which samples share a draw.

use crate::common::project;
use gripgen::Project;
use gripgen::twin::draw::Drawn;
use std::collections::{BTreeMap, BTreeSet};

const CONFIG: &str = "asset:configs/quickstart.toml";

fn word(project: &Project, index: u64, key: &str) -> String {
    project.sweep.drawn(index)[key].to_string()
}

fn number(project: &Project, index: u64, key: &str) -> f64 {
    match &project.sweep.drawn(index)[key] {
        Drawn::Number(x) => *x,
        Drawn::Text(word) => panic!("{key} is {word}"),
    }
}

/// Values of a key, by the group that a sample is of.
fn by_group(project: &Project, column: &str, key: &str) -> BTreeMap<String, BTreeSet<u64>> {
    let mut of: BTreeMap<String, BTreeSet<u64>> = BTreeMap::new();
    for index in 0..project.sweep.samples {
        let values = of.entry(word(project, index, column)).or_default();
        values.insert(number(project, index, key).to_bits());
    }
    of
}

const GROUPS: &str = "groups={rigs=4, gels_per_rig=2, sessions_per_gel=3}";

#[test]
fn samples_of_one_group_share_its_draw_and_no_other_does() {
    let project = project(
        CONFIG,
        &[
            "design=random",
            "samples=600",
            GROUPS,
            "vary.robot.lag_s={log_normal=[0.1, 0.5], per=\"rig\", limits=[0.01, 0.5]}",
            "vary.parts.*.kinetic_ratio={normal=[0.84, 0.09], per=\"gel\", limits=[0.55, 1.0]}",
            "vary.temperature_c={normal=[23, 2], per=\"session\"}",
            "vary.parts.*.mu={log_normal=[0.2, 0.4], per=\"part\"}",
            "vary.grip_offset_mm={normal=[0, 1]}",
        ],
    );
    for (column, key, groups) in [
        ("rig_id", "robot.lag_s", 4),
        ("gel_id", "parts.*.kinetic_ratio", 8),
        ("session", "temperature_c", 24),
        ("part", "parts.*.mu", project.sweep.drawn_parts().len()),
    ] {
        let of = by_group(&project, column, key);
        assert_eq!(of.len(), groups, "{column}");
        assert!(of.values().all(|values| values.len() == 1), "{key} differs within a {column}");
        let all: BTreeSet<u64> = of.values().flatten().copied().collect();
        assert!(
            all.len() + 1 >= groups,
            "{key} is the same for several of {column}: {} of {groups}",
            all.len()
        );
    }
    let offsets: BTreeSet<u64> = (0..600).map(|i| number(&project, i, "grip_offset_mm").to_bits()).collect();
    assert_eq!(offsets.len(), 600);
    // A session is one of one gel, a gel one of one rig.
    for index in 0..600 {
        let (rig, gel, session) = (
            word(&project, index, "rig_id"),
            word(&project, index, "gel_id"),
            word(&project, index, "session"),
        );
        assert!(gel.starts_with(&rig) && session.starts_with(&gel), "{rig} {gel} {session}");
    }
}

/// More samples leave those that are there as they are: a group does not depend on how many there are.
#[test]
fn groups_do_not_depend_on_the_number_of_samples() {
    let with = |samples: &str| {
        project(
            CONFIG,
            &[
                "design=random",
                samples,
                GROUPS,
                "vary.parts.*.mu={log_normal=[0.2, 0.4], per=\"part\", spread={gel=0.1, sample=0.05}}",
            ],
        )
    };
    let (few, many) = (with("samples=20"), with("samples=2000"));
    for index in 0..20 {
        assert_eq!(few.sweep.drawn(index), many.sweep.drawn(index));
    }
}

/// Further levels multiply what is drawn on a logarithm: the mean of a gel's samples keeps its factor, and repetitions differ by that
/// of the sample alone.
#[test]
fn spreads_of_levels_are_nested() {
    let project = project(
        CONFIG,
        &[
            "design=random",
            "samples=4000",
            "repetitions=2",
            "vary.part=[\"gear\"]",
            "groups={rigs=1, gels_per_rig=5}",
            "vary.parts.*.mu={log_normal=[0.2, 0.4], per=\"part\", spread={gel=0.2, sample=0.05}}",
        ],
    );
    let mu = |index: u64| number(&project, index, "parts.*.mu").ln();
    let mut within = Vec::new();
    let mut of_gel: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    for group in 0..2000 {
        within.push(mu(2 * group) - mu(2 * group + 1));
        of_gel.entry(word(&project, 2 * group, "gel_id")).or_default().push(mu(2 * group));
    }
    let deviation = |x: &[f64]| {
        let mean = x.iter().sum::<f64>() / x.len() as f64;
        (x.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / x.len() as f64).sqrt()
    };
    assert!((deviation(&within) / (0.05 * 2f64.sqrt()) - 1.0).abs() < 0.06, "{}", deviation(&within));
    assert_eq!(of_gel.len(), 5);
    for values in of_gel.values() {
        assert!((deviation(values) / 0.05 - 1.0).abs() < 0.12, "{}", deviation(values));
    }
    let means: Vec<f64> = of_gel.values().map(|x| x.iter().sum::<f64>() / x.len() as f64).collect();
    assert!(deviation(&means) > 0.05, "gels differ: {means:?}");
    let twins = [0, 1].map(|index| project.twin_of(index).unwrap().parts["gear"].mu);
    assert!((twins[0].ln() - mu(0)).abs() < 1e-12 && twins[0] != twins[1], "the twin has what was drawn");
}

/// The ids are columns of what is recorded.
#[test]
fn group_ids_are_columns() {
    let project = project(CONFIG, &["design=random", "samples=4", GROUPS]);
    let keys: Vec<&str> = project.sweep.drawn_keys().collect();
    assert!(["rig_id", "gel_id", "session"].iter().all(|id| keys.contains(id)), "{keys:?}");
    let scenario = gripgen::drawn_scenario(&project, 3);
    assert_eq!(scenario.covariates.gel_id, word(&project, 3, "gel_id"));
    assert_eq!(scenario.covariates.extra["rig_id"].to_string(), word(&project, 3, "rig_id"));
}

/// A run that is read back draws the same.
#[test]
fn levels_survive_the_resolved_configuration() {
    let sets = [
        "design=random",
        "samples=30",
        GROUPS,
        "vary.parts.*.mu={log_normal=[0.2, 0.4], per=\"part\", spread={gel=0.12, session=0.08}, limits=[0.05, 0.6]}",
        "vary.grip_pose={one_of=[0, 0], per=\"gel\"}",
    ];
    let first = project(CONFIG, &sets);
    let file = first.sweep.to_file();
    let again = gripgen::twin::Sweep::new(
        &toml::from_str(&toml::to_string(&file).unwrap()).unwrap(),
        &gripgen::load_twin_document(&gripgen::Location::parse("asset:configs/twin.toml"), &[]).unwrap(),
    )
    .unwrap();
    assert_eq!(first.sweep.vary, again.vary);
    for index in 0..30 {
        assert_eq!(first.sweep.drawn(index), again.drawn(index));
    }
}
