//! Meshes with noise on their vertices: polyhedra as a scanner or a printer gives them.

use blindgrasp::body::polyhedron::Polyhedron;
use blindgrasp::place::population::{Draw, RandomPolyhedron};
use nalgebra::Vector3;
use std::collections::BTreeMap;

/// Each face in triangles, cut in four so many times.
const CUTS: usize = 2;
/// Distance of a vertex of a mesh from its true place, in units of the body's extent: about what a 3-D print has.
const NOISE: f64 = 2e-4;

/// The same body as a mesh with noise, as the text of an ASCII STL in millimetres: faces cut into small triangles, whose
/// vertices are each moved a little.
pub fn noisy_stl(draw: &mut Draw, body: &RandomPolyhedron) -> String {
    let corners: Vec<Vector3<f64>> = body.corners_m.iter().map(|&corner| corner.into()).collect();
    let shape = Polyhedron::hull(&corners).expect("a polyhedron");
    let mut triangles: Vec<[Vector3<f64>; 3]> = Vec::new();
    for face in &shape.faces {
        let at = |k: usize| shape.vertices_m[face.corners[k]];
        triangles.extend((1..face.corners.len() - 1).map(|k| [at(0), at(k), at(k + 1)]));
    }
    for _ in 0..CUTS {
        triangles = triangles.iter().flat_map(cut_in_four).collect();
    }
    // Triangles that share a vertex have it in the same place, to rounding.
    let mut moved: BTreeMap<[i64; 3], Vector3<f64>> = BTreeMap::new();
    let mut text = String::from("solid noise\n");
    for triangle in &triangles {
        text += "facet normal 0 0 0\nouter loop\n";
        for vertex in triangle {
            let key = <[f64; 3]>::from(vertex / (1e-7 * body.extent_m)).map(|v| v.round() as i64);
            let noise = NOISE * body.extent_m;
            let [x, y, z]: [f64; 3] =
                (*moved.entry(key).or_insert_with(|| vertex + draw.vector(noise)) * 1e3).into();
            text += &format!("vertex {x:e} {y:e} {z:e}\n");
        }
        text += "endloop\nendfacet\n";
    }
    text + "endsolid noise\n"
}

fn cut_in_four(&[a, b, c]: &[Vector3<f64>; 3]) -> [[Vector3<f64>; 3]; 4] {
    let [ab, bc, ca] = [(a + b) / 2.0, (b + c) / 2.0, (c + a) / 2.0];
    [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
}
