//! What a graphics processor is asked for and why there is none: the types that are there with and without the feature `gpu`.

use crate::sensor::Sensor;
use gripgen_twin::Gel;
use gripgen_twin::config::GelModel;
use gripgen_twin::frames::Pose;

/// Which adapter to take.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum AdapterChoice {
    /// A graphics processor: discrete before integrated before virtual. Never a software adapter.
    Hardware,
    /// The first adapter whose name contains this, in any case; the only way to a software adapter.
    Named(String),
}

/// What an adapter says of itself.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GpuAdapter {
    /// Its name.
    pub name: String,
    /// `vulkan`, `metal` or `dx12`.
    pub api: String,
    /// Driver and its version.
    pub driver: String,
    /// Whether it computes on the processor.
    pub software: bool,
}

impl std::fmt::Display for GpuAdapter {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let software = if self.software { ", software" } else { "" };
        write!(f, "{} ({}{software})", self.name, self.api)
    }
}

/// Why the graphics processor cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum GpuError {
    /// A build without the feature `gpu`.
    #[error("this gripgen was built without the gpu backend")]
    NotBuilt,
    /// No adapter of the kind wanted.
    #[error("{}; found {}", no_adapter(wanted), if found.is_empty() { "none".into() } else { found.join(", ") })]
    NoAdapter {
        /// What was wanted.
        wanted: AdapterChoice,
        /// What is there.
        found: Vec<String>,
    },
    /// The device or its driver.
    #[error("{adapter}: {problem}")]
    Device {
        /// Which.
        adapter: String,
        /// What it says.
        problem: String,
    },
    /// Something that this backend cannot do.
    #[error("the gpu backend cannot do {what}")]
    Unsupported {
        /// What.
        what: &'static str,
    },
    /// Larger than the device allows.
    #[error("one {what} takes {bytes} bytes, the device binds at most {allowed}")]
    TooLarge {
        /// What.
        what: &'static str,
        /// Its size.
        bytes: u64,
        /// The limit.
        allowed: u64,
    },
    /// A blur kernel for which the memory of a workgroup is too small.
    #[error("a blur kernel of {kernel_px} pixels does not fit the {workgroup_bytes} bytes of a workgroup")]
    Kernel {
        /// Width of the kernel.
        kernel_px: u32,
        /// Memory of a workgroup.
        workgroup_bytes: u32,
    },
}

fn no_adapter(wanted: &AdapterChoice) -> String {
    match wanted {
        AdapterChoice::Hardware => "no graphics processor with Vulkan, Metal or DX12".into(),
        AdapterChoice::Named(name) => format!("no adapter is called `{name}`"),
    }
}

impl GpuError {
    /// What to do about it.
    pub fn hint(&self) -> &'static str {
        match self {
            GpuError::NotBuilt => {
                "the wheel has it, and `cargo build --release --features gpu`; or use backend = \"cpu\""
            }
            GpuError::NoAdapter { wanted: AdapterChoice::Hardware, .. } => {
                "use backend = \"cpu\"; a software adapter is taken when gpu_adapter names it"
            }
            _ => "use backend = \"cpu\"",
        }
    }
}

/// What has no twin on the device.
pub(crate) fn missing(sensor: &Sensor, gel: &Gel) -> Option<&'static str> {
    match gel.model {
        GelModel::Elastic => Some("an elastic gel"),
        _ if gel.stiffens => Some("a gel that stiffens"),
        _ if sensor.markers.is_some() => Some("markers"),
        _ => None,
    }
}

/// Whether a device makes the images of a sensor with its gel. Those of an elastic gel, and of one that stiffens, are the processor's,
/// which solves the contact for the labels in any case; so are those of a gel with markers, which have no twin here yet.
pub fn makes(sensor: &Sensor, gel: &Gel) -> bool {
    missing(sensor, gel).is_none()
}

/// A part pressed into a gel.
#[derive(Clone, Copy)]
pub struct Press<Mesh> {
    /// The part.
    pub mesh: Mesh,
    /// Where it is.
    pub gel_from_mesh: Pose,
    /// Imprint constant c of `V = c F`.
    pub imprint_m3_per_n: f64,
    /// Normal force.
    pub force_n: f64,
}

/// One image to make.
#[derive(Clone, Copy)]
pub struct Request<Mesh> {
    /// The press; the gel at rest without one.
    pub press: Option<Press<Mesh>>,
    /// Which noise; none without a key.
    pub noise_key: Option<u64>,
}

impl<Mesh> Default for Request<Mesh> {
    fn default() -> Self {
        Self { press: None, noise_key: None }
    }
}

/// One image as it comes back.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct GpuImage<'a> {
    /// Red, green, blue of each pixel, row by row.
    pub rgb: &'a [u8],
    /// Largest depth of the contact; 0 without one.
    pub press_depth_m: f64,
}
