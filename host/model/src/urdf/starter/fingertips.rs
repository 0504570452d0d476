//! The links that are fingertips, and the places and sizes of their spheres.
//!
//! A finger ends with a joint below which none moves. Among the links that this joint carries, a sphere among their shapes, or
//! `tip` in a name, tells the fingertip. Once one finger is told in this way, ends without are none.

use super::super::super::check::{Result, fail};
use super::super::super::error::{Place, SceneError};
use super::super::assembly::{Assembly, Seat};
use super::super::keys::Keys;
use super::super::robot::Robot;
use super::super::shape::{Shape, Solid};
use super::super::topology::Tree;
use super::super::transform::Transform;
use super::super::xml::quote;
use super::FingertipRequest;
use blindgrasp_body::MAX_FINGERS;
use nalgebra::Vector3;

/// Radius of a fingertip, as a share of the finger's length: 0.095 for the paper's hand.
const RADIUS_SHARE: f64 = 0.1;
/// The words on that.
const SHARE: &str = "a tenth of the finger's length";
/// Smaller spheres are markers, not fingertips: radius, m.
const MARKER_M: f64 = 2e-3;
/// The words on what the user said.
pub(super) const ASKED: &str = "as asked";
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
    /// The origin of its place.
    pub(super) offset_from: &'static str,
    /// The origin of its radius.
    pub(super) radius_from: &'static str,
    /// `true` if the offset is that of a rod's end, from which the radius has yet to be taken.
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
    let sphere = spheres(robot, link).max_by(|a, b| reach(a).total_cmp(&reach(b)));
    let (offset_m, offset_from) = match (wanted.offset_m, sphere) {
        (Some(offset), _) => (offset.into(), ASKED),
        (None, Some(sphere)) => (sphere.centre_m(), "a sphere of the link"),
        (None, None) => (Vector3::zeros(), "the origin of the link"),
    };
    let (radius_m, radius_from) = match (wanted.radius_m, sphere) {
        (Some(radius), _) => (Some(radius), ASKED),
        (None, Some(sphere)) => (Some(sphere.radius_m()), "a sphere of the link"),
        (None, None) => (None, SHARE),
    };
    Ok(Tip { link, offset_m, radius_m, offset_from, radius_from, is_end: false })
}

/// Returns the farthest distance of a shape from its link's origin, m.
fn reach(shape: &Shape) -> f64 {
    shape.centre_m().norm() + shape.radius_m()
}

/// The spheres of a link.
fn spheres(robot: &Robot, link: usize) -> impl Iterator<Item = Shape> + '_ {
    robot.links[link].shapes.iter().copied().filter(|shape| matches!(shape.solid, Solid::Sphere { .. }))
}

/// The ends of the fingers, as far as anything tells them.
fn guess(robot: &Robot, tree: &Tree, keys: &Keys) -> Result<Vec<Tip>> {
    let free = Free::new(robot, tree, keys)?;
    let mut told = Vec::new();
    let mut untold = Vec::new();
    for &end in &free.ends {
        let finger = Finger { robot, assembly: &free.assembly, end, links: free.carried_by(end) };
        match finger.with_a_sphere() {
            Some(tip) => told.push(tip),
            None if finger.has_a_tip_by_name() => told.push(finger.by_name()?),
            None => untold.push(finger),
        }
    }
    if told.is_empty() {
        told = untold.iter().map(Finger::by_shape_or_mass).collect::<Result<_>>()?;
    }
    let names = || {
        let names: Vec<String> =
            told.iter().map(|tip| format!("`{}`", quote(&robot.links[tip.link].name))).collect();
        names.join(", ")
    };
    match told.len() {
        0 => {
            let remedy = "a hand needs revolute joints below its base that --lock does not hold still";
            Err(SceneError::new("", "no joint moves", remedy).at(&robot.place))
        }
        1 => Err(unclear(robot, &format!("only link {} looks like a fingertip", names()))),
        count if count > MAX_FINGERS => Err(unclear(
            robot,
            &format!("{count} links look like fingertips, of which {MAX_FINGERS} can be used: {}", names()),
        )),
        _ => Ok(told),
    }
}

fn unclear(robot: &Robot, problem: &str) -> SceneError {
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

/// The end of a finger: a joint below which none moves, and the links that it carries.
struct Finger<'a> {
    robot: &'a Robot,
    assembly: &'a Assembly,
    /// Index among the assembly's joints.
    end: usize,
    links: Vec<usize>,
}

impl Finger<'_> {
    /// Returns the pose of a link in the frame of the joint that carries it.
    fn frame(&self, link: usize) -> Transform {
        self.assembly.seats[link].and_then(|seat| seat.frame).unwrap_or(Transform::identity())
    }

    fn named(&self) -> impl Iterator<Item = usize> + '_ {
        let is_tip = |link: &usize| self.robot.links[*link].name.to_lowercase().contains("tip");
        self.links.iter().copied().filter(is_tip)
    }

    fn has_a_tip_by_name(&self) -> bool {
        self.named().next().is_some()
    }

    /// The shape that reaches furthest from the joint, of some links.
    fn outermost(&self, shapes: impl Iterator<Item = (usize, Shape)>) -> Option<(usize, Shape)> {
        let reach = |(link, shape): &(usize, Shape)| {
            self.frame(*link).point(&self.far_end_m(*link, shape)).norm() + shape.radius_m()
        };
        shapes.max_by(|a, b| reach(a).total_cmp(&reach(b)))
    }

    /// The middle of a shape, of a capsule that of its end that is further from the joint, in the frame of its link, m.
    fn far_end_m(&self, link: usize, shape: &Shape) -> Vector3<f64> {
        let [a, b] = shape.ends_m();
        let distance = |end_m: &Vector3<f64>| self.frame(link).point(end_m).norm();
        if distance(&a) > distance(&b) { a } else { b }
    }

    /// A fingertip that is a sphere, if there is one: best of a link that is called a tip.
    fn with_a_sphere(&self) -> Option<Tip> {
        let of = |link: usize| {
            let spheres = spheres(self.robot, link).filter(|sphere| sphere.radius_m() >= MARKER_M);
            spheres.map(move |shape| (link, shape))
        };
        let named = self.outermost(self.named().flat_map(of));
        let (link, sphere) = named.or_else(|| self.outermost(self.links.iter().copied().flat_map(of)))?;
        Some(Tip {
            link,
            offset_m: sphere.centre_m(),
            radius_m: Some(sphere.radius_m()),
            offset_from: "a sphere of the link",
            radius_from: "a sphere of the link",
            is_end: false,
        })
    }

    /// A fingertip by the name of its link: the centre of mass of the link, if it is a part of its own, or its origin.
    fn by_name(&self) -> Result<Tip> {
        let distance = |link: &usize| self.frame(*link).offset_m.norm();
        let furthest = self.named().max_by(|a, b| distance(a).total_cmp(&distance(b)));
        let Some(link) = furthest.filter(|link| distance(link) > SAME_PLACE_M) else {
            return self.by_shape_or_mass();
        };
        let centre = self.robot.links[link]
            .body
            .as_ref()
            .ok()
            .filter(|body| body.mass_kg > 0.0 && body.centre_m.norm() > SAME_PLACE_M);
        let (offset_m, offset_from) = match centre {
            Some(body) => (body.centre_m, "the centre of mass of the link, for its name"),
            None => (Vector3::zeros(), "the origin of the link, for its name"),
        };
        Ok(Tip { link, offset_m, radius_m: None, offset_from, radius_from: SHARE, is_end: false })
    }

    /// A fingertip from a box or the like, or from where the mass is: what ends a finger is taken for a uniform rod from its
    /// joint on, whose end is as far beyond its centre of mass as its joint is before it.
    fn by_shape_or_mass(&self) -> Result<Tip> {
        let shapes = self
            .links
            .iter()
            .flat_map(|&link| self.robot.links[link].shapes.iter().map(move |shape| (link, *shape)));
        if let Some((link, shape)) = self.outermost(shapes)
            && let offset_m = self.far_end_m(link, &shape)
            && self.frame(link).point(&offset_m).norm() > SAME_PLACE_M
        {
            let (offset_from, radius_from) = match shape.solid {
                Solid::Capsule { .. } => ("the end of a capsule of the link", "that of the same"),
                _ => ("the middle of a box or cylinder of the link", "half the least thickness of the same"),
            };
            let radius_m = Some(shape.radius_m());
            return Ok(Tip { link, offset_m, radius_m, offset_from, radius_from, is_end: false });
        }
        let joint = &self.assembly.joints[self.end];
        let link = self.robot.joints[joint.joint].child;
        if !(joint.body.centre_m.norm() > SAME_PLACE_M) {
            let name = quote(&self.robot.links[link].name);
            let problem = format!("nothing tells where the finger ends whose last link is `{name}`");
            return Err(unclear(self.robot, &problem));
        }
        Ok(Tip {
            link,
            offset_m: joint.body.centre_m * 2.0,
            radius_m: None,
            offset_from: "the end of a uniform rod with the link's centre of mass",
            radius_from: SHARE,
            is_end: true,
        })
    }
}
