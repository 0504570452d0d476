//! Which links are fingertips, where their spheres are, and how large.
//!
//! A finger ends with a joint below which none moves. Among the links that this joint carries, a sphere among their shapes, or
//! `tip` in a name, tells the fingertip. Once one finger is told in this way, ends without are none.

use super::super::super::check::{Result, fail};
use super::super::super::error::{Place, SceneError};
use super::super::assembly::{Assembly, Seat};
use super::super::keys::Keys;
use super::super::robot::{Robot, Sphere};
use super::super::topology::Tree;
use super::super::transform::Transform;
use super::super::xml::quote;
use super::FingertipRequest;
use crate::MAX_FINGERS;
use nalgebra::Vector3;

/// Radius of a fingertip, as a share of the finger's length: 0.095 for the paper's hand.
const RADIUS_SHARE: f64 = 0.1;
/// A link whose origin is closer to the joint that carries it does not tell where the finger ends, m.
const SAME_PLACE_M: f64 = 1e-3;

/// A fingertip.
#[derive(Clone, Debug)]
pub(super) struct Tip {
    /// Index of its link.
    pub(super) link: usize,
    /// Its centre in the frame of the link, m.
    pub(super) offset_m: Vector3<f64>,
    /// Its radius, m; guessed later, if nothing tells it.
    pub(super) radius_m: Option<f64>,
    /// What tells where it is.
    pub(super) offset_from: &'static str,
    /// What tells its radius.
    pub(super) radius_from: &'static str,
    /// Whether the offset is that of a rod's end, from which the radius has yet to be taken.
    pub(super) is_end: bool,
}

/// A guessed radius for a finger of a length.
pub(super) fn radius_of(length_m: f64) -> f64 {
    RADIUS_SHARE * length_m
}

/// The fingertips that are asked for, or those that can be found.
pub(super) fn choose(
    robot: &Robot,
    tree: &Tree,
    keys: &Keys,
    wanted: &[FingertipRequest],
) -> Result<Vec<Tip>> {
    let option = |error: SceneError| error.at(&Place::whole("--fingertip"));
    if wanted.is_empty() {
        return guess(robot, tree, keys);
    }
    wanted.iter().map(|wanted| asked(robot, wanted).map_err(option)).collect()
}

/// A fingertip that is asked for.
fn asked(robot: &Robot, wanted: &FingertipRequest) -> Result<Tip> {
    let Some(link) = robot.link_index(&wanted.link) else {
        let problem = format!("there is no link `{}`", quote(&wanted.link));
        return fail("", problem, robot.link_suggestion(&wanted.link));
    };
    let sphere = outermost(&robot.links[link].spheres);
    let (offset_m, offset_from) = match (wanted.offset_m, sphere) {
        (Some(offset), _) => (offset.into(), "as asked"),
        (None, Some(sphere)) => (sphere.centre_m, "a sphere of the link"),
        (None, None) => (Vector3::zeros(), "the origin of the link"),
    };
    let (radius_m, radius_from) = match (wanted.radius_m, sphere) {
        (Some(radius), _) => (Some(radius), "as asked"),
        (None, Some(sphere)) => (Some(sphere.radius_m), "a sphere of the link"),
        (None, None) => (None, "a tenth of the finger's length"),
    };
    Ok(Tip { link, offset_m, radius_m, offset_from, radius_from, is_end: false })
}

/// The sphere that reaches furthest from the link's origin.
fn outermost(spheres: &[Sphere]) -> Option<Sphere> {
    let reach = |sphere: &Sphere| sphere.centre_m.norm() + sphere.radius_m;
    spheres.iter().copied().max_by(|a, b| reach(a).total_cmp(&reach(b)))
}

/// The ends of the fingers, as far as anything tells them.
fn guess(robot: &Robot, tree: &Tree, keys: &Keys) -> Result<Vec<Tip>> {
    let free = Free::new(robot, tree, keys)?;
    let mut told = Vec::new();
    let mut untold = Vec::new();
    for &end in &free.ends {
        let links: Vec<usize> = free.carried_by(end);
        match tell(robot, &free.assembly, &links) {
            Some(tip) => told.push(tip),
            None => untold.push((end, links)),
        }
    }
    if told.is_empty() {
        told = untold
            .iter()
            .map(|(end, links)| from_mass(robot, &free.assembly, *end, links))
            .collect::<Result<_>>()?;
    }
    let names = || {
        let names: Vec<String> =
            told.iter().map(|tip| format!("`{}`", quote(&robot.links[tip.link].name))).collect();
        names.join(", ")
    };
    match told.len() {
        0 => {
            let remedy = "a hand needs revolute joints that --lock does not hold still";
            Err(SceneError::new("", "no joint moves", remedy).at(&robot.place))
        }
        1 => Err(none_found(robot, &format!("only link {} looks like a fingertip", names()))),
        count if count > MAX_FINGERS => Err(none_found(
            robot,
            &format!("{count} links look like fingertips, of which {MAX_FINGERS} can be used: {}", names()),
        )),
        _ => Ok(told),
    }
}

fn none_found(robot: &Robot, problem: &str) -> SceneError {
    SceneError::new("", problem, "name the fingertips: --fingertip LINK[:x,y,z[:radius_m]]").at(&robot.place)
}

/// The robot with every joint free that is not held still, of whatever kind.
struct Free {
    assembly: Assembly,
    /// Joints of the assembly below which there is none.
    ends: Vec<usize>,
}

impl Free {
    fn new(robot: &Robot, tree: &Tree, keys: &Keys) -> Result<Self> {
        let assembly = Assembly::of_all(robot, tree, keys)?;
        let is_end = |index: &usize| assembly.joints.iter().all(|joint| joint.parent != Some(*index));
        let ends = (0..assembly.joints.len()).filter(is_end).collect();
        Ok(Self { assembly, ends })
    }

    /// The links that a joint carries.
    fn carried_by(&self, index: usize) -> Vec<usize> {
        let is_on = |seat: &Option<Seat>| seat.is_some_and(|seat| seat.joint == Some(index));
        (0..self.assembly.seats.len()).filter(|&link| is_on(&self.assembly.seats[link])).collect()
    }
}

/// Where a link is in the frame of the joint that carries it.
fn frame(assembly: &Assembly, link: usize) -> Transform {
    assembly.seats[link].and_then(|seat| seat.frame).unwrap_or(Transform::identity())
}

/// The fingertip among the links of a finger's end, if a sphere or a name tells it.
fn tell(robot: &Robot, assembly: &Assembly, links: &[usize]) -> Option<Tip> {
    let is_tip = |link: &usize| robot.links[*link].name.to_lowercase().contains("tip");
    let named: Vec<usize> = links.iter().copied().filter(is_tip).collect();
    let candidates =
        if named.iter().any(|&link| !robot.links[link].spheres.is_empty()) { &named } else { links };
    let spheres = candidates.iter().flat_map(|&link| {
        let frame = frame(assembly, link);
        robot.links[link]
            .spheres
            .iter()
            .map(move |sphere| (link, *sphere, frame.point(&sphere.centre_m).norm() + sphere.radius_m))
    });
    if let Some((link, sphere, _)) = spheres.max_by(|a, b| a.2.total_cmp(&b.2)) {
        return Some(Tip {
            link,
            offset_m: sphere.centre_m,
            radius_m: Some(sphere.radius_m),
            offset_from: "a sphere of the link",
            radius_from: "a sphere of the link",
            is_end: false,
        });
    }
    let reach = |link: &usize| frame(assembly, *link).offset_m.norm();
    let link = named.into_iter().max_by(|a, b| reach(a).total_cmp(&reach(b)))?;
    (reach(&link) > SAME_PLACE_M).then_some(Tip {
        link,
        offset_m: Vector3::zeros(),
        radius_m: None,
        offset_from: "the origin of the link, for its name",
        radius_from: "a tenth of the finger's length",
        is_end: false,
    })
}

/// A fingertip from where the mass is: what ends a finger is taken for a uniform rod from its joint on, whose end is as far
/// beyond its centre of mass as its joint is before it.
fn from_mass(robot: &Robot, assembly: &Assembly, end: usize, links: &[usize]) -> Result<Tip> {
    let joint = &assembly.joints[end];
    let link = robot.joints[joint.joint].child;
    if !(joint.body.centre_m.norm() > SAME_PLACE_M) {
        let problem = format!(
            "nothing tells where the finger ends whose last link is `{}`",
            quote(&robot.links[links.last().copied().unwrap_or(link)].name)
        );
        return Err(none_found(robot, &problem));
    }
    Ok(Tip {
        link,
        offset_m: joint.body.centre_m * 2.0,
        radius_m: None,
        offset_from: "the end of a uniform rod with the link's centre of mass",
        radius_from: "a tenth of the finger's length",
        is_end: true,
    })
}
