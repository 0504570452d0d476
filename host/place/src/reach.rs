//! The reach of a hand's fingertips, sampled once for a hand: for every cell of a grid in the base frame, and for each
//! fingertip, the posture nearest to the nominal one that was seen there.
//!
//! The samples are spread evenly over the ranges of the joints that move a fingertip alone, by an additive recurrence with
//! the powers of the generalised golden ratio (M. Roberts' R sequence): the same on every machine. Joints that move several
//! fingertips (a trunk) stay where they are.

use blindgrasp_body::inverse_kinematics::own_joints;
use blindgrasp_body::{Hand, MAX_FINGERS, MAX_JOINTS, Posture};
use blindgrasp_model::{Parts, SceneError, SceneFile};
use nalgebra::Vector3;

/// Samples: enough that a finger of four joints leaves few holes in the middle of its reach.
const SAMPLES: usize = 1 << 17;
/// Of these, how many find out how large the grid has to be.
const SCOUTS: usize = 1 << 12;
/// Cells along each axis. A row of the grid is a word.
pub(super) const CELLS: usize = 64;
/// A cell without a sample.
const EMPTY: u32 = u32::MAX;

/// The posture that is remembered for a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Spot {
    /// Square of the distance from the nominal posture, rad^2.
    pub(super) from_nominal_rad2: f32,
    /// Of all joints that move the fingertip alone, the least distance from an end stop, rad.
    pub(super) room_rad: f32,
    /// Unit vector from the last joint to the fingertip's centre; zero where they coincide.
    pub(super) bone: Vector3<f32>,
}

/// The reach of one fingertip.
#[derive(Clone, Debug)]
struct Map {
    /// A bit a cell, a word a row along x; by `z * CELLS + y`.
    rows: Vec<u64>,
    /// Index of its spot for each cell.
    at: Vec<u32>,
    spots: Vec<Spot>,
}

/// The reach of a hand's fingertips.
#[derive(Clone, Debug)]
pub struct Reach {
    /// Angles that the trunk's joints keep, and that the inverse kinematics stays near, rad.
    pub(super) nominal_rad: Vec<f64>,
    /// The corner of the grid, m.
    pub(super) corner_m: Vector3<f64>,
    /// Edge of a cell, m.
    pub(super) cell_m: f64,
    maps: Vec<Map>,
    /// The largest distance between the centres of two fingertips that was seen, m, by fingertip and fingertip.
    pub(super) farthest_m: [[f64; MAX_FINGERS]; MAX_FINGERS],
}

/// A cell of the grid: also outside of it.
pub(super) type Cell = Vector3<i32>;

impl Reach {
    /// Samples the reach of a hand around its nominal posture. It takes about a tenth of a second.
    pub fn of(hand: &Hand, nominal_rad: &[f64]) -> Self {
        let count = hand.fingertip_count();
        let sampler = Sampler::new(hand, nominal_rad);
        let mut posture = Posture::at_base();
        let (mut low, mut high) = (Vector3::repeat(f64::INFINITY), Vector3::repeat(f64::NEG_INFINITY));
        let mut scouts = Vec::with_capacity(SCOUTS);
        for index in 0..SCOUTS {
            hand.forward_kinematics(&sampler.angles(index), &mut posture);
            for centre in &posture.centres_m[..count] {
                low = low.inf(centre);
                high = high.sup(centre);
            }
            scouts.push(posture.centres_m);
        }
        // A cell to spare on each side: few samples come near the very ends.
        let cell_m = (high - low).max() / (CELLS - 3) as f64;
        let corner_m = (low + high) / 2.0 - Vector3::repeat(cell_m * CELLS as f64 / 2.0);
        let empty = Map { rows: vec![0; CELLS * CELLS], at: vec![EMPTY; CELLS.pow(3)], spots: Vec::new() };
        let mut reach = Self {
            nominal_rad: nominal_rad.to_vec(),
            corner_m,
            cell_m,
            maps: vec![empty; count],
            farthest_m: farthest(&scouts, count),
        };
        for index in 0..SAMPLES {
            let angles = sampler.angles(index);
            hand.forward_kinematics(&angles, &mut posture);
            for i in 0..count {
                let cell = reach.cell(&posture.centres_m[i]);
                let last = posture.link(hand.fingertip_link(i)).origin_m;
                let bone = (posture.centres_m[i] - last).try_normalize(1e-9).unwrap_or_default();
                let (room, far) = sampler.measure(i, &angles);
                let spot = Spot {
                    from_nominal_rad2: far as f32,
                    room_rad: room as f32,
                    bone: bone.map(|v| v as f32),
                };
                reach.maps[i].add(&cell, spot);
            }
        }
        reach
    }

    /// Of the hand of a scene, with the trunk where the scene has it.
    ///
    /// # Errors
    /// An angle of the trunk that can't be.
    pub fn of_scene(file: &SceneFile, parts: &Parts) -> Result<Self, SceneError> {
        Ok(Self::of(&parts.hand, &file.nominal_rad(&parts.hand)?))
    }

    /// The cell that a point lies in.
    pub(super) fn cell(&self, point_m: &Vector3<f64>) -> Cell {
        ((point_m - self.corner_m) / self.cell_m).map(|v| v.floor() as i32)
    }

    /// A whole number of cells, the nearest to a vector.
    pub(super) fn steps(&self, vector_m: &Vector3<f64>) -> Cell {
        (vector_m / self.cell_m).map(|v| v.round() as i32)
    }

    /// The middle of a cell, m.
    pub(super) fn middle_m(&self, cell: &Cell) -> Vector3<f64> {
        self.corner_m + cell.map(|v| f64::from(v) + 0.5) * self.cell_m
    }

    /// The cells of a fingertip, a word for each row along x.
    pub(super) fn rows(&self, fingertip: usize) -> &[u64] {
        &self.maps[fingertip].rows
    }

    /// Returns the data of a fingertip in a cell.
    pub(super) fn spot(&self, fingertip: usize, cell: &Cell) -> Option<&Spot> {
        let map = &self.maps[fingertip];
        index(cell).and_then(|at| map.spots.get(map.at[at] as usize))
    }
}

impl Map {
    fn add(&mut self, cell: &Cell, spot: Spot) {
        let Some(at) = index(cell) else { return };
        match self.spots.get_mut(self.at[at] as usize) {
            Some(known) if known.from_nominal_rad2 <= spot.from_nominal_rad2 => {}
            Some(known) => *known = spot,
            None => {
                self.at[at] = self.spots.len() as u32;
                self.spots.push(spot);
                self.rows[at / CELLS] |= 1 << (at % CELLS);
            }
        }
    }
}

/// The index of a cell inside the grid.
fn index(cell: &Cell) -> Option<usize> {
    let inside = cell.iter().all(|&v| (0..CELLS as i32).contains(&v));
    inside.then(|| (cell.z as usize * CELLS + cell.y as usize) * CELLS + cell.x as usize)
}

/// The largest distances between fingertips. Those of different fingers move independently: any of the one goes with any of
/// the other.
fn farthest(scouts: &[[Vector3<f64>; MAX_FINGERS]], count: usize) -> [[f64; MAX_FINGERS]; MAX_FINGERS] {
    // The two farthest points of two sets are nearly extreme in some direction.
    let directions: Vec<Vector3<f64>> = super::attitude::directions(96);
    let mut farthest = [[0.0; MAX_FINGERS]; MAX_FINGERS];
    for direction in &directions {
        let mut extremes = [(0, 0); MAX_FINGERS];
        for i in 0..count {
            let along = |k: &usize| scouts[*k][i].dot(direction);
            let by = |a: &usize, b: &usize| along(a).total_cmp(&along(b));
            let range = 0..scouts.len();
            extremes[i] = (range.clone().min_by(by).unwrap_or(0), range.max_by(by).unwrap_or(0));
        }
        for i in 0..count {
            for j in 0..count {
                let distance = (scouts[extremes[i].1][i] - scouts[extremes[j].0][j]).norm();
                farthest[i][j] = f64::max(farthest[i][j], distance);
                farthest[j][i] = farthest[i][j];
            }
        }
    }
    farthest
}

/// Joint angles spread evenly over their ranges.
struct Sampler<'a> {
    hand: &'a Hand,
    nominal: [f64; MAX_JOINTS],
    /// The joints that move each fingertip alone.
    own: Vec<Vec<usize>>,
    /// The steps of each of a finger's joints from sample to sample, as fractions, by the number of joints.
    strides: Vec<Vec<f64>>,
}

impl<'a> Sampler<'a> {
    fn new(hand: &'a Hand, nominal_rad: &[f64]) -> Self {
        let mut nominal = [0.0; MAX_JOINTS];
        for (nominal, angle) in nominal.iter_mut().zip(nominal_rad) {
            *nominal = *angle;
        }
        let own: Vec<Vec<usize>> = (0..hand.fingertip_count()).map(|i| own_joints(hand, i)).collect();
        let strides = own.iter().map(|joints| strides(joints.len())).collect();
        Self { hand, nominal, own, strides }
    }

    fn angles(&self, index: usize) -> [f64; MAX_JOINTS] {
        let mut angles = self.nominal;
        for (joints, strides) in self.own.iter().zip(&self.strides) {
            for (&k, stride) in joints.iter().zip(strides) {
                let (lower, upper) = self.hand.range_rad(k);
                angles[k] = lower + (upper - lower) * (0.5 + index as f64 * stride).fract();
            }
        }
        angles
    }

    /// The least distance of a fingertip's own joints from their end stops (rad), and the square of the distance from the
    /// nominal posture (rad^2).
    fn measure(&self, fingertip: usize, angles: &[f64; MAX_JOINTS]) -> (f64, f64) {
        let (mut room, mut far) = (f64::INFINITY, 0.0);
        for &k in &self.own[fingertip] {
            let (lower, upper) = self.hand.range_rad(k);
            room = f64::min(room, f64::min(angles[k] - lower, upper - angles[k]));
            far += (angles[k] - self.nominal[k]) * (angles[k] - self.nominal[k]);
        }
        (room, far)
    }
}

/// Powers of `1 / g`, where `g^(n + 1) = g + 1`.
fn strides(count: usize) -> Vec<f64> {
    let mut ratio: f64 = 2.0;
    for _ in 0..40 {
        // Newton's method; the root is between 1 and 2.
        let power = ratio.powi(count as i32);
        ratio -= (power * ratio - ratio - 1.0) / ((count + 1) as f64 * power - 1.0);
    }
    (1..=count as i32).map(|k| ratio.powi(-k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_model::Scene;
    use blindgrasp_shared::math::Real;

    #[test]
    fn strides_are_those_of_the_golden_ratio() {
        let one = strides(1)[0];
        assert!((one - (5.0_f64.square_root() - 1.0) / 2.0).abs() < 1e-15);
        let two = strides(2);
        assert!((two[0] - 0.754_877_666_246_692_8).abs() < 1e-14 && (two[1] - two[0] * two[0]).abs() < 1e-15);
    }

    /// Wherever some posture gets, the map says so, but for cells at the rim.
    #[test]
    fn what_is_reached_is_on_the_map() {
        let scene = Scene::load("prism", &[]).unwrap();
        let nominal: Vec<f64> = scene.file.hand.joints.iter().map(|joint| joint.nominal_rad).collect();
        let reach = Reach::of(&scene.hand, &nominal);
        let mut random = fastrand::Rng::with_seed(5);
        let (mut seen, mut inner, mut total) = (0, 0, 0);
        for _ in 0..2000 {
            let mut angles = [0.0; MAX_JOINTS];
            for (k, angle) in angles.iter_mut().enumerate().take(12) {
                let (lower, upper) = scene.hand.range_rad(k);
                *angle = lower + (upper - lower) * (0.1 + 0.8 * random.f64());
            }
            let mut posture = Posture::at_base();
            scene.hand.forward_kinematics(&angles, &mut posture);
            for i in 0..3 {
                let cell = reach.cell(&posture.centres_m[i]);
                total += 1;
                seen += usize::from(reach.spot(i, &cell).is_some());
                let word = reach.rows(i)[cell.z as usize * CELLS + cell.y as usize];
                assert_eq!(word >> cell.x & 1 == 1, reach.spot(i, &cell).is_some());
                inner += usize::from((0..3).all(|axis| {
                    let mut next = cell;
                    next[axis] += 1;
                    reach.spot(i, &next).is_some()
                }));
            }
        }
        println!("of {total} fingertips {seen} are on the map, {inner} with their neighbours");
        assert!(seen as f64 > 0.98 * total as f64, "{seen} of {total}");
    }
}
