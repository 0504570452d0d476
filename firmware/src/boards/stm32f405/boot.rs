//! The start that both images share: clock, and why there was a reset.

use super::SavedFlash;
use super::flash::{Flash, Mapped};
use super::{clock, reset, wiring};
use crate::control::{Control, HandBurst};
use crate::crash;
use crate::model::{self, FINGERS, JOINTS};
use blindgrasp_shared::device::Device;
use blindgrasp_shared::identity::{BrownOut, Clock, Crash, Identity, Image, ResetCause, Restored};
use blindgrasp_shared::link::rate::FASTER_BAUDS;
use blindgrasp_shared::tick::Params;
use core::mem::MaybeUninit;
use stm32f4xx_hal::pac::{DBGMCU, FLASH, RCC};
use stm32f4xx_hal::rcc::Rcc;

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
    /// Flash for saved parameters; not in QEMU, which has no controller for it.
    pub flash: Option<SavedFlash>,
}

impl Boot {
    /// Finds out why there was a reset, and starts the clock.
    pub fn new(rcc: RCC, debug: &DBGMCU, flash: FLASH) -> Self {
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
        let flash = (clock != Clock::Emulated).then(|| Flash::new(Mapped(flash)));
        Self { rcc, clock, reset, crash: crash::take(), brown_out, flash }
    }

    /// Whether this is QEMU.
    pub fn is_emulated(&self) -> bool {
        self.clock == Clock::Emulated
    }

    /// The control task's hand, as the image's description calls it, in a place of its own. `restore`, which is
    /// told the hash of the hand, may put saved parameters in the place of its file's; tells what became of them, if there is a store.
    ///
    /// Here the stack is deepest: hence no part of it is in the caller's frame, nor the hand in that of its parameters.
    ///
    /// # Panics
    /// Never: the build wrote the description.
    #[inline(never)]
    pub fn control(
        &self,
        image: &'static [u8],
        restore: impl FnOnce(u32, &mut Params<JOINTS, FINGERS>) -> Option<Restored>,
        burst: &'static mut HandBurst,
        place: &'static mut MaybeUninit<Control>,
    ) -> &'static mut Control {
        let mut params = model::params();
        let image = Image::decode(image).expect("the build wrote the description");
        let restored = restore(image.hand_hash, &mut params);
        self.place(image, params, restored, burst, place)
    }

    #[inline(never)]
    fn place(
        &self,
        image: Image<'static>,
        params: Params<JOINTS, FINGERS>,
        restored: Option<Restored>,
        burst: &'static mut HandBurst,
        place: &'static mut MaybeUninit<Control>,
    ) -> &'static mut Control {
        let &Self { clock, reset, crash, brown_out, .. } = self;
        let clock_hz = if self.is_emulated() { 0 } else { wiring::SYSTEM_CLOCK.raw() };
        // An emulated line has no rate, and without the crystal only the slowest is sure.
        let faster_bauds = if clock == Clock::External { &FASTER_BAUDS[..] } else { &[] };
        let told = Identity {
            reset,
            crash,
            brown_out,
            clock_hz,
            restored,
            most_baud: faster_bauds.iter().copied().fold(wiring::BAUD, u32::max),
            ..Identity::of(image, clock)
        };
        let device = Device::new(params, told).with_faster_bauds(faster_bauds);
        place.write(Control::new(device, burst))
    }
}
