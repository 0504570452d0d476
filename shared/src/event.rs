//! Events that come to a tick from outside besides counts and commands. They are recorded, so that a replay has it too.

use core::fmt;
use serde::{Deserialize, Serialize};

/// An event.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Event {
    /// The host gave a sign of life.
    Heartbeat = 1,
    /// The tick before was not done when it should have been.
    Late = 1 << 1,
    /// The clock is not the crystal.
    FallbackClock = 1 << 2,
    /// The supply was below what its monitor is set to, at some time since the tick before.
    SupplyLow = 1 << 3,
    /// Signs or zeros of the joints were set since somebody confirmed what is read with them.
    Unconfirmed = 1 << 4,
}

impl Event {
    /// Every event.
    pub const ALL: [Self; 5] =
        [Self::Heartbeat, Self::Late, Self::FallbackClock, Self::SupplyLow, Self::Unconfirmed];

    /// Its name in recordings and tables.
    pub const fn key(self) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::Late => "late",
            Self::FallbackClock => "fallback_clock",
            Self::SupplyLow => "supply_low",
            Self::Unconfirmed => "unconfirmed",
        }
    }

    /// In words.
    pub const fn words(self) -> &'static str {
        match self {
            Self::Heartbeat => "heartbeat",
            Self::Late => "late",
            Self::FallbackClock => "fall-back clock",
            Self::SupplyLow => "supply low",
            Self::Unconfirmed => "reading unconfirmed",
        }
    }
}

/// The events of a tick: a bit each.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Events(u8);

impl Events {
    /// Nothing.
    pub const NONE: Self = Self(0);

    /// These, and another if it is there.
    #[must_use]
    pub const fn with(self, event: Event, there: bool) -> Self {
        if there { Self(self.0 | event as u8) } else { self }
    }

    /// The bits, as they go over the wire.
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// The events of such bits, if there is a meaning to each.
    pub const fn from_bits(bits: u8) -> Option<Self> {
        if bits < 1 << Event::ALL.len() { Some(Self(bits)) } else { None }
    }

    /// Returns `true` if one is among them.
    pub const fn contains(self, event: Event) -> bool {
        self.0 & event as u8 != 0
    }
}

impl fmt::Display for Events {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        for event in Event::ALL.into_iter().filter(|&event| self.contains(event)) {
            write!(f, "{separator}{}", event.words())?;
            separator = ", ";
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[test]
    fn each_event_has_its_bit() {
        for event in Event::ALL {
            let events = Events::NONE.with(event, true).with(Event::Heartbeat, false);
            assert!(Event::ALL.into_iter().all(|other| events.contains(other) == (other == event)));
            assert_eq!(events.to_string(), event.words());
        }
        let both = Events::NONE.with(Event::Late, true).with(Event::Heartbeat, true);
        assert_eq!(both.to_string(), "heartbeat, late");
    }
}
