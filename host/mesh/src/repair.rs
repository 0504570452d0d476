//! From triangles as a file has them to a closed, oriented surface; what had to be done for that, in words.

use crate::cracks;
use crate::soup::Soup;
use crate::weld::{distinct, weld};
use blindgrasp_body::polyhedron::surface::{NONE, Survey, origin, survey};
use blindgrasp_body::polyhedron::{MeshFault, counted, diagonal_m};
use nalgebra::Vector3;
use std::collections::HashSet;

/// Vertices closer than this are one, in units of the body's diagonal: some roundings of a 32-bit float.
pub(super) const WELD: f64 = 1e-6;

/// A mesh under repair: all triangles have three different vertices.
pub(super) struct Mesh {
    pub(super) vertices: Vec<Vector3<f64>>,
    pub(super) triangles: Vec<[usize; 3]>,
    /// The number of each triangle in the file, from 0.
    pub(super) numbers: Vec<u32>,
}

/// The repaired surface.
#[derive(Debug)]
pub struct Repaired {
    /// Its vertices, m.
    pub vertices: Vec<Vector3<f64>>,
    /// The vertices of each triangle, counterclockwise from outside.
    pub triangles: Vec<[usize; 3]>,
    /// Notices of what was repaired, in words.
    pub notices: Vec<String>,
}

/// Repairs what can be repaired without a guess, and refuses the rest.
pub(super) fn repair(soup: Soup) -> Result<Repaired, MeshFault> {
    let mut notices = Vec::new();
    let (vertices, places) = distinct(soup.triangles.iter().flatten().copied());
    let diagonal = diagonal_m(&vertices);
    let mut mesh = Mesh {
        vertices,
        triangles: places.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect(),
        numbers: soup.numbers,
    };
    if diagonal > 0.0 {
        let firsts = weld(&mesh.vertices, WELD * diagonal);
        let welded = firsts.iter().enumerate().filter(|(k, first)| **first != *k as u32).count();
        if welded > 0 {
            notices.push(format!(
                "{} within {} mm of another welded to it",
                counted(welded, "vertex").replace("vertexs", "vertices"),
                length(WELD * diagonal)
            ));
        }
        mesh.merge(&firsts);
    }
    let lost = mesh.drop_degenerate();
    mesh.say(&lost, "without area left out", &mut notices);
    let twice = mesh.drop_duplicates();
    mesh.say(&twice, "that are there twice left out", &mut notices);
    if mesh.triangles.is_empty() {
        return Err(MeshFault::Empty);
    }

    let mut edges = survey(&mesh.triangles);
    if !edges.open.is_empty() {
        edges = cracks::close(&mut mesh, edges, diagonal, &mut notices);
    }
    edges.check_closed(&mesh.vertices, &mesh.triangles).map_err(|fault| fault.renumbered(&mesh.numbers))?;
    mesh.orient(&edges, &mut notices).map_err(|fault| fault.renumbered(&mesh.numbers))?;
    let (vertices, places) = in_order(&mesh);
    Ok(Repaired { vertices, triangles: places, notices })
}

impl Mesh {
    /// Puts one vertex in the place of others.
    pub(super) fn merge(&mut self, firsts: &[u32]) {
        for corner in self.triangles.iter_mut().flatten() {
            *corner = firsts[*corner] as usize;
        }
    }

    /// Leaves out triangles of fewer than three vertices; their numbers.
    pub(super) fn drop_degenerate(&mut self) -> Vec<u32> {
        self.drop(|[a, b, c]| a == b || b == c || c == a)
    }

    /// Leaves out triangles that have the same vertices as one before, turned either way; their numbers.
    pub(super) fn drop_duplicates(&mut self) -> Vec<u32> {
        let mut seen = HashSet::with_capacity(self.triangles.len());
        self.drop(|mut corners| {
            corners.sort_unstable();
            !seen.insert(corners)
        })
    }

    fn drop(&mut self, mut is_bad: impl FnMut([usize; 3]) -> bool) -> Vec<u32> {
        let bad: Vec<bool> = self.triangles.iter().map(|&corners| is_bad(corners)).collect();
        let dropped =
            self.numbers.iter().zip(&bad).filter(|(_, bad)| **bad).map(|(number, _)| *number).collect();
        let mut good = bad.iter().map(|bad| !bad);
        self.triangles.retain(|_| good.next().unwrap_or(true));
        let mut good = bad.iter().map(|bad| !bad);
        self.numbers.retain(|_| good.next().unwrap_or(true));
        dropped
    }

    fn say(&self, numbers: &[u32], what: &str, notices: &mut Vec<String>) {
        if let Some(first) = numbers.first() {
            notices.push(format!(
                "{} {what}, the first number {}",
                counted(numbers.len(), "triangle"),
                first + 1
            ));
        }
    }

    /// Turns triangles so that neighbours agree and the outside is outside.
    fn orient(&mut self, edges: &Survey, notices: &mut Vec<String>) -> Result<(), MeshFault> {
        let turned = turns(&self.triangles, edges)?;
        for (corners, turned) in self.triangles.iter_mut().zip(&turned) {
            if *turned {
                corners.swap(1, 2);
            }
        }
        let inside_out = six_volumes(&self.vertices, &self.triangles) < 0.0;
        if inside_out {
            self.triangles.iter_mut().for_each(|corners| corners.swap(1, 2));
        }
        let numbers: Vec<u32> = self
            .numbers
            .iter()
            .zip(&turned)
            .filter(|(_, turned)| **turned != inside_out)
            .map(|(number, _)| *number)
            .collect();
        if numbers.len() == self.triangles.len() {
            notices.push("it was inside out: all triangles turned over".to_owned());
        } else {
            self.say(&numbers, "that showed their inside turned over", notices);
        }
        Ok(())
    }
}

/// Returns the triangles that are to be turned over so that all agree with the first.
fn turns(triangles: &[[usize; 3]], edges: &Survey) -> Result<Vec<bool>, MeshFault> {
    let mut turns: Vec<Option<bool>> = vec![None; triangles.len()];
    turns[0] = Some(false);
    let mut waiting = vec![0];
    while let Some(triangle) = waiting.pop() {
        for half in 3 * triangle as u32..3 * triangle as u32 + 3 {
            let twin = edges.twins[half as usize];
            if twin == NONE {
                continue;
            }
            let against = origin(triangles, half) == origin(triangles, twin);
            let wanted = turns[triangle] != Some(against);
            match turns[twin as usize / 3] {
                None => {
                    turns[twin as usize / 3] = Some(wanted);
                    waiting.push(twin as usize / 3);
                }
                Some(turned) if turned != wanted => {
                    return Err(MeshFault::OneSided { triangle: twin as usize / 3 });
                }
                Some(_) => {}
            }
        }
    }
    Ok(turns.into_iter().map(|turned| turned == Some(true)).collect())
}

/// Six times the volume, seen from one of the vertices.
fn six_volumes(vertices: &[Vector3<f64>], triangles: &[[usize; 3]]) -> f64 {
    let tip = vertices[triangles[0][0]];
    triangles
        .iter()
        .map(|corners| corners.map(|k| vertices[k] - tip))
        .map(|[a, b, c]| a.dot(&b.cross(&c)))
        .sum()
}

/// Vertices in the order in which the triangles use them, and the triangles with them.
fn in_order(mesh: &Mesh) -> (Vec<Vector3<f64>>, Vec<[usize; 3]>) {
    let mut places = vec![usize::MAX; mesh.vertices.len()];
    let mut vertices = Vec::new();
    let triangles = mesh
        .triangles
        .iter()
        .map(|corners| {
            corners.map(|k| {
                if places[k] == usize::MAX {
                    places[k] = vertices.len();
                    vertices.push(mesh.vertices[k]);
                }
                places[k]
            })
        })
        .collect();
    (vertices, triangles)
}

/// A small length in millimetres, two digits.
pub(super) fn length(m: f64) -> String {
    format!("{:.1e}", m * 1e3)
}
