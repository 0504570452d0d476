//! The grasped object: a rigid convex polyhedron with planar faces.
//!
//! Every constructor moves the origin to the centre of mass of the uniform body, so that `distance_m` of a face is the
//! paper's `Y_i`. The axes stay those of the description; the inertia is a full tensor in them.

mod hull;
#[cfg(test)]
mod tests;

use blindgrasp_shared::math::{Real, norm};
use nalgebra::{Matrix3, Vector3};

/// The most points that [`Polyhedron::hull`] and [`Polyhedron::prism`] take: their checks look at all triples.
pub const MAX_POINTS: usize = 100;

/// A planar face, seen in the object frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Face {
    /// Unit normal pointing **out of** the object. (The paper's `C_iY` points into it.)
    pub normal: Vector3<f64>,
    /// Distance of the face's plane from the origin of the object frame, m (`Y_i`, once the origin is the centre of mass).
    pub distance_m: f64,
    /// Corners, counter-clockwise seen from outside: indices into the vertices.
    pub corners: Vec<usize>,
}

/// A convex polyhedron in the object frame, whose origin is the centre of mass.
#[derive(Clone, Debug, PartialEq)]
pub struct Polyhedron {
    /// Vertices, m.
    pub vertices_m: Vec<Vector3<f64>>,
    /// Faces.
    pub faces: Vec<Face>,
}

/// Volume, and what it takes to turn a mass into an inertia.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MassProperties {
    /// Volume, m^3.
    pub volume_m3: f64,
    /// Centre of mass of the uniform body, m.
    pub centre_m: Vector3<f64>,
    /// Inertia of the uniform body about its centre of mass for each kilogram, m^2.
    pub inertia_per_kg_m2: Matrix3<f64>,
}

/// Why a description is not a polyhedron.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PolyhedronError {
    /// A length that is not positive and finite.
    #[error("{what} has to be positive and finite, not {value:?}")]
    Length {
        /// What it is the length of.
        what: &'static str,
        /// What it is.
        value: f64,
    },
    /// A coordinate that is NaN or infinite.
    #[error("point {point} is not finite")]
    NotFinite {
        /// Index of the point.
        point: usize,
    },
    /// Too few points.
    #[error("{count} points make no {shape}: at least {least} are needed")]
    TooFewPoints {
        /// How many there are.
        count: usize,
        /// How many it takes.
        least: usize,
        /// What they should make.
        shape: &'static str,
    },
    /// Too many points.
    #[error("{count} points are too many: at most {MAX_POINTS}")]
    TooManyPoints {
        /// How many there are.
        count: usize,
    },
    /// Two points in the same place.
    #[error("points {first} and {second} are the same")]
    Duplicate {
        /// Index of the one.
        first: usize,
        /// Index of the other.
        second: usize,
    },
    /// All points in one plane, or nearly so.
    #[error("all points lie in one plane: no volume")]
    NoVolume,
    /// The polygon turns inwards or clockwise somewhere, or has a straight corner.
    #[error("the polygon is not convex and counter-clockwise at corner {corner}")]
    NotConvex {
        /// Index of the corner.
        corner: usize,
    },
    /// Rounding decides which points are corners.
    #[error("some points lie so close to a plane or a line through others that the faces are not clear")]
    Unclear,
}

impl Polyhedron {
    /// A box with sides along the axes. Faces: -x, +x, -y, +y, -z, +z.
    ///
    /// # Errors
    /// A side that is not positive.
    pub fn cuboid(size_m: [f64; 3]) -> Result<Self, PolyhedronError> {
        for (what, value) in
            ["the length along x", "the length along y", "the length along z"].into_iter().zip(size_m)
        {
            check_length(what, value)?;
        }
        let half = Vector3::from(size_m) / 2.0;
        // Vertex k has the signs of the bits of k: x, y, z.
        let sign = |k: usize, bit: usize| if k & (1 << bit) == 0 { -1.0 } else { 1.0 };
        let vertices_m = (0..8)
            .map(|k| Vector3::new(half.x * sign(k, 0), half.y * sign(k, 1), half.z * sign(k, 2)))
            .collect();
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            .into_iter()
            .enumerate()
            .map(|(k, corners)| {
                let mut normal = Vector3::zeros();
                normal[k / 2] = if k % 2 == 0 { -1.0 } else { 1.0 };
                Face { normal, distance_m: half[k / 2], corners: corners.to_vec() }
            })
            .collect();
        Ok(Self { vertices_m, faces })
    }

    /// A right prism over a regular polygon, its axis along z. Faces: the sides, beginning with the one that looks along
    /// -y and going counter-clockwise seen from +z; then bottom and top.
    ///
    /// # Errors
    /// Fewer than three sides, too many, or a length that is not positive.
    pub fn regular_prism(sides: usize, side_m: f64, height_m: f64) -> Result<Self, PolyhedronError> {
        check_length("the length of a side", side_m)?;
        if sides < 3 {
            return Err(PolyhedronError::TooFewPoints { count: sides, least: 3, shape: "prism" });
        }
        if sides > MAX_POINTS {
            return Err(PolyhedronError::TooManyPoints { count: sides });
        }
        let half_angle = std::f64::consts::PI / sides as f64;
        let radius = side_m / (2.0 * half_angle.sine_cosine().0);
        let corners: Vec<[f64; 2]> = (0..sides)
            .map(|k| {
                let (sine, cosine) = ((2 * k) as f64 * half_angle - half_angle).sine_cosine();
                // The angle counts from -y.
                [radius * sine, -radius * cosine]
            })
            .collect();
        Self::prism(&corners, height_m)
    }

    /// A right prism over a convex polygon (counter-clockwise seen from +z), its axis along z. Faces: the sides from each
    /// corner to the next; then bottom and top.
    ///
    /// # Errors
    /// What is wrong with the polygon or the height.
    pub fn prism(corners_m: &[[f64; 2]], height_m: f64) -> Result<Self, PolyhedronError> {
        check_length("the height", height_m)?;
        let count = corners_m.len();
        let corners: Vec<_> = corners_m.iter().map(|c| Vector3::new(c[0], c[1], 0.0)).collect();
        check_points(&corners, 3, "prism")?;
        for k in 0..count {
            let (a, b, c) = (corners[k], corners[(k + 1) % count], corners[(k + 2) % count]);
            let sine = (b - a).normalize().cross(&(c - b).normalize()).z;
            // Turning left at every corner is not enough: a star does.
            let behind = corners.iter().any(|p| (b - a).cross(&(p - a)).z < 0.0 && *p != a && *p != b);
            if !(sine > 1e-9) || behind {
                return Err(PolyhedronError::NotConvex { corner: (k + 1) % count });
            }
        }
        let up = Vector3::z() * (height_m / 2.0);
        let vertices_m = corners.iter().map(|c| c - up).chain(corners.iter().map(|c| c + up)).collect();
        let mut loops: Vec<Vec<usize>> =
            (0..count).map(|k| vec![k, (k + 1) % count, (k + 1) % count + count, k + count]).collect();
        loops.push((0..count).rev().collect());
        loops.push((count..2 * count).collect());
        Self::from_loops(vertices_m, loops)
    }

    /// The convex hull of points. Points inside the hull, its faces or its edges are left out, coplanar triangles merged.
    ///
    /// Brute force over all planes through three points: at most [`MAX_POINTS`].
    ///
    /// # Errors
    /// What is wrong with the points, by index.
    pub fn hull(points_m: &[Vector3<f64>]) -> Result<Self, PolyhedronError> {
        check_points(points_m, 4, "hull")?;
        let (vertices_m, loops) = hull::faces(points_m)?;
        Self::from_loops(vertices_m, loops)
    }

    /// Planes through the given loops of corners, and the origin at the centre of mass.
    fn from_loops(
        mut vertices_m: Vec<Vector3<f64>>,
        loops: Vec<Vec<usize>>,
    ) -> Result<Self, PolyhedronError> {
        // The mass properties need no planes.
        let face = |corners| Face { normal: Vector3::zeros(), distance_m: 0.0, corners };
        let mut polyhedron =
            Self { vertices_m: vertices_m.clone(), faces: loops.into_iter().map(face).collect() };
        let properties = polyhedron.mass_properties();
        if !(properties.volume_m3 > 0.0 && properties.inertia_per_kg_m2.iter().all(|v| v.is_finite())) {
            return Err(PolyhedronError::NoVolume);
        }
        for vertex in &mut vertices_m {
            *vertex -= properties.centre_m;
        }
        for face in &mut polyhedron.faces {
            // Newell's normal: twice the area of the loop as a vector, exact for planar loops.
            let first = vertices_m[face.corners[0]];
            let area = face.corners.windows(2).fold(Vector3::zeros(), |sum, pair| {
                sum + (vertices_m[pair[0]] - first).cross(&(vertices_m[pair[1]] - first))
            });
            face.normal = area / norm(&area);
            face.distance_m = face.corners.iter().map(|&k| face.normal.dot(&vertices_m[k])).sum::<f64>()
                / face.corners.len() as f64;
            if !(face.distance_m > 0.0) {
                return Err(PolyhedronError::Unclear);
            }
        }
        polyhedron.vertices_m = vertices_m;
        Ok(polyhedron)
    }

    /// How far a point lies inside a face's outline once it is moved onto the face's plane along the normal, m: the distance
    /// from the nearest edge inside; outside, minus the distance from the edge line that it is farthest beyond.
    pub fn margin_m(&self, face: usize, point_m: &Vector3<f64>) -> f64 {
        let face = &self.faces[face];
        let next = face.corners.iter().cycle().skip(1);
        face.corners
            .iter()
            .zip(next)
            .map(|(&from, &to)| {
                let edge = self.vertices_m[to] - self.vertices_m[from];
                let inwards = face.normal.cross(&edge);
                inwards.dot(&(point_m - self.vertices_m[from])) / norm(&inwards)
            })
            .fold(f64::INFINITY, f64::min)
    }

    /// Mean of a face's corners, m.
    pub fn face_centre_m(&self, face: usize) -> Vector3<f64> {
        let corners = &self.faces[face].corners;
        corners.iter().map(|&k| self.vertices_m[k]).sum::<Vector3<f64>>() / corners.len() as f64
    }

    /// The face that a point lies on, with the point's distance from it, m: of the faces whose outline contains the point
    /// to within `tolerance_m`, the nearest.
    pub fn nearest_face(&self, point_m: &Vector3<f64>, tolerance_m: f64) -> Option<(usize, f64)> {
        (0..self.faces.len())
            .filter(|&k| self.margin_m(k, point_m) >= -tolerance_m)
            .map(|k| (k, (self.faces[k].normal.dot(point_m) - self.faces[k].distance_m).abs()))
            .min_by(|a, b| a.1.total_cmp(&b.1))
    }

    /// Largest distance of a vertex from the origin, m.
    pub fn radius_m(&self) -> f64 {
        self.vertices_m.iter().map(norm).fold(0.0, f64::max)
    }

    /// Volume, centre of mass and inertia of the uniform body: exact sums over tetrahedra.
    pub fn mass_properties(&self) -> MassProperties {
        // Tetrahedra stand on the faces' triangles with their tip at the mean of the vertices: sums of positive terms, which
        // lose no digits however far the body is from the origin.
        let tip = self.vertices_m.iter().sum::<Vector3<f64>>() / self.vertices_m.len().max(1) as f64;
        let (mut six_volumes, mut first, mut second) = (0.0, Vector3::zeros(), Matrix3::zeros());
        for face in &self.faces {
            for pair in face.corners[1..].windows(2) {
                let [a, b, c] = [face.corners[0], pair[0], pair[1]].map(|k| self.vertices_m[k] - tip);
                let six = a.dot(&b.cross(&c));
                let sum = a + b + c;
                six_volumes += six;
                // The mean of x over a tetrahedron is the mean of its corners; the mean of x x^T is
                // (sum of p p^T + s s^T) / 20 over its corners p with s their sum. The tip is the origin here.
                first += six * sum / 4.0;
                second += six
                    * (a * a.transpose() + b * b.transpose() + c * c.transpose() + sum * sum.transpose())
                    / 20.0;
            }
        }
        let centre = first / six_volumes;
        let spread = second / six_volumes - centre * centre.transpose();
        MassProperties {
            volume_m3: six_volumes / 6.0,
            centre_m: tip + centre,
            inertia_per_kg_m2: Matrix3::identity() * spread.trace() - spread,
        }
    }
}

fn check_length(what: &'static str, value: f64) -> Result<(), PolyhedronError> {
    if value > 0.0 && value.is_finite() { Ok(()) } else { Err(PolyhedronError::Length { what, value }) }
}

/// Enough points, not too many, all finite, no two the same.
fn check_points(points: &[Vector3<f64>], least: usize, shape: &'static str) -> Result<(), PolyhedronError> {
    let count = points.len();
    if count < least {
        return Err(PolyhedronError::TooFewPoints { count, least, shape });
    }
    if count > MAX_POINTS {
        return Err(PolyhedronError::TooManyPoints { count });
    }
    if let Some(point) = points.iter().position(|p| !p.iter().all(|v| v.is_finite())) {
        return Err(PolyhedronError::NotFinite { point });
    }
    let scale = points.iter().map(|p| (p - points[0]).amax()).fold(0.0, f64::max);
    for (second, b) in points.iter().enumerate() {
        if let Some(first) = points[..second].iter().position(|a| !((a - b).amax() > 1e-9 * scale)) {
            return Err(PolyhedronError::Duplicate { first, second });
        }
    }
    Ok(())
}
