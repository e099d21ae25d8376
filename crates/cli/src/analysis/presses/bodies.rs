//! Bodies that are pressed into a sensor, from their meshes.

use super::LoadPressesError;
use crate::mesh_file::read_mesh;
use gripgen_measured::PressedBody;
use gripgen_tactile::Grid;
use gripgen_tactile::presses::{Indenter, IndenterPose, USUAL_EDGE_RADIUS_M};
use gripgen_twin::{TactileImage, TriMesh, usual_scale_mm_per_unit};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// The bodies of a folder; each mesh is read once.
pub(super) struct PressBodies {
    folder: PathBuf,
    metres_per_px: f64,
    meshes: BTreeMap<String, TriMesh>,
}

impl PressBodies {
    pub(super) fn new(folder: &Path, metres_per_px: f64) -> Self {
        Self { folder: folder.into(), metres_per_px, meshes: BTreeMap::new() }
    }

    /// A body at its place in an image, `travel_m` after first contact.
    pub(super) fn indenter(
        &mut self,
        body: &PressedBody,
        at: IndenterPose,
        travel_m: f64,
        image: &TactileImage,
    ) -> Result<Arc<Indenter>, LoadPressesError> {
        let grid = Grid {
            width_px: image.width_px as usize,
            height_px: image.height_px as usize,
            metres_per_px: self.metres_per_px,
        };
        if !self.meshes.contains_key(&body.mesh) {
            let path = self.folder.join(&body.mesh);
            let extension = path.extension().unwrap_or_default().to_string_lossy();
            let mesh = read_mesh(&path, usual_scale_mm_per_unit(&extension) * 1e-3)?;
            self.meshes.insert(body.mesh.clone(), mesh);
        }
        let indenter = Indenter::of_mesh(&body.shape, &self.meshes[&body.mesh], at, travel_m, &grid);
        let indenter =
            indenter.map_err(|source| LoadPressesError::Body { path: self.folder.clone(), source })?;
        let radius_m = body.edge_radius_m.unwrap_or(USUAL_EDGE_RADIUS_M);
        Ok(Arc::new(indenter.with_edge_radius(radius_m, &grid)))
    }
}
