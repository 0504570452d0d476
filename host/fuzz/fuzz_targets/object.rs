//! Reads any bytes as the file of an object.

#![no_main]

mod target;

libfuzzer_sys::fuzz_target!(|bytes: &[u8]| target::check(target::Reader::Object, bytes));
