//! The elastic gel in the whole pipeline, and beside the pyramid on real presses.

use crate::common::{project, root};
use gripgen::generate;
use gripgen::tactile::npz::Npz;
use gripgen::tactile::{
    Base, ElasticGel, Grid, Imprint, LINEAR_PRESSURE_SHARE, Plane, PressedGel, SimdLevel, deform, gradient,
    indent, press_elastic,
};
use gripgen::twin::Outcome;

/// Where the modulus changes, so do press, patch and image; force and label do not.
#[test]
fn a_softer_gel_is_pressed_deeper_under_the_same_force() {
    let sample = |mpa: &str| {
        let at = ["vary.grip_pose=[0]", "vary.grip_offset_mm=[0]"];
        let sets = ["vary.part=[\"gear\"]", "vary.grip_force_n=[40]", at[0], at[1]];
        let modulus = format!("gel.left.young_modulus_mpa={mpa}");
        let p = project(
            "asset:configs/quickstart.toml",
            &[&sets[..], &["gel.left.model=elastic", &modulus]].concat(),
        );
        match generate(&p, 0, SimdLevel::best()).outcome {
            Outcome::Pulled(pulled) => *pulled,
            other => panic!("{other:?}"),
        }
    };
    let (soft, hard) = (sample("0.25"), sample("0.5"));
    for jaw in gripgen::twin::Jaw::BOTH {
        let ratio = soft.imprint[jaw].press_depth_m / hard.imprint[jaw].press_depth_m;
        // A flat stamp doubles its press, a ball on a thin layer has d ~ F^(1/2), so 1.4.
        assert!((1.3..=2.01).contains(&ratio), "{ratio}");
        assert!((soft.imprint[jaw].patch.normal_force_n() - 40.0).abs() < 1e-9);
        let images = |p: &gripgen::twin::Pulled| p.images.as_ref().unwrap()[jaw].clone();
        assert!(images(&soft) != images(&hard));
    }
}

/// Press of the left jaw and area of its contact, in mm and mm2, for a part and a grip force.
fn press(part: &str, force_n: f64, sets: &[&str]) -> (f64, f64) {
    let (part, force) = (format!("vary.part=[\"{part}\"]"), format!("vary.grip_force_n=[{force_n}]"));
    let at = [
        "vary.grip_pose=[0]",
        "vary.grip_offset_mm=[0]",
        "vary.grip_angle_deg=[0]",
        "images=none",
        "trace=none",
    ];
    let p = project(
        "asset:configs/quickstart.toml",
        &[&[part.as_str(), &force, "mechanics=reduced", "gripper.max_force_n=80"], &at[..], sets].concat(),
    );
    match generate(&p, 0, SimdLevel::best()).outcome {
        Outcome::Pulled(pulled) => {
            let imprint = &pulled.imprint.left;
            (1e3 * imprint.press_depth_m, 1e6 * imprint.patch.area_m2())
        }
        other => panic!("{part} at {force_n} N: {other:?}"),
    }
}

/// The constants of the shipped gel are those of one material: the modulus of the elastic gel that is pressed as deep as
/// `V = c F` says, and the shear stiffness that this modulus has (assets/gels/README.md).
#[test]
fn the_constants_of_the_shipped_gel_are_those_of_one_material() {
    let mut logs = Vec::new();
    let mut areas_mm2 = Vec::new();
    for part in ["ball_bearing", "long_shaft", "gear", "roller_bearing"] {
        for force_n in [20.0, 40.0] {
            let (wanted_mm, area_mm2) = press(part, force_n, &[]);
            let elastic = |mpa: f64| {
                let modulus = format!("gel.left.young_modulus_mpa={mpa}");
                press(part, force_n, &["gel.left.model=elastic", &modulus])
            };
            // The press is near a power of the modulus.
            let (a, b) = (0.5, 1.0);
            let (at_a, at_b) = (elastic(a).0, elastic(b).0);
            let exponent = (at_b / at_a).ln() / (b / a).ln();
            let mpa: f64 = a * (wanted_mm / at_a).powf(1.0 / exponent);
            let (found_mm, found_mm2) = elastic(mpa);
            println!(
                "{part} {force_n} N: {wanted_mm:.2} mm, {area_mm2:.0} mm2 by c; {mpa:.2} MPa: {found_mm:.2} mm, {found_mm2:.0} mm2, \
                 p / E {:.2}",
                force_n / found_mm2 / mpa
            );
            assert!((found_mm / wanted_mm - 1.0).abs() < 0.1, "{found_mm} for {wanted_mm} mm");
            logs.push(mpa.ln());
            areas_mm2.push(area_mm2);
        }
    }
    let mean = (logs.iter().sum::<f64>() / logs.len() as f64).exp();
    println!("modulus {mean:.2} MPa");
    assert!((mean / SHIPPED_MODULUS_MPA).ln().abs() < 0.05, "{mean} MPa");
    // Sheared as a whole the layer has G A / t, a patch of it is held by what lies around it: more than G A / t with the area
    // of the contact, less than with that of the pad.
    let (g_mpa, thickness_mm) = (SHIPPED_MODULUS_MPA / 3.0, 4.0);
    let stiffness = |area_mm2: f64| g_mpa * area_mm2 / thickness_mm;
    let mean_mm2 = areas_mm2.iter().sum::<f64>() / areas_mm2.len() as f64;
    let (low, high) = (stiffness(mean_mm2), stiffness(28.064 * 21.048));
    println!("shear {low:.1} to {high:.1} N/mm, mean contact {mean_mm2:.0} mm2");
    assert!(low < 20.0 && 20.0 < high, "20 N/mm are shipped, {low} to {high} follow");
}

/// Young's modulus that the shipped imprint constant stands for.
const SHIPPED_MODULUS_MPA: f64 = 0.85;

/// `check` says where an elastic gel is pressed beyond what linear elasticity holds for.
#[test]
fn a_plan_says_the_pressure_over_the_modulus() {
    let share = |sets: &[&str]| {
        let at = [
            "vary.part=[\"long_shaft\"]",
            "vary.grip_force_n=[40]",
            "vary.grip_pose=[0]",
            "vary.grip_offset_mm=[0]",
        ];
        let cheap = ["vary.grip_angle_deg=[0]", "images=none", "trace=none", "mechanics=reduced"];
        let p = project("asset:configs/quickstart.toml", &[&at[..], &cheap, sets].concat());
        gripgen_cli::plan(&p, SimdLevel::best()).unwrap().probes[0].pressure_over_modulus
    };
    assert_eq!(share(&[]), None, "the pyramid has no modulus");
    let of =
        |mpa: &str| share(&["gel.left.model=elastic", &format!("gel.left.young_modulus_mpa={mpa}")]).unwrap();
    let (soft, hard) = (of("0.3"), of("2"));
    assert!(soft > LINEAR_PRESSURE_SHARE && hard < LINEAR_PRESSURE_SHARE, "{soft} {hard}");
    // 40 N on the area that the contact of a gel of 2 MPa has.
    let (_, area_mm2) =
        press("long_shaft", 40.0, &["gel.left.model=elastic", "gel.left.young_modulus_mpa=2"]);
    assert!((hard / (40.0 / area_mm2 / 2.0) - 1.0).abs() < 0.05, "{hard}, {area_mm2} mm2");
}

/// Real presses of a ball of 4 mm at half resolution (320 x 240 of 0.059 mm): change of each channel, centre, radius.
struct MeasuredPress {
    change: [Vec<f64>; 3],
    centre_px: (f64, f64),
    radius_px: f64,
}

const GRID: Grid = Grid { width_px: 320, height_px: 240, metres_per_px: 0.059e-3 };
const BALL_M: f64 = 2.0e-3;

fn presses(every: usize) -> Vec<MeasuredPress> {
    let bytes = std::fs::read(root().join("../shared/real/taxim/gelsight/dataPack.npz")).unwrap();
    let mut npz = Npz::open(&bytes).unwrap();
    let mut array = |key: &str| npz.array(key).unwrap().values;
    let (f0, images, centres, radii) =
        (array("f0"), array("imgs"), array("touch_center"), array("touch_radius"));
    let size = 480 * 640 * 3;
    let change = |i: usize, channel: usize| {
        let value = |x: usize, y: usize| {
            let quad = [(0, 0), (1, 0), (0, 1), (1, 1)];
            let at = |(dx, dy)| ((2 * y + dy) * 640 + 2 * x + dx) * 3 + channel;
            quad.map(|q| images[i * size + at(q)] - f0[at(q)]).iter().sum::<f64>() / 4.0
        };
        (0..240).flat_map(|y| (0..320).map(move |x| (x, y))).map(|(x, y)| value(x, y)).collect()
    };
    (0..radii.len())
        .step_by(every)
        .map(|i| MeasuredPress {
            change: [0, 1, 2].map(|c| change(i, c)),
            centre_px: (centres[2 * i] / 2.0 - 0.25, centres[2 * i + 1] / 2.0 - 0.25),
            radius_px: radii[i] / 2.0,
        })
        .collect()
}

impl MeasuredPress {
    fn distance_px(&self, i: usize) -> f64 {
        (((i % 320) as f64) - self.centre_px.0).hypot(((i / 320) as f64) - self.centre_px.1)
    }

    fn ball(&self) -> Plane {
        let radius = BALL_M / GRID.metres_per_px;
        let height = |i| (radius * radius - self.distance_px(i).powi(2)).sqrt();
        let values =
            (0..GRID.len()).map(|i| height(i) as f32).map(|h| if h.is_nan() { f32::NEG_INFINITY } else { h });
        Plane { width: 320, height: 240, values: values.collect() }
    }

    /// The press whose contact has the annotated radius.
    fn pressed(&self, press: impl Fn(&Plane, f64) -> Imprint) -> Imprint {
        let (ball, mut force, wanted) = (self.ball(), 1.0, self.radius_px * GRID.metres_per_px);
        for _ in 0..6 {
            let area = press(&ball, force).patch.area_m2();
            force *= (wanted / (area / std::f64::consts::PI).sqrt()).powi(3);
        }
        press(&ball, force)
    }

    /// Share of the variance of the change in a ring that a linear function of the slope explains, all channels.
    fn explained(&self, surface: &Plane, from: f64, to: f64) -> f64 {
        let (gx, gy) = gradient(surface);
        let ring: Vec<usize> = (0..GRID.len())
            .filter(|&i| (from..to).contains(&(self.distance_px(i) / self.radius_px)))
            .collect();
        let (mut left, mut all) = (0.0, 0.0);
        for change in &self.change {
            let rows = nalgebra::DMatrix::from_fn(ring.len(), 3, |r, c| {
                [1.0, f64::from(gx.values[ring[r]]), f64::from(gy.values[ring[r]])][c]
            });
            let y = nalgebra::DVector::from_fn(ring.len(), |r, _| change[ring[r]]);
            let fit = (rows.transpose() * &rows).lu().solve(&(rows.transpose() * &y)).unwrap();
            left += (&y - &rows * fit).norm_squared();
            all += y.add_scalar(-y.mean()).norm_squared();
        }
        1.0 - left / all
    }
}

/// What a surface looks like around a contact, over all the presses.
#[derive(Default)]
struct Around {
    press_mm: f64,
    rim_mm: f64,
    /// How far beyond the contact the surface has fallen to a tenth of the press.
    width_mm: f64,
    explained: f64,
    explained_inside: f64,
}

/// The gel around a contact: both models beside each other at the same contact radius, and whose slope the images
/// follow. Prints the table of docs/model.md.
///
/// The presses are far beyond small strains (contact radius 0.93 of the ball's), and the real pad is a dome.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn the_elastic_gel_beside_the_pyramid_on_real_presses() {
    let level = SimdLevel::best();
    let elastic = |ball: &Plane, force_n: f64, thickness_m: f64, poisson_ratio: f64, base| {
        let gel = ElasticGel { thickness_m, young_modulus_pa: 2e5, poisson_ratio, base };
        press_elastic(ball, &GRID, &gel, force_n, level).unwrap()
    };
    let flat = PressedGel { thickness_m: 4e-3, imprint_m3_per_n: 1e-9, stiffens: false };
    type Model<'a> = (&'a str, &'a dyn Fn(&Plane, f64) -> Imprint);
    let models: [Model<'_>; 5] = [
        ("pyramid", &|ball, force_n| indent(ball, &GRID, &flat, force_n).unwrap()),
        ("layer 4 mm, nu 0.5", &|ball, force_n| elastic(ball, force_n, 4e-3, 0.5, Base::Bonded)),
        ("layer 4 mm, nu 0.45", &|ball, force_n| elastic(ball, force_n, 4e-3, 0.45, Base::Bonded)),
        ("layer 8 mm, nu 0.5", &|ball, force_n| elastic(ball, force_n, 8e-3, 0.5, Base::Bonded)),
        ("half-space", &|ball, force_n| elastic(ball, force_n, 4e-3, 0.5, Base::HalfSpace)),
    ];
    let presses = presses(6);
    let mm = GRID.metres_per_px * 1e3;
    let mut mean: [Around; 5] = Default::default();
    let (mut largest, mut average) = (0.0_f64, 0.0);
    for press in &presses {
        let surfaces = models.map(|(_, model)| {
            let imprint = press.pressed(model);
            let surface = match &imprint.elastic {
                Some(field) => field.surface_px.clone(),
                None => deform(&imprint, &[101, 51, 25, 11, 5], 0.4, GRID.metres_per_px, None, level),
            };
            (imprint.press_depth_m * 1e3, surface)
        });
        let ring: Vec<usize> = (0..GRID.len())
            .filter(|&i| (1.05..2.0).contains(&(press.distance_px(i) / press.radius_px)))
            .collect();
        let difference =
            |&i: &usize| f64::from((surfaces[1].1.values[i] - surfaces[0].1.values[i]).abs()) * mm;
        largest = ring.iter().map(difference).fold(largest, f64::max);
        average += ring.iter().map(difference).sum::<f64>() / ring.len() as f64 / presses.len() as f64;
        for ((press_mm, surface), mean) in surfaces.iter().zip(&mut mean) {
            let profile = |r: f64| {
                let near = |i: &usize| (press.distance_px(*i) - r).abs() < 1.0;
                let band: Vec<usize> = (0..GRID.len()).filter(near).collect();
                band.iter().map(|&i| f64::from(surface.values[i]) * mm).sum::<f64>() / band.len() as f64
            };
            let fallen =
                (0..60).map(|r| press.radius_px + f64::from(r)).find(|&r| profile(r) < 0.1 * press_mm);
            let share = 1.0 / presses.len() as f64;
            mean.press_mm += share * press_mm;
            mean.rim_mm += share * profile(press.radius_px);
            mean.width_mm += share * (fallen.unwrap_or(f64::INFINITY) - press.radius_px) * mm;
            mean.explained += share * press.explained(surface, 1.05, 2.0);
            mean.explained_inside += share * press.explained(surface, 0.0, 0.9);
        }
    }
    println!("layer 4 mm against pyramid, 1.05 to 2 radii: mean {average:.3} mm, largest {largest:.3} mm");
    for ((name, _), a) in models.iter().zip(&mean) {
        println!(
            "{name}: press {:.2} mm, rim {:.2} mm, falls to a tenth of the press within {:.2} mm, R2 outside {:.3}, \
             inside {:.3}",
            a.press_mm, a.rim_mm, a.width_mm, a.explained, a.explained_inside
        );
    }
    // The image outside the contact follows the slope of the elastic gel as well as that of the pyramid.
    assert!(mean[1].explained > 0.85 && mean[4].explained > mean[0].explained);
    assert!((mean[1].explained - mean[0].explained).abs() < 0.03);
}

/// One node of Taxim's finite elements: place about the pin and displacement sideways, in metres.
struct Node {
    x_m: f64,
    y_m: f64,
    normal_m: [f64; 2],
    sheared_m: [f64; 2],
}

fn nodes() -> Vec<Node> {
    let read = |name: &str| {
        let path = root().join("../shared/real/taxim/fem").join(name);
        let bytes = std::fs::read(path).unwrap();
        let mut npz = Npz::open(&bytes).unwrap();
        (npz.array("xyz_m").unwrap().values, npz.array("disp_m").unwrap().values)
    };
    let (places, normal) = read("0705_dome_node_dz_0.3.npz");
    let (_, both) = read("0705_dome_node_dxdz_0.3.npz");
    let count = places.len() / 3;
    let deepest = (0..count).max_by(|&a, &b| normal[3 * a + 2].total_cmp(&normal[3 * b + 2])).unwrap();
    (0..count)
        .map(|i| Node {
            x_m: places[3 * i] - places[3 * deepest],
            y_m: places[3 * i + 1] - places[3 * deepest + 1],
            normal_m: [0, 1].map(|c| normal[3 * i + c]),
            sheared_m: [0, 1].map(|c| both[3 * i + c] - normal[3 * i + c]),
        })
        .collect()
}

/// Correlation, and what is left of b after the best multiple of a, relative to b.
fn agreement(a: &[f64], b: &[f64]) -> (f64, f64) {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let dot = |f: &dyn Fn(f64, f64) -> f64| a.iter().zip(b).map(|(&a, &b)| f(a, b)).sum::<f64>();
    let spread = (dot(&|a, _| (a - ma).powi(2)) * dot(&|_, b| (b - mb).powi(2))).sqrt();
    let scale = dot(&|a, b| a * b) / dot(&|a, _| a * a);
    let left = dot(&|a, b| (b - scale * a).powi(2)) / dot(&|_, b| b * b);
    (dot(&|a, b| (a - ma) * (b - mb)) / spread, left.sqrt())
}

/// Finite elements of a dome of gel under a pin of 0.5 mm (Taxim's), against the layer's Green's functions.
///
/// The forces of the two runs are not published: one factor each is fitted. Neither are the constants of the gel:
/// 4 mm, nu = 0.4 and 0.1 mm under the surface fit best. Under the normal load the mesh leaves sideways motion in
/// directions in which there can be none (0.66 of the radial motion), so that node by node little can agree; rings of
/// nodes do.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn markers_move_like_finite_elements() {
    use gripgen::tactile::{MarkerGel, Shear, marker_displacements};
    use gripgen::twin::{ContactPatch, PressureCell};
    let grid = Grid { width_px: 2, height_px: 2, metres_per_px: 1.0 };
    let pin = PressureCell {
        x_m: 0.0,
        y_m: 0.0,
        area_m2: std::f64::consts::PI * 0.25e-3_f64.powi(2),
        force_n: 1.0,
    };
    let patch = ContactPatch { cells: vec![pin], ..Default::default() };
    let gel = MarkerGel::new(4e-3, 2e5, 0.4, 0.1e-3);
    let nodes: Vec<Node> =
        nodes().into_iter().filter(|n| (0.12e-3..8e-3).contains(&n.x_m.hypot(n.y_m))).collect();
    let places: Vec<[f64; 2]> = nodes.iter().map(|n| [n.x_m + 0.5, n.y_m + 0.5]).collect();
    let run = |shear: Shear| marker_displacements(&gel, &patch, &shear, &grid, &places);
    let normal = run(Shear::default());
    let both = run(Shear { force_n: [1.0, 0.0], ..Shear::default() });
    let ours: Vec<f64> = (0..nodes.len()).flat_map(|i| [0, 1].map(|c| both[i][c] - normal[i][c])).collect();
    let theirs: Vec<f64> = nodes.iter().flat_map(|n| n.sheared_m).collect();
    let (shear_correlation, shear_left) = agreement(&ours, &theirs);
    let radial = |n: &Node, u: [f64; 2]| (n.x_m * u[0] + n.y_m * u[1]) / n.x_m.hypot(n.y_m);
    let each: Vec<(f64, f64, f64)> = nodes
        .iter()
        .zip(&normal)
        .map(|(n, &u)| (n.x_m.hypot(n.y_m), radial(n, u), radial(n, n.normal_m)))
        .collect();
    let (ours, theirs): (Vec<f64>, Vec<f64>) = each.iter().map(|&(_, a, b)| (a, b)).unzip();
    let by_node = agreement(&ours, &theirs);
    let edges = [0.12, 0.2, 0.3, 0.5, 0.7, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0];
    let (ours, theirs): (Vec<f64>, Vec<f64>) = edges
        .windows(2)
        .map(|e| {
            let ring: Vec<_> = each.iter().filter(|(r, _, _)| (e[0]..e[1]).contains(&(r * 1e3))).collect();
            let mean = |f: &dyn Fn(&(f64, f64, f64)) -> f64| {
                ring.iter().map(|v| f(v)).sum::<f64>() / ring.len() as f64
            };
            (mean(&|v| v.1), mean(&|v| v.2))
        })
        .unzip();
    let rings = agreement(&ours, &theirs);
    println!("shear, node by node: correlation {shear_correlation:.3}, left {shear_left:.3}");
    println!("normal, node by node: correlation {:.3}, left {:.3}", by_node.0, by_node.1);
    println!("normal, rings: correlation {:.3}, left {:.3}", rings.0, rings.1);
    for (e, (a, b)) in edges.windows(2).zip(ours.iter().zip(&theirs)) {
        println!("{} to {} mm: ours {a:.3e}, FEM {b:.3e} m", e[0], e[1]);
    }
    assert!(shear_correlation > 0.95 && shear_left < 0.3);
    assert!(rings.0 > 0.9 && rings.1 < 0.45);
}
