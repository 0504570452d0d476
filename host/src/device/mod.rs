//! Firmware on a microcontroller, real or emulated.
//!
//! From the ground up: [`interrupt`], whether the user wants an end; [`transport`], bytes to and from; `qemu`, the
//! emulator as a process; [`client`], messages and answers; [`twin`], the firmware's double on the host; [`pil`], a hand
//! in a simulation whose controller is the firmware; [`build`], where its image comes from.

#[cfg(feature = "command")]
pub mod build;
#[cfg(feature = "command")]
pub mod client;
#[cfg(feature = "command")]
pub mod compare;
#[cfg(feature = "command")]
pub mod interrupt;
#[cfg(feature = "command")]
pub mod pil;
#[cfg(all(feature = "command", unix))]
pub mod qemu;
#[cfg(feature = "command")]
pub mod transport;
#[cfg(feature = "command")]
pub mod twin;
