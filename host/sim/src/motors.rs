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
    /// The instant of a period at which the torques on the joints change, in steps of the plant: what the output delay has
    /// beyond whole periods.
    change: f64,
    /// The torques of the two periods before, the later first, if there were any, N m.
    before_nm: Option<[JointVector; 2]>,
}

impl Motors {
    /// Before the first period.
    pub fn new(scene: &Scene) -> Self {
        let mut torque_limits_nm = [f64::INFINITY; MAX_JOINTS];
        for (limit, joint) in torque_limits_nm.iter_mut().zip(&scene.joints) {
            *limit = joint.torque_limit_nm;
        }
        let substeps = scene.substeps;
        let change = scene.actuators.output_delay_ticks.fract() * substeps as f64;
        Self { torque_limits_nm, substeps, change, before_nm: None }
    }

    /// One period, at whose instant of change the torques become the wanted ones, within what the motors can do. `see` is shown
    /// the plant as it is at the beginning, and the torques on its joints, N m.
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
        let [before_nm, earlier_nm] = self.before_nm.unwrap_or([now_nm; 2]);
        self.before_nm = Some([now_nm, before_nm]);
        for substep in 0..self.substeps {
            let torques_nm = self.kick_nm(substep, &now_nm, &before_nm, &earlier_nm);
            plant.solve(&torques_nm).map_err(|lost| (substep, lost))?;
            if substep == 0 {
                see(plant, if self.change > 0.0 { &before_nm } else { &now_nm });
            }
            plant.advance();
        }
        Ok(())
    }

    /// The torques of a sub-step, N m. Its kick covers half a sub-step on either side of its instant, and gets their mean there: so
    /// impulses are exact wherever in a sub-step torques change, and the integrator keeps its second order.
    fn kick_nm(
        &self,
        substep: usize,
        now_nm: &JointVector,
        before_nm: &JointVector,
        earlier_nm: &JointVector,
    ) -> JointVector {
        // Shares of the kick behind this period's change, and behind the one of the period before.
        let behind = |change: f64| (substep as f64 + 0.5 - change).clamp(0.0, 1.0);
        let (now, before) = (behind(self.change), behind(self.change - self.substeps as f64));
        if now == 1.0 {
            return *now_nm;
        }
        std::array::from_fn(|k| {
            now * now_nm[k] + (before - now) * before_nm[k] + (1.0 - before) * earlier_nm[k]
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// However late torques come, in whatever part of a sub-step, they act for as long as they should.
    #[test]
    fn impulses_are_exact() {
        let torque = |period: i32| f64::from(period * period);
        for (delay_ticks, substeps) in [(1.0, 2), (1.3, 2), (0.1, 10), (0.95, 3), (0.7, 1), (5.5, 4)] {
            let set = [
                format!("actuators.output_delay_ticks={delay_ticks}"),
                format!("plant.substep_s={}", 1e-3 / f64::from(substeps)),
            ];
            let motors = Motors::new(&Scene::load("cube", &set).unwrap());
            let all = |period| [torque(period); MAX_JOINTS];
            // In sub-steps: the first kick begins half of one early, when the torques of the period before were on.
            let (mut applied, periods) = (0.0, 7);
            for period in 1..=periods {
                for substep in 0..motors.substeps {
                    applied += motors.kick_nm(substep, &all(period), &all(period - 1), &all(period - 2))[0];
                }
            }
            let change = f64::from(substeps) * f64::fract(delay_ticks);
            let held = |from: f64, to: f64| {
                let part = |period: i32| {
                    let begin = f64::from((period - 1) * substeps) + change;
                    torque(period) * (to.min(begin + f64::from(substeps)) - from.max(begin)).max(0.0)
                };
                (-1..=periods).map(part).sum::<f64>()
            };
            let expected = held(-0.5, f64::from(periods * substeps) - 0.5);
            assert!(
                (applied - expected).abs() < 1e-12 * expected,
                "{delay_ticks} {substeps}: {applied} {expected}"
            );
        }
    }
}
