//! From a URDF to the entries of a hand.

use super::super::check::{Result, fail, item};
use super::super::error::{Place, SceneError, suggestion};
use super::super::file::FingertipFile;
use super::super::hand::{MAX_CAPSULES, is_capsule};
use super::super::inspect::finding::Finding;
use super::super::library::Home;
use super::super::read::read;
use super::super::tree::{Entry, Node, Value};
use super::assembly::{Assembly, Moving, Seat};
use super::complete::{Oddities, complete, list, number, text};
use super::keys::Keys;
use super::robot::{Joint, Kind, Robot};
use super::shape::{Round, Shape, capsules};
use super::topology::Tree;
use super::xml::quote;
use nalgebra::Vector3;

/// The file that a hand's `[urdf]` names.
pub(crate) fn file_of(hand: &Node) -> Option<&Node> {
    hand.get("urdf")?.get("file")
}

/// Replaces the table `[urdf]` of a hand, if there is one, by joints and fingertips. Defaults of fingertips are spread
/// before, those of joints after.
///
/// # Errors
/// What is wrong with the URDF, in the URDF; or with the hand's file, there.
pub(crate) fn expand(hand: &mut Node, home: &Home, notices: &mut Vec<Finding>) -> Result<()> {
    let Some(Entry { place, node: table, .. }) = hand.take("urdf") else { return Ok(()) };
    let keys: Keys = read(&table, "urdf")?;
    let at_key = |error: SceneError| {
        // Only errors about the table have none yet.
        let place = table.place_of(error.key.strip_prefix("urdf.").unwrap_or_default()).clone();
        error.at(&place)
    };
    keys.check().map_err(at_key)?;
    let file_place = table.place_of("file");
    let (text, source) =
        home.urdf(&keys.file, file_place).map_err(|error| error.of_reference("urdf.file", file_place))?;
    let robot = Robot::parse(&text, &source)?;
    let tree = Tree::of(&robot)?;

    let Some(list) = hand.get("fingertip") else {
        let error = SceneError::new("fingertip", "is missing", "add a [[fingertip]], with the URDF's link");
        return Err(error.at(&place));
    };
    let fingertips: Vec<FingertipFile> = read(list, "fingertip")?;
    let mut tips = Vec::with_capacity(fingertips.len());
    for (i, fingertip) in fingertips.iter().enumerate() {
        match robot.link_index(&fingertip.link) {
            Some(link) => tips.push(link),
            None => {
                let problem = format!("{} has no link `{}`", keys.file, quote(&fingertip.link));
                let error = SceneError::new(
                    item("fingertip", i, "link"),
                    problem,
                    robot.link_suggestion(&fingertip.link),
                );
                return Err(error.at(hand.place_of(&item("fingertip", i, "link"))));
            }
        }
    }
    let assembly = Assembly::new(&robot, &tree, &keys, &tips, notices).map_err(at_key)?;
    let hand_parts = Parts { robot: &robot, assembly: &assembly, keys: &keys, place: &place };
    let centres_m = hand_parts.seat_fingertips(hand, &fingertips, &tips)?;
    if hand.get("capsule").is_some() {
        hand_parts.seat_capsules(hand)?;
    } else {
        notices.extend(hand_parts.add_capsules(hand, &fingertips, &centres_m));
    }
    hand_parts.add_joints(hand, notices)
}

/// A capsule, and what it is on.
pub(super) struct Surface {
    /// The link of the URDF.
    pub(super) link: usize,
    /// Index of the joint that carries it; none on the base.
    pub(super) joint: Option<usize>,
    /// In the frame of that joint's own link.
    pub(super) round: Round,
    /// `true` for what more shapes have.
    pub(super) is_more: bool,
}

/// The capsules of the shapes that touch, and of more shapes of links, beside fingertips: carrying joint, centre in the frame of its
/// link (m) and radius (m) of each.
pub(super) fn surfaces(
    robot: &Robot,
    assembly: &Assembly,
    fingertips: &[(usize, Vector3<f64>, f64)],
    more: &[(usize, Shape)],
) -> Vec<Surface> {
    let mut surfaces = Vec::new();
    for (k, (link, seat)) in robot.links.iter().zip(&assembly.seats).enumerate() {
        let Some(Seat { joint, frame }) = *seat else { continue };
        let placed = |shape: &Shape| frame.map_or(*shape, |frame| shape.seen_from(&frame));
        let own = link.shapes.iter().filter(|shape| shape.is_collision).map(placed).collect();
        let others = more.iter().filter(|(link, _)| *link == k).map(|(_, shape)| placed(shape)).collect();
        let on_it = fingertips.iter().filter(|(carrier, ..)| Some(*carrier) == joint);
        let on_it: Vec<_> = on_it.map(|(_, centre_m, radius_m)| (*centre_m, *radius_m)).collect();
        for (shapes, is_more) in [(own, false), (others, true)] {
            let shapes: Vec<Shape> = shapes;
            let rounds = capsules(&shapes, &on_it).into_iter();
            surfaces.extend(rounds.map(|round| Surface { link: k, joint, round, is_more }));
        }
    }
    surfaces
}

/// The parts of the entries.
pub(super) struct Parts<'a> {
    pub(super) robot: &'a Robot,
    pub(super) assembly: &'a Assembly,
    pub(super) keys: &'a Keys,
    /// Of the table `[urdf]`.
    pub(super) place: &'a Place,
}

impl Parts<'_> {
    /// The joint as the URDF has it.
    pub(super) fn joint(&self, moving: &Moving) -> &Joint {
        &self.robot.joints[moving.joint]
    }

    /// Name of one of the hand's joints.
    pub(super) fn name(&self, index: usize) -> &str {
        &self.joint(&self.assembly.joints[index]).name
    }

    /// Fingertips move from their links to the joints that carry them; returns these joints and their centres there, m.
    fn seat_fingertips(
        &self,
        hand: &mut Node,
        fingertips: &[FingertipFile],
        tips: &[usize],
    ) -> Result<Vec<(usize, Vector3<f64>)>> {
        let mut centres_m = Vec::with_capacity(tips.len());
        for (i, (fingertip, &link)) in fingertips.iter().zip(tips).enumerate() {
            let key = item("fingertip", i, "link");
            let seat = self.assembly.seats[link];
            let Some(Seat { joint: Some(joint), frame }) = seat else {
                let problem = match seat {
                    Some(_) => format!("no joint moves link `{}`", quote(&fingertip.link)),
                    None => format!("link `{}` is not below the base", quote(&fingertip.link)),
                };
                let remedy = "choose a link of a finger, or another base, or hold less still ([urdf])";
                return Err(SceneError::new(&key, problem, remedy).at(hand.place_of(&key)));
            };
            let Some(node) = hand.get_mut("fingertip").and_then(|list| list.item_mut(i)) else { continue };
            if let Some(link) = node.get_mut("link") {
                link.value = Value::String(self.name(joint).into());
            }
            let mut centre_m = Vector3::from(fingertip.offset_m);
            if let (Some(frame), Some(offset)) = (frame, node.get_mut("offset_m")) {
                let place = offset.place.clone();
                centre_m = frame.point(&centre_m);
                *offset = list(&centre_m.into(), &place);
            }
            centres_m.push((joint, centre_m));
        }
        Ok(centres_m)
    }

    /// The file's own capsules move from their links to the joints that carry them.
    fn seat_capsules(&self, hand: &mut Node) -> Result<()> {
        let Some(Node { value: Value::Array(items), .. }) = hand.get_mut("capsule") else { return Ok(()) };
        for (k, node) in items.iter_mut().enumerate() {
            let Some(Entry { node: link, .. }) = node.take("link") else { continue };
            let key = item("capsule", k, "link");
            let name: String = read(&link, &key)?;
            let fail =
                |problem: String, remedy: String| Err(SceneError::new(&key, problem, remedy).at(&link.place));
            let Some(index) = self.robot.link_index(&name) else {
                let problem = format!("{} has no link `{}`", self.keys.file, quote(&name));
                return fail(problem, self.robot.link_suggestion(&name));
            };
            let Some(Seat { joint, frame }) = self.assembly.seats[index] else {
                let problem = format!("link `{}` is not below the base", quote(&name));
                return fail(problem, "choose a link of the hand, or another base ([urdf])".into());
            };
            if let Some(joint) = joint {
                node.insert("link", text(self.name(joint), &link.place));
            }
            for end in ["from_m", "to_m"] {
                if let (Some(frame), Some(node)) = (frame, node.get_mut(end)) {
                    let end_m: [f64; 3] = read(node, &item("capsule", k, end))?;
                    *node = list(&frame.point(&end_m.into()).into(), &node.place);
                }
            }
        }
        Ok(())
    }

    /// The array `capsule`: what stands for the shapes of the URDF that touch. What can't be used is told.
    fn add_capsules(
        &self,
        hand: &mut Node,
        fingertips: &[FingertipFile],
        centres_m: &[(usize, Vector3<f64>)],
    ) -> Option<Finding> {
        let tips = centres_m.iter().zip(fingertips);
        let tips: Vec<_> = tips.map(|((joint, centre_m), tip)| (*joint, *centre_m, tip.radius_m)).collect();
        let mut surfaces = surfaces(self.robot, self.assembly, &tips, &[]);
        let all = surfaces.len();
        surfaces.retain(|surface| is_capsule(&surface.round.ends_m, surface.round.radius_m));
        let (count, beyond) = (surfaces.len(), all - surfaces.len());
        let told = |what: String| {
            Some(Finding::notice(&self.robot.place, what, "give the hand's file [[capsule]]s of its own"))
        };
        if count > MAX_CAPSULES {
            return told(format!(
                "its <collision> shapes make {count} capsules, of which a hand may have {MAX_CAPSULES}: links touch nothing"
            ));
        }
        if count > 0 {
            let items = surfaces.iter().map(|surface| self.capsule(surface)).collect();
            hand.insert("capsule", Node { value: Value::Array(items), place: self.place.clone() });
        }
        match beyond {
            0 => None,
            1 => told(
                "a capsule of its <collision> shapes is too small or too large: it touches nothing".into(),
            ),
            _ => told(format!(
                "{beyond} capsules of its <collision> shapes are too small or too large: they touch nothing"
            )),
        }
    }

    /// An entry of the array `capsule`.
    fn capsule(&self, surface: &Surface) -> Node {
        let Surface { link, joint, round: Round { ends_m: [from_m, to_m], radius_m }, .. } = *surface;
        let place = &self.robot.links[link].place;
        let mut node = Node { value: Value::Table(Vec::new()), place: place.clone() };
        if let Some(joint) = joint {
            node.insert("link", text(self.name(joint), place));
        }
        node.insert("from_m", list(&from_m.into(), place));
        node.insert("to_m", list(&to_m.into(), place));
        node.insert("radius_m", number(radius_m, place));
        node
    }

    /// The array `joint`: in its own order if it is there, else in the tree's.
    fn add_joints(&self, hand: &mut Node, notices: &mut Vec<Finding>) -> Result<()> {
        let count = self.assembly.joints.len();
        let entries = match hand.take("joint") {
            None => self.in_tree_order(),
            Some(Entry { node: Node { value: Value::Array(items), .. }, .. }) => self.in_own_order(items)?,
            Some(entry) => {
                let error = SceneError::new("joint", "is not a list", "write each joint as a [[joint]]");
                return Err(error.at(&entry.place));
            }
        };
        let mut items = Vec::with_capacity(count);
        let mut oddities = Oddities::default();
        for (k, (index, mut node)) in entries.into_iter().enumerate() {
            let is_default =
                |key: &str| hand.get("joint_defaults").is_some_and(|table| table.get(key).is_some());
            complete(self, &mut node, index, &item("joint", k, "parent"), &is_default, &mut oddities)?;
            items.push(node);
        }
        notices.extend(oddities.notices());
        let array = Node { value: Value::Array(items), place: self.place.clone() };
        hand.insert("joint", array);
        Ok(())
    }

    fn in_tree_order(&self) -> Vec<(usize, Node)> {
        let entry = |index: usize| {
            let mut node = Node { value: Value::Table(Vec::new()), place: self.place.clone() };
            let joint = self.joint(&self.assembly.joints[index]);
            node.insert("name", text(&joint.name, &joint.place));
            (index, node)
        };
        (0..self.assembly.joints.len()).map(entry).collect()
    }

    /// The entries of the file, each with the index of its joint. Parents come first, and none is left out.
    fn in_own_order(&self, items: Vec<Node>) -> Result<Vec<(usize, Node)>> {
        let mut entries: Vec<(usize, Node)> = Vec::with_capacity(items.len());
        for (k, node) in items.into_iter().enumerate() {
            let key = item("joint", k, "name");
            let Some(name) = node.get("name") else {
                let error =
                    SceneError::new(key, "is missing", "add the name of the URDF's joint: `name = ...`");
                return Err(error.at(&node.place));
            };
            let Value::String(word) = &name.value else {
                let error =
                    SceneError::new(key, "is not a string", "has to be the name of a joint of the URDF");
                return Err(error.at(&name.place));
            };
            let index = self.find(word, &key).map_err(|error| error.at(&name.place))?;
            if entries.iter().any(|(other, _)| *other == index) {
                let error =
                    SceneError::new(key, format!("`{}` is there twice", quote(word)), "leave one out");
                return Err(error.at(&name.place));
            }
            if let Some(parent) = self.assembly.joints[index].parent
                && entries.iter().all(|(other, _)| *other != parent)
            {
                let parent = quote(self.name(parent));
                let problem = format!("joint `{parent}`, which carries it, does not come before it");
                let remedy = format!("move the [[joint]] `{parent}` up, or add it");
                return Err(SceneError::new(key, problem, remedy).at(&name.place));
            }
            entries.push((index, node));
        }
        let is_listed = |index: usize| entries.iter().any(|(other, _)| *other == index);
        match (0..self.assembly.joints.len()).find(|&index| !is_listed(index)) {
            None => Ok(entries),
            Some(index) => {
                let name = self.name(index);
                let problem =
                    format!("joint `{}` of the URDF moves a fingertip and has no [[joint]]", quote(name));
                let remedy = format!(
                    "add it, or hold it still with `locked_rad = {{ {} = 0.0 }}`",
                    super::assembly::toml_key(&quote(name))
                );
                Err(SceneError::new("", problem, remedy).at(self.place))
            }
        }
    }

    /// Index of a joint of the hand by its name.
    fn find(&self, name: &str, key: &str) -> Result<usize> {
        let moving = &self.assembly.joints;
        if let Some(index) = moving.iter().position(|moving| self.joint(moving).name == name) {
            return Ok(index);
        }
        let quoted = quote(name);
        let Some(joint) = self.robot.joints.iter().find(|joint| joint.name == name) else {
            let names = moving.iter().map(|moving| self.joint(moving).name.as_str());
            return fail(key, format!("{} has no joint `{quoted}`", self.keys.file), suggestion(name, names));
        };
        let (problem, remedy) = if joint.kind == Kind::Fixed {
            ("is fixed in the URDF", "leave it out: what it carries is merged with what carries it")
        } else if self.keys.locked_rad.contains_key(name) || self.keys.locked_m.contains_key(name) {
            ("is held still in [urdf]", "leave it out, here or there")
        } else if self.assembly.seats[joint.child].is_none() {
            ("is not below the base", "leave it out, or choose another `base` in [urdf]")
        } else {
            ("moves no fingertip", "leave it out: what it carries is merged with what carries it")
        };
        fail(key, format!("joint `{quoted}` {problem}"), remedy)
    }
}
