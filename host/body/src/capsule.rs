//! Links and palm as capsules, and what of a hand can touch what.

use crate::{Hand, Posture};
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// All points within a radius of a line, on a link or on the palm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capsule {
    /// The link, by its joint; `None` for the base.
    pub link: Option<usize>,
    /// Ends of the line in the link's prepared frame ([`LinkPose::attitude`](blindgrasp_shared::hand::LinkPose)), m.
    pub ends_m: [Vector3<f64>; 2],
    /// Radius, m.
    pub radius_m: f64,
}

/// A part of a hand that has a surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Part {
    /// One of the hand's capsules, by its number.
    Capsule(usize),
    /// A fingertip, by its number.
    Fingertip(usize),
}

impl Part {
    /// The link that it is on; `None` for the base.
    pub fn link(self, hand: &Hand, capsules: &[Capsule]) -> Option<usize> {
        match self {
            Self::Capsule(number) => capsules[number].link,
            Self::Fingertip(number) => Some(hand.fingertip_link(number)),
        }
    }

    /// Radius, m.
    pub fn radius_m(self, hand: &Hand, capsules: &[Capsule]) -> f64 {
        match self {
            Self::Capsule(number) => capsules[number].radius_m,
            Self::Fingertip(number) => hand.radius_m(number),
        }
    }

    /// Ends of its line in the base frame, m; a fingertip's are both its centre.
    pub fn ends_m(self, posture: &Posture, capsules: &[Capsule]) -> [Vector3<f64>; 2] {
        match self {
            Self::Capsule(number) => {
                let Capsule { link, ends_m, .. } = &capsules[number];
                link.map_or(*ends_m, |link| {
                    let pose = posture.link(link);
                    ends_m.map(|end_m| pose.point(&end_m))
                })
            }
            Self::Fingertip(number) => [posture.centres_m[number]; 2],
        }
    }
}

/// The pairs of parts that may touch: all that are neither on one link nor on two links that are joined. Links without a part
/// don't count: what lies on either side of them is joined.
pub fn pairs(hand: &Hand, capsules: &[Capsule]) -> Vec<[Part; 2]> {
    let fingertips = (0..hand.fingertip_count()).map(Part::Fingertip);
    let parts: Vec<Part> = (0..capsules.len()).map(Part::Capsule).chain(fingertips).collect();
    let has_part = |link: Option<usize>| parts.iter().any(|part| part.link(hand, capsules) == link);
    let below = |link: Option<usize>| {
        let mut below = hand.parent(link?);
        while below.is_some() && !has_part(below) {
            below = hand.parent(below?);
        }
        Some(below)
    };
    let mut pairs = Vec::new();
    for (k, first) in parts.iter().enumerate() {
        for second in &parts[k + 1..] {
            let [a, b] = [first, second].map(|part| part.link(hand, capsules));
            if a != b && below(a) != Some(b) && below(b) != Some(a) {
                pairs.push([*first, *second]);
            }
        }
    }
    pairs
}

/// Returns how deep two parts are in each other, m; negative where they are apart.
pub fn overlap_m(parts: [Part; 2], hand: &Hand, posture: &Posture, capsules: &[Capsule]) -> f64 {
    let [a, b] = parts.map(|part| part.ends_m(posture, capsules));
    let [s, t] = closest_of_lines([&a, &b]);
    let apart_m = (a[0] + (a[1] - a[0]) * s) - (b[0] + (b[1] - b[0]) * t);
    parts.map(|part| part.radius_m(hand, capsules)).into_iter().sum::<f64>() - norm(&apart_m)
}

/// Returns how far along each of two lines (0 to 1) the points are that are closest to each other.
pub fn closest_of_lines([a, b]: [&[Vector3<f64>; 2]; 2]) -> [f64; 2] {
    let ([u, v], apart) = ([a[1] - a[0], b[1] - b[0]], a[0] - b[0]);
    let (uu, uv, vv) = (u.norm_squared(), u.dot(&v), v.norm_squared());
    let (ua, va) = (u.dot(&apart), v.dot(&apart));
    let share = |numerator: f64, denominator: f64| {
        if denominator > 0.0 { (numerator / denominator).clamp(0.0, 1.0) } else { 0.0 }
    };
    // Where the lines are parallel, any place on the first will do; its own end is found below.
    let s = share(uv * va - vv * ua, uu * vv - uv * uv);
    let t = share(uv * s + va, vv);
    [share(uv * t - ua, uu), t]
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_meshes::Numbers;

    /// Against all pairs of points on a grid; lines that are points or parallel among them.
    ///
    /// Tolerance: the grid's points are a hundredth of a line of at most 0.35 m apart, so that one is within 3.5 mm of each end of
    /// the shortest way; the square of the distance is flat there.
    #[test]
    fn no_points_of_two_lines_are_closer() {
        let mut numbers = Numbers(11);
        let at = |line: &[Vector3<f64>; 2], share: f64| line[0] + (line[1] - line[0]) * share;
        for k in 0..300 {
            let a = [numbers.vector() * 0.1, numbers.vector() * 0.1];
            let mut b = [numbers.vector() * 0.1, numbers.vector() * 0.1];
            match k % 4 {
                1 => b[1] = b[0],
                2 => b[1] = b[0] + (a[1] - a[0]) * 0.7,
                _ => {}
            }
            let apart = |s: f64, t: f64| (at(&a, s) - at(&b, t)).norm();
            let [s, t] = closest_of_lines([&a, &b]);
            let grid =
                (0..=100).flat_map(|i| (0..=100).map(move |j| (f64::from(i) / 100.0, f64::from(j) / 100.0)));
            let least = grid.map(|(s, t)| apart(s, t)).fold(f64::INFINITY, f64::min);
            assert!(
                apart(s, t) <= least + 1e-12 && apart(s, t) > least - 3.5e-3,
                "{k}: {} {least}",
                apart(s, t)
            );
        }
    }
}
