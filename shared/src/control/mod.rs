//! Control laws: joint angles and speeds in, joint torques out, nothing known of the object.
//!
//! The torques are the sum of what [`hold`] always does, and of the laws that are chosen: [`grasp`] is the paper's,
//! [`integral`] what an earlier one had in place of one of its terms, [`frame`] what holds and moves the hand as a whole. A law is a file, and a line in the list below.
//! It declares its **gains**, each with the ramp that it follows and the potential that is proportional to it, and what
//! else it tells. Limits, commands, parameters, the energy ledger, records and tables follow from that; none of them
//! knows a law by name.

pub mod frame;
pub mod gain;
pub mod grasp;
pub mod hold;
pub mod integral;

pub use frame::{FrameConfig, Held, Pose};
pub use gain::{Gain, Ramp, Signal};
pub use grasp::AttitudeError;
pub use hold::Hold;

use crate::bytes::{BufferTooSmall, Loader, Saver, SnapshotError};
use crate::hand::{Hand, Posture};
use crate::math::Real;
use crate::parameter::ParameterError;
use core::array;
use serde::{Deserialize, Serialize};

/// A control law with its number of gains and of signals, prepared for a hand.
///
/// Its module has tables of both, `GAINS` and `SIGNALS`, and its [latch](Self::Latch) under that name, with `save` and
/// `load` for snapshots.
pub trait Law<T: Real, const J: usize, const F: usize, const GAINS: usize, const SIGNALS: usize> {
    /// Its memory of the hand at the moment in which a grasp begins.
    type Latch;

    /// Returns the law, prepared for a hand.
    fn prepare(hand: &Hand<T, J, F>, config: &LawsConfig<T, J>) -> Self;

    /// Returns what it remembers of a hand that stands like this.
    fn latch(hand: &Hand<T, J, F>, posture: &Posture<T, J, F>, angles_rad: &[T; J]) -> Self::Latch;

    /// Adds its torques, N m, at these gains. Each is the negative gradient of the potential that is returned.
    fn torques(
        &self,
        stance: &Stance<'_, T, J, F>,
        latch: &Self::Latch,
        gains: &[T; GAINS],
        torques_nm: &mut [T; J],
    ) -> Effect<T, GAINS, SIGNALS>;
}

/// The state of the hand in a tick.
#[derive(Clone, Copy, Debug)]
pub struct Stance<'a, T, const J: usize, const F: usize> {
    /// The hand.
    pub hand: &'a Hand<T, J, F>,
    /// The poses of its links.
    pub posture: &'a Posture<T, J, F>,
    /// Joint angles that lead there, rad.
    pub angles_rad: &'a [T; J],
    /// Joint speeds, rad/s.
    pub speeds_rad_s: &'a [T; J],
    /// The frame of the fingertips, and its target.
    pub held: &'a Held<T, F>,
}

/// The result of a law beside its torques.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Effect<T, const GAINS: usize, const SIGNALS: usize> {
    /// The potential of each gain, J.
    pub potentials_j: [T; GAINS],
    /// Its other signals.
    pub signals: [T; SIGNALS],
    /// Power that its damping takes, W.
    pub damping_w: T,
    /// By how much a target that moved has raised its potentials since the tick before, J.
    pub fed_j: T,
}

impl<T: Real, const GAINS: usize> Effect<T, GAINS, 0> {
    /// Returns that of springs, with these potentials, J.
    pub fn of_springs(potentials_j: [T; GAINS]) -> Self {
        Self { potentials_j, signals: [], damping_w: T::zero(), fed_j: T::zero() }
    }
}

/// Writes what follows from the list of laws: the laws together, and containers of one value for each of their gains.
macro_rules! laws {
    ($($law:ident: $Law:ident, $words:literal;)*) => {
        /// A value for each gain of each law.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct PerGain<T> {
            $(#[doc = concat!("Those of ", $words, ".")] pub $law: [T; $law::GAINS.len()],)*
        }

        /// A value for each signal of each law, other than gains and potentials.
        #[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
        pub struct PerSignal<T> {
            $(#[doc = concat!("Those of ", $words, ".")] pub $law: [T; $law::SIGNALS.len()],)*
        }

        /// Number of gains of all laws.
        pub const GAIN_COUNT: usize = 0 $(+ $law::GAINS.len())*;
        /// Number of signals of all laws, other than gains and potentials.
        pub const SIGNAL_COUNT: usize = 0 $(+ $law::SIGNALS.len())*;
        /// Every gain, law by law.
        pub const GAINS: [Gain; GAIN_COUNT] = {
            let mut all = [grasp::GAINS[0]; GAIN_COUNT];
            let mut at = 0;
            $({
                let mut k = 0;
                while k < $law::GAINS.len() {
                    all[at] = $law::GAINS[k];
                    (at, k) = (at + 1, k + 1);
                }
            })*
            all
        };
        /// Every signal of a law that is no gain and no potential, law by law.
        pub const SIGNALS: [Signal; SIGNAL_COUNT] = {
            let mut all = [grasp::GAINS[0].potential; SIGNAL_COUNT];
            let mut at = 0;
            $({
                let mut k = 0;
                while k < $law::SIGNALS.len() {
                    all[at] = $law::SIGNALS[k];
                    (at, k) = (at + 1, k + 1);
                }
            })*
            let _ = &mut all;
            let _ = at;
            all
        };
        /// Names of the laws, as files and parameters have them, and what they are.
        pub const LAWS: &[(&str, &str)] = &[$((stringify!($law), $words)),*];

        impl<T> PerGain<T> {
            /// Returns the values, law by law.
            pub fn iter(&self) -> impl Iterator<Item = &T> + Clone {
                core::iter::empty()$(.chain(&self.$law))*
            }

            /// Returns the values, law by law, to be changed.
            pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
                core::iter::empty()$(.chain(&mut self.$law))*
            }

            /// Returns what a function makes of each value.
            pub fn map<V>(&self, f: impl Fn(&T) -> V) -> PerGain<V> {
                self.zip_with(self, |value, _| f(value))
            }

            /// Returns what a function makes of each two values.
            pub fn zip_with<U, V>(&self, other: &PerGain<U>, f: impl Fn(&T, &U) -> V) -> PerGain<V> {
                PerGain { $($law: array::from_fn(|k| f(&self.$law[k], &other.$law[k])),)* }
            }
        }

        impl<T: Copy> PerGain<T> {
            /// Returns the same value for all.
            pub const fn all(value: T) -> Self {
                Self { $($law: [value; $law::GAINS.len()],)* }
            }

            /// Returns these values, law by law.
            pub const fn of(values: [T; GAIN_COUNT]) -> Self {
                let mut at = 0;
                $(let mut $law = [values[0]; $law::GAINS.len()];
                let mut k = 0;
                while k < $law::GAINS.len() {
                    $law[k] = values[at];
                    (at, k) = (at + 1, k + 1);
                })*
                let _ = at;
                Self { $($law,)* }
            }
        }

        impl<T: Copy> PerSignal<T> {
            /// Returns the same value for all.
            pub const fn all(value: T) -> Self {
                Self { $($law: [value; $law::SIGNALS.len()],)* }
            }

            /// Returns the values, law by law.
            pub fn iter(&self) -> impl Iterator<Item = &T> + Clone {
                core::iter::empty()$(.chain(&self.$law))*
            }

            /// Returns the values, law by law, to be changed.
            pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
                core::iter::empty()$(.chain(&mut self.$law))*
            }
        }

        impl PerGain<Ramp> {
            /// The ramp of each gain.
            pub const RAMP: Self = {
                let mut ramps = Self { $($law: [Ramp::Force; $law::GAINS.len()],)* };
                $({
                    let mut k = 0;
                    while k < $law::GAINS.len() {
                        ramps.$law[k] = $law::GAINS[k].ramp;
                        k += 1;
                    }
                })*
                ramps
            };
        }

        impl PerGain<u8> {
            /// The number of the law that each gain belongs to.
            pub const LAW: Self = {
                let mut next = 0;
                $(let $law = next; next += 1;)*
                let _ = next;
                Self { $($law: [$law; $law::GAINS.len()],)* }
            };
        }

        impl PerSignal<u8> {
            /// The number of the law that each signal belongs to.
            pub const LAW: Self = {
                let mut next = 0;
                $(let $law = next; next += 1;)*
                let _ = next;
                Self { $($law: [$law; $law::SIGNALS.len()],)* }
            };
        }

        /// The memory of all laws of the moment in which a grasp began.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Latch<T, const J: usize, const F: usize> {
            $(#[doc = concat!("What ", $words, " remembers.")] pub $law: $law::Latch<T, J, F>,)*
        }

        impl<T: Real, const J: usize, const F: usize> Latch<T, J, F> {
            /// Returns what the laws remember of a hand that stands like this; angles in rad.
            pub fn of(hand: &Hand<T, J, F>, posture: &Posture<T, J, F>, angles_rad: &[T; J]) -> Self {
                Self { $($law: $law::$Law::<T>::latch(hand, posture, angles_rad),)* }
            }
        }

        impl<const J: usize, const F: usize> Latch<f32, J, F> {
            pub(crate) fn save(
                &self,
                joints: usize,
                fingertips: usize,
                to: &mut Saver<'_>,
            ) -> Result<(), BufferTooSmall> {
                $(self.$law.save(joints, fingertips, to)?;)*
                Ok(())
            }

            pub(crate) fn load(
                joints: usize,
                fingertips: usize,
                from: &mut Loader<'_>,
            ) -> Result<Self, SnapshotError> {
                Ok(Self { $($law: $law::Latch::load(joints, fingertips, from)?,)* })
            }
        }

        /// The laws, prepared for one hand.
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct Laws<T, const J: usize> {
            config: LawsConfig<T, J>,
            /// Gains in full, those of laws that are not chosen being zero.
            gains: PerGain<T>,
            $(#[doc = concat!("The law of ", $words, ".")] pub $law: $law::$Law<T>,)*
        }

        impl<T: Real, const J: usize> Laws<T, J> {
            fn prepared<const F: usize>(config: &LawsConfig<T, J>, hand: &Hand<T, J, F>) -> Self {
                let gains = config.gains.zip_with(&PerGain::LAW, |gain, law| {
                    if config.chosen.has(*law) { *gain } else { T::zero() }
                });
                Self { config: *config, gains, $($law: $law::$Law::prepare(hand, config),)* }
            }

            /// Adds the torques of the laws whose gains are not all zero.
            fn grasp_torques<const F: usize>(
                &self,
                stance: &Stance<'_, T, J, F>,
                grip: &Grip<'_, T, J, F>,
                torques_nm: &mut [T; J],
                account: &mut Account<T>,
            ) {
                account.gains = grip.gains;
                $(if grip.gains.$law.iter().any(|gain| *gain > T::zero()) {
                    let (latch, gains) = (&grip.latch.$law, &grip.gains.$law);
                    let effect = self.$law.torques(stance, latch, gains, torques_nm);
                    account.potentials_j.$law = effect.potentials_j;
                    account.signals.$law = effect.signals;
                    account.damping_w += effect.damping_w;
                    account.fed_j += effect.fed_j;
                })*
            }
        }
    };
}

laws! {
    grasp: GraspLaw, "the paper's grasp law, `u_s + u_st`";
    integral: IntegralLaw, "the earlier law's integral, `u_I`";
    frame: FrameLaw, "the virtual frame, `u_p + u_o`, which holds and moves the hand as a whole";
}

/// The laws that may act: a bit each, in the order of the list.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Chosen(u8);

impl Chosen {
    /// Every law.
    pub const ALL: Self = {
        assert!(LAWS.len() <= 8, "there is a bit for each");
        Self(((1_u16 << LAWS.len()) - 1) as u8)
    };
    /// None of them.
    pub const NONE: Self = Self(0);

    /// Returns `true` if the law of this number is chosen.
    pub const fn has(self, law: u8) -> bool {
        self.0 >> law & 1 != 0
    }

    /// The same with, or without, the law of this number.
    #[must_use]
    pub const fn with(self, law: u8, on: bool) -> Self {
        let bit = (1 << law) & Self::ALL.0;
        Self(if on { self.0 | bit } else { self.0 & !bit })
    }
}

/// The laws, as a user configures them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LawsConfig<T, const J: usize> {
    /// Gains in full; the gains of a law that is not chosen do nothing.
    pub gains: PerGain<T>,
    /// Laws that may act.
    pub chosen: Chosen,
    /// Damping and reach of the virtual frame.
    pub frame: FrameConfig<T>,
    /// Form of the attitude error of the grasp law.
    pub attitude_error: AttitudeError,
    /// The torques that act with every law and without.
    pub hold: Hold<T, J>,
}

impl<T: Real, const J: usize> LawsConfig<T, J> {
    /// Checks the numbers and prepares the laws for a hand.
    ///
    /// # Errors
    /// The first number that is not finite, or a gain or damping that is negative.
    pub fn prepare<const F: usize>(&self, hand: &Hand<T, J, F>) -> Result<Laws<T, J>, ParameterError> {
        for (gain, value) in GAINS.iter().zip(self.gains.iter()) {
            if !(*value >= T::zero() && value.is_finite()) {
                let reason = "has to be zero or positive";
                return Err(ParameterError { parameter: gain.key.into(), joint: None, reason });
            }
        }
        self.frame.check()?;
        self.hold.check(hand.joint_count())?;
        Ok(Laws::prepared(self, hand))
    }
}

/// A grasp, as it is in this tick.
#[derive(Clone, Copy, Debug)]
pub struct Grip<'a, T, const J: usize, const F: usize> {
    /// The memory of the laws of its beginning.
    pub latch: &'a Latch<T, J, F>,
    /// The gains that act.
    pub gains: PerGain<T>,
}

/// The laws' own account, which needs no knowledge of the object.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Account<T> {
    /// The gains that act.
    pub gains: PerGain<T>,
    /// The potential of each gain, J.
    pub potentials_j: PerGain<T>,
    /// Other signals of the laws.
    pub signals: PerSignal<T>,
    /// Potential energy of the links' weight that is held, above some level, J; zero where none is.
    pub weight_potential_j: T,
    /// Power that the damping takes, W.
    pub damping_w: T,
    /// Potential of the springs by which joints or fingertips follow a way, J, and the share of them that acts.
    pub way_potential_j: T,
    /// That share.
    pub way_share: T,
    /// Energy that targets which moved have brought in since the tick before, J.
    pub fed_j: T,
}

impl<T: Real> Account<T> {
    /// Returns that of no torque.
    pub fn none() -> Self {
        let zero = T::zero();
        Self {
            gains: PerGain::all(zero),
            potentials_j: PerGain::all(zero),
            signals: PerSignal::all(zero),
            weight_potential_j: zero,
            damping_w: zero,
            way_potential_j: zero,
            way_share: zero,
            fed_j: zero,
        }
    }
}

impl<T: Real, const J: usize> Laws<T, J> {
    /// Returns the configuration.
    pub fn config(&self) -> &LawsConfig<T, J> {
        &self.config
    }

    /// Returns the gains in full, those of laws that are not chosen being zero.
    pub fn gains(&self) -> PerGain<T> {
        self.gains
    }

    /// Returns the whole grip, as configured.
    pub fn grip<'a, const F: usize>(&self, latch: &'a Latch<T, J, F>) -> Grip<'a, T, J, F> {
        Grip { latch, gains: self.gains() }
    }

    /// Returns joint torques `u` (Eq. 29), N m, and what the laws know of themselves. Without a grip the joints are only damped and their weight held.
    pub fn torques<const F: usize>(
        &self,
        stance: &Stance<'_, T, J, F>,
        grip: Option<&Grip<'_, T, J, F>>,
    ) -> ([T; J], Account<T>) {
        let (mut torques_nm, mut account) = ([T::zero(); J], Account::none());
        self.add_torques(stance, grip, &mut torques_nm, &mut account);
        (torques_nm, account)
    }

    /// Adds these torques, N m, and writes their account where it stays, since it takes long to move.
    pub fn add_torques<const F: usize>(
        &self,
        stance: &Stance<'_, T, J, F>,
        grip: Option<&Grip<'_, T, J, F>>,
        torques_nm: &mut [T; J],
        account: &mut Account<T>,
    ) {
        let hold = &self.config.hold;
        account.damping_w = hold.damp(stance.speeds_rad_s, torques_nm);
        if let Some(grip) = grip {
            self.grasp_torques(stance, grip, torques_nm, account);
        }
        account.weight_potential_j = hold.hold_weight(stance.hand, stance.posture, torques_nm);
    }
}
