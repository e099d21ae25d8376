//! One press of a part into a gel, on any grid: the stages `raster` and `indent`, or those of an elastic gel.

use super::{Imprint, IndentError, Indentation, PressedGel, indent};
use crate::elastic::{Base, ElasticGel, press_elastic};
use crate::grid::{Grid, Plane, added};
use crate::raster::{ClusteredMesh, HeightMap};
use crate::simd::SimdLevel;
use gripgen_twin::Gel;
use gripgen_twin::config::GelModel;
use gripgen_twin::frames::Pose;

/// A gel, and what presses on it.
pub(crate) struct Press<'a> {
    pub(crate) gel: &'a Gel,
    pub(crate) imprint_m3_per_n: f64,
    pub(crate) force_n: f64,
    pub(crate) level: SimdLevel,
}

impl Press<'_> {
    fn pyramid(&self) -> PressedGel {
        PressedGel::of(self.gel, self.imprint_m3_per_n)
    }

    /// Presses a part in. `rest` is the gel's surface without contact, flat without one.
    pub(crate) fn mesh(
        &self,
        map: &mut HeightMap,
        mesh: &ClusteredMesh,
        gel_from_mesh: &Pose,
        grid: &Grid,
        rest: Option<&Plane>,
    ) -> Result<Imprint, IndentError> {
        if elastic_gel(self.gel).is_some() {
            let heights = mesh.raster(gel_from_mesh, grid, reach_px(self.gel, grid, rest));
            return self.heights(&added(heights, rest), grid);
        }
        map.start(mesh, gel_from_mesh, grid);
        let (gel, force_n, level) = (&self.pyramid(), self.force_n, self.level);
        Indentation { grid, gel, force_n, rest, level }.sink(map, mesh)
    }

    /// Presses a height map, in pixels above the gel at rest, in.
    pub(crate) fn heights(&self, heights: &Plane, grid: &Grid) -> Result<Imprint, IndentError> {
        match elastic_gel(self.gel) {
            Some(gel) => press_elastic(heights, grid, &gel, self.force_n, self.level),
            None => indent(heights, grid, &self.pyramid(), self.force_n),
        }
    }
}

/// The gel of a twin that says `elastic`.
fn elastic_gel(gel: &Gel) -> Option<ElasticGel> {
    let elastic = gel.elastic.filter(|_| gel.model == GelModel::Elastic)?;
    Some(ElasticGel {
        thickness_m: gel.thickness_m,
        young_modulus_pa: elastic.young_modulus_pa,
        poisson_ratio: elastic.poisson_ratio,
        base: Base::Bonded,
    })
}

/// How deep below the highest part of a surface another one may lie and still touch the gel: its thickness, and how much the gel's
/// own surface differs at rest.
pub(crate) fn reach_px(gel: &Gel, grid: &Grid, rest_px: Option<&Plane>) -> f64 {
    let lowest = rest_px.map_or(0.0, |rest| rest.values.iter().fold(0.0f32, |m, &h| m.min(h)));
    let highest = rest_px.map_or(0.0, |rest| rest.values.iter().fold(0.0f32, |m, &h| m.max(h)));
    gel.thickness_m / grid.metres_per_px + f64::from(highest - lowest)
}
