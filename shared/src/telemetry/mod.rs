//! Telemetry of the tick: one [`Record`] a tick, and its bytes.
//!
//! - The **encoding** is postcard: fields in their order, without names; counts and numbers as variable-length
//!   integers, `f32` as four bytes. It is positional, so that any change of [`Record`] or of a type in it is another
//!   **interface version**.
//! - Lists carry their run-time count: the bytes of a hand do not depend on the capacity it was built with, and a host
//!   of large capacity reads what a microcontroller of exact size wrote.
//! - With its parameters, the counts and the commands (which the answers repeat), a record has all that a replay needs
//!   to compute everything else again, to the bit.

pub mod burst;
pub mod snapshot;

pub use crate::list::List;
pub use crate::signals::{DecodeError, INTERFACE_VERSION, Record};
