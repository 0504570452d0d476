//! Physics against closed forms, conservation laws and itself at other steps.

mod grasps;
mod joints;
mod links;
mod order;
mod robustness;
mod tables;

use super::*;
use crate::ObjectModel;
use crate::coulomb::{Friction, Path};
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{FingertipModel, Hand, JointFriction};
use blindgrasp_shared::hand::{Fingertip, Joint, Link};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, UnitQuaternion};

const GRAVITY_M_S2: f64 = 9.81;
const TIP: FingertipModel =
    FingertipModel { radius_m: 0.015, stiffness_n_m2: 2.39e6, damping_n_s_m3: 5e4, torsion_n_s_m: 0.0 };

/// A finger of one joint that turns about the vertical, at a place; its fingertip is one arm's length away from the joint.
fn arm(joint_m: Vector3<f64>, tip_m: Vector3<f64>) -> (Joint<f64>, Vector3<f64>) {
    let arm_m = tip_m - joint_m;
    let link = Link {
        mass_kg: 0.02,
        mass_centre_m: 0.5 * arm_m,
        inertia_kg_m2: Matrix3::identity() * (0.02 * arm_m.norm_squared() / 12.0),
    };
    let joint = Joint {
        parent: None,
        offset_m: joint_m,
        attitude: Matrix3::identity(),
        axis: Vector3::z(),
        lower_rad: -1.0,
        upper_rad: 1.0,
        link,
    };
    (joint, arm_m)
}

/// Fingers of one joint each.
fn hand(arms: &[(Joint<f64>, Vector3<f64>)]) -> Hand {
    let joints: Vec<_> = arms.iter().map(|(joint, _)| *joint).collect();
    let fingertips: Vec<_> = arms
        .iter()
        .enumerate()
        .map(|(link, (_, arm_m))| Fingertip { link, offset_m: *arm_m, radius_m: TIP.radius_m })
        .collect();
    Hand::new(&joints, &fingertips).unwrap()
}

/// A hand far away, that does nothing.
fn no_hand() -> Hand {
    let far = |x_m: f64| arm(Vector3::new(x_m, 3.0, 3.0), Vector3::new(x_m, 3.1, 3.0));
    hand(&[far(3.0), far(4.0)])
}

fn object(shape: Polyhedron, mass_kg: f64) -> ObjectModel {
    let inertia_kg_m2 = shape.mass_properties().inertia_per_kg_m2 * mass_kg;
    ObjectModel { shape, mass_kg, inertia_kg_m2 }
}

fn model(hand: Hand, object: ObjectModel) -> PlantModel {
    PlantModel {
        fingertips: vec![TIP; hand.fingertip_count()],
        friction: vec![JointFriction::default(); hand.joint_count()],
        rotor_inertia_kg_m2: Vec::new(),
        joint_limits: false,
        hand,
        object,
        faces: Vec::new(),
        hand_gravity_m_s2: Vector3::zeros(),
        object_gravity_m_s2: Vector3::new(0.0, 0.0, -GRAVITY_M_S2),
        pushes: Vec::new(),
    }
}

fn table(friction: f64) -> Table {
    Table {
        point_m: Path::constant(Vector3::zeros()),
        normal: Vector3::z(),
        object_friction: friction,
        fingertip_friction: Friction { sliding: friction, torsion_m: 0.0 },
    }
}

/// No friction between fingertips and object, and some tables.
fn world(fingertips: usize, tables: Vec<Table>) -> World {
    World { fingertip_friction: vec![Friction::default(); fingertips], tables, ..World::default() }
}

fn at(position_m: Vector3<f64>) -> Motion {
    Motion::at_rest([0.0; MAX_JOINTS], position_m, UnitQuaternion::identity())
}

impl Plant {
    /// Kinetic and elastic energy at the half step before this instant, of which the integrator's balance is exact. Joints have
    /// to be alone on their branches: then their inertia does not change.
    fn half_step_energy_j(&self) -> f64 {
        let v = head(&self.before.object);
        let inertia = self.now.inertia_kg_m2(&self.model);
        let spin = solve_inertia(&inertia, &self.spin_momentum);
        let joints: f64 = (0..self.model.hand.joint_count())
            .map(|k| self.now.mass[k][k] * self.before.joints[k] * self.before.joints[k])
            .sum();
        let elastic: f64 = self
            .touches
            .iter()
            .zip(&self.rates_m_s)
            .map(|(touch, rate)| touch.material.energy_j(touch.depth_m - 0.5 * self.substep_s * rate))
            .sum();
        let taken_away = |relief: &Relief| {
            let rate = -relief.rows.times(&self.mass.branches, &self.before)[0];
            relief.touch.material.energy_j(relief.touch.depth_m - 0.5 * self.substep_s * rate)
        };
        let taken_away: f64 = self.reliefs.iter().map(taken_away).sum();
        let object = self.model.object.mass_kg * v.norm_squared() + spin.dot(&self.spin_momentum);
        0.5 * (object + joints) + elastic - taken_away
    }

    /// Moves on by a time under constant torques.
    fn run(&mut self, torques_nm: &[f64], time_s: f64, mut see: impl FnMut(&Self)) {
        let mut torques = [0.0; MAX_JOINTS];
        torques[..torques_nm.len()].copy_from_slice(torques_nm);
        for _ in 0..(time_s / self.substep_s).round() as u64 {
            self.solve(&torques).unwrap();
            see(self);
            self.advance();
        }
        self.solve(&torques).unwrap();
        see(self);
    }
}
