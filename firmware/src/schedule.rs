//! The 1 kHz of the control task: the processor's own timer, and what one turn of it took.

use crate::boards::Board;
use crate::control::Timing;
use core::sync::atomic::{AtomicU32, Ordering};
#[cfg(target_os = "none")]
use cortex_m::peripheral::{DCB, DWT, SCB, SYST, syst::SystClkSource};

/// Starts the timer's interrupt, of a clock in Hz, with a period, us. The counter has 24 bits.
#[cfg(target_os = "none")]
pub fn start(timer: &mut SYST, clock_hz: u32, period_us: u32) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(clock_hz / 1_000_000 * period_us - 1);
    timer.clear_current();
    timer.enable_counter();
    timer.enable_interrupt();
}

/// Starts the cycle counter. QEMU has none: there it reads zero.
#[cfg(target_os = "none")]
pub fn start_cycle_counter(debug: &mut DCB, watch: &mut DWT) {
    debug.enable_trace();
    watch.enable_cycle_counter();
}

/// Processor cycles since the start, modulo 2^32.
#[cfg(target_os = "none")]
pub fn cycle_count() -> u32 {
    DWT::cycle_count()
}

/// Returns `true` if the timer has called for the control task, which has not begun yet.
#[cfg(target_os = "none")]
pub fn is_pending() -> bool {
    SCB::is_pendst_pending()
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
    pub fn begin<B: Board>() -> Self {
        TICKS.fetch_add(1, Ordering::Relaxed);
        Self { began: B::cycle_count() }
    }

    /// Ends it. It is late if the timer has called for the next one already.
    pub fn end<B: Board>(self) -> Timing {
        let cycles = B::cycle_count().wrapping_sub(self.began);
        Timing { late: B::is_late(), cycles }
    }
}
