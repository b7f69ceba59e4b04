#![no_main]

libfuzzer_sys::fuzz_target!(|data: &[u8]| ipman_fuzz::support::run(data));
