//! Shapes of links, and the capsules that stand for them where links touch.
//!
//! Capsules lie inside the shapes that they stand for, so that nothing touches which is apart. What is flat is filled with capsules
//! beside each other, as thick as it is.

use super::transform::Transform;
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// The most capsules beside each other in a flat shape; a wider one has gaps.
const MOST_BESIDE: f64 = 8.0;
/// Places and radii that differ by less are the same, m.
const SAME_M: f64 = 1e-6;

/// A sphere, box, cylinder or capsule of a link.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Shape {
    pub(super) solid: Solid,
    /// Its own frame, with its middle as the origin, in the link's frame.
    pub(super) pose: Transform,
    /// `true` for a `<collision>`, `false` for a `<visual>`.
    pub(super) is_collision: bool,
}

/// Form and size of a shape; what is round is so about z.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Solid {
    Sphere {
        radius_m: f64,
    },
    /// The length is that between the middles of the rounded ends.
    Capsule {
        radius_m: f64,
        length_m: f64,
    },
    Cylinder {
        radius_m: f64,
        length_m: f64,
    },
    Box {
        sides_m: [f64; 3],
    },
}

/// All points within a radius of a line.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Round {
    pub(super) ends_m: [Vector3<f64>; 2],
    pub(super) radius_m: f64,
}

impl Shape {
    /// Its middle in the link's frame, m.
    pub(super) fn centre_m(&self) -> Vector3<f64> {
        self.pose.offset_m
    }

    /// Radius of the largest sphere that fits into it, m.
    pub(super) fn radius_m(&self) -> f64 {
        match self.solid {
            Solid::Sphere { radius_m } | Solid::Capsule { radius_m, .. } => radius_m,
            Solid::Cylinder { radius_m, length_m } => radius_m.min(0.5 * length_m),
            Solid::Box { sides_m } => 0.5 * sides_m.into_iter().fold(f64::INFINITY, f64::min),
        }
    }

    /// The same, seen from the frame that the link's is given in.
    pub(super) fn seen_from(&self, frame: &Transform) -> Self {
        Self { pose: frame.then(&self.pose), ..*self }
    }

    /// The middles of its rounded ends, m; of other shapes the middle twice.
    pub(super) fn ends_m(&self) -> [Vector3<f64>; 2] {
        let half_m = match self.solid {
            Solid::Capsule { length_m, .. } => 0.5 * length_m,
            _ => 0.0,
        };
        [-half_m, half_m].map(|z| self.pose.point(&(Vector3::z() * z)))
    }

    /// Returns `true` if a sphere is this one, or the one in its middle that fills it.
    pub(super) fn is_at(&self, centre_m: &Vector3<f64>, radius_m: f64) -> bool {
        let is_sphere = matches!(self.solid, Solid::Sphere { .. });
        (self.centre_m() - centre_m).norm() < SAME_M
            && (is_sphere || (self.radius_m() - radius_m).abs() < SAME_M)
    }

    /// The capsules that fill it, in the link's frame.
    fn filling(&self) -> Vec<Round> {
        let radius_m = self.radius_m();
        let along = |across: Vector3<f64>, along: Vector3<f64>| Round {
            ends_m: [across - along, across + along].map(|end_m| self.pose.point(&end_m)),
            radius_m,
        };
        match self.solid {
            Solid::Sphere { .. } | Solid::Capsule { .. } => vec![Round { ends_m: self.ends_m(), radius_m }],
            Solid::Cylinder { radius_m: wide_m, length_m } if length_m > 2.0 * wide_m => {
                vec![along(Vector3::zeros(), Vector3::z() * (0.5 * length_m - radius_m))]
            }
            Solid::Cylinder { radius_m: wide_m, .. } => {
                let rim_m = wide_m - radius_m;
                let chord_m = |y: f64| (rim_m * rim_m - y * y).max(0.0).square_root();
                let beside = beside_m(2.0 * wide_m, radius_m);
                beside.map(|y| along(Vector3::y() * y, Vector3::x() * chord_m(y))).collect()
            }
            Solid::Box { sides_m } => {
                let mut order = [0, 1, 2];
                order.sort_by(|&a, &b| sides_m[a].total_cmp(&sides_m[b]));
                let [_, middle, long] = order.map(|k| Vector3::ith_axis(k).into_inner());
                let reach = long * (0.5 * sides_m[order[2]] - radius_m);
                beside_m(sides_m[order[1]], radius_m).map(|y| along(middle * y, reach)).collect()
            }
        }
    }
}

impl Round {
    /// The longest part that leaves a fingertip on its link free: its rounded end does not pass the fingertip's centre. `None` if
    /// there is none.
    pub(super) fn clear_of(&self, centre_m: &Vector3<f64>, radius_m: f64) -> Option<Self> {
        let [from_m, to_m] = self.ends_m;
        let (way, apart) = (to_m - from_m, from_m - centre_m);
        let reach_m = radius_m.max(self.radius_m);
        // Where the line is as far away as it has to be: at^2 a + 2 at b + c = 0.
        let (a, b, c) = (way.norm_squared(), apart.dot(&way), apart.norm_squared() - reach_m * reach_m);
        let discriminant = b * b - a * c;
        if !(discriminant > 0.0) {
            return (c >= 0.0).then_some(*self);
        }
        let [enters, leaves] = [-1.0, 1.0].map(|sign| (sign * discriminant.square_root() - b) / a);
        let (before, behind) = (enters.min(1.0), 1.0 - leaves.max(0.0));
        let at = |share: f64| from_m + way * share;
        if before <= 0.0 && behind <= 0.0 {
            None
        } else if before >= behind {
            Some(Self { ends_m: [from_m, if before < 1.0 { at(before) } else { to_m }], ..*self })
        } else {
            Some(Self { ends_m: [if behind < 1.0 { at(leaves) } else { from_m }, to_m], ..*self })
        }
    }
}

/// Places of capsules beside each other that cover a width, m.
fn beside_m(width_m: f64, radius_m: f64) -> impl Iterator<Item = f64> {
    let count = (width_m / (2.0 * radius_m) - SAME_M).ceil().clamp(1.0, MOST_BESIDE);
    let outermost = 0.5 * width_m - radius_m;
    (0..count as usize).map(move |k| match count {
        1.0 => 0.0,
        _ => outermost * (2.0 * k as f64 / (count - 1.0) - 1.0),
    })
}

/// The capsules of shapes, beside fingertips with these centres and radii (m) on the same link: to the bit where a cylinder with
/// two spheres on its ends says one, since URDF has no word for it; else those that fill a shape. A shape that became a fingertip has
/// none.
pub(super) fn capsules(shapes: &[Shape], fingertips: &[(Vector3<f64>, f64)]) -> Vec<Round> {
    let mut capsules = Vec::new();
    let mut rest = shapes;
    while let Some((shape, behind)) = rest.split_first() {
        rest = behind;
        if let [first, second, behind @ ..] = behind
            && let Some(capsule) = rounded(shape, [first, second])
        {
            capsules.push(capsule);
            rest = behind;
        } else if fingertips.iter().all(|(centre_m, radius_m)| !shape.is_at(centre_m, *radius_m)) {
            let mut filling = shape.filling();
            if !matches!(shape.solid, Solid::Sphere { .. }) {
                for (centre_m, radius_m) in fingertips {
                    filling = filling.iter().filter_map(|it| it.clear_of(centre_m, *radius_m)).collect();
                }
            }
            capsules.append(&mut filling);
        }
    }
    capsules
}

/// The capsule that a cylinder makes with spheres on its ends.
fn rounded(cylinder: &Shape, spheres: [&Shape; 2]) -> Option<Round> {
    let Solid::Cylinder { radius_m, length_m } = cylinder.solid else { return None };
    let is_end = |sphere: &Shape, sign: f64| {
        let end_m = cylinder.pose.point(&(Vector3::z() * (0.5 * sign * length_m)));
        matches!(sphere.solid, Solid::Sphere { radius_m: other_m } if (other_m - radius_m).abs() < SAME_M)
            && (sphere.centre_m() - end_m).norm() < SAME_M
    };
    let [first, second] = spheres;
    let is_capsule =
        (is_end(first, -1.0) && is_end(second, 1.0)) || (is_end(first, 1.0) && is_end(second, -1.0));
    is_capsule.then(|| Round { ends_m: [first.centre_m(), second.centre_m()], radius_m: first.radius_m() })
}
