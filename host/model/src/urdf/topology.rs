//! The tree that a robot has to be: one root, and one way to every link.

use super::super::error::SceneError;
use super::robot::Robot;
use super::xml::quote;

/// The tree of a robot.
#[derive(Clone, Debug)]
pub(super) struct Tree {
    /// Index of the link that hangs on no joint.
    pub(super) root: usize,
    /// The joint that carries a link; none for the root.
    pub(super) carrier: Vec<Option<usize>>,
    /// The joints that sit on a link, in the file's order.
    pub(super) carried: Vec<Vec<usize>>,
}

impl Tree {
    /// The tree of a robot.
    ///
    /// # Errors
    /// It is none: no link, two roots, a link on two joints, a circle.
    pub(super) fn of(robot: &Robot) -> Result<Self, SceneError> {
        let name = |link: usize| quote(&robot.links[link].name);
        let count = robot.links.len();
        let (mut carrier, mut carried) = (vec![None; count], vec![Vec::new(); count]);
        for (k, joint) in robot.joints.iter().enumerate() {
            if let Some(other) = carrier[joint.child].replace(k) {
                let other: &super::robot::Joint = &robot.joints[other];
                let problem = format!(
                    "link `{}` hangs on two joints, `{}` and `{}`",
                    name(joint.child),
                    quote(&other.name),
                    quote(&joint.name)
                );
                let remedy = "remove one of them: a URDF is a tree, and has no closed loops";
                return Err(SceneError::new("", problem, remedy).at(&joint.place));
            }
            carried[joint.parent].push(k);
        }
        let roots: Vec<usize> = (0..count).filter(|&link| carrier[link].is_none()).collect();
        match roots[..] {
            [root] => {
                let tree = Self { root, carrier, carried };
                // Without a second root, what the root does not reach goes round in a circle.
                let reached = tree.below(root, robot);
                match (0..count).find(|link| !reached.contains(link)) {
                    None => Ok(tree),
                    Some(link) => Err(tree.circle(link, robot)),
                }
            }
            [] if count == 0 => Err(SceneError::new("", "has no <link>", "is this a URDF?").at(&robot.place)),
            [] => Err(Self { root: 0, carrier, carried }.circle(0, robot)),
            [first, second, ..] => {
                let problem = format!("links `{}` and `{}` hang on no joint", name(first), name(second));
                let remedy = "a URDF has one root: join them by a fixed joint, or remove one";
                Err(SceneError::new("", problem, remedy).at(&robot.links[second].place))
            }
        }
    }

    /// A link and all below it, parents first, branch after branch.
    pub(super) fn below(&self, link: usize, robot: &Robot) -> Vec<usize> {
        let mut order = Vec::new();
        let mut ahead = vec![link];
        while let Some(link) = ahead.pop() {
            order.push(link);
            ahead.extend(self.carried[link].iter().rev().map(|&joint| robot.joints[joint].child));
        }
        order
    }

    /// The joints between a link and the root, from the link up.
    pub(super) fn above<'a>(&'a self, link: usize, robot: &'a Robot) -> impl Iterator<Item = usize> + 'a {
        std::iter::successors(self.carrier[link], |&joint| self.carrier[robot.joints[joint].parent])
    }

    /// Tells the circle that is above a link without a root.
    fn circle(&self, link: usize, robot: &Robot) -> SceneError {
        // After as many steps up as there are links, one is in the circle.
        let mut joints = self.above(link, robot);
        let Some(inside) = joints.nth(robot.links.len()) else {
            return SceneError::new("", "links go round in a circle", "").at(&robot.place);
        };
        let start = robot.joints[inside].child;
        let mut names = vec![quote(&robot.links[start].name)];
        for joint in self.above(start, robot) {
            let parent = robot.joints[joint].parent;
            names.insert(0, quote(&robot.links[parent].name));
            if parent == start {
                break;
            }
        }
        let problem = format!("links go round in a circle: `{}`", names.join("` -> `"));
        SceneError::new("", problem, "remove one of the joints: a URDF is a tree")
            .at(&robot.joints[inside].place)
    }
}
