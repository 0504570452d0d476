//! Which corners of triangles are the same vertex.

use nalgebra::Vector3;
use std::collections::HashMap;

/// For each point the first of those that stand for all others: one within the tolerance of it (per coordinate), itself if there is
/// none. Points that stand for others are farther apart than the tolerance.
///
/// Points are sorted into cubes of twice the tolerance; what is near a point lies in eight of them at most, and in each of
/// these there are eight at most that stand for others. So it takes `n` steps, wherever the points are.
pub(super) fn weld(points: &[Vector3<f64>], tolerance: f64) -> Vec<u32> {
    let mut cubes: HashMap<[i64; 3], Vec<u32>> = HashMap::with_capacity(points.len());
    let near = |a: u32, b: u32| (points[a as usize] - points[b as usize]).amax() <= tolerance;
    let side = 2.0 * tolerance;
    (0..points.len() as u32)
        .map(|own| {
            let place = points[own as usize] / side;
            let home = place.map(f64::floor);
            // The cubes on the sides of its own to which it is nearer.
            let step = (place - home).map(|share| if share < 0.5 { -1.0 } else { 1.0 });
            let found = (0..8).find_map(|bits| {
                let at =
                    Vector3::from_fn(|k, _| if bits & (1 << k) == 0 { home[k] } else { home[k] + step[k] });
                let cube = cubes.get(&[at.x as i64, at.y as i64, at.z as i64])?;
                cube.iter().copied().find(|&other| near(own, other))
            });
            found.unwrap_or_else(|| {
                cubes.entry([home.x as i64, home.y as i64, home.z as i64]).or_default().push(own);
                own
            })
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
