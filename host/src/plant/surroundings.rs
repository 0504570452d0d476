//! Whether a fingertip that rolls on a face comes to another part of the object.

use super::contact::FaceContact;
use super::polyhedron::{Obstacles, Polyhedron};
use nalgebra::Vector3;

/// The surroundings of one fingertip. To measure a distance takes a look at every triangle there; as long as the fingertip
/// has moved less than the room that it had at the last look, none is needed.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    obstacles: Obstacles,
    /// Where the fingertip's centre was at the last look, object frame, m.
    looked_from_m: Vector3<f64>,
    /// How far it could move from there, m.
    room_m: f64,
}

impl Surroundings {
    /// Of a fingertip on a face. On a convex body there is nothing around.
    pub(super) fn of(shape: &Polyhedron, face: &FaceContact) -> Self {
        Self { obstacles: Obstacles::above(shape, face.face), looked_from_m: Vector3::zeros(), room_m: 0.0 }
    }

    /// Whether a sphere (object frame) has come to any of it.
    pub(super) fn reach(&mut self, centre_m: &Vector3<f64>, radius_m: f64) -> bool {
        if self.obstacles.is_empty() || (centre_m - self.looked_from_m).norm_squared() < self.room_m.powi(2) {
            return false;
        }
        (self.looked_from_m, self.room_m) = (*centre_m, self.obstacles.distance_m(centre_m) - radius_m);
        !(self.room_m >= 0.0)
    }
}
