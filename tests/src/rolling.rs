//! Random states of a hand and an object that its fingertips touch, and what the plant makes of them: velocities that obey the
//! rolling constraints, accelerations, and contact forces.
//!
//! The plant has no function for accelerations. They are taken from what it does: the velocities `v(h)` after one sub-step of
//! `h` are those that obey the constraints at `h = 0`, and their derivative there is the acceleration. (Half of the step is done
//! with the constraint of its beginning and half with that of its end; the multipliers of both ends differ by what the rate of
//! the constraint takes, and their mean is the multiplier of Eq. 28.) So it is the integrator itself that is looked at.

use crate::numeric::Taylor;
use crate::random::Draw;
use blindgrasp::body::FaceContact;
use blindgrasp::body::dynamics::JointVector;
use blindgrasp::body::{MAX_JOINTS, Posture};
use blindgrasp::model::Scene;
use blindgrasp::plant::integrator::Plant;
use blindgrasp::plant::{Motion, PlantModel};
use blindgrasp::sim;
use blindgrasp_shared::math::norm;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// Steps at which the derivative is tried, as shares of the largest, and how the largest is looked for.
const SAMPLES: [usize; 2] = [5, 8];
const LARGEST_S: f64 = 1e-4;
const SMALLEST_S: f64 = 1e-9;

/// A model in a motion, under torques.
#[derive(Clone, Debug)]
pub struct State {
    /// With faces, fingertips and gravity of its own.
    pub model: PlantModel,
    /// Velocities need not obey the constraints.
    pub motion: Motion,
    /// Torques of the motors, N m.
    pub torques_nm: JointVector,
}

/// The plant's response to a state, each kind of number for itself.
#[derive(Clone, Debug)]
pub struct Response {
    /// `(dq, dx, w)` that obey the constraints: those of the state, projected.
    pub velocities: Vec<f64>,
    /// `(ddq, ddx, dw)` with these velocities.
    pub accelerations: Vec<f64>,
    /// `lambda_iX`, `lambda_iZ` of every contact, N.
    pub multipliers_n: Vec<f64>,
    /// Normal force of every contact, N.
    pub normal_n: Vec<f64>,
    /// Torsional torque of every contact, N m.
    pub torsion_nm: Vec<f64>,
    /// Largest error of the derivatives, relative to the largest number of their kind.
    pub uncertainty: f64,
}

/// Joints that move more than one fingertip.
pub fn trunk(model: &PlantModel) -> Vec<usize> {
    let fingers = 0..model.hand.fingertip_count();
    let moved = |k: usize| fingers.clone().filter(|&i| model.hand.moves(k, i)).count();
    (0..model.hand.joint_count()).filter(|&k| moved(k) > 1).collect()
}

impl State {
    /// A random state of a scene's hand and object: joints up to 0.4 rad from where the scene starts (those of an arm 1 rad),
    /// the object in any attitude, every fingertip pressed into the face that it is nearest to, anywhere on it. None where a
    /// fingertip finds no face.
    ///
    /// Half of the states have the scene's fingertips; in the other half they are up to a million times easier to twist and to
    /// dampen, so that not everything is governed by the largest of their forces.
    pub fn random(scene: &Scene, gravity_m_s2: &Vector3<f64>, draw: &mut Draw) -> Option<Self> {
        let mut model = sim::model(scene);
        (model.hand_gravity_m_s2, model.object_gravity_m_s2) = (*gravity_m_s2, *gravity_m_s2);
        model.friction.fill(blindgrasp::body::JointFriction::default());
        if draw.chance(0.5) {
            for fingertip in &mut model.fingertips {
                fingertip.torsion_n_s_m *= 10_f64.powf(draw.within(-6.0, 0.0));
                fingertip.damping_n_s_m3 *= 10_f64.powf(draw.within(-6.0, 0.0));
            }
        }
        let (hand, trunk, size_m) = (&model.hand, trunk(&model), model.object.shape.radius_m());
        let mut angles_rad = [0.0; MAX_JOINTS];
        for (k, start_rad) in scene.start.angles_rad.iter().enumerate() {
            let off_rad = if trunk.contains(&k) { 1.0 } else { 0.4 };
            angles_rad[k] = start_rad + draw.within(-off_rad, off_rad);
        }
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&angles_rad, &mut posture);
        let fingers = hand.fingertip_count();
        let centre = posture.centres_m[..fingers].iter().sum::<Vector3<f64>>() / fingers as f64;
        let mut motion = Motion::at_rest(
            angles_rad,
            centre + draw.vector(0.2 * size_m),
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(draw.rotation())),
        );
        for i in 0..fingers {
            let share = draw.within(0.02, 0.2);
            model.faces[i] = touch(&model, &mut motion, &trunk, i, share)?;
        }
        for k in 0..model.hand.joint_count() {
            motion.speeds_rad_s[k] = draw.within(-2.0, 2.0);
        }
        (motion.velocity_m_s, motion.spin_rad_s) = (draw.vector(0.5), draw.vector(5.0));
        let state = Self { model, motion, torques_nm: draw.joints(0.3) };
        // The plant looks whether every fingertip is on its face, and whether the constraints are independent.
        state.step(LARGEST_S).map(|_| state)
    }

    /// The plant after one sub-step, solved, with the multipliers of both ends.
    fn step(&self, substep_s: f64) -> Option<(Plant, Vec<f64>)> {
        let mut plant = Plant::new(self.model.clone(), self.motion, substep_s).ok()?;
        plant.solve(&self.torques_nm).ok()?;
        let first = plant.forces().to_vec();
        plant.advance();
        plant.solve(&self.torques_nm).ok()?;
        let both = first.iter().zip(plant.forces());
        let means = both
            .flat_map(|(a, b)| [0.5 * (a.lambda_x_n + b.lambda_x_n), 0.5 * (a.lambda_z_n + b.lambda_z_n)])
            .collect();
        Some((plant, means))
    }

    /// Everything that a sub-step says, in one list: velocities, multipliers, normal forces, torsion.
    fn numbers(&self, substep_s: f64) -> Vec<f64> {
        let (plant, mut multipliers) = self.step(substep_s).expect("as the step before");
        let mut numbers = velocities(plant.motion(), self.model.hand.joint_count());
        numbers.append(&mut multipliers);
        numbers.extend(plant.forces().iter().map(|force| force.normal_n));
        numbers.extend(plant.forces().iter().map(|force| force.torsion_nm));
        numbers
    }

    /// Returns the plant's response to the state. The steps are those whose derivatives are the least uncertain: the
    /// smaller they are, the less is left of the fastest motion and the more is rounded.
    pub fn response(&self) -> Response {
        let joints = self.model.hand.joint_count();
        let speeds = joints + 6;
        let mut projected = self.clone();
        // Twice: what is left of the given velocities after the first time is rounding.
        for _ in 0..2 {
            let best = projected.best(|taylor| uncertainty(&taylor.value[..speeds], &taylor.doubt[..speeds]));
            set_velocities(&mut projected.motion, &best.value[..speeds], joints);
        }
        let contacts = self.model.faces.len();
        let kinds = |taylor: &Taylor| {
            let (slope, slope_doubt) = (&taylor.slope[..speeds], &taylor.slope_doubt[..speeds]);
            let split = [0..joints, joints..joints + 3, joints + 3..speeds];
            let moved =
                split.iter().map(|kind| uncertainty(&slope[kind.clone()], &slope_doubt[kind.clone()]));
            let forces = uncertainty(
                &taylor.value[speeds..speeds + 3 * contacts],
                &taylor.doubt[speeds..speeds + 3 * contacts],
            );
            moved.fold(forces, f64::max)
        };
        let best = projected.best(kinds);
        let forces = &best.value[speeds..];
        Response {
            velocities: velocities(&projected.motion, joints),
            accelerations: best.slope[..speeds].to_vec(),
            multipliers_n: forces[..2 * contacts].to_vec(),
            normal_n: forces[2 * contacts..3 * contacts].to_vec(),
            torsion_nm: forces[3 * contacts..].to_vec(),
            uncertainty: kinds(&best),
        }
    }

    /// Value and slope of all numbers at a step of zero, with the steps that leave the least doubt.
    fn best(&self, doubt: impl Fn(&Taylor) -> f64) -> Taylor {
        let mut best: Option<(f64, Taylor)> = None;
        let mut largest_s = LARGEST_S;
        while largest_s > SMALLEST_S {
            for samples in SAMPLES {
                let taylor = Taylor::at_zero(largest_s, samples, |substep_s| self.numbers(substep_s));
                let doubt = doubt(&taylor);
                if best.as_ref().is_none_or(|(least, _)| doubt < *least) {
                    best = Some((doubt, taylor));
                }
            }
            largest_s *= 0.4;
        }
        best.expect("several steps").1
    }
}

/// Largest of some doubts, relative to the largest of their numbers.
fn uncertainty(numbers: &[f64], doubts: &[f64]) -> f64 {
    let largest = |list: &[f64]| list.iter().fold(0.0, |most: f64, number| most.max(number.abs()));
    largest(doubts) / largest(numbers)
}

/// Velocities `(dq, dx, w)` of a motion.
pub fn velocities(motion: &Motion, joints: usize) -> Vec<f64> {
    let object = motion.velocity_m_s.iter().chain(motion.spin_rad_s.iter());
    motion.speeds_rad_s[..joints].iter().chain(object).copied().collect()
}

fn set_velocities(motion: &mut Motion, velocities: &[f64], joints: usize) {
    motion.speeds_rad_s[..joints].copy_from_slice(&velocities[..joints]);
    motion.velocity_m_s = Vector3::from_row_slice(&velocities[joints..joints + 3]);
    motion.spin_rad_s = Vector3::from_row_slice(&velocities[joints + 3..]);
}

/// Turns the joints of a finger until its fingertip is pressed into the nearest face by a share of its radius.
fn touch(
    model: &PlantModel,
    motion: &mut Motion,
    trunk: &[usize],
    finger: usize,
    share: f64,
) -> Option<FaceContact> {
    let (hand, shape) = (&model.hand, &model.object.shape);
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&motion.angles_rad, &mut posture);
    let height_m = |posture: &Posture, face: usize| {
        let local = motion.attitude.inverse() * (posture.centres_m[finger] - motion.position_m);
        shape.faces[face].normal.dot(&local) - shape.faces[face].distance_m
    };
    let face =
        (0..shape.faces.len()).max_by(|&a, &b| height_m(&posture, a).total_cmp(&height_m(&posture, b)))?;
    let outwards = motion.attitude * shape.faces[face].normal;
    let wanted_m = (1.0 - share) * model.fingertips[finger].radius_m;
    for _ in 0..20 {
        let missing_m = wanted_m - height_m(&posture, face);
        let mut slope = hand.jacobians(&posture, finger).0.tr_mul(&outwards);
        trunk.iter().for_each(|&k| slope[k] = 0.0);
        let step = slope * (missing_m / slope.norm_squared());
        // A finger that would have to turn far is at its end.
        if !(step.amax() < 0.5) {
            return None;
        }
        motion.angles_rad.iter_mut().zip(step.iter()).for_each(|(angle, step)| *angle += step);
        hand.forward_kinematics(&motion.angles_rad, &mut posture);
    }
    if !((wanted_m - height_m(&posture, face)).abs() < 1e-9) {
        return None;
    }
    // Any direction on the face: the frame turns about its normal from one face to the next.
    let y = -shape.faces[face].normal;
    let across = if y.x.abs() < 0.8 { Vector3::x() } else { Vector3::y() };
    let mut x = y.cross(&across);
    x /= norm(&x);
    Some(FaceContact {
        face,
        frame: nalgebra::Matrix3::from_columns(&[x, y, x.cross(&y)]),
        distance_m: shape.faces[face].distance_m,
    })
}
