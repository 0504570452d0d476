//! The materials of all contacts of a plant: as stiff as they are, or as the step resolves.

use super::material::Material;
use super::placed::Placed;
use crate::mass::MassFactor;
use crate::model::{ObjectModel, PlantModel};
use crate::vectors::{Everything, dot};
use blindgrasp_body::{CORNER_STIFFNESS_N_M, Hand, MAX_JOINTS};
use blindgrasp_shared::math::Real;
use nalgebra::Vector3;

/// Stiffness of the end of a joint's range, N m/rad.
const LIMIT_NM: f64 = 20.0;
/// Damping of both, of critical.
const DAMPING: f64 = 1.75;
/// Materials, prepared once.
#[derive(Clone, Debug)]
pub(super) struct Materials {
    pub(super) fingertips: Vec<Material>,
    pub(super) corner: Material,
    pub(super) limits: Vec<Material>,
}

impl Materials {
    /// Of a model without joint limits.
    pub(super) fn new(model: &PlantModel, step_s: f64) -> Self {
        Self {
            fingertips: model.fingertips.iter().map(Material::of_fingertip).collect(),
            corner: corner(model, step_s),
            limits: Vec::new(),
        }
    }
}

/// The material of the object's corners on a table: as stiff as the step resolves, with damping by the object's mass.
///
/// It is one for all corners and the whole run, so that their energy is a potential: `n` corners of a face at once, each with
/// `h^2 k n (J M^-1 J^T) <= 1` in any direction, stay within what the leapfrog resolves.
pub(super) fn corner(model: &PlantModel, step_s: f64) -> Material {
    let object = &model.object;
    let corners = object.shape.faces.iter().map(|face| face.corners.len()).max().unwrap_or(1) as f64;
    let most = object_yields_per_kg(object);
    let stiffness_n_m = CORNER_STIFFNESS_N_M.min(1.0 / (corners * step_s * step_s * most));
    let critical_n_s_m = 2.0 * (stiffness_n_m * object.mass_kg / corners).square_root();
    Material::spring(stiffness_n_m, DAMPING * critical_n_s_m)
}

/// Acceleration of an object's vertex for each newton there, 1/kg: that of the vertex that yields most, or more.
pub(super) fn object_yields_per_kg(object: &ObjectModel) -> f64 {
    let inverse = object.inertia_kg_m2.try_inverse().unwrap_or_default();
    let yields = |vertex_m: &Vector3<f64>| {
        let lever = vertex_m.cross_matrix();
        // The trace is above the largest eigenvalue.
        1.0 / object.mass_kg + (lever * inverse * lever.transpose()).trace()
    };
    object.shape.vertices_m.iter().map(yields).fold(0.0, f64::max)
}

/// Acceleration of a point of a link for each newton there, 1/kg: the sum over three directions, which is above the largest.
pub(super) fn yields_per_kg(
    mass: &MassFactor,
    placed: &Placed,
    hand: &Hand,
    link: usize,
    point_m: &Vector3<f64>,
) -> f64 {
    let along = |axis: usize| {
        let mut row = Everything::ZERO;
        let mut at = Some(link);
        while let Some(joint) = at {
            let pose = placed.posture.link(joint);
            row.joints[joint] = pose.axis().cross(&(point_m - pose.origin_m))[axis];
            at = hand.parent(joint);
        }
        mass.whiten(&mut row);
        dot(&row.joints, &row.joints, MAX_JOINTS)
    };
    (0..3).map(along).sum()
}

/// The material of what is hard, where both bodies together yield so much, as the sum over three directions: as stiff as the step
/// resolves.
pub(super) fn hard(yields_per_kg: f64, step_s: f64) -> Material {
    let stiffness_n_m = CORNER_STIFFNESS_N_M.min(1.0 / (step_s * step_s * yields_per_kg));
    Material::spring(stiffness_n_m, DAMPING * 2.0 * (stiffness_n_m / yields_per_kg).square_root())
}

/// The materials of the ends of the joints' ranges, by the joints' inertia at the start.
pub(crate) fn limits(mass: &MassFactor, joints: usize, step_s: f64) -> Vec<Material> {
    let limit = |joint: usize| {
        let mut row = Everything::ZERO;
        row.joints[joint] = 1.0;
        mass.whiten(&mut row);
        let inertia_kg_m2 = 1.0 / dot(&row.joints, &row.joints, MAX_JOINTS);
        // A quarter, since the inertia changes with the posture.
        let stiffness_nm = LIMIT_NM.min(0.25 * inertia_kg_m2 / (step_s * step_s));
        Material::spring(stiffness_nm, DAMPING * 2.0 * (stiffness_nm * inertia_kg_m2).square_root())
    };
    (0..joints).map(limit).collect()
}
