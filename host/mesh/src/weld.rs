//! Welding of the triangles' corners that are the same vertex.

use nalgebra::Vector3;
use std::collections::HashMap;

/// The side of a cube, in tolerances. In a larger one more points may stand for others; of a smaller one more points are near
/// a side, so that the cube on the other side has to be looked at as well.
const SIDE: f64 = 8.0;
/// The end of a list.
const END: u32 = u32::MAX;

/// For each point the first of those that stand for all others: one within the tolerance of it (in each coordinate), itself
/// if there is none. Points that stand for others are farther apart than the tolerance.
///
/// Points are sorted into cubes. What is near a point lies in eight of them at most, and in each of these there are 125 at
/// most that stand for others. So it takes `n` steps, wherever the points are.
pub(super) fn weld(points: &[Vector3<f64>], tolerance: f64) -> Vec<u32> {
    // The last that was put into each cube, and for each point the one before it.
    let mut last: HashMap<[i64; 3], u32> = HashMap::with_capacity(points.len());
    let mut before = vec![END; points.len()];
    let side = SIDE * tolerance;
    (0..points.len() as u32)
        .map(|own| {
            let point = points[own as usize];
            let cube = |place: f64| (place / side).floor() as i64;
            let range = |k: usize| cube(point[k] - tolerance)..=cube(point[k] + tolerance);
            for x in range(0) {
                for y in range(1) {
                    for z in range(2) {
                        let mut other = last.get(&[x, y, z]).copied().unwrap_or(END);
                        while other != END {
                            if (points[other as usize] - point).amax() <= tolerance {
                                return other;
                            }
                            other = before[other as usize];
                        }
                    }
                }
            }
            let home = [point.x, point.y, point.z].map(cube);
            before[own as usize] = last.insert(home, own).unwrap_or(END);
            own
        })
        .collect()
}

/// Points without those that are bit for bit the same as another before, and for each its place among them.
pub(super) fn distinct(points: impl Iterator<Item = Vector3<f64>>) -> (Vec<Vector3<f64>>, Vec<usize>) {
    let mut places: HashMap<[u64; 3], usize> = HashMap::new();
    let mut kept = Vec::new();
    let place = points
        .map(|point| {
            // Zero has two signs.
            let key = [point.x, point.y, point.z].map(|v| (v + 0.0).to_bits());
            *places.entry(key).or_insert_with(|| {
                kept.push(point);
                kept.len() - 1
            })
        })
        .collect();
    (kept, place)
}
