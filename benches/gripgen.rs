//! How long things take, on one core. Names are paths: `cargo bench -- tactile` runs the tactile ones.

#![expect(clippy::unwrap_used, reason = "a benchmark that cannot go on panics")]

mod guard;
mod scenes;

use criterion::{BenchmarkId, Criterion, Throughput};
use gripgen::physics::{
    Arm, FrictionCell, Grip, GripSetup, Held, JawFriction, Mount, Until, grip, pull_staircase,
};
use gripgen::record::{EncodeOptions, VIEW_RATE_HZ, encode};
use gripgen::tactile::{ClusteredMesh, Renderer, SimdLevel};
use gripgen::twin::config::{ImageStorage, TraceStorage};
use gripgen::twin::frames::Pose;
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{Jaw, PerJaw, Staircase};
use gripgen::{Location, Project, generate, press_only};
use std::hint::black_box;
use std::process::ExitCode;

const PARTS: [&str; 4] = ["ball_bearing", "long_shaft", "gear", "roller_bearing"];

/// One sample of a part: 40 N, first grip, 30 degrees.
fn project(part: &str, mechanics: &str, images: &str) -> Project {
    let sets = [
        ("vary.part", format!("[\"{part}\"]")),
        ("vary.grip_force_n", "[40]".into()),
        ("vary.grip_pose", "[0]".into()),
        ("vary.grip_angle_deg", "[30]".into()),
        ("mechanics", mechanics.into()),
        ("images", images.into()),
    ]
    .map(|(key, value): (&str, String)| (key.to_string(), value));
    Project::load(&Location::parse("asset:configs/quickstart.toml"), &sets).unwrap()
}

/// `physics/sample/<mechanics>/<part>`: grip, imprint and pull, no images. `physics/pull/<mechanics>/<arm>`: grip and
/// pull of the shaft at 40 N with 64 cells per jaw, noise and trace.
fn physics(c: &mut Criterion) {
    let mut group = c.benchmark_group("physics");
    group.sample_size(20).throughput(Throughput::Elements(1));
    for mechanics in ["rapier", "reduced"] {
        for part in PARTS {
            let project = project(part, mechanics, "none");
            group.bench_function(BenchmarkId::new(format!("sample/{mechanics}"), part), |b| {
                b.iter(|| black_box(generate(&project, 0, SimdLevel::best())));
            });
        }
        let project = project("long_shaft", mechanics, "none");
        let pull = project.sweep.pull();
        let arm = project.twin.arm.as_ref().map(|arm| project.library.arm(arm).unwrap());
        let arms = [("carriage", Arm::Carriage), ("ur5e", Arm::Multibody(arm.as_deref().unwrap()))];
        let staircase = Staircase::constant(pull.increment_n, pull.step_s, pull.max_time_s);
        let cell = FrictionCell { limit_n: 0.168 * 40.0 / 64.0, area_m2: 1e-6 };
        let jaw = JawFriction {
            cells: vec![cell; 64],
            kinetic_ratio: 1.0,
            kinetic_fall_s: 0.0,
            shear_by_area: 1.0,
        };
        let friction = PerJaw { left: jaw.clone(), right: jaw };
        for (name, arm) in arms {
            group.bench_function(format!("pull/{mechanics}/{name}"), |b| {
                b.iter(|| {
                    let noise = Stream::new(1, 2, Purpose::ForceNoise);
                    let mut session = held(&project, arm).pull(&friction, noise);
                    black_box(pull_staircase(&mut session, &staircase, &pull, Until::Stopped).unwrap())
                });
            });
        }
    }
}

/// The part of sample 0, gripped.
fn held(project: &Project, arm: Arm<'_>) -> Held {
    let twin = &project.twin;
    let scenario = project.sweep.scenario(0, twin).0;
    let part = &twin.parts[&scenario.part];
    let shape = project.library.shape(part, scenario.grip_pose).unwrap();
    let setup = GripSetup {
        mechanics: project.sweep.mechanics,
        arm,
        robot: twin.robot,
        gripper: twin.gripper,
        wrist: twin.wrist,
        gel: &twin.gel,
        shape: &shape,
        world_from_part: Pose::identity(),
        grip_force_n: PerJaw { left: 40.0, right: 40.0 },
        direction: [0.0, 0.0, 1.0],
        mount: Mount::Fixed,
    };
    match grip(&setup).unwrap() {
        Grip::Held(held) => *held,
        Grip::NoContact => panic!("the shaft is between the jaws"),
    }
}

/// `tactile/<stage>/<vector unit>/<part>`: one image of 320 x 240 pixels.
fn tactile(c: &mut Criterion) {
    let mut group = c.benchmark_group("tactile");
    group.sample_size(30).throughput(Throughput::Elements(1));
    for part in PARTS {
        let project = project(part, "rapier", "png");
        let scenario = project.sweep.scenario(0, &project.twin).0;
        let press =
            press_only(&project.twin, &project.library, &scenario, project.sweep.mechanics).unwrap().unwrap();
        let imprint = &press.imprint[Jaw::Left];
        for level in SimdLevel::available() {
            let renderer = Renderer { sensor: &press.sensors.left, gel: &project.twin.gel.left, level };
            let name = format!("{level:?}").to_lowercase();
            group.bench_function(BenchmarkId::new(format!("surface/{name}"), part), |b| {
                b.iter(|| black_box(renderer.surface(imprint)));
            });
            if level == SimdLevel::best() {
                group.bench_function(BenchmarkId::new(format!("image/{name}"), part), |b| {
                    b.iter(|| black_box(renderer.image(Some(imprint), Some(7))));
                });
            }
        }
        let p = &project.twin.parts[part];
        let mesh = project.library.clustered_mesh(p).unwrap();
        let pose = gripgen::twin::frames::world_from_gel(Jaw::Left, 0.03).inverse() * p.grips[0];
        let renderer =
            Renderer { sensor: &press.sensors.left, gel: &project.twin.gel.left, level: SimdLevel::best() };
        group.bench_function(BenchmarkId::new("press", part), |b| {
            b.iter(|| black_box(renderer.press(&mesh, &pose, p.imprint_m3_per_n, 40.0).unwrap()));
        });
    }
}

/// `tactile/ball/<what>/<vector unit>`: a bumpy ball of 50,000 triangles, from mesh to image; `image/<kind>` is the image of
/// its imprint by the kinds of sensor in `scenes`.
fn ball(c: &mut Criterion) {
    let mut group = c.benchmark_group("tactile/ball");
    group.sample_size(50).throughput(Throughput::Elements(1));
    let project = project("gear", "rapier", "png");
    let sensor = project.library.sensor(&project.twin.optics.left).unwrap();
    let (mesh, at) = (ClusteredMesh::new(&scenes::bumpy_ball()), scenes::gel_from_ball());
    for level in SimdLevel::available() {
        let renderer = Renderer { sensor: &sensor, gel: &project.twin.gel.left, level };
        let press = || renderer.press(&mesh, &at, scenes::IMPRINT_M3_PER_N, scenes::FORCE_N).unwrap();
        let imprint = press();
        let name = format!("{level:?}").to_lowercase();
        group.bench_function(BenchmarkId::new("press", &name), |b| b.iter(|| black_box(press())));
        group.bench_function(BenchmarkId::new("surface", &name), |b| {
            b.iter(|| black_box(renderer.surface(&imprint)));
        });
        group.bench_function(BenchmarkId::new("change", &name), |b| {
            b.iter(|| black_box(renderer.change(&imprint)));
        });
        group.bench_function(BenchmarkId::new("press_and_image", &name), |b| {
            b.iter(|| black_box(renderer.image(Some(&press()), Some(7))));
        });
        for (kind, sensor) in scenes::sensors(&sensor) {
            let gel = scenes::with_modulus(&project.twin.gel.left);
            let renderer = Renderer { sensor: &sensor, gel: &gel, level };
            group.bench_function(BenchmarkId::new(format!("image/{kind}"), &name), |b| {
                b.iter(|| black_box(renderer.image(Some(&imprint), Some(7))));
            });
        }
    }
}

/// `record/encode/<images>`: a sample into the messages of a shard.
fn record(c: &mut Criterion) {
    let mut group = c.benchmark_group("record/encode");
    group.sample_size(30).throughput(Throughput::Elements(1));
    let sample = generate(&project("gear", "rapier", "png"), 0, SimdLevel::best());
    for (name, images) in [("png", ImageStorage::Png), ("raw", ImageStorage::Raw)] {
        let options = EncodeOptions {
            images,
            trace: TraceStorage::Full,
            view_rate_hz: Some(VIEW_RATE_HZ),
            extra_columns: vec![],
            noise_apart_rgb: None,
            background: None,
            first_sample: 0,
            slot_ns: 61_000_000_000,
        };
        group.bench_function(name, |b| b.iter(|| black_box(encode(&sample, &options).unwrap())));
    }
}

fn main() -> ExitCode {
    let run = guard::Run::from_args("gripgen");
    let folder = guard::criterion_folder();
    let mut c = Criterion::default().output_directory(&folder).configure_from_args();
    for group in [physics, tactile, ball, record] {
        group(&mut c);
    }
    c.final_summary();
    let Some(mut run) = run else { return ExitCode::SUCCESS };
    run.take_criterion(&folder);
    run.finish()
}
