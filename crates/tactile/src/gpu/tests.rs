//! The graphics processor against the processor, stage by stage and as a whole, in both variants of the kernels.
//!
//! Run on Mesa's lavapipe where there is no other adapter: it shows that results are right, not how fast they are.

use super::*;
use crate::colour::regressor::{AROUND_FIELD, AROUND_HEIGHTS, NEAR, NEAR_FIELD, SURROUNDINGS};
use crate::colour::{ColourModel, Regressor, TaximTable};
use crate::convolve::Follow;
use crate::sensor::{GelShape, Pyramid};
use crate::shadow::{Shadow, ShadowKind, ShadowTable};
use crate::testing::{self, gel};
use crate::{ClusteredMesh, Grid, Renderer, SimdLevel, finish};
use gripgen_twin::frames::Pose;
use gripgen_twin::frames::{pose, rotation_from_fixed_xyz};
use gripgen_twin::parts::{BallBearing, InvoluteGear, SteppedShaft};
use nalgebra::Vector3;

/// Share of the values of an image that may be more than one grey level off.
const OUTLIERS: f64 = 0.0005;
/// Largest difference between two surfaces.
const TOLERANCE_PX: f32 = 1e-4;

fn renderer() -> GpuRenderer {
    GpuRenderer::new(&AdapterChoice::Named("llvmpipe".into()))
        .or_else(|_| GpuRenderer::new(&AdapterChoice::Hardware))
        .unwrap_or_else(|e| panic!("{e}"))
}

fn both_variants() -> [GpuRenderer; 2] {
    [renderer().with_variant(Variant::Texture { run: 16 }), renderer().with_variant(Variant::Tile)]
}

/// A table whose colours change with slope and direction, as a calibrated one's do.
fn taxim_table(width_px: usize, height_px: usize) -> TaximTable {
    let rgb = (0..width_px * height_px).flat_map(|i| [(90 + i % 30) as u8, 110, 120]).collect();
    let frame = TactileImage { width_px: width_px as u32, height_px: height_px as u32, rgb };
    testing::taxim_table(&frame, 125, |c, k| {
        let (i, j) = ((k / 125) as f64, (k % 125) as f64);
        let value = 1.5 * i * (j * std::f64::consts::TAU / 124.0 + [0.0, 2.1, 4.2][c]).cos();
        [1e-6 * i, -2e-6 * i, 1e-6 * i, 1e-3 * i, -1e-3 * i, value + 100.0]
    })
}

/// Regression with every coefficient in use, and limits that some presses reach.
fn regression(width_px: usize) -> ColourModel {
    let number = |i: usize| ((i * 7919 + 13) % 1009) as f32 / 504.5 - 1.0;
    let mut around_limit = vec![0.3; SURROUNDINGS];
    AROUND_HEIGHTS.iter().for_each(|&i| around_limit[i] = 0.6);
    ColourModel::Regressor(Box::new(Regressor {
        mm_per_px: 28.0 / width_px as f64,
        near: (0..3 * NEAR * NEAR_FIELD).map(|i| 12.0 * number(i)).collect(),
        around: (0..3 * SURROUNDINGS * AROUND_FIELD).map(|i| 10.0 * number(i + 77)).collect(),
        slope_limit: 0.75,
        height_limit_mm: 1.0,
        around_limit,
    }))
}

/// Three lights, each mainly in its channel.
pub(super) fn lit() -> ColourModel {
    let colours = [(0.0, [150.0, 20.0, 10.0]), (120.0, [10.0, 160.0, 20.0]), (240.0, [20.0, 10.0, 155.0])];
    ColourModel::Lambert(Box::new(testing::lights(0.6, [0.3, 0.1], &colours)))
}

pub(super) fn sensor(width_px: usize, height_px: usize, colour: ColourModel) -> Sensor {
    let rest = [90.0, 110.0, 120.0].map(|base| {
        (0..width_px * height_px).map(|i| base + (i % width_px) as f32 * 0.05).collect::<Vec<f32>>()
    });
    let grid = Grid { width_px, height_px, metres_per_px: 28e-3 / width_px as f64 };
    Sensor::new(grid, rest, [1.5, 1.2, 1.8], colour)
}

const PYRAMID: [u32; 5] = [71, 51, 21, 11, 5];

/// The mesh turned and shifted, its highest point in the gel's surface.
fn touching(mesh: &TriMesh, angles: [f64; 3], x_m: f64, y_m: f64) -> Pose {
    let rotation = rotation_from_fixed_xyz(angles);
    let nearest = mesh.vertices_m().iter().map(|v| (rotation * v).z).fold(f64::INFINITY, f64::min);
    pose(&rotation, Vector3::new(x_m, y_m, -nearest))
}

/// A part in a pose with a force.
struct Case {
    mesh: usize,
    at: Pose,
    force_n: f64,
}

/// Parts with few large and many small triangles, upright and tilted, in the middle and over the window's edge.
/// `turned_rad` turns them all about the gel's normal.
fn cases(turned_rad: f64) -> (Vec<TriMesh>, Vec<Case>) {
    let meshes = vec![
        SteppedShaft { segments: 96, ..Default::default() }.mesh(),
        InvoluteGear::default().mesh(),
        BallBearing::default().mesh(),
        SteppedShaft { segments: 1500, ..Default::default() }.mesh(),
    ];
    let mut cases = vec![];
    for mesh in 0..meshes.len() {
        for (angles, x_m, y_m, force_n) in [
            ([0.0, 0.0, 0.0], 0.31e-3, -0.17e-3, 40.0),
            ([1.57, 0.0, 0.4], 1.1e-3, 0.7e-3, 25.0),
            ([0.02, 1.57, 1.0], -2e-3, 1e-3, 80.0),
            ([0.7, 0.3, 2.0], 12e-3, -8e-3, 5.0),
            ([1.5, 0.1, 0.0], -13.9e-3, 9e-3, 12.0),
        ] {
            let angles = [angles[0], angles[1], angles[2] + turned_rad];
            cases.push(Case { mesh, at: touching(&meshes[mesh], angles, x_m, y_m), force_n });
        }
    }
    (meshes, cases)
}

const IMPRINT_M3_PER_N: f64 = 1.0e-9;

fn requests<'a>(cases: &[Case], meshes: &'a [GpuMesh], noise_key: Option<u64>) -> Vec<GpuRequest<'a>> {
    let request = |case: &Case| GpuRequest {
        press: Some(GpuPress {
            mesh: &meshes[case.mesh],
            gel_from_mesh: case.at,
            imprint_m3_per_n: IMPRINT_M3_PER_N,
            force_n: case.force_n,
        }),
        noise_key,
    };
    cases.iter().map(request).collect()
}

/// Renders all cases on both and compares surfaces and images.
fn compare(gpu: &GpuRenderer, sensor: &Sensor, gel: &Gel, turned_rad: f64) {
    let (meshes, cases) = cases(turned_rad);
    let cpu = Renderer { sensor, gel, level: SimdLevel::best() };
    let on_device: Vec<GpuMesh> = meshes.iter().map(|m| gpu.mesh(m).unwrap()).collect();
    let meshes: Vec<ClusteredMesh> = meshes.iter().map(ClusteredMesh::new).collect();
    let mut there = gpu.sensor(sensor, gel).unwrap();
    let key = Some(0x1234_5678_9abc_def0);
    let requests = requests(&cases, &on_device, key);
    let surfaces = gpu.surfaces(&mut there, &requests).unwrap();
    let images = gpu.images(&mut there, &requests).unwrap();
    let (mut pressed, mut worst_px, mut worst_share) = (0, 0.0f32, 0.0f64);
    for (i, case) in cases.iter().enumerate() {
        let ours = cpu.press(&meshes[case.mesh], &case.at, IMPRINT_M3_PER_N, case.force_n);
        let (imprint, image) = match (ours, &images[i]) {
            (Ok(imprint), Ok(image)) => (imprint, image),
            (Err(e), Err(there)) => {
                assert_eq!(std::mem::discriminant(&e), std::mem::discriminant(there), "case {i}");
                continue;
            }
            (ours, _) => panic!("case {i}: only one of them failed, cpu {:?}", ours.err()),
        };
        pressed += 1;
        let surface = cpu.surface(&imprint);
        let difference =
            surface.values.iter().zip(&surfaces[i].values).fold(0.0f32, |m, (a, b)| m.max((a - b).abs()));
        let image_of_cpu = cpu.image(Some(&imprint), key);
        let off = image_of_cpu.rgb.iter().zip(&image.rgb).filter(|(a, b)| a.abs_diff(**b) > 1).count();
        let share = off as f64 / image.rgb.len() as f64;
        assert!(difference <= TOLERANCE_PX, "case {i}: surfaces differ by {difference} px");
        assert!(share <= OUTLIERS, "case {i}: {:.4} % of the values differ by more than 1", 100.0 * share);
        worst_px = worst_px.max(difference);
        worst_share = worst_share.max(share);
    }
    assert!(pressed >= cases.len() * 3 / 4, "{pressed} of {} cases touch", cases.len());
    println!(
        "{}, {:?}: {pressed} presses, surfaces within {worst_px:.1e} px, at most {:.4} % of values more than 1 apart",
        gpu.adapter(),
        gpu.pipelines.variant(),
        100.0 * worst_share
    );
}

#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn images_agree_with_the_processor() {
    for gpu in both_variants() {
        compare(&gpu, &sensor(320, 240, lit()), &gel(&PYRAMID), 0.0);
    }
}

#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn odd_sizes_and_other_pyramids_agree_with_the_processor() {
    for gpu in both_variants() {
        compare(&gpu, &sensor(131, 97, lit()), &gel(&[101, 31, 7, 3]), 0.0);
    }
}

/// Turned by half a degree: the axes of the image are bounds of bins of direction, and there the last bit of a height
/// decides on which side a slope lies (0.08 % of the values of the upright gear; its colours jump by 3 grey levels).
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn colours_of_a_taxim_table_agree_with_the_processor() {
    for gpu in both_variants() {
        let table = ColourModel::Taxim(Box::new(taxim_table(320, 240)));
        compare(&gpu, &sensor(320, 240, table), &gel(&PYRAMID), 0.01);
    }
}

/// Images of even and odd size, with cells of one pixel and of three, and levels smaller than the kernel that smooths
/// them. Much smaller images differ by what the straight lines of the processor's blocks of 16 pixels leave out.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
#[cfg_attr(vulkan, ignore = "slow: kernels on a software driver")]
fn colours_by_regression_agree_with_the_processor() {
    for gpu in both_variants() {
        compare(&gpu, &sensor(320, 240, regression(320)), &gel(&PYRAMID), 0.0);
        compare(&gpu, &sensor(131, 97, regression(131)), &gel(&[31, 21, 7, 3]), 0.0);
        compare(&gpu, &sensor(80, 53, regression(80)), &gel(&[11, 5]), 0.0);
    }
}

/// A calibrated sensor says which kernels its gel has.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn the_deformation_of_the_calibration_is_used() {
    let mut calibrated = sensor(160, 120, regression(160));
    calibrated.pyramid = Some(Pyramid {
        kernels_px: vec![31, 15, 5],
        restore_depth_fraction: 0.25,
        sink_in_fraction: 0.0,
        follow: Follow::Exactly,
    });
    for gpu in both_variants() {
        for follow in [Follow::Exactly, Follow::AtLeast] {
            calibrated.pyramid.iter_mut().for_each(|pyramid| pyramid.follow = follow);
            compare(&gpu, &calibrated, &gel(&[71, 5]), 0.0);
        }
    }
}

/// Rays as long as a sensor's, longer in some directions, of some rows and of some channels. Some contacts lie below and
/// above its rows.
fn shadow_table(kind: ShadowKind) -> ShadowTable {
    let ray = |i: usize, c: usize| -> Vec<f32> {
        let steps = 8 + (i * 7 + c * 5) % 40;
        (0..steps).map(|s| -40.0 * (1.0 - s as f32 / steps as f32) - ((i + c) % 5) as f32).collect()
    };
    ShadowTable { first_height_m: 0.2e-3, ..testing::shadow_table(kind, 4, 0.08e-3, ray) }
}

fn with_shadows(mut sensor: Sensor, kind: ShadowKind) -> Sensor {
    let (grid, colour) = (&sensor.grid, &sensor.colour);
    let shadow = Shadow::new(shadow_table(kind), grid.metres_per_px, grid.width_px, colour);
    sensor.shadow = Some(Box::new(shadow));
    sensor
}

/// Both kinds of table with every kind of colours, also on a gel that is not flat. Turned, since the sectors of direction
/// have borders along the axes of the image too.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
#[cfg_attr(vulkan, ignore = "slow: kernels on a software driver")]
fn shadows_agree_with_the_processor() {
    let taxim = || ColourModel::Taxim(Box::new(taxim_table(200, 150)));
    let (flat, dome) = (GelShape::Flat, GelShape::Dome { sag_m: 1e-3 });
    let (added, ceiling) = (ShadowKind::Darkening, ShadowKind::Ceiling);
    for (kind, colour, gel_shape) in [
        (added, lit(), &flat),
        (added, regression(200), &dome),
        (added, taxim(), &flat),
        (ceiling, lit(), &dome),
        (ceiling, regression(200), &dome),
        (ceiling, taxim(), &flat),
        (ceiling, taxim(), &dome),
    ] {
        let mut plain = sensor(200, 150, colour);
        plain.gel_shape = gel_shape.clone();
        let shadowed = with_shadows(plain, kind);
        for gpu in both_variants() {
            compare(&gpu, &shadowed, &gel(&[51, 21, 11, 5]), 0.01);
        }
    }
}

/// Without contact the image is the rest frame, with the same noise to the bit.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
#[cfg_attr(vulkan, ignore = "slow: kernels on a software driver")]
fn a_gel_at_rest_gives_the_same_bytes() {
    for gpu in both_variants() {
        for colour in [lit(), regression(67), ColourModel::Taxim(Box::new(taxim_table(67, 45)))] {
            let sensor = with_shadows(sensor(67, 45, colour), ShadowKind::Ceiling);
            let mut there = gpu.sensor(&sensor, &gel(&[11, 5])).unwrap();
            let keys = [None, Some(0), Some(7), Some(u64::MAX), Some(99 << 32 | 17)];
            let requests = keys.map(|noise_key| GpuRequest { press: None, noise_key });
            for (key, image) in keys.into_iter().zip(gpu.images(&mut there, &requests).unwrap()) {
                assert!(image.unwrap() == finish(&sensor, None, key), "noise {key:?}");
            }
        }
    }
}

/// More images than the ring holds, of meshes in any order, each in its place.
#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn images_come_back_in_the_order_of_the_requests() {
    let gpu = renderer();
    let sensor = sensor(64, 48, lit());
    let mut there = gpu.sensor(&sensor, &gel(&[11, 5])).unwrap();
    let (meshes, cases) = cases(0.0);
    let on_device: Vec<GpuMesh> = meshes.iter().map(|m| gpu.mesh(m).unwrap()).collect();
    let single = requests(&cases, &on_device, None);
    let alone: Vec<_> = single.iter().map(|r| gpu.images(&mut there, &[*r]).unwrap().remove(0)).collect();
    let n = 5 * there.batch() + 3;
    let place = |i: usize| (i * 7 + i / 5) % cases.len();
    let many: Vec<_> = (0..n).map(|i| single[place(i)]).collect();
    let together = gpu.images(&mut there, &many).unwrap();
    for (i, image) in together.iter().enumerate() {
        assert!(*image == alone[place(i)], "image {i}");
    }
}

#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
fn presses_that_cannot_be_are_the_same_errors() {
    let gpu = renderer();
    let (sensor, gel) = (sensor(160, 120, lit()), gel(&[21, 5]));
    let cpu = Renderer { sensor: &sensor, gel: &gel, level: SimdLevel::best() };
    let mesh = SteppedShaft::default().mesh();
    let there = gpu.mesh(&mesh).unwrap();
    let mut on_device = gpu.sensor(&sensor, &gel).unwrap();
    let middle = touching(&mesh, [0.0; 3], 0.0, 0.0);
    let far = touching(&mesh, [0.0; 3], 0.5, 0.0);
    for (at, force_n) in [(middle, 1e6), (far, 10.0)] {
        let imprint_m3_per_n = 1e-9;
        let press = GpuPress { mesh: &there, gel_from_mesh: at, imprint_m3_per_n, force_n };
        let request = GpuRequest { press: Some(press), noise_key: None };
        let theirs = gpu.images(&mut on_device, &[request]).unwrap().remove(0).unwrap_err();
        let ours = cpu.press(&ClusteredMesh::new(&mesh), &at, imprint_m3_per_n, force_n).unwrap_err();
        assert_eq!(theirs.to_string(), ours.to_string());
    }
}

#[test]
fn a_missing_adapter_is_one_clear_line() {
    let Err(error) = GpuRenderer::new(&AdapterChoice::Named("no such adapter".into())) else {
        panic!("there is none")
    };
    let text = error.to_string();
    assert!(text.starts_with("no adapter is called `no such adapter`; found "), "{text}");
    assert!(!text.contains('\n') && error.hint().contains("backend = \"cpu\""));
}

#[test]
#[cfg_attr(not(vulkan), ignore = "GRIPGEN_VULKAN is not set")]
#[cfg_attr(vulkan, ignore = "slow: kernels on a software driver")]
fn domed_gels_agree_with_the_processor() {
    for colour in [lit(), regression(200), ColourModel::Taxim(Box::new(taxim_table(200, 150)))] {
        let mut domed = sensor(200, 150, colour);
        domed.gel_shape = GelShape::Dome { sag_m: 1e-3 };
        for gpu in both_variants() {
            compare(&gpu, &domed, &gel(&[51, 21, 11, 5]), 0.01);
            let mut there = gpu.sensor(&domed, &gel(&[51, 21, 11, 5])).unwrap();
            let image = gpu.images(&mut there, &[GpuRequest::default()]).unwrap().remove(0).unwrap();
            assert!(image == finish(&domed, None, None), "at rest it shows its rest frame");
        }
    }
}
