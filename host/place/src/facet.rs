//! A face as a place for a contact: a plane with axes of its own, and the half-planes that keep a contact on it.

use blindgrasp_body::polyhedron::Polyhedron;
use blindgrasp_shared::math::Real;
use nalgebra::{Vector2, Vector3};

/// A half-plane of a face's plane: `inwards . z + offset_m` is how far a point lies inside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfPlane {
    /// Unit vector in the axes of the face.
    pub(super) inwards: Vector2<f64>,
    /// Depth of the origin inside, m.
    pub(super) offset_m: f64,
}

/// A face in the object frame, with coordinates `z` (m) in its plane.
#[derive(Clone, Debug)]
pub(super) struct Facet {
    /// Its index.
    pub(super) face: usize,
    /// `C_Y`: unit normal into the object.
    pub(super) inward: Vector3<f64>,
    /// Unit vectors in the plane; the first lies along the face's longest edge.
    pub(super) axes: [Vector3<f64>; 2],
    /// A point inside the face, where `z = 0`, m.
    pub(super) origin_m: Vector3<f64>,
    /// Depth of the origin inside the outline, m.
    pub(super) margin_m: f64,
    /// A convex part of the face around the origin: all of it, if the face is convex.
    pub(super) cell: Vec<HalfPlane>,
}

impl Facet {
    /// The face of a polyhedron, around its middle.
    pub(super) fn of(shape: &Polyhedron, face: usize) -> Self {
        let plane = &shape.faces[face];
        // The middle of a face that was read from a mesh may lie off its plane, as its corners do.
        let middle = shape.face_centre_m(face);
        let origin_m = middle - plane.normal * (plane.normal.dot(&middle) - plane.distance_m);
        let edges: Vec<(Vector3<f64>, Vector3<f64>)> = std::iter::once(&plane.corners)
            .chain(&plane.holes)
            .flat_map(|outline| outline.iter().zip(outline.iter().cycle().skip(1)))
            .map(|(&from, &to)| (shape.vertices_m[from], shape.vertices_m[to]))
            .collect();
        let longest =
            edges.iter().map(|(from, to)| to - from).fold(Vector3::zeros(), |a: Vector3<f64>, b| {
                if b.norm_squared() > a.norm_squared() { b } else { a }
            });
        let in_plane = |v: Vector3<f64>| v - plane.normal * plane.normal.dot(&v);
        let along = in_plane(longest).normalize();
        let axes = [along, plane.normal.cross(&along)];
        let flat = |v: Vector3<f64>| Vector2::new(axes[0].dot(&v), axes[1].dot(&v));
        let flat_edges: Vec<(Vector2<f64>, Vector2<f64>)> =
            edges.iter().map(|(from, to)| (flat(from - origin_m), flat(to - origin_m))).collect();
        let margin_m = shape.margin_m(face, &origin_m);
        Self { face, inward: -plane.normal, axes, origin_m, margin_m, cell: cell(&flat_edges) }
    }

    /// Returns the depth of a coordinate inside the convex part, m.
    pub(super) fn margin_at_m(&self, z: &Vector2<f64>) -> f64 {
        self.cell.iter().map(|half| half.inwards.dot(z) + half.offset_m).fold(f64::INFINITY, f64::min)
    }

    /// The point of a coordinate, in the object frame, m.
    pub(super) fn point_m(&self, z: &Vector2<f64>) -> Vector3<f64> {
        self.origin_m + self.axes[0] * z.x + self.axes[1] * z.y
    }

    /// The coordinates of a point of the face, m.
    pub(super) fn coordinates(&self, point_m: &Vector3<f64>) -> Vector2<f64> {
        let from_origin = point_m - self.origin_m;
        Vector2::new(self.axes[0].dot(&from_origin), self.axes[1].dot(&from_origin))
    }
}

/// The origin has to be so much of its distance from the nearest edge inside of the lines along all edges, so that these make
/// the convex part.
const KEPT: f64 = 0.8;

/// The half-planes of a convex part of an outline around the origin, from its edges, with the inside on their left: what lies
/// on the inner side of the lines along all edges, which is all of a convex outline, and nearly all of one that is convex but
/// for the noise of a mesh. Where that leaves out the origin or comes close to it, each edge has the half-plane that ends at its
/// point nearest to the origin, across the way there: no edge reaches into it.
fn cell(edges: &[(Vector2<f64>, Vector2<f64>)]) -> Vec<HalfPlane> {
    let along = |(from, to): &(Vector2<f64>, Vector2<f64>)| {
        let way = (to - from).try_normalize(0.0)?;
        let inwards = Vector2::new(-way.y, way.x);
        Some(HalfPlane { inwards, offset_m: -inwards.dot(from) })
    };
    let across = |(from, to): &(Vector2<f64>, Vector2<f64>)| {
        let way = to - from;
        let share = (-from.dot(&way) / way.norm_squared()).limited(0.0, 1.0);
        let point = from + way * share;
        let offset_m = point.norm();
        (offset_m > 0.0).then(|| HalfPlane { inwards: -point / offset_m, offset_m })
    };
    let least = |cell: &[HalfPlane]| cell.iter().map(|half| half.offset_m).fold(f64::INFINITY, f64::min);
    let lines: Vec<HalfPlane> = edges.iter().filter_map(along).collect();
    let points: Vec<HalfPlane> = edges.iter().filter_map(across).collect();
    if least(&lines) >= KEPT * least(&points) { lines } else { points }
}

#[cfg(test)]
mod tests {
    use super::*;
    use blindgrasp_model::ObjectFile;

    fn shape(toml: &str) -> Polyhedron {
        let text = format!("schema = 1\nname = \"x\"\ndensity_kg_m3 = 20\n{toml}");
        let file = ObjectFile::parse(&text, "x.toml", std::path::Path::new("")).unwrap();
        file.body(&mut Vec::new()).unwrap().shape
    }

    #[test]
    fn a_convex_face_is_its_own_cell() {
        let shape = shape("[shape.box]\nsize_m = [0.02, 0.04, 0.06]\n");
        let mut random = fastrand::Rng::with_seed(2);
        for face in 0..6 {
            let facet = Facet::of(&shape, face);
            assert_eq!(facet.cell.len(), 4);
            assert!((facet.inward + shape.faces[face].normal).norm() == 0.0);
            for _ in 0..50 {
                let z = Vector2::new(0.08 * (random.f64() - 0.5), 0.08 * (random.f64() - 0.5));
                let point = facet.point_m(&z);
                assert!((facet.coordinates(&point) - z).norm() < 1e-15);
                assert!(
                    (facet.margin_at_m(&z) - shape.margin_m(face, &point)).abs() < 1e-9 || {
                        // Outside, near a corner, the margin is the distance from the corner.
                        facet.margin_at_m(&z) < 0.0 && shape.margin_m(face, &point) < 0.0
                    }
                );
            }
        }
    }

    /// Wherever the cell has a margin, the face has at least that.
    #[test]
    fn the_cell_of_a_notched_face_lies_on_the_face() {
        let square = [(0.0, 0.0), (4.0, 0.0), (4.0, 1.0), (1.0, 1.0), (1.0, 4.0), (0.0, 4.0)];
        let corners: Vec<Vector2<f64>> =
            square.iter().map(|&(x, y)| Vector2::new(x - 0.6, y - 0.6)).collect();
        let edges: Vec<_> = (0..6).map(|k| (corners[k], corners[(k + 1) % 6])).collect();
        let cell = cell(&edges);
        let mut random = fastrand::Rng::with_seed(4);
        let mut inside = 0;
        for _ in 0..4000 {
            let z = Vector2::new(5.0 * random.f64() - 1.0, 5.0 * random.f64() - 1.0);
            let margin =
                cell.iter().map(|half| half.inwards.dot(&z) + half.offset_m).fold(f64::INFINITY, f64::min);
            if margin > 0.0 {
                inside += 1;
                let (x, y) = (z.x + 0.6, z.y + 0.6);
                assert!(x > 0.0 && y > 0.0 && x < 4.0 && y < 4.0 && (x < 1.0 || y < 1.0), "{z}");
            }
        }
        assert!(inside > 100, "{inside}");
    }
}
