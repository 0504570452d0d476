//! A placed grasp in its user's world: the object has weight and lies on a table, which goes away once it is grasped.

use blindgrasp_body::Part;
use blindgrasp_body::inverse_kinematics;
use blindgrasp_model::file::{ContactLaw, MoveFile, PlantSettings, SceneFile, TableFile};
use blindgrasp_model::{Scene, posture};
use nalgebra::Vector3;

/// Gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.81;
/// Room that fingertips, links and palm have above the table, m.
const ROOM_M: f64 = 1e-3;
/// The time at which the table goes, s after the soft start.
const GRASPED_S: f64 = 1.0;
/// The time that its going takes, s.
const GOING_S: f64 = 1.0;
/// The way that it goes, m.
const GOING_M: f64 = 0.1;
/// The time for which the object has to be held then, s.
const HELD_S: f64 = 5.0;

impl super::Placement {
    /// The same grasp of an object with weight, with friction, on a table that goes away. A hand without a trunk looks down, along
    /// the axis that leads to the object; below one with an arm the table stands as tables do, and links don't touch where the arm
    /// reaches lower than its surface.
    pub fn on_a_table(&self) -> SceneFile {
        let Scene { file, hand, object, start, .. } = &self.scene;
        let has_trunk = (0..hand.joint_count()).any(|k| inverse_kinematics::is_trunk(hand, k));
        let down = if has_trunk { -Vector3::z() } else { along_an_axis(&start.position_m) };
        let posture = posture(hand, &start.angles_rad);
        let corners = object.vertices_m.iter().map(|corner_m| start.position_m + start.attitude * corner_m);
        let touch = file.plant.links.unwrap_or(true);
        let capsules = if touch { file.hand.capsules(hand) } else { Vec::new() };
        let depth_m = |part: Part| {
            let room_m = down * (part.radius_m(hand, &capsules) + ROOM_M);
            let [a, b] = part.ends_m(&posture, &capsules).map(|end_m| (end_m + room_m).dot(&down));
            a.max(b)
        };
        // The base touches no table.
        let moving = (0..capsules.len()).filter(|&capsule| capsules[capsule].link.is_some());
        let is_of_arm = |part: &Part| {
            part.link(hand, &capsules).is_some_and(|link| inverse_kinematics::is_trunk(hand, link))
        };
        let (of_arm, of_fingers): (Vec<Part>, Vec<Part>) = moving.map(Part::Capsule).partition(is_of_arm);
        let fingertips = (0..hand.fingertip_count()).map(|finger| depth_m(Part::Fingertip(finger)));
        let object_m =
            corners.map(|corner_m| corner_m.dot(&down)).chain(fingertips).fold(f64::NEG_INFINITY, f64::max);
        let fingers_m = of_fingers.into_iter().map(depth_m).fold(object_m, f64::max);
        // Tables end somewhere, and an arm may stand beside one.
        let is_beside = of_arm.into_iter().map(depth_m).any(|arm_m| arm_m > fingers_m);
        let lowest_m = if is_beside { object_m } else { fingers_m };
        let goes_s = file.control.soft_start_s + GRASPED_S;
        let way = MoveFile { from_s: goes_s, for_s: GOING_S, by_m: (down * GOING_M).into() };
        let table = TableFile {
            point_m: (start.position_m + down * (lowest_m - start.position_m.dot(&down))).into(),
            normal: (-down).map(|v| v + 0.0).into(),
            moves: vec![way],
            ..TableFile::default()
        };
        let plant = PlantSettings {
            contact: ContactLaw::Coulomb,
            gravity_on_object: None,
            gravity_m_s2: (down * GRAVITY_M_S2).into(),
            tables: vec![table],
            links: if is_beside { Some(false) } else { file.plant.links },
            ..file.plant.clone()
        };
        SceneFile { duration_s: goes_s + GOING_S + HELD_S, plant, ..file.clone() }
    }
}

/// The unit vector along an axis that is nearest to a direction.
fn along_an_axis(direction: &Vector3<f64>) -> Vector3<f64> {
    let mut axis = Vector3::zeros();
    let longest = direction.iamax();
    axis[longest] = direction[longest].signum();
    axis
}
