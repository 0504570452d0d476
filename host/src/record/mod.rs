//! What a run leaves behind: samples in memory, and files in a directory.

pub mod csv;
pub mod run_dir;
pub mod sample;
