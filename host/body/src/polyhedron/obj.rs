//! A polyhedron as a Wavefront OBJ file, which every tool for meshes opens.

use super::Polyhedron;
use std::fmt::Write as _;

impl Polyhedron {
    /// Returns an OBJ file of the body, in metres and in the object frame: vertices with all their bits, faces as polygons; a face
    /// with holes, of which OBJ has none, as its triangles.
    pub fn to_obj(&self) -> String {
        let mut text = String::new();
        for vertex in &self.vertices_m {
            let _ = writeln!(text, "v {:?} {:?} {:?}", vertex.x, vertex.y, vertex.z);
        }
        let mut polygon = |corners: &[usize]| {
            let corners: String = corners.iter().map(|corner| format!(" {}", corner + 1)).collect();
            let _ = writeln!(text, "f{corners}");
        };
        for face in &self.faces {
            if face.holes.is_empty() {
                polygon(&face.corners);
            } else {
                face.triangles.iter().for_each(|triangle| polygon(triangle));
            }
        }
        text
    }
}
