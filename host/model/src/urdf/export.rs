//! A hand as a URDF: links with their masses and surfaces, joints, and fingertips as spheres.
//!
//! URDF has no word for a capsule: it is a cylinder with a sphere on each end, as which it is read again. A hand without surfaces
//! gets bones that viewers can show.
//!
//! Numbers have the fewest digits that give back every bit, so that the hand can be read again as it was. Each joint's link is
//! called after it; each fingertip is a link of its own, fixed where the fingertip's centre is. What URDF knows nothing of
//! (gains, encoders, stiffness of the fingertips) is left out.

use super::super::file::{CapsuleFile, FingertipFile, HandFile, InertiaFile, JointFile};
use nalgebra::Vector3;
use std::fmt::Write as _;

/// Bones are this much thinner than long, ...
const SLENDERNESS: f64 = 0.15;
/// ... and thinner than the fingertips by this factor.
const THINNER: f64 = 0.7;
/// Shorter bones are not drawn, m.
const SHORTEST_BONE_M: f64 = 1e-4;
/// Mass of a link that has none of its own, kg, and its moments of inertia, kg m^2. Where nothing is said, PyBullet (3.2.7)
/// takes 1 kg and 1 kg m^2; MuJoCo (4.0) refuses moving bodies of less than 1e-15 kg or 1e-14 kg m^2.
const NEXT_TO_NOTHING: (f64, f64) = (2e-15, 1.1e-14);
/// Name of the link that is the base frame.
const BASE: &str = "base";

impl HandFile {
    /// The hand as a URDF that other tools load. It is the same hand when it is read again.
    pub fn to_urdf(&self) -> String {
        Export::of(self).write()
    }
}

/// Names of a hand's links and fingertips in files of other tools.
pub(crate) struct Names {
    /// Names of the joints' links, in the hand's order.
    pub(crate) links: Vec<String>,
    /// Names of the fingertips, in the hand's order.
    pub(crate) tips: Vec<String>,
}

impl Names {
    /// Of a hand.
    pub(crate) fn of(hand: &HandFile) -> Self {
        // Names of links must differ from each other, and some readers want them to differ from those of joints.
        let mut taken: Vec<String> = hand.joints.iter().map(|joint| joint.name.clone()).collect();
        taken.push(BASE.into());
        let mut unused = |wanted: String| {
            let mut name = wanted;
            while taken.contains(&name) {
                name.push('_');
            }
            taken.push(name.clone());
            name
        };
        Self {
            links: hand.joints.iter().map(|joint| unused(format!("{}-link", joint.name))).collect(),
            tips: hand.fingertips.iter().map(|tip| unused(format!("{}-tip", tip.name))).collect(),
        }
    }
}

/// Lines, indented by how deep they are.
#[derive(Default)]
pub(crate) struct Lines {
    text: String,
}

impl Lines {
    /// Adds a line.
    pub(crate) fn line(&mut self, depth: usize, text: impl AsRef<str>) {
        let _ = writeln!(self.text, "{:width$}{}", "", text.as_ref(), width = 2 * depth);
    }

    /// All of them.
    pub(crate) fn text(self) -> String {
        self.text
    }
}

/// A link without mass of its own has next to nothing, since other tools refuse what has none: mass, kg; and moments of inertia
/// xx, yy, zz, xy, xz, yz, kg m^2.
pub(crate) fn inertia(joint: &JointFile) -> (f64, [f64; 6]) {
    or_next_to_nothing(joint.mass_kg, moments(&joint.inertia_kg_m2))
}

fn or_next_to_nothing(mass_kg: f64, moments: [f64; 6]) -> (f64, [f64; 6]) {
    if mass_kg == 0.0 && moments.iter().all(|moment| *moment == 0.0) {
        let (mass_kg, moment) = NEXT_TO_NOTHING;
        (mass_kg, [moment, moment, moment, 0.0, 0.0, 0.0])
    } else {
        (mass_kg, moments)
    }
}

/// The bones of a link: their ends, at the joints and fingertips that sit on it, and their radii, m.
pub(crate) fn bones(hand: &HandFile, link: Option<&str>) -> Vec<(Vector3<f64>, f64)> {
    let joints = hand.joints.iter().filter(|joint| joint.parent.as_deref() == link);
    let tips = hand.fingertips.iter().filter(|tip| Some(tip.link.as_str()) == link);
    let ends = joints.map(|joint| joint.offset_m).chain(tips.map(|tip| tip.offset_m));
    let thickest = THINNER * hand.fingertips.iter().map(|tip| tip.radius_m).fold(f64::INFINITY, f64::min);
    ends.map(Vector3::from)
        .filter(|end| end.norm() >= SHORTEST_BONE_M)
        .map(|end| (end, thickest.min(SLENDERNESS * end.norm())))
        .collect()
}

struct Export<'a> {
    hand: &'a HandFile,
    names: Names,
    lines: Lines,
}

impl<'a> Export<'a> {
    fn of(hand: &'a HandFile) -> Self {
        Self { hand, names: Names::of(hand), lines: Lines::default() }
    }

    fn write(mut self) -> String {
        let version = env!("CARGO_PKG_VERSION");
        self.line(0, "<?xml version=\"1.0\"?>".into());
        self.line(0, format!("<!-- Written by blindgrasp {version}. -->"));
        self.line(0, format!("<robot name=\"{}\">", escaped(&self.hand.name)));
        self.line(1, "<material name=\"bone\"><color rgba=\"0.75 0.75 0.78 1\"/></material>".into());
        self.line(1, "<material name=\"fingertip\"><color rgba=\"0.85 0.45 0.25 1\"/></material>".into());
        self.base();
        let hand = self.hand;
        for (k, joint) in hand.joints.iter().enumerate() {
            self.link(k, joint);
            self.joint(k, joint);
        }
        for (i, tip) in hand.fingertips.iter().enumerate() {
            self.fingertip(i, tip);
        }
        self.line(0, "</robot>".into());
        self.lines.text()
    }

    fn line(&mut self, depth: usize, text: String) {
        self.lines.line(depth, text);
    }

    /// The link of a joint by the joint's name; the base without one.
    fn link_name(&self, joint: Option<&str>) -> String {
        let index = joint.and_then(|name| self.hand.joints.iter().position(|joint| joint.name == name));
        escaped(index.map_or(BASE, |index| &self.names.links[index]))
    }

    fn base(&mut self) {
        self.line(1, format!("<link name=\"{BASE}\">"));
        self.surface(None);
        self.line(1, "</link>".into());
    }

    fn link(&mut self, k: usize, joint: &JointFile) {
        self.line(1, format!("<link name=\"{}\">", escaped(&self.names.links[k])));
        self.inertial(inertia(joint), &joint.mass_centre_m);
        self.surface(Some(&joint.name));
        self.line(1, "</link>".into());
    }

    /// The capsules of a link, or its bones in a hand without capsules.
    fn surface(&mut self, link: Option<&str>) {
        let hand = self.hand;
        if hand.capsules.is_empty() {
            for (end, radius_m) in bones(hand, link) {
                self.cylinder("visual", [Vector3::zeros(), end], radius_m);
            }
        }
        let on_it = |capsule: &&CapsuleFile| capsule.link.as_deref() == link;
        for CapsuleFile { from_m, to_m, radius_m, .. } in hand.capsules.iter().filter(on_it) {
            for tag in ["visual", "collision"] {
                if from_m != to_m {
                    self.cylinder(tag, [*from_m, *to_m].map(Vector3::from), *radius_m);
                    self.solid(tag, from_m, None, &format!("<sphere radius=\"{radius_m:?}\"/>"));
                }
                self.solid(tag, to_m, None, &format!("<sphere radius=\"{radius_m:?}\"/>"));
            }
        }
    }

    fn inertial(&mut self, (mass_kg, moments): (f64, [f64; 6]), centre_m: &[f64; 3]) {
        let [xx, yy, zz, xy, xz, yz] = moments;
        let inertia = format!(
            "<inertia ixx=\"{xx:?}\" ixy=\"{xy:?}\" ixz=\"{xz:?}\" iyy=\"{yy:?}\" iyz=\"{yz:?}\" izz=\"{zz:?}\"/>"
        );
        self.line(2, "<inertial>".into());
        self.line(3, format!("<origin xyz=\"{}\"/>", numbers(centre_m)));
        self.line(3, format!("<mass value=\"{mass_kg:?}\"/>"));
        self.line(3, inertia);
        self.line(2, "</inertial>".into());
    }

    fn joint(&mut self, k: usize, joint: &JointFile) {
        let [lower, upper] = joint.limits_rad;
        let lines = [
            format!("<parent link=\"{}\"/>", self.link_name(joint.parent.as_deref())),
            format!("<child link=\"{}\"/>", escaped(&self.names.links[k])),
            format!(
                "<origin xyz=\"{}\" rpy=\"{}\"/>",
                numbers(&joint.offset_m),
                numbers(&joint.rotation_rpy_rad)
            ),
            format!("<axis xyz=\"{}\"/>", numbers(&joint.axis)),
            format!(
                "<limit lower=\"{lower:?}\" upper=\"{upper:?}\" effort=\"{:?}\" velocity=\"{:?}\"/>",
                joint.torque_limit_nm, joint.speed_limit_rad_s
            ),
            format!(
                "<dynamics damping=\"{:?}\" friction=\"{:?}\"/>",
                joint.viscous_friction_nm_s_rad, joint.coulomb_friction_nm
            ),
        ];
        self.line(1, format!("<joint name=\"{}\" type=\"revolute\">", escaped(&joint.name)));
        lines.into_iter().for_each(|line| self.line(2, line));
        self.line(1, "</joint>".into());
    }

    fn fingertip(&mut self, i: usize, tip: &FingertipFile) {
        let name = escaped(&self.names.tips[i]);
        let sphere = format!("<geometry><sphere radius=\"{:?}\"/></geometry>", tip.radius_m);
        let parent = self.link_name(Some(&tip.link));
        self.line(1, format!("<link name=\"{name}\">"));
        self.inertial(or_next_to_nothing(0.0, [0.0; 6]), &[0.0; 3]);
        self.line(2, format!("<visual>{sphere}<material name=\"fingertip\"/></visual>"));
        self.line(2, format!("<collision>{sphere}</collision>"));
        self.line(1, "</link>".into());
        self.line(1, format!("<joint name=\"{name}-joint\" type=\"fixed\">"));
        self.line(2, format!("<parent link=\"{parent}\"/>"));
        self.line(2, format!("<child link=\"{name}\"/>"));
        self.line(2, format!("<origin xyz=\"{}\"/>", numbers(&tip.offset_m)));
        self.line(1, "</joint>".into());
    }

    /// A cylinder between two points.
    fn cylinder(&mut self, tag: &str, [from_m, to_m]: [Vector3<f64>; 2], radius_m: f64) {
        let along = to_m - from_m;
        let length = along.norm();
        // The axis z of a cylinder, turned into the line.
        let across = blindgrasp_shared::math::norm(&Vector3::new(along.x, along.y, 0.0));
        let rpy = [0.0, libm::atan2(across, along.z), libm::atan2(along.y, along.x)];
        let middle: [f64; 3] = (from_m + along * 0.5).into();
        let cylinder = format!("<cylinder radius=\"{radius_m:?}\" length=\"{length:?}\"/>");
        self.solid(tag, &middle, Some(&rpy), &cylinder);
    }

    /// A shape that is seen, or touches.
    fn solid(&mut self, tag: &str, middle_m: &[f64; 3], rpy_rad: Option<&[f64; 3]>, solid: &str) {
        let turned = rpy_rad.map_or(String::new(), |rpy| format!(" rpy=\"{}\"", numbers(rpy)));
        self.line(2, format!("<{tag}>"));
        self.line(3, format!("<origin xyz=\"{}\"{turned}/>", numbers(middle_m)));
        self.line(3, format!("<geometry>{solid}</geometry>"));
        if tag == "visual" {
            self.line(3, "<material name=\"bone\"/>".into());
        }
        self.line(2, format!("</{tag}>"));
    }
}

/// xx, yy, zz, xy, xz, yz; a file may leave out what is zero.
fn moments(inertia: &InertiaFile) -> [f64; 6] {
    std::array::from_fn(|k| inertia.0.get(k).copied().unwrap_or(0.0))
}

/// Numbers with all their bits, as an attribute's value.
pub(crate) fn numbers(values: &[f64]) -> String {
    values.iter().map(|value| format!("{value:?}")).collect::<Vec<_>>().join(" ")
}

/// A name as an attribute's value.
pub(crate) fn escaped(name: &str) -> String {
    name.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}
