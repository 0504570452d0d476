//! Logs: how the start went, and what is wrong with the line. Written by `idle` alone, to RTT, where what finds no
//! room is dropped.

use crate::board::boot::Boot;
use crate::board::serial;
use crate::schedule;
use blindgrasp_shared::identity::{CrashKind, Image};
use blindgrasp_shared::link::Counters;

/// Ticks between two looks at the line's errors.
const PERIOD_TICKS: u32 = 1000;

/// Tells how the start went.
pub fn start(boot: &Boot, image: &[u8]) {
    if let Some(image) = Image::decode(image) {
        defmt::info!(
            "blindgrasp {=str} ({=u32:08x}), image {=str}, hand {=str} ({=u32:08x}), interface {=u16}",
            image.firmware_version,
            image.build_hash,
            image.kind,
            image.hand,
            image.hand_hash,
            image.interface_version
        );
    }
    let (clock, reset, brown_out) = (boot.clock.words(), boot.reset.words(), boot.brown_out.words());
    defmt::info!("clock: {=str}; reset: {=str}; brown-out reset: {=str}", clock, reset, brown_out);
    if let Some(crash) = &boot.crash {
        match crash.kind {
            CrashKind::Panic => {
                defmt::error!(
                    "before: panic in line {=u32} of the file {=u32:08x}",
                    crash.line,
                    crash.file_hash
                );
            }
            CrashKind::HardFault => defmt::error!(
                "before: hard fault at {=u32:08x}, called from {=u32:08x}",
                crash.program_counter,
                crash.link_register
            ),
        }
    }
}

/// Tells of errors of the line when there are new ones, but not more often than once a second.
pub struct LineReport {
    told_at: u32,
    told: (u32, u32, u32),
}

impl Default for LineReport {
    fn default() -> Self {
        Self::new()
    }
}

impl LineReport {
    /// Nothing is wrong yet.
    pub const fn new() -> Self {
        Self { told_at: 0, told: (0, 0, 0) }
    }

    /// Looks at the counters.
    pub fn poll(&mut self, frames: Counters) {
        let now = schedule::ticks();
        if now.wrapping_sub(self.told_at) < PERIOD_TICKS {
            return;
        }
        self.told_at = now;
        let (line_errors, lost) = serial::errors();
        let refused = frames.refused();
        if self.told != (line_errors, lost, refused) {
            self.told = (line_errors, lost, refused);
            defmt::warn!(
                "line: {=u32} bytes with errors, {=u32} lost; {=u32} frames good, {=u32} bad",
                line_errors,
                lost,
                frames.good,
                refused
            );
        }
    }
}
