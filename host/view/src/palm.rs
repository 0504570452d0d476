//! Palms: the plates that several fingers start from. Where they face is settled once, because in a run fingertips may
//! swing past the plane of their palm.

use blindgrasp_body::{Hand, Posture};
use nalgebra::Vector3;

/// A plate, in the frame of the link that carries it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Palm {
    /// The link; `None` for the base.
    pub(super) link: Option<usize>,
    centre_m: Vector3<f64>,
    /// Unit vector out of its face, towards the fingertips.
    normal: Vector3<f64>,
    /// Distance of the outermost finger's base from the centre, m.
    pub(super) radius_m: f64,
}

impl Palm {
    /// The palms of a hand, which face the fingertips in `posture`.
    pub(super) fn all(hand: &Hand, posture: &Posture) -> Vec<Self> {
        let tips = middle(&posture.centres_m[..hand.fingertip_count()]);
        let links = std::iter::once(None).chain((0..hand.joint_count()).map(Some));
        links
            .filter_map(|link| {
                let joints = (0..hand.joint_count()).filter(|&k| hand.parent(k) == link);
                let bases: Vec<Vector3<f64>> = joints.map(|k| posture.link(k).origin_m).collect();
                (bases.len() > 1).then(|| Self::through(&bases, &tips).carried_by(link, posture))
            })
            .collect()
    }

    /// The plate through some points that faces another, in the base frame.
    fn through(bases: &[Vector3<f64>], towards: &Vector3<f64>) -> Self {
        let centre_m = middle(bases);
        let spokes: Vec<Vector3<f64>> = bases.iter().map(|base| base - centre_m).collect();
        let longest = |best: Vector3<f64>, v: Vector3<f64>| if v.norm() > best.norm() { v } else { best };
        let widest = spokes.iter().copied().fold(Vector3::zeros(), longest);
        let out = towards - centre_m;
        // Two fingers span no plane: then the plate faces the fingertips as well as it can.
        let plane = spokes.iter().map(|spoke| widest.cross(spoke)).fold(Vector3::zeros(), longest);
        let radius_m = widest.norm();
        let normal = if plane.norm() > 1e-3 * radius_m * radius_m && radius_m > 0.0 {
            plane * plane.dot(&out).signum()
        } else if radius_m > 0.0 {
            out - widest * (out.dot(&widest) / (radius_m * radius_m))
        } else {
            out
        };
        let normal = normal.try_normalize(0.0).unwrap_or(Vector3::z());
        Self { link: None, centre_m, normal, radius_m }
    }

    fn carried_by(self, link: Option<usize>, posture: &Posture) -> Self {
        let Some(pose) = link.map(|link| posture.link(link)) else { return self };
        let to_link = pose.attitude.transpose();
        let (centre_m, normal) = (to_link * (self.centre_m - pose.origin_m), to_link * self.normal);
        Self { link, centre_m, normal, ..self }
    }

    /// Centre (m) and normal in the base frame.
    pub(super) fn placed(&self, posture: &Posture) -> (Vector3<f64>, Vector3<f64>) {
        match self.link.map(|link| posture.link(link)) {
            Some(pose) => (pose.point(&self.centre_m), pose.attitude * self.normal),
            None => (self.centre_m, self.normal),
        }
    }
}

/// Mean of some points; the origin if there is none.
pub(super) fn middle(points: &[Vector3<f64>]) -> Vector3<f64> {
    points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::super::fixture;
    use super::*;

    #[test]
    fn the_palm_faces_the_fingertips() {
        let bases = [Vector3::x(), -Vector3::x(), Vector3::y()];
        let palm = Palm::through(&bases, &Vector3::new(0.2, 0.1, -3.0));
        assert!((palm.normal + Vector3::z()).norm() < 1e-12);
        let pair = Palm::through(&bases[..2], &Vector3::new(0.5, 0.0, 2.0));
        assert!((pair.normal - Vector3::z()).norm() < 1e-12, "square to the line between two fingers");
        assert_eq!(Palm::through(&[Vector3::zeros(); 3], &Vector3::zeros()).normal, Vector3::z());
    }

    #[test]
    fn a_hand_without_an_arm_has_its_palm_in_the_base() {
        let hand = fixture::hand();
        let mut posture = Posture::at_base();
        hand.forward_kinematics(&[0.0; blindgrasp_body::MAX_JOINTS], &mut posture);
        let palms = Palm::all(&hand, &posture);
        assert_eq!(palms.len(), 1);
        let (centre, normal) = palms[0].placed(&posture);
        assert!(centre.norm() < 1e-12 && (normal - Vector3::z()).norm() < 1e-12);
        assert!((palms[0].radius_m - 0.035).abs() < 1e-12);
    }
}
