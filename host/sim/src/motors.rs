//! The motors: what they make of the torques that the controller wants, and what that does in one control period.

use blindgrasp_body::MAX_JOINTS;
use blindgrasp_body::dynamics::JointVector;
use blindgrasp_model::Scene;
use blindgrasp_plant::{Lost, Plant};

/// The motors of a hand.
#[derive(Clone, Debug)]
pub struct Motors {
    torque_limits_nm: JointVector,
    /// Steps of the plant in a period.
    pub(crate) substeps: usize,
    /// The torques on the joints in the period before, if there was one, N m.
    applied_nm: Option<JointVector>,
}

impl Motors {
    /// Before the first period.
    pub fn new(scene: &Scene) -> Self {
        let mut torque_limits_nm = [f64::INFINITY; MAX_JOINTS];
        for (limit, joint) in torque_limits_nm.iter_mut().zip(&scene.joints) {
            *limit = joint.torque_limit_nm;
        }
        Self { torque_limits_nm, substeps: scene.substeps, applied_nm: None }
    }

    /// One period, with torques within what the motors can do. `see` is shown the plant as it is at the beginning, and the
    /// torques on its joints, N m.
    ///
    /// # Errors
    /// In which sub-step, and how, the grasp was lost.
    pub fn turn(
        &mut self,
        plant: &mut Plant,
        wanted_nm: &[f32; MAX_JOINTS],
        mut see: impl FnMut(&Plant, &JointVector),
    ) -> Result<(), (usize, Lost)> {
        let limits_nm = &self.torque_limits_nm;
        let now_nm: JointVector =
            std::array::from_fn(|k| f64::from(wanted_nm[k]).clamp(-limits_nm[k], limits_nm[k]));
        let before_nm = self.applied_nm.replace(now_nm).unwrap_or(now_nm);
        // The torques change at the very instant of the first sub-step, whose kick covers half a sub-step on either side:
        // it gets their mean, which keeps the integrator's second order.
        let mut torques_nm: JointVector = std::array::from_fn(|k| 0.5 * (before_nm[k] + now_nm[k]));
        for substep in 0..self.substeps {
            plant.solve(&torques_nm).map_err(|lost| (substep, lost))?;
            if substep == 0 {
                see(plant, &now_nm);
                torques_nm = now_nm;
            }
            plant.advance();
        }
        Ok(())
    }
}
