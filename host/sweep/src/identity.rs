//! The identity of a sweep: what has to be the same for rows of two runs of the program to belong together.

use super::plan::Plan;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use serde::{Deserialize, Serialize};
use std::sync::OnceLock;

/// The identity of a sweep.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity {
    /// Version of the program, and the checksum of its file: another build may compute other bits.
    program: String,
    /// Version of what firmware and host say to each other.
    interface: u32,
    /// Checksum of what the scene's files say, as far as nothing else has changed it.
    scene: u64,
    /// Checksum of what is set.
    settings: u64,
    /// Checksum of what is varied.
    axes: u64,
    seeds: u32,
    /// Bits of the width to which the point where the grasp fails is found.
    refine: Option<u64>,
}

impl Identity {
    /// Of a plan before it is refined, and of how it will be.
    pub fn of(plan: &Plan, refine: Option<f64>) -> Self {
        let sum = |texts: Vec<String>| texts.iter().fold(0, |sum, text| checksum(sum, text.as_bytes()));
        Self {
            program: program().to_owned(),
            interface: INTERFACE_VERSION.into(),
            scene: sum(plan.contents()),
            settings: sum(plan.base_settings().iter().map(|setting| format!("{setting:?}")).collect()),
            axes: sum(plan.axes().iter().map(|axis| format!("{axis:?}")).collect()),
            seeds: plan.seeds(),
            refine: refine.map(f64::to_bits),
        }
    }

    /// Returns the difference from another one, in words.
    pub(super) fn difference(&self, another: &Self) -> Option<String> {
        if self.program != another.program {
            return Some(format!("the program ({}, now {})", another.program, self.program));
        }
        let differs = [
            (self.interface != another.interface, "the interface version"),
            (self.settings != another.settings, "what is --set"),
            (self.axes != another.axes, "what is to --vary"),
            (self.scene != another.scene, "the scene"),
            (self.seeds != another.seeds, "the number of --seeds"),
            (self.refine != another.refine, "--refine"),
        ];
        differs.into_iter().find(|(differs, _)| *differs).map(|(_, words)| words.to_owned())
    }
}

/// Version and checksum of the program.
pub(super) fn program() -> &'static str {
    static PROGRAM: OnceLock<String> = OnceLock::new();
    PROGRAM.get_or_init(|| {
        // A program that can't be read is only known by its version.
        let file = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
        format!("{} {:016x}", env!("CARGO_PKG_VERSION"), checksum(0, &file))
    })
}

/// A checksum that goes on from another.
pub(super) fn checksum(seed: u64, bytes: &[u8]) -> u64 {
    const CRC: crc::Crc<u64> = crc::Crc::<u64>::new(&crc::CRC_64_XZ);
    let mut digest = CRC.digest();
    digest.update(&seed.to_le_bytes());
    digest.update(bytes);
    digest.finalize()
}
