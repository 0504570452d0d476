//! Positions of the object from which every fingertip gets to its contact: the cells of the [reach](super::reach) that
//! all fingertips leave over, each moved back by where its contact is on the object.

use super::reach::{CELLS, Cell, Reach};
use blindgrasp_body::MAX_FINGERS;
use nalgebra::Vector3;

/// A fingertip's contact in the axes of the base frame.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Target {
    /// Position of the fingertip's centre from the object's centre of mass, m.
    pub(super) offset_m: Vector3<f64>,
    /// `C_Y`: into the object.
    pub(super) inward: Vector3<f64>,
}

/// A fingertip touches with the half that looks away from its finger: the cosine of the angle between the bone and the
/// inward normal is at least this. A little less on the map, whose postures are nearly those of the inverse kinematics.
pub(super) const FACING: f64 = 0.0;
const NEARLY_FACING: f32 = -0.25;
/// Joints that have this much room have enough, rad: there the soft end stops begin.
pub(super) const ROOM_RAD: f64 = 0.1;
/// Positions that are proposed are at least so many cells apart.
const APART: i32 = 3;

/// Positions of the object at which all fingertips get to their contacts, the most comfortable first: at most `count`, apart
/// from each other.
pub(super) fn propose(reach: &Reach, targets: &[Target], count: usize) -> Vec<Vector3<f64>> {
    let mut found: Vec<(f64, Cell)> = Vec::new();
    for_common(reach, targets, |cell| {
        if let Some(comfort) = comfort(reach, targets, &cell) {
            found.push((comfort, cell));
        }
    });
    found.sort_by(|a, b| b.0.total_cmp(&a.0).then_with(|| a.1.as_slice().cmp(b.1.as_slice())));
    let mut proposals: Vec<Cell> = Vec::new();
    for (_, cell) in found {
        if proposals.iter().all(|other| (other - cell).amax() >= APART) {
            proposals.push(cell);
            if proposals.len() == count {
                break;
            }
        }
    }
    proposals.iter().map(|cell| reach.middle_m(cell)).collect()
}

/// Returns `true` if all fingertips may get to their contacts with the object in a given position, by the map, which
/// has holes.
pub(super) fn near(reach: &Reach, targets: &[Target], position_m: &Vector3<f64>) -> bool {
    targets.iter().enumerate().all(|(i, target)| {
        let cell = reach.cell(&(position_m + target.offset_m));
        let around =
            (-1..=1).flat_map(|x| (-1..=1).flat_map(move |y| (-1..=1).map(move |z| Cell::new(x, y, z))));
        around.into_iter().any(|step| reach.spot(i, &(cell + step)).is_some())
    })
}

/// Calls `take` for every cell of the object's centre of mass that puts all fingertips into cells of theirs.
fn for_common(reach: &Reach, targets: &[Target], mut take: impl FnMut(Cell)) {
    let mut steps = [Cell::zeros(); MAX_FINGERS];
    for (steps, target) in steps.iter_mut().zip(targets) {
        *steps = reach.steps(&target.offset_m);
    }
    // The object may be outside of the grid: its cells count from the first fingertip's.
    let (first, size) = (steps[0], CELLS as i32);
    for z in 0..size {
        for y in 0..size {
            let mut word = reach.rows(0)[(z * size + y) as usize];
            for i in 1..targets.len() {
                if word == 0 {
                    break;
                }
                let shift = steps[i] - first;
                let (row_y, row_z) = (y + shift.y, z + shift.z);
                let inside = (0..size).contains(&row_y) && (0..size).contains(&row_z);
                let row = if inside { reach.rows(i)[(row_z * size + row_y) as usize] } else { 0 };
                word &= match shift.x {
                    0..64 => row >> shift.x,
                    -63..0 => row << -shift.x,
                    _ => 0,
                };
            }
            while word != 0 {
                let x = word.trailing_zeros() as i32;
                word &= word - 1;
                take(Cell::new(x, y, z) - first);
            }
        }
    }
}

/// Returns how comfortable it is to hold the object with its centre of mass in a cell: enough room before the end stops
/// counts most, then nearness to the nominal posture. `None` where a fingertip does not get, or only with its back.
fn comfort(reach: &Reach, targets: &[Target], cell: &Cell) -> Option<f64> {
    let (mut room, mut far) = (ROOM_RAD, 0.0);
    for (i, target) in targets.iter().enumerate() {
        let spot = reach.spot(i, &(cell + reach.steps(&target.offset_m)))?;
        if spot.bone.dot(&target.inward.map(|v| v as f32)) < NEARLY_FACING && spot.bone != Vector3::zeros() {
            return None;
        }
        room = room.min(f64::from(spot.room_rad));
        far += f64::from(spot.from_nominal_rad2);
    }
    Some(room / ROOM_RAD - 0.05 * far / targets.len() as f64)
}
