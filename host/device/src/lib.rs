//! Firmware on a microcontroller, real or emulated.
//!
//! - [`image`]: what is in an image's file; [`build`]: where an image for processor in the loop comes from;
//!   `flash` (feature `probe`): images onto a chip; [`options`]: its option bytes.
//! - From the ground up: [`interrupt`], whether the user wants an end; [`transport`], bytes to and from; `qemu`, the emulator as a
//!   process; [`client`], messages and answers; [`talk`], a session with a hand whose joints are real; [`recorder`], a recording of it.

pub mod build;
pub mod client;
#[cfg(feature = "probe")]
pub mod flash;
pub mod image;
pub mod interrupt;
pub mod options;
#[cfg(unix)]
pub mod qemu;
pub mod recorder;
pub mod talk;
pub mod transport;
