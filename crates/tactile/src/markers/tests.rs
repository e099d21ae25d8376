//! Against closed forms, and the picture.

use super::*;
use gripgen_twin::PressureCell;
use std::f64::consts::PI;

const GRID: Grid = Grid { width_px: 320, height_px: 240, metres_per_px: 1e-4 };

/// A point-like force in the middle of the image.
fn point(force_n: f64) -> ContactPatch {
    ContactPatch {
        cells: vec![PressureCell { x_m: 0.0, y_m: 0.0, area_m2: 1e-10, force_n }],
        ..Default::default()
    }
}

/// Where in pixels a point lies that is (x, y) metres from the middle.
fn at(x: f64, y: f64) -> [f64; 2] {
    [x / 1e-4 + 159.5, y / 1e-4 + 119.5]
}

fn moved(gel: &MarkerGel, patch: &ContactPatch, shear: Shear, x: f64, y: f64) -> [f64; 2] {
    marker_displacements(gel, patch, &shear, &GRID, &[at(x, y)])[0].map(|u| u * 1e-4)
}

/// A gel so thick that its base is far is a half-space: Boussinesq and Cerruti (Johnson 1985, eqs. 3.18b and 3.75),
/// whose displacements fall as 1 / r.
#[test]
fn a_thick_gel_moves_as_a_half_space() {
    for nu in [0.0, 0.3, 0.5] {
        let (modulus, force) = (1e5, 0.2);
        let gel = MarkerGel::new(2.0, modulus, nu, 0.0);
        let g = modulus / (2.0 * (1.0 + nu));
        for (x, y) in [(3e-3, 0.0), (0.0, -5e-3), (2e-3, 1e-3), (-8e-3, 6e-3)] {
            let r = f64::hypot(x, y);
            let close = |a: f64, b: f64| (a - b).abs() < 0.01 * force / (4.0 * PI * g * r);
            let [ux, uy] = moved(&gel, &point(force), Shear::default(), x, y);
            let exact = -(1.0 - 2.0 * nu) * force / (4.0 * PI * g * r);
            assert!(close(ux, exact * x / r) && close(uy, exact * y / r), "nu {nu}, ({x}, {y}): {ux} {uy}");
            let shear = Shear { force_n: [force, 0.0], ..Shear::default() };
            let [vx, vy] = moved(&gel, &point(force), shear, x, y);
            let scale = force / (4.0 * PI * g);
            let cx = scale * (1.0 / r + x * x / r.powi(3) + (1.0 - 2.0 * nu) * (1.0 / r - x * x / r.powi(3)));
            let cy = scale * 2.0 * nu * x * y / r.powi(3);
            assert!(close(vx - ux, cx) && close(vy - uy, cy), "nu {nu}: {} {cx}, {} {cy}", vx - ux, vy - uy);
        }
    }
}

/// Inside a half-space: Mindlin's limit of Boussinesq, u_r = F / (4 pi G) (r z / R^3 - (1 - 2 nu) r / (R (R + z))).
#[test]
fn below_the_surface_an_incompressible_gel_gives_way_outwards() {
    for nu in [0.2, 0.5] {
        let (modulus, z) = (1e5, 1e-3);
        let gel = MarkerGel::new(2.0, modulus, nu, z);
        let g = modulus / (2.0 * (1.0 + nu));
        for r in [0.5e-3, 1e-3, 4e-3] {
            let big = f64::hypot(r, z);
            let exact =
                0.2 / (4.0 * PI * g) * (r * z / big.powi(3) - (1.0 - 2.0 * nu) * r / (big * (big + z)));
            let [ux, uy] = moved(&gel, &point(0.2), Shear::default(), r, 0.0);
            assert!((ux - exact).abs() < 0.01 * exact.abs() + 1e-9 && uy == 0.0, "{nu}, {r}: {ux} {exact}");
        }
    }
}

/// The layer's displacements against their Hankel integrals, done here by brute force with the load's own spectrum.
#[test]
fn a_layer_moves_as_its_integrals_say() {
    let (t, nu, depth, modulus) = (4e-3, 0.45, 0.3e-3, 1e5);
    let gel = MarkerGel::new(t, modulus, nu, depth);
    let g = modulus / (2.0 * (1.0 + nu));
    let soft = 0.5 * (1e-10_f64 / PI).sqrt() / t;
    for r in [0.7e-3, 2.3e-3, 5.5e-3, 11e-3] {
        let integral = |f: &dyn Fn(f64) -> f64| {
            crate::layer::simpson(140.0, 40_000, |x| f(x) * (-x * soft).exp()) / (2.0 * PI * g * t)
        };
        let wave = |x: f64| crate::layer::in_plane(x, depth / t, nu);
        let rho = r / t;
        let outwards = 0.3 * integral(&|x| wave(x).normal * libm::j1(x * rho));
        let mean = integral(&|x| 0.5 * (wave(x).along + wave(x).across) * libm::j0(x * rho));
        let half = -integral(&|x| 0.5 * (wave(x).along - wave(x).across) * libm::jn(2, x * rho));
        let [ux, _] = moved(&gel, &point(0.3), Shear::default(), r, 0.0);
        assert!((ux - outwards).abs() < 2e-3 * outwards.abs() + 1e-9, "{r}: {ux} {outwards}");
        let shear = Shear { force_n: [0.3, 0.0], ..Shear::default() };
        let along = moved(&gel, &point(0.3), shear, r, 0.0)[0] - ux;
        let across = moved(&gel, &point(0.3), shear, 0.0, r)[0];
        assert!((along - 0.3 * (mean + half)).abs() < 2e-3 * 0.3 * mean.abs() + 1e-9, "{r}: {along}");
        assert!((across - 0.3 * (mean - half)).abs() < 2e-3 * 0.3 * mean.abs() + 1e-9, "{r}: {across}");
    }
}

/// A bonded incompressible gel is squeezed outwards, the same in all directions; a shear moves everything near along
/// it; a twist turns the markers about the contact.
#[test]
fn pressing_spreads_pulling_drags_and_twisting_turns() {
    let gel = MarkerGel::new(4e-3, 2e5, 0.5, 0.0);
    let cell = |x: f64, y: f64| PressureCell { x_m: x, y_m: y, area_m2: 1e-6, force_n: 2.5 };
    let patch = ContactPatch {
        cells: [(1e-3, 0.0), (-1e-3, 0.0), (0.0, 1e-3), (0.0, -1e-3)].map(|(x, y)| cell(x, y)).to_vec(),
        ..Default::default()
    };
    let ring: Vec<[f64; 2]> =
        (0..8).map(|i| f64::from(i) * PI / 4.0).map(|a| at(5e-3 * a.cos(), 5e-3 * a.sin())).collect();
    let run = |shear| marker_displacements(&gel, &patch, &shear, &GRID, &ring);
    let pressed = run(Shear::default());
    for (i, u) in pressed.iter().enumerate() {
        let a = i as f64 * PI / 4.0;
        assert!(u[0] * a.cos() + u[1] * a.sin() > 0.3, "outwards: {u:?} px");
        assert!((u[1] * a.cos() - u[0] * a.sin()).abs() < 1e-9, "and nothing but: {u:?}");
    }
    let pulled = run(Shear { force_n: [0.0, 3.0], ..Shear::default() });
    let twisted = run(Shear { moment_n_m: 5e-3, ..Shear::default() });
    for i in 0..8 {
        let a = i as f64 * PI / 4.0;
        assert!(pulled[i][1] - pressed[i][1] > 0.1, "{:?}", pulled[i]);
        let (x, y) = (twisted[i][0] - pressed[i][0], twisted[i][1] - pressed[i][1]);
        assert!(y * a.cos() - x * a.sin() > 0.01 && (x * a.cos() + y * a.sin()).abs() < 1e-2, "{x} {y}");
    }
}

#[test]
fn without_load_nothing_moves_and_nothing_changes() {
    let gel = MarkerGel::new(4e-3, 2e5, 0.5, 0.0);
    let markers = Markers::regular(&GRID, 13, 11, 20.0, 3.2, [0.8, 0.7, 0.6]);
    let still = marker_displacements(
        &gel,
        &ContactPatch::default(),
        &Shear { force_n: [5.0, 0.0], ..Shear::default() },
        &GRID,
        &markers.rest_px,
    );
    assert!(still.iter().flatten().all(|u| u.to_bits() == 0));
    let clean = [0, 1, 2].map(|_| vec![120.0_f32; GRID.len()]);
    let mut change = [0, 1, 2].map(|_| Plane::filled(320, 240, 0.0));
    draw_markers(&markers, &still, &clean, &mut change);
    assert!(change.iter().all(|p| p.values.iter().all(|&v| v == 0.0)));
}

/// A rest frame with printed dots, moved by whole pixels, is the frame with the dots printed there.
#[test]
fn a_moved_dot_is_gone_where_it_was_and_there_where_it_is() {
    let markers = Markers::regular(&GRID, 5, 4, 40.0, 3.4, [0.9, 0.5, 0.2]);
    let plain = [60.0_f32, 120.0, 200.0].map(|v| vec![v; GRID.len()]);
    let print = |dx: f64, dy: f64| {
        let rest_px = markers.rest_px.iter().map(|p| [p[0] + dx, p[1] + dy]).collect();
        let mut frame = plain.clone();
        print_markers(&mut frame, &GRID, &Markers { rest_px, ..markers.clone() });
        frame
    };
    let rest = print(0.0, 0.0);
    let clean = without_markers(&rest, &GRID, &markers);
    for (a, b) in clean.iter().flatten().zip(plain.iter().flatten()) {
        assert!((a - b).abs() < 1e-3);
    }
    // A part and a whole pixel, and out of the image.
    for (dx, dy) in [(3.0, -2.0), (0.37, 0.81), (200.0, 0.0), (0.0, -400.0)] {
        let mut change = [0, 1, 2].map(|_| Plane::filled(320, 240, 0.0));
        draw_markers(&markers, &vec![[dx, dy]; 20], &clean, &mut change);
        let wanted = print(dx, dy);
        for channel in 0..3 {
            for i in 0..GRID.len() {
                let shown = rest[channel][i] + change[channel].values[i];
                assert!((shown - wanted[channel][i]).abs() < 2e-3, "({dx}, {dy}), pixel {i}");
            }
        }
    }
    let dark: f64 = rest[1].iter().map(|&v| f64::from(120.0 - v) / 60.0).sum();
    assert!((dark / (20.0 * PI * 3.4 * 3.4) - 1.0).abs() < 0.02, "the edge keeps the dot's area: {dark}");
}

/// A sensor with markers is written and read again, refuses numbers that cannot be, and its picture shows the motion.
#[test]
fn markers_of_a_sensor_file_are_read_and_moved() {
    use crate::{ColourModel, Lambert, Renderer, Sensor, SimdLevel};
    let grid = Grid { width_px: 64, height_px: 48, metres_per_px: 1e-4 };
    let markers = Markers::regular(&grid, 3, 3, 12.0, 2.5, [1.0, 0.5, 0.0]);
    let mut rest = [0, 1, 2].map(|_| vec![100.0_f32; grid.len()]);
    print_markers(&mut rest, &grid, &markers);
    let rest = rest.map(|plane| plane.iter().map(|v| v.round()).collect());
    let colour = ColourModel::Lambert(Box::new(Lambert::new(&[0.0; 54])));
    let sensor = Sensor { markers: Some(markers.clone()), ..Sensor::new(grid, rest, [0.0; 3], colour) };
    let bytes = sensor.to_npz().unwrap().unwrap();
    let again = Sensor::from_npz(&bytes, None, None).unwrap();
    assert_eq!(again.markers, sensor.markers);
    for (bad, part) in [
        (Markers { radius_px: 0.1, ..markers.clone() }, "`marker_radius_px` is 0.1"),
        (Markers { darkness_rgb: [0.0, 1.5, 0.0], ..markers.clone() }, "`marker_darkness_rgb` is 1.5"),
        (Markers { rest_px: vec![[f64::NAN, 0.0]], ..markers.clone() }, "`marker_px` holds"),
    ] {
        let bytes = Sensor { markers: Some(bad), ..sensor.clone() }.to_npz().unwrap().unwrap();
        let error = Sensor::from_npz(&bytes, None, None).unwrap_err().to_string();
        assert!(error.contains(part), "{error}");
    }
    let elastic = Some(gripgen_twin::Elastic { young_modulus_pa: 2e5, poisson_ratio: 0.5 });
    let model = gripgen_twin::config::GelModel::Elastic;
    let gel = gripgen_twin::Gel { model, elastic, ..crate::testing::gel(&[5]) };
    let renderer = Renderer { sensor: &again, gel: &gel, level: SimdLevel::best() };
    let ball = Plane::from_fn(64, 48, |x, y| -((x as f32 - 31.5).powi(2) + (y as f32 - 23.5).powi(2)) / 40.0);
    let gel = crate::ElasticGel {
        thickness_m: 4e-3,
        young_modulus_pa: 2e5,
        poisson_ratio: 0.5,
        base: crate::Base::Bonded,
    };
    let imprint = crate::press_elastic(&ball, &grid, &gel, 0.5, SimdLevel::best()).unwrap();
    let sheared = renderer.change_under_shear(&imprint, &Shear { force_n: [0.06, 0.0], ..Shear::default() });
    // Behind the middle dot it gets brighter, ahead darker; blue light passes the dots.
    assert!(
        sheared[0].at(29, 24) > 5.0 && sheared[0].at(34, 24) < -5.0,
        "{} {}",
        sheared[0].at(29, 24),
        sheared[0].at(34, 24)
    );
    assert!((sheared[1].at(29, 24) / sheared[0].at(29, 24) - 0.5).abs() < 0.05);
    assert!(sheared[2].values.iter().all(|&v| v == 0.0));
    let plain = Sensor { markers: None, ..again.clone() };
    let unmarked = Renderer { sensor: &plain, ..renderer };
    assert!(unmarked.change(&imprint)[0].values.iter().all(|&v| v == 0.0));
}

/// A ramp of slope 1/4 moves its dots down by a quarter of the lever; a surface that is dragged takes them along by its height.
#[test]
fn dots_go_with_the_tilt_and_the_shear_of_the_surface() {
    let ramp = Plane::from_fn(40, 30, |x, _| 0.25 * x as f32);
    let at = [[20.0, 15.0], [8.0, 4.0], [200.0, 4.0]];
    let tilted = marker_displacements_by_surface(&ramp, 0.04e-3, [0.0; 2], &at);
    assert!((tilted[0][0] + 0.25 * 4.0).abs() < 1e-9 && tilted[0][1] == 0.0, "{tilted:?}");
    let dragged = marker_displacements_by_surface(&ramp, 0.04e-3, [0.0, 0.5], &at);
    assert!((dragged[1][1] - 0.5 * 2.0).abs() < 1e-9 && dragged[1][0] == tilted[1][0], "{dragged:?}");
    assert_eq!(dragged[2], [0.0; 2], "outside of the image nothing is known");
}

/// Dots drawn into a frame, dimmed by 0.7 and 2.5 px wide, are measured as they were drawn.
#[test]
fn the_dots_of_a_frame_are_measured() {
    let grid = Grid { width_px: 160, height_px: 120, metres_per_px: 1e-4 };
    let drawn = Markers::regular(&grid, 6, 5, 22.3, 2.6, [0.7, 0.6, 0.8]);
    let mut rest = [120.0f32, 90.0, 60.0].map(|level| {
        let plane = Plane::from_fn(160, 120, |x, y| level + 0.1 * x as f32 - 0.05 * y as f32);
        plane.values
    });
    assert_eq!(Markers::of_rest(&rest, &grid), None, "a frame without dots has none");
    print_markers(&mut rest, &grid, &drawn);
    let found = Markers::of_rest(&rest, &grid).unwrap();
    assert_eq!(found.rest_px.len(), 30);
    for (found, drawn) in found.rest_px.iter().zip(&drawn.rest_px) {
        assert!((found[0] - drawn[0]).hypot(found[1] - drawn[1]) < 0.15, "{found:?} {drawn:?}");
    }
    assert!((found.radius_px - 2.6).abs() < 0.15, "{}", found.radius_px);
    for (found, drawn) in found.darkness_rgb.iter().zip(drawn.darkness_rgb) {
        assert!((found - drawn).abs() < 0.05, "{found} {drawn}");
    }
    // Each moved by up to 10 px, less than half the pitch, one gone: nobody takes its neighbour's place.
    let by = |i: usize| [(i as f64 * 2.4).sin() * 7.0, (i as f64 * 1.7).cos() * 7.0];
    let dot = |i: usize| Dot {
        centre_px: [drawn.rest_px[i][0] + by(i)[0], drawn.rest_px[i][1] + by(i)[1]],
        pixels: vec![],
    };
    let moved: Vec<Dot> = (0..30).filter(|&i| i != 13).map(dot).collect();
    let followed = follow_dots(&moved, &drawn.rest_px);
    for (i, at) in followed.iter().enumerate() {
        assert_eq!(*at, (i != 13).then_some(if i < 13 { i } else { i - 1 }));
    }
}
