//! The deformation against Taxim's own, on its domed gel.

use crate::common::root;
use gripgen::tactile::npz::Npz;
use gripgen::tactile::{BlurredRest, Imprint, Plane, SimdLevel, deform};
use gripgen::twin::ContactPatch;

/// Kernels of Taxim's `params.py` at 640 x 480, and its millimetres per pixel.
const KERNELS_PX: [u32; 6] = [201, 101, 51, 21, 11, 5];
const MM_PER_PX: f64 = 0.0295;

fn reference(name: &str) -> Vec<u8> {
    std::fs::read(root().join("../shared/real/taxim/reference").join(name)).unwrap()
}

fn plane(bytes: &[u8], key: &str) -> Plane {
    let array = Npz::open(bytes).unwrap().array(key).unwrap();
    let values = array.values.iter().map(|&v| v as f32).collect();
    Plane { width: array.shape[1], height: array.shape[0], values }
}

/// Bits of numpy's `packbits`, the first pixel in the highest one.
fn mask(bytes: &[u8], key: &str) -> Vec<bool> {
    let packed = Npz::open(bytes).unwrap().array(key).unwrap().values;
    packed.iter().flat_map(|&byte| (0..8).map(move |bit| byte as u8 & (0x80 >> bit) != 0)).collect()
}

/// `z0 - gel'` goes in, `H - gel'` has to come out; `gel'` is the pad at rest, 0 at its apex and growing towards the
/// camera.
#[test]
#[cfg_attr(not(shared_data), ignore = "the folder of shared measured data is not beside this checkout")]
fn heights_on_a_dome_are_taxims() {
    let gel = plane(&reference("rest.npz"), "gel");
    let rest_px = Plane { values: gel.values.iter().map(|&g| -g).collect(), ..gel.clone() };
    for scene in ["press03_dome.npz", "shaft20_dome.npz"] {
        let bytes = reference(scene);
        let (z0, deformed) = (plane(&bytes, "z0"), plane(&bytes, "H"));
        let press_mm = Npz::open(&bytes).unwrap().array("press_mm").unwrap().values[0];
        let (contact, core) = (mask(&bytes, "contact0"), mask(&bytes, "mask"));
        let pixels = gel.values.len();
        for i in (0..pixels).filter(|&i| !contact[i]) {
            assert_eq!(z0.values[i], gel.values[i], "{scene}: outside the contact z0 is the pad");
        }
        let depth: Vec<f32> = (0..pixels)
            .map(|i| if contact[i] { (z0.values[i] - gel.values[i]).max(0.0) } else { 0.0 })
            .collect();
        let imprint = Imprint {
            depth_px: Plane { values: depth, ..z0.clone() },
            edges: Default::default(),
            press_depth_m: press_mm * 1e-3,
            lift_m: 0.0,
            patch: ContactPatch::default(),
            places: Default::default(),
            elastic: None,
        };
        let threshold = 0.4 * press_mm / MM_PER_PX;
        let other =
            (0..pixels).filter(|&i| core[i] != (f64::from(imprint.depth_px.values[i]) > threshold)).count();
        assert_eq!(other, 0, "{scene}: the restored core is Taxim's mask");
        let furthest = |ours: &Plane| {
            (0..pixels)
                .map(|i| f64::from(ours.values[i]) + f64::from(gel.values[i]) - f64::from(deformed.values[i]))
                .fold(0.0, |most: f64, d| most.max(d.abs()))
        };
        for level in SimdLevel::available() {
            let blurred = BlurredRest::new(&rest_px, &KERNELS_PX, level);
            let run = |rest| deform(&imprint, &KERNELS_PX, 0.4, MM_PER_PX * 1e-3, rest, level);
            let difference = furthest(&run(Some(&blurred)));
            assert!(difference < 1e-4, "{scene}, {level:?}: {difference} px");
            assert!(furthest(&run(None)) > 0.1, "{scene}: a flat gel has other heights");
        }
    }
}
