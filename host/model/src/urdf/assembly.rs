//! The rigid bodies that are left when what does not move is taken together, and the joints between them.
//!
//! Every link below the base gets a **seat**: the joint that carries it, and where its frame is in the frame of that joint's
//! own link. Links behind fixed joints, joints that are held still and joints that move no fingertip share the seat of the
//! link that they hang on; their masses become one body.

use super::super::check::{Result, fail};
use super::super::error::{SceneError, suggestion};
use super::super::inspect::finding::Finding;
use super::body::Body;
use super::keys::Keys;
use super::robot::{Joint, Kind, Robot};
use super::topology::Tree;
use super::transform::{Transform, roll_pitch_yaw};
use super::xml::quote;
use blindgrasp_body::MAX_JOINTS;
use blindgrasp_shared::math::Real;
use nalgebra::{Quaternion, UnitQuaternion};
use std::collections::BTreeMap;

/// Joints that are named in a message.
pub(super) const MOST_NAMES: usize = 6;

/// A hand's joints and bodies.
#[derive(Clone, Debug)]
pub(super) struct Assembly {
    /// Branch after branch, parents first.
    pub(super) joints: Vec<Moving>,
    /// One a link of the robot; none for those that are not below the base.
    pub(super) seats: Vec<Option<Seat>>,
}

/// A joint of the hand, and the body that it carries.
#[derive(Clone, Debug)]
pub(super) struct Moving {
    /// Index among the robot's joints.
    pub(super) joint: usize,
    /// Index among the hand's joints; none on the base.
    pub(super) parent: Option<usize>,
    /// Position of its link frame in the parent's at zero angle, m.
    pub(super) offset_m: [f64; 3],
    /// Roll, pitch and yaw of the same, rad.
    pub(super) rpy_rad: [f64; 3],
    /// Everything that moves as one with its link, in the link's frame.
    pub(super) body: Body,
}

/// The pose of a link.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seat {
    /// Index among the hand's joints; none on the base.
    pub(super) joint: Option<usize>,
    /// The link's frame in that of the joint's own link, or of the base; none where they are the same.
    pub(super) frame: Option<Transform>,
}

impl Assembly {
    /// Takes together what does not move, for fingertips on some of the links.
    ///
    /// # Errors
    /// A base or a joint to hold still that is not there, or a joint that can't be part of a hand.
    pub(super) fn new(
        robot: &Robot,
        tree: &Tree,
        keys: &Keys,
        fingertips: &[usize],
        notices: &mut Vec<Finding>,
    ) -> Result<Self> {
        let mut moves_fingertip = vec![false; robot.joints.len()];
        for &link in fingertips {
            tree.above(link, robot).for_each(|joint| moves_fingertip[joint] = true);
        }
        let mut assembly = Self::put_together(robot, tree, keys, |k| moves_fingertip[k])?;
        refuse_unfit(robot, &assembly.joints)?;
        refuse_crowd(robot, assembly.joints.len())?;
        assembly.merge(robot, true)?;
        notices.extend(tell_idle(robot, &assembly.idle(robot, keys)));
        notices.extend(tell_massless(robot, &assembly.joints));
        Ok(assembly)
    }

    /// The same with every joint that is not to be held still, of whatever kind and number; a mass that can't be read is none.
    ///
    /// # Errors
    /// A base or a joint to hold still that is not there.
    pub(super) fn of_all(robot: &Robot, tree: &Tree, keys: &Keys) -> Result<Self> {
        let mut assembly = Self::put_together(robot, tree, keys, |_| true)?;
        assembly.merge(robot, false)?;
        Ok(assembly)
    }

    /// Of the joints that are neither fixed nor to be held still, those move that are to.
    fn put_together(
        robot: &Robot,
        tree: &Tree,
        keys: &Keys,
        is_to_move: impl Fn(usize) -> bool,
    ) -> Result<Self> {
        let base = base(robot, tree, keys)?;
        let held = held(robot, keys)?;
        let is_free =
            |k: usize| robot.joints[k].kind != Kind::Fixed && !held.contains_key(&k) && is_to_move(k);
        let on_base = Seat { joint: None, frame: None };
        let mut assembly = Self { joints: Vec::new(), seats: vec![None; robot.links.len()] };
        for link in tree.below(base, robot) {
            let seat = match tree.carrier[link].filter(|_| link != base) {
                None => on_base,
                Some(k) => {
                    let joint = &robot.joints[k];
                    let on = assembly.seats[joint.parent].unwrap_or(on_base);
                    if is_free(k) {
                        assembly.joints.push(Moving::new(k, joint, &on));
                        Seat { joint: Some(assembly.joints.len() - 1), frame: None }
                    } else {
                        let still = joint.origin.transform.then(&motion(joint, held.get(&k).copied()));
                        let frame = on.frame.map_or(still, |frame| frame.then(&still));
                        Seat { joint: on.joint, frame: Some(frame) }
                    }
                }
            };
            assembly.seats[link] = Some(seat);
        }
        Ok(assembly)
    }

    /// Takes together what each joint carries. Masses of links that do not move may be wrong; others too, if not `all` count.
    fn merge(&mut self, robot: &Robot, all: bool) -> Result<()> {
        let mut bodies: Vec<Vec<Body>> = vec![Vec::new(); self.joints.len()];
        for (link, seat) in robot.links.iter().zip(&self.seats) {
            let Some(Seat { joint: Some(joint), frame }) = *seat else { continue };
            match &link.body {
                Ok(body) => bodies[joint].push(frame.map_or(*body, |frame| body.seen_from(&frame))),
                Err(error) if all => return Err(error.clone()),
                Err(_) => {}
            }
        }
        for (moving, bodies) in self.joints.iter_mut().zip(&bodies) {
            moving.body = Body::merged(bodies);
        }
        Ok(())
    }

    /// The robot's joints that could move, but move no fingertip; in the file's order.
    pub(super) fn idle(&self, robot: &Robot, keys: &Keys) -> Vec<usize> {
        let is_idle = |k: &usize| {
            let joint = &robot.joints[*k];
            joint.kind != Kind::Fixed
                && self.seats[joint.parent].is_some()
                && self.seats[joint.child].is_some()
                && self.joints.iter().all(|moving| moving.joint != *k)
                && !keys.locked_rad.contains_key(&joint.name)
                && !keys.locked_m.contains_key(&joint.name)
        };
        (0..robot.joints.len()).filter(is_idle).collect()
    }
}

impl Moving {
    fn new(index: usize, joint: &Joint, on: &Seat) -> Self {
        let origin = &joint.origin;
        let (offset_m, rpy_rad) = match &on.frame {
            // As written, to the bit.
            None => (origin.transform.offset_m.into(), origin.rpy_rad()),
            Some(frame) => {
                let pose = frame.then(&origin.transform);
                (pose.offset_m.into(), roll_pitch_yaw(&pose.attitude))
            }
        };
        Self { joint: index, parent: on.joint, offset_m, rpy_rad, body: Body::none() }
    }
}

/// Index of the base link.
fn base(robot: &Robot, tree: &Tree, keys: &Keys) -> Result<usize> {
    let Some(name) = &keys.base else { return Ok(tree.root) };
    robot.link_index(name).map_or_else(
        || fail("urdf.base", format!("there is no link `{}`", quote(name)), robot.link_suggestion(name)),
        Ok,
    )
}

/// The joints that are to be held still, and where.
fn held(robot: &Robot, keys: &Keys) -> Result<BTreeMap<usize, f64>> {
    let lists = [("locked_rad", &keys.locked_rad), ("locked_m", &keys.locked_m)];
    let mut held = BTreeMap::new();
    for (list, (name, &position)) in
        lists.into_iter().flat_map(|(list, map)| map.iter().map(move |entry| (list, entry)))
    {
        let key = format!("urdf.{list}.{name}");
        let Some(k) = robot.joint_index(name) else {
            let movable = robot.joints.iter().filter(|joint| joint.kind != Kind::Fixed);
            let remedy = suggestion(name, movable.map(|joint| joint.name.as_str()));
            return fail(key, "there is no such joint", remedy);
        };
        let joint = &robot.joints[k];
        match (joint.kind, list) {
            (Kind::Revolute | Kind::Continuous, "locked_rad") | (Kind::Prismatic, "locked_m") => {}
            (Kind::Fixed, _) => return fail(key, "the joint is fixed as it is", "leave it out"),
            (Kind::Prismatic, _) => return fail(key, "the joint is prismatic", "put it into locked_m"),
            (Kind::Revolute | Kind::Continuous, _) => {
                return fail(key, format!("the joint is {}", joint.kind.word()), "put it into locked_rad");
            }
            (kind, _) => {
                return fail(key, format!("the joint is {}", kind.word()), "make it fixed in the URDF");
            }
        }
        let (lower, upper) = range(joint);
        if !(position >= lower && position <= upper) {
            let remedy = format!("has to be between {lower:?} and {upper:?}");
            return fail(key, format!("{position:?} is outside the joint's limits"), remedy);
        }
        held.insert(k, position);
    }
    Ok(held)
}

/// Returns the range of a joint, rad or m; anywhere, if it does not say.
fn range(joint: &Joint) -> (f64, f64) {
    match (joint.kind, joint.limit.lower, joint.limit.upper) {
        (Kind::Continuous, ..) | (_, None, None) => (f64::NEG_INFINITY, f64::INFINITY),
        // What is left out is zero, says URDF.
        (_, lower, upper) => (lower.unwrap_or(0.0), upper.unwrap_or(0.0)),
    }
}

/// Returns the motion of a joint that is held still.
fn motion(joint: &Joint, position: Option<f64>) -> Transform {
    let position = position.unwrap_or_else(|| resting(joint));
    let still = Transform::identity();
    match joint.kind {
        Kind::Revolute | Kind::Continuous => {
            let (sine, cosine) = (0.5 * position).sine_cosine();
            let turn = UnitQuaternion::new_normalize(Quaternion::from_parts(cosine, joint.axis * sine));
            Transform { attitude: turn.to_rotation_matrix().into_inner(), ..still }
        }
        Kind::Prismatic => Transform { offset_m: joint.axis * position, ..still },
        Kind::Fixed | Kind::Floating | Kind::Planar | Kind::Spherical => still,
    }
}

/// Refuses joints that move a fingertip and are not of a kind that the law is for.
fn refuse_unfit(robot: &Robot, moving: &[Moving]) -> Result<()> {
    let all = |unfit: &dyn Fn(&Joint) -> bool| -> Vec<&Joint> {
        moving.iter().map(|moving| &robot.joints[moving.joint]).filter(|joint| unfit(joint)).collect()
    };
    let refuse = |joints: &[&Joint], problem: String, remedy: String| match joints {
        [] => Ok(()),
        [joint, ..] => Err(SceneError::new("", problem, remedy).at(&joint.place)),
    };
    let mimics = all(&|joint| joint.mimics.is_some() && joint.kind.turns());
    if let [joint, ..] = mimics[..] {
        let followed = joint.mimics.as_deref().unwrap_or_default();
        let (subject, verb) = subject(&mimics);
        let verb = if verb == "is" { "follows" } else { "follow" };
        let whom = if mimics.len() == 1 { format!("`{}`", quote(followed)) } else { "others".into() };
        let problem = format!("{subject} {verb} {whom} (<mimic>), but the law sets each torque on its own");
        let remedy =
            hold(&mimics, "locked_rad") + ", or remove <mimic> from each that has a motor of its own";
        return refuse(&mimics, problem, remedy);
    }
    let slides = all(&|joint| joint.kind == Kind::Prismatic);
    if !slides.is_empty() {
        let (subject, verb) = subject(&slides);
        let problem = format!("{subject} {verb} prismatic, but the law is for revolute joints");
        return refuse(&slides, problem, hold(&slides, "locked_m"));
    }
    let other = all(&|joint| !joint.kind.turns());
    if let [joint, ..] = other[..] {
        let problem = format!(
            "joint `{}` is {}, but the law is for revolute joints",
            quote(&joint.name),
            joint.kind.word()
        );
        let remedy = "make it fixed in the URDF, or choose a `base` below it in [urdf]";
        return refuse(&other, problem, remedy.into());
    }
    Ok(())
}

fn refuse_crowd(robot: &Robot, count: usize) -> Result<()> {
    if count <= MAX_JOINTS {
        return Ok(());
    }
    let problem = format!("{count} joints move a fingertip: at most {MAX_JOINTS} are supported");
    let remedy = "choose a `base` closer to the hand, hold joints still, or name fewer fingertips";
    Err(SceneError::new("", problem, remedy).at(&robot.place))
}

/// Joints by name, the first few of many, with `is` or `are`.
fn subject(joints: &[&Joint]) -> (String, &'static str) {
    let names: Vec<String> = joints.iter().map(|joint| format!("`{}`", quote(&joint.name))).collect();
    match names.len() {
        1 => (format!("joint {}", names[0]), "is"),
        count if count > MOST_NAMES => {
            let named = names[..MOST_NAMES].join(", ");
            (format!("joints {named} and {} more", count - MOST_NAMES), "are")
        }
        _ => (format!("joints {}", names.join(", ")), "are"),
    }
}

/// Returns the advice to hold joints still.
fn hold(joints: &[&Joint], list: &str) -> String {
    let it = if joints.len() == 1 { "it" } else { "them" };
    let entries: Vec<String> = joints
        .iter()
        .map(|joint| format!("{} = {:?}", toml_key(&quote(&joint.name)), resting(joint)))
        .collect();
    format!(
        "hold {it} still with `{list} = {{ {} }}` in [urdf] (or `--lock` of `hand new`)",
        entries.join(", ")
    )
}

/// Returns the position at which a joint is held of which it is not said: at zero, or the limit nearest to it.
pub(super) fn resting(joint: &Joint) -> f64 {
    let (lower, upper) = range(joint);
    0.0_f64.max(lower).min(upper)
}

/// A key of TOML.
pub(crate) fn toml_key(name: &str) -> String {
    let is_bare = |c: char| c.is_ascii_alphanumeric() || c == '-' || c == '_';
    if !name.is_empty() && name.chars().all(is_bare) {
        name.into()
    } else {
        toml::Value::String(name.into()).to_string()
    }
}

/// Links that move, have an extent, and weigh nothing. Links of joints that share a place are points.
fn tell_massless(robot: &Robot, joints: &[Moving]) -> Vec<Finding> {
    let has_extent =
        |k: usize| joints.iter().any(|other| other.parent == Some(k) && other.offset_m != [0.0; 3]);
    let massless = joints.iter().enumerate().filter(|(k, moving)| moving.body.is_none() && has_extent(*k));
    massless
        .map(|(_, moving)| {
            let link = &robot.links[robot.joints[moving.joint].child];
            let what = format!("link `{}` moves and has no mass", quote(&link.name));
            Finding::notice(&link.place, what, "add <inertial>, unless its mass is counted in another link")
        })
        .collect()
}

/// Joints that could move, but move no fingertip.
fn tell_idle(robot: &Robot, idle: &[usize]) -> Option<Finding> {
    let joints: Vec<&Joint> = idle.iter().map(|&k| &robot.joints[k]).collect();
    let (first, (names, verb)) = (joints.first()?, subject(&joints));
    let moves = if verb == "is" { "moves" } else { "move" };
    let at = if joints.iter().all(|joint| resting(joint) == 0.0) {
        "zero"
    } else {
        "zero or the limit nearest to it"
    };
    let what = format!("{names} {moves} no fingertip and {verb} held still at {at}");
    Some(Finding::notice(&first.place, what, "say where with locked_rad (or locked_m) in [urdf]"))
}
