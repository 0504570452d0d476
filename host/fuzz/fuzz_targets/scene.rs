//! Reads any bytes as a scene.

#![no_main]

mod target;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| target::check(target::Reader::Scene, bytes));
