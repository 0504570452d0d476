//! Convex solids: box, prisms, pyramid, convex hull.

use super::{Face, MAX_POINTS, Polyhedron, PolyhedronError, hull, mass};
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

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
        let vertices_m: Vec<_> = (0..8)
            .map(|k| Vector3::new(half.x * sign(k, 0), half.y * sign(k, 1), half.z * sign(k, 2)))
            .collect();
        let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]]
            .into_iter()
            .enumerate()
            .map(|(k, corners)| {
                let mut normal = Vector3::zeros();
                normal[k / 2] = if k % 2 == 0 { -1.0 } else { 1.0 };
                // The plane as it is, without the rounding of a fit.
                Face { normal, distance_m: half[k / 2], ..Face::convex(&vertices_m, corners.to_vec()) }
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
        let corners = regular_polygon(sides, side_m, "prism")?;
        Self::prism(&corners, height_m)
    }

    /// A pyramid over a regular polygon, its apex over the centre, its axis along z. Faces: the sides, beginning with the one
    /// that looks along -y and going counter-clockwise seen from +z; then the bottom.
    ///
    /// # Errors
    /// Fewer than three sides, too many, or a length that is not positive.
    pub fn regular_pyramid(sides: usize, side_m: f64, height_m: f64) -> Result<Self, PolyhedronError> {
        let mut vertices: Vec<_> = regular_polygon(sides, side_m, "pyramid")?
            .into_iter()
            .map(|[x, y]| Vector3::new(x, y, 0.0))
            .collect();
        check_length("the height", height_m)?;
        vertices.push(Vector3::z() * height_m);
        let mut loops: Vec<Vec<usize>> = (0..sides).map(|k| vec![k, (k + 1) % sides, sides]).collect();
        loops.push((0..sides).rev().collect());
        Self::from_loops(vertices, loops)
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
        let faces: Vec<Face> = loops.into_iter().map(|corners| Face::convex(&vertices_m, corners)).collect();
        let properties = mass::of(&vertices_m, faces.iter().flat_map(|face| &face.triangles));
        if !(properties.volume_m3 > 0.0 && properties.inertia_per_kg_m2.iter().all(|v| v.is_finite())) {
            return Err(PolyhedronError::NoVolume);
        }
        for vertex in &mut vertices_m {
            *vertex -= properties.centre_m;
        }
        let again = |face: Face| Face::convex(&vertices_m, face.corners);
        let faces: Vec<Face> = faces.into_iter().map(again).collect();
        // The centre of mass of a convex body lies below all of its faces.
        if faces.iter().any(|face| !(face.distance_m > 0.0)) {
            return Err(PolyhedronError::Unclear);
        }
        Ok(Self { vertices_m, faces })
    }
}

/// Corners of a regular polygon, counter-clockwise; the first side is the one that looks along -y.
fn regular_polygon(sides: usize, side_m: f64, shape: &'static str) -> Result<Vec<[f64; 2]>, PolyhedronError> {
    check_length("the length of a side", side_m)?;
    if sides < 3 {
        return Err(PolyhedronError::TooFewPoints { count: sides, least: 3, shape });
    }
    if sides > MAX_POINTS {
        return Err(PolyhedronError::TooManyPoints { count: sides });
    }
    let half_angle = std::f64::consts::PI / sides as f64;
    let radius = side_m / (2.0 * half_angle.sine_cosine().0);
    Ok((0..sides)
        .map(|k| {
            let (sine, cosine) = ((2 * k) as f64 * half_angle - half_angle).sine_cosine();
            // The angle counts from -y.
            [radius * sine, -radius * cosine]
        })
        .collect())
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
