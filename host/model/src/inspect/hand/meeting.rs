//! Meetings of the fingertips: the smallest ball that they can all touch, evenly around their middle.
//!
//! The law draws the fingertips to their middle `x_c`. With a ball there, it comes to rest where every centre is at the
//! ball's radius plus its own from `x_c`: since `x_c` is the mean of the centres, the fingertips then face each other.
//! Such postures are searched for from many starts, each fingertip in turn moving to where it should be; what is found
//! is confirmed by the inverse kinematics that places the fingers of a scene.

use super::reach::{Angles, Sense, random_angles, sweep};
use super::specimen::Specimen;
use crate::posture;
use blindgrasp_body::inverse_kinematics;
use nalgebra::Vector3;

/// Starts for a ball and a set of fingertips: the nominal posture, and random ones.
const STARTS: usize = 24;
/// Turns from one start.
const TURNS: usize = 150;
/// A turn that comes no nearer than this share of the way left has stalled, ...
const STALLED: f64 = 0.995;
/// ... and after so many of them in a row the search is given up.
const PATIENCE: usize = 5;
/// A search that is as near as this, in radii of a fingertip, is left to the inverse kinematics.
const NEAR: f64 = 1e-3;

/// Fingertips that meet.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Meeting {
    /// The fingertips that touch the ball, by index.
    pub(super) fingertips: Vec<usize>,
    /// Radius of the ball, m.
    pub(super) ball_radius_m: f64,
    /// Its centre in the base frame, m.
    pub(super) centre_m: Vector3<f64>,
}

/// The balls that can be held.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Meetings {
    /// Around a small ball, of the size of a fingertip: the most fingertips, if at least two.
    pub(super) small: Option<Meeting>,
    /// Around the smallest ball found that all fingertips can touch.
    pub(super) all: Option<Meeting>,
}

/// Finds out.
pub(super) fn meetings(specimen: &Specimen) -> Meetings {
    let count = specimen.fingers();
    let everyone: Vec<usize> = (0..count).collect();
    let small_m = specimen.mean_radius_m();
    if let Some(meeting) = meet(specimen, &everyone, small_m) {
        return Meetings { small: Some(meeting.clone()), all: Some(meeting) };
    }
    // Radii that grow by a half, up to a ball as large as the hand.
    let radii = std::iter::successors(Some(small_m * 1.5), |radius| Some(radius * 1.5));
    let all =
        radii.take_while(|radius| *radius < specimen.span_m()).find_map(|r| meet(specimen, &everyone, r));
    let mut sets: Vec<Vec<usize>> = (0..1_usize << count)
        .map(|bits| (0..count).filter(|i| bits & (1 << i) != 0).collect::<Vec<_>>())
        .filter(|set| set.len() > 1 && set.len() < count)
        .collect();
    sets.sort_by_key(|set| (count - set.len(), set.clone()));
    Meetings { small: sets.iter().find_map(|set| meet(specimen, set, small_m)), all }
}

/// A posture in which these fingertips touch a ball.
fn meet(specimen: &Specimen, fingertips: &[usize], ball_radius_m: f64) -> Option<Meeting> {
    let joints: Vec<usize> = fingertips.iter().flat_map(|&i| &specimen.own[i]).copied().collect();
    let mut random = fastrand::Rng::with_seed(1);
    let starts = (0..STARTS).map(|k| match k {
        0 => specimen.nominal_rad,
        _ => random_angles(specimen, &joints, &mut random),
    });
    for mut angles in starts {
        let (mut nearest, mut stalled) = (f64::INFINITY, 0);
        for _ in 0..TURNS {
            let Some((centre, targets)) = targets(specimen, fingertips, ball_radius_m, &angles) else {
                break;
            };
            let tips = posture(&specimen.hand, &angles).centres_m;
            let errors = fingertips.iter().zip(&targets).map(|(&i, target)| (tips[i] - target).norm());
            let error = errors.fold(0.0, f64::max);
            stalled = if error < STALLED * nearest { 0 } else { stalled + 1 };
            nearest = nearest.min(error);
            if stalled > PATIENCE {
                break;
            }
            if error < NEAR * specimen.mean_radius_m() {
                if is_confirmed(specimen, fingertips, &targets, &angles) {
                    return Some(Meeting {
                        fingertips: fingertips.to_vec(),
                        ball_radius_m,
                        centre_m: centre,
                    });
                }
                break;
            }
            for (&i, target) in fingertips.iter().zip(&targets) {
                sweep(specimen, i, &specimen.own[i], target, Sense::Nearest, &mut angles);
            }
        }
    }
    None
}

/// The middle of some fingertips, and where on a ball around it their centres should be: in the directions in which they are.
fn targets(
    specimen: &Specimen,
    fingertips: &[usize],
    ball_radius_m: f64,
    angles: &Angles,
) -> Option<(Vector3<f64>, Vec<Vector3<f64>>)> {
    let tips = posture(&specimen.hand, angles).centres_m;
    let middle = fingertips.iter().map(|&i| tips[i]).sum::<Vector3<f64>>() / fingertips.len() as f64;
    let target = |&i: &usize| {
        let way = (tips[i] - middle).try_normalize(1e-9 * specimen.hand.radius_m(i))?;
        Some(middle + way * (ball_radius_m + specimen.hand.radius_m(i)))
    };
    Some((middle, fingertips.iter().map(target).collect::<Option<_>>()?))
}

/// Returns `true` if the inverse kinematics of scenes gets there too. The other fingertips stay where they are, and so
/// do those with too few joints to get to any point, which are there nearly.
fn is_confirmed(
    specimen: &Specimen,
    fingertips: &[usize],
    targets: &[Vector3<f64>],
    angles: &Angles,
) -> bool {
    let hand = &specimen.hand;
    let mut all = posture(hand, angles).centres_m[..specimen.fingers()].to_vec();
    for (&i, target) in fingertips.iter().zip(targets) {
        if specimen.own[i].len() > 2 {
            all[i] = *target;
        }
    }
    inverse_kinematics::place(hand, &all, &angles[..hand.joint_count()]).is_ok()
}

#[cfg(test)]
mod tests {
    use super::super::tests::specimen;
    use super::*;

    #[test]
    fn the_paper_s_fingertips_meet_above_the_palm() {
        let hand = specimen("three-finger");
        let found = meetings(&hand);
        let meeting = found.small.unwrap();
        assert_eq!((meeting.fingertips.as_slice(), meeting.ball_radius_m), (&[0, 1, 2][..], 0.015));
        let [x, y, z]: [f64; 3] = meeting.centre_m.into();
        assert!(x.abs() < 0.05 && y.abs() < 0.05 && (0.03..0.16).contains(&z), "{meeting:?}");
        assert_eq!(found.all.unwrap().fingertips.len(), 3);
    }

    #[test]
    fn fingers_too_far_apart_do_not_meet() {
        let mut file = crate::HandFile::load("two-finger").unwrap();
        // The bases 0.2 m apart from each other's reach: 2 * (0.158 + 0.1).
        for (joint, y) in [(0, -0.258), (4, 0.258)] {
            file.joints[joint].offset_m[1] = y;
        }
        let found = meetings(&super::super::tests::specimen_of(file));
        assert_eq!(found.small, None);
        // Stretched towards each other, the tips' centres stay 0.2 m apart: a ball of 85 mm between them.
        let all = found.all.unwrap();
        assert!((0.085..0.085 * 1.5).contains(&all.ball_radius_m), "{all:?}");
    }
}
