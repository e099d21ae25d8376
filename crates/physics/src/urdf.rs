//! An arm from URDF text: one chain of revolute joints with the inertia of what each joint moves.

use crate::arm::{ArmJoint, ArmMesh, ArmModel, LinkInertia, UrdfError};
use gripgen_twin::frames::{Pose, pose, rotation_from_fixed_xyz};
use nalgebra::{Matrix3, Unit, Vector3};
use std::collections::BTreeMap;
use urdf_rs::{Geometry, Joint, JointType, Link, Robot};

impl ArmModel {
    /// Reads the chain that ends at link `tip`.
    ///
    /// What is fixed to a link counts as part of it. What hangs on the tip is ignored: the gripper has its own
    /// model. `find_mesh` turns a mesh reference (`package://...`) into a place; nothing is opened here.
    ///
    /// # Errors
    ///
    /// Text that is no URDF, no link `tip`, a joint or an inertia that a chain of revolute joints cannot have, or a
    /// mesh that `find_mesh` does not find.
    pub fn from_urdf(
        text: &str,
        tip: &str,
        find_mesh: &dyn Fn(&str) -> Option<String>,
    ) -> Result<Self, UrdfError> {
        let robot = urdf_rs::read_from_string(text)
            .map_err(|e| UrdfError(format!("the URDF cannot be read: {e}")))?;
        let meshes = meshes_of(&robot, find_mesh)?;
        let tree = Tree::new(&robot)?;
        let chain = tree.chain(tip)?;
        let mut joints: Vec<ArmJoint> = Vec::new();
        let mut inertias: Vec<Vec<LinkInertia>> = Vec::new();
        let mut last_from_here = Pose::identity();
        for (i, joint) in chain.iter().enumerate() {
            let origin = origin_of(&joint.name, &joint.origin)?;
            match joint.joint_type {
                JointType::Fixed => last_from_here *= origin,
                JointType::Revolute | JointType::Continuous => {
                    joints.push(ArmJoint {
                        name: joint.name.clone(),
                        link: joint.child.link.clone(),
                        parent_from_joint: last_from_here * origin,
                        axis: axis_of(joint)?,
                        limits_rad: limits_of(joint)?,
                        inertia: LinkInertia::NOTHING,
                    });
                    inertias.push(Vec::new());
                    last_from_here = Pose::identity();
                }
                ref other => {
                    return Err(UrdfError(format!(
                        "joint `{}` between base and `{tip}` is {}; only revolute, continuous and fixed joints are supported",
                        joint.name,
                        kind_name(other)
                    )));
                }
            }
            if let Some(parts) = inertias.last_mut() {
                let after = chain.get(i + 1).map(|j| j.name.as_str());
                tree.collect(&joint.child.link, &last_from_here, tip, after, parts)?;
            }
        }
        if joints.is_empty() {
            return Err(UrdfError(format!("no revolute joint between base and `{tip}`")));
        }
        for (joint, parts) in joints.iter_mut().zip(&inertias) {
            joint.inertia = LinkInertia::sum(parts);
            joint.inertia.check(joint)?;
        }
        Ok(Self { name: robot.name, joints, last_from_tip: last_from_here, meshes })
    }
}

/// Links and joints by name.
struct Tree<'a> {
    links: BTreeMap<&'a str, &'a Link>,
    parent_joint: BTreeMap<&'a str, &'a Joint>,
    joints: &'a [Joint],
}

impl<'a> Tree<'a> {
    fn new(robot: &'a Robot) -> Result<Self, UrdfError> {
        let mut parent_joint: BTreeMap<&str, &Joint> = BTreeMap::new();
        for joint in &robot.joints {
            if let Some(first) = parent_joint.insert(&joint.child.link, joint) {
                let (link, first, second) = (&joint.child.link, &first.name, &joint.name);
                return Err(UrdfError(format!(
                    "link `{link}` is the child of both `{first}` and `{second}`"
                )));
            }
        }
        let links = robot.links.iter().map(|l| (l.name.as_str(), l)).collect();
        Ok(Self { links, parent_joint, joints: &robot.joints })
    }

    /// The joints from base to tip.
    fn chain(&self, tip: &str) -> Result<Vec<&'a Joint>, UrdfError> {
        if !self.links.contains_key(tip) {
            let links = self.links.keys().map(|l| format!("`{l}`")).collect::<Vec<_>>().join(", ");
            return Err(UrdfError(format!("no link `{tip}`; the links are {links}")));
        }
        let mut chain = Vec::new();
        let mut link = tip;
        while let Some(&joint) = self.parent_joint.get(link) {
            if chain.len() == self.joints.len() {
                return Err(UrdfError(format!("link `{link}` is its own ancestor")));
            }
            chain.push(joint);
            link = &joint.parent.link;
        }
        chain.reverse();
        Ok(chain)
    }

    /// Inertia of a link and of the branches fixed to it. `next` is the joint with which the chain goes on.
    fn collect(
        &self,
        link: &str,
        last_from_link: &Pose,
        tip: &str,
        next: Option<&str>,
        parts: &mut Vec<LinkInertia>,
    ) -> Result<(), UrdfError> {
        if let Some(body) = self.links.get(link) {
            parts.push(inertia_of(body)?.moved(last_from_link));
        }
        if link == tip {
            return Ok(());
        }
        for joint in self.joints.iter().filter(|j| j.parent.link == link && Some(j.name.as_str()) != next) {
            if joint.joint_type != JointType::Fixed {
                let (joint, kind) = (&joint.name, kind_name(&joint.joint_type));
                return Err(UrdfError(format!(
                    "joint `{joint}` ({kind}) branches off the arm at link `{link}`; only fixed branches are supported"
                )));
            }
            let origin = origin_of(&joint.name, &joint.origin)?;
            self.collect(&joint.child.link, &(last_from_link * origin), tip, None, parts)?;
        }
        Ok(())
    }
}

fn kind_name(kind: &JointType) -> &'static str {
    match kind {
        JointType::Revolute => "revolute",
        JointType::Continuous => "continuous",
        JointType::Prismatic => "prismatic",
        JointType::Fixed => "fixed",
        JointType::Floating => "floating",
        JointType::Planar => "planar",
        JointType::Spherical => "spherical",
    }
}

fn finite(what: &'static str, of: &str, values: &[f64]) -> Result<(), UrdfError> {
    match values.iter().find(|v| !v.is_finite()) {
        None => Ok(()),
        Some(value) => Err(UrdfError(format!("{what} of `{of}` is {value}"))),
    }
}

/// URDF angles are about the fixed x, then y, then z axis.
fn origin_of(of: &str, origin: &urdf_rs::Pose) -> Result<Pose, UrdfError> {
    finite("xyz", of, &origin.xyz.0)?;
    finite("rpy", of, &origin.rpy.0)?;
    Ok(pose(&rotation_from_fixed_xyz(origin.rpy.0), Vector3::from(origin.xyz.0)))
}

fn axis_of(joint: &Joint) -> Result<[f64; 3], UrdfError> {
    let axis = joint.axis.xyz.0;
    finite("axis", &joint.name, &axis)?;
    Unit::try_new(Vector3::from(axis), 1e-9).map(|a| a.into_inner().into()).ok_or_else(|| {
        let length = Vector3::from(axis).norm();
        UrdfError(format!("the axis of joint `{}` has length {length}", joint.name))
    })
}

fn limits_of(joint: &Joint) -> Result<Option<[f64; 2]>, UrdfError> {
    if joint.joint_type == JointType::Continuous {
        return Ok(None);
    }
    let (lower_rad, upper_rad) = (joint.limit.lower, joint.limit.upper);
    finite("limit", &joint.name, &[lower_rad, upper_rad])?;
    if lower_rad > upper_rad {
        return Err(UrdfError(format!(
            "joint `{}` has its lower limit {lower_rad} above its upper limit {upper_rad}",
            joint.name
        )));
    }
    Ok(Some([lower_rad, upper_rad]))
}

fn inertia_of(link: &Link) -> Result<LinkInertia, UrdfError> {
    let (i, mass_kg) = (&link.inertial.inertia, link.inertial.mass.value);
    finite("mass", &link.name, &[mass_kg])?;
    finite("inertia", &link.name, &[i.ixx, i.ixy, i.ixz, i.iyy, i.iyz, i.izz])?;
    let tensor = Matrix3::new(i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz);
    let body = LinkInertia { mass_kg, centre_m: Vector3::zeros(), about_centre_kg_m2: tensor };
    Ok(body.moved(&origin_of(&link.name, &link.inertial.origin)?))
}

fn meshes_of(robot: &Robot, find_mesh: &dyn Fn(&str) -> Option<String>) -> Result<Vec<ArmMesh>, UrdfError> {
    let mut meshes = Vec::new();
    for link in &robot.links {
        let seen = link.visual.iter().map(|v| &v.geometry);
        for geometry in seen.chain(link.collision.iter().map(|c| &c.geometry)) {
            let Geometry::Mesh { filename, .. } = geometry else { continue };
            let place = find_mesh(filename).ok_or_else(|| {
                UrdfError(format!("mesh `{filename}` of link `{}` was not found", link.name))
            })?;
            meshes.push(ArmMesh { link: link.name.clone(), reference: filename.clone(), place });
        }
    }
    Ok(meshes)
}

#[cfg(test)]
mod tests;
