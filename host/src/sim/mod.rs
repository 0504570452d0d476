//! The closed loop.

pub mod trace;
