//! The convex hull of a few points, by looking at every plane through three of them.

use super::PolyhedronError;
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;
use std::collections::HashMap;

/// A point counts as lying in a plane or on a line when it is closer than this, in units of the body's extent.
const FLAT: f64 = 1e-9;
/// A body is flat when it is thinner than this, in units of its extent.
const THIN: f64 = 1e-6;

/// Vertices, and faces as loops of vertices.
type Hull = (Vec<Vector3<f64>>, Vec<Vec<usize>>);

/// Vertices of the hull and its faces as loops of vertices, counter-clockwise seen from outside.
///
/// The points are finite, distinct, and at most 128.
pub(super) fn faces(points: &[Vector3<f64>]) -> Result<Hull, PolyhedronError> {
    let scale = points.iter().map(|p| (p - points[0]).amax()).fold(0.0, f64::max);
    let unit: Vec<Vector3<f64>> = points.iter().map(|p| (p - points[0]) / scale).collect();
    if !unit.iter().all(|p| p.iter().all(|v| v.is_finite())) || is_flat(&unit) {
        return Err(PolyhedronError::NoVolume);
    }
    let mut loops: Vec<Vec<usize>> = Vec::new();
    // Points of the faces found so far, one bit a point.
    let mut found: Vec<u128> = Vec::new();
    for i in 0..unit.len() {
        for j in i + 1..unit.len() {
            for k in j + 1..unit.len() {
                let triple = (1u128 << i) | (1 << j) | (1 << k);
                if found.iter().any(|face| face & triple == triple) {
                    continue;
                }
                let Some((normal, members)) = supporting_plane(&unit, i, j, k) else { continue };
                found.push(members);
                loops.push(outline(&unit, members, &normal));
            }
        }
    }
    // Where rounding decides, two planes may claim the same points; then the faces do not fit together.
    if !is_closed(&loops) {
        return Err(PolyhedronError::Unclear);
    }
    Ok(renumber(points, loops))
}

/// Returns `true` if all points lie in one plane, nearly.
fn is_flat(points: &[Vector3<f64>]) -> bool {
    let farthest = |distance: &dyn Fn(&Vector3<f64>) -> f64| {
        points.iter().max_by(|a, b| distance(a).total_cmp(&distance(b))).copied().unwrap_or_default()
    };
    let origin = points[0];
    let along = (farthest(&|p| (p - origin).norm_squared()) - origin).normalize();
    let off_line = |p: &Vector3<f64>| (p - origin) - along * along.dot(&(p - origin));
    let across = off_line(&farthest(&|p| off_line(p).norm_squared()));
    if !(norm(&across) > THIN) {
        return true;
    }
    let normal = along.cross(&across.normalize());
    !(points.iter().any(|p| normal.dot(&(p - origin)).abs() > THIN))
}

/// The outward normal of the plane through three points, and the points in it, if all other points are on one side.
fn supporting_plane(points: &[Vector3<f64>], i: usize, j: usize, k: usize) -> Option<(Vector3<f64>, u128)> {
    let (a, b, c) = (points[i], points[j], points[k]);
    let area = (b - a).cross(&(c - a));
    let longest = (b - a).norm_squared().max((c - a).norm_squared()).max((c - b).norm_squared());
    // Points on one line span no plane, and a sliver spans one badly: another triple of the face does better.
    if !(norm(&area) > 1e-6 * longest) {
        return None;
    }
    let mut normal = area / norm(&area);
    let mut side = 0.0;
    let mut members = 0u128;
    for (bit, p) in points.iter().enumerate() {
        let height = normal.dot(&(p - a));
        if height.abs() <= FLAT {
            members |= 1 << bit;
        } else if side * height < 0.0 {
            return None;
        } else {
            side = height;
        }
    }
    if side > 0.0 {
        normal = -normal;
    }
    Some((normal, members))
}

/// Corners of a face, counter-clockwise about its normal: the points of the plane without those inside or on an edge.
fn outline(points: &[Vector3<f64>], members: u128, normal: &Vector3<f64>) -> Vec<usize> {
    let members: Vec<usize> = (0..points.len()).filter(|k| members & (1 << k) != 0).collect();
    // Gift wrapping. Start at the point farthest in some direction of the plane; of several, the farthest across it.
    let helper = if normal.x.abs() < 0.6 { Vector3::x() } else { Vector3::y() };
    let across = helper.cross(normal).normalize();
    let along = normal.cross(&across);
    let start = members.iter().copied().max_by(|&a, &b| {
        let (a, b) = (points[a], points[b]);
        let lead = along.dot(&(a - b));
        if lead.abs() > FLAT { lead.total_cmp(&0.0) } else { across.dot(&(a - b)).total_cmp(&0.0) }
    });
    let Some(start) = start else { return Vec::new() };
    let mut corners = vec![start];
    loop {
        let here = corners[corners.len() - 1];
        let mut next: Option<usize> = None;
        for &candidate in members.iter().filter(|&&k| k != here) {
            let Some(best) = next else {
                next = Some(candidate);
                continue;
            };
            let (to_best, to_candidate) = (points[best] - points[here], points[candidate] - points[here]);
            // Right of the line to the best so far: everything else has to be on its left.
            let left = normal.dot(&to_best.cross(&to_candidate)) / norm(&to_best);
            let farther = to_candidate.norm_squared() > to_best.norm_squared();
            if left < -FLAT || (left <= FLAT && farther) {
                next = Some(candidate);
            }
        }
        match next {
            Some(next) if next != start && corners.len() < members.len() => corners.push(next),
            _ => return corners,
        }
    }
}

/// Returns `true` if every edge belongs to exactly two faces, which run along it in opposite directions, and Euler's
/// formula holds.
fn is_closed(loops: &[Vec<usize>]) -> bool {
    let mut edges: HashMap<(usize, usize), usize> = HashMap::new();
    for corners in loops {
        if corners.len() < 3 {
            return false;
        }
        for (&from, &to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
            *edges.entry((from, to)).or_default() += 1;
        }
    }
    let mut vertices: Vec<usize> = loops.iter().flatten().copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    edges.iter().all(|(&(from, to), &count)| count == 1 && edges.contains_key(&(to, from)))
        && vertices.len() + loops.len() == edges.len() / 2 + 2
}

/// Keeps the points that are corners.
fn renumber(points: &[Vector3<f64>], mut loops: Vec<Vec<usize>>) -> Hull {
    let mut vertices = Vec::new();
    let mut place = vec![None; points.len()];
    for corner in loops.iter_mut().flatten() {
        *corner = *place[*corner].get_or_insert_with(|| {
            vertices.push(points[*corner]);
            vertices.len() - 1
        });
    }
    (vertices, loops)
}
