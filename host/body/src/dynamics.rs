//! The hand's own dynamics by the standard recursive algorithms: the mass matrix `H(q)` by composite rigid bodies, the
//! bias torques (Coriolis, centrifugal, gravity) by Newton and Euler with zero accelerations.
//!
//! Everything is in the base frame, with moments about its origin: a body's wrench then passes down to its parent by a
//! plain sum.

use crate::{Hand, MAX_JOINTS, Posture};
use nalgebra::{Matrix3, Vector3};

/// One number a joint.
pub type JointVector = [f64; MAX_JOINTS];

/// A symmetric joint-space matrix; entries of joints on different branches stay zero.
pub type JointMatrix = [[f64; MAX_JOINTS]; MAX_JOINTS];

/// A link in the base frame.
#[derive(Clone, Copy, Debug)]
pub struct Body {
    /// Of the joint before it: unit vector, and a point on it, m.
    axis: Vector3<f64>,
    origin_m: Vector3<f64>,
    mass_kg: f64,
    centre_m: Vector3<f64>,
    /// About the mass centre.
    inertia_kg_m2: Matrix3<f64>,
}

impl Body {
    /// No body: fills the unused capacity.
    pub const NONE: Body =
        Body { axis: ZERO, origin_m: ZERO, mass_kg: 0.0, centre_m: ZERO, inertia_kg_m2: ZERO_INERTIA };
}

const ZERO: Vector3<f64> = Vector3::new(0.0, 0.0, 0.0);
const ZERO_INERTIA: Matrix3<f64> = Matrix3::new(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0);

/// Places the hand's links.
pub fn place_bodies(hand: &Hand, posture: &Posture, bodies: &mut [Body; MAX_JOINTS]) {
    for k in 0..hand.joint_count() {
        let (link, pose) = (hand.link(k), posture.link(k));
        bodies[k] = Body {
            axis: pose.axis(),
            origin_m: pose.origin_m,
            mass_kg: link.mass_kg,
            centre_m: pose.point(&link.mass_centre_m),
            inertia_kg_m2: pose.attitude * link.inertia_kg_m2 * pose.attitude.transpose(),
        };
    }
}

/// Mass matrix `H(q)`, kg m^2: composite rigid bodies. Only the entries of joints on one branch are written.
pub fn mass_matrix(hand: &Hand, bodies: &[Body; MAX_JOINTS], h: &mut JointMatrix) {
    // What a joint carries: mass, first moment and inertia, both about the base's origin.
    let mut carried = [(0.0, Vector3::zeros(), ZERO_INERTIA); MAX_JOINTS];
    for j in (0..hand.joint_count()).rev() {
        let body = &bodies[j];
        let (mass, moment, inertia) = &mut carried[j];
        *mass += body.mass_kg;
        *moment += body.centre_m * body.mass_kg;
        *inertia += body.inertia_kg_m2 + point_inertia(body.mass_kg, &body.centre_m);
        let (mass, moment, inertia) = carried[j];
        if let Some(parent) = hand.parent(j) {
            let below = &mut carried[parent];
            below.0 += mass;
            below.1 += moment;
            below.2 += inertia;
        }
        // Momentum of what joint j carries when it turns at unit speed, and its moment about each axis below.
        let Body { axis, origin_m, .. } = body;
        let linear = axis.cross(&(moment - origin_m * mass));
        let angular = inertia * axis - moment.cross(&axis.cross(origin_m));
        let mut below = Some(j);
        while let Some(k) = below {
            let Body { axis, origin_m, .. } = &bodies[k];
            let entry = axis.dot(&(angular - origin_m.cross(&linear)));
            h[j][k] = entry;
            h[k][j] = entry;
            below = hand.parent(k);
        }
    }
}

/// Inertia of a point mass about the origin.
fn point_inertia(mass_kg: f64, at_m: &Vector3<f64>) -> Matrix3<f64> {
    let (x, y, z) = (at_m.x, at_m.y, at_m.z);
    Matrix3::new(y * y + z * z, -x * y, -x * z, -x * y, x * x + z * z, -y * z, -x * z, -y * z, x * x + y * y)
        * mass_kg
}

/// Bias torques `(dH/2 + S_q) dq + g(q)` of Eq. 19, N m: what the joints have to supply to keep the speeds constant.
pub fn bias_torques(
    hand: &Hand,
    bodies: &[Body; MAX_JOINTS],
    speeds_rad_s: &JointVector,
    gravity_m_s2: &Vector3<f64>,
) -> JointVector {
    #[derive(Clone, Copy)]
    struct Motion {
        spin: Vector3<f64>,
        spin_rate: Vector3<f64>,
        origin: Vector3<f64>,
        acceleration: Vector3<f64>,
    }
    // Gravity is an acceleration of the base upwards.
    let still = Motion {
        spin: Vector3::zeros(),
        spin_rate: Vector3::zeros(),
        origin: Vector3::zeros(),
        acceleration: -gravity_m_s2,
    };
    let mut motions = [still; MAX_JOINTS];
    let mut forces = [Vector3::zeros(); MAX_JOINTS];
    let mut moments = [Vector3::zeros(); MAX_JOINTS];
    for k in 0..hand.joint_count() {
        let body = &bodies[k];
        let parent = hand.parent(k).map_or(still, |parent| motions[parent]);
        let lever = body.origin_m - parent.origin;
        let turning = body.axis * speeds_rad_s[k];
        let motion = Motion {
            spin: parent.spin + turning,
            spin_rate: parent.spin_rate + parent.spin.cross(&turning),
            origin: body.origin_m,
            acceleration: parent.acceleration
                + parent.spin_rate.cross(&lever)
                + parent.spin.cross(&parent.spin.cross(&lever)),
        };
        motions[k] = motion;
        let arm = body.centre_m - body.origin_m;
        let acceleration =
            motion.acceleration + motion.spin_rate.cross(&arm) + motion.spin.cross(&motion.spin.cross(&arm));
        let force = acceleration * body.mass_kg;
        let moment =
            body.inertia_kg_m2 * motion.spin_rate + motion.spin.cross(&(body.inertia_kg_m2 * motion.spin));
        forces[k] = force;
        moments[k] = moment + body.centre_m.cross(&force);
    }
    let mut torques = [0.0; MAX_JOINTS];
    for k in (0..hand.joint_count()).rev() {
        let Body { axis, origin_m, .. } = &bodies[k];
        torques[k] = axis.dot(&(moments[k] - origin_m.cross(&forces[k])));
        if let Some(parent) = hand.parent(k) {
            forces[parent] += forces[k];
            moments[parent] += moments[k];
        }
    }
    torques
}
