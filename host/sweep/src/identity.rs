//! The identity of a sweep: what has to be the same for rows of two runs of the program to belong together.

use super::plan::Plan;
use blindgrasp_shared::telemetry::INTERFACE_VERSION;
use serde::{Deserialize, Serialize};
use std::fmt::Debug;

/// The identity of a sweep: what it depends on, in words, and a checksum of each.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Identity(Vec<(String, u64)>);

impl Identity {
    /// Of a plan before it is refined, and of how it will be.
    pub fn of(plan: &Plan, refine: Option<f64>) -> Self {
        let parts: [(&str, &dyn Debug); 7] = [
            ("the program", &program()),
            ("the interface version", &INTERFACE_VERSION),
            ("what is --set", &plan.base_settings()),
            ("what is to --vary", &plan.axes()),
            ("the scene", &plan.contents()),
            ("the number of --seeds", &plan.seeds()),
            ("--refine", &refine),
        ];
        Self(parts.map(|(words, part)| (words.to_owned(), checksum(format!("{part:?}").as_bytes()))).into())
    }

    /// Returns the difference from another one, in words.
    pub(super) fn difference(&self, another: &Self) -> Option<&str> {
        self.0.iter().find(|part| !another.0.contains(part)).map(|(words, _)| words.as_str())
    }
}

/// Version and checksum of the program: another build may compute other bits.
pub(super) fn program() -> String {
    // A program that can't be read is only known by its version.
    let file = std::env::current_exe().and_then(std::fs::read).unwrap_or_default();
    format!("{} {:016x}", env!("CARGO_PKG_VERSION"), checksum(&file))
}

/// A checksum of bytes.
pub(super) fn checksum(bytes: &[u8]) -> u64 {
    crc::Crc::<u64>::new(&crc::CRC_64_XZ).checksum(bytes)
}
