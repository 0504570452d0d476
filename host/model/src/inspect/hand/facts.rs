//! The facts of a hand: the numbers that a check shows, as `--json` prints them.

use super::meeting::{Meeting, Meetings};
use super::reach::{Sense, extreme_m};
use super::specimen::Specimen;
use super::strength;
use crate::file::{CapsuleFile, FingertipFile, JointFile, PostureFile};
use crate::{HandFile, posture};
use blindgrasp_body::MAX_JOINTS;
use nalgebra::Vector3;
use serde::Serialize;

/// Half the width of what is grasped has to be so many times the lag of a fingertip that presses.
const WIDTHS_PER_LAG: f64 = 5.0;

/// A joint of the map.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JointFacts {
    /// Its number in the file, from 1, as keys have it.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// The joint on whose link it sits; `None` for the base.
    pub parent: Option<String>,
    /// Its axis in its link frame, as the file has it.
    pub axis: [f64; 3],
    /// Its axis in the base frame with all joints at zero; `None` where the tree is not known.
    pub axis_in_base: Option<[f64; 3]>,
    /// End stops, rad.
    pub limits_rad: [f64; 2],
    /// Angle at the nominal posture, rad.
    pub nominal_rad: f64,
    /// Largest torque, N m.
    pub torque_limit_nm: f64,
    /// Largest speed, rad/s.
    pub speed_limit_rad_s: f64,
    /// Encoder counts a turn.
    pub encoder_counts_per_turn: f64,
    /// Names of the fingertips that it moves.
    pub moves: Vec<String>,
    /// `finger` where it moves one, `trunk` where it moves several.
    pub part: Option<&'static str>,
    /// Cosine between the fingertip's velocity, when the joint turns in its positive sense at the nominal posture, and the way
    /// to the middle of all fingertips: 1 closes, -1 opens.
    pub closing: Option<f64>,
}

/// A fingertip.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct FingertipFacts {
    /// Its number in the file, from 1.
    pub number: usize,
    /// Its name.
    pub name: String,
    /// The joint whose link it is on.
    pub link: String,
    /// Radius, m.
    pub radius_m: f64,
    /// Joints that move it and no other fingertip.
    pub own_joints: usize,
    /// Joints that move it and others.
    pub shared_joints: usize,
    /// The largest force towards the other fingertips at the nominal posture, N, and the joint that ends it.
    pub grasping_force_n: Option<f64>,
    /// The joint that limits it.
    pub limited_by: Option<String>,
    /// The largest force in the direction in which it is weakest, N.
    pub least_force_n: Option<f64>,
}

/// A capsule of a link or of the palm.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct CapsuleFacts {
    /// Its number in the file, from 1.
    pub number: usize,
    /// The joint whose link it is on; `None` for the palm.
    pub link: Option<String>,
    /// Length of its line, m; 0 for a ball.
    pub length_m: f64,
    /// Radius, m.
    pub radius_m: f64,
}

/// A named posture.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PostureFacts {
    /// Its name.
    pub name: String,
    /// An angle for each joint, rad.
    pub angles_rad: Vec<f64>,
    /// The middle of the fingertips' centres in the base frame, m.
    pub middle_m: [f64; 3],
    /// The distance of the nearest and of the farthest centre from there, m.
    pub from_middle_m: [f64; 2],
}

/// The forces of fingertips that close until they touch.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClosingFacts {
    /// The posture that is looked at, in words.
    pub posture: &'static str,
    /// Force of a fingertip, N.
    pub force_n: f64,
    /// Force from which all fingertips move against the friction of their joints, N.
    pub moving_force_n: f64,
    /// The fingertip that needs it.
    pub stiffest: String,
    /// Most that a fingertip presses with while it comes to rest, N.
    pub most_force_n: f64,
    /// Way by which a fingertip that presses is behind its reference, m.
    pub lag_m: f64,
    /// Half the width of the smallest object that is found for certain, m: five times that.
    pub least_half_width_m: f64,
}

/// The reach of a fingertip's centre.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Reach {
    /// The fingertip's name.
    pub fingertip: String,
    /// The beginning of its finger, in the base frame at the nominal posture, m.
    pub finger_base_m: [f64; 3],
    /// Nearest to there, m, by the finger's own joints.
    pub from_finger_least_m: f64,
    /// Farthest from there, m.
    pub from_finger_most_m: f64,
    /// The bound of the reach: the sum of the finger's bones, m.
    pub finger_length_m: f64,
    /// Nearest to the base's origin, m, by all joints.
    pub from_base_least_m: f64,
    /// Farthest from there, m.
    pub from_base_most_m: f64,
    /// The bound of the reach: the sum of all bones, m.
    pub bones_m: f64,
}

/// Masses of the links, kg.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Masses {
    /// Of each finger: of the joints that move its fingertip alone.
    pub fingers_kg: Vec<f64>,
    /// Of the joints that move several fingertips.
    pub trunk_kg: f64,
    /// All.
    pub total_kg: f64,
    /// Of all links together at the nominal posture, in the base frame, m; `None` without mass.
    pub centre_m: Option<[f64; 3]>,
}

/// Fingertips that can hold a ball between them.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct MeetingFacts {
    /// Their names.
    pub fingertips: Vec<String>,
    /// Radius of the ball, m.
    pub ball_radius_m: f64,
    /// Its centre in the base frame, m.
    pub centre_m: [f64; 3],
}

/// The places where the fingertips meet; a part is `None` where no such posture was found.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct MeetingsFacts {
    /// Around a ball of the size of a fingertip: the most fingertips, if at least two.
    pub small: Option<MeetingFacts>,
    /// Around the smallest ball found that all touch.
    pub all: Option<MeetingFacts>,
}

/// The joint map. Without a specimen, what the file says.
pub(super) fn joints(file: &HandFile, specimen: Option<&Specimen>) -> Vec<JointFacts> {
    let zero = specimen.map(|specimen| posture(&specimen.hand, &[0.0; MAX_JOINTS]));
    let facts = |(k, joint): (usize, &JointFile)| {
        // A joint that moves no fingertip is not in the specimen.
        let of = specimen.and_then(|s| Some((s, s.numbers.iter().position(|&number| number == k + 1)?)));
        let moves: Vec<String> = of.map_or(Vec::new(), |(s, j)| {
            let moved = (0..s.fingers()).filter(|&i| s.hand.moves(j, i));
            moved.map(|i| s.file.fingertips[i].name.clone()).collect()
        });
        JointFacts {
            number: k + 1,
            name: joint.name.clone(),
            parent: joint.parent.clone(),
            axis: joint.axis,
            axis_in_base: of.zip(zero.as_ref()).map(|((_, j), zero)| zero.link(j).axis().into()),
            limits_rad: joint.limits_rad,
            nominal_rad: joint.nominal_rad,
            torque_limit_nm: joint.torque_limit_nm,
            speed_limit_rad_s: joint.speed_limit_rad_s,
            encoder_counts_per_turn: joint.encoder_counts_per_turn,
            part: of.map(|_| if moves.len() > 1 { "trunk" } else { "finger" }),
            moves,
            closing: of.and_then(|(s, j)| s.finger_of(j).map(|_| s.closing(&s.posture, j))),
        }
    };
    file.joints.iter().enumerate().map(facts).collect()
}

/// The fingertips.
pub(super) fn fingertips(file: &HandFile, specimen: Option<&Specimen>) -> Vec<FingertipFacts> {
    let facts = |(i, tip): (usize, &FingertipFile)| {
        let grasping = specimen.and_then(|s| strength::grasping_force(s, i));
        FingertipFacts {
            number: i + 1,
            name: tip.name.clone(),
            link: tip.link.clone(),
            radius_m: tip.radius_m,
            own_joints: specimen.map_or(0, |s| s.own[i].len()),
            shared_joints: specimen.map_or(0, |s| s.hand.joints_to(i).count() - s.own[i].len()),
            grasping_force_n: grasping.map(|force| force.force_n),
            limited_by: specimen.zip(grasping).map(|(s, force)| s.file.joints[force.limited_by].name.clone()),
            least_force_n: specimen.and_then(|s| strength::least_force(s, i)).map(|force| force.force_n),
        }
    };
    file.fingertips.iter().enumerate().map(facts).collect()
}

/// The capsules.
pub(super) fn capsules(file: &HandFile) -> Vec<CapsuleFacts> {
    let facts = |(k, capsule): (usize, &CapsuleFile)| CapsuleFacts {
        number: k + 1,
        link: capsule.link.clone(),
        length_m: (Vector3::from(capsule.to_m) - Vector3::from(capsule.from_m)).norm(),
        radius_m: capsule.radius_m,
    };
    file.capsules.iter().enumerate().map(facts).collect()
}

/// Returns the named postures.
pub(super) fn postures(specimen: &Specimen) -> Vec<PostureFacts> {
    let facts = |file: &PostureFile| {
        let posture = posture(&specimen.hand, &file.angles_rad);
        let middle_m = specimen.middle_m(&posture);
        let away_m =
            posture.centres_m[..specimen.fingers()].iter().map(|centre_m| (centre_m - middle_m).norm());
        PostureFacts {
            name: file.name.clone(),
            angles_rad: file.angles_rad.clone(),
            middle_m: middle_m.into(),
            from_middle_m: [away_m.clone().fold(f64::INFINITY, f64::min), away_m.fold(0.0, f64::max)],
        }
    };
    specimen.file.postures.iter().map(facts).collect()
}

/// Returns how the fingertips close; `None` where they don't, or nothing moves them.
pub(super) fn closing(specimen: &Specimen) -> Option<ClosingFacts> {
    let control = specimen.file.control.as_ref()?;
    let numbers = [control.closing_speed_m_s, control.closing_force_n, control.closing_stiffness_n_m];
    if !numbers.iter().all(|number| *number > 0.0 && number.is_finite()) {
        return None;
    }
    let (words, posture) = specimen.closing_posture();
    let forces_n =
        (0..specimen.fingers()).filter_map(|i| Some((strength::moving_force_n(specimen, &posture, i)?, i)));
    // Of fingers that are alike, the first.
    let (moving_force_n, stiffest) =
        forces_n.reduce(|most, next| if next.0 > most.0 * (1.0 + 1e-9) { next } else { most })?;
    let force_n = control.closing_force_n;
    let lag_m = force_n / control.closing_stiffness_n_m;
    Some(ClosingFacts {
        posture: words,
        force_n,
        moving_force_n,
        stiffest: specimen.file.fingertips[stiffest].name.clone(),
        most_force_n: force_n + control.closing_damping_n_s_m * control.closing_speed_m_s,
        lag_m,
        least_half_width_m: WIDTHS_PER_LAG * lag_m,
    })
}

/// Returns the reach of each fingertip.
pub(super) fn reaches(specimen: &Specimen) -> Vec<Reach> {
    (0..specimen.fingers()).map(|i| reach(specimen, i)).collect()
}

/// Returns the places where they meet.
pub(super) fn meetings(specimen: &Specimen, meetings: &Meetings) -> MeetingsFacts {
    let facts = |meeting: &Meeting| MeetingFacts {
        fingertips: meeting.fingertips.iter().map(|&i| specimen.file.fingertips[i].name.clone()).collect(),
        ball_radius_m: meeting.ball_radius_m,
        centre_m: meeting.centre_m.into(),
    };
    MeetingsFacts { small: meetings.small.as_ref().map(facts), all: meetings.all.as_ref().map(facts) }
}

fn reach(specimen: &Specimen, i: usize) -> Reach {
    let (base, own) = (specimen.base_m(i), specimen.own[i].clone());
    let mut all: Vec<usize> = specimen.hand.joints_to(i).collect();
    all.reverse();
    let bones: f64 = all.iter().map(|&k| specimen.hand.offset_m(k).norm()).sum();
    let origin = Vector3::zeros();
    Reach {
        fingertip: specimen.file.fingertips[i].name.clone(),
        finger_base_m: base.into(),
        from_finger_least_m: extreme_m(specimen, i, &own, &base, Sense::Nearest),
        from_finger_most_m: extreme_m(specimen, i, &own, &base, Sense::Farthest),
        finger_length_m: specimen.finger_length_m(i),
        from_base_least_m: extreme_m(specimen, i, &all, &origin, Sense::Nearest),
        from_base_most_m: extreme_m(specimen, i, &all, &origin, Sense::Farthest),
        bones_m: bones + specimen.hand.prepared_fingertips()[i].offset_m.norm(),
    }
}

/// Returns the masses of the links.
pub(super) fn masses(specimen: &Specimen) -> Masses {
    let mass = |k: usize| specimen.hand.link(k).mass_kg;
    let all = 0..specimen.joints();
    let total_kg: f64 = all.clone().map(mass).sum();
    let moment: Vector3<f64> = all
        .clone()
        .map(|k| specimen.posture.link(k).point(&specimen.hand.link(k).mass_centre_m) * mass(k))
        .sum();
    Masses {
        fingers_kg: specimen.own.iter().map(|own| own.iter().map(|&k| mass(k)).sum()).collect(),
        trunk_kg: all.filter(|&k| specimen.finger_of(k).is_none()).map(mass).sum(),
        total_kg,
        centre_m: (total_kg > 0.0).then(|| (moment / total_kg).into()),
    }
}
