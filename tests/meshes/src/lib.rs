//! Meshes for tests: closed, oriented, and nothing special about their triangles unless it says so.

use blindgrasp_shared::math::Real;
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

/// Vertices and triangles.
pub type Mesh = (Vec<Vector3<f64>>, Vec<[usize; 3]>);

/// A sequence of numbers in [0, 1) that is the same everywhere.
pub struct Numbers(pub u64);

impl Numbers {
    /// The next one, in [0, 1).
    pub fn unit(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// A whole number below `count`.
    pub fn below(&mut self, count: usize) -> usize {
        (self.unit() * count as f64) as usize
    }

    /// In the cube from -1 to 1.
    pub fn vector(&mut self) -> Vector3<f64> {
        Vector3::from_fn(|_, _| 2.0 * self.unit() - 1.0)
    }

    /// A rotation about any axis.
    pub fn rotation(&mut self) -> Rotation3<f64> {
        UnitQuaternion::from_scaled_axis(self.vector() * 3.0).to_rotation_matrix()
    }

    /// Puts the items into another order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for k in (1..items.len()).rev() {
            items.swap(k, self.below(k + 1));
        }
    }
}

/// A box around the origin whose faces are grids of squares, each cut in two. Faces in the order -x, +x, -y, +y, -z, +z.
pub fn grid_box(size_m: [f64; 3], squares: usize) -> Mesh {
    let mut vertices: Vec<Vector3<f64>> = Vec::new();
    let mut triangles = Vec::new();
    let mut places = std::collections::HashMap::new();
    for (axis, sign) in [(0, -1.0), (0, 1.0), (1, -1.0), (1, 1.0), (2, -1.0), (2, 1.0)] {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let mut corner = |i: usize, j: usize| {
            let mut place = [0; 3];
            place[axis] = if sign < 0.0 { 0 } else { squares };
            (place[u], place[v]) = (i, j);
            *places.entry(place).or_insert_with(|| {
                vertices.push(Vector3::from_fn(|k, _| size_m[k] * (place[k] as f64 / squares as f64 - 0.5)));
                vertices.len() - 1
            })
        };
        for i in 0..squares {
            for j in 0..squares {
                let [a, b, c, d] = [corner(i, j), corner(i + 1, j), corner(i + 1, j + 1), corner(i, j + 1)];
                let halves = if (i + j) % 2 == 0 { [[a, b, c], [a, c, d]] } else { [[a, b, d], [b, c, d]] };
                triangles.extend(halves.map(|[a, b, c]| if sign > 0.0 { [a, b, c] } else { [a, c, b] }));
            }
        }
    }
    (vertices, triangles)
}

/// The icosahedron with each triangle cut in four so many times, on a sphere around the origin.
pub fn icosphere(radius_m: f64, cuts: usize) -> Mesh {
    let g = (1.0 + 5.0_f64.square_root()) / 2.0;
    let mut vertices: Vec<Vector3<f64>> = Vec::new();
    for (a, b) in [(1.0, g), (-1.0, g), (1.0, -g), (-1.0, -g)] {
        vertices.extend([Vector3::new(0.0, a, b), Vector3::new(a, b, 0.0), Vector3::new(b, 0.0, a)]);
    }
    for vertex in &mut vertices {
        *vertex = vertex.normalize() * radius_m;
    }
    let mut triangles = Vec::new();
    let edge =
        (0..12).map(|k| (vertices[0] - vertices[k]).norm()).filter(|d| *d > 0.0).fold(f64::MAX, f64::min);
    let near = |a: usize, b: usize| ((vertices[a] - vertices[b]).norm() - edge).abs() < 1e-6 * radius_m;
    for a in 0..12 {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    let out =
                        (vertices[b] - vertices[a]).cross(&(vertices[c] - vertices[a])).dot(&vertices[a]);
                    triangles.push(if out > 0.0 { [a, b, c] } else { [a, c, b] });
                }
            }
        }
    }
    for _ in 0..cuts {
        let mut middles = std::collections::HashMap::new();
        let mut middle = |a: usize, b: usize, vertices: &mut Vec<Vector3<f64>>| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                vertices.push((vertices[a] + vertices[b]).normalize() * radius_m);
                vertices.len() - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let [ab, bc, ca] = [(a, b), (b, c), (c, a)].map(|(a, b)| middle(a, b, &mut vertices));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (vertices, triangles)
}

/// An L with arms of 60 and 40 mm, 20 mm thick, 30 mm along z: a corner of its outline in the origin. Faces: bottom, top,
/// and the sides counter-clockwise seen from +z, from the one that looks along -y.
pub fn bracket() -> Mesh {
    let outline = [[0, 0], [60, 0], [60, 20], [20, 20], [20, 40], [0, 40]];
    let cap = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]];
    extrude(&outline, &cap, 30)
}

/// A plate of 60 x 40 x 10 mm with a square hole of 20 mm in its middle, along z. Faces: bottom, top, four sides outside,
/// four inside.
pub fn plate() -> Mesh {
    let square = |x: i32, y: i32| [[-x, -y], [x, -y], [x, y], [-x, y]];
    let corners: Vec<[i32; 2]> = square(30, 20).into_iter().chain(square(10, 10)).collect();
    let mut cap = Vec::new();
    for k in 0..4 {
        let next = (k + 1) % 4;
        cap.extend([[k, next, 4 + next], [k, 4 + next, 4 + k]]);
    }
    let mut mesh = lids(&corners, &cap, 10);
    sides(&mut mesh.1, &[0, 1, 2, 3], 8);
    sides(&mut mesh.1, &[7, 6, 5, 4], 8);
    mesh
}

/// An octahedron of 30 mm with its top pushed in: a pit, whose bottom is a vertex with concave edges only.
pub fn pit() -> Mesh {
    let side = |x: f64, y: f64| Vector3::new(0.03 * x, 0.03 * y, 0.0);
    let vertices = vec![
        side(1.0, 0.0),
        side(0.0, 1.0),
        side(-1.0, 0.0),
        side(0.0, -1.0),
        Vector3::new(0.0, 0.0, -0.03),
        Vector3::new(0.002, 0.003, -0.01),
    ];
    let around = [[0, 1], [1, 2], [2, 3], [3, 0]];
    let triangles = around.iter().flat_map(|&[a, b]| [[b, a, 4], [a, b, 5]]).collect();
    (vertices, triangles)
}

/// A block of 60 x 40 x 20 mm and a little more, whose top is two faces that fall to a concave edge in its middle, at 5 degrees each.
pub fn valley() -> Mesh {
    let (w, d, h) = (0.03, 0.02, 0.03 * 0.0875);
    let at = |x: f64, y: f64, z: f64| Vector3::new(x, y, z);
    let vertices = vec![
        at(-w, -d, 0.0),
        at(w, -d, 0.0),
        at(w, -d, 0.02 + h),
        at(0.0, -d, 0.02),
        at(-w, -d, 0.02 + h),
        at(-w, d, 0.0),
        at(w, d, 0.0),
        at(w, d, 0.02 + h),
        at(0.0, d, 0.02),
        at(-w, d, 0.02 + h),
    ];
    let front = [[0, 1, 3], [1, 2, 3], [0, 3, 4]];
    let mut triangles: Vec<[usize; 3]> = front.to_vec();
    triangles.extend(front.map(|[a, b, c]| [a + 5, c + 5, b + 5]));
    for k in 0..5 {
        let next = (k + 1) % 5;
        triangles.extend([[next, k, k + 5], [next, k + 5, next + 5]]);
    }
    (vertices, triangles)
}

fn extrude(outline_mm: &[[i32; 2]], cap: &[[usize; 3]], height_mm: i32) -> Mesh {
    let mut mesh = lids(outline_mm, cap, height_mm);
    sides(&mut mesh.1, &(0..outline_mm.len()).collect::<Vec<_>>(), outline_mm.len());
    mesh
}

/// Bottom and top.
fn lids(corners_mm: &[[i32; 2]], cap: &[[usize; 3]], height_mm: i32) -> Mesh {
    let count = corners_mm.len();
    let at = |z: i32| {
        corners_mm.iter().map(move |&[x, y]| Vector3::new(f64::from(x), f64::from(y), f64::from(z)) / 1000.0)
    };
    let bottom = cap.iter().map(|&[a, b, c]| [a, c, b]);
    let top = cap.iter().map(|corners| corners.map(|k| k + count));
    (at(0).chain(at(height_mm)).collect(), bottom.chain(top).collect())
}

fn sides(triangles: &mut Vec<[usize; 3]>, rim: &[usize], up: usize) {
    for (&a, &b) in rim.iter().zip(rim.iter().cycle().skip(1)) {
        triangles.extend([[a, b, b + up], [a, b + up, a + up]]);
    }
}
