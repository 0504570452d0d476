//! Random URDFs, and their kinematics and dynamics a second time: link by link as they are written, nothing merged.

use crate::description::rodrigues;
use crate::random::Draw;
use blindgrasp_shared::math::Real;
use nalgebra::{DMatrix, Matrix3, Vector3};
use std::collections::BTreeMap;
use std::fmt::Write as _;

/// A link as it is written.
#[derive(Clone, Debug)]
pub struct RawLink {
    /// Its name.
    pub name: String,
    /// Mass, kg; zero for a link without `<inertial>`.
    pub mass_kg: f64,
    /// Origin of its `<inertial>`, m.
    pub centre_m: Vector3<f64>,
    /// Angles of the same, rad.
    pub rpy_rad: Vector3<f64>,
    /// Inertia in these axes, kg m^2.
    pub inertia_kg_m2: Matrix3<f64>,
}

/// A joint as it is written.
#[derive(Clone, Debug)]
pub struct RawJoint {
    /// Its name.
    pub name: String,
    /// Its type.
    pub kind: &'static str,
    /// Index of the link that it sits on.
    pub parent: usize,
    /// Index of the link that it carries.
    pub child: usize,
    /// Origin, m.
    pub xyz_m: Vector3<f64>,
    /// Angles of the origin, rad.
    pub rpy_rad: Vector3<f64>,
    /// A unit vector.
    pub axis: Vector3<f64>,
}

/// A robot as it is written. Link 0 is the root, and each link comes after the one that carries it.
#[derive(Clone, Debug)]
pub struct RawRobot {
    /// Links.
    pub links: Vec<RawLink>,
    /// Joint `k` carries link `k + 1`.
    pub joints: Vec<RawJoint>,
}

/// The poses of a robot's links.
#[derive(Clone, Debug)]
pub struct RawPoses {
    /// Origins, m.
    pub origins_m: Vec<Vector3<f64>>,
    /// Axes, as columns.
    pub attitudes: Vec<Matrix3<f64>>,
}

/// Rotations about x, y and z, in this order about fixed axes, matrix by matrix.
fn rpy_matrix(rpy_rad: &Vector3<f64>) -> Matrix3<f64> {
    let [(sr, cr), (sp, cp), (sy, cy)] = [rpy_rad.x, rpy_rad.y, rpy_rad.z].map(|angle| angle.sine_cosine());
    let roll = Matrix3::new(1.0, 0.0, 0.0, 0.0, cr, -sr, 0.0, sr, cr);
    let pitch = Matrix3::new(cp, 0.0, sp, 0.0, 1.0, 0.0, -sp, 0.0, cp);
    let yaw = Matrix3::new(cy, -sy, 0.0, sy, cy, 0.0, 0.0, 0.0, 1.0);
    yaw * pitch * roll
}

impl RawRobot {
    /// A random tree of so many joints: fixed and revolute ones, some continuous and prismatic.
    pub fn random(draw: &mut Draw, joints: usize) -> Self {
        let mut robot = Self { links: vec![RawLink::random(draw, 0)], joints: vec![] };
        for k in 0..joints {
            // Chains, with branches.
            let parent = if draw.chance(0.7) { k } else { draw.count(0..=k) };
            let kind = match draw.within(0.0, 1.0) {
                share if share < 0.35 => "fixed",
                share if share < 0.9 => "revolute",
                share if share < 0.95 => "continuous",
                _ => "prismatic",
            };
            let right_angles = draw.chance(0.3);
            robot.links.push(RawLink::random(draw, k + 1));
            robot.joints.push(RawJoint {
                name: format!("joint-{k}"),
                kind,
                parent,
                child: k + 1,
                xyz_m: draw.vector(0.1),
                rpy_rad: if right_angles {
                    // Where roll and yaw are not unique.
                    Vector3::from_fn(|_, _| draw.count(0..=4) as f64 - 2.0) * std::f64::consts::FRAC_PI_2
                } else {
                    draw.vector(3.1)
                },
                axis: draw.unit(),
            });
        }
        robot
    }

    /// The file.
    pub fn text(&self) -> String {
        let mut text = String::from("<?xml version=\"1.0\"?>\n<robot name=\"random\">\n");
        let three = |v: &Vector3<f64>| format!("{:?} {:?} {:?}", v.x, v.y, v.z);
        for link in &self.links {
            let _ = writeln!(text, "<link name=\"{}\">", link.name);
            if link.mass_kg > 0.0 {
                let i = &link.inertia_kg_m2;
                let _ = writeln!(
                    text,
                    "<inertial><origin xyz=\"{}\" rpy=\"{}\"/><mass value=\"{:?}\"/><inertia ixx=\"{:?}\" ixy=\"{:?}\" \
                     ixz=\"{:?}\" iyy=\"{:?}\" iyz=\"{:?}\" izz=\"{:?}\"/></inertial>",
                    three(&link.centre_m),
                    three(&link.rpy_rad),
                    link.mass_kg,
                    i.m11,
                    i.m12,
                    i.m13,
                    i.m22,
                    i.m23,
                    i.m33
                );
            }
            text += "</link>\n";
        }
        for joint in &self.joints {
            let _ = writeln!(
                text,
                "<joint name=\"{}\" type=\"{}\"><parent link=\"{}\"/><child link=\"{}\"/>\
                 <origin xyz=\"{}\" rpy=\"{}\"/><axis xyz=\"{}\"/>\
                 <limit lower=\"-3\" upper=\"3\" effort=\"5\" velocity=\"6\"/></joint>",
                joint.name,
                joint.kind,
                self.links[joint.parent].name,
                self.links[joint.child].name,
                three(&joint.xyz_m),
                three(&joint.rpy_rad),
                three(&joint.axis)
            );
        }
        text + "</robot>\n"
    }

    /// The joints between a link and another one below which it is, from the link up; nothing if it is not below it.
    pub fn chain(&self, base: usize, link: usize) -> Option<Vec<usize>> {
        let mut chain = Vec::new();
        let mut here = link;
        while here != base {
            let joint = here.checked_sub(1)?;
            chain.push(joint);
            here = self.joints[joint].parent;
        }
        Some(chain)
    }

    /// Places every link in the frame of one of them, for positions of joints (zero for those that are not named).
    pub fn poses(&self, base: usize, positions: &BTreeMap<usize, f64>) -> RawPoses {
        let mut poses = RawPoses {
            origins_m: vec![Vector3::zeros(); self.links.len()],
            attitudes: vec![Matrix3::identity(); self.links.len()],
        };
        for (k, joint) in self.joints.iter().enumerate().filter(|(_, joint)| joint.child != base) {
            let position = positions.get(&k).copied().unwrap_or(0.0);
            let origin = poses.origins_m[joint.parent] + poses.attitudes[joint.parent] * joint.xyz_m;
            let attitude = poses.attitudes[joint.parent] * rpy_matrix(&joint.rpy_rad);
            let (slide, turn) = match joint.kind {
                "prismatic" => (joint.axis * position, Matrix3::identity()),
                "fixed" => (Vector3::zeros(), Matrix3::identity()),
                _ => (Vector3::zeros(), rodrigues(&joint.axis, position)),
            };
            poses.origins_m[joint.child] = origin + attitude * slide;
            poses.attitudes[joint.child] = attitude * turn;
        }
        poses
    }

    /// Returns the motion of a point of a link with each of some joints: linear and angular Jacobian, in the axes of
    /// the base.
    pub fn jacobians(
        &self,
        base: usize,
        poses: &RawPoses,
        joints: &[usize],
        link: usize,
        point_m: &Vector3<f64>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let chain = self.chain(base, link).unwrap_or_default();
        let (mut linear, mut angular) = (DMatrix::zeros(3, joints.len()), DMatrix::zeros(3, joints.len()));
        for (column, &k) in joints.iter().enumerate().filter(|(_, k)| chain.contains(k)) {
            let child = self.joints[k].child;
            let axis = poses.attitudes[child] * self.joints[k].axis;
            linear.set_column(column, &axis.cross(&(point_m - poses.origins_m[child])));
            angular.set_column(column, &axis);
        }
        (linear, angular)
    }

    /// Mass matrix and gravity torques for some joints: the sum over all links below the base of what each is by itself.
    pub fn dynamics(
        &self,
        base: usize,
        poses: &RawPoses,
        joints: &[usize],
        gravity_m_s2: &Vector3<f64>,
    ) -> (DMatrix<f64>, DMatrix<f64>) {
        let mut mass = DMatrix::zeros(joints.len(), joints.len());
        let mut weight = DMatrix::zeros(joints.len(), 1);
        for (k, link) in self.links.iter().enumerate().filter(|(k, _)| self.chain(base, *k).is_some()) {
            let attitude = poses.attitudes[k];
            let centre = poses.origins_m[k] + attitude * link.centre_m;
            let axes = attitude * rpy_matrix(&link.rpy_rad);
            let inertia = axes * link.inertia_kg_m2 * axes.transpose();
            let (linear, angular) = self.jacobians(base, poses, joints, k, &centre);
            mass += linear.transpose() * &linear * link.mass_kg + angular.transpose() * inertia * &angular;
            weight -= linear.transpose() * gravity_m_s2 * link.mass_kg;
        }
        (mass, weight)
    }
}

impl RawLink {
    fn random(draw: &mut Draw, index: usize) -> Self {
        let mass_kg = if draw.chance(0.2) { 0.0 } else { draw.within(0.01, 0.3) };
        Self {
            name: format!("link-{index}"),
            mass_kg,
            centre_m: draw.vector(0.05),
            rpy_rad: if draw.chance(0.5) { Vector3::zeros() } else { draw.vector(3.1) },
            inertia_kg_m2: if mass_kg > 0.0 { draw.inertia(mass_kg, 0.1) } else { Matrix3::zeros() },
        }
    }
}
