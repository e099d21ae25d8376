//! Checking the sections of a twin file and converting them to SI units. Errors name the key.

use super::{Elastic, Gel, Part, RobotArm};
use crate::config::{
    ArmFile, ConfigError, GelFile, GelModel, PartFile, RobotFile, TwinFile, Twist, in_range,
};
use crate::effects::{self, Effect, EffectSpec, OutsideFit, Per};
use crate::frames::{pose, rotation_from_fixed_xyz};
use nalgebra::Point3;

/// Largest friction coefficient that a part of a twin may have.
pub const LARGEST_MU: f64 = 5.0;

pub(super) fn check_arm(arm: Option<&ArmFile>) -> Result<RobotArm, ConfigError> {
    let arm = arm.ok_or_else(|| {
        ConfigError::new("robot.model", "an arm with links needs the section [robot.arm]")
            .hint("the shipped one stands in asset:configs/twin-baseline.toml; or use model = \"carriage\"")
    })?;
    let (mut joints_rad, mut rotor_inertia_kg_m2) = ([0.0; 6], [0.0; 6]);
    for i in 0..6 {
        let key = format!("robot.arm.joints_deg[{i}]");
        joints_rad[i] = in_range(&key, arm.joints_deg[i], -360.0..=360.0, "deg")?.to_radians();
        let key = format!("robot.arm.rotor_inertia_kg_m2[{i}]");
        rotor_inertia_kg_m2[i] = in_range(&key, arm.rotor_inertia_kg_m2[i], 0.0..=1000.0, "kg m2")?;
    }
    Ok(RobotArm {
        urdf: arm.urdf.clone(),
        tip: arm.tip.clone(),
        joints_rad,
        tip_to_grip_m: 1e-3 * in_range("robot.arm.tip_to_grip_mm", arm.tip_to_grip_mm, 0.0..=2000.0, "mm")?,
        rotor_inertia_kg_m2,
    })
}

/// The stiffness against rotation, checked wherever it stands and needed with a compliant twist.
pub(super) fn check_twist(robot: &RobotFile) -> Result<Option<f64>, ConfigError> {
    let key = "robot.twist_stiffness_n_m_per_rad";
    let stiffness = robot.twist_stiffness_n_m_per_rad;
    if stiffness.is_none() && robot.twist == Twist::Compliant {
        return Err(ConfigError::new(
            key,
            "twist = \"compliant\" needs the stiffness of arm, fingers and fixture",
        )
        .hint("a UR5e with a WSG 50 has some 1000 N m/rad"));
    }
    let hint = "a grip that does not turn is twist = \"stiff\", one that nothing holds is \"free\"";
    stiffness.map(|k| in_range(key, k, 1e-3..=1e6, "N m/rad").map_err(|e| e.hint(hint))).transpose()
}

/// Most pixels of a contact: those of a camera image of 2048 x 2048, whose planes of single precision take 16 MB each.
const MAX_CONTACT_PIXELS: f64 = 4_194_304.0;

pub(super) fn check_gel(gel: &GelFile, key: &str) -> Result<Gel, ConfigError> {
    for (i, &k) in gel.kernels_px.iter().enumerate() {
        if k % 2 == 0 || !(3..=255).contains(&k) {
            let problem = format!("a kernel of {k} pixels, it must be an odd number from 3 to 255");
            return Err(ConfigError::new(format!("{key}.kernels_px[{i}]"), problem));
        }
    }
    let checked = |name: &str, value: f64, range: std::ops::RangeInclusive<f64>, unit: &str| {
        in_range(&format!("{key}.{name}"), value, range, unit)
    };
    let contact_mm_per_px = checked("contact_mm_per_px", gel.contact_mm_per_px, 0.005..=1.0, "mm")?;
    let pixels = gel.width_mm * gel.height_mm / (contact_mm_per_px * contact_mm_per_px);
    if pixels > MAX_CONTACT_PIXELS {
        let problem = format!(
            "{} x {} mm of pad in pixels of {contact_mm_per_px} mm are {pixels:.0}, at most {MAX_CONTACT_PIXELS:.0} are solved",
            gel.width_mm, gel.height_mm
        );
        return Err(ConfigError::new(format!("{key}.contact_mm_per_px"), problem)
            .hint("use larger contact pixels or a smaller pad"));
    }
    if gel.stiffens && gel.model == GelModel::Elastic {
        let problem = "an elastic gel does not stiffen, its modulus is constant";
        return Err(ConfigError::new(format!("{key}.stiffens"), problem).hint("model = \"pyramid\" does"));
    }
    let compliance = checked("compliance", gel.compliance, 0.01..=100.0, "1")?;
    Ok(Gel {
        thickness_m: checked("thickness_mm", gel.thickness_mm, 0.1..=50.0, "mm")? * 1e-3,
        width_m: checked("width_mm", gel.width_mm, 1.0..=200.0, "mm")? * 1e-3,
        height_m: checked("height_mm", gel.height_mm, 1.0..=200.0, "mm")? * 1e-3,
        contact_m_per_px: contact_mm_per_px * 1e-3,
        shear_stiffness_n_per_m: 1e3
            * checked("shear_stiffness_n_per_mm", gel.shear_stiffness_n_per_mm, 0.1..=1e4, "N/mm")?
            / compliance,
        shear_by_area: checked("shear_by_area", gel.shear_by_area, 0.0..=1.0, "1")?,
        stiffens: gel.stiffens,
        interlock: checked("interlock", gel.interlock, 0.0..=10.0, "1")?,
        interlock_smoothing_m: 1e-3
            * checked("interlock_smoothing_mm", gel.interlock_smoothing_mm, 0.0..=5.0, "mm")?,
        compliance,
        kernels_px: gel.kernels_px.clone(),
        restore_depth_fraction: checked(
            "restore_depth_fraction",
            gel.restore_depth_fraction,
            0.0..=1.0,
            "1",
        )?,
        model: gel.model,
        elastic: check_elastic(gel, key)?,
    })
}

/// The elastic constants, checked wherever they stand and needed with the elastic model.
fn check_elastic(gel: &GelFile, key: &str) -> Result<Option<Elastic>, ConfigError> {
    let modulus = format!("{key}.young_modulus_mpa");
    let mpa = gel.young_modulus_mpa.map(|x| in_range(&modulus, x, 1e-3..=1e3, "MPa")).transpose()?;
    let ratio = gel.poisson_ratio.unwrap_or(0.5);
    let poisson_ratio = in_range(&format!("{key}.poisson_ratio"), ratio, 0.0..=0.5, "1")?;
    if gel.model == GelModel::Elastic && mpa.is_none() {
        return Err(ConfigError::new(modulus, "model = \"elastic\" needs the modulus of the gel")
            .hint("a silicone gel of such a sensor has 0.275 MPa by its hardness; imprints of the shipped parts are those of 0.85"));
    }
    Ok(mpa.map(|mpa| Elastic { young_modulus_pa: mpa * 1e6 / gel.compliance, poisson_ratio }))
}

pub(super) fn check_part(part: &PartFile, key: &str) -> Result<Part, ConfigError> {
    let at = |name: &str| format!("{key}.{name}");
    if part.grips.is_empty() {
        return Err(ConfigError::new(at("grips"), "the list is empty, a part needs at least one grip"));
    }
    let mut grips = Vec::new();
    for (i, grip) in part.grips.iter().enumerate() {
        for axis in 0..3 {
            in_range(&format!("{key}.grips[{i}].origin_mm"), grip.origin_mm[axis], -2000.0..=2000.0, "mm")?;
            let angle = grip.orientation_deg[axis];
            in_range(&format!("{key}.grips[{i}].orientation_deg"), angle, -360.0..=360.0, "deg")?;
        }
        let rotation = rotation_from_fixed_xyz(grip.orientation_deg.map(f64::to_radians));
        let origin = Point3::from(grip.origin_mm.map(|x| x * 1e-3));
        grips.push(pose(&rotation, -(rotation * origin.coords)));
    }
    Ok(Part {
        mesh: part.mesh.clone(),
        metres_per_unit: in_range(&at("scale_mm_per_unit"), part.scale_mm_per_unit, 1e-6..=1e6, "mm")? * 1e-3,
        grips,
        mu: in_range(&at("mu"), part.mu, 0.0..=LARGEST_MU, "1")?,
        kinetic_ratio: in_range(&at("kinetic_ratio"), part.kinetic_ratio, 0.05..=1.0, "1")?,
        kinetic_fall_s: in_range(&at("kinetic_fall_s"), part.kinetic_fall_s, 0.0..=1.0, "s")?,
        scatter: in_range(&at("scatter"), part.scatter, 0.0..=0.5, "1")?,
        imprint_m3_per_n: in_range(&at("imprint_mm3_per_n"), part.imprint_mm3_per_n, 1e-3..=1e3, "mm3/N")?
            * 1e-9,
        edge_radius_m: in_range(&at("edge_radius_mm"), part.edge_radius_mm, 0.0..=1.0, "mm")? * 1e-3,
        relief_m: in_range(&at("relief_um"), part.relief_um, 0.0..=50.0, "um")? * 1e-6,
    })
}

pub(super) fn check_effect(file: &TwinFile, index: usize) -> Result<Effect, ConfigError> {
    let effect = &file.effects[index];
    let key = |name: &str| format!("effects[{index}].{name}");
    let known = || effects::LIBRARY.iter().map(|spec| spec.id);
    let spec = effects::find(&effect.name).ok_or_else(|| {
        let error = ConfigError::new(key("name"), format!("there is no effect `{}`", effect.name));
        error.suggest(&effect.name, known(), || {
            format!("effects of this version: {}", known().collect::<Vec<_>>().join(", "))
        })
    })?;
    if let Some(part) = &effect.part
        && !file.parts.contains_key(part)
    {
        return Err(ConfigError::unknown_part(key("part"), part, file.parts.keys()));
    }
    let fixed =
        ["part", "fitted_grip_force_n", "outside_fit", "per", "reference_area_mm2", "source", "calibration"];
    for name in effect.parameters.keys() {
        if spec.parameters.iter().all(|p| p.name != name) {
            let names: Vec<&str> = spec.parameters.iter().map(|p| p.name).chain(fixed).collect();
            let error = ConfigError::new(key(name), format!("`{}` has no parameter `{name}`", spec.id));
            let keys = || format!("its keys: {}", names.join(", "));
            return Err(error.suggest(name, names.iter().copied(), keys));
        }
    }
    if spec.friction.is_none() {
        let range = effect.fitted_grip_force_n.map(|_| "fitted_grip_force_n");
        let outside = (effect.outside_fit != OutsideFit::default()).then_some("outside_fit");
        if let Some(name) = range.or(outside) {
            let problem =
                format!("`{}` is no friction law, a range of grip forces says nothing about it", spec.id);
            return Err(ConfigError::new(key(name), problem).hint(format!("leave {name} out")));
        }
    }
    let values = spec
        .parameters
        .iter()
        .map(|p| match effect.parameters.get(p.name) {
            None => Ok(p.neutral),
            Some(toml::Value::Float(x)) => in_range(&key(p.name), *x, p.bounds.0..=p.bounds.1, p.unit),
            Some(toml::Value::Integer(i)) => {
                in_range(&key(p.name), *i as f64, p.bounds.0..=p.bounds.1, p.unit)
            }
            Some(other) => Err(ConfigError::new(key(p.name), format!("a number is needed, found {other}"))),
        })
        .collect::<Result<_, _>>()?;
    if let Some([low, high]) = effect.fitted_grip_force_n
        && !(low.is_finite() && high.is_finite() && low >= 0.0 && low <= high)
    {
        let problem = format!("[{low}, {high}] N is not a range from small to large");
        return Err(ConfigError::new(key("fitted_grip_force_n"), problem));
    }
    Ok(Effect {
        spec,
        part: effect.part.clone(),
        values,
        fitted_grip_force_n: effect.fitted_grip_force_n.map(|[low, high]| (low, high)),
        outside_fit: effect.outside_fit,
        per: effect.per,
        reference_area_m2: check_reference_area(effect, spec, &key)?,
    })
}

/// The reference area in m2, there exactly for laws of the grip force that are evaluated per cell.
fn check_reference_area(
    effect: &crate::config::EffectFile,
    spec: &EffectSpec,
    key: &dyn Fn(&str) -> String,
) -> Result<Option<f64>, ConfigError> {
    let area = key("reference_area_mm2");
    match (effect.per, effect.reference_area_mm2) {
        (Per::Cell, _) if spec.of_pressure => {
            let problem = format!("`{}` is a law of the pressure, it has a value per cell as it is", spec.id);
            Err(ConfigError::new(key("per"), problem).hint("leave per and reference_area_mm2 out"))
        }
        (Per::Cell, _) if !spec.is_load_law() => {
            let problem =
                format!("`{}` does not depend on the grip force, it has no value per cell", spec.id);
            let laws = effects::LIBRARY.iter().filter(|s| s.is_load_law()).map(|s| s.id);
            let hint = format!("leave it out; per cell there are {}", laws.collect::<Vec<_>>().join(", "));
            Err(ConfigError::new(key("per"), problem).hint(hint))
        }
        (Per::Cell, None) => Err(ConfigError::new(area, "per = \"cell\" needs a reference area")
            .hint("pressure times this area is the grip force of the law; take the contact area of the fit")),
        (Per::Cell, Some(mm2)) => Ok(Some(in_range(&area, mm2, 1e-3..=1e5, "mm2")? * 1e-6)),
        (Per::Jaw, Some(_)) => Err(ConfigError::new(area, "it is used with per = \"cell\" only")
            .hint("add per = \"cell\" or leave it out")),
        (Per::Jaw, None) => Ok(None),
    }
}
