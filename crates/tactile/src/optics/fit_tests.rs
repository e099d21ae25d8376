//! Every optics effect can be fitted, and which of them look alike.

use super::testing::*;
use gripgen_twin::OpticsState;
use gripgen_twin::effects::{EffectSpec, LIBRARY};
use gripgen_twin::random::{Purpose, Stream};
use nalgebra::{DMatrix, DVector};

/// Presses of a series: a ball at several places and depths, and something with edges, over four hours.
const SERIES: [Scene; 4] = [
    scene(Shape::Ball, [0.5, -0.4], 4.0, 0.5),
    scene(Shape::Rack, [-1.5, 1.0], 5.0, 1.5),
    scene(Shape::Ball, [-5.0, 3.5], 8.0, 2.5),
    scene(Shape::Rack, [3.0, -2.0], 2.0, 4.0),
];

/// Effects with a value of middling size for each parameter, and where a fit of them starts.
///
/// What stands at its neutral value in the second column is not fitted: the place of a step is found by trying, and two
/// of the finer terms of a background stand for all.
const CASES: [(&str, &[f64], &[f64]); 13] = [
    ("light_drift", &[0.02, -0.015, 0.03], &[0.0; 3]),
    ("background_change", &PATTERN, &[0.0; PATTERN.len()]),
    ("misregistration", &[0.25, -0.15, 2.0, 1.03, 0.04, 0.0], &[0.0, 0.0, 0.0, 1.0, 0.0, 0.0]),
    ("exposure", &[0.95, 1.06], &[1.0, 1.0]),
    ("defocus", &[0.25], &[0.1]),
    ("gel_kernel", &[1.25], &[1.0]),
    ("cad_mismatch", &[0.12, 0.25], &[0.0, 0.1]),
    ("rest_offset", &[2.0, -3.0, 1.5], &[0.0; 3]),
    ("cast_shadow", &[0.3, 15.0], &[0.1, 25.0]),
    ("gel_dome", &[0.8], &[0.0]),
    ("press_gain", &[1.04, 0.95, 0.04, 0.02, 0.03], &[1.0, 1.0, 0.0, 0.0, 0.0]),
    ("press_depth", &[0.8, 0.06], &[1.0, 0.0]),
    ("edge_rounding", &[0.7], &[0.5]),
];

/// All coarse terms of a background and one each of the fourth and the sixth degree.
const PATTERN: [f64; 82] = {
    let coarse = [3.0, -2.0, 4.0, 1.5, -3.0, -2.5, 3.0, 2.0, -2.0, 1.5, 2.0, 2.5, -3.0, 2.0, 3.0];
    let mut all = [0.0; 82];
    let mut i = 0;
    while i < coarse.len() {
        all[i] = coarse[i];
        i += 1;
    }
    all[30] = 2.5;
    all[60] = -3.0;
    all
};

/// The images of the series, as one vector.
fn images(rig: &TestSensor, scenes: &[Scene], id: &str, parameters: &[f64]) -> DVector<f64> {
    let all = scenes.iter().flat_map(|scene| rig.with(scene, id, parameters));
    DVector::from_iterator(scenes.len() * 3 * GRID.len(), all.flat_map(|plane| plane.values).map(f64::from))
}

fn without(rig: &TestSensor, scenes: &[Scene]) -> DVector<f64> {
    let all = scenes.iter().flat_map(|scene| rig.change(scene, &OpticsState::default()));
    DVector::from_iterator(scenes.len() * 3 * GRID.len(), all.flat_map(|plane| plane.values).map(f64::from))
}

/// Parameters of an effect that are fitted.
fn fitted(spec: &EffectSpec) -> Vec<usize> {
    let (_, size, _) = CASES.into_iter().find(|(id, ..)| *id == spec.id).expect("a case");
    (0..spec.parameters.len()).filter(|&j| size[j] != spec.parameters[j].neutral).collect()
}

/// Derivatives of the images by the fitted parameters, from steps of a hundredth of a bound to both sides.
fn derivatives(rig: &TestSensor, scenes: &[Scene], id: &str, parameters: &[f64]) -> DMatrix<f64> {
    let columns: Vec<DVector<f64>> = fitted(spec(id))
        .into_iter()
        .map(|j| {
            let (low, high) = spec(id).parameters[j].bounds;
            let step = 0.005 * (high - low).min(2.0);
            let at = |value: f64| {
                let mut moved = parameters.to_vec();
                moved[j] = value.clamp(low, high);
                (moved[j], images(rig, scenes, id, &moved))
            };
            let ((a, before), (b, after)) = (at(parameters[j] - step), at(parameters[j] + step));
            (after - before) / (b - a)
        })
        .collect();
    DMatrix::from_columns(&columns)
}

/// Gauss-Newton from `start`, kept inside the bounds, with halved steps where the error would rise.
fn fit(rig: &TestSensor, scenes: &[Scene], id: &str, start: &[f64], measured: &DVector<f64>) -> Vec<f64> {
    let mut now = start.to_vec();
    let mut error = (measured - images(rig, scenes, id, &now)).norm_squared();
    for _ in 0..12 {
        let jacobian = derivatives(rig, scenes, id, &now);
        let residual = measured - images(rig, scenes, id, &now);
        let normal = jacobian.transpose() * &jacobian;
        let step =
            normal.cholesky().expect("independent derivatives").solve(&(jacobian.transpose() * residual));
        let mut length = 1.0;
        let (next, lower) = loop {
            let mut next = now.clone();
            for (&j, d) in fitted(spec(id)).iter().zip(step.iter()) {
                let (low, high) = spec(id).parameters[j].bounds;
                next[j] = (now[j] + length * d).clamp(low, high);
            }
            let lower = (measured - images(rig, scenes, id, &next)).norm_squared();
            if lower <= error || length < 0.01 {
                break (next, lower);
            }
            length *= 0.5;
        };
        let done = error - lower < 1e-6 * error;
        if lower < error {
            (now, error) = (next, lower);
        }
        if done {
            break;
        }
    }
    now
}

/// From two images with the noise of a real sensor every parameter comes back: within 4 % of its size.
#[test]
fn every_parameter_comes_back_from_noisy_images() {
    let rig = rig();
    let scenes = &SERIES[1..3];
    for (case, (id, truth, start)) in CASES.into_iter().enumerate() {
        let mut noise = Stream::new(7, case as u64, Purpose::ImageNoiseLeft);
        // A camera rounds.
        let measured = images(&rig, scenes, id, truth).map(|v| (v + CAMERA_NOISE * noise.normal()).round());
        let found = fit(&rig, scenes, id, start, &measured);
        for j in fitted(spec(id)) {
            let p = &spec(id).parameters[j];
            let size = (truth[j] - p.neutral).abs();
            println!("{id}.{}: {:.4} of {}", p.name, found[j], truth[j]);
            assert!(
                (found[j] - truth[j]).abs() < 0.04 * size,
                "{id}.{}: {} of {}",
                p.name,
                found[j],
                truth[j]
            );
        }
    }
}

/// Standard deviation of a pixel, in grey levels.
const CAMERA_NOISE: f64 = 1.0;

/// Signatures of the effects (rows) against each other and against linearised fits of their rivals (columns).
struct Table {
    cosines: DMatrix<f64>,
    /// Share that the best fit of the rival explains.
    shares: DMatrix<f64>,
    /// Size of what it leaves, in standard deviations of the noise.
    sigmas: DMatrix<f64>,
}

/// The signatures of all effects, then for each effect what each of its parameters does alone: a column each, and which
/// columns are whose. Secants, because some derivatives vanish at the neutral value.
fn columns(rig: &TestSensor, scenes: &[Scene]) -> (DMatrix<f64>, Vec<Vec<usize>>) {
    let plain = without(rig, scenes);
    let mut all: Vec<DVector<f64>> =
        CASES.iter().map(|(id, size, _)| images(rig, scenes, id, size) - &plain).collect();
    let mut whose = Vec::new();
    for (id, size, _) in CASES {
        let parameters = spec(id).parameters;
        let mut own = Vec::new();
        for j in fitted(spec(id)) {
            let mut one: Vec<f64> = parameters.iter().map(|p| p.neutral).collect();
            if id == "cast_shadow" {
                // The elevation of a light without shadow says nothing.
                one[0] = size[0];
            }
            one[j] = size[j];
            own.push(all.len());
            all.push(images(rig, scenes, id, &one) - &plain);
        }
        whose.push(own);
    }
    (DMatrix::from_columns(&all), whose)
}

/// The table of some of the images, from the products of their columns.
fn table(products: &DMatrix<f64>, whose: &[Vec<usize>]) -> Table {
    let n = CASES.len();
    let left = DMatrix::from_fn(n, n, |i, j| {
        // A press may be too shallow for a shadow.
        let own: Vec<usize> = whose[j].iter().copied().filter(|&k| products[(k, k)] > 0.0).collect();
        let m = own.len();
        let scale = |k: usize| products[(k, k)].sqrt();
        let normal =
            DMatrix::from_fn(m, m, |a, b| products[(own[a], own[b])] / scale(own[a]) / scale(own[b]));
        let right = DVector::from_fn(m, |a, _| products[(own[a], i)] / scale(own[a]));
        let fit = normal.cholesky().expect("independent columns").solve(&right);
        (products[(i, i)] - fit.dot(&right)).max(0.0)
    });
    Table {
        cosines: DMatrix::from_fn(n, n, |i, j| {
            products[(i, j)] / (products[(i, i)] * products[(j, j)]).sqrt()
        }),
        shares: DMatrix::from_fn(n, n, |i, j| 1.0 - left[(i, j)] / products[(i, i)]),
        sigmas: left.map(|squares| squares.sqrt() / CAMERA_NOISE),
    }
}

fn print(title: &str, table: &DMatrix<f64>) {
    println!("{title}");
    for (i, (id, ..)) in CASES.iter().enumerate() {
        let row: String = table.row(i).iter().map(|v| format!("{v:8.3}")).collect();
        println!("{id:>18}{row}");
    }
}

/// Over a series of presses no signature is a multiple of another one, and what the best rival leaves of it stands far
/// above the noise. The tables say which pairs are hard.
#[test]
fn no_two_effects_look_alike_over_a_series_of_presses() {
    let rig = rig();
    let nothing = scene(Shape::Nothing, [0.0; 2], 0.0, 3.0);
    let with_rest = [SERIES[0], SERIES[1], SERIES[2], SERIES[3], nothing];
    let (all, whose) = columns(&rig, &with_rest);
    for (title, scenes) in [
        ("four presses in four hours", 0..4),
        ("the same and a frame without contact", 0..5),
        ("one image of a rack", 1..2),
        ("one image of a ball", 0..1),
    ] {
        let pixels = 3 * GRID.len();
        let some = all.rows(scenes.start * pixels, scenes.len() * pixels);
        let Table { cosines, shares, sigmas } = table(&(some.transpose() * some), &whose);
        print(&format!("{title}: cosines of signatures"), &cosines);
        print(&format!("{title}: share of the row that a fit of the column explains"), &shares);
        print(&format!("{title}: what that fit leaves, in standard deviations of the noise"), &sigmas);
        let n = CASES.len();
        for (i, j) in (0..n * n).map(|k| (k / n, k % n)).filter(|(i, j)| i != j) {
            let names = format!("{title}: {} by {}", CASES[i].0, CASES[j].0);
            if scenes.len() > 1 {
                assert!(cosines[(i, j)].abs() < 0.95, "{names}: cosine {}", cosines[(i, j)]);
                assert!(sigmas[(i, j)] > 10.0, "{names}: {} sigma", sigmas[(i, j)]);
            }
            if i < j && cosines[(i, j)].abs() > 0.7 || shares[(i, j)] > 0.7 {
                let (c, s) = (cosines[(i, j)], shares[(i, j)]);
                println!("ALIKE {names}: cosine {c:.3}, share {s:.4}, {:.0} sigma left", sigmas[(i, j)]);
            }
        }
    }
}

/// The images have a derivative by every parameter in the middle of its range.
#[test]
fn every_parameter_moves_the_image() {
    let rig = rig();
    for (id, middle, _) in CASES {
        let jacobian = derivatives(&rig, &SERIES[1..3], id, middle);
        for (column, j) in fitted(spec(id)).into_iter().enumerate() {
            let p = &spec(id).parameters[j];
            let moved = jacobian.column(column).norm() / (jacobian.nrows() as f64).sqrt();
            // In grey levels over a tenth of the range, root mean square.
            let over = 0.1 * moved * (p.bounds.1 - p.bounds.0);
            println!("{id}.{}: {over:.3}", p.name);
            assert!(over > 0.02, "{id}.{}: {over}", p.name);
        }
    }
    let known: Vec<&str> = CASES.iter().map(|(id, ..)| *id).collect();
    assert!(LIBRARY.iter().filter(|s| s.optics.is_some()).all(|s| known.contains(&s.id)));
}

/// Without a clock two effects are one: a drift that all channels share is an exposure.
#[test]
fn a_common_drift_in_one_image_is_an_exposure() {
    let rig = rig();
    let scenes = &SERIES[2..3];
    let drift = images(&rig, scenes, "light_drift", &[-0.02; 3]);
    let exposure = images(&rig, scenes, "exposure", &[1.0 - 0.02 * SERIES[2].hours, 1.0]);
    assert!((drift - exposure).amax() < 1e-3);
}
