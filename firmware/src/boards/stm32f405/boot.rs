//! The start that both images share: clock, and why there was a reset.

use super::{clock, reset, wiring};
use crate::{crash, model};
use blindgrasp_shared::device::Device;
use blindgrasp_shared::identity::{BrownOut, Clock, Crash, Identity, Image, ResetCause};
use blindgrasp_shared::link::rate::FASTER_BAUDS;
use stm32f4xx_hal::pac::{DBGMCU, FLASH, RCC};
use stm32f4xx_hal::rcc::Rcc;

use crate::model::{FINGERS, JOINTS};

/// What the start found.
pub struct Boot {
    /// The clock tree, running.
    pub rcc: Rcc,
    /// What drives it.
    pub clock: Clock,
    /// Why there was a reset.
    pub reset: ResetCause,
    /// What ended the run before it.
    pub crash: Option<Crash>,
    /// Level of the brown-out reset.
    pub brown_out: BrownOut,
}

impl Boot {
    /// Finds out why there was a reset, and starts the clock.
    pub fn new(rcc: RCC, debug: &DBGMCU, flash: &FLASH) -> Self {
        let reset = reset::cause(rcc.csr().read().bits());
        // The flags add up over resets until they are cleared.
        rcc.csr().modify(|_, w| w.rmvf().clear());
        // Logs stay readable while the processor sleeps, and the watchdog waits while it is halted.
        debug.cr().modify(|_, w| w.dbg_sleep().set_bit());
        let (rcc, clock) = clock::start(rcc, clock::is_emulated(debug));
        let brown_out = match clock {
            Clock::Emulated => BrownOut::Unknown,
            Clock::External | Clock::Fallback => reset::brown_out(flash.optcr().read().bits()),
        };
        Self { rcc, clock, reset, crash: crash::take(), brown_out }
    }

    /// Whether this is QEMU.
    pub fn is_emulated(&self) -> bool {
        self.clock == Clock::Emulated
    }

    /// The hand, as the image's description calls it.
    ///
    /// # Panics
    /// Never: the build wrote the description.
    pub fn device(&self, image: &'static [u8]) -> Device<JOINTS, FINGERS> {
        let image = Image::decode(image).expect("the build wrote the description");
        let &Self { clock, reset, crash, brown_out, .. } = self;
        let clock_hz = if self.is_emulated() { 0 } else { wiring::SYSTEM_CLOCK.raw() };
        // An emulated line has no rate, and without the crystal only the slowest is sure.
        let faster_bauds = if clock == Clock::External { &FASTER_BAUDS[..] } else { &[] };
        let told = Identity {
            reset,
            crash,
            brown_out,
            clock_hz,
            most_baud: faster_bauds.iter().copied().fold(wiring::BAUD, u32::max),
            ..Identity::of(image, clock)
        };
        Device::new(model::params(), told).with_faster_bauds(faster_bauds)
    }
}
