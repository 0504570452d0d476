//! Firmware on a microcontroller, real or emulated.

pub mod image;
