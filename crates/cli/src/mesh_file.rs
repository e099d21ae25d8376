//! A mesh from a file.

use gripgen::{LibraryError, Location, ReadFileError};
use gripgen_twin::TriMesh;
use std::path::Path;

/// Why a mesh could not be read.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshFileError {
    /// The file.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// What it holds.
    #[error(transparent)]
    Mesh(#[from] LibraryError),
}

impl MeshFileError {
    /// What to do about it, where there is something to say.
    pub fn hint(&self) -> Option<&'static str> {
        match self {
            MeshFileError::Read(_) => None,
            MeshFileError::Mesh(e) => e.hint(),
        }
    }
}

/// Reads an STL, OBJ, PLY or GLB file.
pub fn read_mesh(path: &Path, metres_per_unit: f64) -> Result<TriMesh, MeshFileError> {
    let location = Location::Disk(path.into());
    let bytes = location.read()?;
    let mesh = TriMesh::from_file_bytes(&bytes, location.extension(), metres_per_unit);
    Ok(mesh.map_err(|source| LibraryError::Mesh { location, source })?)
}
