//! What a run leaves behind: samples in memory, and files in a directory.

pub mod csv;
#[cfg(feature = "command")]
pub mod export;
#[cfg(feature = "command")]
pub mod replay;
pub mod run_dir;
pub mod sample;
