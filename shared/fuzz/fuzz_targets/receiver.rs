//! Any bytes through the receiver and the encoder of the wire.
//!
//! `tests/fuzz` runs it.
//!
//! What is checked is in `tests/link/property.rs`, and is checked for a bounded number of inputs by `cargo test` too.

#![no_main]

#[path = "../../tests/link/property.rs"]
mod property;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| property::check(bytes));
