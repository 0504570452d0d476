//! A scene as MJCF, the model file of MuJoCo: the same hand, object and tables, for an engine that is not ours.
//!
//! MuJoCo's contacts are springs whose stiffness follows from an impedance and from the inertia that the engine estimates once, with
//! all joints at zero. Here that estimate is made as MuJoCo makes it, so that a fingertip presses with the force that it has in
//! our plant at the depth where the grasp settles, and with the same slope there.

#[cfg(test)]
mod tests;

use super::Scene;
use super::check::{Result, fail, item};
use super::file::{ContactLaw, JointFile, ShapeFile};
use super::hand::{posture, rotation};
use super::urdf::export::{Lines, Names, bones, escaped, inertia, numbers};
use blindgrasp_body::dynamics::{Body, JointMatrix, mass_matrix, place_bodies};
use blindgrasp_body::polyhedron::Touchable;
use blindgrasp_body::{
    ContactFriction, FingertipModel, Hand, MAX_JOINTS, Part, equilibrium_indentations, pairs,
};
use blindgrasp_shared::math::Real;
use nalgebra::{DMatrix, DVector, UnitQuaternion, Vector3};
use std::f64::consts::PI;

/// Name of the object's body and geometry.
const OBJECT: &str = "object";
/// The most that the fastest vibration of the object turns on in a step, rad: MuJoCo's springs are explicit.
const MOST_PHASE_RAD: f64 = 0.5;
/// Name of the pose and posture at the start.
const START: &str = "start";

/// Least and most impedance of a fingertip's contact. The part of MuJoCo's force that does not come from spring and damper is in
/// proportion to the impedance.
const IMPEDANCE: (f64, f64) = (2e-3, 1e-2);
/// Depth at which a fingertip settles, in units of the width over which its impedance rises. With a least of a fifth of the most
/// the force is there locally in proportion to the square of the depth, as Eq. 14 has it, and is within 8 % of it from a seventh
/// of that depth to one and a half of it.
const SETTLED: f64 = 0.5;
/// Midpoint of the impedance's rise, the least that MuJoCo takes: the rise begins with its steepest slope.
const MIDPOINT: f64 = 1e-4;
/// Depth at which a fingertip settles where Eq. 57 has none, in units of its radius.
const SOME_DEPTH: f64 = 0.1;
/// Time in which what is hard comes back, s, and share of critical damping: the object on a table, joints at the ends of their ranges.
/// The object sinks by 2 um.
const HARD: &str = "0.002 1";
/// The most iterations that take the softness out of friction. Ten are usual; what they leave over is creep.
const NO_SLIP_ITERATIONS: u32 = 200;
/// Stiffness of friction over that of the normal force, before those iterations.
const FRICTION_RATIO: f64 = 1e4;

/// A scene in MuJoCo's format.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mjcf {
    /// The text of the file.
    pub text: String,
    /// The parts of the scene that the format has no words for, a line each.
    pub left_out: Vec<String>,
}

impl Scene {
    /// The scene in MuJoCo's format: what stands in it of the world, and nothing of the controller.
    ///
    /// # Errors
    /// A scene whose fingertips can't slip, or whose object is not convex.
    pub fn to_mjcf(&self) -> Result<Mjcf> {
        if self.plant.contact == ContactLaw::Rolling {
            return fail(
                "plant.contact",
                "is \"rolling\": fingertips that never slip can't be said in MJCF",
                "set it to \"coulomb\"",
            );
        }
        if !Touchable::of(&self.object).is_convex() {
            return fail(
                "object.shape",
                format!("`{}` is not convex: MuJoCo would take its convex hull", self.object_name),
                "export a scene with a convex object, such as its hull",
            );
        }
        let settled_m = settled_m(self);
        let text = Export {
            scene: self,
            names: Names::of(&self.file.hand),
            step_s: step_s(self, &settled_m),
            settled_m,
            lines: Lines::default(),
        }
        .write();
        Ok(Mjcf { text, left_out: self.left_out() })
    }

    fn left_out(&self) -> Vec<String> {
        let plant = &self.plant;
        let mut lines = Vec::new();
        for (t, table) in plant.tables.iter().enumerate() {
            if !table.moves.is_empty() {
                let key = item("plant.table", t, "move");
                lines.push(format!("{key}: the table stands still; move the mocap body `{}`", table_name(t)));
            }
        }
        let mut say = |is_there: bool, line: &str| lines.extend(is_there.then(|| line.to_owned()));
        say(
            !plant.turns.is_empty(),
            "plant.turn: gravity does not turn; set the model's gravity as time goes",
        );
        say(
            !plant.shakes.is_empty(),
            "plant.shake: nothing shakes; take the shaking from the model's gravity",
        );
        say(
            !plant.pushes.is_empty(),
            "plant.push: nothing pushes; set the force on the body `object` as time goes",
        );
        let presliding = |joint: &super::JointParameters| joint.friction.coulomb_nm > 0.0;
        say(
            self.joints.iter().any(presliding),
            "hand.joint.*.presliding_rad: joints stick rigidly up to their Coulomb friction",
        );
        say(true, "control, sensors, actuators: motors do what they are told, and nobody tells them");
        lines
    }
}

/// Name of the part of a fingertip that is not pressed in where it settles.
fn core_name(tip: &str) -> String {
    format!("{tip}-core")
}

/// Name of a capsule of the hand.
fn capsule_name(capsule: usize) -> String {
    format!("capsule-{}", capsule + 1)
}

fn table_name(table: usize) -> String {
    format!("table-{}", table + 1)
}

struct Export<'a> {
    scene: &'a Scene,
    names: Names,
    /// Depths at which the fingertips settle, m.
    settled_m: Vec<f64>,
    step_s: f64,
    lines: Lines,
}

impl Export<'_> {
    fn write(mut self) -> String {
        let scene = self.scene;
        self.head();
        self.line(1, "<worldbody>");
        self.surface(2, None);
        let order = self.bodies(2, None);
        self.object();
        self.tables();
        self.line(1, "</worldbody>");
        self.contacts();
        self.line(1, "<actuator>");
        for joint in &scene.joints {
            let (name, most) = (escaped(&joint.name), joint.torque_limit_nm);
            let range = if most.is_finite() {
                format!(" ctrlrange=\"{}\"", numbers(&[-most, most]))
            } else {
                String::new()
            };
            self.line(2, format!("<motor name=\"{name}\" joint=\"{name}\"{range}/>"));
        }
        self.line(1, "</actuator>");
        let start = &scene.start;
        let mut qpos: Vec<f64> = order.iter().map(|&joint| start.angles_rad[joint]).collect();
        qpos.extend(start.position_m.iter());
        qpos.extend(wxyz(&start.attitude));
        self.line(1, "<keyframe>");
        self.line(2, format!("<key name=\"{START}\" qpos=\"{}\"/>", numbers(&qpos)));
        self.line(1, "</keyframe>");
        self.line(0, "</mujoco>");
        self.lines.text()
    }

    fn line(&mut self, depth: usize, text: impl AsRef<str>) {
        self.lines.line(depth, text);
    }

    fn head(&mut self) {
        let (scene, version) = (self.scene, env!("CARGO_PKG_VERSION"));
        self.line(0, "<?xml version=\"1.0\"?>");
        self.line(0, format!("<!-- Written by blindgrasp {version}."));
        for line in [
            "     Fingertips press as they do in blindgrasp (k dr^2, Eq. 14), in force and in slope, where the grasp settles (Eq. 57),",
            "     within 8 % from a seventh of that depth to one and a half of it. The geometry that touches is a core, with a margin as",
            "     deep as the fingertip settles. solref and solimp of a core hold for these masses: MuJoCo makes stiffness of them with",
            "     the inertia that it estimates at joint angles zero. What touches is what has a pair; links and palm are hard. -->",
        ] {
            self.line(0, line);
        }
        self.line(0, format!("<mujoco model=\"{}\">", escaped(&scene.name)));
        self.line(1, "<compiler angle=\"radian\"/>");
        let (step_s, gravity) = (self.step_s, numbers(&scene.plant.gravity_m_s2));
        self.line(
            1,
            format!(
                "<option timestep=\"{step_s:?}\" gravity=\"{gravity}\" cone=\"elliptic\" impratio=\"{FRICTION_RATIO:?}\" \
                 noslip_iterations=\"{NO_SLIP_ITERATIONS}\" noslip_tolerance=\"1e-10\"/>"
            ),
        );
        self.line(1, "<default>");
        self.line(2, "<geom contype=\"0\" conaffinity=\"0\" mass=\"0\"/>");
        // Dry friction stops a joint within a few steps.
        self.line(2, format!("<joint solreflimit=\"{HARD}\" solreffriction=\"{:?} 1\"/>", 4.0 * step_s));
        self.line(1, "</default>");
        if !matches!(scene.file.object.shape, ShapeFile::Box { .. }) {
            let corners: Vec<f64> = scene.object.vertices_m.iter().flat_map(|v| [v.x, v.y, v.z]).collect();
            self.line(1, "<asset>");
            self.line(2, format!("<mesh name=\"{OBJECT}\" vertex=\"{}\"/>", numbers(&corners)));
            self.line(1, "</asset>");
        }
    }

    /// The capsules of a link, or its bones in a hand without capsules.
    fn surface(&mut self, depth: usize, link: Option<&str>) {
        let hand = &self.scene.file.hand;
        if hand.capsules.is_empty() {
            for (end, radius_m) in bones(hand, link) {
                self.capsule(depth, "", [&[0.0; 3], &end.into()], radius_m);
            }
        }
        for (k, capsule) in hand.capsules.iter().enumerate() {
            if capsule.link.as_deref() == link {
                let name = format!("name=\"{}\" ", capsule_name(k));
                self.capsule(depth, &name, [&capsule.from_m, &capsule.to_m], capsule.radius_m);
            }
        }
    }

    fn capsule(&mut self, depth: usize, name: &str, [from_m, to_m]: [&[f64; 3]; 2], radius_m: f64) {
        let place = if from_m == to_m {
            format!("type=\"sphere\" pos=\"{}\"", numbers(to_m))
        } else {
            format!("type=\"capsule\" fromto=\"{} {}\"", numbers(from_m), numbers(to_m))
        };
        self.line(depth, format!("<geom {name}{place} size=\"{radius_m:?}\" rgba=\"0.75 0.75 0.78 1\"/>"));
    }

    /// The links on a joint's link, or on the base; returns the joints in the order of the file.
    fn bodies(&mut self, depth: usize, parent: Option<&str>) -> Vec<usize> {
        let scene = self.scene;
        let mut order = Vec::new();
        for (k, joint) in scene.file.hand.joints.iter().enumerate() {
            if joint.parent.as_deref() != parent {
                continue;
            }
            order.push(k);
            self.body(depth, k, joint);
            order.extend(self.bodies(depth + 1, Some(&joint.name)));
            self.line(depth, "</body>");
        }
        order
    }

    fn body(&mut self, depth: usize, k: usize, joint: &JointFile) {
        let scene = self.scene;
        let (position, attitude) =
            (numbers(&joint.offset_m), numbers(&wxyz(&rotation(joint.rotation_rpy_rad))));
        let link = escaped(&self.names.links[k]);
        self.line(depth, format!("<body name=\"{link}\" pos=\"{position}\" quat=\"{attitude}\">"));
        let friction = &scene.joints[k].friction;
        let range = if scene.plant.joints_stop() {
            format!(" range=\"{}\"", numbers(&joint.limits_rad))
        } else {
            String::new()
        };
        let rotor_kg_m2 = scene.rotors_kg_m2().get(k).copied().unwrap_or_default();
        self.line(
            depth + 1,
            format!(
                "<joint name=\"{}\" axis=\"{}\"{range} damping=\"{:?}\" frictionloss=\"{:?}\" armature=\"{rotor_kg_m2:?}\"/>",
                escaped(&joint.name),
                numbers(&joint.axis),
                friction.viscous_nm_s,
                friction.coulomb_nm,
            ),
        );
        let (mass_kg, moments) = inertia(joint);
        self.inertial(depth + 1, mass_kg, &joint.mass_centre_m, &moments);
        self.surface(depth + 1, Some(&joint.name));
        for (i, tip) in scene.file.hand.fingertips.iter().enumerate() {
            if tip.link != joint.name {
                continue;
            }
            let (name, centre) = (escaped(&self.names.tips[i]), numbers(&tip.offset_m));
            let radii_m =
                [(name.clone(), tip.radius_m), (core_name(&name), tip.radius_m - self.settled_m[i])];
            for ((name, radius_m), look) in
                radii_m.into_iter().zip(["rgba=\"0.85 0.45 0.25 0.5\"", "group=\"3\""])
            {
                self.line(
                    depth + 1,
                    format!("<geom name=\"{name}\" type=\"sphere\" pos=\"{centre}\" size=\"{radius_m:?}\" {look}/>"),
                );
            }
        }
    }

    fn inertial(&mut self, depth: usize, mass_kg: f64, centre_m: &[f64; 3], moments: &[f64; 6]) {
        let (centre, inertia) = (numbers(centre_m), numbers(moments));
        self.line(
            depth,
            format!("<inertial pos=\"{centre}\" mass=\"{mass_kg:?}\" fullinertia=\"{inertia}\"/>"),
        );
    }

    fn object(&mut self) {
        let scene = self.scene;
        let (position, attitude) =
            (numbers(scene.start.position_m.as_slice()), numbers(&wxyz(&scene.start.attitude)));
        let floats = if scene.plant.object_has_weight() { "" } else { " gravcomp=\"1\"" };
        self.line(2, format!("<body name=\"{OBJECT}\" pos=\"{position}\" quat=\"{attitude}\"{floats}>"));
        self.line(3, "<freejoint/>");
        let i = &scene.inertia_kg_m2;
        let moments = [i[(0, 0)], i[(1, 1)], i[(2, 2)], i[(0, 1)], i[(0, 2)], i[(1, 2)]];
        self.inertial(3, scene.mass_kg, &[0.0; 3], &moments);
        let shape = match &scene.file.object.shape {
            ShapeFile::Box { size_m } => {
                format!("type=\"box\" size=\"{}\"", numbers(&size_m.map(|side| side / 2.0)))
            }
            _ => format!("type=\"mesh\" mesh=\"{OBJECT}\""),
        };
        self.line(3, format!("<geom name=\"{OBJECT}\" {shape} rgba=\"0.35 0.55 0.8 1\"/>"));
        self.line(2, "</body>");
    }

    fn tables(&mut self) {
        for (t, table) in self.scene.plant.tables.iter().enumerate() {
            let (name, normal) = (table_name(t), Vector3::from(table.normal));
            // Straight down: about any axis across.
            let turn = UnitQuaternion::rotation_between(&Vector3::z(), &normal)
                .unwrap_or_else(|| UnitQuaternion::from_axis_angle(&Vector3::x_axis(), PI));
            let (position, attitude) = (numbers(&table.point_m), numbers(&wxyz(&turn)));
            self.line(
                2,
                format!("<body name=\"{name}\" mocap=\"true\" pos=\"{position}\" quat=\"{attitude}\">"),
            );
            self.line(
                3,
                format!(
                    "<geom name=\"{name}\" type=\"plane\" size=\"0.5 0.5 0.01\" rgba=\"0.6 0.6 0.55 1\"/>"
                ),
            );
            self.line(2, "</body>");
        }
    }

    fn contacts(&mut self) {
        let scene = self.scene;
        let widest_m = scene.fingertip_friction.iter().map(|friction| friction.torsion_m).fold(0.0, f64::max);
        self.line(1, "<contact>");
        for (i, depth_m) in self.settled_m.clone().into_iter().enumerate() {
            let (tip, name) = (&scene.fingertips[i], core_name(&escaped(&self.names.tips[i])));
            let yields_per_kg =
                yields_per_kg(&scene.hand, &scene.rotors_kg_m2(), scene.hand.fingertip_link(i));
            let soft = softness(tip, depth_m, yields_per_kg + 1.0 / scene.mass_kg, self.step_s);
            self.pair(&name, OBJECT, &scene.fingertip_friction[i], &soft);
            for (t, table) in scene.plant.tables.iter().enumerate() {
                let soft = softness(tip, depth_m, yields_per_kg, self.step_s);
                let friction = ContactFriction { sliding: table.fingertip_friction, torsion_m: widest_m };
                self.pair(&name, &table_name(t), &friction, &soft);
            }
        }
        let hard = format!("solref=\"{HARD}\"");
        let sliding = |sliding: f64| ContactFriction { sliding, torsion_m: 0.0 };
        for (t, table) in scene.plant.tables.iter().enumerate() {
            self.pair(OBJECT, &table_name(t), &sliding(table.friction), &hard);
        }
        for (k, capsule) in scene.capsules.iter().enumerate() {
            self.pair(&capsule_name(k), OBJECT, &sliding(scene.capsule_friction[k]), &hard);
            // What does not move never comes to a table with any force.
            for (t, table) in scene.plant.tables.iter().enumerate().filter(|_| capsule.link.is_some()) {
                self.pair(&capsule_name(k), &table_name(t), &sliding(table.friction), &hard);
            }
        }
        if scene.plant.links_touch() {
            for parts in pairs(&scene.hand, &scene.capsules) {
                self.parts(parts, &hard);
            }
        }
        self.line(1, "</contact>");
    }

    /// Two parts of the hand: as soft as the fingertips among them.
    fn parts(&mut self, parts: [Part; 2], hard: &str) {
        let scene = self.scene;
        let [(first, first_friction), (second, second_friction)] = parts.map(|part| match part {
            Part::Capsule(k) => (capsule_name(k), scene.capsule_friction[k]),
            Part::Fingertip(i) => {
                (core_name(&escaped(&self.names.tips[i])), scene.fingertip_friction[i].sliding)
            }
        });
        let friction = ContactFriction { sliding: first_friction.min(second_friction), torsion_m: 0.0 };
        let links = parts.into_iter().filter_map(|part| part.link(&scene.hand, &scene.capsules));
        let yield_per_kg = links.map(|link| yields_per_kg(&scene.hand, &scene.rotors_kg_m2(), link)).sum();
        let soft: Vec<usize> = parts
            .iter()
            .filter_map(|part| match part {
                Part::Fingertip(i) => Some(*i),
                Part::Capsule(_) => None,
            })
            .collect();
        let soft = match soft[..] {
            [i] => softness(&scene.fingertips[i], self.settled_m[i], yield_per_kg, self.step_s),
            [i, j] => {
                let depth_m = self.settled_m[i] + self.settled_m[j];
                let tip = scene.fingertips[i].onto(&scene.fingertips[j]);
                softness(&tip, depth_m, yield_per_kg, self.step_s)
            }
            _ => hard.to_owned(),
        };
        self.pair(&first, &second, &friction, &soft);
    }

    fn pair(&mut self, first: &str, second: &str, friction: &ContactFriction, soft: &str) {
        let ContactFriction { sliding, torsion_m } = *friction;
        // Torsion has the dimension of a length; rolling has no resistance.
        let dimensions = match (sliding > 0.0, torsion_m > 0.0) {
            (false, _) => 1,
            (true, false) => 3,
            (true, true) => 4,
        };
        let friction = [sliding, sliding, torsion_m];
        self.line(
            2,
            format!(
                "<pair geom1=\"{first}\" geom2=\"{second}\" condim=\"{dimensions}\" friction=\"{} 0 0\" {soft}/>",
                numbers(&friction)
            ),
        );
    }
}

fn wxyz(turn: &UnitQuaternion<f64>) -> [f64; 4] {
    [turn.w, turn.i, turn.j, turn.k]
}

/// Depths at which the fingertips settle, m; some depth where it is not known which faces they will touch.
fn settled_m(scene: &Scene) -> Vec<f64> {
    let inwards: Vec<Vector3<f64>> =
        scene.contacts.iter().map(|contact| contact.frame.column(1).into_owned()).collect();
    let (radii, stiffnesses): (Vec<f64>, Vec<f64>) =
        scene.fingertips.iter().map(|tip| (tip.radius_m, tip.stiffness_n_m2)).unzip();
    let force_n = scene.control.force_n();
    let settled = equilibrium_indentations(&scene.start.points_m, &inwards, &radii, &stiffnesses, force_n);
    settled
        .ok()
        .filter(|depths_m| depths_m.len() == radii.len())
        .unwrap_or_else(|| radii.iter().map(|radius_m| SOME_DEPTH * radius_m).collect())
}

/// Step, s: the longest that divides the plant's and resolves the object between its fingertips.
fn step_s(scene: &Scene, settled_m: &[f64]) -> f64 {
    let rotors = scene.rotors_kg_m2();
    let squares = scene.fingertips.iter().zip(settled_m).enumerate().map(|(i, (tip, depth_m))| {
        let yields_per_kg =
            1.0 / scene.mass_kg + yields_per_kg(&scene.hand, &rotors, scene.hand.fingertip_link(i));
        2.0 * tip.stiffness_n_m2 * depth_m * yields_per_kg
    });
    let fastest_rad_s = squares.sum::<f64>().square_root();
    scene.substep_s / (scene.substep_s * fastest_rad_s / MOST_PHASE_RAD).ceil().max(1.0)
}

/// Acceleration of a link's centre of mass for each newton there, the mean over all directions, with all joints at zero, 1/kg:
/// MuJoCo's `body_invweight0`.
fn yields_per_kg(hand: &Hand, rotors_kg_m2: &[f64], link: usize) -> f64 {
    let count = hand.joint_count();
    let posture = posture(hand, &[]);
    let mut bodies = [Body::NONE; MAX_JOINTS];
    place_bodies(hand, &posture, &mut bodies);
    let mut entries: JointMatrix = [[0.0; MAX_JOINTS]; MAX_JOINTS];
    mass_matrix(hand, &bodies, &mut entries);
    let rotor = |k: usize| rotors_kg_m2.get(k).copied().unwrap_or_default();
    let mass = DMatrix::from_fn(count, count, |a, b| entries[a][b] + if a == b { rotor(a) } else { 0.0 });
    let centre_m = posture.link(link).point(&hand.link(link).mass_centre_m);
    let chain: Vec<usize> = std::iter::successors(Some(link), |&k| hand.parent(k)).collect();
    let Some(factor) = mass.cholesky() else { return 0.0 };
    let along = |axis: usize| {
        let row = DVector::from_fn(count, |k, _| {
            let pose = posture.link(k);
            let is_below = chain.contains(&k);
            if is_below { pose.axis().cross(&(centre_m - pose.origin_m))[axis] } else { 0.0 }
        });
        row.dot(&factor.solve(&row))
    };
    (0..3).map(along).sum::<f64>() / 3.0
}

/// Contact of a fingertip's core: it touches from as far away as it settles deep, so that the point of contact, which MuJoCo has
/// half way between the surfaces, is where it settles on the surface of what is touched. `solref` and `solimp` are in MuJoCo's
/// direct form.
///
/// MuJoCo's force on a contact that is `x` deep, whose depth grows at `v`, is `(s d^2 x / m^2 + b d v / m) / ((1 - d) A)` with `s`
/// and `b` from `solref`, the impedance `d` and its most `m` from `solimp`, and `A` the inverse of the mass.
fn softness(tip: &FingertipModel, depth_m: f64, yields_per_kg: f64, step_s: f64) -> String {
    let (least, most) = IMPEDANCE;
    let share = 1.0 - (1.0 - SETTLED).powi(2) / (1.0 - MIDPOINT);
    let impedance = least + share * (most - least);
    let per_impedance = (1.0 - impedance) * yields_per_kg / impedance;
    let force_n = tip.stiffness_n_m2 * depth_m * depth_m;
    let stiffness = force_n / depth_m * most * most * per_impedance / impedance;
    let area_m2 = PI * (2.0 * tip.radius_m - depth_m) * depth_m;
    let damping = tip.damping_n_s_m3 * area_m2 * most * per_impedance;
    // Slip that is left over is gone after a step.
    let slip = most / step_s;
    format!(
        "margin=\"{depth_m:?}\" solref=\"{}\" solreffriction=\"{}\" solimp=\"{}\"",
        numbers(&[-stiffness, -damping]),
        numbers(&[-1.0, -slip]),
        numbers(&[least, most, depth_m / SETTLED, MIDPOINT, 2.0])
    )
}
