//! Reads any bytes as an OBJ file.

#![no_main]

mod target;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| target::check(target::Reader::Obj, bytes));
