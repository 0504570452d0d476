//! The hand of a scene: its numbers checked, handed to the shared crate, and tried for what would break the integrator.

use super::{
    JointParameters,
    check::{Result, all_within, distinct, fail, item, within},
    error::{SceneError, suggestion},
    file::{FingertipFile, HandFile, JointFile, Safety, SceneFile},
    object::{breaks_triangle, tensor},
};
use blindgrasp_body::FingertipModel;
use blindgrasp_body::JointFriction;
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_shared::{
    estimate::Encoder,
    hand::{Fingertip, HandError, Joint, Link},
    math::Real,
};
use nalgebra::{DMatrix, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};

/// Checks a hand and prepares it.
pub(super) fn hand(file: &HandFile, warnings: &mut Vec<String>) -> Result<Hand> {
    let tree = tree(file)?;
    check_safety(&file.safety)?;
    for (k, joint) in file.joints.iter().enumerate() {
        let key = |name: &str| item("hand.joint", k, name);
        check_joint(joint, &key)?;
        if breaks_triangle(&tensor(&key("inertia_kg_m2"), &joint.inertia_kg_m2)?) {
            warnings.push(format!(
                "link `{}`: its inertia is that of no body: one moment is larger than the sum of the two others",
                joint.name
            ));
        }
    }
    for (i, fingertip) in file.fingertips.iter().enumerate() {
        check_fingertip(fingertip, &|name| item("hand.fingertip", i, name))?;
    }
    prepare(file, &tree)
}

/// The kinematics and masses of a hand, whatever size its numbers have: for those who look into what is wrong with it.
pub(super) fn kinematics(file: &HandFile) -> Result<Hand> {
    prepare(file, &tree(file)?)
}

/// The tree of joints, by index.
struct Tree {
    /// Of each joint.
    parents: Vec<Option<usize>>,
    /// Of each fingertip.
    links: Vec<usize>,
}

/// Follows the names.
fn tree(file: &HandFile) -> Result<Tree> {
    // The shared crate checks this too, but not before the lists below have been searched for names.
    let (joints, fingertips) = (file.joints.len(), file.fingertips.len());
    let wrong_count = if joints == 0 {
        Some(HandError::NoJoints)
    } else if joints > MAX_JOINTS {
        Some(HandError::TooManyJoints { count: joints, capacity: MAX_JOINTS })
    } else if fingertips < 2 {
        Some(HandError::TooFewFingertips { count: fingertips })
    } else if fingertips > MAX_FINGERS {
        Some(HandError::TooManyFingertips { count: fingertips, capacity: MAX_FINGERS })
    } else {
        None
    };
    if let Some(error) = wrong_count {
        return Err(hand_error(file, error));
    }
    distinct("hand.joint", file.joints.iter().map(|joint| joint.name.as_str()))?;
    distinct("hand.fingertip", file.fingertips.iter().map(|fingertip| fingertip.name.as_str()))?;
    let find = |key: String, name: &str, before: usize| match file
        .joints
        .iter()
        .position(|joint| joint.name == name)
    {
        Some(index) if index < before => Ok(index),
        Some(_) => fail(key, format!("joint `{name}` does not come before this one"), "move it up"),
        None => fail(
            key,
            format!("there is no joint `{name}`"),
            suggestion(name, file.joints.iter().map(|joint| joint.name.as_str())),
        ),
    };
    let parent = |(k, joint): (usize, &JointFile)| match &joint.parent {
        Some(name) => find(item("hand.joint", k, "parent"), name, k).map(Some),
        None => Ok(None),
    };
    let link =
        |(i, tip): (usize, &FingertipFile)| find(item("hand.fingertip", i, "link"), &tip.link, usize::MAX);
    Ok(Tree {
        parents: file.joints.iter().enumerate().map(parent).collect::<Result<_>>()?,
        links: file.fingertips.iter().enumerate().map(link).collect::<Result<_>>()?,
    })
}

/// Hands the numbers to the shared crate.
fn prepare(file: &HandFile, tree: &Tree) -> Result<Hand> {
    let mut joints = Vec::with_capacity(file.joints.len());
    for (k, (joint, &parent)) in file.joints.iter().zip(&tree.parents).enumerate() {
        let inertia_kg_m2 = tensor(&item("hand.joint", k, "inertia_kg_m2"), &joint.inertia_kg_m2)?;
        joints.push(Joint {
            parent,
            offset_m: joint.offset_m.into(),
            attitude: rotation(joint.rotation_rpy_rad).to_rotation_matrix().into_inner(),
            axis: joint.axis.into(),
            lower_rad: joint.limits_rad[0],
            upper_rad: joint.limits_rad[1],
            link: Link { mass_kg: joint.mass_kg, mass_centre_m: joint.mass_centre_m.into(), inertia_kg_m2 },
        });
    }
    let tips = file.fingertips.iter().zip(&tree.links);
    let fingertips: Vec<Fingertip<f64>> = tips
        .map(|(tip, &link)| Fingertip { link, offset_m: tip.offset_m.into(), radius_m: tip.radius_m })
        .collect();
    Hand::new(&joints, &fingertips).map_err(|error| hand_error(file, error))
}

fn check_safety(safety: &Safety) -> Result<()> {
    for (key, value) in safety.values() {
        if !(value >= key.least && value <= key.most) {
            return fail(
                format!("hand.safety.{}", key.name),
                format!("{value} is out of range"),
                format!("has to be between {} and {}; {} unless given", key.least, key.most, key.default),
            );
        }
    }
    Ok(())
}

fn check_fingertip(fingertip: &FingertipFile, key: &dyn Fn(&str) -> String) -> Result<()> {
    all_within(&key("offset_m"), &fingertip.offset_m, 10.0)?;
    within(&key("radius_m"), fingertip.radius_m, 1e-5, 1.0)?;
    within(&key("stiffness_n_m2"), fingertip.stiffness_n_m2, 1.0, 1e13)?;
    within(&key("damping_n_s_m_per_m2"), fingertip.damping_n_s_m_per_m2, 0.0, 1e12)?;
    let torsion = fingertip.torsional_damping_nm_s_rad_per_m2;
    within(&key("torsional_damping_nm_s_rad_per_m2"), torsion, 0.0, 1e12)
}

fn check_joint(joint: &JointFile, key: &dyn Fn(&str) -> String) -> Result<()> {
    all_within(&key("offset_m"), &joint.offset_m, 10.0)?;
    all_within(&key("rotation_rpy_rad"), &joint.rotation_rpy_rad, 100.0)?;
    all_within(&key("axis"), &joint.axis, 1e6)?;
    all_within(&key("limits_rad"), &joint.limits_rad, 100.0)?;
    let [lower, upper] = joint.limits_rad;
    if lower < upper && !(joint.nominal_rad >= lower && joint.nominal_rad <= upper) {
        return fail(
            key("nominal_rad"),
            format!("{:?} is outside the limits", joint.nominal_rad),
            format!("has to be between {lower} and {upper}"),
        );
    }
    within(&key("mass_kg"), joint.mass_kg, 0.0, 1e4)?;
    all_within(&key("mass_centre_m"), &joint.mass_centre_m, 10.0)?;
    within(&key("damping_gain_nm_s_rad"), joint.damping_gain_nm_s_rad, 0.0, 1e6)?;
    within(&key("torque_limit_nm"), joint.torque_limit_nm, 1e-9, 1e6)?;
    within(&key("speed_limit_rad_s"), joint.speed_limit_rad_s, 1e-6, 1e6)?;
    within(&key("encoder_counts_per_turn"), joint.encoder_counts_per_turn, 8.0, 1e9)?;
    let most_zero_count = f64::from(Encoder::MOST_ZERO_COUNT);
    all_within(&key("encoder_zero_count"), &[f64::from(joint.encoder_zero_count)], most_zero_count)?;
    within(&key("torque_per_volt_nm_v"), joint.torque_per_volt_nm_v, 1e-6, 1e4)
        .map_err(|error| SceneError { remedy: error.remedy + "; its sign is `motor_reversed`", ..error })?;
    within(&key("viscous_friction_nm_s_rad"), joint.viscous_friction_nm_s_rad, 0.0, 1e6)?;
    within(&key("coulomb_friction_nm"), joint.coulomb_friction_nm, 0.0, 1e6)?;
    within(&key("presliding_rad"), joint.presliding_rad, 1e-9, 1.0)?;
    within(&key("presliding_damping_nm_s_rad"), joint.presliding_damping_nm_s_rad, 0.0, 1e6)
}

/// The shared crate's error, with the key and the name of the joint.
fn hand_error(file: &HandFile, error: HandError) -> SceneError {
    let joint_name = |joint: usize| file.joints.get(joint).map_or("?", |joint| joint.name.as_str());
    match error {
        HandError::NoJoints => SceneError::new("hand.joint", "the hand has no joint", "add a [[joint]]"),
        HandError::TooFewFingertips { count } => SceneError::new(
            "hand.fingertip",
            format!(
                "the hand has {count} fingertip{}: grasping needs at least two",
                if count == 1 { "" } else { "s" }
            ),
            "add a [[fingertip]]",
        ),
        HandError::TooManyJoints { .. } => SceneError::new("hand.joint", error.to_string(), "leave some out"),
        HandError::TooManyFingertips { .. } => {
            SceneError::new("hand.fingertip", error.to_string(), "leave some out")
        }
        HandError::ParentNotBefore { joint } => {
            SceneError::new(item("hand.joint", joint, "parent"), error.to_string(), "move it up")
        }
        HandError::MovesNoFingertip { joint } => SceneError::new(
            item("hand.joint", joint, "name"),
            format!("joint `{}` moves no fingertip", joint_name(joint)),
            "leave it out and add its mass to its parent",
        ),
        HandError::Joint { joint, parameter, reason } => {
            let (key, remedy) = match parameter {
                "offset" => ("offset_m", "give finite numbers"),
                "attitude" => ("rotation_rpy_rad", "give finite numbers"),
                "axis" => ("axis", "divide it by its length"),
                "limits" => ("limits_rad", "write [lower, upper]"),
                "mass" => ("mass_kg", "give it in kilograms"),
                "mass centre" => ("mass_centre_m", "give finite numbers"),
                _ => ("inertia_kg_m2", "give the inertia about the mass centre as [xx, yy, zz, xy, xz, yz]"),
            };
            let problem = format!("joint `{}`: {parameter} {reason}", joint_name(joint));
            SceneError::new(item("hand.joint", joint, key), problem, remedy)
        }
        HandError::Fingertip { fingertip, parameter, reason } => {
            let key = match parameter {
                "link" => "link",
                "offset" => "offset_m",
                _ => "radius_m",
            };
            SceneError::new(item("hand.fingertip", fingertip, key), format!("{parameter} {reason}"), "")
        }
    }
}

pub(super) fn joint_parameters(joint: &JointFile, file: &SceneFile) -> JointParameters {
    let friction = file.friction.scale;
    JointParameters {
        name: joint.name.clone(),
        damping_gain_nm_s_rad: joint.damping_gain_nm_s_rad * file.control.damping_scale,
        torque_limit_nm: if file.actuators.torque_limits { joint.torque_limit_nm } else { f64::INFINITY },
        speed_limit_rad_s: joint.speed_limit_rad_s,
        encoder_counts_per_turn: joint.encoder_counts_per_turn,
        encoder_reversed: joint.encoder_reversed,
        encoder_zero_count: joint.encoder_zero_count,
        friction: JointFriction {
            viscous_nm_s: joint.viscous_friction_nm_s_rad * friction,
            coulomb_nm: joint.coulomb_friction_nm * friction,
            presliding_rad: joint.presliding_rad,
            presliding_damping_nm_s: joint.presliding_damping_nm_s_rad * friction,
        },
    }
}

pub(super) fn fingertip_parameters(fingertip: &FingertipFile) -> FingertipModel {
    FingertipModel {
        radius_m: fingertip.radius_m,
        stiffness_n_m2: fingertip.stiffness_n_m2,
        damping_n_s_m3: fingertip.damping_n_s_m_per_m2,
        torsion_n_s_m: fingertip.torsional_damping_nm_s_rad_per_m2,
    }
}

/// Roll, pitch and yaw about fixed axes, in this order.
pub(super) fn rotation(rpy_rad: [f64; 3]) -> UnitQuaternion<f64> {
    let [roll, pitch, yaw] = rpy_rad.map(|angle| (0.5 * angle).sine_cosine());
    let turn = |(sine, cosine): (f64, f64), axis: Vector3<f64>| Quaternion::from_parts(cosine, axis * sine);
    let product = turn(yaw, Vector3::z()) * turn(pitch, Vector3::y()) * turn(roll, Vector3::x());
    UnitQuaternion::new_normalize(product)
}

/// Returns the posture for given joint angles.
pub fn posture(hand: &Hand, angles: &[f64]) -> Posture {
    let mut padded = [0.0; MAX_JOINTS];
    for (padded, angle) in padded.iter_mut().zip(angles) {
        *padded = *angle;
    }
    let mut posture = Posture::at_base();
    hand.forward_kinematics(&padded, &mut posture);
    posture
}

/// Every combination of joint speeds has to move mass: the integrator divides by the mass matrix.
pub(crate) fn moving_masses(file: &HandFile, hand: &Hand, angles: &[f64]) -> Result<()> {
    let count = hand.joint_count();
    let posture = posture(hand, angles);
    let mut mass = DMatrix::<f64>::zeros(count, count);
    for link in 0..count {
        let body = hand.link(link);
        let pose = posture.link(link);
        let centre = pose.point(&body.mass_centre_m);
        let inertia = pose.attitude * body.inertia_kg_m2 * pose.attitude.transpose();
        let chain: Vec<usize> = std::iter::successors(Some(link), |&k| hand.parent(k)).collect();
        for &a in &chain {
            for &b in &chain {
                let (axis_a, axis_b) = (posture.link(a).axis(), posture.link(b).axis());
                let speed = |k: usize, axis: &Vector3<f64>| axis.cross(&(centre - posture.link(k).origin_m));
                mass[(a, b)] += body.mass_kg * speed(a, &axis_a).dot(&speed(b, &axis_b))
                    + axis_a.dot(&(inertia * axis_b));
            }
        }
    }
    let still = |k: usize| {
        fail(
            item("hand.joint", k, "mass_kg"),
            format!("joint `{}` moves no mass", file.joints[k].name),
            "give its link a mass and an inertia",
        )
    };
    if let Some(k) = (0..count).find(|&k| !(mass[(k, k)] > 0.0)) {
        return still(k);
    }
    // Scaled to ones on the diagonal, so that small links next to large ones count in full.
    let scaled = DMatrix::from_fn(count, count, |a, b| {
        mass[(a, b)] / (mass[(a, a)].square_root() * mass[(b, b)].square_root())
    });
    let modes = SymmetricEigen::new(scaled);
    let least = modes.eigenvalues.imin();
    if !(modes.eigenvalues[least] > 1e-9) {
        return still(modes.eigenvectors.column(least).iamax());
    }
    Ok(())
}

/// Fingertips that are in each other's way at the start. The paper's model has no contact between fingers.
pub(super) fn overlaps(file: &HandFile, hand: &Hand, angles: &[f64], warnings: &mut Vec<String>) {
    let posture = posture(hand, angles);
    for b in 0..hand.fingertip_count() {
        for a in 0..b {
            let apart = (posture.centres_m[a] - posture.centres_m[b]).norm();
            let overlap = hand.radius_m(a) + hand.radius_m(b) - apart;
            if overlap > 0.0 {
                warnings.push(format!(
                    "fingertips `{}` and `{}` overlap by {:.1} mm at the start",
                    file.fingertips[a].name,
                    file.fingertips[b].name,
                    overlap * 1e3
                ));
            }
        }
    }
}
