//! The file of an object.

use super::InertiaFile;
use super::key::{FileKey, ShapeKind, keys};
use serde::{Deserialize, Serialize};

keys! {
    /// An object.
    #[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
    #[serde(deny_unknown_fields)]
    pub struct ObjectFile {
        /// Version of the format: 1.
        pub schema: u32,
        /// Name of the object, a word.
        pub name: String,
        /// A sentence or two on it.
        #[serde(default)]
        pub description: String,
        /// Mass, kg; or `density_kg_m3`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub mass_kg: Option<f64>,
        /// Density, kg/m^3, instead of the mass.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub density_kg_m3: Option<f64>,
        /// Inertia about the centre of mass in the object frame, kg m^2: xx, yy, zz, and xy, xz, yz unless zero; without it,
        /// that of a uniform body.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub inertia_kg_m2: Option<InertiaFile>,
        /// Coefficient of friction against the hand, whose file may have a lower one.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub friction: Option<f64>,
        /// Shape: one of the tables below.
        pub shape: ShapeFile,
    }
}

keys! {
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
        /// An STL or OBJ file (`file`, `unit` and `scale`) may stand for vertices and triangles; it is repaired where that is
        /// safe, and refused otherwise.
        Mesh {
            /// The vertices, m.
            vertices_m: Vec<[f64; 3]>,
            /// The triangles: indices into the vertices, from 0, counter-clockwise seen from outside.
            triangles: Vec<[usize; 3]>,
            /// Largest angle between neighbouring triangles of a face, degrees.
            #[serde(default = "ShapeFile::flat_deg")]
            flat_deg: f64,
            /// Largest distance of a face's parts from its plane, m (root mean square); without it, a thousandth of the diagonal
            /// of the box around the body.
            #[serde(default, skip_serializing_if = "Option::is_none")]
            flat_m: Option<f64>,
        },
    }
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
