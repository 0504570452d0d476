//! The 1 kHz of the control task: the processor's own timer, and what one turn of it took.

use crate::board;
use crate::control::Timing;
use core::sync::atomic::{AtomicU32, Ordering};
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m::peripheral::{DCB, DWT, SCB, SYST};

/// Starts the timer's interrupt with a period, us. The counter has 24 bits.
pub fn start(timer: &mut SYST, period_us: u32, emulated: bool) {
    let clock_hz = if emulated { board::EMULATED_HZ } else { board::SYSTEM_CLOCK.raw() };
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(clock_hz / 1_000_000 * period_us - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Starts the cycle counter. QEMU has none: there it reads zero.
pub fn start_cycle_counter(debug: &mut DCB, watch: &mut DWT) {
    debug.enable_trace();
    watch.enable_cycle_counter();
}

/// Processor cycles since the start, modulo 2^32.
pub fn cycle_count() -> u32 {
    DWT::cycle_count()
}

/// Turns of the control task since the start.
static TICKS: AtomicU32 = AtomicU32::new(0);

/// Turns of the control task since the start, modulo 2^32.
pub fn ticks() -> u32 {
    TICKS.load(Ordering::Relaxed)
}

/// A turn that has begun.
pub struct Turn {
    began: u32,
}

impl Turn {
    /// Begins it.
    pub fn begin() -> Self {
        TICKS.fetch_add(1, Ordering::Relaxed);
        Self { began: DWT::cycle_count() }
    }

    /// Ends it. It is late if the timer has called for the next one already.
    pub fn end(self) -> Timing {
        Timing { late: SCB::is_pendst_pending(), cycles: DWT::cycle_count().wrapping_sub(self.began) }
    }
}
