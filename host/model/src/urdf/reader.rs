//! From the elements of a URDF to a [`Robot`].

use super::super::error::{Place, SceneError, suggestion};
use super::body::Body;
use super::robot::{Dynamics, Joint, Kind, Limit, Link, Mesh, Origin, Robot};
use super::shape::{Shape, Solid};
use super::transform::Transform;
use super::xml::{Text, child, children, quote};
use nalgebra::{Matrix3, UnitQuaternion, Vector3};
use roxmltree::Node;

/// Links, or joints. Humanoids with both hands have less than 200.
const MOST_PARTS: usize = 2000;
/// Largest difference of an axis from a unit vector: files with three decimals are that far off.
const AXIS_SLACK: f64 = 1e-3;

/// Shorter ones have no direction that was meant.
const SHORTEST_AXIS: f64 = 1e-4;

/// Largest excess of the square of a product of inertia over the product of its moments, relatively: rounded digits.
const PRODUCT_SLACK: f64 = 1e-4;

impl Robot {
    /// Reads a URDF. Meshes, materials, transmissions and the like are not looked at.
    ///
    /// # Errors
    /// The first thing that is wrong: where, what, what to do.
    pub(super) fn parse(text: &str, source: &str) -> Result<Self, SceneError> {
        let text = Text::new(text, source);
        let document = text.document()?;
        let root = document.root_element();
        text.refuse_xacro(root)?;
        let place = text.place(root);
        match root.tag_name().name() {
            "robot" => {}
            tag => {
                let remedy = match tag {
                    "sdf" => "that is SDF: convert it to URDF first",
                    "mujoco" | "mujocoinclude" => "that is MJCF: convert it to URDF first",
                    _ => "is this a URDF?",
                };
                let problem = format!("the root is <{}>, not <robot>", quote(tag));
                return Err(SceneError::new("", problem, remedy).at(&place));
            }
        }
        let reader = Reader { text, quaternions: version(root) >= (1, 1) };
        let name = root.attribute("name").unwrap_or_default().into();
        let mut robot = Self { place, name, links: vec![], joints: vec![] };
        for element in root.children().filter(Node::is_element) {
            reader.text.refuse_xacro(element)?;
            if element.tag_name().name() == "link" {
                let link = reader.link(element)?;
                let twin = robot.links.iter().find(|other| other.name == link.name);
                refuse_twin("link", &link.name, &link.place, twin.map(|link| &link.place))?;
                robot.links.push(link);
            }
            refuse_crowd("links", robot.links.len(), &robot.place)?;
        }
        for element in children(root, "joint") {
            let joint = reader.joint(element, &robot.links)?;
            let twin = robot.joints.iter().find(|other| other.name == joint.name);
            refuse_twin("joint", &joint.name, &joint.place, twin.map(|joint| &joint.place))?;
            robot.joints.push(joint);
            refuse_crowd("joints", robot.joints.len(), &robot.place)?;
        }
        Ok(robot)
    }
}

fn refuse_twin(what: &str, name: &str, place: &Place, twin: Option<&Place>) -> Result<(), SceneError> {
    match twin {
        None => Ok(()),
        Some(first) => {
            let problem = format!("{what} `{name}` is there twice, the first in line {}", first.line);
            Err(SceneError::new("", problem, "rename one of them").at(place))
        }
    }
}

fn refuse_crowd(what: &str, count: usize, place: &Place) -> Result<(), SceneError> {
    if count <= MOST_PARTS {
        return Ok(());
    }
    let problem = format!("has more than {MOST_PARTS} {what}");
    Err(SceneError::new("", problem, "cut out the part with the hand").at(place))
}

/// The file's version of URDF. As other readers have it, nothing and nonsense are 1.0.
fn version(root: Node<'_, '_>) -> (u32, u32) {
    let numbers = |text: &str| {
        let (major, minor) = text.trim().split_once('.')?;
        Some((major.parse().ok()?, minor.parse().ok()?))
    };
    root.attribute("version").and_then(numbers).unwrap_or((1, 0))
}

struct Reader<'a> {
    text: Text<'a>,
    /// `true` if the version of URDF has quaternions.
    quaternions: bool,
}

impl Reader<'_> {
    fn fail<T>(
        &self,
        element: Node<'_, '_>,
        problem: impl Into<String>,
        remedy: impl Into<String>,
    ) -> Result<T, SceneError> {
        Err(SceneError::new("", problem, remedy).at(&self.text.place(element)))
    }

    fn name(&self, element: Node<'_, '_>) -> Result<String, SceneError> {
        let tag = element.tag_name().name();
        match element.attribute("name") {
            Some(name) if !name.trim().is_empty() => Ok(name.into()),
            _ => self.fail(element, format!("a {tag} without a name"), format!("write <{tag} name=\"...\">")),
        }
    }

    fn number(&self, of: &str, element: Node<'_, '_>, name: &str) -> Result<Option<f64>, SceneError> {
        Ok(self.text.numbers::<1>(of, element, name)?.map(|[number]| number))
    }

    /// A number that may not be negative.
    fn amount(&self, of: &str, element: Node<'_, '_>, name: &str) -> Result<Option<f64>, SceneError> {
        match self.number(of, element, name)? {
            Some(number) if number < 0.0 => {
                let tag = element.tag_name().name();
                self.fail(
                    element,
                    format!("{of}: {name} of <{tag}> is negative: {number:?}"),
                    "check the number",
                )
            }
            number => Ok(number),
        }
    }

    fn link(&self, element: Node<'_, '_>) -> Result<Link, SceneError> {
        let (name, place) = (self.name(element)?, self.text.place(element));
        let of = format!("link `{}`", quote(&name));
        let (body, body_place) = match child(element, "inertial") {
            Some(inertial) => (self.body(&of, inertial), self.text.place(inertial)),
            None => (Ok(Body::none()), place.clone()),
        };
        let (shapes, meshes, left_out) = self.shapes(element);
        Ok(Link { name, place, body, body_place, shapes, meshes, left_out })
    }

    fn body(&self, of: &str, inertial: Node<'_, '_>) -> Result<Body, SceneError> {
        let origin = self.origin(of, inertial)?;
        let mass = match child(inertial, "mass") {
            Some(mass) => self.amount(of, mass, "value")?,
            None => None,
        };
        let Some(mass_kg) = mass else {
            return self.fail(inertial, format!("{of}: no mass"), "add <mass value=\"...\"/>");
        };
        let Some(inertia) = child(inertial, "inertia") else {
            let remedy = "add <inertia ixx=... iyy=... izz=.../>, about the mass centre";
            return self.fail(inertial, format!("{of}: a mass without inertia"), remedy);
        };
        let mut moments = [0.0; 3];
        for (moment, name) in moments.iter_mut().zip(["ixx", "iyy", "izz"]) {
            *moment = match self.amount(of, inertia, name)? {
                Some(number) => number,
                None => return self.fail(inertia, format!("{of}: no {name}"), format!("add {name}=\"...\"")),
            };
        }
        let [xx, yy, zz] = moments;
        let product = |name| Ok::<f64, SceneError>(self.number(of, inertia, name)?.unwrap_or(0.0));
        let (xy, xz, yz) = (product("ixy")?, product("ixz")?, product("iyz")?);
        for (name, product, [a, b]) in [("ixy", xy, [xx, yy]), ("ixz", xz, [xx, zz]), ("iyz", yz, [yy, zz])] {
            // The rest of what no body has is found once all that moves together is known.
            if product * product > a * b * (1.0 + PRODUCT_SLACK) {
                let problem = format!("{of}: {name} is larger than its two moments of inertia allow");
                return self.fail(inertia, problem, "give the inertia about the mass centre, in kg m^2");
            }
        }
        let body = Body {
            mass_kg,
            centre_m: Vector3::zeros(),
            inertia_kg_m2: Matrix3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz),
        };
        if origin.transform.attitude == Matrix3::identity() {
            // As written, to the bit.
            return Ok(Body { centre_m: origin.transform.offset_m, ..body });
        }
        Ok(body.seen_from(&origin.transform))
    }

    /// Returns the shapes of a link, and the meshes that it touches with; and says of each other `<collision>` what it is.
    fn shapes(&self, link: Node<'_, '_>) -> (Vec<Shape>, Vec<Mesh>, Vec<String>) {
        let (mut shapes, mut meshes, mut left_out) = (Vec::new(), Vec::new(), Vec::new());
        for (tag, is_collision) in [("collision", true), ("visual", false)] {
            for element in children(link, tag) {
                let solid = child(element, "geometry").and_then(|geometry| geometry.first_element_child());
                let shape = solid.and_then(|solid| self.shape(element, solid, is_collision));
                match shape {
                    Some(shape) => shapes.push(shape),
                    None if !is_collision => {}
                    None => match solid.and_then(|solid| self.mesh(element, solid)) {
                        Some(mesh) => meshes.push(mesh),
                        None => {
                            left_out.push(solid.map_or("a <collision> without a shape".into(), |solid| {
                                format!("a <{}> that can't be read", quote(solid.tag_name().name()))
                            }))
                        }
                    },
                }
            }
        }
        (shapes, meshes, left_out)
    }

    fn mesh(&self, element: Node<'_, '_>, solid: Node<'_, '_>) -> Option<Mesh> {
        let file = solid.attribute("filename").filter(|_| solid.tag_name().name() == "mesh")?.into();
        let scale = self.text.numbers("", solid, "scale").ok()?.unwrap_or([1.0; 3]);
        Some(Mesh { file, scale, pose: self.origin("", element).ok()?.transform })
    }

    /// A shape whose numbers can be read.
    fn shape(&self, element: Node<'_, '_>, solid: Node<'_, '_>, is_collision: bool) -> Option<Shape> {
        let length = |name| Some(self.text.numbers::<1>("", solid, name).ok()??[0]);
        let solid = match solid.tag_name().name() {
            "sphere" => Solid::Sphere { radius_m: length("radius")? },
            "capsule" => Solid::Capsule { radius_m: length("radius")?, length_m: length("length")? },
            "cylinder" => Solid::Cylinder { radius_m: length("radius")?, length_m: length("length")? },
            "box" => Solid::Box { sides_m: self.text.numbers("", solid, "size").ok()?? },
            _ => return None,
        };
        let shape = Shape { solid, pose: self.origin("", element).ok()?.transform, is_collision };
        (shape.radius_m() > 0.0).then_some(shape)
    }

    fn origin(&self, of: &str, parent: Node<'_, '_>) -> Result<Origin, SceneError> {
        let Some(element) = child(parent, "origin") else {
            let place = self.text.place(parent);
            return Ok(Origin { transform: Transform::identity(), rpy_rad: Some([0.0; 3]), place });
        };
        let place = self.text.place(element);
        let offset_m = self.text.numbers(of, element, "xyz")?.unwrap_or([0.0; 3]);
        let rpy_rad = self.text.numbers(of, element, "rpy")?;
        let Some([x, y, z, w]) = self.text.numbers(of, element, "quat_xyzw")? else {
            let rpy_rad = rpy_rad.unwrap_or([0.0; 3]);
            return Ok(Origin {
                transform: Transform::new(offset_m, rpy_rad),
                rpy_rad: Some(rpy_rad),
                place,
            });
        };
        if !self.quaternions {
            let problem =
                format!("{of}: quat_xyzw of <origin> is of URDF 1.1, which this file does not say it is");
            return self.fail(element, problem, "write rpy, or <robot version=\"1.1\">");
        }
        if rpy_rad.is_some() {
            return self.fail(element, format!("{of}: <origin> has rpy and quat_xyzw"), "leave one out");
        }
        let quaternion = nalgebra::Quaternion::new(w, x, y, z);
        if !((quaternion.norm_squared() - 1.0).abs() <= 2.0 * AXIS_SLACK) {
            let problem = format!("{of}: quat_xyzw of <origin> is not a unit quaternion");
            return self.fail(element, problem, "divide it by its length");
        }
        let attitude = UnitQuaternion::new_normalize(quaternion).to_rotation_matrix().into_inner();
        Ok(Origin { transform: Transform { attitude, offset_m: offset_m.into() }, rpy_rad: None, place })
    }

    fn joint(&self, element: Node<'_, '_>, links: &[Link]) -> Result<Joint, SceneError> {
        let (name, place) = (self.name(element)?, self.text.place(element));
        let of = format!("joint `{}`", quote(&name));
        let word = element.attribute("type").unwrap_or_default();
        let Some(&(_, kind)) = Kind::ALL.iter().find(|(known, _)| *known == word) else {
            let remedy = suggestion(word, Kind::ALL.iter().map(|(word, _)| *word));
            let problem = match word {
                "" => format!("{of}: no type"),
                word => format!("{of}: type `{}` is unknown", quote(word)),
            };
            return self.fail(element, problem, remedy);
        };
        let parent = self.end(&of, element, "parent", links)?;
        let child_link = self.end(&of, element, "child", links)?;
        if parent == child_link {
            let problem = format!("{of}: joins link `{}` to itself", quote(&links[parent].name));
            return self.fail(element, problem, "name another parent or child");
        }
        let (axis, axis_place) = self.axis(&of, element, kind)?;
        let limit = child(element, "limit");
        let limit_number = |name| limit.map_or(Ok(None), |limit| self.number(&of, limit, name));
        let limit_amount = |name| limit.map_or(Ok(None), |limit| self.amount(&of, limit, name));
        let dynamics = child(element, "dynamics");
        let dynamics_amount = |name| dynamics.map_or(Ok(None), |dynamics| self.amount(&of, dynamics, name));
        let mimics = child(element, "mimic").map(|mimic| mimic.attribute("joint").unwrap_or("?").into());
        Ok(Joint {
            kind,
            parent,
            child: child_link,
            origin: self.origin(&of, element)?,
            axis,
            axis_place,
            limit: Limit {
                lower: limit_number("lower")?,
                upper: limit_number("upper")?,
                effort: limit_amount("effort")?,
                velocity: limit_amount("velocity")?,
                place: self.text.place(limit.unwrap_or(element)),
            },
            dynamics: Dynamics {
                damping: dynamics_amount("damping")?,
                friction: dynamics_amount("friction")?,
                place: self.text.place(dynamics.unwrap_or(element)),
            },
            mimics,
            name,
            place,
        })
    }

    /// Index of the link at one end of a joint.
    fn end(&self, of: &str, joint: Node<'_, '_>, tag: &str, links: &[Link]) -> Result<usize, SceneError> {
        let found = child(joint, tag).and_then(|end| Some((end, end.attribute("link")?)));
        let Some((end, name)) = found else {
            return self.fail(joint, format!("{of}: no {tag}"), format!("add <{tag} link=\"...\"/>"));
        };
        links.iter().position(|link| link.name == name).map_or_else(
            || {
                let remedy = suggestion(name, links.iter().map(|link| link.name.as_str()));
                self.fail(end, format!("{of}: there is no link `{}`", quote(name)), remedy)
            },
            Ok,
        )
    }

    fn axis(&self, of: &str, joint: Node<'_, '_>, kind: Kind) -> Result<(Vector3<f64>, Place), SceneError> {
        let Some(element) = child(joint, "axis") else { return Ok((Vector3::x(), self.text.place(joint))) };
        let place = self.text.place(element);
        let Some(xyz) = self.text.numbers(of, element, "xyz")? else {
            return self.fail(element, format!("{of}: an axis without xyz"), "add xyz=\"...\"");
        };
        let axis = Vector3::from(xyz);
        if !matches!(kind, Kind::Revolute | Kind::Continuous | Kind::Prismatic) {
            return Ok((axis, place)); // Means nothing.
        }
        let length = blindgrasp_shared::math::norm(&axis);
        if length < SHORTEST_AXIS {
            return self.fail(
                element,
                format!("{of}: the axis is zero"),
                "give its direction, such as 0 0 1",
            );
        }
        if !((length - 1.0).abs() <= AXIS_SLACK) {
            let problem = format!("{of}: the axis is {length:.4} long");
            return self.fail(element, problem, "has to be a unit vector: divide it by its length");
        }
        // A length that rounds to one needs no division, which would only cost the last bit.
        let is_unit = (length - 1.0).abs() <= 2.0 * f64::EPSILON;
        Ok((if is_unit { axis } else { axis / length }, place))
    }
}

#[cfg(test)]
mod tests {
    use super::super::transform::matrix;
    use super::*;

    #[test]
    fn a_quaternion_is_the_rotation_of_its_angles() {
        let file = |version: &str, origin: &str| {
            format!(
                "<robot {version}><link name='a'/><link name='b'/><joint name='j' type='fixed'>\
                 <parent link='a'/><child link='b'/><origin {origin}/></joint></robot>"
            )
        };
        let text = file("version='1.1'", "quat_xyzw='0.5 0.5 0.5 0.5' xyz='1 2 3'");
        let robot = Robot::parse(&text, "r").unwrap();
        let expected = matrix([std::f64::consts::FRAC_PI_2, 0.0, std::f64::consts::FRAC_PI_2]);
        assert!((robot.joints[0].origin.transform.attitude - expected).amax() < 1e-15);
        assert!((matrix(robot.joints[0].origin.rpy_rad()) - expected).amax() < 1e-15);
        let error = Robot::parse(&file("", "quat_xyzw='0.5 0.5 0.5 0.5'"), "r").unwrap_err();
        assert_eq!(
            error.to_string(),
            "r:1: joint `j`: quat_xyzw of <origin> is of URDF 1.1, which this file does not say it is; write rpy, or <robot version=\"1.1\">"
        );
    }
}
