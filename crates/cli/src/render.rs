//! The image of any mesh, or of any surface, that is pressed into a sensor.

use crate::mesh_file::{MeshFileError, read_mesh};
use gripgen::{Location, ReadFileError};
use gripgen_tactile::npz::{Array, parse_npy};
use gripgen_tactile::presses::{
    HeightsError, Indenter, IndenterError, IndenterPose, RenderedBody, render_body, render_heights,
};
use gripgen_tactile::{Grid, Sensor};
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// How something is pressed in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RenderOptions {
    /// Travel after first contact. A mesh needs one; of heights the highest is the travel where it is left out.
    pub travel_m: Option<f64>,
    /// Place of a mesh's origin, columns from the centre of the first pixel; the middle of the image where it is left out.
    pub x_px: Option<f64>,
    /// Place of a mesh's origin, rows from the centre of the first pixel.
    pub y_px: Option<f64>,
    /// Turn of a mesh, counter-clockwise in the image.
    pub rotation_rad: f64,
    /// Radius of the convex edges of a mesh; 0 leaves them sharp.
    pub edge_radius_m: f64,
    /// Size of the unit of a mesh, or of heights.
    pub metres_per_unit: f64,
}

impl RenderOptions {
    /// Where a mesh is in an image of `grid`.
    pub fn pose(&self, grid: &Grid) -> IndenterPose {
        let middle = IndenterPose::middle_of(grid);
        IndenterPose {
            x_px: self.x_px.unwrap_or(middle.x_px),
            y_px: self.y_px.unwrap_or(middle.y_px),
            rotation_rad: self.rotation_rad,
        }
    }
}

/// Whether a path to render is one of heights.
pub fn is_height_map(path: &Path) -> bool {
    path.extension().is_some_and(|e| e.eq_ignore_ascii_case("npy"))
}

/// Why something could not be rendered.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RenderError {
    /// The mesh.
    #[error(transparent)]
    Mesh(#[from] MeshFileError),
    /// Where it is.
    #[error("{}: {source}", .path.display())]
    Body {
        /// The mesh.
        path: PathBuf,
        /// What is wrong.
        source: IndenterError,
    },
    /// Nobody said how far a mesh travels.
    #[error("{}: it is not said how far the mesh travels after first contact", .path.display())]
    NoTravel {
        /// The mesh.
        path: PathBuf,
    },
    /// The file of the heights.
    #[error(transparent)]
    Read(#[from] ReadFileError),
    /// What it holds.
    #[error("{}: {problem}", .path.display())]
    Npy {
        /// The file.
        path: PathBuf,
        /// What is wrong.
        problem: String,
    },
    /// Heights that are turned or moved.
    #[error("heights stand where they are in the image: they have no place and no turn")]
    Placed,
    /// The heights.
    #[error("{}{source}", .path.as_ref().map_or(String::new(), |path| format!("{}: ", path.display())))]
    Heights {
        /// The file, where they are from one.
        path: Option<PathBuf>,
        /// What is wrong.
        source: HeightsError,
    },
}

/// Presses what a file holds into a sensor and looks at it: a mesh (STL, OBJ, PLY, GLB), or heights of a surface above the gel at rest
/// (`.npy`, rows and columns of the sensor's image).
///
/// # Errors
/// A file that cannot be read, a mesh that the image does not show, heights of another size, or a travel that cannot be.
pub fn render_file(
    path: &Path,
    options: &RenderOptions,
    sensor: &Sensor,
) -> Result<RenderedBody, RenderError> {
    if is_height_map(path) {
        let heights = parse_npy(&Location::Disk(path.into()).read()?)
            .map_err(|problem| RenderError::Npy { path: path.into(), problem })?;
        return render_surface(heights, options, sensor).map_err(|e| match e {
            RenderError::Heights { source, .. } => RenderError::Heights { path: Some(path.into()), source },
            other => other,
        });
    }
    let mesh = read_mesh(path, options.metres_per_unit)?;
    let travel_m = options.travel_m.ok_or_else(|| RenderError::NoTravel { path: path.into() })?;
    let name = path.file_stem().map_or_else(|| "mesh".into(), |stem| stem.to_string_lossy());
    let indenter = Indenter::of_mesh(&name, &mesh, options.pose(&sensor.grid), travel_m, &sensor.grid)
        .map_err(|source| RenderError::Body { path: path.into(), source })?
        .with_edge_radius(options.edge_radius_m, &sensor.grid);
    Ok(render_body(&Arc::new(indenter), sensor))
}

/// The same of heights in units of `options` above the gel at rest (rows, columns).
///
/// # Errors
/// Heights of another size than the image, ones that are no numbers, a place or a turn, or a travel that cannot be.
pub fn render_surface(
    mut heights: Array,
    options: &RenderOptions,
    sensor: &Sensor,
) -> Result<RenderedBody, RenderError> {
    if options.x_px.is_some() || options.y_px.is_some() || options.rotation_rad != 0.0 {
        return Err(RenderError::Placed);
    }
    heights.values.iter_mut().for_each(|height| *height *= options.metres_per_unit);
    render_heights(&heights, options.travel_m, sensor)
        .map_err(|source| RenderError::Heights { path: None, source })
}
