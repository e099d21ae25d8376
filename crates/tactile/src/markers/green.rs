//! How a force on a bonded elastic layer moves points of it sideways.

use crate::layer::{InPlane, REACH, cubic, in_plane};
use std::f64::consts::PI;
use std::sync::{Arc, Mutex};

/// Values of the tables to a thickness.
const PER_THICKNESS: usize = 24;

/// What a rigid base changes of the displacements in a half-space, by distance in thicknesses.
///
/// Columns: outwards from a pressure; isotropic and two-fold part from a shear. Functions of Poisson's ratio and of
/// the depth of the markers over the thickness only.
#[derive(Debug)]
struct BaseTable {
    key: [u64; 2],
    values: Vec<[f64; 3]>,
}

impl BaseTable {
    fn new(poisson_ratio: f64, depth: f64) -> Self {
        // Hankel transforms of the layer's displacements less the half-space's, which decay as exp(-x (2 - depth)).
        let (end, half) = (16.0, 270);
        let step = end / (2 * half) as f64;
        let difference: Vec<[f64; 3]> = (0..=2 * half)
            .map(|i| {
                let x = i as f64 * step;
                let (layer, deep) = (in_plane(x, depth, poisson_ratio), half_space(x, depth, poisson_ratio));
                let (along, across) = (layer.along - deep.along, layer.across - deep.across);
                let weight = step / 3.0 * if i == 0 || i == 2 * half { 1.0 } else { [2.0, 4.0][i % 2] };
                [layer.normal - deep.normal, 0.5 * (along + across), 0.5 * (along - across)]
                    .map(|v| weight * v)
            })
            .collect();
        let count = (REACH * PER_THICKNESS as f64) as usize + 4;
        let values = (0..count).map(|j| {
            let rho = j as f64 / PER_THICKNESS as f64;
            let mut sum = [0.0; 3];
            for (i, d) in difference.iter().enumerate() {
                let z = i as f64 * step * rho;
                let (j0, j1) = (libm::j0(z), libm::j1(z));
                let j2 = if z < 1e-3 { 0.125 * z * z } else { 2.0 * j1 / z - j0 };
                sum = [sum[0] + d[0] * j1, sum[1] + d[1] * j0, sum[2] - d[2] * j2];
            }
            sum
        });
        Self { key: [poisson_ratio.to_bits(), depth.to_bits()], values: values.collect() }
    }

    /// The table, which takes about 10 ms to compute, kept for the gels used last.
    fn shared(poisson_ratio: f64, depth: f64) -> Arc<Self> {
        static KEPT: Mutex<Vec<Arc<BaseTable>>> = Mutex::new(Vec::new());
        let key = [poisson_ratio.to_bits(), depth.to_bits()];
        let kept = |tables: &Vec<Arc<BaseTable>>| tables.iter().find(|t| t.key == key).cloned();
        let lock = || KEPT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
        if let Some(table) = kept(&lock()) {
            return table;
        }
        let table = Arc::new(Self::new(poisson_ratio, depth));
        let mut tables = lock();
        if tables.len() >= 8 {
            tables.remove(0);
        }
        tables.push(table.clone());
        table
    }

    fn at(&self, rho: f64) -> [f64; 3] {
        let x = rho * PER_THICKNESS as f64;
        let i = (x as usize).min(self.values.len() - 3);
        // Even and odd functions of the distance; the first column is odd.
        let before = if i == 0 {
            let v = self.values[1];
            [-v[0], v[1], v[2]]
        } else {
            self.values[i - 1]
        };
        let four = [before, self.values[i], self.values[i + 1], self.values[i + 2]];
        [0, 1, 2].map(|c| cubic(four.map(|v| v[c]), x - i as f64))
    }
}

/// The half-space's displacements, as [`in_plane`] gives the layer's (Johnson 1985, section 3.2, in waves).
fn half_space(x: f64, depth: f64, nu: f64) -> InPlane {
    let (decay, xd) = (libm::exp(-x * depth), x * depth);
    InPlane {
        normal: -0.5 * ((1.0 - 2.0 * nu) - xd) * decay,
        along: ((1.0 - nu) - 0.5 * xd) * decay,
        across: decay,
    }
}

/// The gel as far as markers are concerned.
#[derive(Debug, Clone)]
pub struct MarkerGel {
    thickness_m: f64,
    /// Depth of the markers below the surface.
    depth_m: f64,
    poisson_ratio: f64,
    shear_modulus_pa: f64,
    table: Arc<BaseTable>,
}

/// A force on a round spot.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Load {
    normal: f64,
    tangential: [f64; 2],
    /// Softens the load: as high a displacement in its middle as that of a disc of the same area.
    soft_m: f64,
}

impl MarkerGel {
    /// A layer of `thickness_m` bonded to a rigid base, with markers `depth_m` below its surface.
    pub fn new(thickness_m: f64, young_modulus_pa: f64, poisson_ratio: f64, depth_m: f64) -> Self {
        Self {
            thickness_m,
            depth_m,
            poisson_ratio,
            shear_modulus_pa: young_modulus_pa / (2.0 * (1.0 + poisson_ratio)),
            table: BaseTable::shared(poisson_ratio, depth_m / thickness_m),
        }
    }

    /// A force on a spot of `area_m2`.
    pub(crate) fn load(&self, normal_n: f64, tangential_n: [f64; 2], area_m2: f64) -> Load {
        let scale = 1.0 / (2.0 * PI * self.shear_modulus_pa);
        Load {
            normal: scale * normal_n,
            tangential: tangential_n.map(|q| scale * q),
            soft_m: 0.5 * (area_m2 / PI).sqrt().max(1e-9),
        }
    }

    /// Displacement at `(x_m, y_m)` from the middle of the load.
    ///
    /// Half-space: Boussinesq and Cerruti (Johnson 1985, eqs. 3.19 and 3.77) at depth z + e, with e the softening of
    /// the load: the force is spread as `e / (r^2 + e^2)^1.5`. Then the table of what the base changes.
    pub(crate) fn displacement_m(&self, load: &Load, x_m: f64, y_m: f64) -> [f64; 2] {
        let (e, z, nu) = (load.soft_m, self.depth_m, self.poisson_ratio);
        let r2 = x_m * x_m + y_m * y_m;
        let depth = e + z;
        let r = r2.sqrt();
        let s = (r2 + depth * depth).sqrt();
        let s3 = s * s * s;
        // Integrals of J0, J1 and J2 with exp(-k depth), and with k exp(-k depth).
        let w = r / (s + depth);
        let (i0, i1, i2) = (1.0 / s, w / s, w * w / s);
        let (k0, k1, k2) = (depth / s3, r / s3, w * w * (2.0 * s + depth) / s3);
        let mut outwards = -0.5 * ((1.0 - 2.0 * nu) * i1 - z * k1);
        // Mean and half difference of along and across.
        let mut isotropic = 0.5 * ((2.0 - nu) * i0 - 0.5 * z * k0);
        let mut twofold = 0.5 * (nu * i2 + 0.5 * z * k2);
        let rho = r / self.thickness_m;
        if rho < REACH {
            let [a, b, c] = self.table.at(rho);
            outwards += a / self.thickness_m;
            isotropic += b / self.thickness_m;
            twofold += c / self.thickness_m;
        } else {
            // Beyond the reach a layer rests.
            (outwards, isotropic, twofold) = (0.0, 0.0, 0.0);
        }
        let (ex, ey) = if r > 0.0 { (x_m / r, y_m / r) } else { (0.0, 0.0) };
        let (c2, s2) = (ex * ex - ey * ey, 2.0 * ex * ey);
        let [qx, qy] = load.tangential;
        [
            load.normal * outwards * ex + isotropic * qx + twofold * (c2 * qx + s2 * qy),
            load.normal * outwards * ey + isotropic * qy + twofold * (s2 * qx - c2 * qy),
        ]
    }
}
