//! What a run leaves behind: samples in memory, files in a directory, and recordings of hands.

#[cfg(feature = "command")]
pub mod compare;
pub mod csv;
pub mod derived;
#[cfg(feature = "command")]
pub mod export;
#[cfg(feature = "command")]
pub mod mcap;
#[cfg(feature = "command")]
pub mod replay;
pub mod run_dir;
pub mod sample;
#[cfg(feature = "command")]
pub mod table;
