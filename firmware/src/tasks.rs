//! The tasks of the image `hand`, on any board. The image itself binds them to interrupts, by the names that those have
//! on its board.

use crate::boards::Board;
use crate::control::{Control, Timing, task};
use crate::link::Link;
use crate::queue::{ControlEnd, StoreEnd};
use crate::schedule;
use blindgrasp_shared::link::Counters;
use blindgrasp_shared::store::Store;

/// The control task.
pub struct ControlTask<B: Board> {
    /// The hand.
    pub control: &'static mut Control,
    /// Its joints.
    pub joints: B::Joints,
    /// Its end of the queues.
    pub queues: ControlEnd<'static>,
    /// The timing of the turn before.
    pub last: Timing,
    /// Not in the emulator.
    pub watchdog: Option<B::Watchdog>,
}

impl<B: Board> ControlTask<B> {
    /// A turn.
    pub fn run(&mut self) {
        self.last = task::<B>(self.control, &mut self.joints, &mut self.queues, self.last);
        // What the turn wrote may have come after the interrupt.
        if B::supply_is_low() {
            B::amplifiers_off();
        }
        if let Some(watchdog) = &mut self.watchdog {
            B::feed(watchdog);
        }
    }
}

/// All that has time.
pub struct IdleTask<B: Board> {
    /// The link.
    pub link: Link<'static, B::Line>,
    /// Errors of the line that were not told yet.
    pub errors: LineErrors,
    /// The store of saved parameters, if there is one, with the hash of the hand.
    pub store: Option<(Store<B::Flash>, u32)>,
    /// Its end of the queues.
    pub store_end: StoreEnd<'static>,
}

impl<B: Board> IdleTask<B> {
    /// A small piece of it; returns errors of the line that are to be told.
    pub fn poll(&mut self) -> Option<LineErrors> {
        let now = schedule::ticks();
        self.link.poll(now);
        self.store_end.poll(&mut self.store);
        self.errors.poll(now, B::line_errors(), self.link.counters())
    }

    /// Returns `true` if there is nothing to do until an interrupt.
    pub fn is_idle(&self) -> bool {
        self.link.is_idle()
    }
}

/// Ticks between two looks at the line's errors.
const PERIOD_TICKS: u32 = 1000;

/// Errors of the line since the start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineErrors {
    looked_at: u32,
    /// Bytes that came with an error.
    pub bytes: u32,
    /// Bytes that were lost.
    pub lost: u32,
    /// Frames that were good.
    pub good: u32,
    /// Frames that were not.
    pub bad: u32,
}

impl LineErrors {
    /// The errors when there are new ones, but not more often than once a second.
    fn poll(&mut self, now: u32, (bytes, lost): (u32, u32), frames: Counters) -> Option<Self> {
        if now.wrapping_sub(self.looked_at) < PERIOD_TICKS {
            return None;
        }
        let told = (self.bytes, self.lost, self.bad);
        *self = Self { looked_at: now, bytes, lost, good: frames.good, bad: frames.refused() };
        (told != (bytes, lost, self.bad)).then_some(*self)
    }
}
