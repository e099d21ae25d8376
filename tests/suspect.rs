//! Labels against their own traces, through the whole pipeline.

use crate::common::{self, jobs, run, slow, write_project};
use gripgen::Project;
use gripgen::twin::effects::{EffectSpec, LIBRARY};
use gripgen::twin::label::check::{Expected, LabelEvidence, Verdict, check_label};
use gripgen::twin::label::forces::LabelBranch;
use gripgen::twin::{MeasuredPulls, Pulled};
use gripgen_measured::{Suspects, load_pulls, load_pulls_with};
use gripgen_measured::{open_dataset, read_judged_pulls, write_pull_folder};
use std::path::Path;

/// Pulls of the gear by the reduced mechanics, with these effects; no images.
fn project(effects: &str, samples: usize, vary: &str) -> Project {
    let folder = tempfile::tempdir().unwrap();
    let twin = format!(
        "[parts.gear]\nmesh = \"asset:parts/gear/part.stl\"\nmu = 0.2\nscatter = 0.05\nimprint_mm3_per_n = 1.5\n\
         [[parts.gear.grips]]\norientation_deg = [0.0, 0.0, 90.0]\n{effects}"
    );
    let sweep = format!(
        "twin = \"twin.toml\"\nsamples = {samples}\nseed = 11\nimages = \"none\"\nmechanics = \"reduced\"\n\
         [vary]\ngrip_force_n = {{ uniform = [15, 60] }}\ndwell_s = [1, 30]\ntime_s = {{ uniform = [0, 7200] }}\n\
         pull_index = [0, 50, 300]\n{vary}"
    );
    write_project(folder.path(), &twin, &sweep)
}

const MANY: &str =
    "pull.increment_n = [0.5, 1, 2]\nparts.gear.kinetic_ratio = [1.0, 0.8]\nrobot.lag_s = [0.02, 0.05]\n";

fn pulled(project: &Project, samples: usize) -> Vec<Pulled> {
    (0..samples).filter_map(|i| common::pulled(project, i as u64)).map(|pulled| *pulled).collect()
}

/// 400 clean pulls, judged with what the twin knows and again as if somebody had measured them.
#[test]
fn clean_simulated_pulls_are_not_suspect() {
    let pulls = pulled(&project("", 400, MANY), 400);
    assert_eq!(pulls.len(), 400);
    let simulated: Vec<&String> = pulls.iter().filter_map(|p| p.suspect.as_ref()).collect();
    assert!(simulated.len() <= 2, "{} of 400: {simulated:#?}", simulated.len());
    let measured: Vec<String> = pulls.iter().filter(|p| !p.label.censored).filter_map(as_measured).collect();
    assert!(measured.len() <= 2, "{} of 400: {measured:#?}", measured.len());
}

/// What a pull is suspect for where nothing is known of its rig.
fn as_measured(p: &Pulled) -> Option<String> {
    let of_trace = LabelEvidence::of_trace(p.label.max_pull_force_n, 3.0, 5e-3, Some(&p.trace));
    let judgement = check_label(&LabelEvidence { every_reading: true, ..of_trace }, &Expected::default());
    assert_ne!(judgement.verdict, Verdict::NoEvidence);
    judgement.reason()
}

/// An effect, a tenth of its range away from doing nothing.
fn typical(spec: &EffectSpec) -> String {
    let values = spec.parameters.iter().map(|p| {
        let (low, high) = p.bounds;
        let value = match p.name {
            "limit_n" => 15.0,
            "at_pull_index" => 20.0,
            "tau_s" if spec.id == "sensor_lowpass" => 0.05,
            _ if high > p.neutral => p.neutral + 0.1 * (high - p.neutral),
            _ => p.neutral + 0.1 * (low - p.neutral),
        };
        format!("{} = {value:?}\n", p.name)
    });
    format!("[[effects]]\nname = \"{}\"\n{}", spec.id, values.collect::<String>())
}

/// What the library's effects do to a trace is predicted, and no reason.
#[test]
fn no_effect_makes_its_own_pulls_suspect() {
    let each = if slow() { 100 } else { 10 };
    let mut wrong = Vec::new();
    for spec in LIBRARY.iter().filter(|spec| spec.optics.is_none()) {
        for feedback in ["measured", "independent"] {
            let robot =
                format!("{}[robot]\nmodel = \"carriage\"\nfeedback = \"{feedback}\"\n", typical(spec));
            let pulls = pulled(&project(&robot, each, MANY), each);
            let suspect: Vec<&String> = pulls.iter().filter_map(|p| p.suspect.as_ref()).collect();
            if suspect.len() as f64 > 0.02 * pulls.len() as f64 {
                wrong.push(format!(
                    "{} ({feedback}): {} of {}: {}",
                    spec.id,
                    suspect.len(),
                    pulls.len(),
                    suspect[0]
                ));
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// A slow loop makes labels wrong. The twin predicts it; nobody who only has the pull does.
#[test]
fn a_slow_loop_is_no_reason_in_a_simulation_and_one_in_a_measurement() {
    let pulls = pulled(&project("", 16, "robot.lag_s = [0.5]\n"), 16);
    assert!(pulls.iter().all(|p| p.suspect.is_none() && p.lag_exceeds_tolerance));
    // Labels far below the peak say so; those of a quick loop are not.
    let early = |p: &Pulled| {
        let branch = p.forces.branch(p.label.max_pull_force_n, p.label.slip_time_s, 3.0);
        branch == Some(LabelBranch::Early)
    };
    let quick = pulled(&project("", 16, "robot.lag_s = [0.02]\n"), 16);
    assert!(pulls.iter().all(early) && !quick.iter().any(early));
    let found = pulls.iter().filter(|p| !p.label.censored && as_measured(p).is_some()).count();
    assert!(found >= 14, "{found} of 16");
}

/// A table of pulls with traces.
fn table(folder: &Path, change: impl Fn(usize, &mut MeasuredPulls)) -> MeasuredPulls {
    let run_at = tempfile::tempdir().unwrap();
    run(&project("", 12, "grip_angle_deg = [0]\n"), run_at.path(), jobs(2));
    let mut pulls = load_pulls(run_at.path()).unwrap().pulls;
    assert_eq!(pulls.pulls.len(), 12, "a clean run loses none");
    for i in 0..12 {
        change(i, &mut pulls);
    }
    write_pull_folder(folder, &pulls).unwrap();
    pulls
}

#[test]
fn labels_that_contradict_their_traces_are_left_out_of_a_table() {
    let changes: [fn(f64) -> f64; 2] = [|label_n| 0.9 * label_n, |label_n| label_n + 1.2];
    for change in changes {
        let folder = tempfile::tempdir().unwrap();
        let written = table(folder.path(), |i, pulls| {
            let label_n = &mut pulls.pulls[i].max_pull_force_n;
            *label_n = if i == 0 { *label_n } else { change(*label_n) };
        });
        let loaded = load_pulls(folder.path()).unwrap();
        assert!(loaded.pulls.pulls.len() <= 2, "{} of 12 are left", loaded.pulls.pulls.len());
        assert_eq!(loaded.pulls.pulls[0].id, written.pulls[0].id);
        assert!(loaded.notes[0].contains("the label rule gives"), "{:?}", loaded.notes);
        let all = load_pulls_with(&[folder.path()], Suspects::Include).unwrap();
        assert_eq!(all.pulls.pulls.len(), 12);
        let dataset = open_dataset(folder.path()).unwrap();
        let statuses = dataset.table().words("status").unwrap();
        assert!(statuses.iter().filter(|s| *s == "suspect").count() >= 10, "{statuses:?}");
        assert!(dataset.table().words("status_reason").unwrap()[11].contains(" N "));
        // A table may say that its traces are none of its labels.
        let campaign = folder.path().join("campaign.toml");
        let text = std::fs::read_to_string(&campaign).unwrap();
        std::fs::write(&campaign, format!("{text}label_evidence = \"none\"\n")).unwrap();
        assert_eq!(load_pulls(folder.path()).unwrap().pulls.pulls.len(), 12);
    }
}

/// One sensor that is off in all pulls is for a diagnosis to find; one pull that is off is not.
#[test]
fn a_zero_that_all_pulls_have_is_the_rig() {
    let add = |i: usize, pulls: &mut MeasuredPulls| {
        let pull = &mut pulls.pulls[i];
        pull.max_pull_force_n += 2.0;
        let trace = pull.trace.as_mut().unwrap();
        trace.measured_force_n.iter_mut().for_each(|n| *n += 2.0);
        // The reading without a load, a second of it.
        for k in 1..=50 {
            trace.time_s.insert(0, -0.02 * f64::from(k));
            trace.desired_force_n.insert(0, 0.0);
            trace.measured_force_n.insert(0, 2.0 + if k % 2 == 0 { 0.1 } else { -0.1 });
            trace.displacement_m.insert(0, 0.0);
        }
    };
    let kept = |which: &dyn Fn(usize) -> bool, suspects| {
        let folder = tempfile::tempdir().unwrap();
        table(folder.path(), |i, pulls| {
            if which(i) {
                add(i, pulls);
            }
        });
        load_pulls_with(&[folder.path()], suspects).map_or(0, |loaded| loaded.pulls.pulls.len())
    };
    assert_eq!(kept(&|_| true, Suspects::LeaveOut), 0);
    assert_eq!(kept(&|_| true, Suspects::Screen), 12);
    assert_eq!(kept(&|i| i == 3, Suspects::Screen), 11);
}

#[test]
fn a_table_may_say_how_its_pulls_stand() {
    let folder = tempfile::tempdir().unwrap();
    let text = "pull_id,part,grip_force_n,max_pull_force_n,status,status_reason\n\
                a,gear,20,8.1,,\nb,gear,20,8.2,slipped,\nc,gear,20,,failed,part lost\nd,gear,20,0,no_contact,\n\
                e,gear,20,7.0,censored,\nf,gear,20,3.0,suspect,a hand was there\n";
    std::fs::write(folder.path().join("pulls.csv"), text).unwrap();
    let loaded = load_pulls(folder.path()).unwrap();
    assert_eq!(loaded.pulls.pulls.iter().map(|p| p.id.as_str()).collect::<Vec<_>>(), ["a", "b"]);
    assert!(loaded.pulls.extra.is_empty(), "they are no covariates");
    assert_eq!(loaded.notes.len(), 4, "{:?}", loaded.notes);
    assert!(loaded.notes[3].contains("a hand was there"));
    let all = load_pulls_with(&[folder.path()], Suspects::Include).unwrap();
    assert_eq!(all.pulls.pulls.len(), 3);
    assert_eq!(read_judged_pulls(folder.path()).unwrap().pulls.pulls.len(), 6);
    let put = |text: String| std::fs::write(folder.path().join("pulls.csv"), text).unwrap();
    put(text.replace("no_contact", "lost"));
    let error = load_pulls(folder.path()).unwrap_err().to_string();
    assert!(error.contains("it must be slipped, censored"), "{error}");
    // A pull that slipped has a label: one without is left out, and counted.
    put(text.replace("c,gear,20,,failed", "c,gear,20,,slipped"));
    let loaded = load_pulls(folder.path()).unwrap();
    assert_eq!(loaded.pulls.pulls.len(), 2);
    let said = "max_pull_force_n: 1 cell is missing, these pulls are left out";
    assert!(loaded.notes.iter().any(|note| note == said), "{:?}", loaded.notes);
}
