//! Reads any bytes as a URDF.

#![no_main]

mod target;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| target::check(target::Reader::Urdf, bytes));
