//! The least and the greatest distance of a fingertip from a point.
//!
//! Turned about one joint, a fingertip moves on a circle, whose nearest and farthest points to the given one have a closed
//! form. Joint after joint is turned to them until nothing is gained (cyclic coordinate descent), from several postures.

use super::specimen::Specimen;
use blindgrasp_body::{MAX_JOINTS, Posture};
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// Turns over all joints from one start.
const SWEEPS: usize = 200;
/// Postures that are tried for a start.
const SAMPLES: usize = 256;
/// The number of them that the search starts from.
const STARTS: usize = 6;

/// Joint angles of a whole hand, rad.
pub(super) type Angles = [f64; MAX_JOINTS];

/// The sense of the search.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Sense {
    Nearest,
    Farthest,
}

impl Sense {
    /// Returns `true` if the one distance is better than the other.
    fn prefers(self, a: f64, b: f64) -> bool {
        match self {
            Self::Nearest => a < b,
            Self::Farthest => a > b,
        }
    }
}

/// The extreme distance (m) of a fingertip's centre from a point of the base frame, over the ranges of some joints; the
/// others stay at their nominal angles.
pub(super) fn extreme_m(
    specimen: &Specimen,
    fingertip: usize,
    joints: &[usize],
    point_m: &Vector3<f64>,
    sense: Sense,
) -> f64 {
    let distance = |angles: &Angles| {
        let mut posture = Posture::at_base();
        specimen.hand.forward_kinematics(angles, &mut posture);
        (posture.centres_m[fingertip] - point_m).norm()
    };
    let mut random = fastrand::Rng::with_seed(1);
    let mut starts: Vec<(f64, Angles)> = (0..SAMPLES)
        .map(|_| random_angles(specimen, joints, &mut random))
        .chain([specimen.nominal_rad])
        .map(|angles| (distance(&angles), angles))
        .collect();
    starts.sort_by(|a, b| if sense == Sense::Nearest { a.0.total_cmp(&b.0) } else { b.0.total_cmp(&a.0) });
    let mut best = starts[0].0;
    for (start, mut angles) in starts.into_iter().take(STARTS) {
        let mut reached = start;
        for _ in 0..SWEEPS {
            sweep(specimen, fingertip, joints, point_m, sense, &mut angles);
            let next = distance(&angles);
            let gain = (next - reached).abs();
            reached = if sense.prefers(next, reached) { next } else { reached };
            if !(gain > 1e-12 * specimen.span_m()) {
                break;
            }
        }
        best = if sense.prefers(reached, best) { reached } else { best };
    }
    best
}

/// A posture anywhere in the ranges of some joints, the others at their nominal angles.
pub(super) fn random_angles(specimen: &Specimen, joints: &[usize], random: &mut fastrand::Rng) -> Angles {
    let mut angles = specimen.nominal_rad;
    for &k in joints {
        let (lower, upper) = specimen.hand.range_rad(k);
        angles[k] = lower + (upper - lower) * random.f64();
    }
    angles
}

/// Turns each joint once, from the fingertip inwards, to where the fingertip is nearest to a point or farthest from it.
pub(super) fn sweep(
    specimen: &Specimen,
    fingertip: usize,
    joints: &[usize],
    point_m: &Vector3<f64>,
    sense: Sense,
    angles: &mut Angles,
) {
    let hand = &specimen.hand;
    let mut posture = Posture::at_base();
    hand.forward_kinematics(angles, &mut posture);
    let mut tip = posture.centres_m[fingertip];
    // A joint does not move those further in, so that their poses stay right.
    for &k in joints.iter().rev() {
        let pose = posture.link(k);
        let axis = pose.axis();
        let (lever, way) = (tip - pose.origin_m, point_m - pose.origin_m);
        // The distance squared falls with `a cos + b sin` of the turn.
        let across = axis.cross(&lever);
        let (a, b) = ((lever - axis * axis.dot(&lever)).dot(&way), across.dot(&way));
        let sign = if sense == Sense::Nearest { 1.0 } else { -1.0 };
        let score = |turn: f64| {
            let (sine, cosine) = turn.sine_cosine();
            sign * (a * cosine + b * sine)
        };
        let best = (sign * b).atan2(sign * a);
        let (lower, upper) = hand.range_rad(k);
        let (least, most) = (lower - angles[k], upper - angles[k]);
        // The best turn, a whole turn on where only that is within the range, or else an end of the range.
        let turns = [best, best + std::f64::consts::TAU, best - std::f64::consts::TAU];
        let within = turns.into_iter().filter(|turn| (least..=most).contains(turn));
        let turn = within.chain([least, most]).fold(0.0, |chosen, turn| {
            if score(turn) > score(chosen) + 1e-15 * (a.abs() + b.abs()) { turn } else { chosen }
        });
        angles[k] = (angles[k] + turn).limited(lower, upper);
        let (sine, cosine) = turn.sine_cosine();
        let along = axis * axis.dot(&lever);
        tip = pose.origin_m + along + (lever - along) * cosine + across * sine;
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::specimen;
    use super::*;

    /// Table IV: 64, 64 and 30 mm stretch to 158 mm; folded as far as the limits allow, the law of cosines says how near.
    #[test]
    fn reach_of_the_paper_s_finger() {
        let hand = specimen("three-finger");
        for i in 0..3 {
            let base = hand.base_m(i);
            let far = extreme_m(&hand, i, &hand.own[i], &base, Sense::Farthest);
            assert!((far - 0.158).abs() < 1e-12, "{far}");
            // Joints 3 and 4 at their limit of 1.9 rad.
            let (s1, c1) = 1.9_f64.sine_cosine();
            let (s2, c2) = 3.8_f64.sine_cosine();
            let folded = [0.064 + 0.064 * c1 + 0.03 * c2, 0.064 * s1 + 0.03 * s2];
            let folded = (folded[0] * folded[0] + folded[1] * folded[1]).square_root();
            let near = extreme_m(&hand, i, &hand.own[i], &base, Sense::Nearest);
            assert!((near - folded).abs() < 1e-9, "{near} {folded}");
        }
    }

    #[test]
    fn no_sample_is_nearer_or_farther() {
        let hand = specimen("three-finger");
        let point = Vector3::new(0.03, -0.02, 0.08);
        let mut random = fastrand::Rng::with_seed(5);
        for i in 0..3 {
            let near = extreme_m(&hand, i, &hand.own[i], &point, Sense::Nearest);
            let far = extreme_m(&hand, i, &hand.own[i], &point, Sense::Farthest);
            for _ in 0..20_000 {
                let angles = random_angles(&hand, &hand.own[i], &mut random);
                let mut posture = Posture::at_base();
                hand.hand.forward_kinematics(&angles, &mut posture);
                let distance = (posture.centres_m[i] - point).norm();
                assert!(near <= distance + 1e-12 && distance <= far + 1e-12, "{near} {distance} {far}");
            }
        }
    }
}
