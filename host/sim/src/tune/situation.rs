//! Situations that are linearised: a grasp at rest with the law that holds it, and the hand that touches nothing.

use super::TuneError;
use crate::{laws, model};
use blindgrasp_body::dynamics::{Body, JointVector, place_bodies};
use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_body::{FaceContact, JointFriction, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_model::{HandFile, HandModel, Scene, posture};
use blindgrasp_plant::small_motions::SmallMotions;
use blindgrasp_plant::{ContactForce, Motion, ObjectModel, Plant, PlantModel, integrator};
use blindgrasp_shared::control::{FrameConfig, Held, Hold, Latch, Laws, LawsConfig, Stance};
use blindgrasp_shared::math::Real;
use nalgebra::{DMatrix, DVector, Matrix3, UnitQuaternion, Vector3};

/// Mass of the nominal object, kg: that of the paper's cube. A lighter one is harder to hold.
const NOMINAL_KG: f64 = 2e-3;
/// Step by which a grasp is brought to rest, s.
const STEP_S: f64 = 1e-4;
/// Longest time for that, s.
const LONGEST_S: f64 = 20.0;
/// Time in which fingertips come to press, s.
const BEGUN_S: f64 = 0.02;
/// Kinetic energy at rest, as a share of the elastic energy of the fingertips: what could still swing changes forces by less than
/// a percent. Slow creep, held by the torsional viscosity of fingertips alone, is none of it.
const REST_SHARE: f64 = 1e-6;
/// Time of slow motion after which it is at rest, s.
const REST_S: f64 = 0.1;
/// Change of an angle or a speed by which the law's slopes are measured, rad or rad/s.
const CHANGE: f64 = 1e-6;

/// A situation at rest: small motions of the hand and what it holds, and what the law makes of them.
#[derive(Clone, Debug)]
pub struct Situation {
    /// Small motions of the hand and what it holds.
    pub motions: SmallMotions,
    /// Slopes of the law's torques with the joints' angles, N m/rad.
    pub stiffness_nm_rad: DMatrix<f64>,
    /// Slopes of the law's torques with the joints' speeds, N m s/rad: those of the damping gains and whatever else damps.
    pub damping_nm_s_rad: DMatrix<f64>,
    /// The damping gains, N m s/rad.
    pub gains_nm_s_rad: DVector<f64>,
    /// Inertia of each joint while all others are loose, kg m^2.
    pub inertias_kg_m2: Vec<f64>,
}

impl Situation {
    /// The grasp of a scene without joint friction: as it begins, when fingertips press and have not rolled yet, where its law would
    /// come to rest, and the hand before it touches. Fingertips roll. The gains of the laws are so many times as firm as the scene says.
    ///
    /// # Errors
    /// The reason for which there is none.
    pub fn of_scene(scene: &Scene, firmness: f64) -> Result<Vec<Self>, TuneError> {
        let mut model = model(scene);
        model.joint_limits = false;
        model.pushes.clear();
        model.friction = vec![JointFriction::default(); scene.joints.len()];
        let laws = firmer(scene.laws_config(), firmness).prepare(&scene.hand)?;
        let angles_rad = start_rad(scene);
        let latch = Latch::of(&model.hand, &posture(&model.hand, &angles_rad), &angles_rad);
        let start = Motion::at_rest(angles_rad, scene.start.position_m, scene.start.attitude);
        let [begun, rest] = settle(&model, start, &laws, &latch)?;
        let held = |(motion, forces): (Motion, Vec<ContactForce>)| {
            Self::held(&model, &motion, &forces, &laws, &latch)
        };
        Ok(vec![held(begun), held(rest), Self::free(&model, &start, &laws)])
    }

    /// The grasp of a scene at an instant of its simulation, where it is about at rest; none where contact does not roll.
    ///
    /// # Errors
    /// A gain that is out of its range.
    pub fn of_plant(scene: &Scene, plant: &Plant) -> Result<Option<Self>, TuneError> {
        let Plant::Rolling(plant) = plant else { return Ok(None) };
        let (model, laws) = (model(scene), laws(scene)?);
        let latch = Latch::of(&model.hand, &posture(&model.hand, &scene.start.angles_rad), &start_rad(scene));
        Ok(Some(Self::held(&model, plant.motion(), plant.forces(), &laws, &latch)))
    }

    /// The nominal grasp of a hand, the worst case: in its nominal posture it presses, along the pulls of the law, on faces across
    /// them of an object of 2 g; and the hand in that posture alone. No joint has friction. The gains of the laws are so many times as
    /// firm as its file says.
    ///
    /// # Errors
    /// The reason for which there is none.
    pub fn nominal(
        hand: &HandModel,
        file: &HandFile,
        rotors: bool,
        firmness: f64,
    ) -> Result<Vec<Self>, TuneError> {
        let laws_config = firmer(laws_of(hand), firmness);
        let laws: Laws<f64, MAX_JOINTS> = laws_config.prepare(&hand.hand)?;
        let mut angles_rad = [0.0; MAX_JOINTS];
        for (angle, joint) in angles_rad.iter_mut().zip(&file.joints) {
            *angle = joint.nominal_rad;
        }
        let here = posture(&hand.hand, &angles_rad);
        let fingertips = file.fingertip_models();
        let count = fingertips.len();
        let centres = &here.centres_m[..count];
        let centroid_m = centres.iter().sum::<Vector3<f64>>() / count as f64;
        let force_n = laws.gains().grasp[0];
        let stiffness_n_m = laws.grasp.approach_stiffness_n_m(force_n);
        let mut faces = Vec::with_capacity(count);
        let mut forces = Vec::with_capacity(count);
        for (face, (fingertip, centre)) in fingertips.iter().zip(centres).enumerate() {
            let pull_m = centroid_m - centre;
            let normal_n = stiffness_n_m * pull_m.norm();
            let indentation_m = (normal_n / fingertip.stiffness_n_m2).square_root();
            let inward = pull_m.normalize();
            let near = if inward.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
            let across = (near - inward * inward.dot(&near)).normalize();
            let frame = Matrix3::from_columns(&[inward.cross(&across), inward, across]);
            let distance_m = pull_m.norm() - (fingertip.radius_m - indentation_m);
            faces.push(FaceContact { face, frame, distance_m });
            forces.push(ContactForce { normal_n, ..ContactForce::default() });
        }
        let size_m = centres.iter().map(|centre| (centroid_m - centre).norm()).sum::<f64>() / count as f64;
        let gravity = laws_config.hold.gravity_m_s2.unwrap_or_default();
        let model = PlantModel {
            hand: hand.hand.clone(),
            fingertips,
            friction: vec![JointFriction::default(); file.joints.len()],
            rotor_inertia_kg_m2: if rotors {
                file.joints.iter().map(|joint| joint.rotor_inertia_kg_m2).collect()
            } else {
                Vec::new()
            },
            joint_limits: false,
            object: ObjectModel {
                // It has no shape but its faces: nothing rolls far.
                shape: Polyhedron::cuboid([size_m; 3])
                    .map_err(|error| TuneError::NoGrasp(error.to_string()))?,
                mass_kg: NOMINAL_KG,
                inertia_kg_m2: Matrix3::identity() * (NOMINAL_KG * size_m * size_m / 6.0),
            },
            faces,
            hand_gravity_m_s2: gravity,
            object_gravity_m_s2: Vector3::zeros(),
            pushes: Vec::new(),
        };
        let latch = Latch::of(&model.hand, &here, &angles_rad);
        let motion = Motion::at_rest(angles_rad, centroid_m, UnitQuaternion::identity());
        Ok(vec![Self::held(&model, &motion, &forces, &laws, &latch), Self::free(&model, &motion, &laws)])
    }

    /// A grasp.
    fn held(
        model: &PlantModel,
        motion: &Motion,
        forces: &[ContactForce],
        laws: &Laws<f64, MAX_JOINTS>,
        latch: &Latch<f64, MAX_JOINTS, MAX_FINGERS>,
    ) -> Self {
        let joints = model.hand.joint_count();
        let torques = |angle: Option<usize>, speed: Option<usize>, change: f64| {
            let (mut angles_rad, mut speeds_rad_s) = (motion.angles_rad, [0.0; MAX_JOINTS]);
            angle.into_iter().for_each(|k| angles_rad[k] += change);
            speed.into_iter().for_each(|k| speeds_rad_s[k] += change);
            torques_nm(model, laws, latch, &angles_rad, &speeds_rad_s)
        };
        let slopes = |column: &dyn Fn(usize, f64) -> [f64; MAX_JOINTS]| {
            let columns: Vec<_> = (0..joints).map(|k| (column(k, CHANGE), column(k, -CHANGE))).collect();
            DMatrix::from_fn(joints, joints, |row, k| {
                (columns[k].0[row] - columns[k].1[row]) / (2.0 * CHANGE)
            })
        };
        Self {
            motions: SmallMotions::about(model, motion, forces),
            stiffness_nm_rad: slopes(&|k, change| torques(Some(k), None, change)),
            damping_nm_s_rad: slopes(&|k, change| torques(None, Some(k), change)),
            gains_nm_s_rad: gains(model, laws),
            inertias_kg_m2: inertias_alone_kg_m2(model, motion),
        }
    }

    /// A hand that touches nothing: it is only damped, with its weight held.
    fn free(model: &PlantModel, motion: &Motion, laws: &Laws<f64, MAX_JOINTS>) -> Self {
        let joints = model.hand.joint_count();
        let none = DMatrix::zeros(joints, joints);
        let gains_nm_s_rad = gains(model, laws);
        Self {
            motions: SmallMotions {
                inertia: mass_matrix(model, motion),
                damping: none.clone(),
                stiffness: none.clone(),
                joints: DMatrix::identity(joints, joints),
            },
            stiffness_nm_rad: none,
            damping_nm_s_rad: -DMatrix::from_diagonal(&gains_nm_s_rad),
            gains_nm_s_rad,
            inertias_kg_m2: inertias_alone_kg_m2(model, motion),
        }
    }

    /// Sets the damping gains, N m s/rad.
    pub fn set_gains(&mut self, gains_nm_s_rad: DVector<f64>) {
        self.damping_nm_s_rad += DMatrix::from_diagonal(&(&self.gains_nm_s_rad - &gains_nm_s_rad));
        self.gains_nm_s_rad = gains_nm_s_rad;
    }
}

/// Laws with gains so many times as firm.
fn firmer(laws: LawsConfig<f64, MAX_JOINTS>, firmness: f64) -> LawsConfig<f64, MAX_JOINTS> {
    LawsConfig { gains: laws.gains.map(|gain| firmness * gain), ..laws }
}

/// The laws of a hand's file in the precision of the plant.
fn laws_of(hand: &HandModel) -> LawsConfig<f64, MAX_JOINTS> {
    let laws = &hand.config.laws;
    LawsConfig {
        gains: laws.gains.map(|gain| f64::from(*gain)),
        chosen: laws.chosen,
        attitude_error: laws.attitude_error,
        frame: FrameConfig {
            damping_s: laws.frame.damping_s.into(),
            turn_damping_s: laws.frame.turn_damping_s.into(),
            reach_m: laws.frame.reach_m.into(),
        },
        hold: Hold {
            damping_nm_s: laws.hold.damping_nm_s.map(f64::from),
            gravity_m_s2: laws.hold.gravity_m_s2.map(|gravity| gravity.map(f64::from)),
        },
    }
}

/// Torques of the whole grip, N m.
fn torques_nm(
    model: &PlantModel,
    laws: &Laws<f64, MAX_JOINTS>,
    latch: &Latch<f64, MAX_JOINTS, MAX_FINGERS>,
    angles_rad: &[f64; MAX_JOINTS],
    speeds_rad_s: &[f64; MAX_JOINTS],
) -> [f64; MAX_JOINTS] {
    let mut posture = Posture::at_base();
    model.hand.forward_kinematics(angles_rad, &mut posture);
    let hand = &model.hand;
    let holds = laws.gains().frame.iter().any(|&gain| gain > 0.0);
    let held = if holds { Held::at_latch(hand, &posture, &latch.frame) } else { Held::nothing() };
    let stance = Stance { hand, posture: &posture, angles_rad, speeds_rad_s, held: &held };
    laws.torques(&stance, Some(&laws.grip(latch))).0
}

/// Joint angles at the start of a scene, rad.
fn start_rad(scene: &Scene) -> JointVector {
    let mut angles_rad = [0.0; MAX_JOINTS];
    angles_rad[..scene.start.angles_rad.len()].copy_from_slice(&scene.start.angles_rad);
    angles_rad
}

/// The damping gains of the joints, N m s/rad.
fn gains(model: &PlantModel, laws: &Laws<f64, MAX_JOINTS>) -> DVector<f64> {
    DVector::from_column_slice(&laws.config().hold.damping_nm_s[..model.hand.joint_count()])
}

/// Brings a grasp to rest under its law, acting at once and without its damping. Whenever the kinetic energy has passed a peak,
/// everything is stopped. Returns it as it begins, and at rest.
fn settle(
    model: &PlantModel,
    start: Motion,
    laws: &Laws<f64, MAX_JOINTS>,
    latch: &Latch<f64, MAX_JOINTS, MAX_FINGERS>,
) -> Result<[(Motion, Vec<ContactForce>); 2], TuneError> {
    let still = |motion: &Motion| Motion::at_rest(motion.angles_rad, motion.position_m, motion.attitude);
    let put = |motion: Motion| {
        integrator::Plant::new(model.clone(), motion, STEP_S)
            .map_err(|error| TuneError::NoGrasp(error.to_string()))
    };
    let mut plant = put(start)?;
    let (mut before_j, mut quiet_s) = (0.0, 0.0);
    let mut begun = None;
    for step in 0..(LONGEST_S / STEP_S) as usize {
        let angles_rad = plant.motion().angles_rad;
        let torques_nm = torques_nm(model, laws, latch, &angles_rad, &[0.0; MAX_JOINTS]);
        plant.solve(&torques_nm).map_err(|lost| TuneError::NoGrasp(lost.to_string()))?;
        let (energy_j, elastic_j) = (plant.kinetic_energy_j(), plant.elastic_energy_j());
        let is_past_peak = energy_j < before_j;
        let is_quiet = energy_j < REST_SHARE * elastic_j;
        quiet_s = if is_quiet { quiet_s + STEP_S } else { 0.0 };
        let here = || (still(plant.motion()), plant.forces().to_vec());
        if step as f64 * STEP_S >= BEGUN_S {
            let begun = begun.get_or_insert_with(here);
            if is_quiet && is_past_peak || quiet_s > REST_S {
                return Ok([begun.clone(), here()]);
            }
        }
        if is_past_peak {
            (plant, before_j, quiet_s) = (put(still(plant.motion()))?, 0.0, 0.0);
        } else {
            before_j = energy_j;
            plant.advance();
        }
    }
    Err(TuneError::NoGrasp(format!("it does not come to rest within {LONGEST_S} s")))
}

/// The mass matrix of the hand alone, rotors included.
fn mass_matrix(model: &PlantModel, motion: &Motion) -> DMatrix<f64> {
    let joints = model.hand.joint_count();
    let mut bodies = [Body::NONE; MAX_JOINTS];
    place_bodies(&model.hand, &posture(&model.hand, &motion.angles_rad[..joints]), &mut bodies);
    let mut mass = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    model.mass_matrix(&bodies, &mut mass);
    DMatrix::from_fn(joints, joints, |a, b| mass[a][b])
}

/// Inertia of each joint while all others are loose, `1 / (M^-1)_kk`, rotors included, kg m^2.
fn inertias_alone_kg_m2(model: &PlantModel, motion: &Motion) -> Vec<f64> {
    // Positive definite, as is checked where a hand is read; if not, nothing is known.
    mass_matrix(model, motion).cholesky().map_or_else(
        || vec![f64::NAN; model.hand.joint_count()],
        |factor| factor.inverse().diagonal().iter().map(|entry| 1.0 / entry).collect(),
    )
}
