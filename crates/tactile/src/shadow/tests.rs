use super::*;
use crate::colour::{Lambert, shade};
use crate::gradient::gradient;
use crate::grid::Grid;
use crate::testing::shadow_table;

fn plane(w: usize, h: usize, value: impl Fn(f64, f64) -> f64) -> Plane {
    Plane::from_fn(w, h, |x, y| value(x as f64, y as f64) as f32)
}

fn dull() -> ColourModel {
    ColourModel::Lambert(Box::new(Lambert::new(&[0.0; 54])))
}

/// A table of 63 directions and two rows whose rays have different lengths in each channel.
fn table(kind: ShadowKind, step_m: f64) -> ShadowTable {
    let ray = |i: usize, c: usize| {
        (0..3 + (i * 7 + c * 5) % 20).map(|s| -30.0 + ((i + c) % 11) as f32 + s as f32).collect()
    };
    ShadowTable { height_step_m: 1e-3, ..shadow_table(kind, 2, step_m, ray) }
}

/// A bump near the corner of an image, so that rays leave it on two sides.
struct Scene {
    surface: Plane,
    slope: (Plane, Plane),
    core: Vec<u8>,
}

impl Scene {
    fn new(w: usize, h: usize, centre: (f64, f64), radius_px: f64, height_px: f64) -> Self {
        let surface = plane(w, h, |x, y| {
            let r2 = ((x - centre.0).powi(2) + (y - centre.1).powi(2)) / radius_px.powi(2);
            height_px * (-r2).exp() + 0.01 * (x * 0.9).sin()
        });
        let core = surface.values.iter().map(|&z| u8::from(f64::from(z) > 0.4 * height_px)).collect();
        let slope = gradient(&surface);
        Self { surface, slope, core }
    }

    fn relief(&self) -> Relief<'_> {
        let (along_x, along_y) = (&self.slope.0, &self.slope.1);
        Relief { raised_px: &self.surface, surface_px: &self.surface, along_x, along_y, core: &self.core }
    }
}

/// Taxim's loop as its paper and source tell it, a pixel, a ray, a step at a time.
#[test]
fn rays_are_those_of_the_plain_loop() {
    let table = table(ShadowKind::Ceiling, 1.25e-4);
    let (w, h) = (48_i32, 36_i32);
    for centre in [(9.0, 7.0), (24.0, 18.0), (40.0, 31.0)] {
        let scene = Scene::new(w as usize, h as usize, centre, 7.0, 8.0);
        let rim = rim(&scene.core, w as usize, 4);
        let z = |x: i32, y: i32| scene.surface.at(x as usize, y as usize);
        let mut exact = vec![[0.0_f32; 3]; (w * h) as usize];
        let mut origins = 0;
        for (x, y) in (0..h).flat_map(|y| (0..w).map(move |x| (x, y))) {
            let near = |d: i32| {
                let all = (-d..=d).flat_map(|dy| (-d..=d).map(move |dx| (x + dx, y + dy)));
                let inside = all.filter(|(x, y)| (0..w).contains(x) && (0..h).contains(y));
                inside.into_iter().any(|(x, y)| scene.core[(y * w + x) as usize] == 1)
            };
            let at_rim = near(4) && !near(0);
            assert_eq!(rim[(y * w + x) as usize] == 1, at_rim, "rim at ({x}, {y})");
            let row = (f64::from(z(x, y)) * 0.1).floor();
            if !at_rim || !(0.0..2.0).contains(&row) {
                continue;
            }
            origins += 1;
            let (gx, gy) =
                (scene.slope.0.at(x as usize, y as usize), scene.slope.1.at(x as usize, y as usize));
            let direction = f64::from(gy.atan2(gx)) + std::f64::consts::PI;
            let n = (direction / 0.1).floor() as usize;
            let rays =
                ((table.directions_rad[n] + 0.1 - (table.directions_rad[n] - 0.1)) / 0.05).ceil() as usize;
            for k in 0..rays {
                let angle = table.directions_rad[n] - 0.1 + 0.05 * k as f64;
                for (c, ray) in table.rays[n * 2 + row as usize].iter().enumerate() {
                    for s in 1..ray.len() {
                        let along = 1.25 * s as f64;
                        let tx = (f64::from(x) + along * angle.cos()).trunc() as i32;
                        let ty = (f64::from(y) + along * angle.sin()).trunc() as i32;
                        let inside = (0..w).contains(&tx) && (0..h).contains(&ty);
                        if inside && z(x, y) > z(tx, ty) {
                            let out = &mut exact[(ty * w + tx) as usize][c];
                            *out = out.min(ray[s]);
                        }
                    }
                }
            }
        }
        assert!(origins > 50);
        let mut pixels: Vec<[f32; 4]> = scene.surface.values.iter().map(|&z| [0.0, 0.0, 0.0, z]).collect();
        Rays::new(&table, 1e-4).cast(&scene.relief(), &rim, &mut pixels);
        let differ = pixels.iter().zip(&exact).filter(|(a, b)| a[..3] != b[..]).count();
        assert_eq!(differ, 0, "of {} pixels, bump at {centre:?}", exact.len());
    }
}

/// The same press seen with pixels half as wide: the same shadow in millimetres.
#[test]
fn a_shadow_has_the_same_size_at_every_resolution() {
    let width_mm = |scale: usize| {
        let metres_per_px = 0.1e-3 / scale as f64;
        let (w, h) = (160 * scale, 120 * scale);
        let s = scale as f64;
        let scene = Scene::new(w, h, (80.0 * s, 60.0 * s), 16.0 * s, 12.0 * s);
        let mut table = table(ShadowKind::Darkening, 0.125e-3);
        table.rays = vec![[0, 1, 2].map(|_| vec![-20.0; 12]); 63 * 2];
        let shadow_of = Shadow::new(table, metres_per_px, w, &dull());
        let mut change = shade(&dull(), &scene.surface, &scene.slope.0, &scene.slope.1, None);
        shadow(&shadow_of, &dull(), &scene.relief(), &mut change, SimdLevel::best());
        let row = change[0].row(60 * scale);
        assert!(row[80 * scale].abs() < 1e-3, "no shadow in the middle of the contact: {}", row[80 * scale]);
        row.iter().map(|v| f64::from(*v) / -20.0).sum::<f64>() * metres_per_px * 1e3
    };
    let (coarse, fine) = (width_mm(1), width_mm(2));
    assert!(coarse > 2.0, "{coarse} mm");
    assert!((coarse - fine).abs() < 0.15, "{coarse} and {fine} mm");
}

/// Darkening beside a ball: strong on one side, none on the other, fading with distance; 0 in the contact.
fn darkening(dx: f64, dy: f64, radius_px: f64, fade_px: f64, grey_levels: f64) -> f64 {
    let r = dx.hypot(dy);
    if r <= radius_px {
        return 0.0;
    }
    -grey_levels * 0.5 * (1.0 + dx / r) * (-(r - radius_px) / fade_px).exp()
}

/// Known shadows of balls at several places and depths go in; the table draws them on a ball at another place.
#[test]
fn a_table_from_presses_draws_the_shadows_it_was_made_from() {
    let grid = Grid { width_px: 200, height_px: 150, metres_per_px: 0.059e-3 };
    let (ball_px, fade_px) = (2.0 / 0.059, 9.0);
    let colours = [25.0, 12.0, 0.0];
    let radius = |depth_m: f64| {
        let d = depth_m / grid.metres_per_px;
        (2.0 * ball_px * d - d * d).sqrt()
    };
    let scenes: Vec<([f64; 2], f64, [Plane; 3])> = (0..12)
        .map(|i| {
            let at = [70.0 + 5.3 * f64::from(i), 60.0 + 7.1 * f64::from(i % 5)];
            let depth_m = 0.4e-3 + 0.05e-3 * f64::from(i);
            let residual = colours.map(|grey_levels| {
                plane(200, 150, |x, y| {
                    let noise = ((x * 12.9898 + y * 78.233 + f64::from(i)).sin() * 43758.5453).fract() * 4.0;
                    darkening(x - at[0], y - at[1], radius(depth_m), fade_px, grey_levels) + noise
                })
            });
            (at, depth_m, residual)
        })
        .collect();
    let presses: Vec<BallPress<'_>> = scenes
        .iter()
        .map(|(at, depth_m, residual)| BallPress {
            residual,
            centre_px: *at,
            radius_px: radius(*depth_m),
            depth_m: *depth_m,
        })
        .collect();
    let table = shadow_from_presses(&presses, &grid, 0.4).unwrap();
    assert!(table.rays.iter().all(|ray| ray[2].iter().all(|v| v.abs() < 2.5)), "blue has no shadow");
    for ray in table.rays.iter().flatten() {
        let fades =
            ray.iter().skip_while(|v| **v == 0.0).collect::<Vec<_>>().windows(2).all(|p| p[0] <= p[1]);
        assert!(fades && ray.iter().all(|v| *v <= 0.0), "{ray:?}");
    }
    let shadow_of = Shadow::new(table, grid.metres_per_px, 200, &dull());
    for depth_m in [0.45e-3, 0.7e-3, 0.9e-3] {
        let (a, d) = (radius(depth_m), depth_m / grid.metres_per_px);
        let (cx, cy) = (103.4, 71.7);
        let depth =
            plane(200, 150, |x, y| (d - ((x - cx).powi(2) + (y - cy).powi(2)) * d / (a * a)).max(0.0));
        let raised = plane(200, 150, |x, y| {
            let r = (x - cx).hypot(y - cy);
            let edge = 0.4 * d;
            if f64::from(depth.at(x as usize, y as usize)) > edge {
                d - r * r * d / (a * a)
            } else {
                edge * (-(r - a * 0.6_f64.sqrt()) / 12.0).exp()
            }
        });
        let core: Vec<u8> = depth.values.iter().map(|&z| u8::from(f64::from(z) > 0.4 * d)).collect();
        let (along_x, along_y) = gradient(&raised);
        let relief = Relief {
            raised_px: &raised,
            surface_px: &raised,
            along_x: &along_x,
            along_y: &along_y,
            core: &core,
        };
        let mut change = shade(&dull(), &raised, &along_x, &along_y, None);
        shadow(&shadow_of, &dull(), &relief, &mut change, SimdLevel::best());
        for (channel, grey_levels) in colours.into_iter().enumerate().take(2) {
            let (mut error, mut truth, mut inside) = (0.0, 0.0, 0.0_f64);
            for i in 0..200 * 150 {
                let (x, y) = ((i % 200) as f64 - cx, (i / 200) as f64 - cy);
                let exact = darkening(x, y, a, fade_px, grey_levels);
                if x.hypot(y) < 0.8 * a {
                    inside = inside.max(f64::from(change[channel].values[i]).abs());
                }
                // The blur of the shadows smears the edge of the contact.
                if x.hypot(y) < a + 1.0 {
                    continue;
                }
                error += (f64::from(change[channel].values[i]) - exact).powi(2);
                truth += exact * exact;
            }
            let share = (error / truth).sqrt();
            println!("depth {depth_m}: channel {channel}, error {:.1} %, inside {inside}", share * 100.0);
            assert!(
                share < 0.15 && inside < 2.0,
                "depth {depth_m}, channel {channel}: {share}, inside {inside}"
            );
        }
    }
}

#[test]
fn presses_without_shadow_give_no_table() {
    let grid = Grid { width_px: 60, height_px: 50, metres_per_px: 1e-4 };
    let bright = [0, 1, 2].map(|_| Plane::filled(60, 50, 3.0));
    let press = BallPress { residual: &bright, centre_px: [30.0, 25.0], radius_px: 8.0, depth_m: 5e-4 };
    assert_eq!(shadow_from_presses(&[press], &grid, 0.4), None);
    assert_eq!(shadow_from_presses(&[], &grid, 0.4), None);
}
