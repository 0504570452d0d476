//! What may stand in the file of an object.

use super::InertiaFile;
use serde::{Deserialize, Serialize};

/// An object.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectFile {
    /// Version of the format; [`SCHEMA`](super::SCHEMA).
    pub schema: u32,
    /// A word.
    pub name: String,
    /// A sentence or two.
    #[serde(default)]
    pub description: String,
    /// Mass, kg.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass_kg: Option<f64>,
    /// Instead of the mass: density, kg/m^3.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub density_kg_m3: Option<f64>,
    /// Inertia about the centre of mass in the object frame, kg m^2; without it, that of a uniform body.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub inertia_kg_m2: Option<InertiaFile>,
    /// What it looks like.
    pub shape: ShapeFile,
}

/// A polyhedron. Wherever its description puts the origin, the object frame has its origin at the centre of mass.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum ShapeFile {
    /// A box with its sides along the axes. Faces: -x, +x, -y, +y, -z, +z.
    Box {
        /// Side lengths along x, y and z, m.
        size_m: [f64; 3],
    },
    /// A right prism over a regular polygon, its axis along z. Faces: the sides, beginning with the one that looks
    /// along -y and going counter-clockwise seen from +z; then bottom (-z) and top (+z).
    Prism {
        /// Number of sides.
        sides: u32,
        /// Length of a side, m.
        side_m: f64,
        /// Extent along z, m.
        height_m: f64,
    },
    /// A right prism over a convex polygon, its axis along z. Faces: the sides from each corner to the next; then
    /// bottom and top.
    PolygonPrism {
        /// Corners x, y, m, counter-clockwise seen from +z.
        corners_m: Vec<[f64; 2]>,
        /// Extent along z, m.
        height_m: f64,
    },
    /// The convex hull of points.
    Hull {
        /// The points, m.
        points_m: Vec<[f64; 3]>,
    },
    /// A pyramid over a regular polygon, its apex over the centre, its axis along z. Faces: the sides, beginning with the
    /// one that looks along -y and going counter-clockwise seen from +z; then the bottom.
    Pyramid {
        /// Number of sides.
        sides: u32,
        /// Length of a side of the bottom, m.
        side_m: f64,
        /// Extent along z, m.
        height_m: f64,
    },
    /// The body that a closed surface of triangles encloses; it need not be convex. Triangles in one plane make one face;
    /// faces are numbered in the order of their first triangles.
    ///
    /// In a file `file`, `unit` and `scale` may stand for vertices and triangles: an STL or OBJ file beside it, read
    /// and repaired as [`crate::mesh`] says.
    Mesh {
        /// The vertices, m.
        vertices_m: Vec<[f64; 3]>,
        /// The triangles: indices into the vertices, from 0, counter-clockwise seen from outside.
        triangles: Vec<[usize; 3]>,
        /// How far neighbouring triangles in a face may tilt against each other, degrees.
        #[serde(default = "ShapeFile::flat_deg")]
        flat_deg: f64,
        /// How far parts of a face may be off its plane, m (root mean square); without it, a thousandth of the diagonal of
        /// the box around the body.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        flat_m: Option<f64>,
    },
}

impl ShapeFile {
    /// A mesh with the usual tolerances.
    pub fn mesh(vertices_m: Vec<[f64; 3]>, triangles: Vec<[usize; 3]>) -> Self {
        Self::Mesh { vertices_m, triangles, flat_deg: Self::flat_deg(), flat_m: None }
    }

    fn flat_deg() -> f64 {
        2.0
    }
}
