use super::*;
use crate::args::{Cli, Command};
use clap::Parser;
use gripgen::twin::{Campaign, PlannedPull, PullKind};
use gripgen_identify::DataSummary;

fn typed(words: &[&str]) -> DiagnoseArgs {
    let all = [&["gripgen", "diagnose"][..], words].concat();
    match Cli::try_parse_from(&all).unwrap().command {
        Command::Diagnose(args) => args,
        other => panic!("{other:?}"),
    }
}

fn answered(verdict: Verdict, notes: &[&str]) -> Diagnosed {
    let diagnosis = Diagnosis {
        verdict,
        notes: notes.iter().map(ToString::to_string).collect(),
        ..Diagnosis::blank(Channel::Pulls, DataSummary { sha256: "ab12".into(), ..Default::default() })
    };
    let (edits, report) = Default::default();
    Diagnosed { diagnosis, edits, report, next: None, sets: vec![], posterior: None }
}

/// Pulls with up to 80 N.
fn plan() -> NextPulls {
    let pull =
        |k: u32| PlannedPull { kind: PullKind::Pull, grip_force_n: f64::from(k), ..PlannedPull::default() };
    let pulls = [25, 80, 60].map(pull).to_vec();
    let campaign = Campaign { label_tolerance_n: 3.0, stop_m: 0.005, feedback: None, pulls };
    NextPulls { campaign, apart: vec![], left: vec![] }
}

/// The command of the first step, without the program.
fn first(args: &DiagnoseArgs, diagnosed: &Diagnosed, next: Option<&Path>) -> (String, String) {
    let (text, command) = next_steps(args, diagnosed, next).remove(0);
    let words = command.split_once(' ').map_or(String::new(), |(_, words)| words.into());
    (text, words)
}

#[test]
fn the_same_diagnosis_again_keeps_what_the_answer_depends_on() {
    let words = [
        "my lab",
        "--also",
        "day2",
        "--twin",
        "mine/twin.toml",
        "--set",
        "parts.a.mu=0.2",
        "--without",
        "wear,nap",
        "--include-suspect",
        "--rig",
        "rig.toml",
        "-v",
    ];
    let (_, command) = first(&typed(&words), &answered(Verdict::Effect, &[]), None);
    assert_eq!(
        command,
        "diagnose 'my lab' --also day2 --include-suspect --twin mine/twin.toml --set parts.a.mu=0.2 --rig rig.toml --without wear,nap -o diagnosed.toml"
    );
    let (_, command) = first(&typed(&["lab"]), &answered(Verdict::Unknown, &[]), None);
    assert_eq!(command, "diagnose lab -o diagnosed.toml");
    let (_, command) =
        first(&typed(&["lab", "--twin", "t.toml"]), &answered(Verdict::Insufficient, &[]), None);
    assert_eq!(command, "campaign -o campaign.toml --twin t.toml");
}

#[test]
fn the_sweep_lies_beside_the_twin_or_is_said_in_words() {
    let folder = tempfile::tempdir().unwrap();
    let twin = folder.path().join("twin.toml");
    let args = typed(&["lab", "--twin", twin.to_str().unwrap(), "-o", "d.toml"]);
    let found = answered(Verdict::Effect, &[]);
    let (text, command) = first(&args, &found, None);
    assert!(command.is_empty() && text.contains("--set twin=d.toml"), "{text}: {command}");
    let sweep = folder.path().join("sweep.toml");
    std::fs::write(&sweep, "").unwrap();
    let (_, command) = first(&args, &found, None);
    let wanted = shell::command_line(&["sweep", sweep.to_str().unwrap(), "--set", "twin=d.toml"]);
    assert_eq!(command, format!("{wanted} -o runs/corrected"));
    let (_, command) = first(&typed(&["lab", "-o", "d.toml"]), &found, None);
    assert_eq!(command, "sweep asset:configs/quickstart.toml --set twin=d.toml -o runs/corrected");
}

/// The loop of an unknown goes on by a command that can be copied: a table over a column of one's own does nothing in a sweep that
/// does not draw the column.
#[test]
fn a_column_of_ones_own_is_drawn_by_the_next_sweep() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("d.toml");
    let table = "[{name=\"table\",covariate=\"humidity_pct\",x=[30,60],factor=[1.0,0.7],physical=false}]";
    let wet = [("effects".to_string(), table.to_string())];
    let baseline = Location::parse(BASELINE_TWIN);
    std::fs::write(&out, crate::edited_twin_toml(&baseline, &wet, &Default::default(), &out).unwrap())
        .unwrap();
    let args = typed(&["lab", "-o", out.to_str().unwrap()]);
    let (_, command) = first(&args, &answered(Verdict::Unknown, &[]), None);
    let range = "--set 'vary.humidity_pct={ uniform = [30, 60] }' -o runs/corrected";
    assert!(
        command.starts_with("sweep asset:configs/quickstart.toml") && command.ends_with(range),
        "{command}"
    );
}

/// A proposed command is one that runs: what no sweep takes is not among its ranges. Parts that nobody pulled are told.
#[test]
fn the_next_sweep_is_one_that_runs() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("d.toml");
    let table = |name: &str| {
        format!("{{name=\"table\",covariate=\"{name}\",x=[30,60],factor=[1.0,0.7],physical=false}}")
    };
    let effects = format!("[{}, {}, {}]", table("mu_drawn"), table("parts.gear.mu"), table("humidity_pct"));
    let baseline = Location::parse(BASELINE_TWIN);
    let text = crate::edited_twin_toml(&baseline, &[("effects".into(), effects)], &Default::default(), &out);
    std::fs::write(&out, text.unwrap()).unwrap();
    let args = typed(&["lab", "-o", out.to_str().unwrap()]);
    let mut found = answered(Verdict::Unknown, &[]);
    let (text, command) = first(&args, &found, None);
    assert!(command.matches("vary.").count() == 1 && command.contains("vary.humidity_pct="), "{command}");
    assert_eq!(text, "Make training data with the corrected twin:");
    let mu = gripgen_identify::ParameterEstimate::new(0.2, (0.18, 0.22), "1");
    found.diagnosis.baseline.insert("parts.gear.mu".into(), mu);
    let (text, _) = first(&args, &found, None);
    assert_eq!(
        text,
        "Make training data with the corrected twin (the pulls were of gear; the other parts keep the mu that they had):"
    );
    found.diagnosis.baseline.clear();
    let mu = gripgen_identify::ParameterEstimate::new(0.2, (0.18, 0.22), "1");
    found.diagnosis.baseline.insert("parts.bracket.mu".into(), mu);
    let (text, _) = first(&args, &found, None);
    assert!(text.ends_with("(the pulls were of bracket, which this sweep does not draw):"), "{text}");
}

#[test]
fn pulls_of_no_rig_are_a_list_and_no_other_campaign_is_offered() {
    let mut few = answered(Verdict::Insufficient, &["3 pulls are too few"]);
    few.next = Some(plan());
    let folder = tempfile::tempdir().unwrap();
    let args = typed(&[folder.path().to_str().unwrap(), "-o", "d.toml"]);
    let steps = next_steps(&args, &few, Some(Path::new("next.toml")));
    assert_eq!(steps.len(), 1, "{steps:?}");
    let (text, command) = &steps[0];
    assert!(
        command.is_empty() && text.contains("next.toml lists (up to 80 N a jaw; --rig"),
        "{text}: {command}"
    );
}

#[test]
fn forces_in_another_unit_are_no_reason_for_a_campaign() {
    let mut asked = answered(Verdict::Insufficient, &[]);
    asked.diagnosis.other_unit = true;
    let (text, command) = first(&typed(&["lab"]), &asked, None);
    assert!(command.is_empty() && text.contains("in newtons"), "{text}: {command}");
}

/// A plan of an earlier diagnosis is replaced only with `--force`, and goes where there are no pulls to make.
#[test]
fn an_earlier_plan_is_replaced_or_goes_with_force() {
    let folder = tempfile::tempdir().unwrap();
    let (out, next) = (folder.path().join("d.toml"), folder.path().join("next.toml"));
    let args = typed(&["lab", "-o", out.to_str().unwrap(), "-q"]);
    let write = |force: bool, plan: Option<NextPulls>| {
        let mut found = answered(Verdict::Effect, &[]);
        found.next = plan;
        write_next(&args, &Outputs::new(force), &mut found).map_err(|e| e.message())
    };
    assert_eq!(write(false, Some(plan())), Ok(Some(next.clone())));
    let text = std::fs::read_to_string(&next).unwrap();
    assert!(text.contains("# Measurements: SHA-256 ab12\n"), "{text}");
    assert!(write(false, Some(plan())).is_err());
    assert_eq!((write(false, None), next.is_file()), (Ok(None), true));
    assert_eq!((write(true, Some(plan())), next.is_file()), (Ok(Some(next.clone())), true));
    assert_eq!((write(true, None), next.is_file()), (Ok(None), false));
}
