//! The output delay: what the controller wants, on its way to the motors.

use blindgrasp_body::MAX_JOINTS;
use std::collections::VecDeque;

type Torques = [f32; MAX_JOINTS];

/// Torques that are under way, N m.
///
/// A controller that reads first and writes last is one period late; buses and amplifiers that take longer add to it.
#[derive(Clone, Debug)]
pub struct Delay {
    under_way: VecDeque<Torques>,
}

impl Delay {
    /// So many control periods long, with the same torques all along it, N m. What is left of a period beyond whole ones is the
    /// [motors'](crate::motors).
    pub fn new(ticks: f64, torques_nm: Torques) -> Self {
        Self { under_way: std::iter::repeat_n(torques_nm, ticks as usize).collect() }
    }

    /// Takes the torques of this period, and gives those that reach the motors in it, N m.
    pub fn pass(&mut self, computed_nm: Torques) -> Torques {
        self.under_way.push_back(computed_nm);
        self.under_way.pop_front().unwrap_or(computed_nm)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Simulation;
    use blindgrasp_model::Scene;

    /// The torques on the joints are those that the controller wanted so many ticks before, or when it was armed.
    #[test]
    fn a_run_applies_what_was_wanted_before() {
        for ticks in [0, 1, 5] {
            let set = ["duration_s=0.2".to_owned(), format!("actuators.output_delay_ticks={ticks}")];
            let scene = Scene::load("cube", &set).unwrap();
            let (mut wanted_nm, mut applied_nm) = (Vec::new(), Vec::new());
            let mut simulation = Simulation::new(&scene).unwrap();
            while let Ok(Some(step)) = simulation.step() {
                wanted_nm.push(step.controller.record().unwrap().torques_nm);
                applied_nm.extend(step.sample.map(|sample| sample.torques_nm.clone()));
            }
            assert!(simulation.summary().grasp_held && applied_nm.len() == 201);
            for (tick, applied_nm) in applied_nm.into_iter().enumerate() {
                // The first that it wanted was for the tick that armed it.
                let then = &wanted_nm[(tick + 1).saturating_sub(ticks)];
                let then: Vec<f64> = then.as_slice().iter().map(|torque| f64::from(*torque)).collect();
                assert_eq!(applied_nm, then, "{tick}");
            }
        }
    }

    #[test]
    fn torques_come_as_many_periods_later() {
        for ticks in [0, 1, 2, 7] {
            let mut delay = Delay::new(f64::from(ticks), [-1.0; MAX_JOINTS]);
            for now in 0..20 {
                let expected = if now < ticks { -1.0 } else { (now - ticks) as f32 };
                assert_eq!(delay.pass([now as f32; MAX_JOINTS]), [expected; MAX_JOINTS], "{ticks} at {now}");
            }
        }
    }
}
