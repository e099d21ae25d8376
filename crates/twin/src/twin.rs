//! The checked twin, in SI units.

mod check;

use crate::config::{
    ConfigError, EffectFile, Feedback, ForceConvention, GelModel, ImageNoise, RobotModel, TableChannels,
    TwinFile, Twist,
};
use crate::effects::{self, Effect};
use crate::frames::{Pose, pose};
use crate::surface::{SURFACE_EFFECT, Surface, check_surface};
use crate::table::{TABLE_EFFECT, Table, TableTarget, check_table};
use crate::{Jaw, PerJaw, Scenario};
pub use check::LARGEST_MU;
use check::{check_arm, check_effect, check_gel, check_part, check_twist};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Format string of a twin file.
pub const TWIN_SCHEMA: &str = "gripgen.twin/1";

/// Everything the simulation knows of a rig and its parts. Built by [`Twin::new`], which checks it.
#[derive(Debug, Clone, PartialEq)]
pub struct Twin {
    /// The force loop of the arm.
    pub robot: Robot,
    /// The arm's links; without them the gripper hangs on a carriage.
    pub arm: Option<RobotArm>,
    /// The gripper.
    pub gripper: Gripper,
    /// The wrist force sensor.
    pub wrist: Wrist,
    /// The gels.
    pub gel: PerJaw<Gel>,
    /// The tactile sensors.
    pub optics: PerJaw<Optics>,
    /// The parts by name.
    pub parts: BTreeMap<String, Part>,
    /// The effects, in the order in which they act.
    pub effects: Vec<Effect>,
    /// Dependences without a name, which act after the effects.
    pub tables: Vec<Table>,
    /// The same over several columns together.
    pub surfaces: Vec<Surface>,
}

/// An arm with six joints, and how it stands when it grips.
#[derive(Debug, Clone, PartialEq)]
pub struct RobotArm {
    /// Path of its URDF, as written.
    pub urdf: String,
    /// Link that carries the gripper.
    pub tip: String,
    /// Joint angles from base to tip.
    pub joints_rad: [f64; 6],
    /// Distance of the grip centre from the tip, along the tip's z axis.
    pub tip_to_grip_m: f64,
    /// Inertia of each joint's rotor, seen through its gear.
    pub rotor_inertia_kg_m2: [f64; 6],
}

/// The arm, reduced to what it does along the pull.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Robot {
    /// Mass the arm moves along the pull, without the gripper.
    pub moving_mass_kg: f64,
    /// Mass with which the force loop answers along the pull, gripper included; that of the arm where it is `None`.
    pub apparent_mass_kg: Option<f64>,
    /// Time constant of the force loop.
    pub lag_s: f64,
    /// Time before the force loop answers.
    pub dead_time_s: f64,
    /// Force per speed that the force loop yields to.
    pub damping_n_s_per_m: f64,
    /// Highest speed of the force loop.
    pub speed_limit_m_per_s: f64,
    /// What the loop closes on.
    pub feedback: Feedback,
    /// What holds the grip's rotation about the jaw axis.
    pub twist: Twist,
    /// Moment per rotation of arm, gripper, fingers and fixture in series; there with a compliant twist.
    pub twist_stiffness_n_m_per_rad: Option<f64>,
}

impl Robot {
    /// Mass of a carriage with the gripper on it, jaws included.
    pub fn carriage_mass_kg(&self, gripper: &Gripper) -> f64 {
        self.moving_mass_kg + gripper.mass_kg + 2.0 * gripper.jaw_mass_kg
    }
}

/// The gripper.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gripper {
    /// What a grip force means to the user of this twin.
    pub force_convention: ForceConvention,
    /// Mass without jaws.
    pub mass_kg: f64,
    /// Mass of one jaw.
    pub jaw_mass_kg: f64,
    /// Largest opening between the gels.
    pub opening_m: f64,
    /// Largest grip force, per jaw.
    pub max_force_n: f64,
}

/// The wrist force sensor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Wrist {
    /// Standard deviation of the noise of one reading.
    pub noise_n: f64,
    /// Time constant of its correlation; 0: white.
    pub noise_time_s: f64,
    /// Readings per second, which is also the rate of the simulation.
    pub rate_hz: f64,
}

impl Wrist {
    /// Time between two readings.
    pub fn step_s(&self) -> f64 {
        1.0 / self.rate_hz
    }
}

/// A gel pad.
#[derive(Debug, Clone, PartialEq)]
pub struct Gel {
    /// Thickness.
    pub thickness_m: f64,
    /// Width, along image x.
    pub width_m: f64,
    /// Height, along image y.
    pub height_m: f64,
    /// Side of a pixel of the grid that its contact is solved on.
    pub contact_m_per_px: f64,
    /// Tangential force per shear displacement.
    pub shear_stiffness_n_per_m: f64,
    /// Share of it that cells have by their area; the rest they have by their load.
    pub shear_by_area: f64,
    /// Share of the interlock of slopes that counts.
    pub interlock: f64,
    /// Standard deviation of the blur of these slopes.
    pub interlock_smoothing_m: f64,
    /// Whether it stiffens as it gets thinner.
    pub stiffens: bool,
    /// By what imprint constants of parts are multiplied. Shear stiffness and modulus are those of this gel.
    pub compliance: f64,
    /// Blur kernels, in pixels of the sensor's image.
    pub kernels_px: Vec<u32>,
    /// Start of the restored contact, as a share of the press depth.
    pub restore_depth_fraction: f64,
    /// How it deforms.
    pub model: GelModel,
    /// Elastic constants where they are known; always with the elastic model. Markers move by them in any model.
    pub elastic: Option<Elastic>,
}

/// The constants of an elastic gel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Elastic {
    /// Young's modulus.
    pub young_modulus_pa: f64,
    /// Poisson's ratio.
    pub poisson_ratio: f64,
}

/// A tactile sensor: which file, and what overrides it.
#[derive(Debug, Clone, PartialEq)]
pub struct Optics {
    /// Path as written in the twin.
    pub sensor: String,
    /// Pixel size that replaces the file's.
    pub metres_per_px: Option<f64>,
    /// Path of the image without contact, as written in the twin.
    pub background: Option<String>,
    /// Path of the gel map, as written in the twin.
    pub gel_map: Option<String>,
    /// Path of the shadow table, as written in the twin.
    pub shadow_table: Option<String>,
    /// Width of the images in whose positions a colour table was fitted; 640 without it.
    pub table_width_px: Option<u32>,
    /// Order of the channels of a colour table; blue first without it.
    pub table_channels: Option<TableChannels>,
    /// Whether the images carry noise.
    pub image_noise: ImageNoise,
}

/// A part that can be gripped.
#[derive(Debug, Clone, PartialEq)]
pub struct Part {
    /// Path of the mesh, as written in the twin.
    pub mesh: String,
    /// Length of a mesh unit.
    pub metres_per_unit: f64,
    /// `part_from_mesh` of each grip.
    pub grips: Vec<Pose>,
    /// Static friction coefficient.
    pub mu: f64,
    /// Kinetic over static friction.
    pub kinetic_ratio: f64,
    /// Time constant with which friction falls to its kinetic value once the jaws slide; 0: at once.
    pub kinetic_fall_s: f64,
    /// Relative scatter of the coefficient from grip to grip.
    pub scatter: f64,
    /// Imprint constant c of V = c F.
    pub imprint_m3_per_n: f64,
    /// Radius of its convex edges, in images.
    pub edge_radius_m: f64,
    /// Root of the mean square of the relief of its surface, in images.
    pub relief_m: f64,
}

/// What stands in place of the path of a mesh for a part of which only labels are known.
pub const NO_MESH: &str = "none";

impl Part {
    /// Whether its shape is known: without it a part has labels, and no images.
    pub fn has_geometry(&self) -> bool {
        self.mesh != NO_MESH
    }
}

impl Twin {
    /// By what tables and surfaces multiply the friction of a pull; 1 without any.
    pub fn table_factor(&self, scenario: &Scenario) -> f64 {
        let factors = self.tables.iter().filter(|t| t.target == TableTarget::Factor);
        let factor: f64 = factors.filter_map(|t| t.at(scenario.view())).product();
        self.surfaces.iter().fold(factor, |factor, surface| factor * surface.factor(scenario.view()))
    }

    /// What the tables add to the readings of the wrist sensor, in newtons; 0 without any.
    pub fn table_offset_n(&self, scenario: &Scenario) -> f64 {
        let offsets = self.tables.iter().filter(|t| t.target == TableTarget::Offset);
        offsets.filter_map(|t| t.at(scenario.view())).fold(0.0, |sum, x| sum + x)
    }

    /// Checks a file's values and converts them. Errors name the key.
    ///
    /// # Errors
    ///
    /// A value out of its range, or two that do not go together.
    pub fn new(file: &TwinFile) -> Result<Self, ConfigError> {
        use crate::config::in_range;
        if let Some(schema) = &file.schema
            && schema != TWIN_SCHEMA
        {
            let problem = format!("this is `{schema}`, gripgen reads `{TWIN_SCHEMA}`");
            return Err(ConfigError::new("schema", problem));
        }
        let r = &file.robot;
        let robot = Robot {
            moving_mass_kg: in_range("robot.moving_mass_kg", r.moving_mass_kg, 0.1..=200.0, "kg")?,
            apparent_mass_kg: r
                .apparent_mass_kg
                .map(|m| in_range("robot.apparent_mass_kg", m, 1e-3..=200.0, "kg"))
                .transpose()?,
            lag_s: in_range("robot.lag_s", r.lag_s, 0.0..=2.0, "s")?,
            dead_time_s: in_range("robot.dead_time_s", r.dead_time_s, 0.0..=2.0, "s")?,
            damping_n_s_per_m: in_range("robot.damping_n_s_per_m", r.damping_n_s_per_m, 1.0..=1e5, "N s/m")?,
            speed_limit_m_per_s: in_range(
                "robot.speed_limit_mm_s",
                r.speed_limit_mm_s,
                0.1..=1500.0,
                "mm/s",
            )? * 1e-3,
            feedback: r.feedback,
            twist: r.twist,
            twist_stiffness_n_m_per_rad: check_twist(r)?,
        };
        let arm = match r.model {
            RobotModel::Carriage => None,
            RobotModel::Arm | RobotModel::Ur5e => Some(check_arm(r.arm.as_ref())?),
        };
        let g = &file.gripper;
        let gripper = Gripper {
            force_convention: g.force_convention,
            mass_kg: in_range("gripper.mass_kg", g.mass_kg, 0.05..=20.0, "kg")?,
            jaw_mass_kg: in_range("gripper.jaw_mass_kg", g.jaw_mass_kg, 0.05..=5.0, "kg")?,
            opening_m: in_range("gripper.opening_mm", g.opening_mm, 1.0..=500.0, "mm")? * 1e-3,
            max_force_n: in_range("gripper.max_force_n", g.max_force_n, 0.1..=1000.0, "N")?,
        };
        let wrist = Wrist {
            noise_n: in_range("wrist.noise_n", file.wrist.noise_n, 0.0..=20.0, "N")?,
            noise_time_s: in_range("wrist.noise_time_s", file.wrist.noise_time_s, 0.0..=10.0, "s")?,
            rate_hz: in_range("wrist.rate_hz", file.wrist.rate_hz, 500.0..=4000.0, "Hz")?,
        };
        let mass_kg = robot.apparent_mass_kg.unwrap_or(robot.carriage_mass_kg(&gripper));
        // The mass of an arm with links is known where its description is read.
        if (arm.is_none() || robot.apparent_mass_kg.is_some())
            && robot.damping_n_s_per_m * wrist.step_s() >= mass_kg
        {
            let problem = format!(
                "{} N s/m stop more than the moving {mass_kg} kg within one step of {} s",
                robot.damping_n_s_per_m,
                wrist.step_s()
            );
            return Err(ConfigError::new("robot.damping_n_s_per_m", problem)
                .hint("lower the damping, raise the mass that moves or raise wrist.rate_hz"));
        }
        let gel = PerJaw::try_from_fn(|jaw| {
            let section = file.gel.right.as_ref().filter(|_| jaw == Jaw::Right).unwrap_or(&file.gel.left);
            check_gel(section, &format!("gel.{jaw}"))
        })?;
        let optics = PerJaw::try_from_fn(|jaw| {
            let section =
                file.optics.right.as_ref().filter(|_| jaw == Jaw::Right).unwrap_or(&file.optics.left);
            let key = format!("optics.{jaw}.mm_per_px");
            let mm_per_px = section.mm_per_px.map(|x| in_range(&key, x, 1e-4..=1.0, "mm")).transpose()?;
            let key = format!("optics.{jaw}.table_width_px");
            let width = section.table_width_px.map(|x| in_range(&key, f64::from(x), 16.0..=4096.0, "px"));
            let table_width_px = width.transpose()?.map(|x| x as u32);
            Ok(Optics {
                sensor: section.sensor.clone(),
                metres_per_px: mm_per_px.map(|x| x * 1e-3),
                background: section.background.clone(),
                gel_map: section.gel_map.clone(),
                shadow_table: section.shadow_table.clone(),
                table_width_px,
                table_channels: section.table_channels,
                image_noise: section.image_noise,
            })
        })?;
        if file.parts.is_empty() {
            return Err(ConfigError::new("parts", "the twin has no parts")
                .hint("add a section [parts.NAME] with mesh, mu and imprint_mm3_per_n"));
        }
        let parts = file
            .parts
            .iter()
            .map(|(name, part)| Ok((name.clone(), check_part(part, &format!("parts.{name}"))?)))
            .collect::<Result<_, ConfigError>>()?;
        let (mut effects, mut tables, mut surfaces) = (Vec::new(), Vec::new(), Vec::new());
        for (i, effect) in file.effects.iter().enumerate() {
            match effect.name.as_str() {
                TABLE_EFFECT => tables.push(check_table(file, i)?),
                SURFACE_EFFECT => surfaces.push(check_surface(file, i)?),
                _ => effects.push(check_effect(file, i)?),
            }
        }
        let without_meaning = |(i, e): (usize, &EffectFile)| {
            let reason = effects::find(&e.name)?.not_on_elastic_gel?;
            Some((i, format!("`{}` {reason}", e.name)))
        };
        if gel.iter().any(|(_, gel)| gel.model == GelModel::Elastic)
            && let Some((i, problem)) = file.effects.iter().enumerate().find_map(without_meaning)
        {
            return Err(ConfigError::new(format!("effects[{i}].name"), problem)
                .hint("leave the effect out, or set gel.left.model = \"pyramid\""));
        }
        Ok(Twin { robot, arm, gripper, wrist, gel, optics, parts, effects, tables, surfaces })
    }

    /// Grip force per jaw of a force that follows this twin's convention.
    pub fn force_per_jaw_n(&self, grip_force_n: f64) -> f64 {
        match self.gripper.force_convention {
            ForceConvention::PerJaw => grip_force_n,
            ForceConvention::Total => grip_force_n / 2.0,
        }
    }
}

impl Part {
    /// `world_from_part` for a grip turned by `grip_angle_rad` about the jaw axis and displaced by
    /// `grip_offset_m` along the part's long axis. Turning the grip by an angle turns the part, seen from the
    /// gripper, by its negative.
    pub fn world_from_part(grip_angle_rad: f64, grip_offset_m: f64) -> Pose {
        let rotation = crate::frames::rotation_about_axis(1, -grip_angle_rad);
        pose(&rotation, rotation * Vector3::new(-grip_offset_m, 0.0, 0.0))
    }
}
