//! Firmware on a microcontroller, real or emulated.
//!
//! - [`image`]: what is in an image's file; [`build`]: where an image for processor in the loop comes from;
//!   `flash` (feature `probe`): images onto a chip; [`options`]: its option bytes.
//! - Processor in the loop, from the ground up: [`interrupt`], whether the user wants an end; [`transport`], bytes to and
//!   from; `qemu`, the emulator as a process; [`client`], messages and answers; [`twin`], the firmware's double on the host;
//!   [`pil`], a hand in a simulation whose controller is the firmware.
//! - [`talk`]: a session with a hand whose joints are real; [`recorder`]: a recording of it.
//! - A hand for those who have none, from the ground up: [`simulated`], device and world, a tick at a time; [`line`](mod@line), the
//!   firmware's queues; `pty`, a serial port that is none; `serve`, all of it in real time.

pub mod build;
pub mod client;
#[cfg(feature = "probe")]
pub mod flash;
pub mod image;
pub mod interrupt;
pub mod line;
pub mod options;
pub mod pil;
#[cfg(unix)]
pub mod pty;
#[cfg(unix)]
pub mod qemu;
pub mod recorder;
#[cfg(unix)]
pub mod serve;
pub mod simulated;
pub mod talk;
pub mod transport;
pub mod twin;
