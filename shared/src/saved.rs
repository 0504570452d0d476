//! Parameters that outlive a reset: what is saved of them, and what comes of it at the next start.
//!
//! Saved is what differs from the hand's file, so that whatever was left alone follows the file. The store has other time
//! than the tick: [`Saving`] looks at a few parameters a tick, and hands the set over as [`Order`]s, one after the other.

use crate::identity::Restored;
use crate::parameters::{Parameter, Setting};
use crate::store::{Entry, Store, StoreError};
use crate::tick::Params;
use embedded_storage::nor_flash::NorFlash;

/// Parameters that are looked at in a tick.
const LOOKS: usize = 8;

/// An order to the store.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Order {
    /// Begin a set of so many entries.
    Begin(u16),
    /// Write an entry.
    Put(Entry),
    /// Read the set back, and make it the valid one.
    Finish,
}

/// A set on its way to the store. Until it is over, no parameter may be set: it would be a mixture.
#[derive(Clone, Copy, Debug)]
pub struct Saving {
    stage: Stage,
    /// The number of the parameter that it begins with; behind the last for a set without entries.
    first: u8,
    /// The number of the parameter that it looks at next, and its index.
    next: (u8, u8),
    entry_count: u16,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Count,
    Put,
    Over,
}

impl Saving {
    /// The differences from the hand's file.
    pub const DIFFERENCES: Self = Self::from(0);
    /// Nothing: the hand's file is to hold again.
    pub const NOTHING: Self = Self::from(Parameter::COUNT as u8);

    const fn from(first: u8) -> Self {
        Self { stage: Stage::Count, first, next: (first, 0), entry_count: 0 }
    }

    /// Returns `true` if every order was given.
    pub fn is_over(&self) -> bool {
        self.stage == Stage::Over
    }

    /// The order of this tick, if there is one.
    pub fn next<const J: usize, const F: usize>(&mut self, params: &Params<J, F>) -> Option<Order> {
        (0..LOOKS).find_map(|_| self.look(params))
    }

    /// Looks at a parameter.
    fn look<const J: usize, const F: usize>(&mut self, params: &Params<J, F>) -> Option<Order> {
        if self.is_over() {
            return None;
        }
        let (number, index) = self.next;
        let Ok(parameter) = Parameter::try_from(number) else {
            self.next = (self.first, 0);
            let (stage, order) = match self.stage {
                Stage::Count => (Stage::Put, Order::Begin(self.entry_count)),
                Stage::Put | Stage::Over => (Stage::Over, Order::Finish),
            };
            self.stage = stage;
            return Some(order);
        };
        let is_last = index + 1 >= parameter.count(params.hand().joint_count());
        self.next = if is_last { (number + 1, 0) } else { (number, index + 1) };
        let Setting { value, file } = params.get(parameter, index).ok()?;
        if value == file {
            return None;
        }
        if self.stage == Stage::Count {
            self.entry_count += 1;
            return None;
        }
        Some(Order::Put(Entry { key: parameter.key_hash(), index, value }))
    }
}

/// The number of times that all values are tried: a gain has to be within its limit, and either may have been saved
/// first.
const PASSES: usize = 2;

impl<S: NorFlash> Store<S> {
    /// Does what is ordered.
    ///
    /// # Errors
    /// Nothing is saved, and what was saved before stays valid.
    pub fn obey(&mut self, order: &Order, hand_hash: u32) -> Result<(), StoreError> {
        match order {
            Order::Begin(entry_count) => self.begin(hand_hash, usize::from(*entry_count)),
            Order::Put(entry) => self.put(entry),
            Order::Finish => self.finish(),
        }
    }

    /// Puts what was saved for a hand into its parameters, and tells `ignored` of each entry that is not in effect.
    pub fn restore<const J: usize, const F: usize>(
        &mut self,
        hand_hash: u32,
        params: &mut Params<J, F>,
        mut ignored: impl FnMut(&Entry),
    ) -> Restored {
        let Some(&set) = self.newest() else { return Restored::default() };
        let is_ours = set.hand_hash == hand_hash;
        for index in (0..PASSES).filter(|_| is_ours).flat_map(|_| 0..set.entry_count) {
            if let Ok(Some(entry)) = self.entry(index)
                && let Some(parameter) = named(entry.key)
            {
                // Refused is what is not in effect afterwards.
                let _ = params.set(parameter, entry.index, entry.value);
            }
        }
        let mut restored = Restored { saved: set.entry_count as u16, ignored: 0 };
        for index in 0..set.entry_count {
            let Ok(Some(entry)) = self.entry(index) else {
                restored.ignored += 1;
                continue;
            };
            let in_effect = named(entry.key)
                .and_then(|parameter| params.get(parameter, entry.index).ok())
                .is_some_and(|setting| setting.value == entry.value);
            if !(is_ours && in_effect) {
                restored.ignored += 1;
                ignored(&entry);
            }
        }
        restored
    }
}

/// The parameter whose key has a hash.
fn named(hash: u32) -> Option<Parameter> {
    Parameter::ALL.into_iter().find(|parameter| parameter.key_hash() == hash)
}
