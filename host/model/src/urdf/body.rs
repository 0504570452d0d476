//! Mass, centre and inertia of rigid bodies that move as one.

use super::transform::Transform;
use nalgebra::{Matrix3, Vector3};

/// A rigid body in the frame of the link that it is counted in.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Body {
    /// Mass, kg.
    pub(super) mass_kg: f64,
    /// Centre of mass, m.
    pub(super) centre_m: Vector3<f64>,
    /// Inertia about the centre of mass in the axes of the link, kg m^2.
    pub(super) inertia_kg_m2: Matrix3<f64>,
}

impl Body {
    /// No body.
    pub(super) fn none() -> Self {
        Self { mass_kg: 0.0, centre_m: Vector3::zeros(), inertia_kg_m2: Matrix3::zeros() }
    }

    pub(super) fn is_none(&self) -> bool {
        self.mass_kg == 0.0 && self.inertia_kg_m2 == Matrix3::zeros()
    }

    /// The same body in the coordinates of an outer frame.
    pub(super) fn seen_from(&self, frame: &Transform) -> Self {
        Self {
            mass_kg: self.mass_kg,
            centre_m: frame.point(&self.centre_m),
            inertia_kg_m2: symmetric(&(frame.attitude * self.inertia_kg_m2 * frame.attitude.transpose())),
        }
    }

    /// Several bodies of one frame as one: the parallel axis theorem about the common centre. One body stays as it is, to
    /// the bit.
    pub(super) fn merged(bodies: &[Self]) -> Self {
        let bodies: Vec<&Self> = bodies.iter().filter(|body| !body.is_none()).collect();
        match bodies[..] {
            [] => return Self::none(),
            [one] => return *one,
            _ => {}
        }
        let mass_kg: f64 = bodies.iter().map(|body| body.mass_kg).sum();
        let moment: Vector3<f64> = bodies.iter().map(|body| body.centre_m * body.mass_kg).sum();
        // Without mass there is nothing that a centre would matter to.
        let centre_m = if mass_kg > 0.0 { moment / mass_kg } else { Vector3::zeros() };
        let inertia_kg_m2 = bodies.iter().map(|body| {
            let arm = body.centre_m - centre_m;
            body.inertia_kg_m2
                + (Matrix3::identity() * arm.norm_squared() - arm * arm.transpose()) * body.mass_kg
        });
        Self { mass_kg, centre_m, inertia_kg_m2: inertia_kg_m2.sum() }
    }
}

/// Without what rounding adds to one half of a symmetric tensor.
fn symmetric(m: &Matrix3<f64>) -> Matrix3<f64> {
    (m + m.transpose()) * 0.5
}
