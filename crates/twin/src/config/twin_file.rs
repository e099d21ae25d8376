//! The structs that mirror `twin.toml`.

use crate::effects::{OutsideFit, Per};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A twin: the rig, its gels and sensors, the parts, and the effects that act.
///
/// Keys left out of `robot`, `gripper`, `wrist`, `gel` and `optics` are those of the shipped baseline twin.
/// Paths are relative to this file; `asset:...` names a file inside gripgen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TwinFile {
    /// Format of the file, `gripgen.twin/1`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub schema: Option<String>,
    /// The arm and its force loop.
    pub robot: RobotFile,
    /// The gripper.
    pub gripper: GripperFile,
    /// The wrist force sensor.
    pub wrist: WristFile,
    /// The gel of each jaw; keys of `right` that are left out are those of `left`.
    pub gel: PerJawFile<GelFile>,
    /// The tactile sensor of each jaw; keys of `right` that are left out are those of `left`.
    pub optics: PerJawFile<OpticsFile>,
    /// The parts by name.
    #[serde(default)]
    pub parts: BTreeMap<String, PartFile>,
    /// Effects that act beyond the baseline.
    #[serde(default)]
    pub effects: Vec<EffectFile>,
}

/// A section for each jaw.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PerJawFile<T> {
    /// The left jaw.
    pub left: T,
    /// The right jaw; keys that are left out are those of the left one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub right: Option<T>,
}

/// Which model of the arm.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum RobotModel {
    /// The gripper hangs on a carriage that moves along the pull; the arm is its mass and its force loop.
    Carriage,
    /// The arm of `[robot.arm]`, link by link; its inertia comes from its URDF.
    Arm,
    /// The same by the name that it had first, whatever arm the URDF describes.
    Ur5e,
}

impl RobotModel {
    /// Whether the arm has links, which `[robot.arm]` describes.
    pub fn has_links(self) -> bool {
        self != RobotModel::Carriage
    }
}

/// `[robot.arm]`: an arm with six joints, and how it stands when it grips. Used with `model = "arm"`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ArmFile {
    /// URDF file.
    pub urdf: String,
    /// Link of the URDF on which the gripper is mounted, its z axis out of the flange.
    pub tip: String,
    /// Joint angles from base to tip.
    pub joints_deg: [f64; 6],
    /// Distance of the grip centre from the tip, along the tip's z axis.
    pub tip_to_grip_mm: f64,
    /// Inertia of each joint's rotor, seen through its gear.
    pub rotor_inertia_kg_m2: [f64; 6],
}

/// What the force loop closes on.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Feedback {
    /// The robot's own wrist sensor, noise included.
    Measured,
    /// The commanded force itself: the wrist sensor only watches.
    Independent,
}

/// What holds the grip's rotation about the jaw axis against the moment of a contact beside the pull line.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Twist {
    /// All does: a contact beside the pull line slips like a centred one.
    #[default]
    Stiff,
    /// A spring does, of `twist_stiffness_n_m_per_rad`: the grip turns until the spring holds the moment.
    Compliant,
    /// Nothing does: such a grip turns, and slips as the limit surface says.
    Free,
}

/// `[robot]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RobotFile {
    /// Model of the arm.
    pub model: RobotModel,
    /// Mass that the arm moves along the pull, without the gripper; used with `model = "carriage"`.
    pub moving_mass_kg: f64,
    /// Mass with which the force loop answers along the pull, gripper included: that of the admittance which the controller
    /// imposes. Left out, it is the inertia of the arm and of what it carries.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub apparent_mass_kg: Option<f64>,
    /// Time constant of the force loop.
    pub lag_s: f64,
    /// Time before the force loop answers.
    pub dead_time_s: f64,
    /// Force per speed that the force loop yields to while it moves.
    pub damping_n_s_per_m: f64,
    /// Highest speed of the force loop.
    pub speed_limit_mm_s: f64,
    /// What the force loop closes on.
    pub feedback: Feedback,
    /// What holds the grip's rotation about the jaw axis.
    #[serde(default)]
    pub twist: Twist,
    /// Moment per rotation of arm, gripper, fingers and fixture in series; used with `twist = "compliant"`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub twist_stiffness_n_m_per_rad: Option<f64>,
    /// The arm's links and stance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub arm: Option<ArmFile>,
    /// Uncertainty of values in this section.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub calibration: BTreeMap<String, CalibrationFile>,
}

/// What a grip force means.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ForceConvention {
    /// The normal force of one jaw.
    PerJaw,
    /// The sum over both jaws, the WSG's own number.
    Total,
}

/// `[gripper]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GripperFile {
    /// Name of the gripper, for people: no number depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub model: Option<String>,
    /// What `grip_force_n` means in a sweep with this twin. Files that gripgen writes are per jaw.
    pub force_convention: ForceConvention,
    /// Mass of the gripper without its jaws.
    pub mass_kg: f64,
    /// Mass of one jaw with finger and sensor.
    pub jaw_mass_kg: f64,
    /// Largest opening between the gels.
    pub opening_mm: f64,
    /// Largest grip force, per jaw.
    pub max_force_n: f64,
}

/// `[wrist]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct WristFile {
    /// Standard deviation of the noise of one reading.
    pub noise_n: f64,
    /// Time over which that noise is correlated, as of a filter of first order; 0: white. `calibrate` and `diagnose` take it as white.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub noise_time_s: f64,
    /// Readings per second.
    pub rate_hz: f64,
    /// Uncertainty of values in this section.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub calibration: BTreeMap<String, CalibrationFile>,
}

/// Model of the gel's deformation.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GelModel {
    /// Volume `V = c F`, pressure of a Winkler bed, and a pyramid of blurs (Taxim; Wucherer et al. 2023).
    Pyramid,
    /// A linear elastic layer on a rigid base: pressure and surface from modulus and thickness. It uses neither the
    /// imprint constants of the parts nor `kernels_px` and `restore_depth_fraction`.
    Elastic,
}

/// `[gel.left]`, `[gel.right]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GelFile {
    /// Model of the deformation.
    pub model: GelModel,
    /// Thickness; a press deeper than this fails the sample.
    pub thickness_mm: f64,
    /// Width of the pad, along image x.
    pub width_mm: f64,
    /// Height of the pad, along image y.
    pub height_mm: f64,
    /// Side of a pixel of the grid that the contact is solved on. It has nothing to do with the pixels of the sensor.
    #[serde(default = "contact_mm_per_px", skip_serializing_if = "is_contact_mm_per_px")]
    pub contact_mm_per_px: f64,
    /// Tangential force per shear displacement of the pad.
    pub shear_stiffness_n_per_mm: f64,
    /// Share of that stiffness which the points of a contact have by their area, from 0 to 1; the rest they have by their
    /// load. 1: the rim of a round contact slips long before its middle (Mindlin 1949). 0: the contact lets go at once.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub shear_by_area: f64,
    /// How much softer the gel is than the one whose constants stand elsewhere: imprint constants of all parts are multiplied by it,
    /// shear stiffness and modulus are divided.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub compliance: f64,
    /// Share of the interlock of teeth and edges that counts: friction acts on the slopes of the contact, along the pull and across. 0: on
    /// the projected area alone.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub interlock: f64,
    /// Standard deviation of the blur that rounds these slopes, as the skin of a gel does.
    #[serde(default = "interlock_smoothing_mm", skip_serializing_if = "is_interlock_smoothing_mm")]
    pub interlock_smoothing_mm: f64,
    /// Whether the gel stiffens as it gets thinner: `V = c F (1 - depth / thickness)`, to nine tenths of its thickness. Of
    /// `model = "pyramid"`.
    #[serde(default, skip_serializing_if = "is_false")]
    pub stiffens: bool,
    /// Sizes of the blurs in pixels of the sensor's image, in order; odd numbers. A calibrated sensor file has its own
    /// blurs and share below, which are used instead.
    pub kernels_px: Vec<u32>,
    /// The contact that blurs may not touch begins at this share of the press depth.
    pub restore_depth_fraction: f64,
    /// Young's modulus; needed with `model = "elastic"`. Markers of the sensor move by it; without it they go with the surface of the gel.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub young_modulus_mpa: Option<f64>,
    /// Poisson's ratio; 0.5, incompressible, where it is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub poisson_ratio: Option<f64>,
    /// Uncertainty of values in this section.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub calibration: BTreeMap<String, CalibrationFile>,
}

/// Noise of the tactile images.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum ImageNoise {
    /// As measured and stored in the sensor file.
    Measured,
    /// None: a grip without contact gives the rest frame of the sensor file, bit for bit.
    Off,
}

/// Order of the channels of a colour table.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum TableChannels {
    /// `grad_r` is fitted to blue, as OpenCV orders images.
    Bgr,
    /// `grad_r` is fitted to red.
    Rgb,
}

/// `[optics.left]`, `[optics.right]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct OpticsFile {
    /// Sensor file: gripgen's own npz, or Taxim's `polycalib.npz`.
    pub sensor: String,
    /// Millimetres per pixel; needed with `polycalib.npz`, otherwise the sensor file's.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mm_per_px: Option<f64>,
    /// Image without contact (PNG or JPEG); needed with `polycalib.npz` only.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub background: Option<String>,
    /// Height map of the gel at rest, an `.npy` array of pixels (Taxim's `gelmap.npy`); the sensor file's shape where
    /// this is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub gel_map: Option<String>,
    /// Shadow table, an `.npz` of plain arrays (Taxim's `shadowTable.npz` without its pickle); the sensor file's
    /// shadows where this is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shadow_table: Option<String>,
    /// Width in pixels of the images in whose positions a `polycalib.npz` was fitted; 640, as Taxim's, where this is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table_width_px: Option<u32>,
    /// Order of the channels of a `polycalib.npz`; `bgr`, as Taxim's, where this is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub table_channels: Option<TableChannels>,
    /// Noise of the images.
    pub image_noise: ImageNoise,
}

/// `[parts.NAME]`
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartFile {
    /// Mesh file: STL, OBJ, PLY or GLB; `none` for a part of which only labels are known.
    pub mesh: String,
    /// Millimetres per unit of the mesh file.
    #[serde(default = "one")]
    pub scale_mm_per_unit: f64,
    /// Where the part is gripped; the mesh frame itself where this is left out.
    #[serde(default = "plain_grip")]
    pub grips: Vec<GripFile>,
    /// Static friction coefficient of part and gel.
    pub mu: f64,
    /// Kinetic over static friction; 1 = no loss when sliding.
    #[serde(default = "one")]
    pub kinetic_ratio: f64,
    /// Time constant with which friction falls from its static to its kinetic value once the jaws slide; 0: at once.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub kinetic_fall_s: f64,
    /// Relative standard deviation of the friction coefficient from grip to grip.
    #[serde(default)]
    pub scatter: f64,
    /// Imprint constant c of `V = c F`: imprint volume per normal force of a jaw.
    pub imprint_mm3_per_n: f64,
    /// Radius of its convex edges where the mesh has sharp ones, in images; forces stay those of the mesh. Printed edges have 0.2.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub edge_radius_mm: f64,
    /// Relief of its surface in images, root of the mean square: height that is fixed to the part, above 0.5 mm long. Printed faces have about 5.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub relief_um: f64,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// The kind of part, for whoever trains on it: shaft, gear. Nothing that is simulated depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub family: Option<String>,
    /// What its kind is kept for, for whoever trains on it: train, test. Nothing that is simulated depends on it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub split: Option<String>,
    /// Uncertainty of values in this section.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub calibration: BTreeMap<String, CalibrationFile>,
}

fn one() -> f64 {
    1.0
}

/// The pixels of a GelSight R1.5: 320 over the 28.064 mm of its pad.
fn contact_mm_per_px() -> f64 {
    0.0877
}

fn is_contact_mm_per_px(x: &f64) -> bool {
    *x == contact_mm_per_px()
}

fn is_one(x: &f64) -> bool {
    *x == 1.0
}

/// Between the blurs of a tenth and of half a millimetre that images of GelSight gels show at sharp edges.
fn interlock_smoothing_mm() -> f64 {
    0.3
}

fn is_interlock_smoothing_mm(x: &f64) -> bool {
    *x == interlock_smoothing_mm()
}

fn is_false(x: &bool) -> bool {
    !*x
}

fn is_zero(x: &f64) -> bool {
    *x == 0.0
}

fn plain_grip() -> Vec<GripFile> {
    vec![GripFile { name: None, origin_mm: [0.0; 3], orientation_deg: [0.0; 3] }]
}

/// One entry of `[[parts.NAME.grips]]`: how the mesh lies in the part frame of this grip.
///
/// The part frame has +x along the long axis, +y along the jaw axis, +z up at a grip angle of 0.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GripFile {
    /// A name for people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub name: Option<String>,
    /// The mesh point (after scaling) that comes to lie midway between the jaws.
    #[serde(default)]
    pub origin_mm: [f64; 3],
    /// Rotations of the mesh about the fixed x, then y, then z axis of the part frame.
    #[serde(default)]
    pub orientation_deg: [f64; 3],
}

/// One entry of `[[effects]]`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct EffectFile {
    /// Id of the effect.
    pub name: String,
    /// The only part it acts on; all parts where this is left out.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub part: Option<String>,
    /// Grip forces per jaw on which the values were fitted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fitted_grip_force_n: Option<[f64; 2]>,
    /// What happens outside that range.
    #[serde(default)]
    pub outside_fit: OutsideFit,
    /// Whether a friction law of the grip force is evaluated once for a jaw or for each pressure cell.
    #[serde(default, skip_serializing_if = "Per::is_jaw")]
    pub per: Per,
    /// With `per = "cell"`: pressure times this area is the grip force of the law.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub reference_area_mm2: Option<f64>,
    /// Where the numbers come from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub source: Option<String>,
    /// Uncertainty of the parameters.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub calibration: BTreeMap<String, CalibrationFile>,
    /// The parameters of the effect, by name.
    #[serde(flatten)]
    #[schemars(with = "BTreeMap<String, ParameterValue>")]
    pub parameters: BTreeMap<String, toml::Value>,
}

/// What a key of an effect may hold: a number, or a list, a word or a flag of a table, or the points of a surface.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum ParameterValue {
    Number(f64),
    Numbers(Vec<f64>),
    Words(Vec<String>),
    Points(Vec<Vec<Place>>),
    Word(String),
    Flag(bool),
}

/// A value of a point of a surface.
#[derive(JsonSchema)]
#[serde(untagged)]
#[expect(dead_code, reason = "only its schema is used")]
enum Place {
    Number(f64),
    Word(String),
}

/// How well a value of the same section is known: `calibration.KEY`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct CalibrationFile {
    /// Lower end of the 90 % interval.
    pub low90: f64,
    /// Upper end of the 90 % interval.
    pub high90: f64,
    /// What the value rests on.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub evidence: Option<String>,
    /// SHA-256 of the data it was fitted to.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub data_sha256: Option<String>,
    /// The value that stood there before. A diagnosis of the same data starts from it, so that they count once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub before: Option<f64>,
}
