//! Reads any bytes as an STL file.

#![no_main]

mod target;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| target::check(target::Reader::Stl, bytes));
