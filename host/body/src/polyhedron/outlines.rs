//! The outlines of the faces of a mesh.
//!
//! The rim of a face is followed along the half-edges that have another face on their other side. Where the rim touches
//! itself in a vertex, the way on is found by turning around the vertex within the face, so that outlines touch but never
//! cross. Vertices in the middle of a straight edge between two faces are no corners; whether an edge is straight is decided
//! once for both faces, so that their outlines agree.

use super::Flatness;
use super::regions::Regions;
use super::surface::{Survey, end, next, origin};
use blindgrasp_shared::math::norm;
use nalgebra::Vector3;

/// An edge between two faces counts as straight when its vertices are this close to the line from end to end, in units of
/// the distance that a face may be off its plane: both planes are off in the worst case.
const STRAIGHT: f64 = 4.0;
/// Number of times that an edge that is not straight is cut in two. What is left after that keeps all of its vertices.
const CUTS: usize = 12;

/// Corners of the outer outline, counter-clockwise seen from outside, and of the holes.
pub(super) type Outline = (Vec<usize>, Vec<Vec<usize>>);

/// Follows the rims of all faces.
pub(super) fn outlines(
    vertices_m: &[Vector3<f64>],
    triangles: &[[usize; 3]],
    survey: &Survey,
    flatness: &Flatness,
    regions: &Regions,
) -> Vec<Outline> {
    let rims = Rims { triangles, survey, face_of: &regions.face_of };
    let loops = rims.loops();
    let corners = rims.corners(vertices_m, &loops, STRAIGHT * flatness.distance_m);
    let mut outlines: Vec<Vec<(f64, Vec<usize>)>> = vec![Vec::new(); regions.planes.len()];
    for rim in &loops {
        let face = rims.face(rim[0]);
        let outline: Vec<usize> =
            rim.iter().filter(|&&half| corners[half as usize]).map(|&half| origin(triangles, half)).collect();
        let first = vertices_m[outline[0]];
        let twice_area = outline.windows(2).fold(0.0, |sum, pair| {
            let (a, b) = (vertices_m[pair[0]] - first, vertices_m[pair[1]] - first);
            sum + a.cross(&b).dot(&regions.planes[face].0)
        });
        outlines[face].push((twice_area, outline));
    }
    outlines
        .into_iter()
        .map(|mut outlines| {
            // The outer one is around all others; of equal ones the first.
            let outer = (0..outlines.len()).rev().max_by(|&a, &b| outlines[a].0.total_cmp(&outlines[b].0));
            let corners = outer.map_or(Vec::new(), |outer| outlines.remove(outer).1);
            (corners, outlines.into_iter().map(|(_, hole)| hole).collect())
        })
        .collect()
}

struct Rims<'a> {
    triangles: &'a [[usize; 3]],
    survey: &'a Survey,
    face_of: &'a [u32],
}

impl Rims<'_> {
    fn face(&self, half: u32) -> usize {
        self.face_of[half as usize / 3] as usize
    }

    fn twin(&self, half: u32) -> u32 {
        self.survey.twins[half as usize]
    }

    fn is_rim(&self, half: u32) -> bool {
        self.face(half) != self.face(self.twin(half))
    }

    /// The half-edge of the rim after this one.
    fn after(&self, half: u32) -> u32 {
        let mut half = next(half);
        while !self.is_rim(half) {
            half = next(self.twin(half));
        }
        half
    }

    /// All rims, each beginning with its lowest half-edge.
    fn loops(&self) -> Vec<Vec<u32>> {
        let mut seen = vec![false; self.survey.twins.len()];
        let mut loops = Vec::new();
        for start in 0..seen.len() as u32 {
            if seen[start as usize] || !self.is_rim(start) {
                continue;
            }
            let mut rim = Vec::new();
            let mut half = start;
            while !std::mem::replace(&mut seen[half as usize], true) {
                rim.push(half);
                half = self.after(half);
            }
            loops.push(rim);
        }
        loops
    }

    /// Returns `true` if an edge goes on past the end of a half-edge of the rim: the same two faces on both sides, and
    /// nothing else there, whichever of the two faces one asks.
    fn goes_on(&self, half: u32) -> bool {
        let after = self.after(half);
        self.face(self.twin(half)) == self.face(self.twin(after))
            && self.after(self.twin(after)) == self.twin(half)
    }

    /// For each half-edge of the rims, whether its outline has a corner where it begins.
    fn corners(&self, vertices_m: &[Vector3<f64>], loops: &[Vec<u32>], tolerance_m: f64) -> Vec<bool> {
        let mut corners = vec![true; self.survey.twins.len()];
        for rim in loops {
            // Begin where an edge begins. A rim between two faces alone has no such place, and keeps all of its corners.
            let begins = |k: &usize| !self.goes_on(rim[(k + rim.len() - 1) % rim.len()]);
            let Some(start) = (0..rim.len()).find(begins) else { continue };
            let turned: Vec<u32> = (0..rim.len()).map(|k| rim[(start + k) % rim.len()]).collect();
            for edge in turned.chunk_by(|&half, _| self.goes_on(half)) {
                // Once for both faces.
                if edge.len() > 1 && self.face(edge[0]) < self.face(self.twin(edge[0])) {
                    let mut points: Vec<Vector3<f64>> =
                        edge.iter().map(|&half| vertices_m[origin(self.triangles, half)]).collect();
                    points.push(vertices_m[end(self.triangles, edge[edge.len() - 1])]);
                    let kept = bends(&points, tolerance_m);
                    for k in (1..edge.len()).filter(|&k| !kept[k]) {
                        corners[edge[k] as usize] = false;
                        corners[self.twin(edge[k - 1]) as usize] = false;
                    }
                }
            }
        }
        // What would have two corners or fewer keeps all; and so do its neighbours.
        for rim in loops {
            if rim.iter().filter(|&&half| corners[half as usize]).count() < 3 {
                for (&before, &half) in rim.iter().cycle().zip(rim.iter().cycle().skip(1)).take(rim.len()) {
                    corners[half as usize] = true;
                    corners[self.twin(before) as usize] = true;
                }
            }
        }
        corners
    }
}

/// Returns the points of a line that stay within a tolerance of all of them (Ramer, Douglas and Peucker).
fn bends(points: &[Vector3<f64>], tolerance_m: f64) -> Vec<bool> {
    let mut kept = vec![false; points.len()];
    let mut waiting = vec![(0, points.len() - 1, 0)];
    while let Some((from, to, depth)) = waiting.pop() {
        (kept[from], kept[to]) = (true, true);
        let along = points[to] - points[from];
        let length = norm(&along);
        let off = |k: usize| {
            let from_start = points[k] - points[from];
            if length > 0.0 { norm(&along.cross(&from_start)) / length } else { norm(&from_start) }
        };
        let Some((farthest, distance)) =
            (from + 1..to).map(|k| (k, off(k))).max_by(|a, b| a.1.total_cmp(&b.1))
        else {
            continue;
        };
        if distance <= tolerance_m {
            continue;
        }
        if depth == CUTS {
            kept[from..=to].fill(true);
        } else {
            waiting.extend([(from, farthest, depth + 1), (farthest, to, depth + 1)]);
        }
    }
    kept
}
