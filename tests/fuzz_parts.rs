//! Random parts in random grips, sound and damaged: no panic, no NaN, no contact that is not there, and two mechanics that agree.
//!
//! What is there is found by other code: triangles are drawn into a map of heights in front of each pad, and the depth at which the map
//! has the imprint's volume gives area and middle of the contact.

use crate::common::{overrides, project_in};
use gripgen::tactile::SimdLevel;
use gripgen::twin::parts::benchmark::{FAMILIES, variant};
use gripgen::twin::random::{Purpose, Stream};
use gripgen::twin::{ImprintSummary, Jaw, Outcome, Pulled, TriMesh, write_binary_stl};
use gripgen::{Location, Project, generate};
use nalgebra::Point3;
use std::fmt::Write as _;

/// Grips of each part.
const GRIPS: u64 = 20;
/// Side of a cell of the map.
const CELL_M: f64 = 0.1e-3;

/// What is done to a mesh.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Damage {
    None,
    Holes,
    Turned,
    Shaken,
    Squashed,
    Doubled,
    Collapsed,
}

const DAMAGES: [Damage; 8] = [
    Damage::None,
    Damage::None,
    Damage::Holes,
    Damage::Turned,
    Damage::Shaken,
    Damage::Squashed,
    Damage::Doubled,
    Damage::Collapsed,
];

fn damaged(mesh: &TriMesh, damage: Damage, stream: &mut Stream) -> TriMesh {
    let mut vertices = mesh.vertices_m().to_vec();
    let mut triangles = mesh.triangles().to_vec();
    match damage {
        Damage::None => {}
        Damage::Holes => triangles.retain(|_| stream.uniform() > 0.05),
        Damage::Turned => triangles.iter_mut().filter(|_| stream.uniform() < 0.2).for_each(|t| t.swap(0, 1)),
        Damage::Shaken => {
            vertices
                .iter_mut()
                .for_each(|v| *v += nalgebra::Vector3::from_fn(|_, _| 0.1e-3 * stream.normal()));
        }
        Damage::Squashed => {
            let scale = [0, 1, 2].map(|_| 0.05 + 2.0 * stream.uniform());
            vertices.iter_mut().for_each(|v| (0..3).for_each(|i| v[i] *= scale[i]));
        }
        Damage::Doubled => triangles.extend_from_within(..),
        Damage::Collapsed => {
            let n = vertices.len();
            for _ in 0..n / 20 {
                let (a, b) = ((n as f64 * stream.uniform()) as usize, (n as f64 * stream.uniform()) as usize);
                vertices[a] = vertices[b];
            }
        }
    }
    TriMesh::new(vertices, triangles).unwrap()
}

/// A part in random grips, and the sweep over them.
fn project(
    folder: &std::path::Path,
    mesh: &TriMesh,
    stream: &mut Stream,
    sets: &[(&str, &str)],
) -> Result<Project, String> {
    std::fs::write(folder.join("part.stl"), write_binary_stl(mesh, "part", 1e-3)).unwrap();
    let mut twin = String::from(
        "[robot]\nmodel = \"carriage\"\n[wrist]\nnoise_n = 0.0\n[parts.part]\nmesh = \"part.stl\"\nmu = 0.15\nimprint_mm3_per_n = 1.5\n",
    );
    let (low, high) = mesh.bounds_m();
    for grip in 0..GRIPS {
        let origin = [0, 1, 2].map(|i| 1e3 * (low[i] + (high[i] - low[i]) * (0.2 + 0.6 * stream.uniform())));
        // Half of them along axes of the part, where flats and rims are.
        let turn = |stream: &mut Stream| {
            let angle = 360.0 * stream.uniform() - 180.0;
            if grip % 2 == 0 { (angle / 90.0).round() * 90.0 } else { angle }
        };
        let angles = [turn(stream), turn(stream), turn(stream)];
        writeln!(twin, "[[parts.part.grips]]\norigin_mm = {origin:?}\norientation_deg = {angles:?}").unwrap();
    }
    std::fs::write(folder.join("twin.toml"), twin).unwrap();
    let poses: Vec<u64> = (0..GRIPS).collect();
    let sweep = format!(
        "twin = \"twin.toml\"\nsamples = {GRIPS}\nseed = {}\nmechanics = \"reduced\"\ntrace = \"none\"\ndesign = \"random\"\n[vary]\n\
         grip_pose = {poses:?}\ngrip_force_n = {{ uniform = [5, 80] }}\ngrip_offset_mm = {{ uniform = [-5, 5] }}\n\
         grip_angle_deg = {{ uniform = [-180, 180] }}\n",
        stream.bits() >> 40
    );
    std::fs::write(folder.join("sweep.toml"), sweep).unwrap();
    Project::load(&Location::Disk(folder.join("sweep.toml")), &overrides(sets)).map_err(|e| e.to_string())
}

/// Heights of the part in front of a pad, in metres from the gel: infinite where there is nothing.
struct Map {
    cell_m: f64,
    columns: usize,
    heights_m: Vec<f64>,
}

impl Map {
    fn of(
        mesh: &TriMesh,
        gel_from_mesh: &gripgen::twin::frames::Pose,
        size_m: [f64; 2],
        cell_m: f64,
    ) -> Self {
        let [columns, rows] = size_m.map(|s| (s / cell_m) as usize);
        let mut heights_m = vec![f64::INFINITY; columns * rows];
        let moved: Vec<Point3<f64>> = mesh.vertices_m().iter().map(|v| gel_from_mesh * v).collect();
        let column = |x: f64| (x + size_m[0] / 2.0) / cell_m - 0.5;
        let row = |y: f64| (y + size_m[1] / 2.0) / cell_m - 0.5;
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|v| {
                let p = moved[v as usize];
                [column(p.x), row(p.y), p.z]
            });
            let twice = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
            if twice == 0.0 {
                continue;
            }
            let range = |axis: usize, most: usize| {
                let low = a[axis].min(b[axis]).min(c[axis]).ceil().max(0.0) as usize;
                let high = a[axis].max(b[axis]).max(c[axis]).floor();
                low..if high < 0.0 { 0 } else { (high as usize + 1).min(most) }
            };
            for y in range(1, rows) {
                for x in range(0, columns) {
                    let (px, py) = (x as f64, y as f64);
                    let u = ((px - a[0]) * (c[1] - a[1]) - (py - a[1]) * (c[0] - a[0])) / twice;
                    let v = ((b[0] - a[0]) * (py - a[1]) - (b[1] - a[1]) * (px - a[0])) / twice;
                    if u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 {
                        let z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2]);
                        let slot = &mut heights_m[y * columns + x];
                        *slot = slot.min(z);
                    }
                }
            }
        }
        Self { cell_m, columns, heights_m }
    }

    fn lowest_m(&self) -> f64 {
        self.heights_m.iter().fold(f64::INFINITY, |a, &b| a.min(b))
    }

    /// Area and middle of what lies within the depth at which so much volume is pressed in.
    fn pressed(&self, volume_m3: f64) -> (f64, [f64; 2]) {
        let volume = |depth: f64| {
            let sum: f64 = self.heights_m.iter().map(|&z| (depth - z).max(0.0)).sum();
            sum * self.cell_m * self.cell_m
        };
        // A needle of a damaged mesh may stand out by millimetres from what carries the load.
        let (mut low, mut high) = (self.lowest_m(), self.lowest_m() + 20e-3);
        for _ in 0..50 {
            let middle = (low + high) / 2.0;
            if volume(middle) < volume_m3 { low = middle } else { high = middle }
        }
        let (mut area, mut weight, mut sum) = (0.0, 0.0, [0.0; 2]);
        for (i, &z) in self.heights_m.iter().enumerate().filter(|(_, z)| **z < high) {
            let at = [i % self.columns, i / self.columns].map(|k| (k as f64 + 0.5) * self.cell_m);
            area += self.cell_m * self.cell_m;
            weight += high - z;
            sum = [0, 1].map(|k| sum[k] + (high - z) * at[k]);
        }
        let half = [self.columns, self.heights_m.len() / self.columns].map(|n| n as f64 * self.cell_m / 2.0);
        (area, [0, 1].map(|k| sum[k] / weight - half[k]))
    }
}

/// What the fuzzing saw.
#[derive(Debug, Default)]
struct Seen {
    parts: usize,
    refused: usize,
    grips: usize,
    held: usize,
    missed: usize,
    failed: usize,
    /// Jaws that were compared with a finer map too.
    looked_again: usize,
    /// The worst of what was compared with the map: first touch in mm, area as a share, middle in mm.
    worst: [f64; 3],
    wrong: Vec<String>,
}

fn check(seen: &mut Seen, project: &Project, mesh: &TriMesh, index: u64, pulled: &Pulled) {
    let scenario = project.sweep.scenario(index, &project.twin).0;
    let part = &project.twin.parts["part"];
    assert!(pulled.label.max_pull_force_n.is_finite() && pulled.label.max_pull_force_n >= 0.0);
    assert!(pulled.label.slip_time_s.is_finite() && pulled.mu_effective.is_finite());
    for (jaw, imprint) in pulled.imprint.iter() {
        let ImprintSummary { press_depth_m, patch } = imprint;
        let cells_are_numbers = patch.cells.iter().all(|c| {
            [c.x_m, c.y_m, c.area_m2, c.force_n].iter().all(|x| x.is_finite())
                && c.force_n >= 0.0
                && c.area_m2 > 0.0
        });
        assert!(cells_are_numbers && press_depth_m.is_finite(), "{imprint:?}");
        assert!((patch.normal_force_n() / scenario.grip_force_n - 1.0).abs() < 1e-6, "{imprint:?}");
        let gel_from_mesh = pulled.grasp.gel_from_part[jaw] * part.grips[scenario.grip_pose];
        let gel = &project.twin.gel[jaw];
        let compared = |cell_m: f64| {
            let map = Map::of(mesh, &gel_from_mesh, [gel.width_m, gel.height_m], cell_m);
            let (area_m2, middle_m) = map.pressed(part.imprint_m3_per_n * scenario.grip_force_n);
            let (x, y) = patch.centre_m();
            let found = [
                map.lowest_m().abs() * 1e3,
                (patch.area_m2() - area_m2).abs() / area_m2.max(2e-6),
                libm::hypot(x - middle_m[0], y - middle_m[1]) * 1e3,
            ];
            (found, area_m2)
        };
        let is_wrong = |found: [f64; 3]| {
            found[0] > 0.3 || found[1] > 0.25 || found[2] > 0.5 || !found.iter().all(|x| x.is_finite())
        };
        let (mut found, mut area_m2) = compared(CELL_M);
        if is_wrong(found) {
            // Tips, edges and slivers between two points of the map are met by a finer one.
            seen.looked_again += 1;
            (found, area_m2) = compared(CELL_M / 16.0);
        }
        seen.worst = [0, 1, 2].map(|i| seen.worst[i].max(found[i]));
        if is_wrong(found) {
            let own_mm2 = patch.area_m2() * 1e6;
            seen.wrong
                .push(format!("sample {index}, {jaw} jaw: {found:?}, {own_mm2} for {} mm2", area_m2 * 1e6));
        }
    }
}

/// Nothing lies in front of a pad that a jaw missed.
fn check_missed(seen: &mut Seen, project: &Project, mesh: &TriMesh, index: u64) {
    let scenario = project.sweep.scenario(index, &project.twin).0;
    let c = &scenario.covariates;
    let world_from_mesh = gripgen::twin::Part::world_from_part(c.grip_angle_rad, c.grip_offset_m)
        * project.twin.parts["part"].grips[scenario.grip_pose];
    let maps = Jaw::BOTH.map(|jaw| {
        let gel = &project.twin.gel[jaw];
        let gel_from_mesh = gripgen::twin::frames::world_from_gel(jaw, 0.0).inverse() * world_from_mesh;
        Map::of(mesh, &gel_from_mesh, [gel.width_m, gel.height_m], CELL_M).lowest_m()
    });
    // From the middle of the open jaws; what lies beyond it belongs to the other jaw.
    if maps.iter().all(|lowest| *lowest < -0.05e-3) {
        seen.wrong.push(format!("sample {index} missed: {maps:?}"));
    }
}

fn fuzz(seed: u64, parts: std::ops::Range<u64>) -> Seen {
    let mut seen = Seen::default();
    for number in parts {
        let mut stream = Stream::new(seed, number, Purpose::Draw);
        let family = number as usize % FAMILIES.len();
        let damage = DAMAGES[(number as usize / FAMILIES.len() + number as usize) % DAMAGES.len()];
        let mesh = damaged(&variant(seed + 1000, family, number), damage, &mut stream);
        let folder = tempfile::tempdir().unwrap();
        let images = if number % 10 == 0 { "raw" } else { "none" };
        seen.parts += 1;
        let project = match project(folder.path(), &mesh, &mut stream, &[("images", images)]) {
            Ok(project) => project,
            Err(reason) => {
                assert!(damage != Damage::None, "{}: {reason}", FAMILIES[family].name);
                seen.refused += 1;
                continue;
            }
        };
        let first = seen.wrong.len();
        for index in 0..GRIPS {
            seen.grips += 1;
            match generate(&project, index, SimdLevel::best()).outcome {
                Outcome::Pulled(pulled) => {
                    seen.held += 1;
                    check(&mut seen, &project, &mesh, index, &pulled);
                }
                Outcome::NoContact { .. } => {
                    seen.missed += 1;
                    check_missed(&mut seen, &project, &mesh, index);
                }
                Outcome::Failed { reason } => {
                    seen.failed += 1;
                    assert!(!reason.is_empty() && !reason.contains("NaN"), "{reason}");
                }
            }
        }
        let name = FAMILIES[family].name;
        seen.wrong[first..].iter_mut().for_each(|w| *w = format!("{name} {number}, {damage:?}: {w}"));
    }
    seen
}

#[test]
fn random_parts_in_random_grips_have_the_contact_that_is_there() {
    let seen = fuzz(1, 0..8);
    println!("{seen:?}");
    assert!(seen.held >= 60, "{seen:?}");
    assert!(seen.wrong.is_empty(), "{:#?}", seen.wrong);
}

/// Ten thousand grips, or `GRIPGEN_FUZZ_PARTS` times twenty; `GRIPGEN_FUZZ_PART=140` is one of those parts alone.
#[test]
#[ignore = "slow: minutes"]
fn ten_thousand_random_grips_have_the_contact_that_is_there() {
    let number = |name: &str| std::env::var(name).ok().and_then(|n| n.parse::<u64>().ok());
    let parts = match number("GRIPGEN_FUZZ_PART") {
        Some(one) => one..one + 1,
        None => 0..number("GRIPGEN_FUZZ_PARTS").unwrap_or(500),
    };
    let seen = fuzz(2, parts);
    println!("{seen:#?}");
    assert!(seen.wrong.is_empty(), "{:#?}", seen.wrong);
}

/// Ratios of slip forces, Rapier over reduced, of grips that hold.
fn ratios(seed: u64, parts: u64, wanted: usize) -> Vec<(f64, String)> {
    let mut found = Vec::new();
    for number in 0..parts {
        let mut stream = Stream::new(seed, number, Purpose::Draw);
        let family = number as usize % FAMILIES.len();
        let mesh = variant(seed + 1000, family, number);
        let folder = tempfile::tempdir().unwrap();
        let reduced = project(folder.path(), &mesh, &mut stream, &[("images", "none")]).unwrap();
        let rapier = project_in(folder.path(), &[("mechanics", "rapier"), ("images", "none")]);
        let mut of_part = 0;
        for index in 0..GRIPS {
            if of_part == wanted {
                break;
            }
            let Outcome::Pulled(b) = generate(&reduced, index, SimdLevel::best()).outcome else { continue };
            let name = format!("{} {number}, sample {index}", FAMILIES[family].name);
            let (ratio, why) = match generate(&rapier, index, SimdLevel::best()).outcome {
                Outcome::Pulled(a) => (a.label.max_pull_force_n / b.label.max_pull_force_n, String::new()),
                Outcome::NoContact { .. } => (0.0, ": Rapier misses the part".to_string()),
                Outcome::Failed { reason } => (0.0, format!(": {reason}")),
            };
            let name = name + &why;
            of_part += 1;
            found.push((ratio, name));
        }
    }
    found
}

/// Any grip that holds, in corners and on edges too.
#[test]
#[ignore = "slow: a minute"]
fn both_mechanics_agree_on_random_grips() {
    let parts = std::env::var("GRIPGEN_FUZZ_PARTS").ok().and_then(|n| n.parse().ok()).unwrap_or(120);
    let found = ratios(3, parts, 5);
    let apart: Vec<_> = found.iter().filter(|(ratio, _)| (ratio - 1.0).abs() > 0.01).collect();
    println!("{} of {} apart by more than 1 %: {apart:#?}", apart.len(), found.len());
    assert!(apart.len() * 50 <= found.len(), "{} of {}", apart.len(), found.len());
}
