//! What the optics effects of a twin change in the images of one jaw: numbers only, `tactile` makes pixels of them.

/// Terms of a background pattern: `u, v, u^2, u v, v^2`.
pub const BACKGROUND_TERMS: usize = 5;

/// Degrees (i, j) in u and v of the finer terms of a background pattern, `P_i(u) P_j(v)` of Legendre polynomials.
#[rustfmt::skip]
pub const FINER_TERMS: [(usize, usize); 22] = [
    (3, 0), (2, 1), (1, 2), (0, 3),
    (4, 0), (3, 1), (2, 2), (1, 3), (0, 4),
    (5, 0), (4, 1), (3, 2), (2, 3), (1, 4), (0, 5),
    (6, 0), (5, 1), (4, 2), (3, 3), (2, 4), (1, 5), (0, 6),
];

/// One sensor against its file: what the camera, its light, the gel and the part's surface do that the file and the
/// mesh do not say. The default is neutral and leaves every pixel as it is.
///
/// Colours are in the order red, green, blue, in grey levels of 0 to 255; lengths are on the gel. How pixels follow
/// from it, and in which order, stands in `docs/model.md`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OpticsState {
    /// Factor on the light of each channel, at least 0.
    pub light_gain: [f64; 3],
    /// Coefficients of a pattern that is added to each channel, in grey levels: `u, v, u^2, u v, v^2`, each with mean 0
    /// over the frame; u and v run from -1 to 1 along the rows and columns.
    pub background: [[f64; BACKGROUND_TERMS]; 3],
    /// Coefficients of the same for [`FINER_TERMS`], each with mean 0 over the frame.
    pub finer_background: [[f64; FINER_TERMS.len()]; 3],
    /// Factor on what reaches the camera, all channels.
    pub exposure_gain: f64,
    /// Exponent of the camera's response, all channels.
    pub gamma: f64,
    /// How far the contact lies to the right and below of where it is thought to be.
    pub shift_m: [f64; 2],
    /// How far the contact is turned about the middle of the image, from +x (right) to +y (down).
    pub rotation_rad: f64,
    /// How much larger the contact is in the image than it is thought to be.
    pub scale: f64,
    /// Radial distortion: at `r` half widths from the middle is seen what lies at `r (1 + k1 r^2)`.
    pub distortion_k1: f64,
    /// How much of the way the frame at rest moves along with the contact: 0 if part or marks lie elsewhere, 1 if the camera does.
    pub frame_moves: f64,
    /// Standard deviation of the blur of what a contact changes in the image.
    pub defocus_m: f64,
    /// Factor on the sizes of the kernels that deform the gel.
    pub kernel_scale: f64,
    /// How far the part's outlines lie outside those of its mesh.
    pub part_offset_m: f64,
    /// Standard deviation of the smoothing that blunts the part's convex edges.
    pub edge_blunting_m: f64,
    /// Constant that is added to each channel where there is a contact in front of the camera, in grey levels.
    pub rest_offset: [f64; 3],
    /// Share of a channel's brightness that is missing in a full shadow.
    pub shadow_strength: f64,
    /// Elevation of the lights above the gel, as far as it decides the length of the shadows.
    pub light_elevation_rad: f64,
    /// How much deeper the corners of the gel lie below its apex, seen from the part.
    pub dome_sag_m: f64,
    /// Depth of the press over the one it is thought to be, before [`OpticsState::press_offset_m`].
    pub press_factor: f64,
    /// How much deeper the press is beyond that.
    pub press_offset_m: f64,
    /// Radius of the part's convex edges.
    pub edge_rounding_m: f64,
    /// Root of the mean square of the relief of the part's surface.
    pub relief_m: f64,
    /// Tells the reliefs of parts apart; 0 without one.
    pub relief_key: u64,
}

impl Default for OpticsState {
    fn default() -> Self {
        Self {
            light_gain: [1.0; 3],
            background: [[0.0; BACKGROUND_TERMS]; 3],
            finer_background: [[0.0; FINER_TERMS.len()]; 3],
            exposure_gain: 1.0,
            gamma: 1.0,
            shift_m: [0.0; 2],
            rotation_rad: 0.0,
            scale: 1.0,
            distortion_k1: 0.0,
            frame_moves: 0.0,
            defocus_m: 0.0,
            kernel_scale: 1.0,
            part_offset_m: 0.0,
            edge_blunting_m: 0.0,
            rest_offset: [0.0; 3],
            shadow_strength: 0.0,
            light_elevation_rad: std::f64::consts::FRAC_PI_6,
            dome_sag_m: 0.0,
            press_factor: 1.0,
            press_offset_m: 0.0,
            edge_rounding_m: 0.0,
            relief_m: 0.0,
            relief_key: 0,
        }
    }
}

impl OpticsState {
    /// Whether no pixel differs from what the sensor file and the mesh say.
    pub fn is_neutral(&self) -> bool {
        *self == Self { light_elevation_rad: self.light_elevation_rad, ..Self::default() }
    }

    /// Whether the part is pressed into another gel: the image needs an imprint of its own.
    pub fn changes_press(&self) -> bool {
        self.dome_sag_m != 0.0 || self.edge_rounding_m != 0.0 || self.changes_depth()
    }

    /// Whether the press is deeper or less deep than it is thought to be.
    pub fn changes_depth(&self) -> bool {
        self.press_factor != 1.0 || self.press_offset_m != 0.0
    }

    /// The depth of a press that is thought to be `depth_m` deep, never negative.
    pub fn press_depth_m(&self, depth_m: f64) -> f64 {
        (self.press_factor * depth_m + self.press_offset_m).max(0.0)
    }

    /// Whether the gel surface is seen in another shape or place than a plain press gives it.
    pub fn changes_surface(&self) -> bool {
        self.changes_press()
            || self.kernel_scale != 1.0
            || self.part_offset_m != 0.0
            || self.edge_blunting_m != 0.0
            || self.moves_contact()
    }

    /// Whether the contact is seen elsewhere in the image.
    pub fn moves_contact(&self) -> bool {
        self.shift_m != [0.0; 2] || self.rotation_rad != 0.0 || self.scale != 1.0 || self.distortion_k1 != 0.0
    }

    /// Whether the frame at rest is seen elsewhere, too.
    pub fn moves_frame(&self) -> bool {
        self.frame_moves != 0.0 && self.moves_contact()
    }

    /// Whether light or camera act on the whole frame, with and without contact.
    pub fn changes_frame(&self) -> bool {
        self.moves_frame()
            || self.light_gain != [1.0; 3]
            || self.background != [[0.0; BACKGROUND_TERMS]; 3]
            || self.finer_background != [[0.0; FINER_TERMS.len()]; 3]
            || self.exposure_gain != 1.0
            || self.gamma != 1.0
    }
}
