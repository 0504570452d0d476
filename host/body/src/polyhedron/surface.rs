//! The surface of a mesh: which edges its triangles share, and whether they enclose a body.
//!
//! Half-edge `3 t + k` is the edge of triangle `t` that runs from its corner `k` to the next. Everything is found by sorting
//! half-edges, in `n log n`.

use super::error::MeshFault;
use nalgebra::Vector3;

/// No half-edge.
pub const NONE: u32 = u32::MAX;

/// The edges of a mesh.
#[derive(Clone, Debug, Default)]
pub struct Survey {
    /// For each half-edge the one on the other side of the same edge, whichever way it runs; [`NONE`] where that is not
    /// exactly one.
    pub twins: Vec<u32>,
    /// Half-edges without another on their edge.
    pub open: Vec<u32>,
    /// The first three half-edges of edges that have more than two.
    pub crowded: Vec<[u32; 3]>,
}

/// Returns the vertex where a half-edge begins.
pub fn origin(triangles: &[[usize; 3]], half: u32) -> usize {
    triangles[half as usize / 3][half as usize % 3]
}

/// Returns the vertex where a half-edge ends.
pub fn end(triangles: &[[usize; 3]], half: u32) -> usize {
    origin(triangles, next(half))
}

/// The half-edge after this one in its triangle.
pub fn next(half: u32) -> u32 {
    if half % 3 == 2 { half - 2 } else { half + 1 }
}

/// Looks at all edges. The corners of a triangle are three different vertices.
pub fn survey(triangles: &[[usize; 3]]) -> Survey {
    let mut halves: Vec<(u32, u32, u32)> = (0..3 * triangles.len() as u32)
        .map(|half| {
            let (a, b) = (origin(triangles, half) as u32, end(triangles, half) as u32);
            (a.min(b), a.max(b), half)
        })
        .collect();
    halves.sort_unstable();
    let mut survey = Survey { twins: vec![NONE; halves.len()], ..Survey::default() };
    for edge in halves.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        match *edge {
            [(_, _, half)] => survey.open.push(half),
            [(_, _, a), (_, _, b)] => {
                survey.twins[a as usize] = b;
                survey.twins[b as usize] = a;
            }
            [(_, _, a), (_, _, b), (_, _, c), ..] => survey.crowded.push([a, b, c]),
            [] => {}
        }
    }
    // In the order of the triangles, not of the vertices.
    survey.open.sort_unstable();
    survey.crowded.sort_unstable();
    survey
}

impl Survey {
    /// The first triangle of each separate part of the surface.
    pub(crate) fn parts(&self) -> Vec<usize> {
        let mut seen = vec![false; self.twins.len() / 3];
        let mut firsts = Vec::new();
        let mut waiting = Vec::new();
        for first in 0..seen.len() {
            if seen[first] {
                continue;
            }
            seen[first] = true;
            firsts.push(first);
            waiting.push(first);
            while let Some(triangle) = waiting.pop() {
                for &twin in &self.twins[3 * triangle..3 * triangle + 3] {
                    if twin != NONE && !std::mem::replace(&mut seen[twin as usize / 3], true) {
                        waiting.push(twin as usize / 3);
                    }
                }
            }
        }
        firsts
    }

    /// Checks that the triangles make one closed surface.
    pub fn check_closed(
        &self,
        vertices_m: &[Vector3<f64>],
        triangles: &[[usize; 3]],
    ) -> Result<(), MeshFault> {
        let ends = |half| [origin(triangles, half), end(triangles, half)].map(|k| vertices_m[k]);
        if let Some(first @ &[half, _, _]) = self.crowded.first() {
            return Err(MeshFault::Crowded {
                count: self.crowded.len(),
                triangles: first.map(|half| half as usize / 3),
                ends_m: ends(half),
            });
        }
        if let Some(&half) = self.open.first() {
            let (count, triangle) = (self.open.len(), half as usize / 3);
            return Err(MeshFault::Open { count, triangle, ends_m: ends(half) });
        }
        match self.parts()[..] {
            [_] => Ok(()),
            [] => Err(MeshFault::Empty),
            [_, second, ..] => Err(MeshFault::Parts {
                count: self.parts().len(),
                triangle: second,
                at_m: vertices_m[triangles[second][0]],
            }),
        }
    }

    /// Checks that neighbours run along their common edge in opposite directions, everywhere.
    pub(crate) fn check_oriented(&self, triangles: &[[usize; 3]]) -> Result<(), MeshFault> {
        for (half, &twin) in self.twins.iter().enumerate() {
            if twin != NONE && origin(triangles, half as u32) == origin(triangles, twin) {
                return Err(MeshFault::Turned { triangles: [half / 3, twin as usize / 3] });
            }
        }
        Ok(())
    }
}
