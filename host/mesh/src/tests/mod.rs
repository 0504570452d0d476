//! Mesh files: the same body in each format, what is shipped, what an object's file may say of them.

mod boxes;
mod damage;
mod formats;
mod repairs;

use super::*;
use blindgrasp_body::polyhedron::{Flatness, Polyhedron, PolyhedronError, diagonal_m};
use blindgrasp_meshes::{Mesh, bracket, icosphere, plate};
use nalgebra::Vector3;

fn binary(mesh: &Mesh) -> Vec<u8> {
    let mut bytes = Vec::new();
    stl_io::write_stl(&mut bytes, facets(mesh).iter()).unwrap();
    bytes
}

/// The triangles in millimetres. A mesh file does not need normals that are right, and these are not.
fn facets((vertices, triangles): &Mesh) -> Vec<stl_io::Triangle> {
    let vertex = |k: usize| stl_io::Vertex::new((vertices[k] * 1e3).map(|v| v as f32).into());
    let normal = stl_io::Normal::new([0.0; 3]);
    triangles.iter().map(|corners| stl_io::Triangle { normal, vertices: corners.map(vertex) }).collect()
}

fn ascii(mesh: &Mesh) -> Vec<u8> {
    let mut text = "solid part\n".to_owned();
    for facet in facets(mesh) {
        text += "  facet normal 0 0 0\n    outer loop\n";
        for vertex in facet.vertices {
            text += &format!("      vertex {} {} {}\n", vertex.0[0], vertex.0[1], vertex.0[2]);
        }
        text += "    endloop\n  endfacet\n";
    }
    (text + "endsolid part\n").into_bytes()
}

/// With the coordinates that STL leaves of them.
fn wavefront((vertices, triangles): &Mesh) -> Vec<u8> {
    let mut text = "mtllib nowhere.mtl\no part\n".to_owned();
    for vertex in vertices {
        let [x, y, z] = (vertex * 1e3).map(|v| f64::from(v as f32)).into();
        text += &format!("v {x} {y} {z}\n");
    }
    for [a, b, c] in triangles {
        text += &format!("f {} {} {}\n", a + 1, b + 1, c + 1);
    }
    text.into_bytes()
}

/// Reads a file of this name and content.
fn read(name: &str, bytes: &[u8]) -> Result<Repaired, Problem> {
    body(parse(Format::of(name.as_ref()).unwrap(), bytes.to_vec())?, Unit::Millimetre, 1.0)
}

/// The same, as one line.
fn refusal(name: &str, bytes: &[u8]) -> String {
    let Problem { what, remedy } = read(name, bytes).expect_err("has to be refused");
    format!("{what}; {remedy}")
}

/// The body that faces of some flatness make of it.
fn faces(repaired: &Repaired) -> Result<Polyhedron, PolyhedronError> {
    let flatness = Flatness { angle_rad: 0.035, distance_m: 1e-3 * diagonal_m(&repaired.vertices) };
    Polyhedron::mesh(&repaired.vertices, &repaired.triangles, &flatness)
}

fn polyhedron(repaired: &Repaired) -> Polyhedron {
    faces(repaired).unwrap()
}

/// The octahedron with edges of 50 mm, its corners on the axes.
fn octahedron() -> Mesh {
    use blindgrasp_shared::math::Real;
    let reach = 0.050 / 2f64.square_root();
    let vertices = [
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [-1.0, 0.0, 0.0],
        [0.0, -1.0, 0.0],
        [0.0, 0.0, 1.0],
        [0.0, 0.0, -1.0],
    ];
    let mut triangles = Vec::new();
    for k in 0..4 {
        triangles.extend([[k, (k + 1) % 4, 4], [(k + 1) % 4, k, 5]]);
    }
    (vertices.iter().map(|v| Vector3::from(*v) * reach).collect(), triangles)
}

/// The bracket that is shipped: arms of 48 mm, 20 mm thick, 40 mm wide.
fn l_bracket() -> Mesh {
    let (mut vertices, triangles) = bracket();
    for vertex in &mut vertices {
        let longer = |v: f64| if v > 0.03 { 0.048 } else { v };
        *vertex = Vector3::new(longer(vertex.x), longer(vertex.y), vertex.z / 0.03 * 0.04);
    }
    (vertices, triangles)
}

/// `BLESS=1 cargo test -p blindgrasp-mesh shipped_meshes` writes them.
#[test]
fn shipped_meshes_are_made_here() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../models/objects");
    let head = b"# A regular octahedron with edges of 50, corners on the axes.\n";
    let octahedron = [head.to_vec(), wavefront_exact(&octahedron())].concat();
    for (name, bytes) in [("l-bracket.stl", binary(&l_bracket())), ("octahedron.obj", octahedron)] {
        if std::env::var_os("BLESS").is_some() {
            std::fs::write(folder.join(name), &bytes).unwrap();
        }
        assert!(std::fs::read(folder.join(name)).unwrap() == bytes, "{name} is not what the test makes");
    }
}

fn wavefront_exact((vertices, triangles): &Mesh) -> Vec<u8> {
    let lines = vertices.iter().map(|v| format!("v {} {} {}\n", v.x * 1e3, v.y * 1e3, v.z * 1e3));
    let faces = triangles.iter().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1));
    lines.chain(faces).collect::<String>().into_bytes()
}
