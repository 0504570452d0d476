//! Any bytes through the receiver and the encoder of the wire.
//!
//! With `cargo install cargo-fuzz`, in the directory `shared`:
//!
//! ```text
//! cargo +nightly fuzz run --sanitizer none receiver -- -max_len=2000 -max_total_time=60
//! ```
//!
//! Without a nightly compiler, `RUSTC_BOOTSTRAP=1 cargo fuzz run ...` does. There is no unsafe code for a sanitizer to
//! watch.
//!
//! What is checked is in `tests/link/property.rs`, and is checked for a bounded number of inputs by `cargo test` too.

#![no_main]

#[path = "../../tests/link/property.rs"]
mod property;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| property::check(bytes));
