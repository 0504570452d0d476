//! The surroundings of a fingertip that rolls on a face, and may come to another part of the object.

use blindgrasp_body::FaceContact;
use blindgrasp_body::polyhedron::{Obstacles, Polyhedron};
use nalgebra::Vector3;

/// The surroundings of one fingertip. To measure a distance takes a look at every triangle there; as long as the fingertip
/// has moved less than the room that it had at the last look, none is needed.
#[derive(Clone, Debug)]
pub(super) struct Surroundings {
    obstacles: Obstacles,
    /// Position of the fingertip's centre at the last look, object frame, m.
    looked_from_m: Vector3<f64>,
    /// Distance that it could move from there, m.
    room_m: f64,
}

impl Surroundings {
    /// Of a fingertip on a face. On a convex body there is nothing around.
    pub(super) fn of(shape: &Polyhedron, face: &FaceContact) -> Self {
        Self { obstacles: Obstacles::above(shape, face.face), looked_from_m: Vector3::zeros(), room_m: 0.0 }
    }

    /// Returns `true` if a sphere (object frame) has come to any of it.
    pub(super) fn reach(&mut self, centre_m: &Vector3<f64>, radius_m: f64) -> bool {
        let moved_squared = (centre_m - self.looked_from_m).norm_squared();
        if self.obstacles.is_empty() || (self.room_m > 0.0 && moved_squared < self.room_m * self.room_m) {
            return false;
        }
        (self.looked_from_m, self.room_m) = (*centre_m, self.obstacles.distance_m(centre_m) - radius_m);
        !(self.room_m >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_body::polyhedron::{Flatness, Polyhedron};
    use blindgrasp_meshes::{Numbers, bracket};
    use nalgebra::Matrix3;

    fn on(face: usize) -> FaceContact {
        FaceContact { face, frame: Matrix3::identity(), distance_m: 0.0 }
    }

    /// A walk over an inner side of an L, in steps of every length: what is skipped would have shown nothing.
    #[test]
    fn what_is_not_looked_at_is_out_of_reach() {
        let (vertices, triangles) = bracket();
        let flatness = Flatness { angle_rad: 1e-3, distance_m: 1e-6 };
        let body = Polyhedron::mesh(&vertices, &triangles, &flatness).unwrap();
        let mut numbers = Numbers(80);
        let (mut reached, mut free) = (0, 0);
        let mut surroundings = Surroundings::of(&body, &on(4));
        let mut centre = Vector3::new(0.02, 0.014, 0.0);
        for _ in 0..20_000 {
            let step = numbers.vector() * 10f64.powf(-5.0 + 3.0 * numbers.unit());
            centre = (centre + step).map(|v| v.clamp(-0.03, 0.035));
            let radius_m = 0.01;
            let expected = body.clearance_m(4, &centre) < radius_m;
            assert_eq!(surroundings.reach(&centre, radius_m), expected);
            reached += usize::from(expected);
            free += usize::from(!expected);
        }
        assert!(reached > 1000 && free > 1000, "{reached} {free}");
    }

    #[test]
    fn a_convex_body_has_none() {
        let cube = Polyhedron::cuboid([0.04; 3]).unwrap();
        let mut surroundings = Surroundings::of(&cube, &on(1));
        assert!(!surroundings.reach(&Vector3::new(0.0, 0.0, 0.0), 1.0));
    }
}
