//! Flashing over a debug probe, with probe-rs.
//!
//! 1. [`Chip`]: what probe-rs knows of a chip; whether an image fits it. Nothing needs to be connected.
//! 2. [`probe`]: the probe that is meant, and a session on the right chip.
//! 3. [`download`]: erase, program, verify.
//! 4. [`monitor`]: start the firmware and follow its [`logs`].

mod chip;
pub mod logs;
pub mod monitor;
pub mod probe;

use super::image::Firmware;
use anyhow::anyhow;
use probe_rs::Session;
use probe_rs::flashing::{DownloadOptions, FlashError, FlashProgress, ProgressEvent, ProgressOperation};

pub use chip::Chip;

/// A phase of flashing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Phase {
    /// Sectors are erased.
    Erase,
    /// Pages are written.
    Program,
    /// The contents of the flash are compared with the image.
    Verify,
}

/// The progress of a phase.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// With what.
    pub phase: Phase,
    /// Bytes done.
    pub done_bytes: u64,
    /// Bytes in all.
    pub total_bytes: u64,
}

/// Writes an image to the flash of a connected chip. Sectors that it does not touch stay as they are, those of saved
/// parameters among them. The chip is left halted.
///
/// # Errors
/// If the image does not fit, or the chip or the probe fail.
pub fn download(
    session: &mut Session,
    chip: &Chip,
    firmware: &Firmware<'_>,
    verify: bool,
    mut report: impl FnMut(Progress),
) -> anyhow::Result<()> {
    let loader = chip.loader(firmware)?;
    let mut totals = [0_u64; 3];
    let mut done = [0_u64; 3];
    let mut options = DownloadOptions::default();
    options.verify = verify;
    // It would take what is saved.
    options.do_chip_erase = false;
    options.progress = FlashProgress::new(|event| {
        let operation = match event {
            ProgressEvent::AddProgressBar { operation, total } => {
                if let Some(phase) = phase(operation) {
                    totals[phase as usize] += total.unwrap_or(0);
                }
                return;
            }
            ProgressEvent::Progress { operation, size, .. } => {
                if let Some(phase) = phase(operation) {
                    done[phase as usize] += size;
                }
                operation
            }
            ProgressEvent::Started(operation) | ProgressEvent::Finished(operation) => operation,
            _ => return,
        };
        if let Some(phase) = phase(operation) {
            let (done_bytes, total_bytes) = (done[phase as usize], totals[phase as usize]);
            report(Progress { phase, done_bytes, total_bytes });
        }
    });
    loader.commit(session, options).map_err(|error| match error {
        FlashError::Verify => anyhow!(
            "the flash does not hold the image after writing it: the supply may sag or the flash be worn out; flash again, \
             slower wiring and a shorter cable help"
        ),
        error => anyhow!(error).context(
            "the image could not be written, and what the chip holds now is not complete; check cable and supply, and that \
             the chip is not write-protected, then flash again",
        ),
    })
}

fn phase(operation: ProgressOperation) -> Option<Phase> {
    match operation {
        ProgressOperation::Erase => Some(Phase::Erase),
        ProgressOperation::Program => Some(Phase::Program),
        ProgressOperation::Verify => Some(Phase::Verify),
        // Only with the option to keep bytes of sectors that are partly used.
        ProgressOperation::Fill => None,
    }
}
