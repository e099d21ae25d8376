//! What tests of several stages share.

use crate::colour::{Lambert, Light, TableReading, TaximTable};
use crate::grid::Plane;
use crate::indent::Imprint;
use crate::npz::{Array, ElementType, Npz, write_npz};
use crate::shadow::{ShadowKind, ShadowTable};
use crate::simd::SimdLevel;
use gripgen_twin::config::GelModel;
use gripgen_twin::{Gel, TactileImage};

/// A gel of 4 mm that is blurred.
pub(crate) fn gel(kernels_px: &[u32]) -> Gel {
    Gel {
        model: GelModel::Pyramid,
        elastic: None,
        thickness_m: 4e-3,
        width_m: 28e-3,
        height_m: 21e-3,
        contact_m_per_px: 8.77e-5,
        shear_stiffness_n_per_m: 2e4,
        shear_by_area: 1.0,
        kernels_px: kernels_px.to_vec(),
        restore_depth_fraction: 0.4,
        compliance: 1.0,
        stiffens: false,
        interlock: 0.0,
        interlock_smoothing_m: 3e-4,
    }
}

/// Lights of one elevation and falloff, each with its azimuth in degrees and its colour.
pub(crate) fn lights(elevation_rad: f64, falloff: [f64; 2], lights: &[(f64, [f64; 3])]) -> Lambert {
    let light = |&(azimuth_deg, colour): &(f64, [f64; 3])| Light {
        azimuth_rad: azimuth_deg.to_radians(),
        elevation_rad,
        colour,
        falloff,
    };
    Lambert::from_lights(&lights.iter().map(light).collect::<Vec<_>>())
}

/// Taxim's table of given coefficients of (channel of the file, bin).
pub(crate) fn taxim_table(
    frame: &TactileImage,
    bins: usize,
    coefficients: impl Fn(usize, usize) -> [f64; 6],
) -> TaximTable {
    let channel = |c: usize| {
        let values = (0..bins * bins).flat_map(|k| coefficients(c, k)).collect();
        Array { shape: vec![bins, bins, 6], values }
    };
    let bytes = write_npz(&[
        ("bins", Array { shape: vec![], values: vec![bins as f64] }, ElementType::F64),
        ("grad_r", channel(0), ElementType::F64),
        ("grad_g", channel(1), ElementType::F64),
        ("grad_b", channel(2), ElementType::F64),
    ])
    .unwrap();
    TaximTable::read(&mut Npz::open(&bytes).unwrap(), frame, TableReading::default()).unwrap()
}

/// A shadow table with 63 directions, of the rays of (direction and row, channel).
pub(crate) fn shadow_table(
    kind: ShadowKind,
    heights: usize,
    step_m: f64,
    ray: impl Fn(usize, usize) -> Vec<f32>,
) -> ShadowTable {
    ShadowTable {
        kind,
        directions_rad: (0..63).map(|n| f64::from(n) * 0.1).collect(),
        first_height_m: 0.0,
        height_step_m: 1e-4,
        heights,
        step_m,
        rays: (0..63 * heights).map(|i| [0, 1, 2].map(|c| ray(i, c))).collect(),
    }
}

/// The imprint of a body of these depths that is known at the centres of pixels alone.
pub(crate) fn imprint(depth_px: Plane) -> Imprint {
    let (patch, places) = Default::default();
    let edges = Default::default();
    Imprint { depth_px, edges, press_depth_m: 0.0, lift_m: 0.0, patch, places, elastic: None }
}

/// Every vector unit gives what plain code gives.
#[track_caller]
pub(crate) fn assert_same_on_every_unit<T: PartialEq>(what: &str, run: impl Fn(SimdLevel) -> T) {
    let portable = run(SimdLevel::Portable);
    for level in SimdLevel::available() {
        assert!(run(level) == portable, "{what}, {level:?}");
    }
}

/// The bits of numbers, so that equal means equal to the bit.
pub(crate) fn bits<'a>(values: impl IntoIterator<Item = &'a f32>) -> Vec<u32> {
    values.into_iter().map(|v| v.to_bits()).collect()
}
