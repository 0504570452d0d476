//! Cuts polygons into triangles by taking off ears.
//!
//! Every corner stays a corner, also one on a straight edge: where a neighbour has a vertex there, the surface would be
//! open otherwise. (Libraries for drawing leave such corners out.)

use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// The corners of triangles that make up a polygon, as indices, turned as the polygon is. It may be a little off a plane; what
/// crosses itself is cut in some way. `None` when that takes more looks at other corners than are left.
pub(super) fn triangles(corners: &[Vector3<f64>], looks: &mut u64) -> Option<Vec<[usize; 3]>> {
    let plane = project(corners);
    let mut left: Vec<usize> = (0..corners.len()).collect();
    let mut triangles = Vec::with_capacity(corners.len().saturating_sub(2));
    // Go on where the last ear was taken off: the first that fits would make a fan of slivers.
    let mut at = 0;
    while left.len() > 3 {
        let count = left.len();
        // Where none is an ear, what is left is degenerate or crosses itself: any will do.
        let mut ear = at % count;
        for k in (0..count).map(|k| (at + k) % count) {
            *looks = looks.checked_sub(count as u64)?;
            if is_ear(&plane, &left, k) {
                ear = k;
                break;
            }
        }
        triangles.push([left[(ear + count - 1) % count], left[ear], left[(ear + 1) % count]]);
        left.remove(ear);
        at = ear + 1;
    }
    if let [a, b, c] = left[..] {
        triangles.push([a, b, c]);
    }
    Some(triangles)
}

/// Coordinates in the plane that fits best, in which the polygon is counter-clockwise.
fn project(corners: &[Vector3<f64>]) -> Vec<[f64; 2]> {
    let first = corners.first().copied().unwrap_or_default();
    let area = corners
        .windows(2)
        .fold(Vector3::zeros(), |sum: Vector3<f64>, pair| sum + (pair[0] - first).cross(&(pair[1] - first)));
    let length = norm(&area);
    let normal = if length > 0.0 { area / length } else { Vector3::z() };
    let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let across = helper.cross(&normal);
    let x = across / norm(&across);
    let y = normal.cross(&x);
    corners.iter().map(|corner| corner - first).map(|corner| [x.dot(&corner), y.dot(&corner)]).collect()
}

/// Returns `true` if corner `k` of what is left turns left, and no other corner lies in the triangle that it makes with
/// its neighbours.
fn is_ear(plane: &[[f64; 2]], left: &[usize], k: usize) -> bool {
    let count = left.len();
    let [a, b, c] = [k + count - 1, k, k + 1].map(|k| plane[left[k % count]]);
    if !(turn(a, b, c) > 0.0) {
        return false;
    }
    // Corners in the same place as one of the three are no obstacle: a polygon with a hole runs along a seam twice.
    left.iter()
        .map(|&k| plane[k])
        .filter(|&p| p != a && p != b && p != c)
        .all(|p| turn(a, b, p) < 0.0 || turn(b, c, p) < 0.0 || turn(c, a, p) < 0.0)
}

/// Twice the area of a triangle, positive if it is counter-clockwise.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}
