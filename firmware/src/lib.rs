//! What runs on the microcontroller around the shared tick.
#![cfg_attr(not(test), no_std)]

pub mod joints;
