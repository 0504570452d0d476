//! The paper's three-fingered hand, and the same hand on an arm.

use crate::description::{Description, rodrigues};
use blindgrasp_shared::hand::{Fingertip, Joint, Link};
use blindgrasp_shared::math::Real;
use nalgebra::{Matrix3, Vector3};
use std::f64::consts::PI;

/// Length of the paper's finger links (Table IV), m, by joint: joints 1 and 2 share the finger's base.
const LENGTHS_M: [f64; 4] = [0.0, 0.064, 0.064, 0.030];
const MASSES_KG: [f64; 4] = [0.0, 0.038, 0.024, 0.054];
const MASS_CENTRES_M: [f64; 4] = [0.0, 0.023, 0.035, 0.010];
/// Links are taken as uniform cylinders of this radius, m.
const LINK_RADIUS_M: f64 = 0.010;
/// Distance of the fingers' bases from the palm's axis, m.
const PALM_RADIUS_M: f64 = 0.035;
/// Joints of a finger of [`three_finger`].
pub const FINGER_JOINTS: usize = 4;
/// Joint angles of a finger near a grasp, rad: it leans out and curls in.
pub const NEAR_GRASP_RAD: [f64; FINGER_JOINTS] = [0.0, -0.6, 0.8, 0.5];

/// The hand of Table IV: three fingers of four joints at azimuths -90, 30 and 150 degrees about the palm's axis z.
pub fn three_finger() -> Description {
    fingers(&[-PI / 2.0, PI / 6.0, PI * 5.0 / 6.0])
}

/// Fingers of Table IV at given azimuths about the palm's axis.
pub fn fingers(azimuths_rad: &[f64]) -> Description {
    let mut hand = Description::default();
    for &azimuth in azimuths_rad {
        let first = hand.joints.len();
        for k in 0..FINGER_JOINTS {
            let parent = if k == 0 { None } else { Some(first + k - 1) };
            let (offset_m, attitude) = if k == 0 {
                let (sine, cosine) = azimuth.sine_cosine();
                // x of the finger points to the palm's axis.
                (Vector3::new(cosine, sine, 0.0) * PALM_RADIUS_M, rodrigues(&Vector3::z(), azimuth + PI))
            } else {
                (Vector3::z() * LENGTHS_M[k - 1], Matrix3::identity())
            };
            hand.joints.push(Joint {
                parent,
                offset_m,
                attitude,
                axis: if k == 0 { Vector3::x() } else { Vector3::y() },
                lower_rad: -PI,
                upper_rad: PI,
                link: rod(MASSES_KG[k], LENGTHS_M[k], MASS_CENTRES_M[k]),
            });
        }
        hand.fingertips.push(Fingertip {
            link: hand.joints.len() - 1,
            offset_m: Vector3::z() * LENGTHS_M[FINGER_JOINTS - 1],
            radius_m: 0.015,
        });
    }
    hand
}

/// A hand on an arm of three joints, which all are at a right angle to each other. With the arm at zero the hand is
/// where it was; the arm's joints come first.
pub fn on_arm(hand: &Description) -> Description {
    let bones_m = [Vector3::new(0.0, 0.1, -0.3), Vector3::new(0.0, 0.0, 0.2), Vector3::new(0.0, -0.1, 0.1)];
    let mut whole = Description::default();
    for (k, (axis, offset_m)) in
        [Vector3::y(), Vector3::x(), Vector3::z()].into_iter().zip(bones_m).enumerate()
    {
        whole.joints.push(Joint {
            parent: k.checked_sub(1),
            offset_m,
            attitude: Matrix3::identity(),
            axis,
            lower_rad: -PI,
            upper_rad: PI,
            link: rod(0.3, 0.15, 0.05),
        });
    }
    let arm = whole.joints.len();
    whole.joints.extend(
        hand.joints.iter().map(|joint| Joint {
            parent: Some(joint.parent.map_or(arm - 1, |parent| parent + arm)),
            ..*joint
        }),
    );
    whole.fingertips.extend(hand.fingertips.iter().map(|tip| Fingertip { link: tip.link + arm, ..*tip }));
    whole
}

/// The same, but the last finger stands on the arm's first link, so that the arm's other joints move some fingers only.
pub fn on_forked_arm(hand: &Description) -> Description {
    let mut whole = on_arm(hand);
    let arm = whole.joints.len() - hand.joints.len();
    let to_palm = whole.joints[1..arm].iter().map(|joint| joint.offset_m).sum::<Vector3<f64>>();
    let last = whole.fingertips[whole.fingertips.len() - 1].link;
    let base = whole.chain(last).find(|&k| whole.joints[k].parent == Some(arm - 1));
    if let Some(base) = base {
        whole.joints[base].parent = Some(0);
        whole.joints[base].offset_m += to_palm;
    }
    whole
}

/// A uniform cylinder along z, with its mass centre at `mass_centre_m`.
fn rod(mass_kg: f64, length_m: f64, mass_centre_m: f64) -> Link<f64> {
    let radius_squared = LINK_RADIUS_M * LINK_RADIUS_M;
    let across = mass_kg * (3.0 * radius_squared + length_m * length_m) / 12.0;
    Link {
        mass_kg,
        mass_centre_m: Vector3::z() * mass_centre_m,
        inertia_kg_m2: Matrix3::from_diagonal(&Vector3::new(across, across, mass_kg * radius_squared / 2.0)),
    }
}
