//! What the tick tells the world: one [`Record`] a tick, and its bytes.
//!
//! - The **encoding** is postcard: fields in their order, without names; counts and numbers as variable-length
//!   integers, `f32` as four bytes. It is positional, so that any change of [`Record`] or of a type in it is another
//!   **interface version**.
//! - Lists carry their run-time count: the bytes of a hand do not depend on the capacity it was built with, and a host
//!   of large capacity reads what a microcontroller of exact size wrote.
//! - With its parameters, the counts and the commands (which the answers repeat), a record has all that a replay needs
//!   to compute everything else again, to the bit.

pub mod burst;
pub mod dense;
pub mod snapshot;

pub use crate::list::List;
pub use crate::signals::{DecodeError, INTERFACE_VERSION, Record};

use crate::control::{GAIN_COUNT, SIGNAL_COUNT};

/// How many numbers of a record are what the law and the ledger tell.
pub(crate) const LAW: usize = 2 * GAIN_COUNT + SIGNAL_COUNT + 3;

impl<const J: usize> Record<J> {
    /// What the laws and the ledger tell, in this order: gains, potentials, signals, work.
    pub(crate) fn law(&self) -> [f32; LAW] {
        let mut law = [0.0; LAW];
        let values = self.gains.iter().chain(self.potentials_j.iter()).chain(self.law_signals.iter());
        let values = values.chain([&self.work_j, &self.damped_j, &self.excess_j]);
        law.iter_mut().zip(values).for_each(|(place, value)| *place = *value);
        law
    }

    /// The same record, of which the laws and the ledger tell this.
    #[must_use]
    pub(crate) fn with_law(mut self, law: [f32; LAW]) -> Self {
        let Self { gains, potentials_j, law_signals, work_j, damped_j, excess_j, .. } = &mut self;
        let places = gains.iter_mut().chain(potentials_j.iter_mut()).chain(law_signals.iter_mut());
        places.chain([work_j, damped_j, excess_j]).zip(law).for_each(|(place, value)| *place = value);
        self
    }
}
