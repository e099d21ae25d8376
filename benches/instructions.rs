//! Instructions of the hot kernels: the part of the guard that no other program on the machine disturbs.
//!
//! `cargo bench --bench instructions` runs itself under `perf stat` or, where that cannot count, under callgrind of valgrind;
//! where neither can it says so and passes. A kernel runs once in one process and four times in another, and a third of the
//! difference is its count: loading and warming up are in both.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;

use gripgen::tactile::{Renderer, SimdLevel};
use gripgen::twin::frames::world_from_gel;
use gripgen::twin::{Covariates, Jaw, MeasuredPull, MeasuredPulls};
use gripgen::{Location, Project, generate, press_only};
use gripgen_cli::compare_pulls;
use guard::baseline::Unit;
use std::hint::black_box;
use std::process::{Command, ExitCode};

/// Set in the child processes: kernel and runs.
const CHILD: &str = "GRIPGEN_INSTRUCTIONS_BENCH";
/// Runs beside the first.
const RUNS: u64 = 3;
/// Does it so often.
type Kernel = fn(u64);
const KERNELS: [(&str, Kernel); 3] =
    [("image", image), ("reduced_pull", reduced_pull), ("expected_label", expected_label)];

/// Counts the instructions of this program with the given task.
type Tool = fn(&str) -> Result<u64, String>;

fn main() -> ExitCode {
    if let Ok(task) = std::env::var(CHILD) {
        let (name, runs) = task.split_once(' ').unwrap();
        let (_, kernel) = KERNELS.iter().find(|(n, _)| *n == name).unwrap();
        kernel(runs.parse().unwrap());
        return ExitCode::SUCCESS;
    }
    let Some(mut run) = guard::Run::from_args("instructions") else { return ExitCode::SUCCESS };
    let mut counts_here = false;
    for (tool_name, tool) in [("perf", perf as Tool), ("callgrind", callgrind)] {
        let prefix = format!("instructions/{tool_name}");
        // Vector units, and so the instructions, differ under another tool: it has names of its own.
        let all = KERNELS.iter().map(|(kernel, _)| (kernel, format!("{prefix}/{kernel}")));
        let names: Vec<_> = all.filter(|(_, name)| run.wants(name)).collect();
        if names.is_empty() {
            continue;
        }
        if counts_here {
            run.skip(&prefix, "another tool counts here");
            continue;
        }
        for (kernel, name) in names {
            let count = |runs: u64| tool(&format!("{kernel} {runs}"));
            match count(1).and_then(|once| Ok((once, count(1 + RUNS)?))) {
                Ok((once, more)) => {
                    counts_here = true;
                    let each = more.saturating_sub(once) as f64 / RUNS as f64;
                    println!("{name}: {:.3} M instructions", each * 1e-6);
                    run.measured(&name, Unit::Instructions, vec![each]);
                }
                Err(why) => {
                    run.skip(&prefix, &why);
                    break;
                }
            }
        }
    }
    run.finish()
}

/// Instructions of this program outside the kernel of the system, by the processor's counter.
fn perf(task: &str) -> Result<u64, String> {
    let arguments = ["stat", "-x", ",", "-e", "instructions:u", "--"];
    let text = stderr_of(Command::new("perf").args(arguments), task)?;
    let cell = text.lines().find(|l| l.contains("instructions")).and_then(|l| l.split(',').next());
    let cell = cell.unwrap_or_default();
    cell.parse().map_err(|_| format!("perf stat says `{cell}` and no count"))
}

/// The same, by a simulated processor.
fn callgrind(task: &str) -> Result<u64, String> {
    let arguments = ["--tool=callgrind", "--callgrind-out-file=/dev/null"];
    let text = stderr_of(Command::new("valgrind").args(arguments), task)?;
    let count = text.lines().find_map(|l| l.split_once("Collected :")).map(|(_, count)| count.trim());
    count.and_then(|n| n.parse().ok()).ok_or_else(|| "callgrind printed no count".into())
}

/// What `tool` prints about this program as a child with a task.
fn stderr_of(tool: &mut Command, task: &str) -> Result<String, String> {
    let name = tool.get_program().to_string_lossy().into_owned();
    let this = std::env::current_exe().map_err(|e| e.to_string())?;
    let output =
        tool.arg(this).env(CHILD, task).output().map_err(|e| format!("{name} cannot be run: {e}"))?;
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    if output.status.success() {
        return Ok(text);
    }
    let last = text.lines().rev().find(|l| !l.trim().is_empty()).unwrap_or("nothing");
    Err(format!("{name} ended with {}: {last}", output.status))
}

/// The gear at 40 N, in its first grip.
fn project(images: &str) -> Project {
    let sets = [
        ("vary.part", "[\"gear\"]"),
        ("vary.grip_force_n", "[40]"),
        ("vary.grip_pose", "[0]"),
        ("vary.grip_angle_deg", "[30]"),
        ("mechanics", "reduced"),
        ("images", images),
    ];
    let sets = sets.map(|(key, value)| (key.to_string(), value.to_string()));
    Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap()
}

/// From the mesh to one image: raster, indent, deform, shade, noise.
fn image(runs: u64) {
    let project = project("png");
    let scenario = project.sweep.scenario(0, &project.twin).0;
    let part = &project.twin.parts["gear"];
    let press =
        press_only(&project.twin, &project.library, &scenario, project.sweep.mechanics).unwrap().unwrap();
    let mesh = project.library.clustered_mesh(part).unwrap();
    let pose = world_from_gel(Jaw::Left, 0.03).inverse() * part.grips[0];
    let (sensor, gel) = (&press.sensors.left, &project.twin.gel.left);
    let renderer = Renderer { sensor, gel, level: SimdLevel::best() };
    for _ in 0..runs {
        let imprint = renderer.press(&mesh, &pose, part.imprint_m3_per_n, 40.0).unwrap();
        black_box(renderer.image(Some(&imprint), Some(7)));
    }
}

/// Grip, imprint and pull of one sample in the reduced mechanics, without images.
fn reduced_pull(runs: u64) {
    let project = project("none");
    for _ in 0..runs {
        black_box(generate(&project, 0, SimdLevel::best()));
    }
}

/// The expected label of one measured pull, as `compare` predicts it.
fn expected_label(runs: u64) {
    let project = project("none");
    let pull = MeasuredPull {
        id: "1".into(),
        part: "gear".into(),
        grip_pose: 0,
        grip_force_n: 40.0,
        increment_n: 1.0,
        start_n: None,
        step_s: 0.104,
        covariates: Covariates::default(),
        max_pull_force_n: 15.0,
        zero_shift_n: 0.0,
        trace: None,
    };
    let measured = MeasuredPulls {
        pulls: vec![pull],
        recorded: vec![],
        extra: vec![],
        label_tolerance_n: 3.0,
        stop_m: 5e-3,
        feedback: None,
        sha256: String::new(),
    };
    for _ in 0..runs {
        black_box(compare_pulls(&measured, &project.twin, &project.library, 1).unwrap());
    }
}
