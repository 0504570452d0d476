//! Shapes as triangles.

use super::palette::Rgb;
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// A triangle in the base frame of the hand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    /// m
    pub(super) corners: [Vector3<f64>; 3],
    /// Unit normals of the surface at the corners.
    pub(super) normals: [Vector3<f64>; 3],
    pub(super) colour: Rgb,
}

/// The triangles of one picture.
#[derive(Clone, Debug, Default)]
pub(super) struct Mesh {
    pub(super) solid: Vec<Triangle>,
    /// Faces of one body that one can look through.
    pub(super) glass: Vec<Triangle>,
    /// The triangles in front of everything.
    pub(super) marks: Vec<Triangle>,
}

/// Sides of a round shape: of a thin one, of most, and of one that fills much of the picture.
pub(super) const THIN: usize = 8;
pub(super) const ROUND: usize = 28;
pub(super) const WIDE: usize = 96;

impl Mesh {
    pub(super) fn sphere(&mut self, centre: Vector3<f64>, radius: f64, sides: usize, colour: Rgb) {
        let basis = [Vector3::x(), Vector3::y(), Vector3::z()];
        let rings: Vec<Vec<Vector3<f64>>> = (0..=sides / 2)
            .map(|k| {
                let (sine, cosine) = (std::f64::consts::TAU * k as f64 / sides as f64).sine_cosine();
                circle(&basis, sides).map(|rim| rim * sine + basis[2] * cosine).collect()
            })
            .collect();
        for pair in rings.windows(2) {
            for side in 0..sides {
                let normals =
                    [pair[0][side], pair[1][side], pair[1][(side + 1) % sides], pair[0][(side + 1) % sides]];
                self.quad(normals.map(|normal| centre + normal * radius), normals, colour);
            }
        }
    }

    /// A cylinder or a cone, closed at both ends.
    pub(super) fn cone(&mut self, ends: [Vector3<f64>; 2], radii: [f64; 2], sides: usize, colour: Rgb) {
        let length = (ends[1] - ends[0]).norm();
        if !(length > 0.0) {
            return;
        }
        let axis = (ends[1] - ends[0]) / length;
        let basis = basis(&axis);
        let lean = axis * (radii[0] - radii[1]) / length;
        let rim: Vec<Vector3<f64>> = circle(&basis, sides).collect();
        for side in 0..sides {
            let (a, b) = (rim[side], rim[(side + 1) % sides]);
            let corners = [
                ends[0] + a * radii[0],
                ends[0] + b * radii[0],
                ends[1] + b * radii[1],
                ends[1] + a * radii[1],
            ];
            let normals = [a, b, b, a].map(|rim| (rim + lean).normalize());
            self.quad(corners, normals, colour);
            for (end, out) in [(0, -axis), (1, axis)] {
                let corners = [ends[end], ends[end] + a * radii[end], ends[end] + b * radii[end]];
                self.triangle(corners, [out; 3], colour);
            }
        }
    }

    /// A piece of a flat face of glass.
    pub(super) fn pane(&mut self, corners: [Vector3<f64>; 3], normal: Vector3<f64>, colour: Rgb) {
        self.glass.push(Triangle { corners, normals: [normal; 3], colour });
    }

    /// All corners.
    pub(super) fn points(&self) -> impl Iterator<Item = &Vector3<f64>> {
        self.solid.iter().chain(&self.glass).chain(&self.marks).flat_map(|triangle| &triangle.corners)
    }

    fn quad(&mut self, corners: [Vector3<f64>; 4], normals: [Vector3<f64>; 4], colour: Rgb) {
        for [a, b, c] in [[0, 1, 2], [0, 2, 3]] {
            self.triangle([corners[a], corners[b], corners[c]], [normals[a], normals[b], normals[c]], colour);
        }
    }

    fn triangle(&mut self, corners: [Vector3<f64>; 3], normals: [Vector3<f64>; 3], colour: Rgb) {
        self.solid.push(Triangle { corners, normals, colour });
    }
}

/// A right-handed set of axes, the third along the unit vector `axis`.
pub(super) fn basis(axis: &Vector3<f64>) -> [Vector3<f64>; 3] {
    let helper = if axis.z.abs() < 0.9 { Vector3::z() } else { Vector3::x() };
    let first = helper.cross(axis).normalize();
    [first, axis.cross(&first), *axis]
}

/// Unit vectors all around the third axis.
fn circle(basis: &[Vector3<f64>; 3], sides: usize) -> impl Iterator<Item = Vector3<f64>> + '_ {
    (0..sides).map(move |k| {
        let (sine, cosine) = (std::f64::consts::TAU * k as f64 / sides as f64).sine_cosine();
        basis[0] * cosine + basis[1] * sine
    })
}
