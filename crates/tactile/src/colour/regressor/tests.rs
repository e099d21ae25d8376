use super::pyramid::{Surroundings, double, surroundings};
use super::*;
use crate::colour::{ColourModel, shade};
use crate::gradient::gradient;
use crate::grid::Plane;
use crate::testing::{assert_same_on_every_unit, bits};

/// Reproducible numbers between -1 and 1.
fn number(i: usize) -> f32 {
    ((i * 7919 + 13) % 1009) as f32 / 504.5 - 1.0
}

fn model(near: f32, around: f32) -> Regressor {
    Regressor {
        mm_per_px: 0.1,
        near: (0..3 * NEAR * NEAR_FIELD).map(|i| near * number(i)).collect(),
        around: (0..3 * SURROUNDINGS * AROUND_FIELD).map(|i| around * number(i + 77)).collect(),
        slope_limit: 0.9,
        height_limit_mm: 5.0,
        around_limit: vec![50.0; SURROUNDINGS],
    }
}

/// A dent beside the middle of the image.
fn dent() -> Plane {
    Plane::from_fn(83, 61, |x, y| {
        let (x, y) = (x as f32 - 50.0, y as f32 - 27.0);
        (6.0 - 0.03 * (x * x + y * y)).max(0.0)
    })
}

/// The features of the surroundings of a surface on its finest cells, one plane a feature.
fn around_planes(surface: &Plane, mm_per_px: f64) -> Vec<Plane> {
    let all = [true; SURROUNDINGS];
    let Surroundings { fine, coarse } =
        surroundings(&Planes::of_heights(surface), cell_px(mm_per_px), mm_per_px, &all);
    let (w, h) = fine.size;
    let doubled = coarse.planes.iter().map(|(_, plane)| double(plane, w, h));
    fine.planes.into_iter().map(|(_, plane)| plane).chain(doubled).collect()
}

fn change(model: Regressor, surface: &Plane) -> [Plane; 3] {
    let (along_x, along_y) = gradient(surface);
    shade(&ColourModel::Regressor(Box::new(model)), surface, &along_x, &along_y, None)
}

/// Exponents of n_x and n_y of the terms, in order.
fn exponents(degrees: std::ops::RangeInclusive<i32>) -> Vec<(i32, i32)> {
    degrees.flat_map(|d| (0..=d).map(move |b| (d - b, b))).collect()
}

#[test]
fn a_gel_at_rest_changes_nothing() {
    let planes = change(model(30.0, 30.0), &Plane::filled(83, 61, 0.0));
    assert!(planes.iter().all(|plane| plane.values.iter().all(|&v| v == 0.0)));
}

/// The formula of the module in f64, pixel by pixel.
#[test]
fn the_near_part_is_its_formula() {
    let model = model(30.0, 0.0);
    let surface = dent();
    let planes = change(model.clone(), &surface);
    let (along_x, along_y) = gradient(&surface);
    let field = exponents(0..=3);
    let (mut worst, mut largest) = (0.0f64, 0.0f64);
    for pixel in (0..surface.values.len()).step_by(7) {
        let (gx, gy) = (f64::from(along_x.values[pixel]), f64::from(along_y.values[pixel]));
        let length = (1.0 + gx * gx + gy * gy).sqrt();
        let (nx, ny) = (-gx / length, -gy / length);
        let h = f64::from(surface.values[pixel]) * 0.1;
        let u = ((pixel % 83) as f64 - 41.0) * 2.0 / 83.0;
        let v = ((pixel / 83) as f64 - 30.0) * 2.0 / 83.0;
        let normals = exponents(1..=4).into_iter().map(|(a, b)| nx.powi(a) * ny.powi(b));
        let heights = exponents(0..=2).into_iter().map(|(a, b)| h * nx.powi(a) * ny.powi(b));
        let terms: Vec<f64> = normals.chain(heights).collect();
        assert_eq!(terms.len(), NEAR);
        for (channel, plane) in planes.iter().enumerate() {
            let mut exact = 0.0;
            for (t, term) in terms.iter().enumerate() {
                for (m, (i, j)) in field.iter().enumerate() {
                    let c = f64::from(model.near[(channel * NEAR + t) * NEAR_FIELD + m]);
                    exact += c * term * u.powi(*i) * v.powi(*j);
                }
            }
            let ours = f64::from(plane.values[pixel]);
            worst = worst.max((ours - exact).abs());
            largest = largest.max(exact.abs());
        }
    }
    // Fields are straight lines over 16 of these 83 pixels; in an image of 320 the curve is 15 times smaller.
    assert!(largest > 20.0 && worst < 0.03 * largest, "{worst} of {largest}");
}

/// What is fitted (features on the finest cells, fields at the pixel) and what is drawn (fields on each level's
/// cells) are two ways to the same sum.
#[test]
fn the_surroundings_are_drawn_as_they_are_fitted() {
    let model = model(0.0, 20.0);
    let surface = dent();
    let planes = change(model.clone(), &surface);
    let around = around_planes(&surface, 0.1);
    let (cell, field) = (cell_px(0.1), exponents(0..=2));
    let place = Place::of((83, 61));
    let (mut worst, mut largest) = (0.0f32, 0.0f32);
    for pixel in (0..surface.values.len()).step_by(11) {
        let (x, y) = (pixel % 83, pixel / 83);
        let (u, v) = (place.u(x as f32), place.v(y as f32));
        let (x0, x1, wx) = between_cells(x, cell, around[0].width);
        let (y0, y1, wy) = between_cells(y, cell, around[0].height);
        for (channel, plane) in planes.iter().enumerate() {
            let mut exact = 0.0;
            for (f, feature) in around.iter().enumerate() {
                let row = |y: usize| feature.at(x0, y) + wx * (feature.at(x1, y) - feature.at(x0, y));
                let value = row(y0) + wy * (row(y1) - row(y0));
                for (m, (i, j)) in field.iter().enumerate() {
                    let c = model.around[(channel * SURROUNDINGS + f) * AROUND_FIELD + m];
                    exact += c * value * u.powi(*i) * v.powi(*j);
                }
            }
            worst = worst.max((plane.values[pixel] - exact).abs());
            largest = largest.max(exact.abs());
        }
    }
    assert!(largest > 10.0 && worst < 0.03 * largest, "{worst} of {largest}");
}

#[test]
fn slopes_and_features_beyond_those_of_the_presses_are_held() {
    let [nx, ny] = limited_normal(30.0, -40.0, 0.5);
    assert!((nx + 0.3).abs() < 1e-6 && (ny - 0.4).abs() < 1e-6);
    let [nx, ny] = limited_normal(0.3, 0.4, 0.5);
    let length = 1.25_f32.sqrt();
    assert!((nx + 0.3 / length).abs() < 1e-6 && (ny + 0.4 / length).abs() < 1e-6);
    let mut tight = model(0.0, 20.0);
    tight.around_limit = vec![1e-4; SURROUNDINGS];
    let largest = change(tight, &dent())[0].values.iter().fold(0.0f32, |m, v| m.max(v.abs()));
    assert!(largest > 0.0 && largest <= 1e-4 * 20.0 * (SURROUNDINGS * AROUND_FIELD) as f32);
}

#[test]
fn models_that_cannot_be_drawn_are_told_apart() {
    let good = model(1.0, 1.0);
    assert!(good.is_usable());
    for edit in [
        (|m: &mut Regressor| m.near[3] = f32::NAN) as fn(&mut Regressor),
        |m| m.around[5] = f32::INFINITY,
        |m| m.around_limit[7] = -1.0,
        |m| m.slope_limit = -0.1,
        |m| m.height_limit_mm = f32::NAN,
        |m| m.mm_per_px = 0.0,
    ] {
        let mut bad = good.clone();
        edit(&mut bad);
        assert!(!bad.is_usable());
    }
}

#[test]
fn vector_units_give_the_same_bits() {
    let surface = dent();
    let (along_x, along_y) = gradient(&surface);
    assert_same_on_every_unit("shade", |level| {
        let mut change = [0, 1, 2].map(|_| Plane::filled(83, 61, 0.0));
        let planes = Planes::new(&surface, &along_x, &along_y);
        model(30.0, 30.0).shade(&planes, &mut change, &mut DrawScratch::default(), level);
        change.map(|plane| bits(&plane.values))
    });
}

/// A model that uses some of the features draws what it draws with all of them.
#[test]
fn features_without_coefficients_are_left_out() {
    let surface = dent();
    let mut few = model(0.0, 20.0);
    for (i, c) in few.around.chunks_exact_mut(AROUND_FIELD).enumerate() {
        if !AROUND_FITTED.contains(&(i % SURROUNDINGS)) {
            c.fill(0.0);
        }
    }
    assert_eq!(few.around_used().iter().filter(|used| **used).count(), AROUND_FITTED.len());
    let drawn = change(few.clone(), &surface);
    // One more feature with a say of nothing that a pixel can hold.
    let mut all = few.clone();
    all.around.iter_mut().filter(|c| **c == 0.0).for_each(|c| *c = 1e-30);
    assert_eq!(all.around_used(), [true; SURROUNDINGS]);
    assert_eq!(change(all, &surface), drawn);
    few.around.fill(0.0);
    assert!(change(few, &surface).iter().all(|plane| plane.values.iter().all(|&v| v == 0.0)));
}

/// The tail of a blur is no displacement, in blocks of pixels that it fills and beside others.
#[test]
fn tails_of_blurs_are_left_out() {
    let surface = dent();
    let far = |i: usize| {
        let (x, y) = (i % 83, i / 83);
        let at = |x: usize, y: usize| surface.at(x.min(82), y.min(60)) == 0.0;
        at(x, y) && at(x + 1, y) && at(x.saturating_sub(1), y) && at(x, y + 1) && at(x, y.saturating_sub(1))
    };
    let largest = |tail: f32| {
        let mut with_tail = surface.clone();
        for (i, z) in with_tail.values.iter_mut().enumerate().filter(|(_, z)| **z == 0.0) {
            *z = tail * number(i);
        }
        let change = change(model(30.0, 0.0), &with_tail);
        let of_plane = |plane: &Plane| {
            plane.values.iter().enumerate().filter(|(i, _)| far(*i)).fold(0.0f32, |m, (_, v)| m.max(v.abs()))
        };
        change.iter().map(of_plane).fold(0.0f32, f32::max)
    };
    assert!((0..surface.values.len()).filter(|i| far(*i)).count() > 2000);
    assert_eq!(largest(1e-6), 0.0);
    let of_more = largest(1e-3);
    assert!(of_more > 1e-3, "a tail that is larger counts: {of_more}");
}
