//! The URDF's knowledge of a joint, as keys of its entry.
//!
//! A key comes from the joint's own `[[joint]]`, else from the URDF, else from `[joint_defaults]`.

use super::super::check::Result;
use super::super::error::{Place, SceneError};
use super::super::inspect::finding::Finding;
use super::super::tree::{Node, Value};
use super::expand::Parts;
use super::robot::{Joint, Kind};
use super::xml::quote;
use nalgebra::Matrix3;
use std::f64::consts::PI;

/// Torques, N m, and speeds, rad/s, from which on a limit is taken for a placeholder.
pub(super) const PLACEHOLDER: f64 = 1000.0;

/// Oddities of the joints: many have the same, which is told of the first.
#[derive(Clone, Debug, Default)]
pub(super) struct Oddities(Vec<(&'static str, Finding, usize)>);

impl Oddities {
    fn extend(&mut self, kind: &'static str, notice: Option<Finding>) {
        let Some(notice) = notice else { return };
        match self.0.iter_mut().find(|(other, ..)| *other == kind) {
            Some((.., count)) => *count += 1,
            None => self.0.push((kind, notice, 1)),
        }
    }

    /// One notice a kind.
    pub(super) fn notices(self) -> impl Iterator<Item = Finding> {
        self.0.into_iter().map(|(_, notice, count)| match count {
            1 => notice,
            2 => Finding { what: notice.what + " (and so it is with another joint)", ..notice },
            _ => Finding {
                what: format!("{} (and so it is with {} more joints)", notice.what, count - 1),
                ..notice
            },
        })
    }
}

/// Adds to the entry of a joint what the URDF says and the entry does not. `is_default` tells whether `[joint_defaults]` has a
/// key, `parent_key` is that of the entry's parent.
///
/// # Errors
/// Something is missing in all three, or contradicts the tree.
pub(super) fn complete(
    parts: &Parts<'_>,
    node: &mut Node,
    index: usize,
    parent_key: &str,
    is_default: &dyn Fn(&str) -> bool,
    oddities: &mut Oddities,
) -> Result<()> {
    let moving = &parts.assembly.joints[index];
    let joint = parts.joint(moving);
    let parent = moving.parent.map(|index| parts.name(index));
    set_parent(node, joint, parent, parent_key)?;

    let body_place = &parts.robot.links[joint.child].body_place;
    let body = &moving.body;
    let mut add = |key: &str, value: Node| {
        if node.get(key).is_none() {
            node.insert(key, value);
        }
    };
    add("offset_m", list(&moving.offset_m, &joint.origin.place));
    add("rotation_rpy_rad", list(&moving.rpy_rad, &joint.origin.place));
    add("axis", list(&joint.axis.into(), &joint.axis_place));
    add("mass_kg", number(body.mass_kg, body_place));
    add("mass_centre_m", list(&body.centre_m.into(), body_place));
    add("inertia_kg_m2", list(&moments(&body.inertia_kg_m2), body_place));
    let dynamics = &joint.dynamics;
    for (key, attribute, given) in [
        ("viscous_friction_nm_s_rad", "damping", dynamics.damping),
        ("coulomb_friction_nm", "friction", dynamics.friction),
    ] {
        if let Some(value) = parts.keys.heeded(attribute, given) {
            add(key, number(value, &dynamics.place));
        }
    }

    set_range(node, joint, is_default, oddities)?;
    let limit = &joint.limit;
    for (key, attribute, given, unit) in [
        ("torque_limit_nm", "effort", limit.effort, "N m"),
        ("speed_limit_rad_s", "velocity", limit.velocity, "rad/s"),
    ] {
        if node.get(key).is_some() {
            continue;
        }
        // A joint that may not push or not move is one whose limit nobody knew.
        match parts.keys.heeded(attribute, given).filter(|value| *value > 0.0) {
            Some(value) => {
                oddities.extend(attribute, placeholder(joint, key, attribute, value, unit));
                node.insert(key, number(value, &limit.place));
            }
            None if is_default(key) => {}
            None => {
                let problem = match given {
                    None => format!("<limit> has no {attribute}"),
                    Some(value) if value > 0.0 => format!("{attribute} is to be ignored"),
                    Some(_) => format!("{attribute} is 0"),
                };
                return Err(lacking(joint, &problem, key).at(&limit.place));
            }
        }
    }
    oddities.extend("friction", too_much_friction(node, joint));
    for key in ["damping_gain_nm_s_rad", "encoder_counts_per_turn"] {
        if node.get(key).is_none() && !is_default(key) {
            return Err(
                lacking(joint, &format!("no `{key}`, of which URDF knows nothing"), key).at(&node.place)
            );
        }
    }
    Ok(())
}

fn of(joint: &Joint) -> String {
    format!("joint `{}`", quote(&joint.name))
}

/// The error that a key is given nowhere.
fn lacking(joint: &Joint, problem: &str, key: &str) -> SceneError {
    let remedy = format!("give `{key}` in [joint_defaults], or in its [[joint]]");
    SceneError::new("", format!("{}: {problem}", of(joint)), remedy)
}

/// The joint that carries a joint; the file may say it too, but not otherwise.
fn set_parent(node: &mut Node, joint: &Joint, parent: Option<&str>, key: &str) -> Result<()> {
    match (node.get("parent"), parent) {
        (None, None) => Ok(()),
        (None, Some(parent)) => {
            node.insert("parent", text(parent, &joint.place));
            Ok(())
        }
        (Some(Node { value: Value::String(own), .. }), Some(parent)) if own == parent => Ok(()),
        (Some(own), parent) => {
            let problem = match parent {
                Some(parent) => format!("is `{}` in the URDF", quote(parent)),
                None => "is the base in the URDF".into(),
            };
            Err(SceneError::new(key, problem, "leave it out").at(&own.place))
        }
    }
}

/// Lower and upper end stop.
fn set_range(
    node: &mut Node,
    joint: &Joint,
    is_default: &dyn Fn(&str) -> bool,
    oddities: &mut Oddities,
) -> Result<()> {
    let key = "limits_rad";
    if node.get(key).is_some() {
        return Ok(());
    }
    let place = &joint.limit.place;
    let [lower, upper] = match (joint.kind, joint.limit.lower, joint.limit.upper) {
        (Kind::Continuous, ..) | (_, None, None) if is_default(key) => return Ok(()),
        (Kind::Continuous, ..) => {
            let what = format!("{} is continuous: its limits are taken as -pi and pi", of(joint));
            let remedy = format!("give `{key}` in its [[joint]]");
            oddities.extend("continuous", Some(Finding::notice(&joint.place, what, remedy)));
            [-PI, PI]
        }
        (_, None, None) => return Err(lacking(joint, "no limits", key).at(place)),
        // What is left out is zero, says URDF.
        (_, lower, upper) => [lower.unwrap_or(0.0), upper.unwrap_or(0.0)],
    };
    if !(lower < upper) {
        let problem = format!("{}: lower ({lower:?}) is not below upper ({upper:?})", of(joint));
        let remedy = format!("correct <limit>, or give `{key}` in its [[joint]]");
        return Err(SceneError::new("", problem, remedy).at(place));
    }
    // Zero, the nominal angle of a joint that says nothing, would be refused.
    if !(lower <= 0.0 && upper >= 0.0) && node.get("nominal_rad").is_none() && !is_default("nominal_rad") {
        node.insert("nominal_rad", number(0.5 * (lower + upper), place));
    }
    node.insert(key, list(&[lower, upper], place));
    Ok(())
}

fn placeholder(joint: &Joint, key: &str, attribute: &str, value: f64, unit: &str) -> Option<Finding> {
    let what = format!("{}: {attribute} of {value:?} {unit} looks like a placeholder", of(joint));
    let remedy =
        format!("if so, give `{key}` in [joint_defaults] and `ignore = [\"{attribute}\"]` in [urdf]");
    (value >= PLACEHOLDER).then(|| Finding::notice(&joint.limit.place, what, remedy))
}

/// Friction of the URDF that the motor can't overcome: it holds still, or never comes near its speed.
fn too_much_friction(node: &Node, joint: &Joint) -> Option<Finding> {
    let number = |key: &str| match node.get(key) {
        Some(Node { value: Value::Float(value), place }) => Some((*value, place)),
        _ => None,
    };
    let is_of_the_urdf = |(_, place): &(f64, &Place)| **place == joint.dynamics.place;
    let (torque, _) = number("torque_limit_nm")?;
    let friction = number("coulomb_friction_nm").filter(is_of_the_urdf).map(|(friction, _)| friction);
    let damping = number("viscous_friction_nm_s_rad").filter(is_of_the_urdf).map(|(damping, _)| damping);
    let what = match (friction, damping, number("speed_limit_rad_s")) {
        (Some(friction), ..) if !(friction < torque) => {
            format!("its friction of {friction:?} N m is more than its motor can turn against")
        }
        (_, Some(damping), Some((speed, _))) if !(damping * speed < torque) => {
            format!("its damping of {damping:?} N m s/rad leaves its motor nothing at {speed:?} rad/s")
        }
        _ => return None,
    };
    let remedy = "if it is a placeholder, add `ignore = [\"friction\", \"damping\"]` to [urdf]";
    Some(Finding::notice(&joint.dynamics.place, format!("{}: {what}", of(joint)), remedy))
}

/// Moments and products as a hand's file has them.
fn moments(inertia: &Matrix3<f64>) -> [f64; 6] {
    let i = inertia;
    [i.m11, i.m22, i.m33, i.m12, i.m13, i.m23]
}

/// A number.
pub(super) fn number(value: f64, place: &Place) -> Node {
    Node { value: Value::Float(value), place: place.clone() }
}

/// A string.
pub(super) fn text(value: &str, place: &Place) -> Node {
    Node { value: Value::String(value.into()), place: place.clone() }
}

/// An array of numbers.
pub(super) fn list<const N: usize>(values: &[f64; N], place: &Place) -> Node {
    let items = values.iter().map(|&value| number(value, place)).collect();
    Node { value: Value::Array(items), place: place.clone() }
}
