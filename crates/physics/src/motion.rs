//! What a time step of either mechanics tells.

/// The plant after a time step.
pub(crate) struct Motion {
    pub(crate) contact_force_n: f64,
    pub(crate) displacement_m: f64,
    pub(crate) speed_m_per_s: f64,
    pub(crate) sliding: bool,
}
