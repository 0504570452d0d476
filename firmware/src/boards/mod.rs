//! The boards: a folder each, with all that is true of that board alone, behind one trait. One line of the library's root
//! chooses.
//!
//! `docs/new-board.md` says how to write one, step by step.

use crate::link::Port;
use crate::model::JOINTS;
use blindgrasp_shared::identity::{BrownOut, Clock, Crash, ResetCause};
use blindgrasp_shared::joints::Joints;
use embedded_storage::nor_flash::NorFlash;

pub mod stm32f405;

/// A board whose clock runs, with the amplifiers off, until its parts go to the tasks.
pub trait Board: Sized {
    /// The hand's joints.
    type Joints: Joints<JOINTS>;
    /// The line to the host.
    type Line: Port;
    /// Handlers of the line's interrupts; the images say which ones they are.
    type Interrupts;
    /// Flash for saved parameters.
    type Flash: NorFlash;
    /// The watchdog.
    type Watchdog;
    /// Memory that its parts need for as long as the program runs.
    type Memory: 'static;

    /// Frequency of the processor and its timer, Hz.
    const CLOCK_HZ: u32;
    /// Frequency of the timer in the emulator, Hz.
    const EMULATED_HZ: u32;

    /// Returns the findings of the start.
    fn found(&self) -> &Found;
    /// Flash for saved parameters, once; nothing where it can't be written.
    fn take_flash(&mut self) -> Option<Self::Flash>;
    /// Starts supply monitor, joints and line, and the watchdog at last.
    fn start(self, memory: &'static mut Self::Memory) -> Parts<Self>;
    /// Starts the line alone, whose user waits for each byte.
    fn start_line(self) -> (Self::Interrupts, Self::Line);

    /// Feeds the watchdog.
    fn feed(watchdog: &mut Self::Watchdog);
    /// Takes the amplifiers' power away, whoever has the pin.
    fn amplifiers_off();
    /// Returns true while the supply is too low, or if it was since [`Self::take_supply_low`].
    fn supply_is_low() -> bool;
    /// [`Self::supply_is_low`], once.
    fn take_supply_low() -> bool;
    /// Bytes received with an error, and lost because they were not read in time, since the start.
    fn line_errors() -> (u32, u32);
    /// Processor cycles since the start, modulo 2^32; zero where they can't be counted.
    fn cycle_count() -> u32;
    /// Returns true if the timer has called for the next turn of the control task already.
    fn is_late() -> bool;
}

/// The parts of a board that was started.
pub struct Parts<B: Board> {
    /// For the control task.
    pub joints: B::Joints,
    /// For the idle task.
    pub line: B::Line,
    /// For the tasks of the line.
    pub interrupts: B::Interrupts,
    /// For the control task; not in the emulator.
    pub watchdog: Option<B::Watchdog>,
}

/// Findings of the start of a board.
#[derive(Clone, Copy, Debug)]
pub struct Found {
    /// Source of the clock.
    pub clock: Clock,
    /// The cause of the reset.
    pub reset: ResetCause,
    /// Crash that ended the run before it.
    pub crash: Option<Crash>,
    /// Level of the brown-out reset.
    pub brown_out: BrownOut,
}

impl Found {
    /// Returns true in the emulator.
    pub fn is_emulated(&self) -> bool {
        self.clock == Clock::Emulated
    }
}
