//! A hand, an object, a plant and the grasp law, ready to run: the ideal experiments of Sec. 6, on an arm if one likes.
//!
//! The law is that of the controller, in `f64` and evaluated at every sub-step, so that nothing but the plant's
//! integrator stands between the paper's equations and what comes out.

use crate::description::Description;
use crate::hands::{FINGER_JOINTS, NEAR_GRASP_RAD};
use blindgrasp::body::JointFriction;
use blindgrasp::body::dynamics::JointVector;
use blindgrasp::body::polyhedron::Polyhedron;
use blindgrasp::body::{FaceContact, FingertipModel};
use blindgrasp::body::{Hand, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp::plant::integrator::Plant;
use blindgrasp::plant::{Motion, ObjectModel, PlantModel};
use blindgrasp_shared::control::{
    self, Account, AttitudeError, Chosen, FrameConfig, Hold, Latch, Laws, LawsConfig, PerGain, Stance,
};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, UnitQuaternion, Vector3};

/// Gravity of the base frame, m/s^2.
pub const GRAVITY_M_S2: Vector3<f64> = Vector3::new(0.0, 0.0, -9.81);
/// Nominal grasping force `f_d` of Table VII, N.
pub const FORCE_N: f64 = 5.0;
/// `K_st` of Table VII, N m.
pub const ATTITUDE_STIFFNESS_NM: f64 = 5e-3;
/// Damping `C_i` of Table VII, N m s/rad.
pub const DAMPING_NM_S: [f64; FINGER_JOINTS] = [4e-4, 4e-4, 3e-4, 2e-4];
/// Damping of the joints of an arm, N m s/rad: `C_a` of Table II in its order of magnitude.
pub const ARM_DAMPING_NM_S: f64 = 5e-2;
/// The fingertip of Table IV, with the damping of Table I.
pub const FINGERTIP: FingertipModel =
    FingertipModel { radius_m: 0.015, stiffness_n_m2: 2.39e6, damping_n_s_m3: 1.0, torsion_n_s_m: 1e4 };
/// Joint friction as of the motors of the experiment: 4.7 mN m of dry friction, that sticks within 0.2 mrad.
pub const FRICTION: JointFriction = JointFriction {
    viscous_nm_s: 2.5e-5,
    coulomb_nm: 4.7e-3,
    presliding_rad: 2e-4,
    presliding_damping_nm_s: 2e-2,
};

/// An object, where it is, and where each finger touches it.
#[derive(Clone, Debug)]
pub struct Held {
    /// Its shape.
    pub shape: Polyhedron,
    /// Mass, kg. Its inertia is that of a uniform body.
    pub mass_kg: f64,
    /// Its centre of mass, m.
    pub position_m: Vector3<f64>,
    /// Its attitude.
    pub attitude: UnitQuaternion<f64>,
    /// One a finger: a face, and a point on it in the object frame, m.
    pub contacts: Vec<(usize, Vector3<f64>)>,
}

/// The cube of Table VI: one finger on a face, the others on the two faces beside it.
pub fn cube() -> Held {
    const SIDE_M: f64 = 0.048;
    Held::centred(Polyhedron::cuboid([SIDE_M; 3]).expect("the cube is a cuboid"), 0.0021, &[2, 1, 0])
}

/// The prism of Table VI: one finger on each side, a few millimetres off the middle, so that it has to find its
/// balance.
pub fn prism() -> Held {
    let shape = Polyhedron::regular_prism(3, 0.060, 0.039).expect("the prism is one");
    let mut held = Held::centred(shape, 0.0015, &[0, 1, 2]);
    held.contacts[0].1 += Vector3::new(0.004, 0.0, 0.003);
    held.contacts[1].1 += Vector3::new(0.0, 0.0, -0.004);
    held
}

impl Held {
    /// An object over the palm, touched in the middle of each of the given faces.
    pub fn centred(shape: Polyhedron, mass_kg: f64, faces: &[usize]) -> Self {
        let contacts = faces.iter().map(|&face| (face, shape.face_centre_m(face))).collect();
        Self {
            shape,
            mass_kg,
            position_m: Vector3::new(0.0, 0.0, 0.125),
            attitude: UnitQuaternion::identity(),
            contacts,
        }
    }
}

/// Everything that a run needs.
#[derive(Clone, Debug)]
pub struct Grasp {
    /// The hand in the user's frames.
    pub description: Description,
    /// The plant's model; change it before [`Self::plant`].
    pub model: PlantModel,
    /// The start of a run; the latch is taken there.
    pub start: Motion,
    /// The laws.
    pub laws: Laws<f64, MAX_JOINTS>,
    /// The laws' memory of the hand at the start.
    pub latch: Latch<f64, MAX_JOINTS, MAX_FINGERS>,
}

impl Grasp {
    /// Puts fingers like those of Table IV to an object, at rest, each pressed in as Eq. 57 asks for. Joints that move
    /// several fingers stay at zero.
    pub fn new(description: Description, held: &Held) -> Self {
        Self::with_fingertips(description, held, FINGERTIP)
    }

    /// The same with fingertips of another material.
    pub fn with_fingertips(description: Description, held: &Held, fingertip: FingertipModel) -> Self {
        let hand: Hand = description.hand();
        let trunk = hand.joint_count() - FINGER_JOINTS * hand.fingertip_count();
        let damping_nm_s = std::array::from_fn(|k| match k.checked_sub(trunk) {
            Some(k) => DAMPING_NM_S[k % FINGER_JOINTS],
            None => ARM_DAMPING_NM_S,
        });
        let config = LawsConfig {
            frame: FrameConfig::least(),
            gains: PerGain { grasp: [FORCE_N, ATTITUDE_STIFFNESS_NM], ..PerGain::all(0.0) },
            chosen: Chosen::ALL,
            attitude_error: AttitudeError::Sine,
            hold: Hold { damping_nm_s, gravity_m_s2: Some(GRAVITY_M_S2) },
        };
        let laws = config.prepare(&hand).expect("the gains of Table VII are good");
        let faces =
            held.contacts.iter().map(|&(face, _)| face_contact(&held.shape, face)).collect::<Vec<_>>();
        let centres =
            equilibrium_centres(held, &faces, &fingertip, laws.grasp.approach_stiffness_n_m(FORCE_N));
        let angles_rad = reach(&hand, trunk, &centres);
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&angles_rad, &mut posture);
        let model = PlantModel {
            fingertips: vec![fingertip; hand.fingertip_count()],
            friction: vec![JointFriction::default(); hand.joint_count()],
            rotor_inertia_kg_m2: Vec::new(),
            joint_limits: false,
            hand,
            object: ObjectModel {
                shape: held.shape.clone(),
                mass_kg: held.mass_kg,
                inertia_kg_m2: held.shape.mass_properties().inertia_per_kg_m2 * held.mass_kg,
            },
            faces,
            hand_gravity_m_s2: GRAVITY_M_S2,
            object_gravity_m_s2: Vector3::zeros(),
            pushes: Vec::new(),
        };
        let start = Motion::at_rest(angles_rad, held.position_m, held.attitude);
        let latch = Latch::of(&model.hand, &posture, &angles_rad);
        Self { description, model, start, laws, latch }
    }

    /// The plant at the start.
    pub fn plant(&self, substep_s: f64) -> Plant {
        match Plant::new(self.model.clone(), self.start, substep_s) {
            Ok(plant) => plant,
            Err(error) => panic!("{error}"),
        }
    }

    /// The law at the plant's motion.
    fn law_at(&self, plant: &Plant) -> (JointVector, Account<f64>) {
        let Motion { angles_rad, speeds_rad_s, .. } = plant.motion();
        let (hand, posture) = (&self.model.hand, plant.posture());
        let held = control::Held::at_latch(hand, posture, &self.latch.frame);
        let stance = Stance { hand, posture, angles_rad, speeds_rad_s, held: &held };
        self.laws.torques(&stance, Some(&self.laws.grip(&self.latch)))
    }

    /// The law's torques for the plant's motion, N m.
    pub fn torques(&self, plant: &Plant) -> JointVector {
        self.law_at(plant).0
    }

    /// Energy `E = K + V_s + V_st + P` of Eq. 40, with the least value of each term at zero, J.
    pub fn energy_j(&self, plant: &Plant) -> f64 {
        let monitor = self.law_at(plant).1;
        plant.kinetic_energy_j()
            + plant.elastic_energy_j()
            + monitor.potentials_j.grasp[0]
            + monitor.potentials_j.grasp[1]
    }

    /// Advances a plant by some sub-steps under the law, and shows it solved at the beginning of each.
    pub fn run(&self, plant: &mut Plant, steps: usize, each: impl FnMut(&Plant)) {
        self.drive(plant, steps, |plant| self.torques(plant), each);
    }

    /// Advances a plant by some sub-steps under any torques, and shows it solved at the beginning of each.
    pub fn drive(
        &self,
        plant: &mut Plant,
        steps: usize,
        torques: impl Fn(&Plant) -> JointVector,
        mut each: impl FnMut(&Plant),
    ) {
        for step in 0..steps {
            let torques = torques(plant);
            if let Err(lost) = plant.solve(&torques) {
                panic!("step {step}: {lost}");
            }
            each(plant);
            plant.advance();
        }
    }
}

/// Contact frame of a face: `C_Y` into the object, `C_Z` as near to the object's z as it gets.
pub fn face_contact(shape: &Polyhedron, face: usize) -> FaceContact {
    let y = -shape.faces[face].normal;
    let up = if y.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let x = y.cross(&up).normalize();
    FaceContact {
        face,
        frame: Matrix3::from_columns(&[x, y, x.cross(&y)]),
        distance_m: shape.faces[face].distance_m,
    }
}

/// Fingertip centres in the base frame over the points of contact, with the indentations at which `k dr^2` is the
/// normal part of the law's pull (Eq. 57).
fn equilibrium_centres(
    held: &Held,
    faces: &[FaceContact],
    fingertip: &FingertipModel,
    stiffness_n_m: f64,
) -> Vec<Vector3<f64>> {
    let mut pressed = vec![0.0; faces.len()];
    let mut centres = vec![Vector3::zeros(); faces.len()];
    // Each round shrinks the error by the ratio of the law's stiffness to the fingertip's, about 1/50.
    for _ in 0..30 {
        for (k, (face, (_, point))) in faces.iter().zip(&held.contacts).enumerate() {
            centres[k] = point - face.frame.column(1) * (fingertip.radius_m - pressed[k]);
        }
        let centroid = centres.iter().sum::<Vector3<f64>>() / centres.len() as f64;
        for (k, face) in faces.iter().enumerate() {
            let force = stiffness_n_m * face.frame.column(1).dot(&(centroid - centres[k]));
            pressed[k] = (force / fingertip.stiffness_n_m2).square_root();
        }
    }
    centres.iter().map(|centre| held.position_m + held.attitude * centre).collect()
}

/// Joint angles that put the fingertips' centres at the targets: damped Newton steps of the fingers' joints.
fn reach(hand: &Hand, trunk: usize, targets_m: &[Vector3<f64>]) -> JointVector {
    let mut angles = [0.0; MAX_JOINTS];
    for k in trunk..hand.joint_count() {
        angles[k] = NEAR_GRASP_RAD[(k - trunk) % FINGER_JOINTS];
    }
    let mut posture = Posture::at_base();
    for _ in 0..100 {
        hand.forward_kinematics(&angles, &mut posture);
        for (i, target) in targets_m.iter().enumerate() {
            let mut jacobian = hand.jacobians(&posture, i).0;
            jacobian.columns_mut(0, trunk).fill(0.0);
            let square = jacobian * jacobian.transpose() + Matrix3::identity() * 1e-9;
            let step =
                square.try_inverse().expect("it is positive definite") * (target - posture.centres_m[i]);
            for (angle, change) in angles.iter_mut().zip(jacobian.tr_mul(&step).iter()) {
                *angle += change;
            }
        }
    }
    hand.forward_kinematics(&angles, &mut posture);
    for (i, target) in targets_m.iter().enumerate() {
        let missed = (target - posture.centres_m[i]).norm();
        assert!(missed < 1e-12, "finger {i} misses its point by {missed:e} m");
    }
    angles
}
