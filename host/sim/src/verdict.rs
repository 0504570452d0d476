//! The judgement on a grasp whose contacts have friction: a fingertip that bounces has lost nothing, an object that is gone is.

use blindgrasp_plant::coulomb::Pair;
use blindgrasp_plant::{Lost, Plant};
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Time without touch, or on a table that goes away, after which an object is lost, s.
const PATIENCE_S: f64 = 0.2;
/// Way that a fingertip may slip in a run while the object counts as held fast, m.
const SLIPPED_M: f64 = 1e-3;

/// The end of a run in a word.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Outcome {
    /// The object is in the hand, and was held fast.
    #[default]
    Held,
    /// The object is in the hand, but a fingertip slipped by more than a millimetre.
    Slipped,
    /// The object was in the hand, and is no more.
    Dropped,
    /// The object never was in the hand: no two fingertips ever touched it at once.
    NeverGrasped,
    /// An assumption of the model no longer holds.
    Lost,
}

impl Outcome {
    /// Of a run that was lost or not, in which each fingertip slipped by so much, m.
    pub fn of(lost: Option<Lost>, slipped_m: &[f64]) -> Self {
        match lost {
            Some(Lost::NeverGrasped) => Self::NeverGrasped,
            Some(Lost::Untouched | Lost::Away | Lost::OnTable) => Self::Dropped,
            Some(_) => Self::Lost,
            None if slipped_m.iter().any(|&slipped_m| slipped_m > SLIPPED_M) => Self::Slipped,
            None => Self::Held,
        }
    }
}

/// Watches a plant with friction; one whose contacts roll judges itself.
#[derive(Clone, Debug)]
pub struct Judge {
    period_s: f64,
    /// From the middle of the fingertips to the object, in the object's own frame, when two fingertips touched first, m.
    home_m: Option<Vector3<f64>>,
    untouched_s: f64,
    on_table_s: f64,
}

impl Judge {
    /// Before the first tick of a period.
    pub fn new(period_s: f64) -> Self {
        Self { period_s, home_m: None, untouched_s: 0.0, on_table_s: 0.0 }
    }

    /// Looks at the plant once a period, after it was solved for. Returns why the object is lost, if it is.
    pub fn see(&mut self, plant: &Plant) -> Option<Lost> {
        let Plant::Coulomb(friction) = plant else { return None };
        let motion = plant.motion();
        let touching = friction.contacts().iter().filter(|contact| contact.normal_n > 0.0);
        // A table that has gone by half the object's size should have left it in the hand, however far that has sunk.
        let half_size_m = plant.model().object.shape.radius_m();
        let (mut fingers, mut on_table) = (0u32, false);
        for contact in touching {
            match contact.touch.pair {
                Pair::FingertipObject { finger, .. } => fingers |= 1 << finger,
                Pair::ObjectTable { table, .. } => on_table |= friction.table_gone_m(table) > half_size_m,
                _ => {}
            }
        }
        let count = |for_s: &mut f64, is: bool| {
            *for_s = if is { *for_s + self.period_s } else { 0.0 };
            *for_s > PATIENCE_S
        };
        let is_untouched = count(&mut self.untouched_s, fingers == 0);
        let is_on_table = count(&mut self.on_table_s, on_table);
        let centres_m = &plant.posture().centres_m[..plant.model().hand.fingertip_count()];
        let middle_m = centres_m.iter().sum::<Vector3<f64>>() / centres_m.len() as f64;
        let there_m = motion.attitude.inverse() * (motion.position_m - middle_m);
        if fingers.count_ones() >= 2 && self.home_m.is_none() {
            self.home_m = Some(there_m);
        }
        match self.home_m {
            None if is_untouched || is_on_table => Some(Lost::NeverGrasped),
            None => None,
            Some(_) if is_untouched => Some(Lost::Untouched),
            Some(_) if is_on_table => Some(Lost::OnTable),
            Some(home_m) => ((there_m - home_m).norm() > 2.0 * half_size_m).then_some(Lost::Away),
        }
    }
}
