//! A placed grasp in its user's world: the object has weight and lies on a table, which goes away once it is grasped.

use blindgrasp_body::inverse_kinematics;
use blindgrasp_model::file::{ContactLaw, MoveFile, PlantSettings, SceneFile, TableFile};
use blindgrasp_model::{Scene, posture};
use nalgebra::Vector3;

/// Gravity, m/s^2.
const GRAVITY_M_S2: f64 = 9.81;
/// Room that fingertips have above the table, m.
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
    /// the axis that leads to the object; below one with an arm the table stands as tables do.
    pub fn on_a_table(&self) -> SceneFile {
        let Scene { file, hand, object, start, .. } = &self.scene;
        let has_trunk = (0..hand.joint_count()).any(|k| inverse_kinematics::is_trunk(hand, k));
        let down = if has_trunk { -Vector3::z() } else { along_an_axis(&start.position_m) };
        let posture = posture(hand, &start.angles_rad);
        let corners = object.vertices_m.iter().map(|corner_m| start.position_m + start.attitude * corner_m);
        let tips = (0..hand.fingertip_count())
            .map(|finger| posture.centres_m[finger] + down * (hand.radius_m(finger) + ROOM_M));
        let lowest_m =
            corners.chain(tips).map(|point_m| point_m.dot(&down)).fold(f64::NEG_INFINITY, f64::max);
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
