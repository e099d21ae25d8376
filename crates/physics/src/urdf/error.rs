//! What can be wrong with a URDF.

/// A URDF that is no arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum UrdfError {
    /// Not well-formed, or an element is missing or of a type that URDF does not have.
    #[error("the URDF cannot be read: {0}")]
    Syntax(String),
    /// The tip is not among the links.
    #[error("no link `{tip}`; the links are {links}")]
    NoTip {
        /// Link asked for.
        tip: String,
        /// Links there are.
        links: String,
    },
    /// A joint on the chain is neither fixed nor revolute.
    #[error(
        "joint `{joint}` between base and `{tip}` is {kind}; only revolute, continuous and fixed joints are supported"
    )]
    JointKind {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
        /// End of the chain.
        tip: String,
    },
    /// A link hangs on two joints.
    #[error("link `{link}` is the child of both `{first}` and `{second}`")]
    TwoParents {
        /// The link.
        link: String,
        /// One joint.
        first: String,
        /// The other.
        second: String,
    },
    /// Following the parents of the tip comes back to where it was.
    #[error("link `{link}` is its own ancestor")]
    Cycle {
        /// A link of the cycle.
        link: String,
    },
    /// Something besides the chain moves.
    #[error(
        "joint `{joint}` ({kind}) branches off the arm at link `{link}`; only fixed branches are supported"
    )]
    MovingBranch {
        /// The joint.
        joint: String,
        /// Its type.
        kind: &'static str,
        /// Where it branches off.
        link: String,
    },
    /// A joint moves nothing that has a mass.
    #[error("link `{link}`, moved by joint `{joint}`, has no <inertial> with a positive mass: {mass_kg} kg")]
    NoInertial {
        /// The link.
        link: String,
        /// The joint.
        joint: String,
        /// Mass of the link with all that is fixed to it.
        mass_kg: f64,
    },
    /// An inertia tensor that no body has.
    #[error("the inertia of link `{link}` has principal moments {moments:?} kg m2; all have to be positive")]
    Inertia {
        /// The link.
        link: String,
        /// Its principal moments.
        moments: [f64; 3],
    },
    /// A number that is none.
    #[error("{what} of `{of}` is {value}")]
    NotFinite {
        /// Which number.
        what: &'static str,
        /// Joint or link.
        of: String,
        /// The value.
        value: f64,
    },
    /// An axis without direction.
    #[error("the axis of joint `{joint}` has length {length}")]
    Axis {
        /// The joint.
        joint: String,
        /// Length of the axis.
        length: f64,
    },
    /// Limits the wrong way round.
    #[error("joint `{joint}` has its lower limit {lower_rad} above its upper limit {upper_rad}")]
    Limits {
        /// The joint.
        joint: String,
        /// Lower limit.
        lower_rad: f64,
        /// Upper limit.
        upper_rad: f64,
    },
    /// No joint between base and tip.
    #[error("no revolute joint between base and `{tip}`")]
    NoJoints {
        /// End of the chain.
        tip: String,
    },
    /// The resolver does not know a mesh.
    #[error("mesh `{mesh}` of link `{link}` was not found")]
    Mesh {
        /// What the URDF calls it.
        mesh: String,
        /// The link.
        link: String,
    },
}
