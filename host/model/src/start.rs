//! The start of a scene: where the object is, which faces the fingertips touch, and the posture that puts them there.

use super::{
    Start,
    check::{Result, all_within, fail, item, within},
    error::{SceneError, suggestion},
    file::{Indentation, JointFile, PoseFile, SceneFile},
    hand::{posture, rotation},
};
use blindgrasp_body::polyhedron::{Polyhedron, Touchable};
use blindgrasp_body::{FaceContact, Hand, equilibrium_indentations, inverse_kinematics};
use nalgebra::{Matrix3, Quaternion, UnitQuaternion, Vector3};

/// Largest distance of a contact point from its face, m; closer, it is moved onto the face.
const OFF_FACE_M: f64 = 1e-6;

/// Room that a fingertip needs from parts of the object beside its face, m: what the search for the posture leaves open.
const CLEAR_M: f64 = 1e-9;

impl PoseFile {
    /// The attitude, checked.
    pub fn attitude(&self) -> Result<UnitQuaternion<f64>> {
        match (self.rotation_rpy_rad, self.quaternion_wxyz) {
            (Some(_), Some(_)) => {
                fail("pose.quaternion_wxyz", "angles and quaternion are both given", "leave one out")
            }
            (None, Some([w, x, y, z])) => {
                let quaternion = Quaternion::new(w, x, y, z);
                if !((quaternion.norm() - 1.0).abs() < 1e-3) {
                    return fail(
                        "pose.quaternion_wxyz",
                        format!("has length {}", quaternion.norm()),
                        "divide it by its length",
                    );
                }
                Ok(UnitQuaternion::new_normalize(quaternion))
            }
            (angles, None) => {
                let angles = angles.unwrap_or_default();
                all_within("pose.rotation_rpy_rad", &angles, 100.0)?;
                Ok(rotation(angles))
            }
        }
    }
}

/// The contact frame `R_Ci` of a face: `C_Y` into the object; `C_Z` as near to the object's z axis (on faces that look along
/// z, its x axis) as the face allows.
fn contact_frame(outward_normal: &Vector3<f64>) -> Matrix3<f64> {
    let c_y = -outward_normal;
    let near = if c_y.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let c_z = (near - c_y * c_y.dot(&near)).normalize();
    Matrix3::from_columns(&[c_y.cross(&c_z), c_y, c_z])
}

impl SceneFile {
    /// The angles of all joints at the start, rad, if the scene gives them, and the key that does.
    ///
    /// # Errors
    /// A posture that the hand does not have, or angles that its joints can't have.
    fn given_rad(&self, hand: &Hand) -> Result<Option<(&'static str, &[f64])>> {
        match (&self.start.posture, &self.start.angles_rad) {
            (Some(_), Some(_)) => fail(
                "start.posture",
                "angles are given as well",
                "leave start.posture or start.angles_rad out",
            ),
            (Some(name), None) => {
                let postures = &self.hand.postures;
                let Some(posture) = postures.iter().find(|posture| posture.name == *name) else {
                    let known = postures.iter().map(|posture| posture.name.as_str());
                    let problem = format!("the hand `{}` has no posture `{name}`", self.hand.name);
                    return fail("start.posture", problem, suggestion(name, known));
                };
                Ok(Some(("start.posture", &posture.angles_rad)))
            }
            (None, Some(angles_rad)) => {
                check_angles(self, hand, angles_rad)?;
                Ok(Some(("start.angles_rad", angles_rad)))
            }
            (None, None) => Ok(None),
        }
    }

    /// The angles that the inverse kinematics starts from and stays near, rad; those of joints that move several fingertips
    /// it keeps.
    ///
    /// # Errors
    /// An angle for a joint that is none of these, or that it can't have.
    pub fn nominal_rad(&self, hand: &Hand) -> Result<Vec<f64>> {
        for name in self.start.trunk_rad.keys() {
            let key = format!("start.trunk_rad.{name}");
            let trunk = |k: &usize| inverse_kinematics::is_trunk(hand, *k);
            match self.hand.joints.iter().position(|joint| joint.name == *name) {
                Some(k) if trunk(&k) => {
                    let (lower, upper) = hand.range_rad(k);
                    within(&key, self.start.trunk_rad[name], lower, upper)?;
                }
                Some(_) => {
                    return fail(
                        key,
                        "this joint moves one fingertip: the inverse kinematics finds its angle",
                        "leave it out",
                    );
                }
                None => {
                    let known =
                        (0..hand.joint_count()).filter(trunk).map(|k| self.hand.joints[k].name.as_str());
                    return fail(key, format!("there is no joint `{name}`"), suggestion(name, known));
                }
            }
        }
        let nominal =
            |joint: &JointFile| self.start.trunk_rad.get(&joint.name).copied().unwrap_or(joint.nominal_rad);
        Ok(self.hand.joints.iter().map(nominal).collect())
    }
}

/// Faces, contact points, joint angles and indentations at the start.
pub(super) fn start(
    file: &SceneFile,
    hand: &Hand,
    shape: &Polyhedron,
    position_m: Vector3<f64>,
    attitude: UnitQuaternion<f64>,
) -> Result<(Vec<FaceContact>, Start)> {
    let nominal_rad = file.nominal_rad(hand)?;
    let given_rad = file.given_rad(hand)?;
    let (tips, given) = (file.hand.fingertips.len(), file.contacts.len());
    match given_rad {
        Some((key, angles)) if given == 0 => {
            return open(file, hand, shape, key, Start::apart(angles, position_m, attitude));
        }
        _ if given == tips => {}
        _ => {
            let remedy = "give one [[contact]] for each fingertip, in the hand's order";
            let or = if given == 0 { "; or none, and start.posture: then the hand begins open" } else { "" };
            return fail(
                "contact",
                format!("{given} contacts for {tips} fingertips"),
                format!("{remedy}{or}"),
            );
        }
    }
    let mut contacts = touches(file, shape)?;
    let radii: Vec<f64> = file.hand.fingertips.iter().map(|fingertip| fingertip.radius_m).collect();

    if let Some((_, angles)) = given_rad {
        let indentations_m = touch(file, hand, shape, &mut contacts, angles, &position_m, &attitude)?;
        unobstructed(file, shape, &contacts, &indentations_m)?;
        let points_m = contacts.iter().map(|touch| touch.point_m).collect();
        let start = Start { angles_rad: angles.to_vec(), position_m, attitude, indentations_m, points_m };
        return Ok((contacts.iter().map(|touch| touch.on).collect(), start));
    }

    let points: Vec<Vector3<f64>> = contacts.iter().map(|touch| touch.point_m).collect();
    let inwards: Vec<Vector3<f64>> =
        contacts.iter().map(|touch| touch.on.frame.column(1).into_owned()).collect();
    let indentations_m = match file.start.indentation_m {
        Indentation::Metres(indentation) => vec![indentation; points.len()],
        Indentation::Equilibrium => {
            let stiffnesses: Vec<f64> =
                file.hand.fingertips.iter().map(|fingertip| fingertip.stiffness_n_m2).collect();
            equilibrium_indentations(&points, &inwards, &radii, &stiffnesses, file.control.force_n())
                .or_else(|i| {
                    fail(
                        format!("contact.{}", i + 1),
                        format!(
                            "the grasping force would pull fingertip `{}` away from its face",
                            file.hand.fingertips[i].name
                        ),
                        "choose faces that look away from the middle of the fingertips",
                    )
                })?
        }
    };
    for (i, &indentation) in indentations_m.iter().enumerate() {
        let name = &file.hand.fingertips[i].name;
        if !(indentation > 0.0 && indentation < radii[i]) {
            return fail(
                "start.indentation_m",
                format!("{indentation:?} m for fingertip `{name}` of radius {:?} m", radii[i]),
                "has to be positive and less than the radius: less force, or stiffer fingertips",
            );
        }
    }
    unobstructed(file, shape, &contacts, &indentations_m)?;
    let targets: Vec<Vector3<f64>> = (0..points.len())
        .map(|i| position_m + attitude * (points[i] - inwards[i] * (radii[i] - indentations_m[i])))
        .collect();
    let angles_rad = inverse_kinematics::place(hand, &targets, &nominal_rad).map_err(|miss| {
        let limit = match miss.limited_by {
            Some(k) => format!(", with joint `{}` at its limit", file.hand.joints[k].name),
            None => String::new(),
        };
        SceneError::new(
            format!("contact.{}", miss.fingertip + 1),
            format!(
                "fingertip `{}` stays {:.3} mm away{limit}",
                file.hand.fingertips[miss.fingertip].name,
                miss.distance_m * 1e3
            ),
            "move the object (pose.position_m) or the contact point",
        )
    })?;
    let start = Start { angles_rad, position_m, attitude, indentations_m, points_m: points };
    Ok((contacts.iter().map(|touch| touch.on).collect(), start))
}

impl Start {
    /// A hand that touches nothing.
    fn apart(angles_rad: &[f64], position_m: Vector3<f64>, attitude: UnitQuaternion<f64>) -> Self {
        let (indentations_m, points_m) = (Vec::new(), Vec::new());
        Self { angles_rad: angles_rad.to_vec(), position_m, attitude, indentations_m, points_m }
    }
}

/// Checks that a hand that begins open touches nothing with its fingertips. `key` is that of its posture.
fn open(
    file: &SceneFile,
    hand: &Hand,
    shape: &Polyhedron,
    key: &str,
    start: Start,
) -> Result<(Vec<FaceContact>, Start)> {
    if !file.plant.has_friction() {
        let problem =
            "fingertips that roll touch the object from the start on, and no [[contact]] says where";
        return fail(key, problem, "a hand that begins open needs plant.contact = \"coulomb\"");
    }
    let (object, posture) = (Touchable::of(shape), posture(hand, &start.angles_rad));
    for (i, fingertip) in file.hand.fingertips.iter().enumerate() {
        let centre_m = start.attitude.inverse() * (posture.centres_m[i] - start.position_m);
        let depth_m = hand.radius_m(i) - object.closest(&centre_m).distance_m;
        if depth_m > 0.0 {
            let name = &fingertip.name;
            let problem =
                format!("fingertip `{name}` is {:.3} mm inside the object at the start", depth_m * 1e3);
            return fail(key, problem, "open the hand wider, or move the object (pose.position_m)");
        }
    }
    Ok((Vec::new(), start))
}

/// A face and the point of it that a fingertip touches, in the object frame, m.
struct Touch {
    on: FaceContact,
    point_m: Vector3<f64>,
}

/// The face of each contact, and its point: the face's middle where none is given.
fn touches(file: &SceneFile, shape: &Polyhedron) -> Result<Vec<Touch>> {
    let mut contacts = Vec::with_capacity(file.contacts.len());
    for (i, contact) in file.contacts.iter().enumerate() {
        let key = |name| item("contact", i, name);
        let mut point = contact.point_m.map(Vector3::from);
        if let Some(point) = &point {
            all_within(&key("point_m"), point.as_slice(), 100.0)?;
        }
        let face = match (contact.face, point) {
            (Some(face), _) if face < shape.faces.len() => face,
            (Some(face), _) => {
                let last = shape.faces.len() - 1;
                let problem = format!("the object has no face {face}");
                return fail(key("face"), problem, format!("has to be between 0 and {last}"));
            }
            (None, Some(point)) => match shape.nearest_face(&point, OFF_FACE_M) {
                Some((face, distance)) if distance <= OFF_FACE_M => face,
                nearest => {
                    let distance = nearest.map_or(String::new(), |(face, distance)| {
                        format!(" but {:.3} mm off face {face}", distance * 1e3)
                    });
                    return fail(
                        key("point_m"),
                        format!("is not on the surface{distance}"),
                        "give a point of a face in the object frame, whose origin is the centre of mass",
                    );
                }
            },
            (None, None) => {
                return fail(key("face"), "neither face nor point is given", "add `point_m = [x, y, z]`");
            }
        };
        let plane = &shape.faces[face];
        if let Some(point) = &mut point {
            let height = plane.normal.dot(point) - plane.distance_m;
            if height.abs() > OFF_FACE_M {
                return fail(
                    key("point_m"),
                    format!("is {:.3} mm off face {face}", height.abs() * 1e3),
                    "give a point of the face in the object frame, whose origin is the centre of mass",
                );
            }
            *point -= plane.normal * height;
            let margin = shape.margin_m(face, point);
            if !(margin > 0.0) {
                return fail(
                    key("point_m"),
                    format!("is {:.3} mm beyond the edge of face {face}", -margin * 1e3),
                    "move it inside",
                );
            }
        }
        contacts.push(Touch {
            on: FaceContact { face, frame: contact_frame(&plane.normal), distance_m: plane.distance_m },
            point_m: point.unwrap_or_else(|| shape.face_centre_m(face)),
        });
    }
    Ok(contacts)
}

/// Checks that every fingertip touches its face alone. Where a body is not convex, it may come to another part of it.
fn unobstructed(
    file: &SceneFile,
    shape: &Polyhedron,
    touches: &[Touch],
    indentations_m: &[f64],
) -> Result<()> {
    for (i, (touch, indentation)) in touches.iter().zip(indentations_m).enumerate() {
        let fingertip = &file.hand.fingertips[i];
        let centre = touch.point_m - touch.on.frame.column(1) * (fingertip.radius_m - indentation);
        let room = shape.clearance_m(touch.on.face, &centre) - fingertip.radius_m;
        if !(room > CLEAR_M) {
            return fail(
                format!("contact.{}", i + 1),
                format!(
                    "fingertip `{}` would reach {:.3} mm into another part of the object than face {}",
                    fingertip.name,
                    -room * 1e3,
                    touch.on.face
                ),
                "move the contact point away from what rises beside the face, or choose another face",
            );
        }
    }
    Ok(())
}

fn check_angles(file: &SceneFile, hand: &Hand, angles: &[f64]) -> Result<()> {
    if angles.len() != hand.joint_count() {
        return fail(
            "start.angles_rad",
            format!("{} angles for {} joints", angles.len(), hand.joint_count()),
            "give one for each joint, in the hand's order",
        );
    }
    for (k, &angle) in angles.iter().enumerate() {
        let (lower, upper) = hand.range_rad(k);
        if !(angle >= lower && angle <= upper) {
            return fail(
                "start.angles_rad",
                format!("{angle:?} is outside the limits of joint `{}`", file.hand.joints[k].name),
                format!("has to be between {lower} and {upper}"),
            );
        }
    }
    Ok(())
}

/// Contact points and indentations of a given posture.
fn touch(
    file: &SceneFile,
    hand: &Hand,
    shape: &Polyhedron,
    touches: &mut [Touch],
    angles: &[f64],
    position_m: &Vector3<f64>,
    attitude: &UnitQuaternion<f64>,
) -> Result<Vec<f64>> {
    let posture = posture(hand, angles);
    let mut indentations = Vec::with_capacity(touches.len());
    for (i, touch) in touches.iter_mut().enumerate() {
        let key = format!("contact.{}", i + 1);
        let name = &file.hand.fingertips[i].name;
        let centre = attitude.inverse() * (posture.centres_m[i] - position_m);
        let plane = &shape.faces[touch.on.face];
        let height = plane.normal.dot(&centre) - plane.distance_m;
        let indentation = hand.radius_m(i) - height;
        if !(indentation > 0.0) {
            let problem = format!("fingertip `{name}` is {:.3} mm away from its face", -indentation * 1e3);
            return fail(key, problem, "change start.angles_rad or the pose");
        }
        if !(height > 0.0) {
            let problem = format!("the centre of fingertip `{name}` is inside the object");
            return fail(key, problem, "change start.angles_rad or the pose");
        }
        touch.point_m = centre - plane.normal * height;
        let margin = shape.margin_m(touch.on.face, &touch.point_m);
        if !(margin > 0.0) {
            let problem =
                format!("fingertip `{name}` is {:.3} mm beyond the edge of its face", -margin * 1e3);
            return fail(key, problem, "change start.angles_rad or the pose");
        }
        indentations.push(indentation);
    }
    Ok(indentations)
}
