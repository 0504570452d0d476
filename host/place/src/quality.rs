//! The quality of a placement: numbers that follow from the law's own equilibrium, and one that ranks.
//!
//! For every fingertip, with `A = f_d / sum(r)`, `F_i = A (x_c - x_i)` (Eq. 30) and `rho_i = r_i - dr_i`:
//!
//! - normal force `F_n = C_Y . F_i`, that of Eq. 57, and tangential force `F_t`, the rest of `F_i`; their ratio is the
//!   **friction** that the grasp asks for at its start;
//! - **turn** `theta_i`: how far the fingertip rolls until `u_st` carries `F_t` (Eqs. 53, 54), by [`rolling`](super::rolling);
//!   about `rho F_t / (2 N K_st)`. It moves on its face by `rho_i theta_i`;
//! - **margin** `m_i`: from the contact point to the nearest edge of the face;
//! - **conditioning**: smallest over largest singular value of its Jacobian `J_i`, over the joints that move it alone.
//!
//! For the grasp:
//!
//! - **unbalanced moment**: of all `rho_i C_Y x F_i`, which turns the object before the fingertips have rolled;
//! - **room**: the least distance of a joint from an end stop;
//! - **chance** to hold for 5 s in the paper's model, a logistic function of the least `m_i / rho_i` and of the root of the
//!   mean of `theta_i^2`:
//!
//! ```text
//! ln(chance / (1 - chance)) = O + a ln(min m_i / rho_i) - b/2 ln(mean theta_i^2 + theta_0^2)
//! ```
//!
//! The numbers O, a, b and `theta_0` were fitted to runs of placements of random polyhedra in the paper's hand. On 293 others the
//! area under the ROC curve, with which it tells grasps that hold from those that are lost, is 0.91 for the chance, 0.79 for
//! the turn alone, 0.83 for the largest friction and 0.78 for the unbalanced moment, which say what the turn says; the margin alone
//! has 0.55, room 0.47 and conditioning 0.51: nothing, in a model without end stops (`cargo test --release -p
//! blindgrasp-tests --test science polyhedra::terms -- --ignored --nocapture`).
//! The chance is that of the paper's hand and gains; elsewhere it ranks, and promises nothing.
//!
//! What **ranks** is the chance, times the room in units of 0.1 rad where it is less: there the soft end stops begin.

use super::facet::Facet;
use super::position::ROOM_RAD;
use super::rolling::{Coordinates, Gains, Rolling};
use super::stance::room;
use blindgrasp_body::inverse_kinematics::own_joints;
use blindgrasp_model::{Scene, posture};
use blindgrasp_shared::math::{Real, norm};
use nalgebra::{Matrix3, Vector3};
use serde::Serialize;

/// Exponent a of the margin.
pub(super) const MARGIN_EXPONENT: f64 = 4.0;
/// Exponent b of the turn.
pub(super) const ROLL_EXPONENT: f64 = 7.0;
/// `theta_0`, rad: something else always moves.
pub(super) const ROLL_FLOOR_RAD: f64 = 0.1;
/// O.
const OFFSET: f64 = -3.8;

/// The chance to hold, of the least margin in units of the rolling radius and the mean square turn (rad^2).
pub(super) fn chance(margin: f64, mean_square_turn: f64) -> f64 {
    let turn = (mean_square_turn + ROLL_FLOOR_RAD * ROLL_FLOOR_RAD).square_root();
    let exponent = OFFSET + MARGIN_EXPONENT * margin.max(1e-6).ln() - ROLL_EXPONENT * turn.ln();
    1.0 / (1.0 + (-exponent).exp())
}

/// Returns the rank: the chance, less where a joint is nearer to an end stop than where that begins to push.
pub(super) fn score(chance: f64, room_rad: f64) -> f64 {
    chance * (room_rad / ROOM_RAD).limited(0.0, 1.0)
}

/// The quality of a placement.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Quality {
    /// The rank of the placement: the chance to hold, less where a joint is close to an end stop.
    pub score: f64,
    /// The chance to hold for 5 s in the paper's model.
    pub chance: f64,
    /// Moment on the object before the fingertips have rolled, N m.
    pub unbalanced_moment_nm: f64,
    /// The least distance of a joint from an end stop, rad, of joints that the inverse kinematics turns.
    pub room_rad: f64,
    /// The joint that has it.
    pub tightest_joint: String,
    /// One a fingertip.
    pub fingertips: Vec<FingertipQuality>,
}

/// The quality of a contact.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FingertipQuality {
    /// Normal force of Eq. 57, N.
    pub normal_force_n: f64,
    /// Tangential part of the pull of the law, N.
    pub tangential_force_n: f64,
    /// Their ratio.
    pub friction: f64,
    /// Angle by which the fingertip rolls until it rests, rad.
    pub turn_rad: f64,
    /// Distance by which it moves on its face, m.
    pub rolled_m: f64,
    /// Distance of the contact point from the nearest edge of its face, m.
    pub margin_m: f64,
    /// Indentation at rest, of Eq. 57, m.
    pub indentation_m: f64,
    /// Smallest over largest singular value of its Jacobian.
    pub conditioning: f64,
}

impl Quality {
    /// Of the start of a scene. `None` where the law pulls a fingertip away from its face.
    pub fn of(scene: &Scene) -> Option<Self> {
        let count = scene.contacts.len();
        let facets: Vec<Facet> =
            scene.contacts.iter().map(|contact| Facet::of(&scene.object, contact.face)).collect();
        let facets: Vec<&Facet> = facets.iter().collect();
        let inwards: Vec<Vector3<f64>> = facets.iter().map(|facet| facet.inward).collect();
        let radii: Vec<f64> = scene.fingertips.iter().map(|fingertip| fingertip.radius_m).collect();
        let stiffnesses: Vec<f64> =
            scene.fingertips.iter().map(|fingertip| fingertip.stiffness_n_m2).collect();
        let points = &scene.start.points_m;
        let indentations = blindgrasp_body::equilibrium_indentations(
            points,
            &inwards,
            &radii,
            &stiffnesses,
            scene.control.force_n(),
        )
        .ok()?;
        let rolling_radii: Vec<f64> = radii.iter().zip(&indentations).map(|(r, dr)| r - dr).collect();
        let gains = Gains {
            approach_n_m: scene.control.force_n() / radii.iter().sum::<f64>(),
            attitude_nm: scene.control.attitude_stiffness_nm(),
        };
        let rolling = Rolling::new(&facets, &rolling_radii, gains);
        let mut z = Coordinates::zeros();
        for i in 0..count {
            let here = facets[i].coordinates(&points[i]);
            (z[2 * i], z[2 * i + 1]) = (here.x, here.y);
        }
        let mut moment = Vector3::zeros();
        let mut least_margin = f64::INFINITY;
        let fingertips: Vec<FingertipQuality> = (0..count)
            .map(|i| {
                let (normal, pull) = (rolling.normal_n(&z, i), rolling.pull_n(&z, i));
                let [x, y] = facets[i].axes;
                moment += facets[i].inward.cross(&(x * pull.x + y * pull.y)) * rolling_radii[i];
                let turn_rad = rolling.turn_rad(&z, i).norm();
                let margin_m = scene.object.margin_m(facets[i].face, &points[i]);
                least_margin = least_margin.min(margin_m / rolling_radii[i]);
                FingertipQuality {
                    normal_force_n: normal,
                    tangential_force_n: pull.norm(),
                    friction: pull.norm() / normal,
                    turn_rad,
                    rolled_m: turn_rad * rolling_radii[i],
                    margin_m,
                    indentation_m: indentations[i],
                    conditioning: conditioning(scene, i),
                }
            })
            .collect();
        let (room_rad, joint) = room(&scene.hand, &scene.start.angles_rad);
        let chance = chance(least_margin, rolling.mean_square_turn(&z));
        Some(Self {
            score: score(chance, room_rad),
            chance,
            unbalanced_moment_nm: norm(&moment),
            room_rad,
            tightest_joint: scene.joints[joint].name.clone(),
            fingertips,
        })
    }
}

/// Smallest over largest singular value of a fingertip's Jacobian, over the joints that move it alone.
fn conditioning(scene: &Scene, fingertip: usize) -> f64 {
    let posture = posture(&scene.hand, &scene.start.angles_rad);
    let (linear, _) = scene.hand.jacobians(&posture, fingertip);
    let mut square = Matrix3::zeros();
    for k in own_joints(&scene.hand, fingertip) {
        square += linear.column(k) * linear.column(k).transpose();
    }
    let squares = square.symmetric_eigenvalues();
    (squares.min().max(0.0) / squares.max().max(f64::MIN_POSITIVE)).square_root()
}
