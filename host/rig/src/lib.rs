//! Test rigs: a firmware in a simulated world ([`pil`]), with a [`twin`] that computes the same; and a hand for those who have
//! none, from the ground up: [`simulated`], device and world, a tick at a time; [`line`](mod@line), the firmware's queues; `pty`,
//! a serial port that is none; `serve`, all of it in real time.

pub mod line;
pub mod pil;
#[cfg(unix)]
pub mod pty;
#[cfg(unix)]
pub mod serve;
pub mod simulated;
pub mod twin;
