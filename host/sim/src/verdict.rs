//! The judgement on a grasp whose contacts have friction: a fingertip that bounces has lost nothing, an object that is gone is.
//!
//! An object lies on a table, is in the hand, or was put down. It gets into the hand when two fingertips touch it while the hand
//! grasps. As long as it lies on a table that has not gone away, what never was in the hand is not grasped yet; and what the hand lets
//! go of there is put down, unless the hand still means to hold it.

use blindgrasp_plant::coulomb::{Pair, Plant as Coulomb};
use blindgrasp_plant::{Lost, Plant};
use blindgrasp_shared::supervisor::Mode;
use nalgebra::Vector3;
use serde::{Deserialize, Serialize};

/// Time without touch, or on a table that goes away, after which an object is lost, s.
const PATIENCE_S: f64 = 0.2;
/// Time without a table after which an object counts as lifted, s: longer than its corners bounce.
const LIFTED_S: f64 = 0.05;
/// Way that an object may fall onto a table and still be put down, m.
const SET_DOWN_M: f64 = 5e-3;
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
    /// The object was in the hand, and lies where the hand let go of it.
    PutDown,
    /// The object was in the hand, and is no more.
    Dropped,
    /// The object never was in the hand: no two fingertips touched it at once while the hand grasped.
    NeverGrasped,
    /// An assumption of the model no longer holds.
    Lost,
}

impl Outcome {
    /// Of a run that was lost or not, in which the object was put down or not, and each fingertip slipped by so much, m.
    pub fn of(lost: Option<Lost>, is_put_down: bool, slipped_m: &[f64]) -> Self {
        match lost {
            Some(Lost::NeverGrasped) => Self::NeverGrasped,
            Some(Lost::Untouched | Lost::Away | Lost::OnTable) => Self::Dropped,
            Some(_) => Self::Lost,
            None if is_put_down => Self::PutDown,
            None if slipped_m.iter().any(|&slipped_m| slipped_m > SLIPPED_M) => Self::Slipped,
            None => Self::Held,
        }
    }
}

/// The place of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Place {
    /// Nobody has looked yet, or there is nothing to judge.
    Unknown,
    /// It has not been in the hand.
    Waiting,
    /// In the hand.
    InHand {
        /// From the middle of the fingertips to the object, in the object's own frame, when two fingertips touched first, m.
        home_m: Vector3<f64>,
        /// It has been off all tables since.
        is_lifted: bool,
    },
    /// On a table, where the hand let go of it.
    PutDown,
}

/// The object at one instant.
#[derive(Clone, Copy, Debug)]
struct Seen {
    /// The hand means to hold it.
    grasps: bool,
    /// Fingertips that touch it.
    fingers: u32,
    /// The way that the table under it has gone since the start, m; none without one.
    table_gone_m: Option<f64>,
    /// From the middle of the fingertips, in its own frame, m.
    there_m: Vector3<f64>,
    /// Its position, m.
    position_m: Vector3<f64>,
}

/// Watches a plant with friction; one whose contacts roll judges itself.
#[derive(Clone, Debug)]
pub struct Judge {
    period_s: f64,
    place: Place,
    /// The hand means to hold the object.
    grasps: bool,
    /// The place where a fingertip touched it last, m.
    let_go_m: Vector3<f64>,
    /// The way that its table had gone when it was grasped, m.
    table_gone_m: f64,
    untouched_s: f64,
    off_tables_s: f64,
    on_gone_table_s: f64,
}

impl Judge {
    /// Before the first tick of a period.
    pub fn new(period_s: f64) -> Self {
        Self {
            period_s,
            place: Place::Unknown,
            grasps: false,
            let_go_m: Vector3::zeros(),
            table_gone_m: 0.0,
            untouched_s: 0.0,
            off_tables_s: 0.0,
            on_gone_table_s: 0.0,
        }
    }

    /// Returns `true` if the object was in the hand, and was put down.
    pub fn is_put_down(&self) -> bool {
        self.place == Place::PutDown
    }

    /// Returns the verdict on a run that ends now, with nothing lost so far: what still waits on its table was never grasped.
    pub fn at_end(&self) -> Option<Lost> {
        (self.place == Place::Waiting).then_some(Lost::NeverGrasped)
    }

    /// Looks at the plant once a period, after it was solved for, with the mode of the controller. Returns why the object is lost, if
    /// it is.
    pub fn see(&mut self, plant: &Plant, mode: Mode) -> Option<Lost> {
        let Plant::Coulomb(friction) = plant else { return None };
        // A fault is no intention.
        if mode != Mode::Fault {
            self.grasps = mode.is_grasp() && mode != Mode::Releasing;
        }
        self.judge(&Seen::of(friction, self.grasps), plant.model().object.shape.radius_m())
    }

    fn judge(&mut self, seen: &Seen, half_size_m: f64) -> Option<Lost> {
        // A table that has gone by half the object's size should have left it in the hand.
        let is_gone = seen.table_gone_m.is_some_and(|gone_m| gone_m - self.table_gone_m > half_size_m);
        let count = |for_s: &mut f64, is: bool, patience_s: f64| {
            *for_s = if is { *for_s + self.period_s } else { 0.0 };
            *for_s > patience_s
        };
        let is_untouched = count(&mut self.untouched_s, seen.fingers == 0, PATIENCE_S);
        let is_off_tables = count(&mut self.off_tables_s, seen.table_gone_m.is_none(), LIFTED_S);
        let is_on_gone_table = count(&mut self.on_gone_table_s, is_gone, PATIENCE_S);
        if seen.fingers > 0 {
            self.let_go_m = seen.position_m;
        }
        if seen.grasps && seen.fingers >= 2 && !matches!(self.place, Place::InHand { .. }) {
            self.place = Place::InHand { home_m: seen.there_m, is_lifted: false };
            self.table_gone_m = seen.table_gone_m.unwrap_or_default();
        }
        match &mut self.place {
            Place::Unknown | Place::Waiting => {
                self.place = Place::Waiting;
                let is_falling = is_untouched && is_off_tables;
                (is_falling || is_on_gone_table).then_some(Lost::NeverGrasped)
            }
            Place::InHand { home_m, is_lifted } => {
                *is_lifted |= is_off_tables;
                let moved_m = (seen.there_m - *home_m).norm();
                if is_on_gone_table && (!*is_lifted || moved_m > 0.5 * half_size_m) {
                    return Some(Lost::OnTable);
                }
                if *is_lifted && moved_m > 2.0 * half_size_m {
                    return Some(Lost::Away);
                }
                if !is_untouched {
                    return None;
                }
                let is_set_down =
                    !seen.grasps && !is_off_tables && (seen.position_m - self.let_go_m).norm() < SET_DOWN_M;
                if !is_set_down {
                    return Some(Lost::Untouched);
                }
                self.place = Place::PutDown;
                None
            }
            Place::PutDown => (is_untouched && self.off_tables_s > PATIENCE_S).then_some(Lost::Untouched),
        }
    }
}

impl Seen {
    fn of(plant: &Coulomb, grasps: bool) -> Self {
        let motion = plant.motion();
        let (mut fingers, mut table_gone_m) = (0u32, None);
        for contact in plant.contacts().iter().filter(|contact| contact.normal_n > 0.0) {
            match contact.touch.pair {
                Pair::FingertipObject { finger, .. } => fingers |= 1 << finger,
                Pair::ObjectTable { table, .. } => {
                    let gone_m = plant.table_gone_m(table);
                    table_gone_m = Some(table_gone_m.map_or(gone_m, |most_m: f64| most_m.max(gone_m)));
                }
                _ => {}
            }
        }
        let centres_m = &plant.posture().centres_m[..plant.model().hand.fingertip_count()];
        let middle_m = centres_m.iter().sum::<Vector3<f64>>() / centres_m.len() as f64;
        Self {
            grasps,
            fingers: fingers.count_ones(),
            table_gone_m,
            there_m: motion.attitude.inverse() * (motion.position_m - middle_m),
            position_m: motion.position_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f64 = 1e-3;
    /// Half the size of the object, m.
    const HALF_M: f64 = 0.04;

    /// The object touched by so many fingertips of a hand that grasps, on a table or not, so high above where it was at the start, and
    /// so far from where the hand had it, m.
    fn seen(fingers: u32, table_gone_m: Option<f64>, height_m: f64, from_hand_m: f64) -> Seen {
        let (there_m, position_m) = (Vector3::z() * from_hand_m, Vector3::z() * height_m);
        Seen { grasps: true, fingers, table_gone_m, there_m, position_m }
    }

    /// The same, of a hand that means to let go, or not to grasp yet.
    fn open(fingers: u32, table_gone_m: Option<f64>, height_m: f64, from_hand_m: f64) -> Seen {
        Seen { grasps: false, ..seen(fingers, table_gone_m, height_m, from_hand_m) }
    }

    /// The word on a course of instants, each for so many milliseconds, and how long it took, ms.
    fn word(course: &[(u32, Seen)]) -> (Outcome, u32) {
        let (mut judge, mut at_ms) = (Judge::new(PERIOD_S), 0);
        for (for_ms, seen) in course {
            for _ in 0..*for_ms {
                at_ms += 1;
                if let Some(lost) = judge.judge(seen, HALF_M) {
                    return (Outcome::of(Some(lost), judge.is_put_down(), &[]), at_ms);
                }
            }
        }
        (Outcome::of(judge.at_end(), judge.is_put_down(), &[]), at_ms)
    }

    #[test]
    fn every_course_gets_its_word() {
        let waits = (1000, seen(0, Some(0.0), 0.0, 0.0));
        let grasped = (500, seen(3, Some(0.0), 0.0, 0.0));
        let held = (1000, seen(3, None, 0.0, 0.0));
        let back = (500, seen(3, Some(0.0), 0.0, 0.0));
        let part_way = (500, seen(3, Some(0.05), 0.0, 0.0));
        let opened = (1000, open(0, Some(0.0), 0.0, 0.0));
        for (course, outcome, end_ms) in [
            (&[waits][..], Outcome::NeverGrasped, 1000),
            // It falls, or its table goes without it having been touched.
            (&[(1000, seen(0, None, 0.0, 0.0))], Outcome::NeverGrasped, 201),
            (&[waits, (1000, seen(0, Some(0.05), -0.05, 0.05))], Outcome::NeverGrasped, 1201),
            // Pushed about by a fingertip, it still waits.
            (&[waits, (1000, seen(1, Some(0.0), 0.0, 0.1)), waits], Outcome::NeverGrasped, 3000),
            // So it does where the fingers close on it and let go again.
            (&[waits, (500, open(3, Some(0.0), 0.0, 0.0)), waits], Outcome::NeverGrasped, 2500),
            (&[waits, grasped], Outcome::Held, 1500),
            // Squeezed out of a hand that means to hold it.
            (&[grasped, waits], Outcome::Dropped, 701),
            // Moved on the table by the hand, farther than its size.
            (&[grasped, (500, seen(2, Some(0.0), 0.0, 0.1))], Outcome::Held, 1000),
            (&[waits, grasped, held], Outcome::Held, 2500),
            // A bounce off all fingertips is no loss.
            (&[grasped, (150, seen(0, None, 0.0, 0.0)), held], Outcome::Held, 1650),
            (&[waits, grasped, held, back, opened], Outcome::PutDown, 4000),
            // Touched once more on the way out.
            (&[grasped, opened, (100, open(2, Some(0.0), 0.0, 0.0)), opened], Outcome::PutDown, 2600),
            (&[grasped, opened], Outcome::PutDown, 1500),
            // The table need not come back all the way, and what was put down stays so wherever it then goes.
            (&[grasped, held, part_way, (1000, open(0, Some(0.05), 0.0, 0.0))], Outcome::PutDown, 3000),
            (&[grasped, opened, (1000, open(0, Some(0.2), -0.2, 0.3))], Outcome::PutDown, 2500),
            // From a little above the table; from more than that it is dropped.
            (
                &[grasped, held, (30, open(0, None, -2e-3, 0.0)), (500, open(0, Some(0.0), -4e-3, 0.0))],
                Outcome::PutDown,
                2030,
            ),
            (
                &[grasped, held, (60, open(0, None, -9e-3, 0.0)), (500, open(0, Some(0.0), -0.02, 0.0))],
                Outcome::Dropped,
                1701,
            ),
            (&[grasped, held, (1000, seen(0, None, -0.05, 0.05))], Outcome::Dropped, 1701),
            // It stays on the table that goes: the hand let go, or its fingertips still touch.
            (&[grasped, (500, seen(3, Some(0.05), -0.05, 0.05))], Outcome::Dropped, 701),
            (&[grasped, held, (500, seen(1, Some(0.1), -0.1, 0.03))], Outcome::Dropped, 1701),
            (&[grasped, held, (500, seen(1, None, -0.1, 0.09))], Outcome::Dropped, 1501),
            // Put down, grasped again and lifted: what counts is the new grasp.
            (&[grasped, held, back, opened, grasped, held], Outcome::Held, 4500),
            (
                &[grasped, held, back, opened, grasped, held, (500, seen(0, None, 0.0, 0.0))],
                Outcome::Dropped,
                4701,
            ),
        ] {
            let (said, at_ms) = word(course);
            assert_eq!(said, outcome, "{course:?}");
            // Times are sums of periods, which round.
            assert!(at_ms.abs_diff(end_ms) <= 1, "{at_ms} ms: {course:?}");
        }
    }
}
