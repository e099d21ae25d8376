//! The image of any mesh that is pressed into a sensor.

use crate::mesh_file::{MeshFileError, read_mesh};
use gripgen_tactile::Sensor;
use gripgen_tactile::presses::{Indenter, IndenterError, IndenterPose, RenderedBody, render_body};
use std::path::Path;
use std::sync::Arc;

/// Why a mesh could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// Where it is.
    #[error(transparent)]
    Body(#[from] IndenterError),
}

/// Presses the mesh of a file into a sensor, `travel_m` after first contact, and looks at it. `metres_per_unit` is the size of
/// the file's unit.
///
/// # Errors
/// A mesh that cannot be read, that the image does not show, or that travels nothing or more than 10 mm.
pub fn render_mesh(
    path: &Path,
    metres_per_unit: f64,
    at: IndenterPose,
    travel_m: f64,
    sensor: &Sensor,
) -> Result<RenderedBody, RenderError> {
    let mesh = read_mesh(path, metres_per_unit)?;
    let name = path.file_stem().map_or_else(|| "mesh".into(), |stem| stem.to_string_lossy());
    let indenter = Indenter::of_mesh(&name, &mesh, at, travel_m, &sensor.grid)?;
    Ok(render_body(&Arc::new(indenter), sensor))
}
