//! Drivers and tasks of the firmware, on the host.

mod board;
mod clear_fault;
mod dac;
mod joints;
mod line;
mod ls7366r;
mod model;
