//! The search: the candidates in turn, until none that is left can be better than what was found.

use super::arrangement::{self, Arrangement};
use super::candidate::{self, Candidate, Contacts};
use super::position::{self, ROOM_RAD, Target};
use super::quality::{Quality, score};
use super::refusal::{Count, Words};
use super::stance::{self, Miss, Stance, Taker};
use super::task::Task;
use super::{NARROWEST, NoPlacement, Placement, Refusal, Request};
use blindgrasp_body::equilibrium_indentations;
use blindgrasp_model::file::{ContactFile, Indentation, PoseFile, SceneFile};
use blindgrasp_model::{Scene, SceneError};
use nalgebra::{UnitQuaternion, Vector3};

/// Positions that are tried for an arrangement.
const POSITIONS: usize = 4;
/// Positions are rounded to these, m, as long as that costs little.
const ROUND_M: [f64; 4] = [5e-3, 1e-3, 1e-4, 1e-6];
/// Contact points are rounded to this, m: less than a scene takes for off the face.
const ROUND_POINT_M: f64 = 1e-7;
/// The share that rounding leaves.
const LITTLE: f64 = 0.98;

/// A placement that the fingers can take.
struct Draft {
    stance: Stance,
    score: f64,
}

/// The best placements, at most `most`, the best first.
pub(super) fn run(request: &Request<'_>, most: usize) -> Result<Vec<Placement>, NoPlacement> {
    let task = Task::new(request)?;
    let mut count = Count::default();
    let candidates = candidate::all(&task, &mut count);
    let mut drafts: Vec<Draft> = Vec::new();
    for candidate in &candidates {
        if drafts.len() >= most && drafts[most - 1].score >= candidate.chance {
            break;
        }
        if let Some(draft) = draft(&task, candidate, &mut count) {
            let at = drafts.partition_point(|other| other.score >= draft.score);
            drafts.insert(at, draft);
        }
    }
    let mut placements: Vec<Placement> = Vec::new();
    for draft in drafts {
        match placement(&task, draft) {
            Ok(placement) => placements.push(placement),
            Err(error) => count.refused.add(0.0, error.to_string()),
        }
        if placements.len() == most {
            break;
        }
    }
    // The scenes' own numbers are rounded, and their radii are exact: near ties may change places.
    placements.sort_by(|a, b| b.quality.score.total_cmp(&a.quality.score));
    if placements.is_empty() { Err(NoPlacement::None(refusal(&task, &count))) } else { Ok(placements) }
}

fn refusal(task: &Task<'_>, count: &Count) -> Refusal {
    if task.free() > 0 && task.facets.is_empty() {
        let mean =
            task.request.like.hand.fingertips.iter().map(|tip| tip.radius_m).sum::<f64>() / task.count as f64;
        return Refusal {
            reason: format!(
                "no face is wide enough: the middle of the widest is {:.2} mm from its edge, and a contact needs {:.2} mm",
                task.narrow.1 * 1e3,
                NARROWEST * mean * 1e3
            ),
            tests: Vec::new(),
        };
    }
    count.refusal(&Words {
        hand: &task.request.like.hand,
        reach: task.request.reach,
        any_attitude: task.request.any_attitude,
        any_position: task.request.any_position,
    })
}

/// The best placement of a candidate.
fn draft(task: &Task<'_>, candidate: &Candidate, count: &mut Count) -> Option<Draft> {
    let arrangements = match arrangement::all(task, candidate) {
        Ok(arrangements) => arrangements,
        Err(wide) => {
            let (i, j) = wide.fingertips;
            count.wide.add(wide.by_m, (i, j, wide.distance_m));
            return None;
        }
    };
    let mut best: Option<Draft> = None;
    let mut proposed = false;
    for arrangement in &arrangements {
        let Some((contacts, faces)) = contacts(task, arrangement) else { continue };
        for position_m in positions(task, arrangement, &contacts, &faces) {
            proposed = true;
            let stance = stance(task, arrangement, &contacts, &faces, position_m);
            let Some(stance) = stance else { continue };
            match take(task, &stance) {
                Ok(room_rad) => {
                    let score = score(contacts.chance, room_rad);
                    if best.as_ref().is_none_or(|best| score > best.score) {
                        best = Some(Draft { stance, score });
                    }
                    if room_rad >= ROOM_RAD {
                        break;
                    }
                }
                Err(miss) => count.miss(miss),
            }
        }
        // The others of this candidate are hardly better.
        if best.as_ref().is_some_and(|best| best.score >= 0.999 * candidate.chance) {
            break;
        }
    }
    if !proposed {
        count.apart += 1;
    }
    best
}

/// Contacts of the fingertips that an arrangement puts on the faces, and the faces.
fn contacts(task: &Task<'_>, arrangement: &Arrangement) -> Option<(Contacts, Vec<usize>)> {
    let facets = task.assigned(&arrangement.order);
    let contacts = candidate::contacts(task, &facets, arrangement.z).ok()?;
    Some((contacts, facets.iter().map(|facet| facet.face).collect()))
}

/// Positions of the object to try.
fn positions(
    task: &Task<'_>,
    arrangement: &Arrangement,
    contacts: &Contacts,
    faces: &[usize],
) -> Vec<Vector3<f64>> {
    let shape = &task.request.parts.object.shape;
    let targets: Vec<Target> = contacts
        .centres_m
        .iter()
        .zip(faces)
        .map(|(centre, &face)| Target {
            offset_m: arrangement.attitude * centre,
            inward: arrangement.attitude * -shape.faces[face].normal,
        })
        .collect();
    let given_m = Vector3::from(task.request.like.pose.position_m);
    if task.request.any_position {
        // Where the contacts have their middle where the fingertips of the nominal posture have theirs; then by the map.
        let middle = targets.iter().map(|target| target.offset_m).sum::<Vector3<f64>>() / task.count as f64;
        let middle = Some(task.nominal_middle_m - middle);
        let middle = middle.filter(|position_m| position::near(task.request.reach, &targets, position_m));
        middle.into_iter().chain(position::propose(task.request.reach, &targets, POSITIONS)).collect()
    } else if position::near(task.request.reach, &targets, &given_m) {
        vec![given_m]
    } else {
        Vec::new()
    }
}

/// Returns the places of everything at the start of the scene.
fn stance(
    task: &Task<'_>,
    arrangement: &Arrangement,
    contacts: &Contacts,
    faces: &[usize],
    position_m: Vector3<f64>,
) -> Option<Stance> {
    let points: Vec<Vector3<f64>> = task
        .assigned(&arrangement.order)
        .iter()
        .enumerate()
        .map(|(i, facet)| facet.point_m(&super::rolling::of(&contacts.z, i)))
        .collect();
    let inwards: Vec<Vector3<f64>> =
        faces.iter().map(|&face| -task.request.parts.object.shape.faces[face].normal).collect();
    let hand = &task.request.like.hand;
    let radii: Vec<f64> = hand.fingertips.iter().map(|tip| tip.radius_m).collect();
    let indentations = match task.request.like.start.indentation_m {
        Indentation::Metres(indentation) => vec![indentation; task.count],
        Indentation::Equilibrium => {
            let stiffnesses: Vec<f64> = hand.fingertips.iter().map(|tip| tip.stiffness_n_m2).collect();
            let force_n = task.request.like.control.force_n();
            equilibrium_indentations(&points, &inwards, &radii, &stiffnesses, force_n).ok()?
        }
    };
    let centres_m = (0..task.count).map(|i| points[i] - inwards[i] * (radii[i] - indentations[i])).collect();
    Some(Stance {
        position_m,
        attitude: arrangement.attitude,
        faces: faces.to_vec(),
        points_m: points,
        centres_m,
    })
}

fn take(task: &Task<'_>, stance: &Stance) -> Result<f64, Miss> {
    let parts = &task.request.parts;
    let taker = Taker {
        hand: &parts.hand,
        capsules: &parts.capsules,
        pairs: &task.pairs,
        nominal_rad: &task.request.reach.nominal_rad,
        object: &task.object,
        object_radius_m: task.object_radius_m,
    };
    stance::take(&taker, &parts.object.shape, stance)
}

/// The scene of a draft, in numbers that can be read, if its checks agree.
fn placement(task: &Task<'_>, mut draft: Draft) -> Result<Placement, SceneError> {
    if task.request.any_position {
        for round_m in ROUND_M {
            let position_m = draft.stance.position_m.map(|v| rounded(v, round_m));
            let stance = Stance { position_m, ..draft.stance.clone() };
            let full = |room_rad: f64| (room_rad / ROOM_RAD).min(1.0);
            if let (Ok(now), Ok(before)) = (take(task, &stance), take(task, &draft.stance))
                && full(now) >= LITTLE * full(before)
            {
                draft.stance = stance;
                break;
            }
        }
    }
    let stance = &draft.stance;
    let contacts = stance.faces.iter().zip(&stance.points_m).map(|(&face, point)| ContactFile {
        face: Some(face),
        point_m: Some((*point).map(|v| rounded(v, ROUND_POINT_M)).into()),
    });
    let position_m = stance.position_m.into();
    let pose = if task.request.any_attitude {
        PoseFile { position_m, rotation_rpy_rad: None, quaternion_wxyz: quaternion(&stance.attitude) }
    } else {
        PoseFile { position_m, ..task.request.like.pose.clone() }
    };
    let file = SceneFile { pose, contacts: contacts.collect(), ..task.request.like.clone() };
    let scene = Scene::build(file)?;
    let quality = Quality::of(&scene).ok_or_else(|| {
        SceneError::new("contact", "the grasping force would pull a fingertip away from its face", "")
    })?;
    Ok(Placement { scene, quality })
}

/// No quaternion for no rotation.
fn quaternion(attitude: &UnitQuaternion<f64>) -> Option<[f64; 4]> {
    let q = attitude.quaternion();
    (*attitude != UnitQuaternion::identity()).then_some([q.w, q.i, q.j, q.k])
}

/// A number with as few digits as the unit has; never minus zero.
fn rounded(value: f64, unit: f64) -> f64 {
    let per_unit = (1.0 / unit).round();
    (value * per_unit).round() / per_unit + 0.0
}
