//! Logs: how the start went, and what is wrong with the line. Written by `idle` alone, to RTT, where what finds no
//! room is dropped.

use crate::boards::Found;
use crate::tasks::LineErrors;
use blindgrasp_shared::identity::{CrashKind, Image};

/// Tells how the start went.
pub fn start(found: &Found, image: &[u8]) {
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
    let (clock, reset, brown_out) = (found.clock.words(), found.reset.words(), found.brown_out.words());
    defmt::info!("clock: {=str}; reset: {=str}; brown-out reset: {=str}", clock, reset, brown_out);
    if let Some(crash) = &found.crash {
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

/// Tells of errors of the line.
pub fn line(errors: &LineErrors) {
    defmt::warn!(
        "line: {=u32} bytes with errors, {=u32} lost; {=u32} frames good, {=u32} bad",
        errors.bytes,
        errors.lost,
        errors.good,
        errors.bad
    );
}
