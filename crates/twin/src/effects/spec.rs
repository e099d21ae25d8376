//! What stands in the file of an effect: all that anybody knows of it.

use super::{
    CommandHook, CreepHook, Experiment, FrictionHook, GraspForceHook, ImprintFit, ImprintHook, Named,
    NormalForceHook, OpticsHook, PressFit, PullFit, SensorHook, TableFit, TiltHook,
};
use std::fmt;

/// A parameter of an effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ParameterSpec {
    /// Name in a twin file, with its unit suffix.
    pub name: &'static str,
    /// Unit, `1` for a plain number.
    pub unit: &'static str,
    /// Value where a twin leaves it out. With every parameter at this value the effect does nothing.
    pub neutral: f64,
    /// Smallest and largest physical value.
    pub bounds: (f64, f64),
    /// What it means.
    pub about: &'static str,
}

/// A parameter of this name, unit, neutral value and bounds; [`ParameterSpec::about`] says what it means.
pub(super) const fn parameter(
    name: &'static str,
    unit: &'static str,
    neutral: f64,
    bounds: (f64, f64),
) -> ParameterSpec {
    ParameterSpec { name, unit, neutral, bounds, about: "" }
}

impl ParameterSpec {
    /// The same with what it means.
    pub(super) const fn about(self, about: &'static str) -> Self {
        Self { about, ..self }
    }
}

/// How large an effect has to be for more than what a first-order loop gets wrong of an arm: less is none, however often it was
/// measured. Sizes are those of the first parameter that is fitted, less its neutral value.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Visible {
    /// However small.
    Always,
    /// From this size on.
    From(f64),
    /// What has grown to this from the first pull of a campaign to the last; the size is one per hour.
    OverTheCampaign(f64),
    /// What has grown to this at the largest label of a campaign; the size is one per newton.
    AtTheLargestForce(f64),
}

/// What of the rig an effect belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Group {
    /// The friction coefficient of a jaw.
    Friction,
    /// Gel and jaws: what presses, and where.
    Jaws,
    /// Wrist sensor and force loop.
    Robot,
    /// Images.
    Optics,
}

impl Group {
    /// All, in the order of the library.
    pub const ALL: [Group; 4] = [Group::Friction, Group::Jaws, Group::Robot, Group::Optics];

    /// Its heading.
    pub fn title(self) -> &'static str {
        match self {
            Group::Friction => "Friction coefficient of a jaw",
            Group::Jaws => "Gel and jaws",
            Group::Robot => "Wrist sensor and force loop",
            Group::Optics => "Optics",
        }
    }
}

/// The description of an effect.
#[derive(Clone, Copy)]
pub struct EffectSpec {
    /// Stable id, the name in a twin file and in a diagnosis.
    pub id: &'static str,
    /// What of the rig it belongs to.
    pub group: Group,
    /// One line: what it is.
    pub about: &'static str,
    /// The formula, with the parameter names.
    pub formula: &'static str,
    /// Where the formula comes from.
    pub source: &'static str,
    /// One sentence for a technician: what happens.
    pub plainly: &'static str,
    /// What its number means, by an example.
    pub number_means: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    /// Values of a rig that has it, to show what it does; the others are neutral.
    pub typical: &'static [Named],
    /// Its parameters, in twin-file units.
    pub parameters: &'static [ParameterSpec],
    /// The first so many parameters are sizes: where they are neutral the effect does nothing, whatever the others are.
    pub sizes: usize,
    /// Names of those parameters that are references, or choose between forms of the law: not fitted.
    pub references: &'static [&'static str],
    /// Columns of a pull table that it needs.
    pub covariates: &'static [&'static str],
    /// Its friction law is one of the contact pressure: it is always taken for each pressure cell.
    pub of_pressure: bool,
    /// Its sensor hook depends on the clock of the campaign.
    pub reads_clock: bool,
    /// Its sensor hook depends on readings before.
    pub remembers: bool,
    /// Its formula knows pulls up and down, and no other direction.
    pub upright_only: bool,
    /// An effect of the contact, which parts may have each in their own way. Those of gel, gripper, sensor and robot are common.
    pub per_part: bool,
    /// The size from which on it is an effect.
    pub visible: Visible,
    /// Effects that what it leaves looks like, because nature is not quite its formula: they are not named beside it.
    pub leaves: &'static [&'static str],
    /// Why it has no meaning on an elastic gel, where it has none: what it changes that such a gel does not have.
    pub not_on_elastic_gel: Option<&'static str>,
    /// How it is fitted to pulls, or why pulls cannot show it.
    pub pulls: Result<PullFit, &'static str>,
    /// How it is fitted to a table of a force sensor, if one can show it.
    pub table: Option<TableFit>,
    /// How it is fitted to presses, if they can show it.
    pub presses: Option<PressFit>,
    /// How it is fitted to imprints of grasps beside a load cell, if they can show it.
    pub imprints: Option<ImprintFit>,
    /// Experiments that show it.
    pub experiments: &'static [Experiment],
    /// Experiments that leave it as it is while they show its rivals.
    pub not_shown_by: &'static [Experiment],
    /// Acts on the friction coefficient of a jaw.
    pub friction: Option<FrictionHook>,
    /// Acts on the normal force of a jaw, before imprint, friction and mechanics.
    pub normal_force: Option<NormalForceHook>,
    /// Acts on the imprint volume of a jaw.
    pub imprint_volume: Option<ImprintHook>,
    /// Acts on the force that imprints show beside readings of a load cell.
    pub grasp_force: Option<GraspForceHook>,
    /// Acts on the displacement under a pull that the jaws hold.
    pub creep: Option<CreepHook>,
    /// Acts on the angle of a gel.
    pub tilt_rad: Option<TiltHook>,
    /// Acts on the readings of the wrist sensor.
    pub sensor: Option<SensorHook>,
    /// Acts on the command of the force loop.
    pub command: Option<CommandHook>,
    /// Acts on the images of a jaw, and on nothing else.
    pub optics: Option<OpticsHook>,
}

impl EffectSpec {
    /// No name and no hook: what the specs fill in.
    pub(super) const BARE: EffectSpec = EffectSpec {
        id: "",
        group: Group::Friction,
        about: "",
        formula: "",
        source: "",
        plainly: "",
        number_means: "",
        remedy: "",
        typical: &[],
        parameters: &[],
        sizes: 1,
        references: &[],
        covariates: &[],
        of_pressure: false,
        reads_clock: false,
        remembers: false,
        upright_only: false,
        per_part: false,
        visible: Visible::Always,
        leaves: &[],
        not_on_elastic_gel: None,
        pulls: Err("it changes images, and nothing that is felt"),
        table: None,
        presses: None,
        imprints: None,
        experiments: &[],
        not_shown_by: &[],
        friction: None,
        normal_force: None,
        imprint_volume: None,
        grasp_force: None,
        creep: None,
        tilt_rad: None,
        sensor: None,
        command: None,
        optics: None,
    };

    /// Values of a rig that has it, in the order of its parameters.
    pub fn typical_values(&self) -> Vec<f64> {
        self.values(self.typical)
    }

    /// Some values by name in the order of its parameters, the others neutral. Of a name that stands twice the first
    /// value counts.
    pub fn values(&self, named: &[Named]) -> Vec<f64> {
        let value =
            |p: &ParameterSpec| named.iter().find(|(n, _)| *n == p.name).map_or(p.neutral, |(_, v)| *v);
        self.parameters.iter().map(value).collect()
    }

    /// Position of a parameter.
    pub fn position(&self, parameter: &str) -> Option<usize> {
        self.parameters.iter().position(|p| p.name == parameter)
    }

    /// Some values without what differs from grip to grip by chance.
    pub fn without_scatter(&self, values: &[f64]) -> Vec<f64> {
        let own = values.len() - self.presses.map_or(0, |fit| fit.scatters).min(values.len());
        let neutral = self.parameters.iter().skip(own).map(|p| p.neutral);
        values.iter().take(own).copied().chain(neutral).collect()
    }

    /// What it acts on, for people.
    pub fn acts_on(&self) -> Vec<&'static str> {
        let hooks = [
            (self.friction.is_some(), "friction coefficient of a jaw"),
            (self.normal_force.is_some(), "normal force of a jaw"),
            (self.imprint_volume.is_some(), "imprint volume"),
            (self.grasp_force.is_some(), "force that imprints show beside a load cell"),
            (self.creep.is_some(), "displacement under a pull that the jaws hold"),
            (self.tilt_rad.is_some(), "angle of the gels"),
            (self.sensor.is_some(), "readings of the wrist sensor"),
            (self.command.is_some(), "command of the force loop"),
            (self.optics.is_some(), "images"),
        ];
        hooks.into_iter().filter(|(acts, _)| *acts).map(|(_, on)| on).collect()
    }

    /// Whether it changes readings or commands.
    pub fn acts_on_signals(&self) -> bool {
        self.sensor.is_some() || self.command.is_some()
    }

    /// Whether pulls feel it: a label, or the trace of one.
    pub fn is_felt(&self) -> bool {
        let grip = self.friction.is_some() || self.normal_force.is_some() || self.tilt_rad.is_some();
        grip || self.creep.is_some() || self.acts_on_signals()
    }

    /// Whether the effect is a friction law of the grip force, which can be taken per pressure cell.
    pub fn is_load_law(&self) -> bool {
        self.friction.is_some() && self.covariates.contains(&"grip_force_n") && !self.of_pressure
    }
}

impl fmt::Debug for EffectSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "EffectSpec({})", self.id)
    }
}

impl PartialEq for EffectSpec {
    fn eq(&self, other: &Self) -> bool {
        self.id == other.id
    }
}
