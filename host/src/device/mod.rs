//! Firmware on a microcontroller, real or emulated.

#[cfg(feature = "probe")]
pub mod flash;
pub mod image;
