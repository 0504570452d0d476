//! The supply of the microcontroller, watched by its voltage detector (PVD).
//!
//! Supply sags: the detector's interrupt takes the amplifiers' power away at once, ahead of everything else, and the next
//! tick makes it fault 13. A brown-out reset, which comes at a lower voltage, is the second line: in a reset all pins are
//! inputs. Its level is an option byte; the firmware only tells it.
//!
//! Threshold 6 (DS8626, embedded reset and power control block characteristics): rising 2.96 to 3.10 V, falling 2.85 to
//! 2.99 V.
//! - A good board never passes it: 3.3 V less 5 % are 3.135 V, above 3.10 V; threshold 7 may take 3.21 V to call it good.
//! - The processor still works when it is passed: 2.85 V are more than the 2.7 V that 168 MHz at five wait states need, and
//!   in general more than the highest brown-out level, which resets at 2.75 to 2.88 V, typically 0.1 V below the detector.
#![allow(unsafe_code)]

use core::sync::atomic::{AtomicBool, Ordering};
use stm32f4xx_hal::pac::{EXTI, PWR, RCC};

/// `PLS` of `PWR_CR`: see the module's essay.
const THRESHOLD: u8 = 6;
/// The detector's line of EXTI (RM0090 5.2.3).
const LINE: u32 = 1 << 16;

/// `true` if the interrupt came since [`take`].
static SAGGED: AtomicBool = AtomicBool::new(false);

/// Starts the detector and lets it interrupt when the supply falls below the threshold.
pub fn start(power: &PWR, lines: &EXTI, clocks: &RCC) {
    clocks.apb1enr().modify(|_, w| w.pwren().enabled());
    // SAFETY: three bits, and every value of them is a threshold.
    power.cr().modify(|_, w| unsafe { w.pls().bits(THRESHOLD) }.pvde().set_bit());
    // The detector's output rises when the supply falls.
    // SAFETY: the bit of this line, which nothing else uses.
    lines.rtsr().modify(|r, w| unsafe { w.bits(r.bits() | LINE) });
    // SAFETY: as above.
    lines.imr().modify(|r, w| unsafe { w.bits(r.bits() | LINE) });
}

/// Notes that the detector's interrupt came, which takes the amplifiers' power.
pub fn sagged() {
    SAGGED.store(true, Ordering::Relaxed);
    // SAFETY: the register is always there, and a one clears the bit of this line alone.
    unsafe { (*EXTI::ptr()).pr().write(|w| w.bits(LINE)) };
}

/// Returns `true` if the supply is too low, or was since [`take`].
pub fn is_low() -> bool {
    // SAFETY: the register is always there; reading it changes nothing. It reads zero where there is no detector.
    SAGGED.load(Ordering::Relaxed) || unsafe { (*PWR::ptr()).csr().read().pvdo().bit_is_set() }
}

/// [`is_low`], once.
pub fn take() -> bool {
    let is_low = is_low();
    SAGGED.store(false, Ordering::Relaxed);
    is_low
}
