//! The energy ledger: what the motors did, what the law's damping took of it, and what they did beyond the law.
//!
//! The blind controller knows neither the object nor any kinetic energy. But it knows its potentials `V`, and the work
//! of the motors: torques times the turns of the joints. Every tick enters
//!
//! ```text
//! work      the motors' work on the hand, and by it on the world; negative where the world works on the motors
//! damped    dq^T C dq: what the law's damping takes, at the estimated speeds
//! excess    work less the drop of the potentials
//! ```
//!
//! **The balance.** A passive law does no work but what its potentials give, less what its damping takes. So, as
//! long as torques are what the law asks for, and when it asks, `work = -(change of V) - damped`, and the excess is what
//! the damping takes, with a minus. Whatever else turns up in it was fed by the controller in spite of its law:
//! torques that are held for a tick, and come late; speeds that are estimated late; limits that cut off and give back.
//! Energy that the controller puts into a swing is seen as excess. Energy that somebody puts in from outside is not: the
//! potentials rise, and the work is what they take. Nor is a motor or an encoder the wrong way round, which looks the same;
//! or an encoder of the wrong scale, since both sides of the balance are reckoned from it.
//!
//! - `V` is the sum of the potentials of the laws' gains, less the potential energy of the links' weight that is held. Each
//!   but the last is its gain times a function of the posture. Gains that change (soft start, release) give and take potential
//!   without any work: the drop is taken at the gains of the tick before.
//! - A **target** that moves, or a reference that is followed by a spring, brings energy in by the force on it times its way. What
//!   the joints do for it was not fed by delays: it is taken off.
//! - **Turns** are those of the counts themselves: the filter's angles are late. Over a way they err by a count in all,
//!   however long it is.
//! - **Torques** are the mean of the last two. What a tick computes acts from its end, or from the next tick on, as the
//!   amplifiers have it; the mean errs by half a tick either way.
//!
//! **Digits.** Work and damping are added up since the grasp began, for hours, in single precision: each sum keeps
//! what rounding takes from it (Kahan), so that it errs by its own rounding, one part in 16 million, and not by that of
//! millions of entries. The excess fades: of what was done a second ago 1/e counts. It cannot lose digits, and it does not let
//! an hour of damping make up for a second of swing.

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::control::{Account, PerGain};
use crate::estimate::Motion;

/// The entries of a tick.
#[derive(Clone, Copy, Debug)]
pub struct Entry<'a, const J: usize> {
    /// The motion of the joints.
    pub motion: &'a Motion<J>,
    /// Torques of the tick before, N m.
    pub last_nm: &'a [f32; J],
    /// The laws' account of this tick; `None` without torque.
    pub law: Option<&'a Account<f32>>,
    /// The tick period, s.
    pub period_s: f32,
}

/// The ledger's memory from tick to tick.
#[derive(Clone, Debug, PartialEq)]
pub struct Ledger<const J: usize> {
    /// Torques of the tick before the last, N m.
    before_nm: [f32; J],
    /// The laws in the last tick.
    terms: PerGain<Term>,
    /// The weight that was held.
    weight: Term,
    /// The springs by which something followed a way.
    way: Term,
    work: Sum,
    damped: Sum,
    excess_j: f32,
}

/// A potential and the gain that it is proportional to.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Term {
    gain: f32,
    potential_j: f32,
}

impl Term {
    const fn new(gain: f32, potential_j: f32) -> Self {
        Self { gain, potential_j }
    }

    const NONE: Self = Self::new(0.0, 0.0);

    /// By how much the potential has fallen since `before`, at the gain that it had then. A term that acted not before, or
    /// acts no more, gives nothing.
    fn drop_since(&self, before: &Self) -> f32 {
        if self.gain > 0.0 { before.potential_j - self.potential_j * (before.gain / self.gain) } else { 0.0 }
    }
}

/// A sum that keeps what rounding takes from it.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Sum {
    sum: f32,
    /// By how much the sum is too large.
    over: f32,
}

impl Sum {
    fn zero() -> Self {
        Self { sum: 0.0, over: 0.0 }
    }

    fn add(&mut self, value: f32) {
        let value = value - self.over;
        let sum = self.sum + value;
        self.over = (sum - self.sum) - value;
        self.sum = sum;
    }
}

impl<const J: usize> Ledger<J> {
    /// Nothing was done.
    pub fn new() -> Self {
        Self {
            before_nm: [0.0; J],
            terms: PerGain::all(Term::NONE),
            weight: Term::NONE,
            way: Term::NONE,
            work: Sum::zero(),
            damped: Sum::zero(),
            excess_j: 0.0,
        }
    }

    /// Enters a tick.
    pub fn enter(&mut self, entry: &Entry<'_, J>) {
        let mut work = 0.0;
        let half = 0.5;
        for ((moved, last), before) in
            entry.motion.moved_rad.iter().zip(entry.last_nm).zip(&mut self.before_nm)
        {
            work += (*last + *before) * *moved;
            *before = *last;
        }
        work *= half;
        self.work.add(work);
        // The weight is held or not: its gain is one.
        let none = (PerGain::all(Term::NONE), Term::NONE, Term::NONE);
        let (terms, weight, way) = entry.law.map_or(none, |law| {
            let terms =
                law.gains.zip_with(&law.potentials_j, |&gain, &potential_j| Term { gain, potential_j });
            let way = Term::new(law.way_share, law.way_potential_j);
            (terms, Term::new(1.0, -law.weight_potential_j), way)
        });
        let drops = terms.zip_with(&self.terms, Term::drop_since);
        let mut drop = drops.iter().fold(0.0, |sum, drop| sum + drop) + weight.drop_since(&self.weight);
        if way.gain > 0.0 {
            drop += way.drop_since(&self.way);
        }
        (self.terms, self.weight, self.way) = (terms, weight, way);
        match entry.law {
            Some(&Account { damping_w, fed_j, .. }) => {
                self.damped.add(damping_w * entry.period_s);
                // A first-order fade with a time constant of one second.
                self.excess_j += work - drop - fed_j - self.excess_j * entry.period_s;
            }
            // What feeds it is gone.
            None => self.excess_j = 0.0,
        }
    }

    /// Potential of the laws in the last tick, but for the spring that pulls what is held to its place, J.
    pub(crate) fn of_the_grip_j(&self) -> f32 {
        self.terms.iter().fold(0.0, |sum, term| sum + term.potential_j) - self.terms.frame[0].potential_j
    }

    /// Begins the sums anew, with a grasp.
    pub fn open(&mut self) {
        self.work = Sum::zero();
        self.damped = Sum::zero();
    }

    /// Work of the motors since the grasp began, J; before the first, since the start.
    pub fn work_j(&self) -> f32 {
        self.work.sum
    }

    /// Returns the energy that the law's damping has taken in the same time, J.
    pub fn damped_j(&self) -> f32 {
        self.damped.sum
    }

    /// Work beyond the drop of the potentials in the last second (fading), J.
    pub fn excess_j(&self) -> f32 {
        self.excess_j
    }
}

impl<const J: usize> Ledger<J> {
    pub(crate) fn save(&self, joints: usize, to: &mut Saver<'_>) -> Result<(), BufferTooSmall> {
        to.f32s(&self.before_nm, joints)?;
        for term in self.terms.iter().chain([&self.weight, &self.way]) {
            to.f32(term.gain)?;
            to.f32(term.potential_j)?;
        }
        for sum in [self.work, self.damped] {
            to.f32(sum.sum)?;
            to.f32(sum.over)?;
        }
        to.f32(self.excess_j)
    }

    pub(crate) fn load(joints: usize, from: &mut Loader<'_>) -> Result<Self, SnapshotError> {
        let mut ledger = Self::new();
        from.f32s(&mut ledger.before_nm, joints)?;
        for term in ledger.terms.iter_mut().chain([&mut ledger.weight, &mut ledger.way]) {
            *term = Term { gain: from.f32()?, potential_j: from.f32()? };
        }
        ledger.work = Sum { sum: from.f32()?, over: from.f32()? };
        ledger.damped = Sum { sum: from.f32()?, over: from.f32()? };
        ledger.excess_j = from.f32()?;
        Ok(ledger)
    }
}

impl<const J: usize> Default for Ledger<J> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PERIOD_S: f32 = 1e-3;

    /// A law with a potential `V_s`, J, at a force of one newton for each joule.
    fn approach(potential_j: f32, damping_w: f32) -> Option<Account<f32>> {
        Some(Account {
            gains: PerGain { grasp: [potential_j, 0.0], ..PerGain::all(0.0) },
            potentials_j: PerGain { grasp: [potential_j, 0.0], ..PerGain::all(0.0) },
            damping_w,
            ..Account::none()
        })
    }

    /// Enters a tick of one joint.
    fn enter(ledger: &mut Ledger<1>, moved_rad: f32, last_nm: f32, law: Option<Account<f32>>) {
        let motion = Motion { moved_rad: [moved_rad], ..Motion::still() };
        let law = law.as_ref();
        ledger.enter(&Entry { motion: &motion, last_nm: &[last_nm], law, period_s: PERIOD_S });
    }

    /// Two hours of little steps in single precision, against the same in double: the sum that is kept errs by its own
    /// rounding only. Without what it keeps, it would be off by more than a hundredth.
    #[test]
    fn hours_lose_no_digits() {
        let mut ledger = Ledger::<1>::new();
        let (mut exact_j, mut exact_damped_j, mut plain_j) = (0.0_f64, 0.0_f64, 0.0_f32);
        for k in 0..2 * 3_600_000_u32 {
            let (moved_rad, damping_w) = (1e-5 + 1e-9 * (k % 1000) as f32, 2e-4 + 1e-8 * (k % 77) as f32);
            enter(&mut ledger, moved_rad, 0.3, approach(0.2, damping_w));
            if k > 0 {
                exact_j += f64::from(0.3_f32 * moved_rad);
                plain_j += 0.3 * moved_rad;
            }
            exact_damped_j += f64::from(damping_w * PERIOD_S);
        }
        // Of the first tick only the last torque counts, as half of the mean with none before.
        exact_j += 0.5 * f64::from(0.3_f32 * 1e-5);
        let error = |sum_j: f32, exact_j: f64| (f64::from(sum_j) / exact_j - 1.0).abs();
        let errors = [error(ledger.work_j(), exact_j), error(ledger.damped_j(), exact_damped_j)];
        std::println!(
            "{exact_j} J and {exact_damped_j} J: off by {errors:?}; plainly {:.1e}",
            error(plain_j, exact_j)
        );
        assert!(errors.into_iter().all(|error| error < f64::from(f32::EPSILON)));
        assert!(error(plain_j, exact_j) > 1e-2);
    }

    /// A posture that stays does no work, whatever becomes of the gains.
    #[test]
    fn gains_that_change_are_no_work() {
        let mut ledger = Ledger::<1>::new();
        for k in (0..=100).chain((0..100).rev()) {
            let share = k as f32 / 100.0;
            enter(&mut ledger, 0.0, share, approach(0.25 * share, 0.0));
            assert!(ledger.excess_j().abs() < 1e-6, "{k}: {}", ledger.excess_j());
        }
        assert_eq!(ledger.work_j(), 0.0);
    }

    /// Work beside what the potential gives is excess, which fades by 1/e in a second; without torque there is none.
    #[test]
    fn what_the_potential_does_not_give_is_excess() {
        let mut ledger = Ledger::<1>::new();
        enter(&mut ledger, 0.0, 0.0, approach(1.0, 0.0));
        enter(&mut ledger, 0.0, 2.0, approach(1.0, 0.0));
        let law = |potential_j: f32| {
            let mut law = approach(1.0, 0.5);
            law.iter_mut().for_each(|account| account.potentials_j.grasp[0] = potential_j);
            law
        };
        // 2 N m over 0.25 rad, for which the potential falls by 0.375 J only.
        enter(&mut ledger, 0.25, 2.0, law(0.625));
        assert_eq!((ledger.work_j(), ledger.excess_j()), (0.5, 0.125));
        for _ in 0..1000 {
            enter(&mut ledger, 0.0, 2.0, law(0.625));
        }
        assert!((ledger.excess_j() / 0.125 - 0.368).abs() < 1e-3);
        assert!((ledger.damped_j() - 0.5).abs() < 1e-3);
        // Somebody pushes the joint back.
        enter(&mut ledger, -0.25, 2.0, law(1.0));
        assert_eq!(ledger.work_j(), 0.0);
        enter(&mut ledger, 0.1, 2.0, None);
        assert_eq!((ledger.work_j(), ledger.excess_j()), (0.2, 0.0));
        ledger.open();
        assert_eq!((ledger.work_j(), ledger.damped_j()), (0.0, 0.0));
    }
}
