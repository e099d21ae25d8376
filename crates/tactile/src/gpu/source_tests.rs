//! Every WGSL source that can be generated, without an adapter. Whether it computes the right thing is for `tests.rs`.

use super::source::{self, Axis, Blur, Ceiling, Restored, Sampling, Shade, Step, Variant};
use crate::convolve::Follow;
use wgpu::naga;

const VARIANTS: [Variant; 3] = [Variant::Texture { run: 16 }, Variant::Texture { run: 40 }, Variant::Tile];

/// The kernels of the shipped twins, Taxim's at 640 x 480, and the smallest and largest that a twin may name.
const KERNELS_PX: [u32; 12] = [3, 5, 7, 11, 21, 31, 51, 71, 101, 151, 201, 255];

fn validate(what: &str, source: &str) -> naga::Module {
    let module = naga::front::wgsl::parse_str(source)
        .unwrap_or_else(|e| panic!("{what}: {}", e.emit_to_string(source)));
    let mut validator =
        naga::valid::Validator::new(naga::valid::ValidationFlags::all(), naga::valid::Capabilities::empty());
    if let Err(e) = validator.validate(&module) {
        panic!("{what}: {}", e.emit_to_string(source));
    }
    module
}

/// Bytes of workgroup memory.
fn workgroup_bytes(module: &naga::Module) -> u32 {
    let mut layouter = naga::proc::Layouter::default();
    layouter.update(module.to_ctx()).unwrap();
    let shared = module.global_variables.iter().filter(|(_, v)| v.space == naga::AddressSpace::WorkGroup);
    shared.map(|(_, v)| layouter[v.ty].size).sum()
}

fn no_markers(source: &str) {
    assert!(!source.contains("/*") && !source.contains("//#"), "{source}");
}

#[test]
fn every_stage_validates() {
    for sampling in [Sampling::Centres, Sampling::Points] {
        let raster = source::raster(sampling);
        no_markers(&raster);
        let raster = validate("raster", &raster);
        // The least that WebGPU allows.
        assert!(workgroup_bytes(&raster) <= 16_384, "{} bytes", workgroup_bytes(&raster));
    }
    validate("blur of shadows", &source::shadow_blur());
    for variant in VARIANTS {
        for sampling in [Sampling::Centres, Sampling::Points] {
            for threads in [256, 1024] {
                let indent = source::indent(variant, sampling, threads);
                no_markers(&indent);
                assert!(workgroup_bytes(&validate("indent", &indent)) <= 16_384);
            }
        }
        validate("steps", &source::steps(variant));
        validate("core", &source::core(variant));
        for (shade, domed) in [
            (Shade::Lambert, false),
            (Shade::Lambert, true),
            (Shade::Taxim, false),
            (Shade::Taxim, true),
            (Shade::Regressor, false),
        ] {
            let kinds = [Ceiling::Added, Ceiling::Relative, Ceiling::Taxim];
            for shadows in kinds.into_iter().map(Some).chain([None]) {
                let image = source::image(variant, shade, domed, shadows);
                no_markers(&image);
                validate("image", &image);
            }
            for kind in kinds {
                let merge = source::shadow_merge(variant, shade, domed, kind);
                no_markers(&merge);
                validate("merge", &merge);
            }
            let rays = source::shadow_rays(variant, domed);
            no_markers(&rays);
            assert!(workgroup_bytes(&validate("rays", &rays)) <= 16_384);
        }
        let smooth = (0..4).flat_map(|level| [Axis::X, Axis::Y].map(|axis| Step::Smooth(level, axis)));
        let others =
            [Step::Average, Step::Differentiate(2), Step::Differentiate(3), Step::Coarse, Step::Fine];
        for step in smooth.chain(others) {
            let source = source::around(variant, step);
            no_markers(&source);
            let module = validate("surroundings", &source);
            assert!(module.entry_points.iter().any(|e| e.name == step.entry_point()));
        }
    }
}

#[test]
fn every_blur_validates_and_fits_the_workgroup_memory() {
    for variant in VARIANTS {
        for kernel_px in KERNELS_PX {
            for axis in [Axis::X, Axis::Y] {
                for (restore, lifted) in [
                    (Some(Restored::Whole), false),
                    (Some(Restored::Share(Follow::Exactly)), false),
                    (Some(Restored::Share(Follow::AtLeast)), false),
                    (None, false),
                    (Some(Restored::Whole), true),
                    (None, true),
                ] {
                    for bytes in [16_384, 32_768, 49_152] {
                        let blur = Blur { kernel_px, axis, restore, lifted, reach_px: [35, kernel_px] };
                        let what = format!("{variant:?} {blur:?} {bytes}");
                        let (source, shape) =
                            source::blur(variant, blur, bytes).unwrap_or_else(|| panic!("{what}: no tile"));
                        no_markers(&source);
                        let used = workgroup_bytes(&validate(&what, &source));
                        assert!(used <= bytes, "{what}: {used} bytes");
                        assert!(shape.span > 0 && shape.lines > 0);
                        if matches!(variant, Variant::Texture { .. }) {
                            break;
                        }
                    }
                }
            }
        }
    }
}

#[test]
fn a_tile_that_fits_nowhere_is_refused() {
    let blur = Blur {
        kernel_px: 71,
        axis: Axis::X,
        restore: Some(Restored::Share(Follow::AtLeast)),
        lifted: false,
        reach_px: [35, 35],
    };
    assert_eq!(source::blur(Variant::Tile, blur, 1024), None);
}
