//! The system clock: 168 MHz from the crystal, or a reported fall-back.
//!
//! The same image runs on hardware and in QEMU, which does not model the clock tree: there every flag of `RCC` reads
//! zero for ever. So the crystal is waited for a bounded number of times, before the library is asked to wait without
//! bound for what is then known to come.
//!
//! Without the crystal the internal oscillator drives the same 168 MHz. The hand answers and measures, with the
//! deadlines that it was designed for, but does not arm: the oscillator may be off by 1 % at 25 °C and by up to 8 %
//! over temperature (DS8626, HSI oscillator characteristics), and so would be every speed and every time.

use super::wiring;
use blindgrasp_shared::identity::Clock;
use stm32f4xx_hal::pac::{DBGMCU, RCC};
use stm32f4xx_hal::prelude::*;
use stm32f4xx_hal::rcc::{Config, Rcc};

/// The most looks at the crystal until it is given up. It starts within 2 ms (DS8626, HSE oscillator characteristics);
/// a look takes at least 6 cycles of the 16 MHz that the processor starts with, so this is 18 ms or more.
const MOST_LOOKS: u32 = 50_000;

/// Returns `true` if this is QEMU: there the device's identity code, 0x413 on hardware, is not modelled.
pub fn is_emulated(debug: &DBGMCU) -> bool {
    debug.idcode().read().bits() == 0
}

/// Starts the clock and says which one it is.
pub fn start(rcc: RCC, emulated: bool) -> (Rcc, Clock) {
    let crystal = crystal_starts(&rcc);
    if emulated {
        return (rcc.constrain(), Clock::Emulated);
    }
    if crystal {
        (rcc.freeze(Config::hse(wiring::CRYSTAL).sysclk(wiring::SYSTEM_CLOCK)), Clock::External)
    } else {
        rcc.cr().modify(|_, w| w.hseon().off());
        (rcc.freeze(Config::hsi().sysclk(wiring::SYSTEM_CLOCK)), Clock::Fallback)
    }
}

/// Switches the crystal oscillator on and waits until it is ready, but not for ever.
fn crystal_starts(rcc: &RCC) -> bool {
    rcc.cr().modify(|_, w| w.hseon().on());
    (0..MOST_LOOKS).any(|_| rcc.cr().read().hserdy().is_ready())
}
