//! The hand of a scene: its numbers checked, handed to the shared crate, and tried for what would break the integrator.

use super::{
    JointParameters,
    build::control,
    check::{Refused, Result, all_within, fail, item, name, schema, within},
    controller::stop_margin_rad,
    error::{SceneError, suggestion},
    file::{CapsuleFile, FingertipFile, HandFile, InertiaFile, JointFile, PostureFile, SafetyKey, SceneFile},
    object::{breaks_triangle, tensor},
};
use blindgrasp_body::Capsule;
use blindgrasp_body::FingertipModel;
use blindgrasp_body::JointFriction;
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_shared::cycle::{NAME_BYTES, POSTURES_MOST};
use blindgrasp_shared::{
    estimate::Encoder,
    hand::{Fingertip, Joint, Link},
    math::Real,
};
use nalgebra::{DMatrix, Quaternion, SymmetricEigen, UnitQuaternion, Vector3};
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Numbers beyond are not computed with, in whatever unit they are.
const LARGEST: f64 = 1e6;

/// The most capsules that a hand may have: each pair of them is looked at in each step.
pub(crate) const MAX_CAPSULES: usize = 64;

/// Bounds on the radius of a capsule, m, ...
const THINNEST_M: f64 = 1e-4;
const THICKEST_M: f64 = 1.0;
/// ... and on the coordinates of its ends.
const FARTHEST_M: f64 = 10.0;

/// Returns `true` for the ends and the radius of a capsule that a hand may have, m.
pub(crate) fn is_capsule(ends_m: &[Vector3<f64>; 2], radius_m: f64) -> bool {
    let is_near = |v: &f64| v.abs() <= FARTHEST_M;
    ends_m.iter().all(|end_m| end_m.iter().all(is_near)) && (THINNEST_M..=THICKEST_M).contains(&radius_m)
}

/// A hand's file, checked from end to end.
pub(crate) struct Examined {
    /// All for which it is refused; the keys are those of the file.
    pub(crate) refused: Refused,
    /// The file, for those who look further: joints that move no fingertip are left out, and numbers that no kinematics can be
    /// computed with are replaced.
    pub(crate) file: HandFile,
    /// The number of each joint in the file as it was, from 1.
    pub(crate) numbers: Vec<usize>,
    /// Its kinematics and masses; `None` where it is not known what sits on what, or where.
    pub(crate) hand: Option<Hand>,
}

impl Examined {
    /// Checks all that every hand needs, and goes on behind what is wrong. A firmware needs the table `[control]` as well.
    pub(crate) fn of(file: &HandFile) -> Self {
        let mut refused = Refused::default();
        refused.take_all([schema("schema", file.schema), name("name", &file.name)]);
        let tree = Tree::of(file, &mut refused);
        if let Some(gains) = &file.control {
            control(gains, &mut refused);
        }
        refused.take_all(file.safety.values().map(|(key, value)| safety(key, value)));
        let (is_placed, mut file) = (is_placed(file), file.clone());
        let mut joints = Vec::with_capacity(file.joints.len());
        for (k, joint) in file.joints.iter_mut().enumerate() {
            joints.push(check_joint(joint, &|name| item("joint", k, name), &mut refused));
        }
        let mut fingertips = Vec::with_capacity(file.fingertips.len());
        for (i, fingertip) in file.fingertips.iter_mut().enumerate() {
            fingertips.push(check_fingertip(fingertip, &|name| item("fingertip", i, name), &mut refused));
        }
        check_capsules(&file, &mut refused);
        check_postures(&file, &mut refused);
        let mut numbers: Vec<usize> = (1..=joints.len()).collect();
        let hand = tree.filter(|_| is_placed).and_then(|Tree { parents, links, kept }| {
            numbers.retain(|number| kept.contains(&(number - 1)));
            file.joints = kept.iter().map(|&k| file.joints[k].clone()).collect();
            let is_kept = |name: &String| file.joints.iter().any(|joint| joint.name == *name);
            file.capsules.retain(|capsule| capsule.link.as_ref().is_none_or(is_kept));
            file.postures.retain(|posture| is_complete(posture, joints.len()));
            for posture in &mut file.postures {
                posture.angles_rad = kept.iter().map(|&k| posture.angles_rad[k]).collect();
            }
            // Parents and links are kept.
            let place = |k: usize| kept.partition_point(|&other| other < k);
            let parent = |k: usize| parents[k].map(place);
            let joints: Vec<_> = kept.iter().map(|&k| Joint { parent: parent(k), ..joints[k] }).collect();
            let links = links.iter().map(|&link| place(link));
            let tips: Vec<_> =
                fingertips.iter().zip(links).map(|(&tip, link)| Fingertip { link, ..tip }).collect();
            let prepared = Hand::new(&joints, &tips);
            refused.take(prepared.or_else(|error| fail("joint", error.to_string(), "")))
        });
        Self { refused, file, numbers, hand }
    }
}

/// Returns `true` if it is known where everything is, and can be computed with.
fn is_placed(file: &HandFile) -> bool {
    let small = |v: &f64| v.abs() < LARGEST;
    file.joints.iter().all(|joint| {
        let lengths = joint.offset_m.iter().chain(&joint.mass_centre_m).chain(&joint.rotation_rpy_rad);
        direction(joint.axis).is_some() && lengths.chain([&joint.mass_kg]).all(small)
    }) && file.fingertips.iter().all(|tip| tip.offset_m.iter().chain([&tip.radius_m]).all(small))
}

impl HandFile {
    /// The materials of the fingertips.
    pub fn fingertip_models(&self) -> Vec<FingertipModel> {
        self.fingertips.iter().map(fingertip_parameters).collect()
    }

    /// Its capsules, for the hand that is prepared from it; those of links that the hand does not have are left out.
    pub fn capsules(&self, hand: &Hand) -> Vec<Capsule> {
        let prepared = |file: &CapsuleFile| {
            let ends_m = [file.from_m, file.to_m].map(Vector3::from);
            let Some(name) = &file.link else {
                return Some(Capsule { link: None, ends_m, radius_m: file.radius_m });
            };
            let link = self.joints.iter().position(|joint| joint.name == *name)?;
            let from_link = &hand.prepared_joints()[link].from_link;
            let ends_m = ends_m.map(|end_m| from_link.tr_mul(&end_m));
            Some(Capsule { link: Some(link), ends_m, radius_m: file.radius_m })
        };
        self.capsules.iter().filter_map(prepared).collect()
    }

    /// Checks all that every hand needs, and prepares it. A firmware needs the table `[control]` as well.
    pub(crate) fn prepare(&self, warnings: &mut Vec<String>) -> Result<Hand> {
        let Examined { refused, hand, .. } = Examined::of(self);
        let hand = refused.or(hand)?;
        let odd = (0..hand.joint_count()).filter(|&k| breaks_triangle(&hand.link(k).inertia_kg_m2));
        warnings.extend(odd.map(|k| {
            let name = &self.joints[k].name;
            format!("link `{name}`: its inertia is that of no body: one moment is larger than the sum of the two others")
        }));
        Ok(hand)
    }
}

/// The tree of joints, by index.
struct Tree {
    /// Of each joint.
    parents: Vec<Option<usize>>,
    /// Of each fingertip.
    links: Vec<usize>,
    /// The joints that move fingertips, in their order.
    kept: Vec<usize>,
}

impl Tree {
    /// Follows the names; `None` where they don't say what sits on what.
    fn of(file: &HandFile, refused: &mut Refused) -> Option<Self> {
        let (joints, fingertips) = (&file.joints, &file.fingertips);
        // Before lists of any length are searched for names.
        let too_many = |what: &str, count: usize, most: usize| {
            format!("the hand has {count} {what}: at most {most} are supported")
        };
        let wrong_count = match (joints.len(), fingertips.len()) {
            (0, _) => fail("joint", "the hand has no joint", "add a [[joint]]"),
            (count, _) if count > MAX_JOINTS => {
                fail("joint", too_many("joints", count, MAX_JOINTS), "leave some out")
            }
            (_, count) if count < 2 => {
                let tips = if count == 1 { "fingertip" } else { "fingertips" };
                let problem = format!("the hand has {count} {tips}: grasping needs at least two");
                fail("fingertip", problem, "add a [[fingertip]]")
            }
            (_, count) if count > MAX_FINGERS => {
                fail("fingertip", too_many("fingertips", count, MAX_FINGERS), "leave some out")
            }
            _ => Ok(()),
        };
        refused.take(wrong_count)?;
        let are_different = refused.names("joint", joints.iter().map(|joint| joint.name.as_str()));
        refused.names("fingertip", fingertips.iter().map(|fingertip| fingertip.name.as_str()));
        let mut find = |key: String, name: &str, before: usize| {
            refused.take(match joints.iter().position(|joint| joint.name == name) {
                Some(index) if index < before => Ok(index),
                Some(_) => fail(key, format!("joint `{name}` does not come before this one"), "move it up"),
                None => {
                    let known = joints.iter().map(|joint| joint.name.as_str());
                    fail(key, format!("there is no joint `{name}`"), suggestion(name, known))
                }
            })
        };
        // All of them are looked for before the first that is not found ends it.
        let mut parent = |(k, joint): (usize, &JointFile)| match &joint.parent {
            Some(name) => find(item("joint", k, "parent"), name, k).map(Some),
            None => Some(None),
        };
        let parents: Vec<Option<Option<usize>>> = joints.iter().enumerate().map(&mut parent).collect();
        let mut link =
            |(i, tip): (usize, &FingertipFile)| find(item("fingertip", i, "link"), &tip.link, usize::MAX);
        let links: Vec<Option<usize>> = fingertips.iter().enumerate().map(&mut link).collect();
        let parents = parents.into_iter().collect::<Option<Vec<_>>>()?;
        let links = links.into_iter().collect::<Option<Vec<_>>>().filter(|_| are_different)?;

        let below = |&link: &usize| std::iter::successors(Some(link), |&k| parents[k]);
        let moving: BTreeSet<usize> = links.iter().flat_map(below).collect();
        for (k, joint) in joints.iter().enumerate() {
            // What it carries is no matter of its own.
            if !moving.contains(&k) && parents[k].is_none_or(|parent| moving.contains(&parent)) {
                let problem = format!("joint `{}` moves no fingertip", joint.name);
                let remedy = "leave it out and add its mass to its parent";
                refused.take::<()>(fail(item("joint", k, "name"), problem, remedy));
            }
        }
        Some(Self { parents, links, kept: moving.into_iter().collect() })
    }
}

fn safety(key: &SafetyKey, value: f64) -> Result<()> {
    if value >= key.least && value <= key.most {
        return Ok(());
    }
    let remedy = format!("has to be between {} and {}; {} unless given", key.least, key.most, key.default);
    fail(format!("safety.{}", key.name), format!("{value} is out of range"), remedy)
}

/// Checks the numbers of a fingertip, and replaces those that no kinematics can be computed with. Its link is still to be told.
fn check_fingertip(
    file: &mut FingertipFile,
    key: &dyn Fn(&str) -> String,
    refused: &mut Refused,
) -> Fingertip<f64> {
    refused.take_all([
        all_within(&key("offset_m"), &file.offset_m, 10.0),
        within(&key("radius_m"), file.radius_m, 1e-5, 1.0),
        within(&key("stiffness_n_m2"), file.stiffness_n_m2, 1.0, 1e13),
        within(&key("damping_n_s_m_per_m2"), file.damping_n_s_m_per_m2, 0.0, 1e12),
        within(&key("torsional_damping_nm_s_rad_per_m2"), file.torsional_damping_nm_s_rad_per_m2, 0.0, 1e12),
        within(&key("friction"), file.friction.unwrap_or_default(), 0.0, 100.0),
        within(&key("torsional_friction_m"), file.torsional_friction_m.unwrap_or_default(), 0.0, 1.0),
    ]);
    if !(file.radius_m > 0.0) {
        file.radius_m = 0.01;
    }
    Fingertip { link: 0, offset_m: file.offset_m.into(), radius_m: file.radius_m }
}

/// Checks the capsules.
fn check_capsules(file: &HandFile, refused: &mut Refused) {
    let count = file.capsules.len();
    if count > MAX_CAPSULES {
        let problem = format!("the hand has {count} capsules: at most {MAX_CAPSULES} are supported");
        refused.take::<()>(fail("capsule", problem, "leave some out"));
        return;
    }
    for (k, capsule) in file.capsules.iter().enumerate() {
        let key = |name: &str| item("capsule", k, name);
        if let Some(link) = &capsule.link
            && file.joints.iter().all(|joint| joint.name != *link)
        {
            let known = file.joints.iter().map(|joint| joint.name.as_str());
            let problem = format!("there is no joint `{link}`");
            refused.take::<()>(fail(key("link"), problem, suggestion(link, known)));
        }
        refused.take_all([
            all_within(&key("from_m"), &capsule.from_m, FARTHEST_M),
            all_within(&key("to_m"), &capsule.to_m, FARTHEST_M),
            within(&key("radius_m"), capsule.radius_m, THINNEST_M, THICKEST_M),
            within(&key("friction"), capsule.friction.unwrap_or_default(), 0.0, 100.0),
        ]);
    }
}

/// Returns `true` if a posture has a number for each joint.
fn is_complete(posture: &PostureFile, joint_count: usize) -> bool {
    posture.angles_rad.len() == joint_count
        && posture.angles_rad.iter().all(|angle_rad| angle_rad.is_finite())
}

/// Checks the named postures. A hand that is told to go to one stays clear of its soft end stops.
fn check_postures(file: &HandFile, refused: &mut Refused) {
    let count = file.postures.len();
    if count > POSTURES_MOST {
        let problem = format!("the hand has {count} postures: at most {POSTURES_MOST} are supported");
        refused.take::<()>(fail("posture", problem, "leave some out"));
        return;
    }
    for (p, posture) in file.postures.iter().enumerate() {
        let (name, key) = (&posture.name, |of: &str| item("posture", p, of));
        let is_plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
        if !(1..=NAME_BYTES).contains(&name.len()) || !name.chars().all(is_plain) {
            let remedy = format!("has to be 1 to {NAME_BYTES} small letters (a to z), digits and hyphens");
            refused.take::<()>(fail(key("name"), format!("`{name}` is not a name of a posture"), remedy));
        } else if file.postures[..p].iter().any(|other| other.name == *name) {
            refused.take::<()>(fail(key("name"), format!("`{name}` is there twice"), "rename one of them"));
        }
        let (angles, joints) = (posture.angles_rad.len(), file.joints.len());
        if angles != joints {
            let problem = format!("{angles} angles for {joints} joints");
            let remedy = "give one for each joint, in the order of the file";
            refused.take::<()>(fail(key("angles_rad"), problem, remedy));
            continue;
        }
        for (k, (&angle_rad, joint)) in posture.angles_rad.iter().zip(&file.joints).enumerate() {
            let ([lower, upper], margin_rad) = (joint.limits_rad, stop_margin_rad(&file.safety, joint));
            // To six digits, inwards, so that what is told is what is taken.
            let least = ((lower + margin_rad) * 1e6 - 1e-3).ceil() / 1e6;
            let most = ((upper - margin_rad) * 1e6 + 1e-3).floor() / 1e6;
            if angle_rad >= least && angle_rad <= most {
                continue;
            }
            let place = if angle_rad >= lower && angle_rad <= upper {
                "within the soft end stop"
            } else {
                "outside the limits"
            };
            let problem = format!("{angle_rad:?} is {place} of joint `{}`", joint.name);
            let remedy = format!("has to be between {least:?} and {most:?}");
            refused.take::<()>(fail(format!("{}.{}", key("angles_rad"), k + 1), problem, remedy));
        }
    }
}

/// Checks the numbers of a joint, and replaces those that no kinematics can be computed with. Its parent is still to be told.
fn check_joint(file: &mut JointFile, key: &dyn Fn(&str) -> String, refused: &mut Refused) -> Joint<f64> {
    refused.take_all([
        all_within(&key("offset_m"), &file.offset_m, 10.0),
        all_within(&key("rotation_rpy_rad"), &file.rotation_rpy_rad, 100.0),
        all_within(&key("axis"), &file.axis, 1e6),
        all_within(&key("limits_rad"), &file.limits_rad, 100.0),
        within(&key("mass_kg"), file.mass_kg, 0.0, 1e4),
        all_within(&key("mass_centre_m"), &file.mass_centre_m, 10.0),
        within(&key("damping_gain_nm_s_rad"), file.damping_gain_nm_s_rad, 0.0, 1e6),
        within(&key("torque_limit_nm"), file.torque_limit_nm, 1e-9, 1e6),
        within(&key("speed_limit_rad_s"), file.speed_limit_rad_s, 1e-6, 1e6),
        within(&key("encoder_counts_per_turn"), file.encoder_counts_per_turn, 8.0, 1e9),
        all_within(
            &key("encoder_zero_count"),
            &[f64::from(file.encoder_zero_count)],
            f64::from(Encoder::MOST_ZERO_COUNT),
        ),
        within(&key("torque_per_volt_nm_v"), file.torque_per_volt_nm_v, 1e-6, 1e4)
            .map_err(|error| SceneError { remedy: error.remedy + "; its sign is `motor_reversed`", ..error }),
        within(&key("rotor_inertia_kg_m2"), file.rotor_inertia_kg_m2, 0.0, 1e4),
        within(&key("viscous_friction_nm_s_rad"), file.viscous_friction_nm_s_rad, 0.0, 1e6),
        within(&key("coulomb_friction_nm"), file.coulomb_friction_nm, 0.0, 1e6),
        within(&key("presliding_rad"), file.presliding_rad, 1e-9, 1.0),
        within(&key("presliding_damping_nm_s_rad"), file.presliding_damping_nm_s_rad, 0.0, 1e6),
    ]);
    if refused.take(tensor(&key("inertia_kg_m2"), &file.inertia_kg_m2)).is_none() {
        file.inertia_kg_m2 = InertiaFile::default();
    }
    for (parameter, reason) in described(file).faults() {
        let (name, remedy) = match parameter {
            "offset" => ("offset_m", "give finite numbers"),
            "attitude" => ("rotation_rpy_rad", "give finite numbers"),
            "axis" => {
                file.axis = direction(file.axis).unwrap_or([0.0, 0.0, 1.0]);
                ("axis", "divide it by its length")
            }
            "limits" => {
                let [a, b] = file.limits_rad;
                file.limits_rad = if a > b { [b, a] } else { [-PI, PI] };
                ("limits_rad", "write [lower, upper]")
            }
            "mass" => {
                file.mass_kg = 0.0;
                ("mass_kg", "give it in kilograms")
            }
            "mass centre" => ("mass_centre_m", "give finite numbers"),
            _ => {
                file.inertia_kg_m2 = InertiaFile::default();
                ("inertia_kg_m2", "give the inertia about the mass centre as [xx, yy, zz, xy, xz, yz]")
            }
        };
        let problem = format!("joint `{}`: {parameter} {reason}", file.name);
        refused.take::<()>(fail(key(name), problem, remedy));
    }
    let [lower, upper] = file.limits_rad;
    if !(file.nominal_rad >= lower && file.nominal_rad <= upper) {
        let problem = format!("{:?} is outside the limits", file.nominal_rad);
        let remedy = format!("has to be between {lower} and {upper}");
        refused.take::<()>(fail(key("nominal_rad"), problem, remedy));
    }
    described(file)
}

/// The numbers of a joint as the shared crate takes them.
fn described(file: &JointFile) -> Joint<f64> {
    Joint {
        parent: None,
        offset_m: file.offset_m.into(),
        attitude: rotation(file.rotation_rpy_rad).to_rotation_matrix().into_inner(),
        axis: file.axis.into(),
        lower_rad: file.limits_rad[0],
        upper_rad: file.limits_rad[1],
        link: Link {
            mass_kg: file.mass_kg,
            mass_centre_m: file.mass_centre_m.into(),
            // What is refused was told.
            inertia_kg_m2: tensor("", &file.inertia_kg_m2).unwrap_or_default(),
        },
    }
}

/// The unit vector along an axis, whatever length that has.
pub(crate) fn direction(axis: [f64; 3]) -> Option<[f64; 3]> {
    let axis = Vector3::from(axis);
    // Squares of large numbers are none.
    (axis / axis.amax()).try_normalize(0.0).filter(|axis| axis.iter().all(|v| v.is_finite())).map(Into::into)
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

fn fingertip_parameters(fingertip: &FingertipFile) -> FingertipModel {
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

/// Returns the joints that move no mass: every combination of joint speeds has to, since the integrator divides by the mass
/// matrix.
pub(crate) fn still_joints(hand: &Hand, angles: &[f64]) -> Vec<usize> {
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
    let is_still = |k: usize| !(mass[(k, k)] > 0.0);
    // Scaled to ones on the diagonal, so that small links next to large ones count in full.
    let scaled = DMatrix::from_fn(count, count, |a, b| match is_still(a) || is_still(b) {
        true => f64::from(u8::from(a == b)),
        false => mass[(a, b)] / (mass[(a, a)].square_root() * mass[(b, b)].square_root()),
    });
    let modes = SymmetricEigen::new(scaled);
    let together = (0..count).filter(|&mode| !(modes.eigenvalues[mode] > 1e-9));
    let together = together.map(|mode| modes.eigenvectors.column(mode).iamax());
    (0..count).filter(|&k| is_still(k)).chain(together).collect()
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
